//! A map of StarCraft II as an environment.

use std::{fmt, sync::Arc, thread, time::Duration};

use mackrl_env::{
    Action, Draw, EntitySet, Environment, EnvironmentSpec, EpisodeKey, Interruption,
    ObservationMut, PriorKnowledge, StepError, TimeStep,
};
use mackrl_skirmish::{
    BattleStatistics, Encounter, Face, Scenario, SkirmishError, SkirmishSettings,
    rules::BattleState,
};

use super::{fault::GameFault, game::Game, pool::GamePool, roster::Roster};
use crate::protocol::Unit;

/// Waited before another try after a failure, and doubled with each further one.
const PAUSE: Duration = Duration::from_millis(20);
/// Longest pause between two tries.
const PAUSE_MAX: Duration = Duration::from_secs(2);

/// Hears of every loop: its number in the game, and everybody who lives.
pub type Watcher = Box<dyn FnMut(u32, &[Unit]) + Send>;

/// Episodes of one map, played in games of a pool.
pub struct StarCraft2 {
    pool: Arc<GamePool>,
    scenario: Arc<Scenario>,
    face: Face,
    /// As the game reported last; what it does not report is as at the start.
    state: BattleState,
    playing: Option<(Game, Roster)>,
    /// Why the episode is void, until the next begins.
    interruption: Option<Interruption>,
    /// Failures since an episode last ended.
    failures: u32,
    /// Whether the game is asked for a replay when an episode has ended, and the latest that it gave.
    replays: Option<Option<Result<Vec<u8>, GameFault>>>,
    watcher: Option<Watcher>,
}

impl StarCraft2 {
    /// An environment on the map of `scenario`. No game is started before the first episode begins.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] if a setting is out of range.
    pub fn new(
        scenario: Arc<Scenario>,
        settings: SkirmishSettings,
        pool: Arc<GamePool>,
    ) -> Result<Self, SkirmishError> {
        let state = Encounter::new(Arc::clone(&scenario), &settings)
            .muster()
            .clone();
        Ok(Self {
            face: Face::new(Arc::clone(&scenario), settings, &state)?,
            pool,
            scenario,
            state,
            playing: None,
            interruption: None,
            failures: 0,
            replays: None,
            watcher: None,
        })
    }

    /// How the current episode stands.
    #[must_use]
    pub const fn battle_statistics(&self) -> BattleStatistics {
        self.face.statistics()
    }

    /// Where everybody is, as the game reported last.
    #[must_use]
    pub const fn state(&self) -> &BattleState {
        &self.state
    }

    /// Asks the game for a replay whenever an episode has ended.
    pub fn keep_replays(&mut self) {
        self.replays.get_or_insert(None);
    }

    /// Lets `watcher` see every loop, which are then played one by one.
    pub fn watch(&mut self, watcher: Watcher) {
        self.watcher = Some(watcher);
    }

    /// The game up to the end of the latest episode, as a file of the game's own.
    ///
    /// # Errors
    /// [`GameFault`] if the game gave none.
    pub fn take_replay(&mut self) -> Result<Vec<u8>, GameFault> {
        let latest = self.replays.as_mut().and_then(Option::take);
        latest.unwrap_or_else(|| Err(GameFault::Launch("no episode has ended".to_owned())))
    }

    /// Begins the episode `key` in the game at hand, in an idle one, or in a new one.
    fn begin(&mut self, key: EpisodeKey) -> Result<(Game, Roster), GameFault> {
        let at_hand = self.playing.take().map(|(game, _)| game);
        let game = at_hand.or_else(|| self.pool.take());
        let (scenario, state) = (&self.scenario, &mut self.state);
        let mut muster = |units: &[Unit]| Roster::read(scenario, units, state);
        let mut game = match game {
            Some(mut game) => {
                game.restart(&mut muster)?;
                game
            }
            None => {
                self.pool.count_launch();
                let [a, b, c, d, ..] = key.bits(0, Draw::Setup(0)).to_le_bytes();
                let seed = u32::from_le_bytes([a, b, c, d]);
                let mut game = Game::launch(self.pool.settings(), scenario, seed)?;
                game.begin(&mut muster)?;
                game
            }
        };
        game.name_episode(key)?;
        // Whoever takes the name for its dice may have put the armies elsewhere.
        let roster = muster(&game.observe()?)?;
        let lost =
            || GameFault::garbage("observation", "units have vanished before the first step");
        Ok((game, roster.ok_or_else(lost)?))
    }

