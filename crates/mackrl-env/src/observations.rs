//! What environments write and agents read: one struct of arrays for a batch of environments.

use crate::{AgentId, EntityId, EntitySet, EnvironmentSpec};

/// Observations of B environments, owned by the caller and filled by [`crate::Environment`].
#[derive(Debug, Clone, PartialEq)]
pub struct Observations {
    environments: usize,
    agents: usize,
    entities: usize,
    entity_features: usize,
    actions: usize,
    observation_size: usize,
    state_size: usize,
    observation_bno: Vec<f32>,
    state_bg: Vec<f32>,
    available_bna: Vec<bool>,
    visible_bn: Vec<EntitySet>,
    entity_bmf: Vec<f32>,
}

/// One environment's part of an [`Observations`], to be written.
#[derive(Debug)]
pub struct ObservationMut<'a> {
    /// Observation vectors \[N, O\]; zeros for dead agents.
    pub observation_no: &'a mut [f32],
    /// State vector \[G\].
    pub state_g: &'a mut [f32],
    /// Whether an action is available \[N, A\]; every row has at least one.
    pub available_na: &'a mut [bool],
    /// Entities that each agent sees \[N\]; a living agent sees itself, a dead one nothing.
    pub visible_n: &'a mut [EntitySet],
    /// Features of every entity in absolute coordinates \[M, F\]. Rows of entities that nobody sees may hold anything finite.
    pub entity_mf: &'a mut [f32],
}

impl Observations {
    /// Room for `environments` environments of the given sizes, zeroed.
    ///
    /// # Panics
    /// If there are more entities than [`EntitySet::CAPACITY`].
    #[must_use]
    pub fn new(spec: &EnvironmentSpec, environments: usize) -> Self {
        assert!(
            spec.entities <= EntitySet::CAPACITY,
            "an entity set holds at most 128 entities"
        );
        let b = environments;
        Self {
            environments,
            agents: spec.agents,
            entities: spec.entities,
            entity_features: spec.entity_features,
            actions: spec.actions,
            observation_size: spec.observation_size,
            state_size: spec.state_size,
            observation_bno: vec![0.0; b * spec.agents * spec.observation_size],
            state_bg: vec![0.0; b * spec.state_size],
            available_bna: vec![false; b * spec.agents * spec.actions],
            visible_bn: vec![EntitySet::EMPTY; b * spec.agents],
            entity_bmf: vec![0.0; b * spec.entities * spec.entity_features],
        }
    }

    /// B: number of environments.
    #[must_use]
    pub const fn environments(&self) -> usize {
        self.environments
    }

    /// The part that environment `b` writes.
    pub fn row_mut(&mut self, b: usize) -> ObservationMut<'_> {
        let (n, m, f) = (self.agents, self.entities, self.entity_features);
        ObservationMut {
            observation_no: part_mut(&mut self.observation_bno, b, n * self.observation_size),
            state_g: part_mut(&mut self.state_bg, b, self.state_size),
            available_na: part_mut(&mut self.available_bna, b, n * self.actions),
            visible_n: part_mut(&mut self.visible_bn, b, n),
            entity_mf: part_mut(&mut self.entity_bmf, b, m * f),
        }
    }

    /// The state \[G\] of environment `b`, for critics only.
    #[must_use]
    pub fn state(&self, b: usize) -> &[f32] {
        part(&self.state_bg, b, self.state_size)
    }

    /// All numbers of environment `b`: what a row of them describes, the length of a row, and the rows.
    #[must_use]
    pub fn numbers(&self, b: usize) -> [(&'static str, usize, &[f32]); 3] {
        let (observation, features) = (self.observation_size, self.entity_features);
        [
            (
                "agent",
                observation,
                part(&self.observation_bno, b, self.agents * observation),
            ),
            (
                "entity",
                features,
                part(&self.entity_bmf, b, self.entities * features),
            ),
            ("state", self.state_size, self.state(b)),
        ]
    }

    /// Who sees what in environment `b` \[N\].
    #[must_use]
    pub fn visible(&self, b: usize) -> &[EntitySet] {
        part(&self.visible_bn, b, self.agents)
    }

    /// All that `agent` knows in environment `b`.
    #[must_use]
    pub fn local_view(&self, b: usize, agent: AgentId) -> LocalView<'_> {
        let row = b * self.agents + agent.index();
        LocalView {
            agent,
            seen: KnownEntities {
                known: self.visible_bn[row],
                entity_mf: part(&self.entity_bmf, b, self.entities * self.entity_features),
                entity_features: self.entity_features,
            },
            observation_o: part(&self.observation_bno, row, self.observation_size),
            available_a: part(&self.available_bna, row, self.actions),
        }
    }
}

