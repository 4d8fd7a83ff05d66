//! A replay played again, with every state at hand.

use mackrl::policy::GroupThought;
use mackrl_env::{Action, AgentId, EntitySet, Environment, EpisodeEnd, Observations};
use mackrl_skirmish::{BattleStatistics, Skirmish, rules::BattleState};

use super::{GroupKnowledge, Replay, ReplayError, Step, hexadecimal};

/// A replay that was simulated again and found to go as recorded.
#[derive(Debug, Clone)]
pub struct Playback {
    /// The world, after the last step.
    pub skirmish: Skirmish,
    /// What was before each step and after the last \[T + 1\].
    pub moments: Vec<Moment>,
    /// Rewards \[T\].
    pub reward_t: Vec<f32>,
    /// Why it ended; `None` if the recording stops before the end.
    pub end: Option<EpisodeEnd>,
    /// How it ended.
    pub statistics: BattleStatistics,
}

/// One moment of a battle.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The battle.
    pub state: BattleState,
    /// What every agent sees \[N\].
    pub visible_n: Vec<EntitySet>,
}

impl Replay {
    /// Plays it again and compares every state, and what every pair commonly knew, with what is recorded.
    ///
    /// # Errors
    /// [`ReplayError::Differs`] with the first step that does, [`ReplayError::Damaged`] if the world cannot be built or an action
    /// not be taken.
    pub fn play(&self) -> Result<Playback, ReplayError> {
        let invalid = |error: String| ReplayError::Damaged(format!("damaged replay: env: {error}"));
        let skirmish = (self.env.skirmish()).map_err(|error| invalid(error.to_string()))?;
        let mut observations = Observations::new(skirmish.spec(), 1);
        let mut playback = Playback {
            skirmish,
            moments: Vec::new(),
            reward_t: Vec::new(),
            end: None,
            statistics: BattleStatistics::default(),
        };
        playback.begin(self, &mut observations);
        for (index, step) in self.steps.iter().enumerate() {
            playback
                .check(step)
                .and_then(|()| playback.advance(step, &mut observations))
                .map_err(|problem| match problem {
                    Problem::Impossible(message) => {
                        let place = format!("damaged replay: step {}", index + 1);
                        ReplayError::Damaged(format!("{place}: {message}"))
                    }
                    Problem::Differs(found) => ReplayError::Differs {
                        step: index + 1,
                        found,
                        recorded: step.state_hash.chars().take(16).collect(),
                    },
                })?;
        }
        playback.statistics = playback.skirmish.battle_statistics();
        Ok(playback)
    }
}

/// What can be wrong with a step.
enum Problem {
    /// It cannot be played.
    Impossible(String),
    /// It leads to the state with this hash.
    Differs(String),
}

