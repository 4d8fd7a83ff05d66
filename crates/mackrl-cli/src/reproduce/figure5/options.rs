//! What `mackrl reproduce figure5` can be asked for.

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, thread};

use clap::{Args, ValueEnum};
use mackrl_env::matrix_game::{MatrixGameKind, ObservationDistribution, Payoffs};
use mackrl_run::{
    config::EnvironmentConfig,
    provenance::{Choice, Judgement, Provenance},
};

use crate::args::{number, side_by_side, size};

/// Reproduce Figure 5: MACKRL, independent learners and a joint learner on the matrix game.
///
/// Two agents play one of two payoff matrices once. With probability p, the horizontal axis, a bit makes the matrix common
/// knowledge; otherwise each agent sees it by its own luck. All three learners climb the exact gradient of the exact expected
/// return, so nothing is sampled but the initial logits.
///
/// Writes figure5.svg, figure5.png and figure5.json, prints the curves beside the published ones and the exact optima, and
/// judges every claim of the paper: holds or does not, with the numbers.
#[derive(Debug, Clone, Args)]
pub(crate) struct Figure5Options {
    /// Folder for the three files; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "runs/figure5")]
    pub(crate) out: PathBuf,

    /// Which payoff matrices to play.
    #[arg(long, value_enum, default_value_t = PayoffsOption::Coded)]
    pub(crate) payoffs: PayoffsOption,

    /// Who sees the matrix how often when it is not common knowledge.
    #[arg(long, value_enum, default_value_t = ObservationOption::Y2018)]
    pub(crate) observation: ObservationOption,

    /// Independent runs of each learner at each of the 11 points, 2 to 1000000. Standard errors shrink with its square root.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 100,
        value_parser = size(2, 1_000_000)
    )]
    pub(crate) runs: usize,

    /// Seed of the initial logits. The same seed gives the same files, byte for byte.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = number(0, u64::MAX))]
    pub(crate) seed: u64,

    /// Threads to use; the result does not depend on it. [default: one for each processor]
    #[arg(long, value_name = "K", value_parser = side_by_side)]
    pub(crate) threads: Option<NonZeroUsize>,

    /// Print the report as JSON, as in figure5.json, instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Which payoff matrices to play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PayoffsOption {
    /// As in the published code: one of the two best cells of each printed matrix is worth 0. The published figure was made
    /// with these.
    Coded,
    /// As printed in the paper.
    Printed,
}

/// Who sees the matrix how often.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ObservationOption {
    /// As in the 2018 paper: without common knowledge, each agent sees the matrix with probability 1/2.
    #[value(name = "2018")]
    Y2018,
    /// As at NeurIPS 2019: each agent sees the matrix with probability 3/4 at every p, so only knowing that the other knows
    /// changes with p. The curves are those of the greedy policies, as published then.
    Neurips,
}

impl Figure5Options {
    /// Threads that were asked for, or one for each processor.
    #[must_use]
    pub(crate) fn threads(&self) -> NonZeroUsize {
        let processors = || thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.threads.unwrap_or_else(processors)
    }

    /// The command that repeats this result, whatever the folder and the number of threads.
    #[must_use]
    pub(crate) fn command(&self) -> String {
        format!(
            "mackrl reproduce figure5 --payoffs {} --observation {} --runs {} --seed {}",
            name(self.payoffs),
            name(self.observation),
            self.runs,
            self.seed
        )
    }

    /// Where a report comes from. Its configuration is the command without the seed.
    #[must_use]
    pub(crate) fn provenance(&self) -> Provenance {
        let mut env = EnvironmentConfig::new(Arc::new(MatrixGameKind));
        for (name, word) in [
            ("payoffs", Payoffs::from(self.payoffs).word()),
            (
                "distribution",
                ObservationDistribution::from(self.observation).word(),
            ),
        ] {
            env.set(name, word).expect("a word that the game takes");
        }
        let command = self.command();
        let settings = command.rsplit_once(" --seed ").map_or("", |(rest, _)| rest);
        let judgement = Judgement {
            actions: Choice::Expected,
            episodes: 0,
        };
        Provenance::new(&env, settings, vec![self.seed], judgement)
    }
}

/// How a choice is spelt on the command line.
fn name(choice: impl ValueEnum) -> String {
    let value = choice
        .to_possible_value()
        .expect("no choice is hidden from users");
    value.get_name().to_owned()
}

impl From<PayoffsOption> for Payoffs {
    fn from(option: PayoffsOption) -> Self {
        match option {
            PayoffsOption::Coded => Self::Coded,
            PayoffsOption::Printed => Self::Printed,
        }
    }
}

impl From<ObservationOption> for ObservationDistribution {
    fn from(option: ObservationOption) -> Self {
        match option {
            ObservationOption::Y2018 => Self::Y2018,
            ObservationOption::Neurips => Self::NeurIps2019,
        }
    }
}