/// All that one agent knows at one step: the entities it sees, its own observation vector and its available actions.
///
/// This is the only input of a decentralised controller. It gives no way to reach an entity that the agent does not see.
#[derive(Debug, Clone, Copy)]
pub struct LocalView<'a> {
    agent: AgentId,
    seen: KnownEntities<'a>,
    observation_o: &'a [f32],
    available_a: &'a [bool],
}

impl<'a> LocalView<'a> {
    /// Puts a view together from its parts, as an agent does that received them from its sensors.
    ///
    /// # Shapes
    /// `observation_o` \[O\], `available_a` \[A\].
    #[must_use]
    pub const fn new(
        agent: AgentId,
        seen: KnownEntities<'a>,
        observation_o: &'a [f32],
        available_a: &'a [bool],
    ) -> Self {
        Self {
            agent,
            seen,
            observation_o,
            available_a,
        }
    }

    /// Whose view this is.
    #[must_use]
    pub const fn agent(&self) -> AgentId {
        self.agent
    }

    /// The entities that the agent sees; empty if it is dead.
    #[must_use]
    pub const fn seen(&self) -> KnownEntities<'a> {
        self.seen
    }

    /// The agent's own observation vector \[O\], a private extra.
    #[must_use]
    pub const fn observation(&self) -> &'a [f32] {
        self.observation_o
    }

    /// The agent's own available actions \[A\], a private extra.
    #[must_use]
    pub const fn available(&self) -> &'a [bool] {
        self.available_a
    }
}

/// A set of entities whose features are known; features of others cannot be reached through it.
#[derive(Debug, Clone, Copy)]
pub struct KnownEntities<'a> {
    known: EntitySet,
    entity_mf: &'a [f32],
    entity_features: usize,
}

impl<'a> KnownEntities<'a> {
    /// Makes the entities of `known` accessible, out of the table `entity_mf`.
    ///
    /// # Shapes
    /// `entity_mf` \[M, F\] with F = `entity_features`.
    ///
    /// # Panics
    /// If `known` has a member beyond the table.
    #[must_use]
    pub fn new(known: EntitySet, entity_mf: &'a [f32], entity_features: usize) -> Self {
        let entities = entity_mf.len() / entity_features.max(1);
        assert!(
            known.is_subset_of(EntitySet::first(entities.min(EntitySet::CAPACITY))),
            "a known entity lies beyond the table of {entities} entities"
        );
        Self {
            known,
            entity_mf,
            entity_features,
        }
    }

    /// Which entities are known.
    #[must_use]
    pub const fn set(&self) -> EntitySet {
        self.known
    }

    /// The features \[F\] of `entity`, if it is known.
    #[must_use]
    pub fn get(&self, entity: impl Into<EntityId>) -> Option<&'a [f32]> {
        let entity = entity.into();
        self.known
            .contains(entity)
            .then(|| part(self.entity_mf, entity.index(), self.entity_features))
    }

    /// What remains known of these entities to someone who knows only those in `set`.
    #[must_use]
    pub const fn restricted_to(&self, set: EntitySet) -> Self {
        Self {
            known: self.known.intersection(set),
            ..*self
        }
    }

    /// M: entities in the table, known or not.
    #[must_use]
    pub const fn entities(&self) -> usize {
        self.entity_mf.len() / self.entity_features
    }
}

fn part<T>(all: &[T], index: usize, len: usize) -> &[T] {
    &all[index * len..(index + 1) * len]
}

fn part_mut<T>(all: &mut [T], index: usize, len: usize) -> &mut [T] {
    &mut all[index * len..(index + 1) * len]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entity_that_is_not_seen_cannot_be_reached() {
        let table = [1.0, 2.0, 3.0, 4.0];
        let seen = KnownEntities::new(EntitySet::first(1), &table, 2);
        assert_eq!(seen.get(EntityId::new(0)), Some(&[1.0, 2.0][..]));
        assert_eq!(seen.get(EntityId::new(1)), None);
        assert_eq!(
            seen.restricted_to(EntitySet::from_bits(0b10)).set(),
            EntitySet::EMPTY
        );
    }
}
