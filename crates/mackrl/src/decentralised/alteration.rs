//! Worlds that are the same for one agent, and otherwise full of noise.

use mackrl_env::{AgentId, Draw, EntityId, EntitySet, EnvironmentSpec, EpisodeKey, Observations};

/// What the noise is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Numbers in [0, 32), the range of positions.
    Plausible,
    /// Numbers in [-1000, 1000).
    Large,
    /// No numbers: whatever is computed with them is no number either. Other agents cannot act in such a world.
    NotANumber,
}

impl Kind {
    /// Kinds in which all agents can act, one after the other.
    pub(super) const fn of_episode(episode: u64) -> Self {
        if episode.is_multiple_of(2) {
            Self::Plausible
        } else {
            Self::Large
        }
    }
}

/// Replaces everything that `agent` does not see by noise. What nobody may read, the state and the entities that nobody sees, is no
/// number in every kind of noise.
pub(super) fn alter_unseen(
    observations: &mut Observations,
    spec: &EnvironmentSpec,
    agent: AgentId,
    (key, step): (&EpisodeKey, usize),
    kind: Kind,
) {
    let mut noise = Noise {
        key: *key,
        step,
        draws: agent.index() << 20,
        kind,
    };
    let seen = observations.visible(0)[agent.index()];
    let seen_by_any =
        (observations.visible(0).iter()).fold(EntitySet::EMPTY, |all, seen| all.union(*seen));
    let row = observations.row_mut(0);
    row.state_g.fill(f32::NAN);
    for (entity, features) in row.entity_mf.chunks_mut(spec.entity_features).enumerate() {
        if !seen_by_any.contains(EntityId::new(entity)) {
            features.fill(f32::NAN);
        } else if !seen.contains(EntityId::new(entity)) {
            noise.fill(features);
        }
    }
    for other in (0..spec.agents)
        .map(AgentId::new)
        .filter(|&other| other != agent)
    {
        let n = other.index();
        noise.fill(part(row.observation_no, n, spec.observation_size));
        let available_a = part(row.available_na, n, spec.actions);
        available_a.fill_with(|| noise.uniform() < 0.5);
        available_a[spec.actions - 1] = true;
        if !row.visible_n[n].is_empty() {
            // What is common to the two follows from what the agent sees, but only if it sees the other.
            let kept = if seen.contains(other) {
                seen
            } else {
                EntitySet::EMPTY
            };
            let beyond = (0..spec.entities)
                .map(EntityId::new)
                .filter(|entity| seen_by_any.contains(*entity))
                .filter(|_| noise.uniform() < 0.5);
            let beyond = beyond.collect::<EntitySet>().difference(kept);
            row.visible_n[n] = row.visible_n[n].intersection(kept).union(beyond);
            row.visible_n[n].insert(other);
        }
    }
}

/// Whether an agent observes the same in two worlds, bit for bit.
pub(super) fn is_same_view(one: &Observations, other: &Observations, agent: AgentId) -> bool {
    let (one, other) = (one.local_view(0, agent), other.local_view(0, agent));
    let is_same = |a: &[f32], b: &[f32]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    one.seen().set() == other.seen().set()
        && is_same(one.observation(), other.observation())
        && one.available() == other.available()
        && one.seen().set().iter().all(|entity| {
            let features = [one.seen().get(entity), other.seen().get(entity)];
            matches!(features, [Some(a), Some(b)] if is_same(a, b))
        })
}

/// Numbers that have nothing to do with the game.
struct Noise {
    key: EpisodeKey,
    step: usize,
    draws: usize,
    kind: Kind,
}

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.draws += 1;
        self.key.uniform(self.step, Draw::World(self.draws))
    }

    #[expect(clippy::cast_possible_truncation, reason = "noise may be rounded")]
    fn fill(&mut self, values: &mut [f32]) {
        match self.kind {
            Kind::NotANumber => values.fill(f32::NAN),
            Kind::Plausible => values.fill_with(|| (32.0 * self.uniform()) as f32),
            Kind::Large => values.fill_with(|| (2000.0 * self.uniform() - 1000.0) as f32),
        }
    }
}

fn part<T>(all: &mut [T], index: usize, len: usize) -> &mut [T] {
    &mut all[index * len..(index + 1) * len]
}
