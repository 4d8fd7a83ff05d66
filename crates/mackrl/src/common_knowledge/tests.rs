//! The lemma against the recursion, one member's computation against the team's, and the encoders by hand.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, Draw, EntityId, EntitySet, EnvironmentSpec, EpisodeKey, KnownEntities,
    PriorKnowledge, Stream,
};

use super::{
    CommonKnowledgeFeatures::{self, Complete, Thin},
    GroupEncoder, common_knowledge, common_knowledge_from_view, joint_mask,
    recursion::Recursion,
};

const KEY: EpisodeKey = EpisodeKey::new(17, Stream::Other, 2);
const FEATURES: usize = 3;
const SHOOTING_RANGE: f32 = 4.0;

/// A plain of units with a sight range for each agent; action 0 is always available, action 1 + i attacks enemy i.
#[derive(Debug)]
struct Plain {
    sight_n: Vec<f32>,
    entities: usize,
}

impl Plain {
    fn agents(&self) -> usize {
        self.sight_n.len()
    }

    fn spec(&self) -> EnvironmentSpec {
        EnvironmentSpec {
            name: "plain".into(),
            agents: self.agents(),
            entities: self.entities,
            entity_features: FEATURES,
            actions: 1 + self.entities - self.agents(),
            observation_size: 1,
            state_size: 1,
            episode_limit: 1,
            distance_scale: 8.0,
            position_features: 2,
            statistics: Vec::new(),
            success: None,
        }
    }

    fn visible(&self, entity_mf: &[f32]) -> Vec<EntitySet> {
        let row = |entity: usize| &entity_mf[entity * FEATURES..(entity + 1) * FEATURES];
        (0..self.agents())
            .map(|a| {
                (0..self.entities)
                    .map(EntityId::new)
                    .filter(|&e| self.sees(AgentId::new(a), row(a), e, row(e.index())))
                    .collect()
            })
            .collect()
    }
}

fn distance(from: &[f32], to: &[f32]) -> f32 {
    (from[0] - to[0]).hypot(from[1] - to[1])
}

impl PriorKnowledge for Plain {
    fn sees(&self, observer: AgentId, observer_f: &[f32], _: EntityId, entity_f: &[f32]) -> bool {
        distance(observer_f, entity_f) <= self.sight_n[observer.index()]
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(false);
        let Some(own) = known.get(agent) else { return };
        available_a[0] = true;
        for (enemy, available) in (self.agents()..).zip(&mut available_a[1..]) {
            *available = known
                .get(EntityId::new(enemy))
                .is_some_and(|enemy_f| distance(own, enemy_f) <= SHOOTING_RANGE);
        }
    }

    fn action_on(&self, entity: EntityId) -> Option<Action> {
        let enemy = entity.index().checked_sub(self.agents())?;
        Some(Action::new(1 + enemy))
    }
}

fn ids(agents: &[usize]) -> Vec<AgentId> {
    agents.iter().copied().map(AgentId::new).collect()
}

/// Every subset of the first `agents` agents but the empty one.
fn groups(agents: usize) -> impl Iterator<Item = Vec<AgentId>> {
    (1..1_u32 << agents).map(move |bits| {
        (0..agents)
            .filter(|a| bits >> a & 1 == 1)
            .map(AgentId::new)
            .collect()
    })
}

/// The row of an agent that sees itself and those of the others whose bit is set in `others`.
fn self_and(agent: usize, others: u64) -> EntitySet {
    let below = others & ((1 << agent) - 1);
    let above = others >> agent << (agent + 1);
    EntitySet::from_bits(u128::from(below | 1 << agent | above))
}

/// Compares lemma and recursion for `group` on every visibility relation of its members with `entities` entities.
///
/// Neither reads the rows of agents outside the group, which is why those need not be varied.
fn compare_exhaustively(group: &[AgentId], agents: usize, entities: usize) {
    let mut recursion = Recursion::default();
    let mut visible_n = vec![EntitySet::EMPTY; agents];
    let others = entities - 1;
    for relation in 0..1_u64 << (group.len() * others) {
        for (place, agent) in group.iter().enumerate() {
            let bits = relation >> (place * others) & ((1 << others) - 1);
            visible_n[agent.index()] = self_and(agent.index(), bits);
        }
        let limit = recursion.limit(group, &visible_n);
        let lemma = common_knowledge(group, &visible_n);
        let levels = if lemma.is_empty() { 2 } else { 1 };
        if limit.known != lemma || limit.stable_from > levels {
            panic!("{group:?} in {visible_n:?}: the lemma says {lemma:?}, the recursion {limit:?}");
        }
    }
}

