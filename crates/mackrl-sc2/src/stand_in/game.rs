//! The protocol: one request, one response, and what the program is to do next.

use std::{fmt, sync::Arc};

use mackrl_env::EpisodeKey;
use mackrl_skirmish::{
    Scenario, UnitData,
    rules::{Order, UnitIndex},
    scenario::map_names,
    unit_types::UnitTypes,
};

use super::{
    answers,
    arena::{Arena, EpisodeRecord},
};
use crate::{
    protocol::{
        Action, CreateGame, DIFFICULTY_VERY_HARD, JoinGame, PlayerType, Request, RequestAction,
        RequestDebug, Response, ResponseAction, ResponseCreateGame, ResponseDebug,
        ResponseJoinGame, ResponseQuit, ResponseSaveReplay, ResponseStep, Status, UnitCommand,
        ability, debug_command, request, response, unit_command,
    },
    units,
};

/// Loops of a step, at most: longer ones would keep the client waiting for minutes.
const LOOPS_MAX: u32 = 100_000;
/// Map units from the origin beyond which no order leads.
const FARTHEST: f32 = 64.0;
/// Results of orders, by the game's numbers.
const SUCCESS: i32 = 1;
const NOT_SUPPORTED: i32 = 2;
const ERROR: i32 = 3;
/// Errors of making a game, by the game's numbers.
const MISSING_MAP: i32 = 1;
const INVALID_MAP_PATH: i32 = 2;
/// The error of joining with what is not there, by the game's number.
const FEATURE_UNSUPPORTED: i32 = 7;

/// What the stand-in does not serve, in a sentence.
pub const NOT_SERVED: &str = "this is mackrl's stand-in, which serves SMAC's 23 maps to one client with raw observations, and not \
    SMACv2, feature layers, rendered images, several clients, or bots that build";

/// Writes an episode as a replay file.
pub type ReplayWriter = Box<dyn Fn(&EpisodeRecord) -> Result<Vec<u8>, String> + Send>;

/// A game program without its socket.
pub struct Game {
    status: Status,
    arena: Option<Arena>,
    units: UnitData,
    /// Seed of games whose client names none.
    seed: u64,
    /// That of the computer, as the client asked for it.
    difficulty: i32,
    replays: Option<ReplayWriter>,
}

impl Game {
    /// A program that has been launched, whose units have the statistics `units`. `seed` is that of games without one.
    #[must_use]
    pub fn new(units: UnitData, seed: u64, replays: Option<ReplayWriter>) -> Self {
        Self {
            status: Status::Launched,
            arena: None,
            units,
            seed,
            difficulty: DIFFICULTY_VERY_HARD,
            replays,
        }
    }

    /// The map in play.
    #[must_use]
    pub const fn arena(&self) -> Option<&Arena> {
        self.arena.as_ref()
    }

    /// How far the program is; [`Status::Quit`] when it has been asked to end.
    #[must_use]
    pub const fn status(&self) -> Status {
        self.status
    }

    /// Answers one request. What cannot be answered is told in the response, as the game does.
    pub fn answer(&mut self, request: &Request) -> Response {
        let answer = match &request.kind {
            Some(kind) => self.answer_kind(kind),
            None => Err(format!(
                "a request of a kind that is not known; {NOT_SERVED}"
            )),
        };
        let (kind, error) = match answer {
            Ok(kind) => (Some(kind), Vec::new()),
            Err(problem) => (None, vec![problem]),
        };
        Response {
            kind,
            id: request.id,
            error,
            status: Some(self.status.into()),
        }
    }

    /// The response to bytes that are no request.
    #[must_use]
    pub fn answer_garbage(&self) -> Response {
        Response {
            kind: None,
            id: None,
            error: vec!["a message that is no request".to_owned()],
            status: Some(self.status.into()),
        }
    }

