//! A map in play as the game server sees it: tags, orders, loops, and the script that begins the battle anew.

use std::sync::Arc;

use mackrl_env::{Action, EpisodeKey, Stream};
use mackrl_skirmish::{
    Encounter, Face, Scenario, SkirmishSettings,
    rules::{BattleState, Chance, Order, Team, UnitIndex},
};

/// Loops of an environment step: dice are named by steps, as in the built-in simulator.
const LOOPS_OF_STEP: u32 = 8;
/// Where tags begin; those of the real game lie above 2³² too.
const FIRST_TAG: u64 = 1 << 32;
/// Units that share the upper part of a tag.
const UNITS_OF_ARMY: u64 = 256;
/// Steps of an episode that are remembered for replays, at most.
const RECORDED_STEPS_MAX: usize = 100_000;

/// A map in play. Its time is the game loop; it knows nothing of steps, rewards or episode limits.
#[derive(Debug)]
pub struct Arena {
    encounter: Encounter,
    seed: u64,
    /// Armies that have appeared, from 0.
    armies: u64,
    key: EpisodeKey,
    /// Loops since the armies appeared.
    loops: u32,
    /// Loops since the game began.
    game_loop: u32,
    chance: Chance,
    record: EpisodeRecord,
    /// Reads orders as SMAC's actions.
    face: Face,
    orders: Vec<Option<Order>>,
}

/// What was done since the armies appeared, in SMAC's actions.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeRecord {
    /// Name of the map.
    pub map: String,
    /// The episode, by which its dice are named.
    pub key: EpisodeKey,
    /// Each step's actions, one per agent, and a hash of the state after it.
    pub steps: Vec<(Vec<Action>, u64)>,
    /// What in the orders is no action of SMAC's, if anything was.
    pub problem: Option<String>,
}

impl Arena {
    /// Puts both armies of `scenario` on the field; the dice of the n-th battle follow from `seed` and n.
    ///
    /// # Panics
    /// Never: the settings of the face are the built-in ones.
    #[must_use]
    pub fn new(scenario: Arc<Scenario>, seed: u64) -> Self {
        let settings = SkirmishSettings::default();
        let encounter = Encounter::new(Arc::clone(&scenario), &settings);
        let face = Face::new(Arc::clone(&scenario), settings, encounter.muster())
            .expect("built-in settings are valid");
        let key = EpisodeKey::new(seed, Stream::Other, 0);
        let mut arena = Self {
            orders: vec![None; scenario.agents],
            record: EpisodeRecord::new(&scenario.name, key),
            chance: Chance::new(key, 1),
            encounter,
            face,
            seed,
            armies: 0,
            key,
            loops: 0,
            game_loop: 0,
        };
        arena.begin(key);
        arena
    }

