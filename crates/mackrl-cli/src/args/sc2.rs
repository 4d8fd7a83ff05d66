//! The commands around StarCraft II.

use std::{net::IpAddr, path::PathBuf};

use clap::{Args, Subcommand, ValueEnum};

/// Play on StarCraft II itself, or let StarCraft's clients play on the built-in simulator
///
/// Two ends of one protocol, the StarCraft II client API. `mackrl train --env sc2 --map 3m` plays on the real game; `mackrl sc2
/// doctor` says whether it is ready. The other way round, `mackrl sc2 install DIR` lays out a folder that SMAC's own client, PyMARL
/// and others take for StarCraft II: with SC2PATH=DIR they run unchanged, on the simulator.
#[derive(Debug, Args)]
pub(crate) struct Sc2Args {
    #[command(subcommand)]
    pub(crate) command: Sc2Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Sc2Command {
    Install(InstallArgs),
    Serve(ServeArgs),
}

/// Lay out a folder that clients take for an installation of StarCraft II
///
/// Holds a program that runs `mackrl sc2 serve`, a marker for each of SMAC's maps, and nothing of the game. A real game in the
/// folder is left alone.
///
/// Example: mackrl sc2 install ~/mackrl-sc2 && SC2PATH=~/mackrl-sc2 python my_smac_script.py
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
    #[arg(long, value_name = "NAME", value_enum, default_value = "liberty")]
    pub(crate) units: UnitsChoice,

    /// Seed of games for which the client names none [default: the number of the process]
    #[arg(long, value_name = "S")]
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
    /// Base Wings of Liberty, on which SMAC's maps depend
    Liberty,
    /// Legacy of the Void 4.10
    Lotv,
}
