//! Policies that were played in the real game too.

use std::fmt::{Display, Formatter, Result as Written};

use mackrl_env::{Action, AgentId, EpisodeKey, Observations, StepError, TimeStep};
use serde::{Deserialize, Serialize};

use crate::{
    Skirmish,
    actions::{NO_OPERATION, STOP, TARGETS_FROM},
    fidelity::heuristic::Heuristic,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

/// A policy that needs no learning and of which recorded runs of the real game exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Policy {
    /// Any available action, all equally likely: what every learner does in its first episode.
    Random,
    /// Stands and never shoots: what an untrained network does that prefers the action `stop`.
    Stop,
    /// Attacks one enemy, the one of this number, whenever that is available, and stands otherwise.
    Attack(usize),
    /// SMAC's own scripted team: each agent takes the nearest enemy, wherever it is, and attacks it until it is dead; a healer
    /// does the same with the nearest friend that is hurt.
    Heuristic,
}

/// A team that plays by a [`Policy`].
#[derive(Debug)]
pub(super) struct Team {
    play: Play,
}

#[derive(Debug)]
enum Play {
    Scripted(Box<ScriptedTeam>),
    Attack(usize),
    Heuristic(Heuristic),
}

impl Team {
    pub(super) fn new(policy: Policy, skirmish: &Skirmish) -> Self {
        let scripted = |script| Play::Scripted(Box::new(ScriptedTeam::new(script, skirmish)));
        Self {
            play: match policy {
                Policy::Random => scripted(ScriptedPolicy::Random),
                Policy::Stop => scripted(ScriptedPolicy::Idle),
                Policy::Attack(enemy) => Play::Attack(enemy),
                Policy::Heuristic => Play::Heuristic(Heuristic::new(skirmish)),
            },
        }
    }

    /// Plays one step; step 0 begins a new episode.
    pub(super) fn step(
        &mut self,
        skirmish: &mut Skirmish,
        observations: &mut Observations,
        actions: &mut [Action],
        (key, step): (EpisodeKey, usize),
    ) -> Result<TimeStep, StepError> {
        match &mut self.play {
            Play::Scripted(team) => team.act(observations, 0, (key, step), actions),
            Play::Attack(enemy) => {
                for (agent, action) in actions.iter_mut().enumerate() {
                    let view = observations.local_view(0, AgentId::new(agent));
                    *action = Action::new(attack(*enemy, view.available()));
                }
            }
            Play::Heuristic(heuristic) => {
                heuristic.choose(skirmish.battle(), step == 0);
                return Ok(skirmish.command(heuristic.orders(), &mut observations.row_mut(0)));
            }
        }
        mackrl_env::Environment::step(skirmish, actions, &mut observations.row_mut(0))
    }
}

/// The action of an agent that attacks one enemy whenever it can.
fn attack(enemy: usize, available: &[bool]) -> usize {
    let wanted = TARGETS_FROM + enemy;
    if available[NO_OPERATION] {
        NO_OPERATION
    } else if available.get(wanted) == Some(&true) {
        wanted
    } else {
        STOP
    }
}

impl Display for Policy {
    fn fmt(&self, f: &mut Formatter<'_>) -> Written {
        match self {
            Self::Random => f.write_str("random"),
            Self::Stop => f.write_str("stop"),
            Self::Attack(enemy) => write!(f, "attack-{enemy}"),
            Self::Heuristic => f.write_str("heuristic"),
        }
    }
}

impl From<Policy> for String {
    fn from(policy: Policy) -> Self {
        policy.to_string()
    }
}

impl TryFrom<String> for Policy {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Ok(match name.as_str() {
            "random" => Self::Random,
            "stop" => Self::Stop,
            "heuristic" => Self::Heuristic,
            _ => {
                let enemy = name.strip_prefix("attack-").and_then(|k| k.parse().ok());
                Self::Attack(enemy.ok_or_else(|| {
                    format!(
                        "no policy is called `{name}`, expected random, stop, attack-0, attack-1, … or heuristic"
                    )
                })?)
            }
        })
    }
}
