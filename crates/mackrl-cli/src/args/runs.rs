//! The commands that make a run or use one.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;
use mackrl_run::run_folder::WhichWeights;

use crate::args::{ConfigurationArgs, EPISODES_MOST, MOST, count_to, number, side_by_side, size};

/// Train a team, and write its weights, metrics and configuration into a run folder
///
/// The folder holds config.toml (everything that determines the result), metrics.jsonl (one JSON object a line),
/// weights.safetensors (the last, readable from PyTorch), weights/ (those that did best in a test, and more with
/// `run.weights_interval_steps_env`), checkpoints/ (from which an interrupted run goes on) and run.json (command, version, status,
/// how the last and the best weights play). A folder that holds a run is never overwritten. The number of threads changes the
/// speed and nothing else.
///
/// At the end the last weights and the best play battles that neither training nor tests have seen; what they win is what
/// `mackrl evaluate` says of them.
///
/// SIGINT (Ctrl-C), SIGTERM and SIGUSR1 write a checkpoint and stop with exit code 75; a second SIGINT stops at once.
///
/// --from copies the weights into initial.safetensors and their hash into the configuration. Everything else begins anew: steps,
/// exploration, optimisers. Sizes of map and networks have to be the same.
///
/// Examples: mackrl train --map 3m --algorithm mackrl --preset paper --seed 1;
/// mackrl train --from runs/3m-mackrl-ppo-seed1 --checkpoint best --map my.toml --steps 1e6 --out runs/mine
#[derive(Debug, Args)]
pub(crate) struct TrainArgs {
    #[command(flatten)]
    pub(crate) configuration: ConfigurationArgs,

    /// Run folder to create [default: runs/MAP-ALGORITHM-seedSEED]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,

    /// Begin with the weights of this run, and with its configuration in place of a preset; the other flags are laid over it
    #[arg(long, value_name = "RUN")]
    pub(crate) from: Option<PathBuf>,

    /// Weights of that run to begin with: last, best, or a number of steps at which it kept some
    #[arg(long, value_name = "WHICH", requires = "from", default_value_t)]
    pub(crate) checkpoint: WhichWeights,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON summary at the end instead of a sentence
    #[arg(long)]
    pub(crate) json: bool,
}

/// Continue an interrupted run, to the byte as if it had never stopped, or make a run longer
///
/// Starts at the latest intact checkpoint, whatever stopped the run: a signal, a kill, a full disk, a loss of power. Weights,
/// checkpoints and metrics (those under sys/ aside) become those of an uninterrupted run, on any number of threads.
///
/// --steps N makes a run longer than it was planned, finished or not. What it learns is what a run of N steps learns from its
/// beginning, to the byte, because no schedule depends on how long a run is planned: exploration, learning rates and weights of
/// entropy have lengths of their own, such as `algorithm.schedule_steps_env`. It goes on from the latest checkpoint before its former
/// end, since the test at that end is none of the longer run. run.json keeps the former plan.
///
/// Examples: mackrl resume runs/3m-mackrl-ppo-seed1; mackrl resume runs/3m-mackrl-ppo-seed1 --steps 2e6
#[derive(Debug, Args)]
pub(crate) struct ResumeArgs {
    /// Run folder that `mackrl train` wrote
    #[arg(value_name = "DIR")]
    pub(crate) run: PathBuf,

    /// Go on to this number of environment steps, more than were planned
    #[arg(long, value_name = "N", value_parser = number(1, MOST))]
    pub(crate) steps: Option<u64>,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON summary at the end instead of a sentence
    #[arg(long)]
    pub(crate) json: bool,

    /// Stop as after a signal when stdin ends: the process that holds its other end has ended, however that came
    #[arg(long, hide = true)]
    pub(crate) leashed: bool,
}

/// Play greedy episodes with a trained team and report how it does
///
/// Says first how often it wins, then prints mean and standard error of what else the world counts, and what the controllers did.
/// Without --checkpoint the last weights play; if those that did best in a test are better by more than chance, that is said.
/// --save-replays keeps some of the episodes, with all that the controllers computed; `mackrl replay` and `mackrl explain` show them.
///
/// Examples: mackrl evaluate runs/3m-mackrl-ppo-seed1 --save-replays 3; mackrl evaluate runs/3m-mackrl-ppo-seed1 --checkpoint best --json;
/// mackrl evaluate runs/3m-mackrl-ppo-seed1 --map my.toml --episodes-out episodes.csv
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// Run folder that `mackrl train` wrote
    #[arg(value_name = "DIR")]
    pub(crate) run: PathBuf,

    #[command(flatten)]
    pub(crate) weights: WeightsArgs,

    /// Episodes to play
    #[arg(long, value_name = "N", default_value = "320", value_parser = count_to(EPISODES_MOST))]
    pub(crate) episodes: NonZeroUsize,

    /// Seed of the episodes [default: the run's own]
    #[arg(long, value_name = "S", value_parser = number(0, u64::MAX))]
    pub(crate) seed: Option<u64>,

    /// Play on this map, as `mackrl maps` lists it, or scenario file; its sizes have to be those of the map of training, and all
    /// other settings stay [default: the map of training]
    #[arg(long, value_name = "MAP")]
    pub(crate) map: Option<String>,

    /// Write a row for each episode into this file: as JSON lines if it ends in .jsonl, as CSV if it ends in .csv
    #[arg(long, value_name = "FILE")]
    pub(crate) episodes_out: Option<PathBuf>,

    /// Keep the first N of the episodes as DIR/replays/seedS-episodeI.replay.gz, after the name of weights that are not the last
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true, value_parser = size(0, MOST))]
    pub(crate) save_replays: usize,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Prove that a trained team runs decentralised
