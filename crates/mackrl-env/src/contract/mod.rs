//! The test that every environment has to pass.
//!
//! What a world promises about a state that it shows is checked at every step. What it promises about states that it does not
//! show, that they change nothing for an agent who does not see the difference, is checked on pairs of states
//! ([`Coverage`]): decentralised execution, and the certificate of it, rest on that.

mod sight;

#[cfg(test)]
mod tests;

use crate::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EpisodeKey, IllegalAction,
    Observations, Stream,
};

/// How often two states were compared that differ only beyond an agent's sight.
///
/// Whether they ever do depends on the world: where everybody sees everything, both stay 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Steps after which agents whom the observer had not seen since had acted otherwise.
    pub other_actions: u64,
    /// States that [`Environment::alter_unseen`] had changed.
    pub alterations: u64,
}

/// Plays `episodes` episodes with random available actions and checks every promise of [`Environment`] and
/// [`crate::PriorKnowledge`] at every step.
///
/// That nothing beyond an agent's sight changes its observation is checked in two ways: an episode is played again with other
/// actions of agents whom it does not see, for as long as it sees none of them and what it sees stays the same; and states are
/// altered by the world's own [`Environment::alter_unseen`]. The first needs nothing of the world; the second finds leaks of
/// what no agent acts upon.
///
/// # Panics
/// With a sentence that names the broken promise, the episode and the step.
pub fn check_environment(environment: &mut dyn Environment, episodes: u64) -> Coverage {
    let spec = environment.spec().clone();
    if let Err(problem) = spec.validate() {
        panic!("{problem}");
    }
    let mut observations = Observations::new(&spec, 1);
    let mut coverage = Coverage::default();
    for episode in 0..episodes {
        let key = EpisodeKey::new(11, Stream::Other, episode);
        let first = play(environment, key, &mut observations);
        let again = play(environment, key, &mut observations);
        assert!(
            first == again,
            "{}: episode {episode} differs when repeated",
            spec.name
        );
        sight::check(environment, key, &first, &mut coverage);
    }
    coverage
}

/// An episode as it was played: what has to be the same when it is played again.
#[derive(Debug, PartialEq)]
struct Recorded {
    /// Before each step, and after the last \[T + 1\].
    observations_t: Vec<Observations>,
    /// What was done \[T\].
    actions_t: Vec<Vec<Action>>,
    /// What it paid \[T\].
    reward_t: Vec<f32>,
    /// What was reported of it \[S\].
    statistics_s: Vec<f64>,
}

/// Plays one episode.
fn play(
    environment: &mut dyn Environment,
    key: EpisodeKey,
    observations: &mut Observations,
) -> Recorded {
    let spec = environment.spec().clone();
    let mut recorded = Recorded {
        observations_t: Vec::new(),
        actions_t: Vec::new(),
        reward_t: Vec::new(),
        statistics_s: vec![f64::NAN; spec.statistics.len()],
    };
    environment.reset(key, &mut observations.row_mut(0));
    check_observations(
        environment,
        observations,
        &format!("{} after reset", spec.name),
    );
    for step in 0..spec.episode_limit {
        let place = format!("{}, episode {}, step {step}", spec.name, key.episode);
        recorded.observations_t.push(observations.clone());
        check_illegal_action(environment, observations, &place);
        let actions: Vec<Action> = (0..spec.agents)
            .map(|agent| random_action(observations, agent, key.uniform(step, Draw::Agent(agent))))
            .collect();
        let time_step = environment
            .step(&actions, &mut observations.row_mut(0))
            .unwrap_or_else(|error| panic!("{place}: an available action was refused: {error}"));
        assert!(
            time_step.reward.is_finite(),
            "{place}: reward {}",
            time_step.reward
        );
        recorded.reward_t.push(time_step.reward);
        recorded.actions_t.push(actions);
        check_observations(environment, observations, &place);
        if time_step.end.is_some() {
            recorded.observations_t.push(observations.clone());
            environment.statistics(&mut recorded.statistics_s);
            assert!(
                recorded.statistics_s.iter().all(|x| x.is_finite()),
                "{place}: a statistic is not finite: {:?}",
                recorded.statistics_s
            );
            return recorded;
        }
    }
    panic!(
        "{}: an episode runs beyond its limit of {} steps",
        spec.name, spec.episode_limit
    );
}

