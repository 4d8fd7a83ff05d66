//! What a world promises to those who act in it.
//!
//! Two things are kept apart that many interfaces merge. The *end of an episode* has a cause: the game was decided, or time
//! ran out; only the learner decides whether the second has a value beyond it. And what the agents *know before the game
//! starts* (the map, the ranges, everybody's field of view) is an object of its own, [`PriorKnowledge`], which a decentralised
//! agent owns without owning a world.

use std::{borrow::Cow, fmt::Debug, sync::Arc};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{Action, AgentId, EntityId, EntitySet, EpisodeKey, KnownEntities, ObservationMut};

/// Sizes of an environment's arrays and its time limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnvironmentSpec {
    /// Name in the registry, such as `3m`.
    pub name: String,
    /// N: agents, at least 1. They are the first N entities.
    pub agents: usize,
    /// M: everything that can be seen, at most [`EntitySet::CAPACITY`].
    pub entities: usize,
    /// F: features of an entity: its position, then attributes of about unit size.
    pub entity_features: usize,
    /// P: how many of the features, from the first on, are its position in map units, such as 2 for (x, y); 0 in worlds
    /// without places. Controllers read positions relative to the members of their group.
    pub position_features: usize,
    /// A: actions of an agent.
    pub actions: usize,
    /// O: length of an agent's observation vector.
    pub observation_size: usize,
    /// G: length of the state vector, which only the critic sees.
    pub state_size: usize,
    /// Steps after which an episode is truncated.
    pub episode_limit: usize,
    /// Map units by which relative positions are divided to become network inputs (the sight range in StarCraft), > 0.
    pub distance_scale: f32,
    /// What an episode is reported by, in the order in which [`Environment::statistics`] writes it.
    pub statistics: Vec<Statistic>,
    /// Index in `statistics` of the one that says how far an episode succeeded, in [0, 1], if one does: reports show it
    /// first. Without one, they show the return.
    pub success: Option<usize>,
}

impl EnvironmentSpec {
    /// The statistic that says how far an episode succeeded, if one does.
    #[must_use]
    pub fn success(&self) -> Option<&Statistic> {
        self.statistics.get(self.success?)
    }

    /// Whether such a world can be played in.
    ///
    /// # Errors
    /// [`InvalidSpec`] says which size is impossible, what was found and what was expected.
    pub fn validate(&self) -> Result<(), InvalidSpec> {
        let most_entities = EntitySet::CAPACITY;
        let ids = usize::from(u16::MAX);
        let count = |what, found: usize, least: usize, most: usize| {
            let fits = (least..=most).contains(&found);
            let expected = || format!("{least} to {most}");
            (!fits).then(|| self.invalid(what, found.to_string(), expected()))
        };
        let sizes = [
            count("entities", self.entities, 1, most_entities),
            count("agents", self.agents, 1, self.entities),
            count("features of an entity", self.entity_features, 1, ids),
            count(
                "features of a position",
                self.position_features,
                0,
                self.entity_features,
            ),
            count("actions", self.actions, 1, ids),
            count("steps of an episode", self.episode_limit, 1, usize::MAX),
        ];
        if let Some(wrong) = sizes.into_iter().flatten().next() {
            return Err(wrong);
        }
        if !(self.distance_scale.is_finite() && self.distance_scale > 0.0) {
            let found = self.distance_scale.to_string();
            return Err(self.invalid("distance_scale", found, "a finite number > 0".to_owned()));
        }
        self.validate_statistics()
    }

    fn validate_statistics(&self) -> Result<(), InvalidSpec> {
        /// What is reported of the episodes of every world.
        const COMMON: [&str; 2] = ["return", "ep_length"];
        for (index, Statistic { name, .. }) in self.statistics.iter().enumerate() {
            let is_word = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            let is_name = !name.is_empty() && name.chars().all(is_word);
            let is_taken = COMMON.contains(&&**name) || self.statistic(name) != Some(index);
            if !is_name || is_taken {
                let expected = "lower-case letters, digits and `_`, and a name of its own";
                return Err(self.invalid("a statistic", format!("`{name}`"), expected.to_owned()));
            }
        }
        match self.success {
            Some(index) if index >= self.statistics.len() => {
                let expected = format!("less than {}", self.statistics.len());
                Err(self.invalid("the index of success", index.to_string(), expected))
            }
            _ => Ok(()),
        }
    }

    fn invalid(&self, what: &'static str, found: String, expected: String) -> InvalidSpec {
        InvalidSpec {
            world: self.name.clone(),
            what,
            found,
            expected,
        }
    }

    /// Index among the statistics of the one called `name`.
    #[must_use]
    pub fn statistic(&self, name: &str) -> Option<usize> {
        self.statistics
            .iter()
            .position(|statistic| statistic.name == name)
    }
}

/// Sizes that no world can have.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("world `{world}`: {what}: {found}, expected {expected}")]
pub struct InvalidSpec {
    /// Name of the world.
    pub world: String,
    /// Which size.
    pub what: &'static str,
    /// What it is.
    pub found: String,
    /// What it may be.
    pub expected: String,
}

/// A number that a world reports of an episode; agents never see it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistic {
    /// Name, such as `battle_won`, in lower case; metrics of runs are called `battle_won_mean` and `test_battle_won_mean`.
    pub name: Cow<'static, str>,
    /// What it is in one episode, such as "1 if the team has won, else 0".
    pub meaning: Cow<'static, str>,
}

