//! One game in its process: ordered about, stepped, begun anew.

use mackrl_env::EpisodeKey;
use mackrl_skirmish::rules::Order;

use super::{client::Client, fault::GameFault, process::GameProcess, roster::Roster};
use crate::{
    episode_name,
    protocol::{
        Action, ActionChat, ActionRaw, DebugCommand, DebugKillUnit, OWNER_ALLY, OWNER_ENEMY,
        Point2D, RequestAction, RequestDebug, RequestGameInfo, RequestObservation,
        RequestSaveReplay, RequestStep, ResponseGameInfo, Status, Unit, UnitCommand, ability,
        debug_command, request, response, unit_command,
    },
};

/// Loops that SMAC lets pass after killing everybody.
const RESTART_LOOPS: u32 = 2;
/// Loops after which new armies should have appeared.
const MUSTER_LOOPS_MAX: u32 = 500;

/// A game that is played.
#[derive(Debug)]
pub struct Game {
    // The client first: it is dropped, and says goodbye, before the process is killed.
    pub(super) client: Client,
    pub(super) process: GameProcess,
    /// Loops since the game began.
    pub(super) game_loop: u32,
    /// Everybody who was seen last, on either side.
    pub(super) living: Vec<u64>,
}

impl Game {
    /// Loops since the game began.
    #[must_use]
    pub const fn game_loop(&self) -> u32 {
        self.game_loop
    }

    /// What does not change in a game.
    ///
    /// # Errors
    /// As every request.
    pub fn info(&mut self) -> Result<ResponseGameInfo, GameFault> {
        match self.ask(request::Kind::GameInfo(RequestGameInfo {}))? {
            response::Kind::GameInfo(info) => Ok(info),
            other => Err(unexpected("game_info", &other)),
        }
    }

    /// Everybody who lives.
    ///
    /// # Errors
    /// As every request; also if time has not passed as it should have.
    pub fn observe(&mut self) -> Result<Vec<Unit>, GameFault> {
        let answer = self.ask(request::Kind::Observation(RequestObservation::default()))?;
        let response::Kind::Observation(answer) = answer else {
            return Err(unexpected("observation", &answer));
        };
        let observation = answer.observation.unwrap_or_default();
        let game_loop = observation.game_loop.unwrap_or_default();
        if game_loop < self.game_loop || self.game_loop == 0 && game_loop > MUSTER_LOOPS_MAX {
            let problem = format!("loop {game_loop}, expected {}", self.game_loop);
            return Err(GameFault::garbage("observation", problem));
        }
        self.game_loop = game_loop;
        let raw = observation.raw_data;
        let units = raw
            .ok_or_else(|| GameFault::garbage("observation", "no units"))?
            .units;
        let fights = |unit: &&Unit| matches!(unit.owner, Some(OWNER_ALLY | OWNER_ENEMY));
        self.living = units
            .iter()
            .filter(fights)
            .filter_map(|unit| unit.tag)
            .collect();
        Ok(units)
    }

    /// Lets `count` loops pass and looks.
    ///
    /// # Errors
    /// As every request; also if another number of loops has passed.
    pub fn step(&mut self, count: u32) -> Result<Vec<Unit>, GameFault> {
        let answer = self.ask(request::Kind::Step(RequestStep { count: Some(count) }))?;
        if !matches!(answer, response::Kind::Step(_)) {
            return Err(unexpected("step", &answer));
        }
        let expected = self.game_loop + count;
        let units = self.observe()?;
        if self.game_loop != expected {
            let problem = format!("loop {}, expected {expected}", self.game_loop);
            return Err(GameFault::garbage("observation", problem));
        }
        Ok(units)
    }

    /// Gives orders, each to one unit, by the tags of `roster`.
    ///
    /// # Errors
    /// As every request.
    pub(super) fn order(
        &mut self,
        roster: &Roster,
        orders: impl Iterator<Item = (usize, Order)>,
    ) -> Result<(), GameFault> {
        let actions = orders.map(|(unit, order)| Action {
            action_raw: Some(ActionRaw {
                unit_command: Some(command(roster, unit, order)),
            }),
            action_chat: None,
        });
        self.act(actions.collect())
    }

    /// Says in the game's chat which episode this is.
    ///
    /// # Errors
    /// As every request.
    pub fn name_episode(&mut self, key: EpisodeKey) -> Result<(), GameFault> {
        self.act(vec![Action {
            action_raw: None,
            action_chat: Some(ActionChat {
                channel: Some(1),
                message: Some(episode_name::format(key)),
            }),
        }])
    }