#[test]
fn lemma_equals_recursion_for_every_relation_of_up_to_four_agents_and_three_entities() {
    for agents in 1..=4 {
        for entities in agents..=agents + 3 {
            for group in groups(agents) {
                compare_exhaustively(&group, agents, entities);
            }
        }
    }
}

#[test]
fn lemma_equals_recursion_for_large_teams() {
    let mut recursion = Recursion::default();
    let mut known_something = 0;
    for case in 0..2_000 {
        let agents = 5 + case % 19;
        let group: Vec<AgentId> = (0..agents)
            .filter(|&a| KEY.uniform(case, Draw::Agent(a)) < 0.4)
            .map(AgentId::new)
            .collect();
        let members: EntitySet = group.iter().copied().collect();
        let visible_n: Vec<EntitySet> = (0..agents)
            .map(|a| {
                let bits = |i| u128::from(KEY.bits(case, Draw::Setup(4 * a + i)));
                // Each entity is seen with probability 7/8; in half of the cases the group sees itself.
                let seen = [0, 1, 2].map(|i| bits(i) << 64 | bits(i) >> i);
                let seen = EntitySet::from_bits(seen[0] | seen[1] | seen[2]);
                let own = EntitySet::from_bits(1 << a);
                seen.union(if case % 2 == 0 { members } else { own })
                    .union(own)
            })
            .collect();
        let limit = recursion.limit(&group, &visible_n);
        assert_eq!(
            limit.known,
            common_knowledge(&group, &visible_n),
            "case {case}"
        );
        assert!(limit.stable_from <= 2, "case {case}: {limit:?}");
        known_something += usize::from(!limit.known.is_empty());
    }
    assert!(
        known_something > 900,
        "only {known_something} groups knew anything"
    );
}

#[test]
fn the_recursion_needs_two_levels_when_one_member_is_blind() {
    // 0 sees both, 1 sees only itself: 0 learns at level 1 that both see entity 1, at level 2 that 1 cannot know it.
    let visible_n = [0b011, 0b010].map(EntitySet::from_bits);
    let limit = Recursion::default().limit(&ids(&[0, 1]), &visible_n);
    assert_eq!(limit.known, EntitySet::EMPTY);
    assert_eq!(limit.stable_from, 2);
}

#[test]
fn a_group_with_a_dead_member_knows_nothing() {
    let visible_n = [0b1011, 0b1011, 0].map(EntitySet::from_bits);
    let known = |group: &[usize]| common_knowledge(&ids(group), &visible_n).bits();
    assert_eq!(known(&[0, 1]), 0b1011);
    assert_eq!(known(&[0, 2]), 0);
    assert_eq!(known(&[0, 1, 2]), 0);
    assert_eq!(known(&[2]), 0);
    assert_eq!(known(&[]), 0);
    let limit = Recursion::default().limit(&ids(&[0, 2]), &visible_n);
    assert_eq!(limit.known, EntitySet::EMPTY);
}

/// A random battle: sight ranges differ from agent to agent, and every third battle has a dead agent.
fn battle(case: usize) -> (Plain, Vec<f32>, Vec<EntitySet>) {
    let (agents, entities) = (5, 11);
    let uniform = |draw| KEY.uniform(case, draw);
    let plain = Plain {
        sight_n: (0..agents)
            .map(|a| 4.0 + 4.0 * real(uniform(Draw::Agent(a))))
            .collect(),
        entities,
    };
    let entity_mf: Vec<f32> = (0..entities * FEATURES)
        .map(|i| 8.0 * real(uniform(Draw::World(i))))
        .collect();
    let mut visible_n = plain.visible(&entity_mf);
    if case.is_multiple_of(3) {
        let dead = EntitySet::from_bits(1 << (case % agents));
        visible_n[case % agents] = EntitySet::EMPTY;
        visible_n
            .iter_mut()
            .for_each(|seen| *seen = seen.difference(dead));
    }
    (plain, entity_mf, visible_n)
}

