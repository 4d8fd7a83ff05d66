//! The commands around StarCraft II.

use std::{net::IpAddr, num::NonZeroU64, path::PathBuf};

use clap::{Args, Subcommand, ValueEnum};

use super::{episodes, number, play::PolicyChoice};

/// Play on StarCraft II itself, or let StarCraft's clients play on the built-in simulator
///
/// Two ends of one protocol, the StarCraft II client API. `mackrl train --env sc2 --map 3m` plays on the real game; `mackrl sc2
/// doctor` says whether it is ready. The other way round, `mackrl sc2 install DIR` lays out a folder that SMAC's own client, PyMARL
/// and others take for StarCraft II: with SC2PATH=DIR they run unchanged, on the simulator.
///
/// The game is looked for in $SC2PATH, else in `~/StarCraftII`. It is waited for: 60 s for an answer (`$MACKRL_SC2_PATIENCE_S`), 120 s
/// for a start (`$MACKRL_SC2_START_PATIENCE_S`). After 10 failures of one environment without an episode that ended
/// (`$MACKRL_SC2_FAILURES`) a run gives up.
#[derive(Debug, Args)]
pub(crate) struct Sc2Args {
    #[command(subcommand)]
    pub(crate) command: Sc2Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Sc2Command {
    Doctor(DoctorArgs),
    Ps(PsArgs),
    Kill(KillArgs),
    Record(RecordArgs),
    Install(InstallArgs),
    Serve(ServeArgs),
    #[command(hide = true)]
    ExecGame(ExecGameArgs),
}

/// Check whether StarCraft II can be played on here, and name the command that repairs what is wrong
///
/// Looks for the folder, the version, the program, SMAC's maps and a free port; with --start it also starts the game, makes a map
/// and compares its ground and its units' statistics with the simulator's.
///
/// Example: mackrl sc2 doctor --start --map 2s3z
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// Version to look for, such as 4.10.0 [default: the latest]
    #[arg(long, value_name = "VERSION")]
    pub(crate) game_version: Option<String>,

    /// Start the game, too
    #[arg(long)]
    pub(crate) start: bool,

    /// Map to make when the game is started
    #[arg(long, value_name = "MAP", default_value = "3m")]
    pub(crate) map: String,

    /// Print a JSON array instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// List the games that this program started and that still run
#[derive(Debug, Args)]
pub(crate) struct PsArgs {
    /// Print a JSON array instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Kill the games that this program started, and no others
#[derive(Debug, Args)]
pub(crate) struct KillArgs {
    /// Process to kill, as `mackrl sc2 ps` lists it [default: all of them]
    #[arg(value_name = "PID")]
    pub(crate) pid: Vec<u32>,
}

/// Play a map on StarCraft II and write down every unit in every game loop
///
/// Such a trace settles what the simulator's rules can only guess (see DEVIATIONS.md): where units appear, how they turn, push and
/// reload. The first line holds map, version, policy and ground; each further line one loop.
///
/// Example: mackrl sc2 record --map 3m --policy nearest --episodes 3 --out 3m.jsonl
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// Map to play
    #[arg(long, value_name = "MAP", default_value = "3m")]
    pub(crate) map: String,

    /// How the team plays
    #[arg(long, value_name = "NAME", value_enum, default_value = "nearest")]
    pub(crate) policy: PolicyChoice,

    /// Episodes to play
    #[arg(long, value_name = "N", default_value = "1", value_parser = episodes())]
    pub(crate) episodes: NonZeroU64,

    /// Seed of the episodes
    #[arg(long, value_name = "S", default_value = "1", value_parser = number(0, u64::MAX))]
    pub(crate) seed: u64,

    /// Version of the game, such as 4.10.0 [default: the latest]
    #[arg(long, value_name = "VERSION")]
    pub(crate) game_version: Option<String>,

    /// File to write, one JSON object a line
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

/// Become a game that is killed when the process that wanted it dies
#[derive(Debug, Args)]
pub(crate) struct ExecGameArgs {
    /// The process that wants the game
    #[arg(long, value_name = "PID")]
    pub(crate) parent: u32,

    /// The game's program and its options
    #[arg(last = true, required = true, value_name = "PROGRAM")]
    pub(crate) game: Vec<String>,
}

/// Lay out a folder that clients take for an installation of StarCraft II
///
/// Holds a program that runs `mackrl sc2 serve`, a marker for each of SMAC's maps, and nothing of the game. A real game in the
/// folder is left alone. Clients can play SMAC's 23 maps and nothing else: no `SMACv2`, no feature layers, no bots that build.
///
/// Example: `mackrl sc2 install ~/mackrl-sc2 && SC2PATH=~/mackrl-sc2 python my_smac_script.py`
#[derive(Debug, Args)]
pub(crate) struct InstallArgs {
    /// Folder to lay out; created if missing
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,

    /// Print a JSON object instead of a sentence
    #[arg(long)]
    pub(crate) json: bool,
}

/// Answer the StarCraft II client API from the built-in simulator, for one client at a time
///
/// Plays every SMAC map that a client asks for, with its restart trigger, until a client asks it to quit. Listens on this machine
/// only. Dice follow from the seed of the client's game, or from --seed. What comes after `--` are options as the game has them
/// (-listen, -port, -dataDir, -tempDir, -dataVersion, ...); so started, it ends with its parent.
///
/// Served are SMAC's 23 maps to one client with raw observations; not served are `SMACv2`, feature layers, rendered images, several
/// clients, and bots that build. What is refused is named in the error.
///
/// Example: mackrl sc2 serve --port 5000
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// Address of this machine to listen on
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    pub(crate) listen: IpAddr,

    /// Port to listen on; 0 takes a free one
    #[arg(long, value_name = "N", default_value = "5000")]
    pub(crate) port: u16,

    /// Statistics of the units
    #[arg(long, value_name = "NAME", value_enum, default_value = "lotv")]
    pub(crate) units: UnitsChoice,

    /// Seed of games for which the client names none [default: the number of the process]
    #[arg(long, value_name = "S", value_parser = number(0, u64::MAX))]
    pub(crate) seed: Option<u64>,

    /// Misbehave on purpose, such as rate=0.01,seed=7,late=1.5,kinds=hang+close
    #[arg(long, value_name = "PLAN", hide = true, env = "MACKRL_SC2_FAULTS")]
    pub(crate) fault: Option<String>,

    /// Options as the game has them
    #[arg(last = true, value_name = "GAME OPTIONS")]
    pub(crate) game: Vec<String>,
}

/// Which statistics units have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum UnitsChoice {
    /// Base Wings of Liberty, on whose data SMAC's maps depend by their files
    Liberty,
    /// Legacy of the Void 4.10
    Lotv,
}
