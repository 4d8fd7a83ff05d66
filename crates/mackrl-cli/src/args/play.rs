//! The command that plays with scripted teams.

use std::{
    num::NonZeroU64,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use mackrl_skirmish::scripted::ScriptedPolicy;

use crate::args::{MOST, episodes, number, runs::ThreadsArgs, size};

/// Play with a scripted team, and report or keep what happens
///
/// Prints the mean and the standard error of battles won, return, episode length, and allies and enemies lost. Scripted agents
/// decide from their own local views, as trained ones do. The number of threads changes the speed and nothing else.
///
/// --out keeps them in a folder, as JSON and as a page with tables of maps by policies; results/scripted was made so.
///
/// --save-replay keeps the first episode: the map, the settings, the seed, every action and a hash of the state after every
/// step. `mackrl replay` shows it as a page or a picture. --svg draws one step of it at once.
///
/// Examples: mackrl play --map 2s3z --policy focus-fire --episodes 1000 --json; mackrl play --map all --policy all --episodes 1000
/// --out results/scripted; mackrl play --map ./my.toml --policy kite --save-replay battle.replay.gz; mackrl play --map 2s3z --policy
/// nearest --svg battle.svg --step 20
#[derive(Debug, Args)]
pub(crate) struct PlayArgs {
    /// Map to play, as `mackrl maps` lists it, a scenario file ending in .toml, or `all`
    #[arg(long, value_name = "MAP", default_value = "3m")]
    pub(crate) map: String,

    /// What plays the battles: skirmish, the built-in simulator, or sc2 for StarCraft II on this machine, whose own replay --save-replay writes
    #[arg(long, value_name = "NAME", default_value = "skirmish")]
    pub(crate) env: String,

    /// How the team plays
    #[arg(long, value_name = "NAME", value_enum, default_value = "focus-fire")]
    pub(crate) policy: PolicyChoice,

    /// Episodes to play
    #[arg(long, value_name = "N", default_value = "100", value_parser = episodes())]
    pub(crate) episodes: NonZeroU64,

    /// Seed from which all randomness follows
    #[arg(long, value_name = "S", default_value = "1", value_parser = number(0, u64::MAX))]
    pub(crate) seed: u64,

    /// One setting of the game, such as `env.sight_range=7`; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print JSON instead of a table
    #[arg(long)]
    pub(crate) json: bool,

    /// Write scripted.json and README.md into this folder too; made if it is not there
    #[arg(long, value_name = "DIR", conflicts_with = "save_replay")]
    pub(crate) out: Option<PathBuf>,

    /// Play the first episode alone, and write it to this file as a replay
    #[arg(long, value_name = "FILE", conflicts_with = "episodes")]
    pub(crate) save_replay: Option<PathBuf>,

    /// Play the first episode alone, and draw one of its steps into this file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["episodes", "out"])]
    pub(crate) svg: Option<PathBuf>,

    /// Step that --svg draws, counted from 0, the start [default: half of the episode]
    #[arg(long, value_name = "T", requires = "svg", value_parser = size(0, MOST))]
    pub(crate) step: Option<usize>,
}

impl PlayArgs {
    /// The command that writes the same report into `folder`.
    pub(crate) fn command(&self, folder: &Path) -> String {
        let policy = self.policy.to_possible_value();
        let policy = policy.map_or_else(String::new, |value| value.get_name().to_owned());
        let settings = self.set.iter().map(|setting| format!(" --set {setting}"));
        format!(
            "mackrl play --map {} --policy {policy} --episodes {} --seed {}{} --out {}",
            self.map,
            self.episodes,
            self.seed,
            settings.collect::<String>(),
            folder.display()
        )
    }
}

/// A scripted policy, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PolicyChoice {
    /// Any available action, all equally likely
    Random,
    /// Stands and never shoots
    Idle,
    /// Shoots at the nearest enemy
    Nearest,
    /// Shoots at the weakest enemy in range
    FocusFire,
    /// Backs off while its weapon reloads
    Kite,
    /// One after the other
    All,
}

impl PolicyChoice {
    /// What was chosen.
    pub(crate) fn policies(self) -> Vec<ScriptedPolicy> {
        vec![match self {
            Self::Random => ScriptedPolicy::Random,
            Self::Idle => ScriptedPolicy::Idle,
            Self::Nearest => ScriptedPolicy::Nearest,
            Self::FocusFire => ScriptedPolicy::FocusFire,
            Self::Kite => ScriptedPolicy::Kite,
            Self::All => return ScriptedPolicy::ALL.to_vec(),
        }]
    }
}
