//! Worlds that break a promise are caught.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use super::{Coverage, check_environment};
use crate::{
    Action, AgentId, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd, EpisodeKey,
    KnownEntities, ObservationMut, PriorKnowledge, StepError, TimeStep,
    sanity::{Observe, ObserveSettings},
};

/// What a corridor tells that it must not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leak {
    Nothing,
    /// The observation holds the other agent's place.
    OtherAgent,
    /// The observation holds where the treasure is, which no agent moves.
    Treasure,
    /// An action is available where the treasure is, seen or not.
    Availability,
    /// What is seen depends on where the treasure is.
    Sight,
}

const PLACES: usize = 8;
const TREASURE: usize = 2;
/// To stay, to go back, to go on, to dig.
const ACTIONS: usize = 4;

/// Two agents walk in a corridor with a wall in its middle; they see as far as one place, but not through the wall. A treasure
/// lies somewhere.
#[derive(Debug, Clone)]
struct Corridor {
    spec: EnvironmentSpec,
    leak: Leak,
    place_m: [usize; 3],
    steps: usize,
}

#[derive(Debug)]
struct Walls;

/// Whether one place can be seen from another: the wall stands between 3 and 4.
fn is_in_sight(from: usize, to: usize) -> bool {
    from.abs_diff(to) <= 1 && (from < PLACES / 2) == (to < PLACES / 2)
}

fn place(features_f: &[f32]) -> usize {
    features_f.iter().position(|x| *x == 1.0).expect("one-hot")
}

impl PriorKnowledge for Walls {
    fn sees(&self, observer: AgentId, own_f: &[f32], entity: EntityId, other_f: &[f32]) -> bool {
        entity == observer.into() || is_in_sight(place(own_f), place(other_f))
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(false);
        let Some(own) = known.get(agent).map(place) else {
            return;
        };
        let digs = known.get(EntityId::new(TREASURE)).map(place) == Some(own);
        available_a.copy_from_slice(&[true, own > 0, own + 1 < PLACES, digs]);
    }

    fn action_on(&self, _entity: EntityId) -> Option<Action> {
        None
    }
}

impl Corridor {
    fn new(leak: Leak) -> Self {
        Self {
            spec: EnvironmentSpec {
                name: "corridor".to_owned(),
                agents: 2,
                entities: 3,
                entity_features: PLACES,
                position_features: 0,
                actions: ACTIONS,
                observation_size: 1,
                state_size: 3,
                episode_limit: 11,
                distance_scale: 1.0,
                statistics: Vec::new(),
                success: None,
            },
            leak,
            place_m: [0; 3],
            steps: 0,
        }
    }

    fn sees(&self, agent: usize, entity: usize) -> bool {
        let sees = is_in_sight(self.place_m[agent], self.place_m[entity]);
        match self.leak {
            Leak::Sight if entity < 2 => sees && self.place_m[TREASURE] > 0,
            _ => sees,
        }
    }

    fn show(&self, out: &mut ObservationMut<'_>) {
        out.entity_mf.fill(0.0);
        for (entity, &place) in self.place_m.iter().enumerate() {
            out.entity_mf[entity * PLACES + place] = 1.0;
            out.state_g[entity] = place as f32;
        }
        for agent in 0..2 {
            let is_seen =
                |entity: &EntityId| entity.index() == agent || self.sees(agent, entity.index());
            let seen: EntitySet = (0..3).map(EntityId::new).filter(is_seen).collect();
            out.visible_n[agent] = seen;
            out.observation_no[agent] = match self.leak {
                Leak::OtherAgent => self.place_m[1 - agent] as f32,
                Leak::Treasure => self.place_m[TREASURE] as f32,
                _ => seen.len() as f32,
            };
            let known = KnownEntities::new(seen, out.entity_mf, PLACES);
            let available_a = &mut out.available_na[agent * ACTIONS..][..ACTIONS];
            Walls.available(known, AgentId::new(agent), available_a);
            if self.leak == Leak::Availability {
                available_a[3] = self.place_m[TREASURE].is_multiple_of(2);
            }
        }
    }
}

