//! Commonly known entities as numbers for a group's controller, and as a mask over its actions.
//!
//! Everything here is a function of the entities in 𝓘^𝒢 and of what was known before the game. No argument could carry an
//! agent's private knowledge, and the arithmetic is the same for every caller: two members compute bit-identical inputs.

use std::{fmt, sync::Arc};

use mackrl_env::{
    AgentId, EntityId, EnvironmentSpec, KnownEntities, PriorKnowledge, declare_words,
};

/// Columns that the features of an entity begin with: its position (x, y).
const POSITION: usize = 2;
/// Numbers about an entity relative to a member: known, distance, Δx, Δy.
const RELATIVE: usize = 4;
/// Numbers about an enemy in the thin features: attack by the first member, distance, Δx, Δy, attack by the second.
const THIN_ENEMY: usize = 5;
/// What the thin features hold in place of anything that is not commonly known.
const MISSING: f32 = -1.0;

declare_words! {
    /// What a group's controller reads of its common knowledge.
    pub enum CommonKnowledgeFeatures {
        /// All that is known of every entity: place relative to each member, attributes, and each member's commonly known
        /// available actions. Unknown is 0.
        #[default]
        Complete = "complete",
        /// What the published code reads: places and whether enemies can be attacked, without health or type. Unknown is −1.
        Thin = "thin",
    }
}

/// Turns the common knowledge of groups of one size into controller inputs.
///
/// # Shapes
/// With G members, M entities, F features and A actions, an input has
/// - complete: G·(4·M + A) + M·(F − 2) numbers: for each member and entity \[known, distance, Δx, Δy\]; then for each
///   entity its attributes; then for each member its available actions;
/// - thin: G·(5·enemies + 4·N) numbers, as [`CommonKnowledgeFeatures::Thin`] of the published code.
///
/// Distances are divided by [`EnvironmentSpec::distance_scale`].
#[derive(Clone)]
pub struct GroupEncoder {
    features: CommonKnowledgeFeatures,
    group_size: usize,
    agents: usize,
    entities: usize,
    entity_features: usize,
    actions: usize,
    distance_scale: f32,
    prior: Arc<dyn PriorKnowledge>,
}

impl GroupEncoder {
    /// An encoder for groups of `group_size` agents.
    ///
    /// # Panics
    /// If entities have no position (F < 2).
    #[must_use]
    pub fn new(
        features: CommonKnowledgeFeatures,
        group_size: usize,
        spec: &EnvironmentSpec,
        prior: Arc<dyn PriorKnowledge>,
    ) -> Self {
        assert!(
            spec.entity_features >= POSITION,
            "the features of an entity begin with its position"
        );
        Self {
            features,
            group_size,
            agents: spec.agents,
            entities: spec.entities,
            entity_features: spec.entity_features,
            actions: spec.actions,
            distance_scale: spec.distance_scale,
            prior,
        }
    }

    /// Length of the input.
    #[must_use]
    pub const fn size(&self) -> usize {
        let enemies = self.entities - self.agents;
        self.group_size
            * match self.features {
                CommonKnowledgeFeatures::Complete => RELATIVE * self.entities + self.actions,
                CommonKnowledgeFeatures::Thin => THIN_ENEMY * enemies + RELATIVE * self.agents,
            }
            + match self.features {
                CommonKnowledgeFeatures::Complete => {
                    self.entities * (self.entity_features - POSITION)
                }
                CommonKnowledgeFeatures::Thin => 0,
            }
    }

    /// Writes which actions of each member are commonly known to be available; none if nothing is commonly known.
    ///
    /// # Shapes
    /// `known`: 𝓘^𝒢; `available_ga` \[G, A\], members in the order of `group`.
    ///
    /// # Panics
    /// If `available_ga` has another length.
    pub fn write_availability(
        &self,
        known: KnownEntities<'_>,
        group: &[AgentId],
        available_ga: &mut [bool],
    ) {
        assert_eq!(
            available_ga.len(),
            self.group_size * self.actions,
            "availability is [G, A]"
        );
        for (&member, available_a) in group.iter().zip(available_ga.chunks_mut(self.actions)) {
            self.prior.available(known, member, available_a);
        }
    }

    /// Writes the controller's input. Nothing is allocated.
    ///
    /// # Shapes
    /// `known`: 𝓘^𝒢; `available_ga` \[G, A\] from [`Self::write_availability`]; `out_f` of [`Self::size`].
    ///
    /// # Panics
    /// If a length differs.
    pub fn encode(
        &self,
        known: KnownEntities<'_>,
        group: &[AgentId],
        available_ga: &[bool],
        out_f: &mut [f32],
    ) {
        assert_eq!(
            group.len(),
            self.group_size,
            "the group's size is the encoder's"
        );
        assert_eq!(
            available_ga.len(),
            self.group_size * self.actions,
            "availability is [G, A]"
        );
        assert_eq!(
            out_f.len(),
            self.size(),
            "the input's size is the encoder's"
        );
        match self.features {
            CommonKnowledgeFeatures::Complete => {
                self.encode_complete(known, group, available_ga, out_f);
            }
            CommonKnowledgeFeatures::Thin => self.encode_thin(known, group, available_ga, out_f),
        }
    }