fn real(uniform: f64) -> f32 {
    crate::Real::from_f64(uniform)
}

/// The table of an agent that sees `seen`: what it does not see is not there.
fn private_table(entity_mf: &[f32], seen: EntitySet) -> Vec<f32> {
    entity_mf
        .chunks(FEATURES)
        .enumerate()
        .flat_map(|(e, row)| {
            let sees = seen.contains(EntityId::new(e));
            row.iter().map(move |&x| if sees { x } else { f32::NAN })
        })
        .collect()
}

#[test]
fn every_member_finds_the_common_knowledge_from_its_own_view_and_encodes_the_same_bits() {
    let mut shared = 0;
    for case in 0..300 {
        let (plain, entity_mf, visible_n) = battle(case);
        let (spec, prior) = (plain.spec(), Arc::new(plain));
        for group in groups(spec.agents) {
            let expected = common_knowledge(&group, &visible_n);
            let encoders = [Complete, Thin]
                .map(|features| GroupEncoder::new(features, group.len(), &spec, prior.clone()));
            let mut inputs = Vec::new();
            for member in &group {
                let seen = visible_n[member.index()];
                let table = private_table(&entity_mf, seen);
                let view = KnownEntities::new(seen, &table, FEATURES);
                let known = common_knowledge_from_view(&group, view, &*prior);
                assert_eq!(known, expected, "case {case}: agent {member} of {group:?}");
                inputs.push(encoders.each_ref().map(|encoder| {
                    encode(encoder, view.restricted_to(known), &group, spec.actions)
                }));
            }
            assert!(
                inputs.iter().all(|input| *input == inputs[0]),
                "case {case}: members of {group:?} read different inputs"
            );
            shared += usize::from(group.len() > 1 && !expected.is_empty());
        }
    }
    assert!(shared > 500, "only {shared} groups knew anything");
}

/// The bits of the input, and the availability.
fn encode(
    encoder: &GroupEncoder,
    known: KnownEntities<'_>,
    group: &[AgentId],
    actions: usize,
) -> (Vec<u32>, Vec<bool>) {
    let (input, available) = encode_numbers(encoder, known, group, actions);
    (input.into_iter().map(f32::to_bits).collect(), available)
}

fn encode_numbers(
    encoder: &GroupEncoder,
    known: KnownEntities<'_>,
    group: &[AgentId],
    actions: usize,
) -> (Vec<f32>, Vec<bool>) {
    // Whatever the buffers held before has to be overwritten.
    let mut available_ga = vec![true; group.len() * actions];
    encoder.write_availability(known, group, &mut available_ga);
    let mut input_f = vec![f32::NAN; encoder.size()];
    encoder.encode(known, group, &available_ga, &mut input_f);
    (input_f, available_ga)
}

/// Three agents and two enemies; the pair (0, 2) knows all but agent 1 and the second enemy.
fn by_hand(features: CommonKnowledgeFeatures) -> (Vec<f32>, Vec<bool>) {
    let plain = Plain {
        sight_n: vec![9.0; 3],
        entities: 5,
    };
    #[rustfmt::skip]
    let entity_mf = [
        10.0, 20.0, 0.1,
        99.0, 99.0, 0.2,
        14.0, 23.0, 0.3,
        10.0, 24.0, 0.4,
        99.0, 99.0, 0.5,
    ];
    let known = KnownEntities::new(EntitySet::from_bits(0b01101), &entity_mf, FEATURES);
    let encoder = GroupEncoder::new(features, 2, &plain.spec(), Arc::new(plain));
    encode_numbers(&encoder, known, &ids(&[0, 2]), 3)
}