    fn answer_kind(&mut self, kind: &request::Kind) -> Result<response::Kind, String> {
        use request::Kind;
        Ok(match kind {
            Kind::Ping(_) => response::Kind::Ping(answers::ping()),
            Kind::Quit(_) => {
                self.status = Status::Quit;
                response::Kind::Quit(ResponseQuit {})
            }
            Kind::CreateGame(create) => response::Kind::CreateGame(self.create(create)),
            Kind::JoinGame(join) => response::Kind::JoinGame(self.join(join)?),
            Kind::GameInfo(_) => {
                response::Kind::GameInfo(answers::game_info(self.playing()?, self.difficulty))
            }
            Kind::Observation(_) => {
                response::Kind::Observation(answers::observation(self.playing()?))
            }
            Kind::Data(_) => response::Kind::Data(answers::data(self.playing()?)),
            Kind::Action(action) => response::Kind::Action(self.act(action)?),
            Kind::Step(step) => response::Kind::Step(self.step(step.count.unwrap_or(1))?),
            Kind::Debug(debug) => response::Kind::Debug(self.debug(debug)?),
            Kind::SaveReplay(_) => response::Kind::SaveReplay(self.save_replay()?),
            other => return Err(format!("{} is not served; {NOT_SERVED}", other.name())),
        })
    }

    fn create(&mut self, create: &CreateGame) -> ResponseCreateGame {
        let refusal = |error: i32, details: String| ResponseCreateGame {
            error: Some(error),
            error_details: Some(details),
        };
        let path = create
            .local_map
            .as_ref()
            .and_then(|map| map.map_path.as_deref());
        let Some(path) = path else {
            return refusal(MISSING_MAP, "no local_map.map_path".to_owned());
        };
        let name = units::map_name(path).unwrap_or(path);
        match scenario(name, self.units) {
            Ok(scenario) => {
                let seed = create.random_seed.map_or(self.seed, u64::from);
                self.arena = Some(Arena::new(scenario, seed));
                let computer = create
                    .player_setup
                    .iter()
                    .find(|player| player.r#type == Some(PlayerType::Computer.into()));
                self.difficulty = computer
                    .and_then(|computer| computer.difficulty)
                    .unwrap_or(DIFFICULTY_VERY_HARD);
                self.status = Status::InitGame;
                ResponseCreateGame::default()
            }
            Err(problem) => refusal(INVALID_MAP_PATH, problem),
        }
    }

    fn join(&mut self, join: &JoinGame) -> Result<ResponseJoinGame, String> {
        if self.status != Status::InitGame {
            return Err(format!(
                "cannot join a game in status {:?}, expected InitGame",
                self.status
            ));
        }
        let options = join.options.unwrap_or_default();
        let wanted = [
            (options.feature_layer, "feature layers"),
            (options.render, "rendered images"),
        ];
        if let Some((_, name)) = wanted.iter().find(|(options, _)| options.is_some()) {
            return Ok(ResponseJoinGame {
                player_id: None,
                error: Some(FEATURE_UNSUPPORTED),
                error_details: Some(format!(
                    "{name} are not served, join with raw observations alone; {NOT_SERVED}"
                )),
            });
        }
        self.status = Status::InGame;
        Ok(ResponseJoinGame {
            player_id: Some(answers::AGENTS_PLAYER),
            error: None,
            error_details: None,
        })
    }

    fn act(&mut self, request: &RequestAction) -> Result<ResponseAction, String> {
        let arena = self.playing_mut()?;
        let result = request
            .actions
            .iter()
            .map(|action| act(arena, action))
            .collect();
        Ok(ResponseAction { result })
    }

    fn step(&mut self, count: u32) -> Result<ResponseStep, String> {
        if count > LOOPS_MAX {
            return Err(format!(
                "a step of {count} loops, expected at most {LOOPS_MAX}"
            ));
        }
        let arena = self.playing_mut()?;
        arena.step(count);
        Ok(ResponseStep {
            simulation_loop: Some(arena.game_loop()),
        })
    }

    fn debug(&mut self, request: &RequestDebug) -> Result<ResponseDebug, String> {
        let arena = self.playing_mut()?;
        for command in &request.debug {
            let Some(debug_command::Kind::KillUnit(kill)) = &command.kind else {
                return Err(format!(
                    "a debug command other than kill_unit is not served; {NOT_SERVED}"
                ));
            };
            for tag in &kill.tag {
                if let Some(unit) = arena.find(*tag) {
                    arena.kill(unit);
                }
            }
        }
        Ok(ResponseDebug {})
    }

    fn save_replay(&self) -> Result<ResponseSaveReplay, String> {
        let record = self.playing()?.record();
        let writer = self
            .replays
            .as_ref()
            .ok_or("this server writes no replays")?;
        if let Some(problem) = &record.problem {
            return Err(format!(
                "no replay of orders that are not SMAC's actions: {problem}"
            ));
        }
        Ok(ResponseSaveReplay {
            data: Some(writer(record)?),
        })
    }

    fn playing(&self) -> Result<&Arena, String> {
        let arena = self
            .arena
            .as_ref()
            .filter(|_| self.status == Status::InGame);
        arena.ok_or_else(|| format!("no game is played in status {:?}", self.status))
    }

    fn playing_mut(&mut self) -> Result<&mut Arena, String> {
        let status = self.status;
        let arena = self.arena.as_mut().filter(|_| status == Status::InGame);
        arena.ok_or_else(|| format!("no game is played in status {status:?}"))
    }
}

impl fmt::Debug for Game {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Game")
            .field("status", &self.status)
            .field("arena", &self.arena)
            .finish_non_exhaustive()
    }
}

