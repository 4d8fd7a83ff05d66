//! What `figure5.json` holds.

use mackrl::tabular::{Curve, Learner, Optima, Run, Sweep};
use mackrl_env::matrix_game::{CommonKnowledge, ObservationDistribution, Payoffs};
use mackrl_run::provenance::Provenance;
use serde::{Deserialize, Serialize};

use super::{claims::claims, findings::Findings, options::Figure5Options};
use crate::reproduce::Claim;

/// Figure 5 in numbers.
///
/// All curves have one entry per point, except the published ones, which have their own points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Figure5Report {
    /// Where the numbers come from.
    pub(crate) provenance: Provenance,
    /// Which payoff matrices were played.
    pub(crate) payoffs: Payoffs,
    /// Who saw the matrix how often.
    pub(crate) observation: ObservationDistribution,
    /// What `curves` holds; the other quantity is in `train_curves` or `test_curves`.
    pub(crate) quantity: Quantity,
    /// Runs of each learner at each point.
    pub(crate) runs: usize,
    /// Seed of the initial logits.
    pub(crate) seed: u64,
    /// Repeats these numbers.
    pub(crate) command: String,
    /// Probabilities of common knowledge.
    pub(crate) points: Vec<f64>,
    /// What the figure shows.
    pub(crate) curves: Curves,
    /// Return of the stochastic policies, if the figure shows the greedy ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) train_curves: Option<Curves>,
    /// Return of the nearly greedy policies, if the figure shows the stochastic ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) test_curves: Option<Curves>,
    /// The best that each class of policies can earn, by enumeration.
    pub(crate) optimum: OptimumCurves,
    /// The published figure.
    pub(crate) published: Published,
    /// How often MACKRL's pair controller delegates after training.
    pub(crate) delegation: Delegation,
    /// Verdicts.
    pub(crate) claims: Vec<Claim>,
}

/// Which policy's expected return a curve shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Quantity {
    /// The learned policy's.
    Train,
    /// The nearly greedy policy's, all logits times 100.
    Test,
}

/// A curve for each learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Curves {
    /// Independent actor-critic.
    pub(crate) iac: Curve,
    /// Joint-action learning.
    pub(crate) jal: Curve,
    /// MACKRL.
    pub(crate) mackrl: Curve,
}

/// Best returns of each class of policies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OptimumCurves {
    /// Each agent on its own observation.
    pub(crate) decentralised: Vec<f64>,
    /// Each agent on its own observation, not knowing whether it is common knowledge.
    pub(crate) decentralised_without_bit: Vec<f64>,
    /// One controller on common knowledge.
    pub(crate) jal: Vec<f64>,
    /// A joint action on common knowledge, or delegation.
    pub(crate) mackrl: Vec<f64>,
    /// One controller on both observations.
    pub(crate) joint_observation: Vec<f64>,
    /// One controller on the truth.
    pub(crate) oracle: Vec<f64>,
}

/// A published figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Published {
    /// Where it stands and how exactly it was read.
    pub(crate) source: String,
    /// Its year.
    pub(crate) label: String,
    /// What it shows.
    pub(crate) quantity: Quantity,
    /// Probabilities of common knowledge.
    pub(crate) points: Vec<f64>,
    /// Independent actor-critic.
    pub(crate) iac: Vec<f64>,
    /// Joint-action learning on common knowledge.
    pub(crate) jal: Vec<f64>,
    /// MACKRL.
    pub(crate) mackrl: Vec<f64>,
}

/// Probability of delegation in each state of common knowledge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Delegation {
    /// The bit is off.
    pub(crate) nothing: StateDelegation,
    /// The bit is on and the matrix is A.
    pub(crate) matrix_a: StateDelegation,
    /// The bit is on and the matrix is B.
    pub(crate) matrix_b: StateDelegation,
    /// Share of runs that delegate with probability above 1/2 when the bit is off and below 1/2 when it is on, in the states
    /// that occur.
    pub(crate) runs_as_described: Vec<f64>,
}

/// Probability of delegation in one state; `None` at points where the state never occurs, so that nothing is learned in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StateDelegation {
    /// Mean over runs.
    pub(crate) mean: Vec<Option<f64>>,
    /// Standard error of the mean.
    pub(crate) sem: Vec<Option<f64>>,
}

