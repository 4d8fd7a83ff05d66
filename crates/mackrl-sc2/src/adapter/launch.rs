//! From an installation to a game that has been joined.

use std::{
    fs, thread,
    time::{Duration, Instant},
};

use mackrl_skirmish::Scenario;

use super::{
    Game, client::Client, fault::GameFault, game::unexpected, pool::GameSettings,
    process::GameProcess,
};
use crate::{
    protocol::{
        CreateGame, DIFFICULTY_VERY_HARD, InterfaceOptions, JoinGame, LocalMap, PlayerSetup,
        PlayerType, RequestPing, request, response,
    },
    stand_in::race,
    units,
};

/// How often a starting game is asked whether it listens.
const KNOCK: Duration = Duration::from_millis(10);

impl Game {
    /// Starts a process, makes the game of `scenario` and joins it.
    ///
    /// # Errors
    /// [`GameFault`] tells which part of that failed.
    pub fn launch(
        settings: &GameSettings,
        scenario: &Scenario,
        seed: u32,
    ) -> Result<Self, GameFault> {
        let map = settings.installation.map_file(&scenario.name);
        let map = map.map_err(|problem| GameFault::Launch(problem.to_string()))?;
        let map_data = fs::read(map)?;
        let mut process = GameProcess::start(&settings.installation, &settings.launcher)?;
        let client = connect(&mut process, settings)?;
        let mut game = Self {
            client,
            process,
            game_loop: 0,
            living: Vec::new(),
        };
        game.check_version(settings)?;
        game.create(scenario, seed, map_data)?;
        if let Some(words) = game.process.last_words() {
            // Somebody else answers on this port.
            return Err(GameFault::Launch(words));
        }
        Ok(game)
    }

    fn check_version(&mut self, settings: &GameSettings) -> Result<(), GameFault> {
        let (answer, _) = self.client.ask(request::Kind::Ping(RequestPing {}))?;
        let response::Kind::Ping(ping) = answer else {
            return Err(unexpected("ping", &answer));
        };
        let (found, expected) = (ping.base_build, settings.installation.base_build);
        match found {
            Some(found) if found != expected => Err(GameFault::Version(format!(
                "it says that it is {} ({found}), expected {expected}",
                ping.game_version.unwrap_or_default()
            ))),
            _ => Ok(()),
        }
    }

    fn create(
        &mut self,
        scenario: &Scenario,
        seed: u32,
        map_data: Vec<u8>,
    ) -> Result<(), GameFault> {
        let [own, other] = scenario.races.map(race);
        let participant = PlayerSetup {
            r#type: Some(PlayerType::Participant.into()),
            ..PlayerSetup::default()
        };
        let computer = PlayerSetup {
            r#type: Some(PlayerType::Computer.into()),
            race: Some(other.into()),
            difficulty: Some(DIFFICULTY_VERY_HARD),
        };
        let create = CreateGame {
            local_map: Some(LocalMap {
                map_path: Some(units::map_path(&scenario.name)),
                map_data: Some(map_data),
            }),
            player_setup: vec![participant, computer],
            random_seed: Some(seed),
            realtime: Some(false),
        };
        let (answer, _) = self.client.ask(request::Kind::CreateGame(create))?;
        let response::Kind::CreateGame(created) = answer else {
            return Err(unexpected("create_game", &answer));
        };
        refused("create_game", created.error, created.error_details)?;
        let join = JoinGame {
            race: Some(own.into()),
            options: Some(InterfaceOptions {
                raw: Some(true),
                score: Some(false),
                ..InterfaceOptions::default()
            }),
        };
        let answer = self.ask(request::Kind::JoinGame(join))?;
        let response::Kind::JoinGame(joined) = answer else {
            return Err(unexpected("join_game", &answer));
        };
        refused("join_game", joined.error, joined.error_details)
    }
}

/// Knocks until the game listens.
fn connect(process: &mut GameProcess, settings: &GameSettings) -> Result<Client, GameFault> {
    let began = Instant::now();
    loop {
        let failure = match Client::connect(process.address(), settings.patience) {
            Ok(client) => return Ok(client),
            Err(failure) => failure,
        };
        if let Some(words) = process.last_words() {
            return Err(GameFault::Launch(words));
        }
        if began.elapsed() > settings.launch_patience {
            let waited = settings.launch_patience.as_secs_f64();
            return Err(GameFault::Launch(format!(
                "no game answered within {waited:.1} s: {failure}"
            )));
        }
        thread::sleep(KNOCK);
    }
}

fn refused(
    request: &'static str,
    error: Option<i32>,
    details: Option<String>,
) -> Result<(), GameFault> {
    match error {
        None => Ok(()),
        Some(number) => Err(GameFault::Refused {
            request,
            reason: format!("error {number} {}", details.unwrap_or_default())
                .trim_end()
                .to_owned(),
        }),
    }
}