#[test]
fn complete_features_hold_places_attributes_and_availability() {
    let (input_f, available_ga) = by_hand(Complete);
    let far = 17.0_f32.sqrt() / 8.0;
    #[rustfmt::skip]
    let expected = [
        // Relative to agent 0: itself, 1 (unknown), 2, the first enemy, the second (unknown).
        1.0, 0.0, 0.0, 0.0,   0.0, 0.0, 0.0, 0.0,   1.0, 0.625, 0.5, 0.375,   1.0, 0.5, 0.0, 0.5,   0.0, 0.0, 0.0, 0.0,
        // Relative to agent 2.
        1.0, 0.625, -0.5, -0.375,   0.0, 0.0, 0.0, 0.0,   1.0, 0.0, 0.0, 0.0,   1.0, far, -0.5, 0.125,   0.0, 0.0, 0.0, 0.0,
        // Attributes.
        0.1, 0.0, 0.3, 0.4, 0.0,
        // Availability: only agent 0 is near enough to the first enemy.
        1.0, 1.0, 0.0,   1.0, 0.0, 0.0,
    ];
    assert_eq!(input_f, expected);
    assert_eq!(available_ga, [true, true, false, true, false, false]);
}

#[test]
fn thin_features_are_those_of_the_published_code() {
    let (input_f, _) = by_hand(Thin);
    let far = 17.0_f32.sqrt() / 8.0;
    #[rustfmt::skip]
    let expected = [
        // Relative to agent 0: enemies with the attack flags of agents 0 and 2, then agents 0, 2 and 1.
        1.0, 0.5, 0.0, 0.5, 0.0,   -1.0, -1.0, -1.0, -1.0, -1.0,
        1.0, 0.0, 0.0, 0.0,   1.0, 0.625, 0.5, 0.375,   -1.0, -1.0, -1.0, -1.0,
        // Relative to agent 2.
        1.0, far, -0.5, 0.125, 0.0,   -1.0, -1.0, -1.0, -1.0, -1.0,
        1.0, 0.625, -0.5, -0.375,   1.0, 0.0, 0.0, 0.0,   -1.0, -1.0, -1.0, -1.0,
    ];
    assert_eq!(input_f, expected);
}

#[test]
fn thin_features_have_the_published_sizes() {
    for (agents, entities, pair, team) in [(3, 6, 54, 81), (8, 16, 144, 576), (5, 10, 90, 225)] {
        let plain = Arc::new(Plain {
            sight_n: vec![9.0; agents],
            entities,
        });
        let size = |group| GroupEncoder::new(Thin, group, &plain.spec(), plain.clone()).size();
        assert_eq!([size(2), size(agents)], [pair, team]);
    }
}

#[test]
fn a_pair_that_knows_nothing_reads_a_constant_and_can_only_delegate() {
    let plain = Arc::new(Plain {
        sight_n: vec![9.0; 3],
        entities: 5,
    });
    let nothing = KnownEntities::new(EntitySet::EMPTY, &[7.0; 15], FEATURES);
    for (features, unknown) in [(Complete, 0.0), (Thin, -1.0)] {
        let encoder = GroupEncoder::new(features, 2, &plain.spec(), plain.clone());
        let (input_f, available_ga) = encode_numbers(&encoder, nothing, &ids(&[1, 2]), 3);
        assert!(
            input_f.iter().all(|&x| x == unknown),
            "{features:?}: {input_f:?}"
        );
        let mut mask_c = [true; 10];
        joint_mask(&available_ga, 3, 1, &mut mask_c);
        assert!(mask_c[0], "delegating is always possible");
        assert!(!mask_c[1..].contains(&true), "a joint action is possible");
    }
}

#[test]
fn the_joint_mask_is_the_outer_product_of_its_members_availability() {
    let available_ga = [true, false, true, false, true, true];
    let mut mask_c = [false; 10];
    joint_mask(&available_ga, 3, 1, &mut mask_c);
    #[rustfmt::skip]
    let expected = [
        true,
        false, true, true,
        false, false, false,
        false, true, true,
    ];
    assert_eq!(mask_c, expected);
}

#[test]
fn the_joint_mask_of_three_is_the_product_of_all() {
    let available_ga = [true, false, true, true, false, true];
    let mut mask_c = [false; 8];
    joint_mask(&available_ga, 2, 0, &mut mask_c);
    // (0, 0, 1) and (0, 1, 1).
    let expected = [false, true, false, true, false, false, false, false];
    assert_eq!(mask_c, expected);
}