    /// Plays one step in the game.
    fn advance(&mut self, actions: &[Action]) -> Result<(), GameFault> {
        let Some((game, roster)) = &mut self.playing else {
            return Err(GameFault::Launch("no episode is played".to_owned()));
        };
        let (face, state) = (&self.face, &self.state);
        let orders = actions.iter().enumerate().filter_map(|(agent, action)| {
            face.order(state, agent, *action)
                .map(|order| (agent, order))
        });
        game.order(roster, orders)?;
        let loops = u32::from(self.face.settings().step_mul);
        let units = match &mut self.watcher {
            None => game.step(loops)?,
            Some(watcher) => {
                let mut units = Vec::new();
                for _ in 0..loops {
                    units = game.step(1)?;
                    watcher(game.game_loop(), &units);
                }
                units
            }
        };
        roster.update(&self.scenario, &units, &mut self.state)
    }

    /// Gives the game back after an episode that ended well.
    fn finish(&mut self) {
        let Some((mut game, _)) = self.playing.take() else {
            return;
        };
        if let Some(latest) = &mut self.replays {
            *latest = Some(game.save_replay());
        }
        self.pool.give_back(game);
    }

    /// Counts a failure, ends the game, and says whether another try makes sense.
    fn fail(&mut self, fault: &GameFault) -> Interruption {
        self.pool.count_fault(fault);
        self.playing = None;
        self.failures += 1;
        let failures_max = self.pool.settings().failures_max;
        let can_be_repeated = fault.may_pass() && self.failures < failures_max;
        let reason = if can_be_repeated || !fault.may_pass() {
            fault.to_string()
        } else {
            format!(
                "{} failures without an episode that ended, the last: {fault}",
                self.failures
            )
        };
        Interruption {
            reason,
            can_be_repeated,
        }
    }

    /// Shows a world in which everybody is dead, for whoever looks before the next step tells.
    fn show_nothing(out: &mut ObservationMut<'_>, actions: usize) {
        out.observation_no.fill(0.0);
        out.state_g.fill(0.0);
        out.visible_n.fill(EntitySet::EMPTY);
        out.entity_mf.fill(0.0);
        for (index, available) in out.available_na.iter_mut().enumerate() {
            *available = index % actions == 0;
        }
    }
}

impl Environment for StarCraft2 {
    fn spec(&self) -> &EnvironmentSpec {
        self.face.spec()
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.face.knowledge().clone()
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.interruption = None;
        let mut pause = PAUSE;
        loop {
            match self.begin(key) {
                Ok(playing) => {
                    self.playing = Some(playing);
                    self.face.begin(&self.state, out);
                    return;
                }
                Err(fault) => {
                    let interruption = self.fail(&fault);
                    if !interruption.can_be_repeated {
                        self.interruption = Some(interruption);
                        Self::show_nothing(out, self.face.spec().actions);
                        return;
                    }
                    thread::sleep(pause);
                    pause = (2 * pause).min(PAUSE_MAX);
                }
            }
        }
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        if let Some(interruption) = &self.interruption {
            return Err(interruption.clone().into());
        }
        self.face.check(&self.state, actions)?;
        if let Err(fault) = self.advance(actions) {
            let interruption = self.fail(&fault);
            self.interruption = Some(interruption.clone());
            return Err(interruption.into());
        }
        let step = self.face.settle(&self.state, actions, out);
        if step.end.is_some() {
            self.failures = 0;
            self.finish();
        }
        Ok(step)
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s.copy_from_slice(&self.face.statistics().values());
    }
}

impl fmt::Debug for StarCraft2 {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("StarCraft2")
            .field("map", &self.scenario.name)
            .field("playing", &self.playing)
            .field("failures", &self.failures)
            .finish_non_exhaustive()
    }
}
