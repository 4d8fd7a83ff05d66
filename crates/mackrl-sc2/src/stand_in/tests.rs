//! What clients of the game rely on, and what hostile ones get.

use mackrl_env::{Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{SkirmishSettings, UnitData, scenario::map_names};
use prost::Message;

use super::*;
use crate::{
    episode_name,
    protocol::{
        Action, ActionChat, ActionRaw, CreateGame, DebugCommand, DebugKillUnit, InterfaceOptions,
        JoinGame, LocalMap, PlayerSetup, PlayerType, Point2D, Request, RequestAction, RequestDebug,
        RequestGameInfo, RequestObservation, RequestPing, RequestSaveReplay, RequestStep, Response,
        Status, Unit, UnitCommand, Unread, ability, debug_command, request, response, unit_command,
    },
    units,
};

/// A client of a game without a socket.
struct Client {
    game: Game,
    asked: u32,
}

impl Client {
    fn playing(map: &str, seed: Option<u32>) -> Self {
        let mut client = Self {
            game: Game::new(UnitData::Liberty, 1, None),
            asked: 0,
        };
        client.ask(request::Kind::CreateGame(create(map, seed)));
        client.ask(request::Kind::JoinGame(JoinGame::default()));
        client
    }

    fn ask(&mut self, kind: request::Kind) -> response::Kind {
        let response = self.try_ask(kind);
        assert!(response.error.is_empty(), "{:?}", response.error);
        response.kind.unwrap()
    }

    fn try_ask(&mut self, kind: request::Kind) -> Response {
        self.asked += 1;
        let request = Request {
            kind: Some(kind),
            id: Some(self.asked),
        };
        let response = self.game.answer(&request);
        assert_eq!(response.id, Some(self.asked));
        response
    }

    fn units(&mut self) -> Vec<Unit> {
        let answer = self.ask(request::Kind::Observation(RequestObservation::default()));
        let response::Kind::Observation(observation) = answer else {
            panic!("{answer:?}");
        };
        observation.observation.unwrap().raw_data.unwrap().units
    }

    fn step(&mut self, count: u32) {
        self.ask(request::Kind::Step(RequestStep { count: Some(count) }));
    }

    fn kill_all(&mut self) {
        let tag = self.units().iter().filter_map(|unit| unit.tag).collect();
        let kind = Some(debug_command::Kind::KillUnit(DebugKillUnit { tag }));
        self.ask(request::Kind::Debug(RequestDebug {
            debug: vec![DebugCommand { kind }],
        }));
    }

    fn command(&mut self, command: UnitCommand) -> Vec<i32> {
        let action = Action {
            action_raw: Some(ActionRaw {
                unit_command: Some(command),
            }),
            action_chat: None,
        };
        self.act(action)
    }

    fn act(&mut self, action: Action) -> Vec<i32> {
        let request = RequestAction {
            actions: vec![action],
        };
        let answer = self.ask(request::Kind::Action(request));
        let response::Kind::Action(answer) = answer else {
            panic!("{answer:?}");
        };
        answer.result
    }
}

fn create(map: &str, random_seed: Option<u32>) -> CreateGame {
    CreateGame {
        local_map: Some(LocalMap {
            map_path: Some(units::map_path(map)),
            map_data: None,
        }),
        random_seed,
        ..CreateGame::default()
    }
}

fn place(unit: &Unit) -> [f32; 2] {
    let pos = unit.pos.unwrap();
    [pos.x.unwrap(), pos.y.unwrap()]
}

#[test]
fn a_program_goes_from_launched_over_made_to_played() {
    let mut client = Client {
        game: Game::new(UnitData::Liberty, 1, None),
        asked: 0,
    };
    let refused = client.try_ask(request::Kind::Step(RequestStep::default()));
    assert!(
        refused.error[0].contains("no game is played"),
        "{refused:?}"
    );
    for (kind, status) in [
        (request::Kind::Ping(RequestPing {}), Status::Launched),
        (
            request::Kind::CreateGame(create("3m", None)),
            Status::InitGame,
        ),
        (request::Kind::JoinGame(JoinGame::default()), Status::InGame),
        (request::Kind::GameInfo(RequestGameInfo {}), Status::InGame),
    ] {
        let response = client.try_ask(kind);
        assert!(response.error.is_empty(), "{response:?}");
        assert_eq!(response.status, Some(status.into()));
    }
}

#[test]
fn an_unknown_map_is_refused_with_the_names_of_all() {
    let mut game = Game::new(UnitData::Liberty, 1, None);
    let response = game.answer(&Request {
        kind: Some(request::Kind::CreateGame(create("4m", None))),
        id: None,
    });
    let Some(response::Kind::CreateGame(refused)) = response.kind else {
        panic!("{response:?}");
    };
    assert_eq!(refused.error, Some(2));
    let details = refused.error_details.unwrap();
    assert!(
        details.contains("\"4m\"") && details.contains("2c_vs_64zg"),
        "{details}"
    );
    assert_eq!(response.status, Some(Status::Launched.into()));
}

#[test]
fn players_are_numbered_and_the_computer_has_the_difficulty_that_was_asked_for() {
    let mut client = Client {
        game: Game::new(UnitData::Liberty, 1, None),
        asked: 0,
    };
    let mut setup = create("3m", None);
    setup.player_setup = vec![
        PlayerSetup {
            r#type: Some(PlayerType::Participant.into()),
            ..PlayerSetup::default()
        },
        PlayerSetup {
            r#type: Some(PlayerType::Computer.into()),
            difficulty: Some(3),
            ..PlayerSetup::default()
        },
    ];
    client.ask(request::Kind::CreateGame(setup));
    client.ask(request::Kind::JoinGame(JoinGame::default()));
    let answer = client.ask(request::Kind::GameInfo(RequestGameInfo {}));
    let response::Kind::GameInfo(info) = answer else {
        panic!("{answer:?}");
    };
    let players = info.player_info.iter();
    let told: Vec<_> = players
        .map(|player| (player.player_id, player.difficulty))
        .collect();
    assert_eq!(told, [(Some(1), None), (Some(2), Some(3))]);
    let answer = client.ask(request::Kind::Observation(RequestObservation::default()));
    let response::Kind::Observation(seen) = answer else {
        panic!("{answer:?}");
    };
    let common = seen.observation.unwrap().player_common.unwrap();
    assert_eq!(common.player_id, Some(1));
}

/// Fields 14 (`query`) and 5 (`leave_game`) with contents that are not read, and field 90, which is none.
#[test]
fn a_request_that_is_not_served_is_named() {
    let mut client = Client::playing("3m", None);
    for (bytes, name) in [
        (&[0x72, 0x02, 0x08, 0x01][..], "query is not served"),
        (&[0x2A, 0x00], "leave_game is not served"),
        (&[0xD2, 0x05, 0x00], "a request of a kind that is not known"),
    ] {
        let response = client.game.answer(&Request::decode(bytes).unwrap());
        assert!(response.kind.is_none());
        assert!(response.error[0].starts_with(name), "{response:?}");
        assert!(response.error[0].ends_with(NOT_SERVED), "{response:?}");
    }
}

#[test]
fn images_are_refused_when_a_client_joins() {
    let layers = InterfaceOptions {
        raw: Some(true),
        feature_layer: Some(Unread {}),
        ..InterfaceOptions::default()
    };
    let rendered = InterfaceOptions {
        render: Some(Unread {}),
        ..InterfaceOptions::default()
    };
    for (options, name) in [(layers, "feature layers"), (rendered, "rendered images")] {
        let mut client = Client {
            game: Game::new(UnitData::Liberty, 1, None),
            asked: 0,
        };
        client.ask(request::Kind::CreateGame(create("3m", None)));
        let join = |options| {
            request::Kind::JoinGame(JoinGame {
                race: None,
                options,
            })
        };
        let answer = client.ask(join(Some(options)));
        let response::Kind::JoinGame(refused) = answer else {
            panic!("{answer:?}");
        };
        assert_eq!((refused.player_id, refused.error), (None, Some(7)));
        let details = refused.error_details.unwrap();
        assert!(details.starts_with(name), "{details}");
        assert_eq!(client.game.status(), Status::InitGame);
        let raw = InterfaceOptions {
            raw: Some(true),
            ..InterfaceOptions::default()
        };
        client.ask(join(Some(raw)));
        assert_eq!(client.game.status(), Status::InGame);
    }
}

#[test]
fn every_map_begins_with_the_armies_of_the_simulator() {
    for map in map_names() {
        let mut client = Client::playing(map, None);
        let found = client.units();
        let mut skirmish = mackrl_skirmish::make(map, &SkirmishSettings::default()).unwrap();
        let mut observations = Observations::new(skirmish.spec(), 1);
        let key = EpisodeKey::new(1, Stream::Other, 0);
        skirmish.reset(key, &mut observations.row_mut(0));
        let state = skirmish.battle().state();
        assert_eq!(found.len(), state.units.len(), "{map}");
        for (index, unit) in found.iter().enumerate() {
            assert_eq!(place(unit), [state.x[index], state.y[index]], "{map}");
        }
        // SMAC sorts its agents by (type, x, y); they have to come out in our order.
        let agents: Vec<&Unit> = found.iter().filter(|unit| unit.owner == Some(1)).collect();
        assert!(
            agents.is_sorted_by(|a, b| (a.unit_type, place(a)) <= (b.unit_type, place(b))),
            "{map}"
        );
    }
}

#[test]
fn killing_everybody_brings_both_armies_back_under_new_tags() {
    let mut client = Client::playing("2s3z", None);
    let before = client.units();
    client.step(24);
    client.kill_all();
    assert!(client.units().is_empty(), "the dead are absent");
    client.step(2);
    let after = client.units();
    assert_eq!(after.len(), before.len());
    for (new, old) in after.iter().zip(&before) {
        assert_ne!(new.tag, old.tag);
        assert_eq!(new.unit_type, old.unit_type);
        assert_eq!((new.health, new.shield), (old.health, old.shield));
    }
}

#[test]
fn loops_played_in_any_portions_give_the_same_battle() {
    let play = |portions: &[u32]| {
        let mut client = Client::playing("3m", Some(5));
        portions.iter().for_each(|count| client.step(*count));
        client.units()
    };
    let whole = play(&[8; 12]);
    assert_eq!(whole, play(&[1; 96]));
    assert_eq!(whole, play(&[5, 3, 13, 75]));
}

#[test]
fn orders_reach_units_of_the_own_side_only() {
    let mut client = Client::playing("3m", None);
    let before = client.units();
    let to = |unit: &Unit| {
        let [x, y] = place(unit);
        let at = Point2D {
            x: Some(x - 2.0),
            y: Some(y),
        };
        UnitCommand {
            ability_id: Some(ability::MOVE),
            target: Some(unit_command::Target::WorldSpacePos(at)),
            unit_tags: vec![unit.tag.unwrap()],
            queue_command: Some(false),
        }
    };
    assert_eq!(client.command(to(&before[0])), [1]);
    assert_eq!(
        client.command(to(&before[4])),
        [3],
        "an enemy takes no orders"
    );
    let nowhere = Point2D {
        x: Some(f32::NAN),
        y: Some(0.0),
    };
    let command = UnitCommand {
        target: Some(unit_command::Target::WorldSpacePos(nowhere)),
        ..to(&before[1])
    };
    assert_eq!(client.command(command), [3]);
    let friend = UnitCommand {
        ability_id: Some(ability::ATTACK),
        target: Some(unit_command::Target::UnitTag(before[1].tag.unwrap())),
        ..to(&before[0])
    };
    assert_eq!(client.command(friend), [3], "a friend is no target");
    client.step(8);
    let after = client.units();
    assert!(place(&after[0])[0] < place(&before[0])[0] - 1.0);
    assert_eq!(place(&after[1]), place(&before[1]));
}

#[test]
fn a_named_episode_is_the_simulators_to_the_bit() {
    let key = EpisodeKey::new(7, Stream::Training, 11);
    let mut skirmish = mackrl_skirmish::make("2m_vs_1z", &SkirmishSettings::default()).unwrap();
    let mut observations = Observations::new(skirmish.spec(), 1);
    skirmish.reset(key, &mut observations.row_mut(0));
    let mut client = Client::playing("2m_vs_1z", None);
    let chat = Action {
        action_raw: None,
        action_chat: Some(ActionChat {
            channel: Some(1),
            message: Some(episode_name::format(key)),
        }),
    };
    assert_eq!(client.act(chat.clone()), [1]);
    for _ in 0..5 {
        client.step(8);
        let stop = [1, 1].map(mackrl_env::Action::new);
        skirmish.step(&stop, &mut observations.row_mut(0)).unwrap();
    }
    let arena = client.game.arena().unwrap();
    assert_eq!(arena.state().x, skirmish.battle().state().x);
    assert_eq!(arena.state().y, skirmish.battle().state().y);
    assert_eq!(client.act(chat), [3], "too late to name a battle");
}

#[test]
fn what_was_done_is_remembered_as_actions() {
    let mut client = Client::playing("3m", Some(5));
    for unit in client.units().iter().take(3) {
        let stop = UnitCommand {
            ability_id: Some(ability::STOP),
            target: None,
            unit_tags: vec![unit.tag.unwrap()],
            queue_command: None,
        };
        assert_eq!(client.command(stop), [1]);
    }
    client.step(8);
    let record = client.game.arena().unwrap().record();
    assert_eq!(record.problem, None);
    assert_eq!(record.steps.len(), 1);
    assert_eq!(record.steps[0].0, [1, 1, 1].map(mackrl_env::Action::new));
    client.step(8);
    let refused = client.try_ask(request::Kind::SaveReplay(RequestSaveReplay {}));
    assert!(
        refused.error[0].contains("writes no replays"),
        "{refused:?}"
    );
    let problem = client
        .game
        .arena()
        .unwrap()
        .record()
        .problem
        .clone()
        .unwrap();
    assert!(problem.starts_with("agent 0 has order None"), "{problem}");
}

/// Requests of a client that plays, as bytes.
fn traffic() -> Vec<Vec<u8>> {
    let mut client = Client::playing("MMM", None);
    let units = client.units();
    let actions = units.iter().take(10).map(|unit| Action {
        action_raw: Some(ActionRaw {
            unit_command: Some(UnitCommand {
                ability_id: Some(ability::ATTACK),
                target: Some(unit_command::Target::UnitTag(units[12].tag.unwrap())),
                unit_tags: vec![unit.tag.unwrap()],
                queue_command: Some(false),
            }),
        }),
        action_chat: None,
    });
    let kinds = [
        request::Kind::Ping(RequestPing {}),
        request::Kind::CreateGame(create("MMM", Some(3))),
        request::Kind::JoinGame(JoinGame::default()),
        request::Kind::GameInfo(RequestGameInfo {}),
        request::Kind::Observation(RequestObservation::default()),
        request::Kind::Action(RequestAction {
            actions: actions.collect(),
        }),
        request::Kind::Step(RequestStep { count: Some(8) }),
        request::Kind::Debug(RequestDebug {
            debug: vec![DebugCommand {
                kind: Some(debug_command::Kind::KillUnit(DebugKillUnit {
                    tag: units.iter().filter_map(|unit| unit.tag).collect(),
                })),
            }],
        }),
        request::Kind::SaveReplay(RequestSaveReplay {}),
    ];
    let request = |(id, kind)| Request {
        kind: Some(kind),
        id: Some(id),
    };
    (1..)
        .zip(kinds)
        .map(|pair| request(pair).encode_to_vec())
        .collect()
}

#[test]
fn no_mutation_of_real_traffic_makes_the_server_panic() {
    let traffic = traffic();
    let key = EpisodeKey::new(23, Stream::Other, 0);
    let mut understood = 0;
    for round in 0..400 {
        let mut game = Game::new(UnitData::Liberty, 1, None);
        for (place, message) in traffic.iter().enumerate() {
            let draw = |n| key.bits(round, mackrl_env::Draw::World(8 * place + n));
            let mut bytes = message.clone();
            for mutation in 0..(draw(0) % 8).saturating_sub(4) as usize {
                let (at, what) = (draw(1 + mutation), draw(4 + mutation));
                let at = usize::try_from(at % bytes.len().max(1) as u64).unwrap();
                match what % 3 {
                    0 if !bytes.is_empty() => bytes[at] = what.to_le_bytes()[7],
                    1 if !bytes.is_empty() => drop(bytes.remove(at)),
                    _ => bytes.insert(at, what.to_le_bytes()[7]),
                }
            }
            let response = match Request::decode(&bytes[..]) {
                // A mutated number of loops may be large; what is tested is not patience.
                Ok(Request {
                    kind: Some(request::Kind::Step(step)),
                    ..
                }) if step
                    .count
                    .is_some_and(|count| (100..=100_000).contains(&count)) =>
                {
                    continue;
                }
                Ok(request) => game.answer(&request),
                Err(_) => game.answer_garbage(),
            };
            understood += usize::from(response.error.is_empty());
        }
    }
    assert!(
        understood > 1000,
        "mutations leave some requests whole: {understood}"
    );
}