    /// Kills everybody, so that the map's script brings new armies, and waits until `muster` recognises them.
    pub(super) fn restart(
        &mut self,
        muster: impl FnMut(&[Unit]) -> Result<Option<Roster>, GameFault>,
    ) -> Result<Roster, GameFault> {
        let dead = self.living.clone();
        let kind = Some(debug_command::Kind::KillUnit(DebugKillUnit {
            tag: dead.clone(),
        }));
        let answer = self.ask(request::Kind::Debug(RequestDebug {
            debug: vec![DebugCommand { kind }],
        }))?;
        if !matches!(answer, response::Kind::Debug(_)) {
            return Err(unexpected("debug", &answer));
        }
        let units = self.step(RESTART_LOOPS)?;
        self.muster(units, &dead, muster)
    }

    /// Waits for the armies of a new game.
    pub(super) fn begin(
        &mut self,
        muster: impl FnMut(&[Unit]) -> Result<Option<Roster>, GameFault>,
    ) -> Result<Roster, GameFault> {
        let units = self.observe()?;
        self.muster(units, &[], muster)
    }

    /// The game so far as a file.
    ///
    /// # Errors
    /// As every request.
    pub fn save_replay(&mut self) -> Result<Vec<u8>, GameFault> {
        match self.ask(request::Kind::SaveReplay(RequestSaveReplay {}))? {
            response::Kind::SaveReplay(replay) => Ok(replay.data.unwrap_or_default()),
            other => Err(unexpected("save_replay", &other)),
        }
    }

    /// Lets loops pass until armies stand there of which nobody is among the `dead`.
    fn muster(
        &mut self,
        mut units: Vec<Unit>,
        dead: &[u64],
        mut muster: impl FnMut(&[Unit]) -> Result<Option<Roster>, GameFault>,
    ) -> Result<Roster, GameFault> {
        for _ in 0..MUSTER_LOOPS_MAX {
            if let Some(roster) = muster(&units)?
                && !roster.has_any(dead)
            {
                return Ok(roster);
            }
            units = self.step(1)?;
        }
        let problem = format!("no complete armies within {MUSTER_LOOPS_MAX} loops");
        Err(GameFault::garbage("observation", problem))
    }

    fn act(&mut self, actions: Vec<Action>) -> Result<(), GameFault> {
        // What becomes of single orders is not looked at, nor does SMAC: a unit may refuse one and goes on with the last.
        match self.ask(request::Kind::Action(RequestAction { actions }))? {
            response::Kind::Action(_) => Ok(()),
            other => Err(unexpected("action", &other)),
        }
    }

    /// Asks something of a game that is played.
    pub(super) fn ask(&mut self, kind: request::Kind) -> Result<response::Kind, GameFault> {
        let (answer, status) = self.client.ask(kind)?;
        if status == Status::InGame {
            return Ok(answer);
        }
        Err(GameFault::garbage(
            "a request",
            format!("status {status:?}, expected InGame"),
        ))
    }
}

/// A game that may be healthy is asked to go before its process is killed.
impl Drop for Game {
    fn drop(&mut self) {
        self.client.quit();
    }
}

fn command(roster: &Roster, unit: usize, order: Order) -> UnitCommand {
    let place = |[x, y]: [f32; 2]| {
        Some(unit_command::Target::WorldSpacePos(Point2D {
            x: Some(x),
            y: Some(y),
        }))
    };
    let other = |target: u8| {
        Some(unit_command::Target::UnitTag(
            roster.tag(usize::from(target)),
        ))
    };
    let (ability_id, target) = match order {
        Order::Stop | Order::Hunt => (ability::STOP, None),
        Order::Move { to } => (ability::MOVE, place(to)),
        Order::AttackMove { to } => (ability::ATTACK, place(to)),
        Order::Attack { target } => (ability::ATTACK, other(target)),
        Order::Heal { target } => (ability::HEAL, other(target)),
    };
    UnitCommand {
        ability_id: Some(ability_id),
        target,
        unit_tags: vec![roster.tag(unit)],
        queue_command: Some(false),
    }
}

pub(super) fn unexpected(request: &'static str, answer: &response::Kind) -> GameFault {
    let text: String = format!("{answer:?}").chars().take(60).collect();
    GameFault::garbage(request, format!("the answer to something else: {text}"))
}