impl Playback {
    /// T: the number of steps.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.reward_t.len()
    }

    /// What `group` knows before step `step`, counted from 0, or after the last.
    ///
    /// # Panics
    /// If there is no such step or no such agent.
    #[must_use]
    pub fn knowledge(&self, step: usize, group: &[AgentId]) -> GroupKnowledge {
        GroupKnowledge::of(group, &self.moments[step].visible_n)
    }

    fn begin(&mut self, replay: &Replay, observations: &mut Observations) {
        self.skirmish
            .reset(replay.key, &mut observations.row_mut(0));
        self.remember(observations);
    }

    fn remember(&mut self, observations: &Observations) {
        self.moments.push(Moment {
            state: self.skirmish.battle().state().clone(),
            visible_n: observations.visible(0).to_vec(),
        });
    }

    /// Whether the step can be taken, and says what is true of the moment before it.
    fn check(&self, step: &Step) -> Result<(), Problem> {
        let spec = self.skirmish.spec();
        let impossible = |message| Err(Problem::Impossible(message));
        if self.end.is_some() {
            return impossible("the episode is over, expected no more steps".to_owned());
        }
        if step.actions.len() != spec.agents {
            let (found, agents) = (step.actions.len(), spec.agents);
            return impossible(format!(
                "{found} actions, expected one for each of {agents} agents"
            ));
        }
        let beyond = |action: &&Action| action.index() >= spec.actions;
        if let Some(action) = step.actions.iter().find(beyond) {
            return impossible(format!(
                "action {action}, expected less than {}",
                spec.actions
            ));
        }
        self.check_thought(step).map_or(Ok(()), impossible)
    }

    /// What is wrong with the numbers in the step's thought, if something is.
    fn check_thought(&self, step: &Step) -> Option<String> {
        let thought = step.thought.as_ref()?;
        let spec = self.skirmish.spec();
        let is_agent = |agent: &AgentId| agent.index() < spec.agents;
        let is_action = |action: &Action| action.index() < spec.actions;
        let groups = thought.partitions.iter().flat_map(|p| &p.groups).flatten();
        let mut named = groups
            .chain(thought.groups.iter().flat_map(|group| &group.members))
            .chain(thought.pairs.iter().flat_map(|pair| &pair.members))
            .chain(thought.agents.iter().map(|agent| &agent.agent));
        if let Some(agent) = named.find(|agent| !is_agent(agent)) {
            return Some(format!("agent {agent}, expected less than {}", spec.agents));
        }
        let joint = thought.pairs.iter().flat_map(|pair| &pair.joint);
        let solo = thought.agents.iter().flat_map(|agent| &agent.options);
        let team = thought.groups.iter().flat_map(|group| &group.joint);
        let mut taken = joint
            .flat_map(|option| &option.actions)
            .chain(team.flat_map(|option| &option.actions))
            .chain(solo.map(|option| &option.action));
        if let Some(action) = taken.find(|action| !is_action(action)) {
            return Some(format!(
                "action {action}, expected less than {}",
                spec.actions
            ));
        }
        let has_all = |group: &GroupThought| {
            let mut joint = group.joint.iter();
            joint.all(|option| option.actions.len() == group.members.len())
        };
        if !thought.groups.iter().all(has_all) {
            return Some("a joint action that is not one of each member".to_owned());
        }
        if let Some(number) = numbers_that_cannot_be(step) {
            return Some(number);
        }
        let is_chosen = match thought.chosen {
            Some(chosen) => chosen < thought.partitions.len(),
            None => thought.partitions.is_empty(),
        };
        if !is_chosen {
            return Some("the chosen partition is none of those in force".to_owned());
        }
        let visible_n = &self.moments.last()?.visible_n;
        let wrong = thought.pairs.iter().find(|pair| {
            let known = GroupKnowledge::of(&pair.members, visible_n).common;
            !pair.known.iter().copied().eq(known.iter())
        })?;
        let [first, second] = wrong.members;
        Some(format!(
            "common knowledge of agents {first} and {second} is not that of the battle"
        ))
    }

    fn advance(&mut self, step: &Step, observations: &mut Observations) -> Result<(), Problem> {
        let time_step = self
            .skirmish
            .step(&step.actions, &mut observations.row_mut(0))
            .map_err(|error| Problem::Impossible(error.to_string()))?;
        self.end = time_step.end;
        self.reward_t.push(time_step.reward);
        self.remember(observations);
        let hash = hexadecimal(self.skirmish.state_hash());
        if hash == step.state_hash {
            Ok(())
        } else {
            Err(Problem::Differs(hash))
        }
    }
}

/// A number in the step's thought that is no probability, or a value that is no number.
fn numbers_that_cannot_be(step: &Step) -> Option<String> {
    /// What sums of rounded numbers may be more than 1.
    const ROUNDING: f64 = 1e-3;
    let thought = step.thought.as_ref()?;
    if step.value.is_some_and(|value| !value.is_finite()) {
        return Some("a value that is not finite".to_owned());
    }
    let partitions = thought.partitions.iter();
    let partitions = partitions.flat_map(|partition| [partition.probability, partition.posterior]);
    let pairs = thought.pairs.iter().flat_map(|pair| {
        let joint = pair.joint.iter().map(|option| option.probability);
        joint.chain([pair.delegate, pair.posterior_joint, pair.posterior_delegate])
    });
    let options = thought.agents.iter().flat_map(|agent| &agent.options);
    let options = options.map(|option| option.probability);
    let team = thought.groups.iter().flat_map(|group| &group.joint);
    let options = options.chain(team.map(|option| option.probability));
    let ways = [thought.log_p_path.exp(), thought.log_p.exp()];
    let numbers = partitions.chain(pairs).chain(options).map(f64::from);
    let wrong = numbers
        .chain(ways)
        .find(|number| !(0.0..=1.0 + ROUNDING).contains(number))?;
    Some(format!("probability {wrong}, expected a number in [0, 1]"))
}