/// The shipped map called `name`.
fn scenario(name: &str, data: UnitData) -> Result<Arc<Scenario>, String> {
    let types = UnitTypes::load(data).map_err(|error| error.to_string())?;
    match Scenario::shipped(name, &types) {
        Some(scenario) => Ok(Arc::new(scenario.map_err(|error| error.to_string())?)),
        None => {
            let name: String = name.chars().take(80).collect();
            Err(format!(
                "no map is called {name:?}, expected one of {}; {NOT_SERVED}",
                map_names().join(", ")
            ))
        }
    }
}

/// Does one action; the result is the game's number for what came of it.
fn act(arena: &mut Arena, action: &Action) -> i32 {
    if let Some(chat) = &action.action_chat {
        let key = chat.message.as_deref().and_then(crate::episode_name::parse);
        return key.map_or(SUCCESS, |key| name(arena, key));
    }
    let command = action
        .action_raw
        .as_ref()
        .and_then(|raw| raw.unit_command.as_ref());
    let Some(command) = command else {
        return NOT_SUPPORTED;
    };
    if command.queue_command == Some(true) {
        return NOT_SUPPORTED;
    }
    let Some(order) = order(arena, command) else {
        return ERROR;
    };
    let mut result = SUCCESS;
    for tag in &command.unit_tags {
        let is_done = arena
            .find(*tag)
            .is_some_and(|unit| arena.order(unit, order));
        if !is_done {
            result = ERROR;
        }
    }
    result
}

fn name(arena: &mut Arena, key: EpisodeKey) -> i32 {
    if arena.name(key) { SUCCESS } else { ERROR }
}

/// What a command means here.
fn order(arena: &Arena, command: &UnitCommand) -> Option<Order> {
    let target = |is_own: bool| {
        let Some(unit_command::Target::UnitTag(tag)) = command.target else {
            return None;
        };
        let is_of_side =
            |unit: &UnitIndex| (usize::from(*unit) < arena.scenario().agents) == is_own;
        arena.find(tag).filter(is_of_side)
    };
    let place = || {
        let Some(unit_command::Target::WorldSpacePos(at)) = command.target else {
            return None;
        };
        let at = [at.x.unwrap_or_default(), at.y.unwrap_or_default()];
        let is_near = at.iter().all(|part| part.abs() <= FARTHEST);
        is_near.then_some(at)
    };
    match command.ability_id? {
        ability::STOP => Some(Order::Stop),
        ability::MOVE => Some(Order::Move { to: place()? }),
        ability::HEAL => Some(Order::Heal {
            target: target(true)?,
        }),
        ability::ATTACK => match place() {
            Some(to) => Some(Order::AttackMove { to }),
            None => Some(Order::Attack {
                target: target(false)?,
            }),
        },
        _ => None,
    }
}