    /// The map.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        self.encounter.scenario()
    }

    /// Everybody, the dead included.
    #[must_use]
    pub fn state(&self) -> &BattleState {
        self.encounter.battle().state()
    }

    /// Loops since the game began.
    #[must_use]
    pub const fn game_loop(&self) -> u32 {
        self.game_loop
    }

    /// What was done since the armies appeared.
    #[must_use]
    pub const fn record(&self) -> &EpisodeRecord {
        &self.record
    }

    /// The name of unit number `unit` of the armies on the field.
    #[must_use]
    pub const fn tag(&self, unit: usize) -> u64 {
        FIRST_TAG + self.armies * UNITS_OF_ARMY + unit as u64
    }

    /// The living unit called `tag`.
    #[must_use]
    pub fn find(&self, tag: u64) -> Option<UnitIndex> {
        let unit = tag.checked_sub(self.tag(0))?;
        let index = usize::try_from(unit).ok()?;
        let found = self.state().units.get(index)?;
        UnitIndex::try_from(unit).ok().filter(|_| found.is_alive())
    }

    /// Names the battle that has just begun, so that its dice are those of the episode `key`; returns whether it was in time,
    /// before the first loop.
    pub fn name(&mut self, key: EpisodeKey) -> bool {
        let is_in_time = self.loops == 0;
        if is_in_time {
            self.begin(key);
        }
        is_in_time
    }

    /// Gives an order to a unit of the agents' side; returns whether it was understood.
    pub fn order(&mut self, unit: UnitIndex, order: Order) -> bool {
        let Some(latest) = self.orders.get_mut(usize::from(unit)) else {
            return false;
        };
        if latest.is_some() {
            self.record
                .problem
                .get_or_insert_with(|| "a unit has two orders in one step".to_owned());
        }
        *latest = Some(order);
        self.encounter.order(unit, order);
        true
    }

    /// Takes a unit off the field.
    pub fn kill(&mut self, unit: UnitIndex) {
        self.encounter.remove(unit);
        self.record
            .problem
            .get_or_insert_with(|| "units were killed from outside".to_owned());
    }

    /// Plays `count` loops. If nobody was left before them, both armies appear anew at their end.
    ///
    /// The maps' script does that at some moment after the last death; clients look only after their step, so here the new
    /// armies stand as they will until then.
    pub fn step(&mut self, count: u32) {
        let is_empty = self.state().units.iter().all(|unit| !unit.is_alive());
        if is_empty {
            self.game_loop = self.game_loop.saturating_add(count);
            self.armies += 1;
            self.begin(EpisodeKey::new(self.seed, Stream::Other, self.armies));
            return;
        }
        let actions = self.actions(count);
        for _ in 0..count {
            if self.loops.is_multiple_of(LOOPS_OF_STEP) {
                let step = self.loops / LOOPS_OF_STEP + 1;
                self.chance = Chance::new(self.key, step as usize);
            }
            self.encounter.advance(&mut self.chance);
            self.loops = self.loops.saturating_add(1);
            self.game_loop = self.game_loop.saturating_add(1);
        }
        self.record.close_step(actions, self.state().hash());
        self.orders.fill(None);
    }

    fn begin(&mut self, key: EpisodeKey) {
        self.key = key;
        self.loops = 0;
        self.encounter.begin(key);
        self.record = EpisodeRecord::new(&self.scenario().name, key);
        self.orders.fill(None);
    }

    /// The orders since the latest step as actions, if every agent did one.
    fn actions(&self, count: u32) -> Result<Vec<Action>, String> {
        if count != LOOPS_OF_STEP {
            return Err(format!(
                "a step has {count} loops, expected {LOOPS_OF_STEP}"
            ));
        }
        let state = self.state();
        let actions = self.face.spec().actions;
        (0..self.orders.len())
            .map(|agent| {
                let order = self.orders[agent];
                (0..actions)
                    .map(Action::new)
                    .filter(|action| self.face.is_available(state, agent, *action))
                    .find(|action| self.face.order(state, agent, *action) == order)
                    .ok_or_else(|| {
                        format!("agent {agent} has order {order:?}, which is no available action")
                    })
            })
            .collect()
    }
}

impl EpisodeRecord {
    fn new(map: &str, key: EpisodeKey) -> Self {
        Self {
            map: map.to_owned(),
            key,
            steps: Vec::new(),
            problem: None,
        }
    }

    fn close_step(&mut self, actions: Result<Vec<Action>, String>, hash: u64) {
        if self.problem.is_some() {
            return;
        }
        match actions {
            Ok(actions) if self.steps.len() < RECORDED_STEPS_MAX => {
                self.steps.push((actions, hash));
            }
            Ok(_) => self.problem = Some(format!("more than {RECORDED_STEPS_MAX} steps")),
            Err(problem) => self.problem = Some(problem),
        }
    }
}

/// The player's number of a side.
pub(super) const fn owner(team: Team) -> i32 {
    match team {
        Team::Ally => crate::protocol::OWNER_ALLY,
        Team::Enemy => crate::protocol::OWNER_ENEMY,
    }
}
