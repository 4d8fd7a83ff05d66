//! Three tiny worlds, each of which needs exactly one ability and is solved in seconds by whatever has it.
//!
//! A learner that fails in battles may lack anything; one that fails here lacks what the world is named after: to act on one's
//! own observation ([`Observe`]), to remember across steps ([`Remember`]), to coordinate on common knowledge
//! ([`Coordinate`]). Each reports how far an episode succeeded as `success`, and 1 is always within reach.

mod coordinate;
mod observe;
mod remember;

use std::sync::Arc;

pub use coordinate::{Coordinate, CoordinateSettings};
pub use observe::{Observe, ObserveSettings};
pub use remember::{Remember, RememberSettings};

use crate::{
    Action, AgentId, DeclaredKind, Draw, EntityId, EntitySet, EpisodeKey, IllegalAction,
    KnownEntities, ObservationMut, PriorKnowledge, Statistic, WorldKind,
};

/// The three as kinds of worlds.
#[must_use]
pub fn kinds() -> Vec<Arc<dyn WorldKind>> {
    vec![
        Arc::new(DeclaredKind::new(
            "sanity-observe",
            "say what you see: needs to act on one's own observation",
            |settings| Ok(Observe::new(settings)),
        )),
        Arc::new(DeclaredKind::new(
            "sanity-remember",
            "say what you saw: needs to remember across steps",
            |settings| Ok(Remember::new(settings)),
        )),
        Arc::new(DeclaredKind::new(
            "sanity-coordinate",
            "press together what both see, and nothing else: needs to coordinate on common knowledge",
            |settings| Ok(Coordinate::new(settings)),
        )),
    ]
}

/// The first agent whose action is not below `count`.
fn refuse_unknown(actions: &[Action], count: usize) -> Result<(), IllegalAction> {
    match actions.iter().position(|action| action.index() >= count) {
        None => Ok(()),
        Some(agent) => Err(IllegalAction {
            agent: AgentId::new(agent),
            action: actions[agent],
        }),
    }
}

/// The statistic that all three report.
fn success(meaning: &'static str) -> Vec<Statistic> {
    vec![Statistic::new("success", meaning)]
}

/// One of `count` symbols, drawn for `agent`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a small count"
)]
pub(crate) fn deal(key: EpisodeKey, agent: usize, count: usize) -> usize {
    (key.uniform(0, Draw::World(agent)) * count as f64) as usize
}

/// Shows every agent nothing but itself, an entity without attributes, and leaves every action open to it.
fn show_alone(out: &mut ObservationMut<'_>) {
    out.observation_no.fill(0.0);
    out.state_g.fill(0.0);
    out.entity_mf.fill(0.0);
    out.available_na.fill(true);
    for (agent, visible) in out.visible_n.iter_mut().enumerate() {
        *visible = EntitySet::from_iter([EntityId::new(agent)]);
    }
}

/// What is known before the game where every agent sees itself alone.
#[derive(Debug)]
struct Alone;

impl PriorKnowledge for Alone {
    fn sees(&self, observer: AgentId, _: &[f32], entity: EntityId, _: &[f32]) -> bool {
        entity == observer.into()
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(known.set().contains(agent));
    }

    fn action_on(&self, _entity: EntityId) -> Option<Action> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Observations, Stream, contract::check_environment};

    #[test]
    fn all_three_keep_the_contract_and_alter_what_is_unseen() {
        for kind in kinds() {
            let world = kind.build(&toml::Table::new()).unwrap();
            let coverage = check_environment(&mut *world.make(), 40);
            assert!(coverage.alterations > 20, "{}: {coverage:?}", kind.name());
            assert_eq!(world.spec().success().unwrap().name, "success");
        }
    }

    /// Plays `episodes` episodes of the kind by `choose`, which is given an agent's observation and whether it sees another;
    /// gives the mean success.
    fn success_of(kind: usize, mut choose: impl FnMut(usize, &[f32], bool) -> usize) -> f64 {
        let world = kinds()[kind].build(&toml::Table::new()).unwrap();
        let (mut environment, agents) = (world.make(), world.spec().agents);
        let mut observations = Observations::new(world.spec(), 1);
        let (mut total, episodes) = (0.0, 200);
        for episode in 0..episodes {
            let key = EpisodeKey::new(3, Stream::Other, episode);
            environment.reset(key, &mut observations.row_mut(0));
            loop {
                let actions: Vec<Action> = (0..agents)
                    .map(|agent| {
                        let view = observations.local_view(0, AgentId::new(agent));
                        let others = view.seen().set().intersection(EntitySet::first(agents));
                        Action::new(choose(agent, view.observation(), others.len() > 1))
                    })
                    .collect();
                let step = environment.step(&actions, &mut observations.row_mut(0));
                if step.unwrap().end.is_some() {
                    break;
                }
            }
            let mut statistics_s = [f64::NAN];
            environment.statistics(&mut statistics_s);
            total += statistics_s[0];
        }
        total / episodes as f64
    }

    fn shown(observation: &[f32]) -> Option<usize> {
        observation.iter().position(|shown| *shown == 1.0)
    }

    #[test]
    fn observing_is_solved_by_saying_what_is_seen_and_by_nothing_less() {
        let solved = success_of(0, |_, observation, _| shown(observation).unwrap());
        assert_eq!(solved, 1.0);
        let blind = success_of(0, |_, _, _| 0);
        assert!((0.2..0.5).contains(&blind), "{blind}");
    }

    #[test]
    fn remembering_is_solved_by_saying_what_was_seen_and_by_nothing_less() {
        let mut memory = [0; 2];
        let solved = success_of(1, |agent, observation, _| {
            memory[agent] = shown(&observation[..2]).unwrap_or(memory[agent]);
            memory[agent]
        });
        assert_eq!(solved, 1.0);
        let forgetful = success_of(1, |_, observation, _| shown(&observation[..2]).unwrap_or(0));
        assert!((0.35..0.65).contains(&forgetful), "{forgetful}");
    }

    #[test]
    fn coordinating_is_solved_by_pressing_what_is_commonly_seen_and_by_nothing_less() {
        let press = |observation: &[f32]| shown(observation).map_or(0, |lamp| 1 + lamp);
        let solved = success_of(
            2,
            |_, observation, is_common| {
                if is_common { press(observation) } else { 0 }
            },
        );
        assert_eq!(solved, 1.0);
        let careless = success_of(2, |_, observation, _| press(observation));
        assert!((0.35..0.65).contains(&careless), "{careless}");
        let idle = success_of(2, |_, _, _| 0);
        assert!((0.35..0.65).contains(&idle), "{idle}");
    }
}