///
/// Starts one process per agent, gives each only its own local views, its number, the weights and the key of its choices, and
/// compares every action, every input of a controller and every log-probability with the central run, bit for bit: sampled and
/// greedy, for whole episodes. On Linux the system ends a process that tries to reach anything else. Then repeats the
/// central run in worlds in which everything that an agent does not see is replaced by noise, alters the world's state beyond
/// its sight, and draws from another key; what is computed for the agent has to stay the same. Says what was certified in its
/// first sentence, and what was not. Exit code 1 and the first counter-example if anything differs.
///
/// Example: mackrl certify runs/3m-mackrl-ppo-seed1 --episodes 100 --html certificate.html
#[derive(Debug, Args)]
pub(crate) struct CertifyArgs {
    /// Run folder that `mackrl train` wrote
    #[arg(value_name = "DIR")]
    pub(crate) run: PathBuf,

    #[command(flatten)]
    pub(crate) weights: WeightsArgs,

    /// Episodes to compare in each mode, sampled and greedy
    #[arg(long, value_name = "N", default_value = "100", value_parser = count_to(EPISODES_MOST))]
    pub(crate) episodes: NonZeroUsize,

    /// Seed of the episodes [default: the run's own]
    #[arg(long, value_name = "S", value_parser = number(0, u64::MAX))]
    pub(crate) seed: Option<u64>,

    /// Write the certificate into this file too, as one page
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Which weights of a run are used.
#[derive(Debug, Args)]
pub(crate) struct WeightsArgs {
    /// Weights to use: last, best (in the tests of training), or a number of steps N at which the run kept some, as
    /// `run.weights_interval_steps_env` asks for
    #[arg(long, value_name = "WHICH", default_value_t)]
    pub(crate) checkpoint: WhichWeights,
}

#[derive(Debug, Args)]
pub(crate) struct ThreadsArgs {
    /// Threads to use; changes no result [default: all cores]
    #[arg(long, value_name = "K", value_parser = side_by_side)]
    threads: Option<NonZeroUsize>,
}

impl ThreadsArgs {
    /// The number asked for, or one for each core.
    pub(crate) fn count(&self) -> usize {
        self.threads
            .or_else(|| std::thread::available_parallelism().ok())
            .map_or(1, NonZeroUsize::get)
    }
}

#[cfg(test)]
mod tests {
    use clap::{FromArgMatches, Parser};

    use super::*;

    #[derive(Debug, Parser)]
    struct Typed<T: Args + FromArgMatches> {
        #[command(flatten)]
        args: T,
    }

    fn typed<T: Args>(line: &str) -> T {
        Typed::<T>::try_parse_from(line.split_whitespace())
            .unwrap()
            .args
    }

    #[test]
    fn flags_of_training_reach_the_configuration() {
        let args: TrainArgs = typed(
            "train --map 2s3z --algorithm central-v --preset paper --steps 9 --seed 4 --threads 3 --out x --set algorithm.gamma=0.5",
        );
        let config = args.configuration.layers().unwrap().build().unwrap();
        assert_eq!(config.env.map(), "2s3z");
        assert_eq!(config.algorithm.name(), "central-v");
        assert_eq!((config.run.steps_env, config.run.seed), (9, 4));
        assert_eq!(config.get("algorithm.gamma"), Some(0.5.into()));
        assert_eq!(args.threads.count(), 3);
        assert_eq!(args.out, Some(PathBuf::from("x")));
    }

    #[test]
    fn evaluation_and_certificate_have_the_usual_lengths() {
        assert_eq!(typed::<EvaluateArgs>("evaluate x").episodes.get(), 320);
        assert_eq!(typed::<CertifyArgs>("certify x").episodes.get(), 100);
    }

    #[test]
    fn weights_are_the_last_unless_others_are_asked_for() {
        let which = |line| typed::<EvaluateArgs>(line).weights.checkpoint;
        assert_eq!(which("evaluate x"), WhichWeights::Last);
        assert_eq!(which("evaluate x --checkpoint best"), WhichWeights::Best);
        let certify: CertifyArgs = typed("certify x --checkpoint 50000");
        assert_eq!(certify.weights.checkpoint, WhichWeights::Step(50_000));
        let line = ["evaluate", "x", "--checkpoint", "bets"];
        assert!(Typed::<EvaluateArgs>::try_parse_from(line).is_err());
    }

    #[test]
    fn no_episodes_are_a_usage_error() {
        let line = ["evaluate", "x", "--episodes", "0"];
        assert!(Typed::<EvaluateArgs>::try_parse_from(line).is_err());
    }
}
