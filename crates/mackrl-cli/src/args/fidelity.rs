//! The command that compares the simulator with the real game.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;

use crate::args::{EPISODES_MOST, count_to, runs::ThreadsArgs};

/// Compare the simulator with recorded runs of the real StarCraft II, quantity by quantity
///
/// Training logs of hundreds of runs on the real game are public. Their first episodes are random
/// play, and the first tests of an untrained network repeat one action; this command plays the same
/// policies in the simulator and sets every quantity beside the recorded one, with its tolerance.
/// Policies: `random`; `stop`, which stands and never shoots; `attack-K`, which attacks enemy K
/// whenever it can and stands otherwise.
///
/// Rows belong to numbered checks, and a check passes if all of its rows do. Rows about trained
/// teams are not played here: they are printed as open, and neither pass nor fail. Rules were
/// chosen by the rows marked `fitted`; the others test them.
///
/// Exit code: 0 if every row that was played passes, 1 if one does not. All numbers follow from
/// --set and --episodes alone; the number of threads changes none.
///
/// Examples: mackrl fidelity; mackrl fidelity --map 25m --episodes 300; mackrl fidelity --set env.units=lotv --json;
/// mackrl fidelity --html fidelity.html; mackrl fidelity --markdown docs/fidelity.md
#[derive(Debug, Args)]
pub(crate) struct FidelityArgs {
    /// Only the rows of this map [default: all]
    #[arg(long, value_name = "MAP")]
    pub(crate) map: Option<String>,

    /// Episodes of each policy on each map
    #[arg(long, value_name = "N", default_value = "1000", value_parser = count_to(EPISODES_MOST))]
    pub(crate) episodes: NonZeroUsize,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// One setting of the game, such as `env.units=lotv`; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,

    /// Print JSON instead of a table: {"checks": [{"name", "map", "policy", "quantity", "real", "error", "tolerance", "ours", "pass", "source", ...}], ...}
    #[arg(long)]
    pub(crate) json: bool,

    /// Write the table and the distributions with their plots into this file too, as one page
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,

    /// Write them as Markdown into this file too, with plots in a file of the same name ending in .svg; docs/fidelity.md was made so
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
}

impl FidelityArgs {
    /// The command that gives the same numbers.
    pub(crate) fn command(&self) -> String {
        let map = self.map.iter().map(|map| format!(" --map {map}"));
        let settings = self.set.iter().map(|setting| format!(" --set {setting}"));
        format!(
            "mackrl fidelity --episodes {}{}",
            self.episodes,
            map.chain(settings).collect::<String>()
        )
    }
}