impl Environment for Corridor {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::new(Walls)
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        let draw = |i| crate::sanity::deal(key, i, PLACES);
        (self.place_m, self.steps) = ([draw(0), draw(1), draw(2)], 0);
        self.show(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        let shown = Observable::of(self);
        for (agent, action) in actions.iter().enumerate() {
            if !shown.available[agent * ACTIONS + action.index()] {
                let agent = AgentId::new(agent);
                return Err(crate::IllegalAction {
                    agent,
                    action: *action,
                }
                .into());
            }
        }
        for (place, action) in self.place_m.iter_mut().zip(actions) {
            match action.index() {
                1 => *place -= 1,
                2 => *place += 1,
                _ => {}
            }
        }
        self.steps += 1;
        self.show(out);
        let is_over = self.steps == self.spec.episode_limit;
        Ok(TimeStep {
            reward: 0.0,
            end: is_over.then_some(EpisodeEnd::Truncated),
        })
    }

    fn statistics(&self, _statistics_s: &mut [f64]) {}

    fn alter_unseen(
        &mut self,
        agent: AgentId,
        _key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        let own = self.place_m[agent.index()];
        if is_in_sight(own, self.place_m[TREASURE]) {
            return false;
        }
        let mut unseen = (0..PLACES).filter(|place| !is_in_sight(own, *place));
        let elsewhere = unseen.rfind(|place| *place != self.place_m[TREASURE]);
        self.place_m[TREASURE] = elsewhere.expect("most places are out of sight");
        self.show(out);
        true
    }
}

/// What a corridor shows now.
struct Observable {
    available: Vec<bool>,
}

impl Observable {
    fn of(corridor: &Corridor) -> Self {
        let mut observations = crate::Observations::new(&corridor.spec, 1);
        let mut row = observations.row_mut(0);
        corridor.show(&mut row);
        Self {
            available: row.available_na.to_vec(),
        }
    }
}

/// The sentence by which `environment` is refused, or what was covered.
fn verdict(mut environment: impl Environment) -> Result<Coverage, String> {
    let checked = catch_unwind(AssertUnwindSafe(|| check_environment(&mut environment, 20)));
    checked.map_err(|panic| match panic.downcast::<String>() {
        Ok(message) => *message,
        Err(panic) => panic
            .downcast_ref::<&str>()
            .map_or_else(String::new, |s| (*s).to_owned()),
    })
}

#[test]
fn a_world_whose_sight_depends_on_walls_keeps_the_contract() {
    let coverage = verdict(Corridor::new(Leak::Nothing)).unwrap();
    assert!(coverage.other_actions > 20, "{coverage:?}");
    assert!(coverage.alterations > 20, "{coverage:?}");
}

#[test]
fn a_world_that_tells_of_an_agent_out_of_sight_is_refused() {
    let refused = verdict(Corridor::new(Leak::OtherAgent)).unwrap_err();
    let expected =
        "agents that it does not see acted otherwise, and number 0 of its observation changed";
    assert!(refused.contains(expected), "{refused}");
}

#[test]
fn a_world_that_tells_of_what_nobody_moves_is_refused() {
    let refused = verdict(Corridor::new(Leak::Treasure)).unwrap_err();
    let expected =
        "the world altered what it does not see, and number 0 of its observation changed";
    assert!(refused.contains(expected), "{refused}");
}

#[test]
fn a_world_in_which_the_unseen_decides_what_is_available_or_seen_is_refused() {
    let refused = verdict(Corridor::new(Leak::Availability)).unwrap_err();
    assert!(refused.contains("availability of agent"), "{refused}");
    let refused = verdict(Corridor::new(Leak::Sight)).unwrap_err();
    assert!(refused.contains("differs from its mask"), "{refused}");
}

#[test]
fn a_world_of_more_entities_than_can_be_told_apart_is_refused_in_words() {
    let agents = EntitySet::CAPACITY + 1;
    let crowd = Observe::new(ObserveSettings { agents, symbols: 2 });
    assert_eq!(
        verdict(crowd).unwrap_err(),
        "world `sanity-observe`: entities: 129, expected 1 to 128"
    );
}
