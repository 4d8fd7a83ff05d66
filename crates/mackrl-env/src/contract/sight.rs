//! Whether what an agent does not see changes anything for it.

use super::{Coverage, Recorded, random_action};
use crate::{AgentId, Draw, EntitySet, Environment, EpisodeKey, LocalView, Observations, Stream};

/// Agents that are examined in an episode, at most.
const AGENTS_MAX: usize = 4;

/// Plays the episode again from each of a few agents' points of view, in states that differ beyond its sight.
pub(super) fn check(
    environment: &mut dyn Environment,
    key: EpisodeKey,
    recorded: &Recorded,
    coverage: &mut Coverage,
) {
    let agents = environment.spec().agents;
    let first = below(agents, key.uniform(0, Draw::Setup(0)));
    for agent in (0..agents.min(AGENTS_MAX)).map(|i| AgentId::new((first + i) % agents)) {
        let draw = Draw::Setup(1 + agent.index());
        let mut again = Again {
            observations: Observations::new(environment.spec(), 1),
            environment,
            recorded,
            key,
            agent,
        };
        let with_strangers: Vec<usize> = (0..recorded.actions_t.len())
            .filter(|&step| !strangers(&recorded.observations_t[step], agent, agents).is_empty())
            .collect();
        if !with_strangers.is_empty() {
            let from = with_strangers[below(with_strangers.len(), key.uniform(1, draw))];
            coverage.other_actions += again.let_strangers_act_otherwise(from);
        }
        let at = below(recorded.actions_t.len(), key.uniform(2, draw));
        coverage.alterations += again.alter(at);
    }
}

/// A number below `count` at `uniform`, in [0, 1), of the way.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a small count"
)]
fn below(count: usize, uniform: f64) -> usize {
    (uniform * count as f64) as usize
}

/// Living agents that `agent`, if it lives, does not see.
fn strangers(observations: &Observations, agent: AgentId, agents: usize) -> EntitySet {
    let seen = observations.local_view(0, agent).seen().set();
    let is_stranger = |other: &AgentId| {
        let lives = !observations.visible(0)[other.index()].is_empty();
        lives && !seen.is_empty() && !seen.contains(*other)
    };
    (0..agents).map(AgentId::new).filter(is_stranger).collect()
}

/// An episode that is played again from the point of view of one agent.
struct Again<'a> {
    environment: &'a mut dyn Environment,
    observations: Observations,
    recorded: &'a Recorded,
    key: EpisodeKey,
    agent: AgentId,
}

impl Again<'_> {
    /// Repeats the first `steps` steps.
    fn repeat(&mut self, steps: usize) {
        let row = &mut self.observations.row_mut(0);
        self.environment.reset(self.key, row);
        for actions in &self.recorded.actions_t[..steps] {
            let step = self.environment.step(actions, row);
            step.expect("the same actions were available before");
        }
    }

    /// From step `from` on, lets agents act otherwise while this one does not see them, and compares what it observes, until
    /// it sees one of them, or sees anything else than before. Gives the number of states compared that were different.
    fn let_strangers_act_otherwise(&mut self, from: usize) -> u64 {
        self.repeat(from);
        let agents = self.environment.spec().agents;
        let otherwise = EpisodeKey::new(12, Stream::Other, self.key.episode);
        let mut strange = EntitySet::EMPTY;
        let mut compared = 0;
        for step in from..self.recorded.actions_t.len() {
            strange = strange.union(strangers(&self.observations, self.agent, agents));
            let mut actions = self.recorded.actions_t[step].clone();
            for (agent, action) in (0..agents).map(AgentId::new).zip(&mut actions) {
                let view = self.observations.local_view(0, agent);
                if strange.contains(agent) {
                    let uniform = otherwise.uniform(step, Draw::Agent(agent.index()));
                    *action = random_action(&self.observations, agent.index(), uniform);
                } else if !view.available()[action.index()] {
                    return compared;
                }
            }
            let row = &mut self.observations.row_mut(0);
            let time_step = self.environment.step(&actions, row);
            let time_step = time_step.expect("only available actions are chosen");
            let is_last = step + 1 == self.recorded.actions_t.len();
            if time_step.end.is_some() != is_last {
                return compared;
            }
            let before = &self.recorded.observations_t[step + 1];
            let [old, new] = [before, &self.observations].map(|all| all.local_view(0, self.agent));
            let meets = !new.seen().set().intersection(strange).is_empty();
            if meets || new.seen().set().is_empty() || !sees_the_same(old, new) {
                return compared;
            }
            self.compare(
                before,
                step + 1,
                "agents that it does not see acted otherwise",
            );
            compared += u64::from(*before != self.observations);
        }
        compared
    }

    /// Lets the world alter what the agent does not see before step `at`. Gives the number of states compared that were
    /// different.
    fn alter(&mut self, at: usize) -> u64 {
        self.repeat(at);
        let row = &mut self.observations.row_mut(0);
        if !self.environment.alter_unseen(self.agent, self.key, row) {
            return 0;
        }
        let before = &self.recorded.observations_t[at];
        let [old, new] = [before, &self.observations].map(|all| all.local_view(0, self.agent));
        let place = self.place(at);
        assert!(
            sees_the_same(old, new),
            "{place}: the world altered what the agent does not see, and its view changed"
        );
        self.compare(before, at, "the world altered what it does not see");
        u64::from(*before != self.observations)
    }

    /// That the agent, which sees what it saw `before`, observes what it observed.
    fn compare(&self, before: &Observations, step: usize, why: &str) {
        let place = self.place(step);
        let [old, new] = [before, &self.observations].map(|all| all.local_view(0, self.agent));
        let mut numbers = old.observation().iter().zip(new.observation());
        let leak = numbers.position(|(old, new)| old.to_bits() != new.to_bits());
        assert!(
            leak.is_none(),
            "{place}: {why}, and number {} of its observation changed",
            leak.unwrap_or_default()
        );
        assert_eq!(
            old.available(),
            new.available(),
            "{place}: {why}, and its available actions changed"
        );
    }

    fn place(&self, step: usize) -> String {
        let (name, episode) = (&self.environment.spec().name, self.key.episode);
        format!(
            "{name}, episode {episode}, before step {step}, agent {}",
            self.agent
        )
    }
}

/// Whether two views hold the same entities with the same features.
fn sees_the_same(one: LocalView<'_>, other: LocalView<'_>) -> bool {
    let (one, other) = (one.seen(), other.seen());
    let bits = |features: Option<&[f32]>| -> Vec<u32> {
        features
            .into_iter()
            .flatten()
            .map(|x| x.to_bits())
            .collect()
    };
    one.set() == other.set()
        && one
            .set()
            .iter()
            .all(|e| bits(one.get(e)) == bits(other.get(e)))
}