impl Statistic {
    /// Declares one.
    #[must_use]
    pub fn new(name: impl Into<Cow<'static, str>>, meaning: impl Into<Cow<'static, str>>) -> Self {
        Self {
            name: name.into(),
            meaning: meaning.into(),
        }
    }
}

/// Why an episode is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EpisodeEnd {
    /// The game was decided: nothing comes after this state.
    Terminated,
    /// The time limit was reached: the game would have gone on.
    Truncated,
}

/// What one step gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStep {
    /// Reward shared by the team.
    pub reward: f32,
    /// Set if this was the episode's last step.
    pub end: Option<EpisodeEnd>,
}

/// An action that was not available to its agent. The world has not moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("agent {agent} chose action {action}, which is not available to it")]
pub struct IllegalAction {
    /// The agent that chose.
    pub agent: AgentId,
    /// What it chose.
    pub action: Action,
}

/// The world failed under the episode, which is void: nothing of it may be learnt from or counted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the episode is void: {reason}")]
pub struct Interruption {
    /// What failed, in words.
    pub reason: String,
    /// Whether a new episode may be tried; otherwise the world cannot be brought back.
    pub can_be_repeated: bool,
}

/// Why a step was not played.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StepError {
    /// The policy chose what it must not; the world is unchanged.
    #[error(transparent)]
    IllegalAction(#[from] IllegalAction),
    /// The world failed. Worlds that are computed never do; games in other processes may.
    #[error(transparent)]
    Interrupted(#[from] Interruption),
}

/// A world with N agents that share one reward.
///
/// Every implementation passes [`crate::contract::check_environment`].
pub trait Environment: Send {
    /// Sizes and limits; constant over the environment's life.
    fn spec(&self) -> &EnvironmentSpec;

    /// What every agent knows before the first step.
    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge>;

    /// Starts the episode named `key` and writes its first observations, wherever the latest episode stands. If a world fails
    /// at it, every agent is shown as dead, and the first step tells.
    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>);

    /// Plays one step and writes the observations that follow it. Nothing is allocated.
    ///
    /// # Errors
    /// [`IllegalAction`] names the first agent whose action was not available; the world is unchanged. [`Interruption`] tells
    /// that the episode is void; only `reset` may follow.
    ///
    /// # Panics
    /// If `actions` does not hold one action per agent.
    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError>;

    /// Writes how the current episode stands, for reports.
    ///
    /// # Shapes
    /// `statistics_s` \[S\], in the order of [`EnvironmentSpec::statistics`]; all finite.
    fn statistics(&self, statistics_s: &mut [f64]);

    /// Alters at random, by draws of `key`, what `agent` does not see, writes the observations of the state that results, and
    /// says that it has done so. Worlds that offer no such alteration, or in which nothing is unseen at the moment, say no.
    ///
    /// The contract's test alone calls it, once in an episode that is not continued: an alteration may be one that no episode
    /// leads to. What `agent` sees and observes has to stay the same, to the bit.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        let _ = (agent, key, out);
        false
    }
}

/// What is common knowledge before the game starts (τ₀ in the paper): everybody's field of view and the rules of availability.
///
/// All methods are pure functions of features, so every agent computes the same answers from the same entities.
pub trait PriorKnowledge: Send + Sync + Debug {
    /// μ^a(s^a, s^e): whether agent `observer` with features `observer_f` sees `entity` with features `entity_f`.
    ///
    /// It may depend on all features of both, on which agent looks, and on anything that never changes or is declared before
    /// the game: walls, ranges of one's own, noise that is a function of these.
    ///
    /// # Shapes
    /// `observer_f` and `entity_f` have F elements each.
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        entity_f: &[f32],
    ) -> bool;

    /// Writes which actions of `agent` are *surely* available to someone who knows only `known`: a subset of the truth, and
    /// equal to it if `known` is all that the agent itself sees. All false if `agent` is not in `known`.
    ///
    /// # Shapes
    /// `available_a` has A elements.
    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]);

    /// The action by which an agent acts on `entity`, if there is one (attack this enemy).
    fn action_on(&self, entity: EntityId) -> Option<Action>;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec() -> EnvironmentSpec {
        EnvironmentSpec {
            name: "maze".to_owned(),
            agents: 3,
            entities: 128,
            entity_features: 2,
            position_features: 2,
            actions: 5,
            observation_size: 0,
            state_size: 0,
            episode_limit: 1,
            distance_scale: 1.0,
            statistics: vec![Statistic::new("found", "1 if the way was found, else 0")],
            success: Some(0),
        }
    }

    #[test]
    fn sizes_that_no_world_can_have_are_refused_in_words() {
        assert_eq!(spec().validate(), Ok(()));
        assert_eq!(spec().success(), Some(&spec().statistics[0]));
        let refused = |change: fn(&mut EnvironmentSpec), expected: &str| {
            let mut spec = spec();
            change(&mut spec);
            assert_eq!(spec.validate().unwrap_err().to_string(), expected);
        };
        refused(
            |spec| spec.entities = 129,
            "world `maze`: entities: 129, expected 1 to 128",
        );
        refused(
            |spec| spec.agents = 129,
            "world `maze`: agents: 129, expected 1 to 128",
        );
        refused(
            |spec| spec.distance_scale = 0.0,
            "world `maze`: distance_scale: 0, expected a finite number > 0",
        );
        refused(
            |spec| spec.statistics.push(Statistic::new("found", "again")),
            "world `maze`: a statistic: `found`, expected lower-case letters, digits and `_`, and a name of its own",
        );
        refused(
            |spec| spec.success = Some(1),
            "world `maze`: the index of success: 1, expected less than 1",
        );
    }
}