    fn encode_complete(
        &self,
        known: KnownEntities<'_>,
        group: &[AgentId],
        available_ga: &[bool],
        out_f: &mut [f32],
    ) {
        let attributes = self.entity_features - POSITION;
        let (places, rest) = out_f.split_at_mut(self.group_size * self.entities * RELATIVE);
        let (attributes_mf, actions) = rest.split_at_mut(self.entities * attributes);
        for (&member, place_m) in group
            .iter()
            .zip(places.chunks_mut(self.entities * RELATIVE))
        {
            for (entity, place) in place_m.chunks_mut(RELATIVE).enumerate() {
                let relative = self.relative(known, member, EntityId::new(entity));
                place.copy_from_slice(&relative.unwrap_or([0.0; RELATIVE]));
            }
        }
        for entity in 0..self.entities {
            let attributes_f = &mut attributes_mf[entity * attributes..(entity + 1) * attributes];
            match known.get(EntityId::new(entity)) {
                Some(features) => attributes_f.copy_from_slice(&features[POSITION..]),
                None => attributes_f.fill(0.0),
            }
        }
        for (number, &available) in actions.iter_mut().zip(available_ga) {
            *number = number_of(available);
        }
    }

    fn encode_thin(
        &self,
        known: KnownEntities<'_>,
        group: &[AgentId],
        available_ga: &[bool],
        out_f: &mut [f32],
    ) {
        out_f.fill(MISSING);
        let per_member = THIN_ENEMY * (self.entities - self.agents) + RELATIVE * self.agents;
        for (&member, block) in group.iter().zip(out_f.chunks_mut(per_member)) {
            let (enemies, allies) = block.split_at_mut(THIN_ENEMY * (self.entities - self.agents));
            let enemy_ids = (self.agents..self.entities).map(EntityId::new);
            for (enemy, slot) in enemy_ids.zip(enemies.chunks_mut(THIN_ENEMY)) {
                let Some([_, distance, dx, dy]) = self.relative(known, member, enemy) else {
                    continue;
                };
                let attack = |i| self.attack_flag(i, enemy, available_ga);
                slot.copy_from_slice(&[attack(0), distance, dx, dy, attack(1)]);
            }
            let others = (0..self.agents)
                .map(AgentId::new)
                .filter(|ally| !group.contains(ally));
            let ally_ids = group.iter().copied().chain(others);
            for (ally, slot) in ally_ids.zip(allies.chunks_mut(RELATIVE)) {
                if let Some(relative) = self.relative(known, member, ally.into()) {
                    slot.copy_from_slice(&relative);
                }
            }
        }
    }

    /// \[1, distance, Δx, Δy\] of `entity` from `member`, scaled, if both are known.
    fn relative(
        &self,
        known: KnownEntities<'_>,
        member: AgentId,
        entity: EntityId,
    ) -> Option<[f32; RELATIVE]> {
        let from = known.get(member)?;
        let to = known.get(entity)?;
        let dx = (to[0] - from[0]) / self.distance_scale;
        let dy = (to[1] - from[1]) / self.distance_scale;
        Some([1.0, (dx * dx + dy * dy).sqrt(), dx, dy])
    }

    /// Whether the `i`-th member can act on `entity`, as a number; missing if the group has no such member.
    fn attack_flag(&self, i: usize, entity: EntityId, available_ga: &[bool]) -> f32 {
        if i >= self.group_size {
            return MISSING;
        }
        let action = self.prior.action_on(entity);
        number_of(action.is_some_and(|action| available_ga[i * self.actions + action.index()]))
    }
}

impl fmt::Debug for GroupEncoder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("GroupEncoder")
            .field("features", &self.features)
            .field("group_size", &self.group_size)
            .field("size", &self.size())
            .finish_non_exhaustive()
    }
}

/// Writes which columns of a pair's table may be chosen: *delegate* always, and every joint action whose two parts are
/// commonly known to be available.
///
/// # Shapes
/// `available_ga` \[2, A\]; `mask_c` \[1 + A·A\], column `1 + u_a·A + u_b` for the joint action `(u_a, u_b)`.
///
/// # Panics
/// If the lengths do not fit each other.
pub fn joint_mask(available_ga: &[bool], mask_c: &mut [bool]) {
    let actions = available_ga.len() / 2;
    assert_eq!(
        mask_c.len(),
        1 + actions * actions,
        "a pair's mask is [1 + A*A]"
    );
    let (first, second) = available_ga.split_at(actions);
    let (delegate, joint) = mask_c.split_at_mut(1);
    delegate[0] = true;
    for (&first_available, row) in first.iter().zip(joint.chunks_mut(actions)) {
        for (column, &second_available) in row.iter_mut().zip(second) {
            *column = first_available && second_available;
        }
    }
}

const fn number_of(fact: bool) -> f32 {
    if fact { 1.0 } else { 0.0 }
}
