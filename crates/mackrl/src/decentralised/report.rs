//! What a certificate says: what was compared, what was found, and what that proves.

use mackrl_env::{Action, AgentId};
use serde::{Deserialize, Serialize};

use super::computed::{Compared, Difference, Found};
use crate::policy::{ControllerId, Mode};

/// Which check found a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// An agent on its own does or computes something else than the central run.
    SeparateAgents,
    /// What is computed for an agent in the central run depends on what it does not see.
    AlteredWorlds,
    /// An agent on its own computes something else when what it does not see is no number.
    UnseenNumbers,
    /// What an agent observes depends on the part of the world's state that it does not see.
    AlteredStates,
    /// What controllers compute depends on the key from which choices are drawn.
    OtherKey,
}

/// What keeps the agents from reaching anything but the messages to them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Isolation {
    /// They run in the process that certifies.
    #[default]
    None,
    /// Each runs in a process of its own, which could reach files, the network and other processes, if its code tried.
    Processes,
    /// Each runs in a process of its own, which the operating system ends if it tries to reach a file, the network or another process.
    SystemCalls,
}

/// What was compared, and what was found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Agents of the team.
    pub agents: usize,
    /// What keeps them apart.
    pub isolation: Isolation,
    /// Episodes played in each mode, sampled and greedy.
    pub episodes: usize,
    /// Environment steps of both modes.
    pub steps: u64,
    /// Actions of separate agents that were compared.
    pub actions_compared: u64,
    /// Inputs of controllers that were compared, bit for bit.
    pub inputs_compared: u64,
    /// Rows of log-probabilities that were compared, bit for bit; 0 if the policy gives none.
    pub outputs_compared: u64,
    /// Actions in altered worlds that were compared.
    pub altered_actions_compared: u64,
    /// Inputs of controllers in altered worlds that were compared.
    pub altered_inputs_compared: u64,
    /// Rows of log-probabilities in altered worlds that were compared.
    pub altered_outputs_compared: u64,
    /// Steps of agents on their own at which what they do not see was no number.
    pub unseen_numbers_compared: u64,
    /// Observations in worlds whose state was altered beyond sight that were compared; 0 if the world does not offer that.
    pub altered_states_compared: u64,
    /// Inputs and rows of log-probabilities under another key that were compared.
    pub other_key_compared: u64,
    /// Comparisons of any check that failed; 0 if the run is decentralised.
    pub mismatches: u64,
    /// Those of them that were found in altered worlds or states.
    pub mismatches_in_altered_worlds: u64,
    /// The first difference.
    pub first_mismatch: Option<CounterExample>,
}

/// One difference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CounterExample {
    /// Which check found it.
    pub check: Check,
    /// In what it consists.
    pub difference: Difference,
    /// Sampled or greedy.
    pub mode: Mode,
    /// Number of the episode, from 0.
    pub episode: u64,
    /// Step of the episode, from 0.
    pub step: usize,
    /// Whose action, input or observation differs.
    pub agent: AgentId,
    /// The controller that read or gave something else, if one did.
    pub controller: Option<ControllerId>,
    /// What the agent does in the central run.
    pub central_action: Action,
    /// What it does on its own, or in the altered world.
    pub agent_action: Action,
    /// The first input that differs, if one does and it is known.
    pub differing_input: Option<DifferingInput>,
}

/// One number that a controller reads differently.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DifferingInput {
    /// Whose input.
    pub controller: ControllerId,
    /// Place among its inputs.
    pub index: usize,
    /// What the central run reads there.
    pub central: f32,
    /// What the agent reads there.
    pub agent: f32,
}

/// Where a comparison stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) check: Check,
    pub(super) mode: Mode,
    pub(super) episode: u64,
    pub(super) step: usize,
    pub(super) agent: AgentId,
}

