//! The commands that look into replays.

use std::path::PathBuf;

use clap::Args;

use crate::args::{MOST, size};

/// Look into a replay: a page for the browser, a picture of a step, a film
///
/// Plays the episode again and compares every state with the recording; what is shown is what happened. Without an output it
/// says how the episode went. `mackrl play --save-replay` and `mackrl evaluate --save-replays` write replays.
///
/// --html writes one page that needs no network: the battle with fields of view, the pairs that were formed, whether each acted
/// jointly or delegated and with what probability, and for every group that is clicked what is common knowledge, what is not, and
/// why.
///
/// Examples: mackrl replay battle.replay.gz --html battle.html; mackrl replay battle.replay.gz --svg battle.svg --step 12 --group A,B; mackrl
/// replay battle.replay.gz --gif battle.gif --group A,B
#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    /// Replay to look into
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Write a page for any browser
    #[arg(long, value_name = "OUT")]
    pub(crate) html: Option<PathBuf>,

    /// Draw one step as an SVG picture
    #[arg(long, value_name = "OUT")]
    pub(crate) svg: Option<PathBuf>,

    /// Draw the whole battle as an animated GIF of eight seconds; long battles take longer
    #[arg(long, value_name = "OUT")]
    pub(crate) gif: Option<PathBuf>,

    /// Decision that is drawn or shown first: 0 is the first, as in `explain` [default: half of the episode; 0 in pages]
    #[arg(long, value_name = "T", value_parser = size(0, MOST))]
    pub(crate) step: Option<usize>,

    /// Agents whose common knowledge is drawn, such as A,B or 0,1
    #[arg(long, value_name = "AGENTS", value_delimiter = ',')]
    pub(crate) group: Vec<String>,

    /// Print JSON instead of a sentence
    #[arg(long)]
    pub(crate) json: bool,
}

/// Say in words what each agent and each pair knew at one step of a replay, and what the controllers made of it
///
/// Prints what each agent sees, the common knowledge of every pair and why it is no more, the most probable entries of every
/// controller's table, the choices that were made with their probabilities, the probability of the joint action over all ways
/// (eq. 5 of the paper) and, given that joint action, the posterior of every partition. What is less probable than 0.001 and was
/// not taken is summed up.
///
/// Examples: mackrl explain battle.replay.gz --step 12; mackrl explain battle.replay.gz --step 12 --group A,B
#[derive(Debug, Args)]
pub(crate) struct ExplainArgs {
    /// Replay to explain
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Step to explain: 0 is the first decision
    #[arg(long, value_name = "T", value_parser = size(0, MOST))]
    pub(crate) step: usize,

    /// Say only what concerns groups of which all members are among these agents, such as A,B or 0,1
    #[arg(
        long,
        value_name = "AGENTS",
        value_delimiter = ',',
        conflicts_with = "agent"
    )]
    pub(crate) group: Vec<String>,

    /// Say only what concerns this agent and the groups that it is in, such as A or 0
    #[arg(long, value_name = "AGENT")]
    pub(crate) agent: Option<String>,

    /// Print a JSON object instead of text
    #[arg(long)]
    pub(crate) json: bool,
}