impl Quantity {
    /// This quantity of one run.
    pub(super) const fn of(self, run: &Run) -> f64 {
        match self {
            Self::Train => run.train,
            Self::Test => run.test,
        }
    }
}

impl Figure5Report {
    pub(super) fn new(options: &Figure5Options, findings: Findings<'_>) -> Self {
        let quantity = findings.published.quantity;
        let curves = |quantity| Curves::measured(findings.sweep, quantity);
        Self {
            provenance: options.provenance(),
            payoffs: options.payoffs.into(),
            observation: options.observation.into(),
            quantity,
            runs: options.runs,
            seed: options.seed,
            command: options.command(),
            points: findings.points.to_vec(),
            curves: curves(quantity),
            train_curves: (quantity != Quantity::Train).then(|| curves(Quantity::Train)),
            test_curves: (quantity != Quantity::Test).then(|| curves(Quantity::Test)),
            optimum: OptimumCurves::from(findings.optima),
            claims: claims(&findings),
            published: findings.published,
            delegation: findings.delegation,
        }
    }
}

impl Curves {
    fn measured(sweep: &Sweep, quantity: Quantity) -> Self {
        let curve = |learner| sweep.curve(learner, |run| quantity.of(run));
        Self {
            iac: curve(Learner::Iac),
            jal: curve(Learner::Jal),
            mackrl: curve(Learner::Mackrl),
        }
    }
}

impl From<&[Optima]> for OptimumCurves {
    fn from(optima: &[Optima]) -> Self {
        let curve = |of: fn(&Optima) -> f64| optima.iter().map(of).collect();
        Self {
            decentralised: curve(|best| best.decentralised),
            decentralised_without_bit: curve(|best| best.decentralised_without_bit),
            jal: curve(|best| best.jal),
            mackrl: curve(|best| best.mackrl),
            joint_observation: curve(|best| best.joint_observation),
            oracle: curve(|best| best.oracle),
        }
    }
}

impl Published {
    /// The curve of `learner`.
    pub(super) fn curve(&self, learner: Learner) -> &[f64] {
        match learner {
            Learner::Iac => &self.iac,
            Learner::Jal => &self.jal,
            Learner::Mackrl => &self.mackrl,
        }
    }

    /// The mean of `learner` at probability `p`, if that point was published.
    pub(super) fn at(&self, learner: Learner, p: f64) -> Option<f64> {
        let same = |point: &f64| (point - p).abs() < 1e-9;
        Some(self.curve(learner)[self.points.iter().position(same)?])
    }
}

impl Delegation {
    pub(super) fn measured(
        sweep: &Sweep,
        distribution: ObservationDistribution,
        points: &[f64],
    ) -> Self {
        let occurs = |state: CommonKnowledge, p: f64| match state {
            CommonKnowledge::Nothing => distribution.probability_of_bit(p) < 1.0,
            CommonKnowledge::MatrixA | CommonKnowledge::MatrixB => p > 0.0,
        };
        let as_described = |run: &Run, p: f64| {
            CommonKnowledge::ALL.into_iter().all(|state| {
                let delegates = run.delegation[state.index()] > 0.5;
                !occurs(state, p) || delegates == (state == CommonKnowledge::Nothing)
            })
        };
        let share = |(point, &p): (usize, &f64)| {
            let runs = sweep.runs(Learner::Mackrl, point);
            let count = runs.iter().filter(|run| as_described(run, p)).count();
            count as f64 / runs.len() as f64
        };
        let state = |state: CommonKnowledge| {
            let curve = sweep.curve(Learner::Mackrl, |run| run.delegation[state.index()]);
            let known = |values: Vec<f64>| {
                (values.into_iter().zip(points))
                    .map(|(value, &p)| occurs(state, p).then_some(value))
                    .collect()
            };
            StateDelegation {
                mean: known(curve.mean),
                sem: known(curve.sem),
            }
        };
        Self {
            nothing: state(CommonKnowledge::Nothing),
            matrix_a: state(CommonKnowledge::MatrixA),
            matrix_b: state(CommonKnowledge::MatrixB),
            runs_as_described: points.iter().enumerate().map(share).collect(),
        }
    }
}
