//! One episode, with all that is needed to play it again or to draw it.

use std::fmt;

use mackrl::config::EnvironmentConfig;
use mackrl_env::{
    Action, Environment, EpisodeEnd, EpisodeKey, EpisodeStatistics, Observations,
    skirmish::{
        Skirmish,
        rules::BattleState,
        scripted::{ScriptedPolicy, ScriptedTeam},
    },
};
use serde::Serialize;

/// One episode that was played.
pub(super) struct Episode {
    /// The world.
    pub(super) map: EnvironmentConfig,
    /// The world after the last step.
    pub(super) skirmish: Skirmish,
    /// Who played, if a script did.
    pub(super) policy: ScriptedPolicy,
    /// Which episode it was.
    pub(super) key: EpisodeKey,
    /// State at the start.
    pub(super) start: BattleState,
    /// What happened.
    pub(super) steps: Vec<Step>,
    /// Why it ended.
    pub(super) end: Option<EpisodeEnd>,
}

/// One step, and the state after it.
#[derive(Debug)]
pub(super) struct Step {
    pub(super) actions: Vec<Action>,
    pub(super) reward: f32,
    pub(super) state: BattleState,
    pub(super) hash: u64,
}

/// How an episode went.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    map: String,
    policy: &'static str,
    seed: u64,
    episode: u64,
    battle_won: bool,
    #[serde(rename = "return")]
    total: f64,
    ep_length: usize,
    dead_allies: usize,
    dead_enemies: usize,
    state_hash: String,
}

impl Episode {
    /// Plays the episode `key` on `map` by a script.
    pub(super) fn play(
        map: &EnvironmentConfig,
        policy: ScriptedPolicy,
        key: EpisodeKey,
    ) -> anyhow::Result<Self> {
        let mut episode = Self::new(map, policy, key)?;
        let mut team = ScriptedTeam::new(policy, &episode.skirmish);
        let mut observations = Observations::new(episode.skirmish.spec(), 1);
        episode.begin(&mut observations);
        let mut actions = vec![Action::default(); episode.skirmish.spec().agents];
        while episode.end.is_none() {
            team.act(&observations, 0, (key, episode.steps.len()), &mut actions);
            episode.advance(actions.clone(), &mut observations)?;
        }
        Ok(episode)
    }

    /// An episode that has not begun.
    pub(super) fn new(
        map: &EnvironmentConfig,
        policy: ScriptedPolicy,
        key: EpisodeKey,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            skirmish: map.skirmish()?,
            map: map.clone(),
            policy,
            key,
            start: BattleState::default(),
            steps: Vec::new(),
            end: None,
        })
    }

    /// Puts everybody at their places.
    pub(super) fn begin(&mut self, observations: &mut Observations) {
        self.skirmish.reset(self.key, &mut observations.row_mut(0));
        self.start = self.skirmish.battle().state().clone();
    }

    /// Plays one step.
    pub(super) fn advance(
        &mut self,
        actions: Vec<Action>,
        observations: &mut Observations,
    ) -> anyhow::Result<()> {
        let time_step = self.skirmish.step(&actions, &mut observations.row_mut(0))?;
        self.end = time_step.end;
        self.steps.push(Step {
            actions,
            reward: time_step.reward,
            state: self.skirmish.battle().state().clone(),
            hash: self.skirmish.state_hash(),
        });
        Ok(())
    }

    /// The state after `step` steps.
    pub(super) fn state(&self, step: usize) -> &BattleState {
        let index = step.checked_sub(1);
        index.map_or(&self.start, |index| &self.steps[index].state)
    }

    /// How it went.
    pub(super) fn summary(&self) -> Summary {
        let EpisodeStatistics {
            battle_won,
            dead_allies,
            dead_enemies,
        } = self.skirmish.statistics();
        Summary {
            map: self.map.map.clone(),
            policy: self.policy.name(),
            seed: self.key.seed,
            episode: self.key.episode,
            battle_won,
            total: self.steps.iter().map(|step| f64::from(step.reward)).sum(),
            ep_length: self.steps.len(),
            dead_allies,
            dead_enemies,
            state_hash: format!("{:016x}", self.skirmish.state_hash()),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            map,
            policy,
            battle_won,
            total,
            ep_length,
            dead_allies,
            dead_enemies,
            state_hash,
            ..
        } = self;
        let outcome = if *battle_won { "won" } else { "not won" };
        write!(
            formatter,
            "{map} by {policy}, {outcome} after {ep_length} steps, return {total:.2}, \
             allies lost: {dead_allies}, enemies lost: {dead_enemies}, state {state_hash}"
        )
    }
}
