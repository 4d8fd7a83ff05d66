//! The commands that measure speed.

use std::num::{NonZeroU64, NonZeroUsize};

use clap::{Args, Subcommand};

use crate::args::{ConfigurationArgs, count_to, episodes, runs::ThreadsArgs};

/// Measure how fast this machine is
///
/// Other work on the machine can only make these numbers worse: measure in a quiet moment, more than once, and believe the
/// best. `benchmarks/` holds measured numbers with their conditions.
#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) command: BenchCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    Env(BenchEnvironmentArgs),
    Update(BenchUpdateArgs),
    Train(BenchTrainArgs),
}

/// Environment steps a second, with random available actions
///
/// Every step fills observations, state and action masks; nothing is learnt. With several threads, each plays its own
/// environment. The best of five equal parts is reported too, because other work on the machine can only slow a part down.
///
/// The JSON object has `map`, `threads`, `steps`, `episodes`, `wall_s`, `env_steps_per_s` and `env_steps_per_s_best_part`.
/// `benchmarks/simulator.sh` measures five maps on one thread and on two.
///
/// Example: mackrl bench env --map 3m --steps 500000 --json
#[derive(Debug, Args)]
pub(crate) struct BenchEnvironmentArgs {
    /// Map to play, as `mackrl maps` lists it, or a scenario file ending in .toml
    #[arg(long, value_name = "NAME", default_value = "3m")]
    pub(crate) map: String,

    /// Environment steps to play, summed over threads
    #[arg(long, value_name = "N", default_value = "100000", value_parser = episodes())]
    pub(crate) steps: NonZeroU64,

    /// Threads, each with an environment of its own
    #[arg(long, value_name = "K", default_value = "1", value_parser = count_to(1024))]
    pub(crate) threads: NonZeroUsize,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Milliseconds that one update of the pair controllers takes, on one thread
///
/// Forward and backward pass of a recurrent network 128 → 64 → GRU 64 → 122 with a masked softmax over whole episodes,
/// clipping and Adam, on made-up data. `benchmarks/peers/compare.py` times the same update in PyTorch and in JAX.
///
/// Example: mackrl bench update --rows 80 --steps 60 --json
#[derive(Debug, Args)]
pub(crate) struct BenchUpdateArgs {
    /// Rows of the batch: pairs times environments
    #[arg(long, value_name = "B", default_value = "80", value_parser = count_to(10_000))]
    pub(crate) rows: NonZeroUsize,

    /// Steps of the episodes
    #[arg(long, value_name = "T", default_value = "60", value_parser = count_to(10_000))]
    pub(crate) steps: NonZeroUsize,

    /// Updates to time
    #[arg(long, value_name = "N", default_value = "100", value_parser = count_to(1_000_000))]
    pub(crate) updates: NonZeroUsize,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Environment steps a second in training, and where the time goes
///
/// Trains as `mackrl train` does, everything included (simulation, acting, learning, greedy tests), and writes no run folder.
/// Shares are of wall-clock time; while several threads play, it is divided in the proportions of what they do. --steps is
/// 100000 unless given.
///
/// Example: mackrl bench train --map 2s3z --preset paper --json
#[derive(Debug, Args)]
pub(crate) struct BenchTrainArgs {
    #[command(flatten)]
    pub(crate) configuration: ConfigurationArgs,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}