impl Certificate {
    /// Adds what was compared in a check.
    pub(super) fn count(&mut self, check: Check, compared: Compared) {
        let Compared {
            actions,
            inputs,
            outputs,
        } = compared;
        match check {
            Check::SeparateAgents => {
                self.actions_compared += actions;
                self.inputs_compared += inputs;
                self.outputs_compared += outputs;
            }
            Check::AlteredWorlds => {
                self.altered_actions_compared += actions;
                self.altered_inputs_compared += inputs;
                self.altered_outputs_compared += outputs;
            }
            Check::UnseenNumbers => self.unseen_numbers_compared += actions,
            Check::AlteredStates => self.altered_states_compared += 1,
            Check::OtherKey => self.other_key_compared += inputs + outputs,
        }
    }

    /// Counts a mismatch and keeps it if it is the first. `actions` are those of the central run and of the other.
    pub(super) fn note(
        &mut self,
        place: Place,
        (difference, controller): Found,
        actions: [Action; 2],
        differing_input: Option<DifferingInput>,
    ) {
        let Place {
            check,
            mode,
            episode,
            step,
            agent,
        } = place;
        self.mismatches += 1;
        if matches!(check, Check::AlteredWorlds | Check::AlteredStates) {
            self.mismatches_in_altered_worlds += 1;
        }
        self.first_mismatch.get_or_insert_with(|| CounterExample {
            check,
            difference,
            mode,
            episode,
            step,
            agent,
            controller,
            central_action: actions[0],
            agent_action: actions[1],
            differing_input,
        });
    }

    /// What was proved, in a few sentences, the first of which says it in short; `world` is what was played.
    #[must_use]
    pub fn proved(&self, world: &str) -> String {
        let Self {
            agents,
            episodes,
            steps,
            ..
        } = self;
        if self.mismatches > 0 {
            return format!(
                "The team is not decentralised: {} of the comparisons in {steps} steps of {world} failed.",
                self.mismatches
            );
        }
        let apart = match self.isolation {
            Isolation::None => "each with its own controllers but in one process",
            Isolation::Processes => "each in a process of its own",
            Isolation::SystemCalls => {
                "each in a process of its own that the operating system kept from files, the network and other processes"
            }
        };
        let computed = if self.outputs_compared > 0 {
            "inputs, log-probabilities and actions"
        } else {
            "inputs and actions"
        };
        let state = match self.altered_states_compared {
            0 => String::new(),
            count => format!(
                " What an agent observed did not change either when the state of the world was altered beyond its sight ({count} times)."
            ),
        };
        format!(
            "Certified: the team runs decentralised on {world}, in {episodes} sampled and {episodes} greedy episodes of {steps} steps together. \
             {agents} agents, {apart}, were given their own local views, their numbers, the weights and the key of their choices, and \
             nothing else. Their {computed} were those of the central run, bit for bit. Nothing of this changed when everything that an \
             agent does not see was replaced by noise.{state}"
        )
    }

    /// What was not proved, a sentence each.
    #[must_use]
    pub fn not_proved(&self) -> Vec<&'static str> {
        let mut sentences = vec![
            "Other episodes, other weights and other worlds: the certificate speaks of the steps that were played.",
            "That the team plays well: any weights of this program's controllers pass, since it is their code that keeps to local views.",
            "Whether an unseen agent is alive was the same in all altered worlds.",
            "The encoder of common knowledge, the networks and the sampler are the same code on both sides: an error in them shows on neither.",
        ];
        sentences.push(match self.isolation {
            Isolation::SystemCalls => {
                "Processes on one machine can still tell each other something by how long they take or how they use shared caches."
            }
            Isolation::Processes => {
                "This system did not keep the agents' processes from files, the network or each other: that they exchange nothing rests on their code."
            }
            Isolation::None => {
                "The agents shared a process: that they exchange nothing rests on their code."
            }
        });
        if self.altered_states_compared == 0 {
            sentences.push(
                "That observations are local: this world does not offer to alter its state beyond an agent's sight.",
            );
        }
        if self.outputs_compared == 0 {
            sentences.push("Log-probabilities were not compared: this policy does not tell them.");
        }
        sentences.push(
            "The key of the choices is not the world's, and the world's cannot be computed from it except by trying all seeds; code that does so was not looked for.",
        );
        sentences
    }
}