fn random_action(observations: &Observations, agent: usize, uniform: f64) -> Action {
    let view = observations.local_view(0, AgentId::new(agent));
    let available: Vec<usize> = (0..view.available().len())
        .filter(|&a| view.available()[a])
        .collect();
    let choice = (uniform * available.len() as f64).floor();
    let index = (0..available.len())
        .rev()
        .find(|&i| i as f64 <= choice)
        .unwrap_or(0);
    Action::new(available[index])
}

fn check_observations(environment: &dyn Environment, observations: &Observations, place: &str) {
    let spec = environment.spec();
    let prior = environment.prior_knowledge();
    assert!(
        observations.state(0).iter().all(|x| x.is_finite()),
        "{place}: the state holds a number that is not finite"
    );
    let everything = EntitySet::first(spec.entities);
    for agent in (0..spec.agents).map(AgentId::new) {
        let view = observations.local_view(0, agent);
        let seen = view.seen();
        assert!(
            view.observation().iter().all(|x| x.is_finite()),
            "{place}: the observation of agent {agent} holds a number that is not finite"
        );
        assert!(
            view.available().contains(&true),
            "{place}: agent {agent} has no available action"
        );
        assert!(
            seen.set().is_subset_of(everything),
            "{place}: agent {agent} sees beyond M"
        );
        let Some(own) = seen.get(agent) else {
            assert!(
                seen.set().is_empty(),
                "{place}: agent {agent} sees others but not itself"
            );
            continue;
        };
        for entity in (0..spec.entities).map(EntityId::new) {
            // Whom nobody sees is dead or hidden from all; the mask speaks only of entities with features.
            let Some(features) = (0..spec.agents)
                .map(AgentId::new)
                .find_map(|other| observations.local_view(0, other).seen().get(entity))
            else {
                continue;
            };
            assert_eq!(
                prior.sees(agent, own, entity, features),
                seen.set().contains(entity),
                "{place}: what agent {agent} sees of entity {entity} differs from its mask"
            );
        }
        check_availability(environment, observations, agent, place);
    }
}

fn check_availability(
    environment: &dyn Environment,
    observations: &Observations,
    agent: AgentId,
    place: &str,
) {
    let spec = environment.spec();
    let prior = environment.prior_knowledge();
    let view = observations.local_view(0, agent);
    let mut known = vec![false; spec.actions];
    prior.available(view.seen(), agent, &mut known);
    assert_eq!(
        known,
        view.available(),
        "{place}: availability of agent {agent} by its own view"
    );
    for entity in view.seen().set().iter() {
        let fewer = view.seen().set().difference([entity].into_iter().collect());
        prior.available(view.seen().restricted_to(fewer), agent, &mut known);
        let subset = known
            .iter()
            .zip(view.available())
            .all(|(known, truth)| !known || *truth);
        assert!(
            subset,
            "{place}: knowing less made an action of agent {agent} available"
        );
    }
}

fn check_illegal_action(
    environment: &mut dyn Environment,
    observations: &mut Observations,
    place: &str,
) {
    let spec = environment.spec().clone();
    let first_available = |agent| random_action(observations, agent, 0.0);
    let mut actions: Vec<Action> = (0..spec.agents).map(first_available).collect();
    let unavailable = (0..spec.agents).rev().find_map(|agent| {
        let available = observations.local_view(0, AgentId::new(agent)).available();
        available
            .iter()
            .position(|available| !available)
            .map(|action| (agent, action))
    });
    let Some((agent, action)) = unavailable else {
        return;
    };
    actions[agent] = Action::new(action);
    let refused = environment.step(&actions, &mut observations.row_mut(0));
    let error = refused.expect_err("an unavailable action is refused");
    let expected = IllegalAction {
        agent: AgentId::new(agent),
        action: Action::new(action),
    };
    assert_eq!(
        error,
        expected.into(),
        "{place}: the wrong agent or action is named"
    );
}
