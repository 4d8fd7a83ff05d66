//! Commonly known entities as numbers for a group's controller, and as a mask over its actions.
//!
//! Everything here is a function of the entities in 𝓘^𝒢 and of what was known before the game. No argument could carry an
//! agent's private knowledge, and the arithmetic is the same for every caller: two members compute bit-identical inputs.

use std::{fmt, sync::Arc};

use mackrl_env::{
    AgentId, EntityId, EnvironmentSpec, KnownEntities, PriorKnowledge, declare_words,
};

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
/// With G members, M entities, F features of which P are the position, and A actions, an input has, where P = 2,
/// - complete: G·(4·M + A) + M·(F − 2) numbers: for each member and entity \[known, distance, Δx, Δy\]; then for each
///   entity its attributes; then for each member its available actions;
/// - thin: G·(5·enemies + 4·N) numbers, as [`CommonKnowledgeFeatures::Thin`] of the published code: for each enemy
///   \[attack by the first member, distance, Δx, Δy, attack by the second\], for each agent \[known, distance, Δx, Δy\].
///
/// With other P there are as many Δ, and without positions no distance either. Distances are divided by [`EnvironmentSpec::distance_scale`].
#[derive(Clone)]
pub struct GroupEncoder {
    features: CommonKnowledgeFeatures,
    group_size: usize,
    agents: usize,
    entities: usize,
    entity_features: usize,
    position_features: usize,
    actions: usize,
    distance_scale: f32,
    prior: Arc<dyn PriorKnowledge>,
}

impl GroupEncoder {
    /// An encoder for groups of `group_size` agents.
    #[must_use]
    pub fn new(
        features: CommonKnowledgeFeatures,
        group_size: usize,
        spec: &EnvironmentSpec,
        prior: Arc<dyn PriorKnowledge>,
    ) -> Self {
        Self {
            features,
            group_size,
            agents: spec.agents,
            entities: spec.entities,
            entity_features: spec.entity_features,
            position_features: spec.position_features,
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
                CommonKnowledgeFeatures::Complete => self.relative() * self.entities + self.actions,
                CommonKnowledgeFeatures::Thin => {
                    self.thin_enemy() * enemies + self.relative() * self.agents
                }
            }
            + match self.features {
                CommonKnowledgeFeatures::Complete => {
                    self.entities * (self.entity_features - self.position_features)
                }
                CommonKnowledgeFeatures::Thin => 0,
            }
    }

    /// The parts of an input, in their order, and how many numbers each has; together they are [`Self::size`].
    #[must_use]
    pub fn parts(&self) -> Vec<(&'static str, usize)> {
        let places = self.group_size * self.relative();
        match self.features {
            CommonKnowledgeFeatures::Complete => vec![
                ("places", places * self.entities),
                (
                    "attributes",
                    self.entities * (self.entity_features - self.position_features),
                ),
                ("available_actions", self.group_size * self.actions),
            ],
            CommonKnowledgeFeatures::Thin => vec![
                (
                    "thin_enemies",
                    self.group_size * self.thin_enemy() * (self.entities - self.agents),
                ),
                ("thin_agents", places * self.agents),
            ],
        }
    }

    /// Numbers about an entity relative to a member: known, and where there are positions distance and Δ.
    const fn relative(&self) -> usize {
        match self.position_features {
            0 => 1,
            axes => 2 + axes,
        }
    }

    /// Numbers about an enemy in the thin features: attack by the first member, distance and Δ, attack by the second.
    const fn thin_enemy(&self) -> usize {
        1 + self.relative()
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
        let attributes = self.entity_features - self.position_features;
        let relative = self.relative();
        let (places, rest) = out_f.split_at_mut(self.group_size * self.entities * relative);
        let (attributes_mf, actions) = rest.split_at_mut(self.entities * attributes);
        for (&member, place_m) in group
            .iter()
            .zip(places.chunks_mut(self.entities * relative))
        {
            for (entity, place) in place_m.chunks_mut(relative).enumerate() {
                if !self.write_relative(known, member, EntityId::new(entity), place) {
                    place.fill(0.0);
                }
            }
        }
        for entity in 0..self.entities {
            let attributes_f = &mut attributes_mf[entity * attributes..(entity + 1) * attributes];
            match known.get(EntityId::new(entity)) {
                Some(features) => attributes_f.copy_from_slice(&features[self.position_features..]),
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
        let thin_enemy = self.thin_enemy();
        let enemy_numbers = thin_enemy * (self.entities - self.agents);
        let per_member = enemy_numbers + self.relative() * self.agents;
        for (&member, block) in group.iter().zip(out_f.chunks_mut(per_member)) {
            let (enemies, allies) = block.split_at_mut(enemy_numbers);
            let enemy_ids = (self.agents..self.entities).map(EntityId::new);
            for (enemy, slot) in enemy_ids.zip(enemies.chunks_mut(thin_enemy)) {
                let (place, attack) = slot.split_at_mut(thin_enemy - 1);
                if self.write_relative(known, member, enemy, place) {
                    place[0] = self.attack_flag(0, enemy, available_ga);
                    attack[0] = self.attack_flag(1, enemy, available_ga);
                }
            }
            let others = (0..self.agents)
                .map(AgentId::new)
                .filter(|ally| !group.contains(ally));
            let ally_ids = group.iter().copied().chain(others);
            for (ally, slot) in ally_ids.zip(allies.chunks_mut(self.relative())) {
                self.write_relative(known, member, ally.into(), slot);
            }
        }
    }

    /// Writes \[1, distance, Δ…\] of `entity` from `member`, scaled, if both are known; says whether they are.
    fn write_relative(
        &self,
        known: KnownEntities<'_>,
        member: AgentId,
        entity: EntityId,
        relative: &mut [f32],
    ) -> bool {
        let (Some(from), Some(to)) = (known.get(member), known.get(entity)) else {
            return false;
        };
        relative[0] = 1.0;
        if let [_, distance, deltas @ ..] = relative {
            let mut square = 0.0;
            for ((delta, from), to) in deltas.iter_mut().zip(from).zip(to) {
                *delta = (to - from) / self.distance_scale;
                square += *delta * *delta;
            }
            *distance = square.sqrt();
        }
        true
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

/// Writes which columns of a group's table may be chosen: every division, and every joint action whose parts are all commonly known to
/// be available.
///
/// # Shapes
/// `available_ga` \[G, A\]; `mask_c` \[D + A^G\]: the divisions, then the joint actions, the last member's action changing fastest. Of a
/// pair column `1 + u_a·A + u_b` is the joint action `(u_a, u_b)`.
///
/// # Panics
/// If the lengths do not fit each other.
pub fn joint_mask(available_ga: &[bool], actions: usize, divisions: usize, mask_c: &mut [bool]) {
    let (divide, joint) = mask_c.split_at_mut(divisions);
    divide.fill(true);
    write_joint(available_ga, actions, joint);
}

/// Writes which joint actions of the members are available.
fn write_joint(available_ga: &[bool], actions: usize, joint: &mut [bool]) {
    let (first, others) = available_ga.split_at(actions);
    if others.is_empty() {
        joint.copy_from_slice(first);
        return;
    }
    assert_eq!(joint.len() % actions, 0, "a group's joint actions are A^G");
    let rows = joint.chunks_mut(joint.len() / actions);
    for (&is_available, row) in first.iter().zip(rows) {
        if is_available {
            write_joint(others, actions, row);
        } else {
            row.fill(false);
        }
    }
}

const fn number_of(fact: bool) -> f32 {
    if fact { 1.0 } else { 0.0 }
}
