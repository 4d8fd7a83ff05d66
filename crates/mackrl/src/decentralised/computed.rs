//! What an agent does at a step and what the controllers of its groups computed for it, in a form that is quick to compare.

use std::hash::{DefaultHasher, Hash, Hasher};

use mackrl_env::{Action, AgentId};
use serde::{Deserialize, Serialize};

use crate::policy::{ControllerId, ControllerInput, ControllerOutput};

/// Fingerprints of the numbers of some controllers, bit for bit.
pub type Fingerprints = Vec<(ControllerId, u64)>;

/// In what two runs differ for an agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Difference {
    /// In what the agent observes.
    Observation,
    /// In what one of its controllers reads.
    Input,
    /// In the log-probabilities that one of its controllers gives.
    LogProbability,
    /// In its action.
    Action,
    /// One of its controllers is not told of at all.
    Missing,
}

/// What an agent did at one step, and what the controllers of its groups computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Computed {
    pub(super) action: Action,
    pub(super) inputs: Fingerprints,
    pub(super) outputs: Fingerprints,
}

/// How much was compared.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Compared {
    pub(super) actions: u64,
    pub(super) inputs: u64,
    pub(super) outputs: u64,
}

/// A difference, and the controller in which it shows.
pub(super) type Found = (Difference, Option<ControllerId>);

impl Computed {
    /// What concerns `agent` of what all controllers computed.
    pub(super) fn of(
        agent: AgentId,
        action: Action,
        inputs: &[ControllerInput],
        outputs: &[ControllerOutput],
    ) -> Self {
        let own = |controller: &ControllerId| controller.agents.contains(&agent);
        let inputs = inputs.iter().filter(|input| own(&input.controller));
        let outputs = outputs.iter().filter(|output| own(&output.controller));
        Self {
            action,
            inputs: inputs
                .map(|input| (input.controller.clone(), fingerprint(&input.values)))
                .collect(),
            outputs: outputs
                .map(|output| (output.controller.clone(), fingerprint(&output.log_p)))
                .collect(),
        }
    }

    /// What a dead agent does.
    pub(super) const fn without_controllers(action: Action) -> Self {
        Self {
            action,
            inputs: Vec::new(),
            outputs: Vec::new(),
        }
    }

    /// The first difference of `other`, in which every controller of this one has to be: one that was not told of could have read
    /// anything.
    pub(super) fn first_difference(&self, other: &Self, compared: &mut Compared) -> Option<Found> {
        let inputs = first_in(&self.inputs, &other.inputs, &mut compared.inputs);
        let outputs = first_in(&self.outputs, &other.outputs, &mut compared.outputs);
        compared.actions += 1;
        let in_controllers = inputs
            .map(|found| found.named(Difference::Input))
            .or_else(|| outputs.map(|found| found.named(Difference::LogProbability)));
        in_controllers
            .or_else(|| (self.action != other.action).then_some((Difference::Action, None)))
    }
}

/// A controller that is not the same in two lists.
enum Unequal {
    Missing(ControllerId),
    Different(ControllerId),
}

impl Unequal {
    fn named(self, difference: Difference) -> Found {
        match self {
            Self::Missing(controller) => (Difference::Missing, Some(controller)),
            Self::Different(controller) => (difference, Some(controller)),
        }
    }
}

fn first_in(own: &Fingerprints, others: &Fingerprints, compared: &mut u64) -> Option<Unequal> {
    let mut first = None;
    for (controller, fingerprint) in own {
        let found = others.iter().find(|(other, _)| other == controller);
        match found {
            None => {
                first.get_or_insert_with(|| Unequal::Missing(controller.clone()));
            }
            Some((_, other)) => {
                *compared += 1;
                if other != fingerprint {
                    first.get_or_insert_with(|| Unequal::Different(controller.clone()));
                }
            }
        }
    }
    first
}

/// A fingerprint of numbers, bit for bit.
pub(super) fn fingerprint(values: &[f32]) -> u64 {
    let mut hasher = DefaultHasher::new();
    values
        .iter()
        .for_each(|value| value.to_bits().hash(&mut hasher));
    hasher.finish()
}
