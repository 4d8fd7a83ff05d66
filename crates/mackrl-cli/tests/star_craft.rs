//! StarCraft II through its stand-in: real processes, real sockets, real faults, real signals.

#![cfg(all(feature = "sc2", target_os = "linux"))]

use std::{
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use mackrl_env::{
    Action, AgentId, Environment, EpisodeKey, Observations, Stream, contract::check_environment,
};
use mackrl_sc2::{
    adapter::{GamePool, GameSettings, Installation, StarCraft2, process::Launcher},
    lifetime,
    stand_in::install::install,
};
use mackrl_skirmish::{Scenario, SkirmishSettings, UnitData, unit_types::UnitTypes};

/// A folder with a game that stands in, and with temporary files of its own, so that tests do not see each other's games.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        install(&folder.path().join("game"), &program()).expect("a stand-in can be laid out");
        std::fs::create_dir(folder.path().join("tmp")).expect("a folder for temporary files");
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(program());
        command
            .args(arguments.split_whitespace())
            .env("SC2PATH", self.path("game"))
            .env("TMPDIR", self.path("tmp"))
            .env_remove("MACKRL_SC2_FAULTS")
            .current_dir(self.folder.path());
        command
    }

    fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().expect("the program runs")
    }

    /// What a command prints, which has to succeed.
    fn printed(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(
            output.status.success(),
            "{arguments}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).expect("text")
    }

    /// Processes of games, with the kernel's dates of their starts.
    fn games(&self) -> Vec<(u32, u64)> {
        let games: serde_json::Value =
            serde_json::from_str(&self.printed("sc2 ps --json")).expect("JSON");
        let number = |game: &serde_json::Value, name: &str| game[name].as_u64().expect("a number");
        let games = games.as_array().expect("an array").iter();
        games
            .map(|game| {
                let pid = u32::try_from(number(game, "pid")).expect("a process");
                (pid, number(game, "start"))
            })
            .collect()
    }

    fn settings(&self) -> GameSettings {
        GameSettings {
            installation: Installation::find(&self.path("game"), None).expect("it was laid out"),
            launcher: Launcher {
                program: program(),
                arguments: ["sc2", "exec-game"].map(str::to_owned).into(),
            },
            launch_patience: Duration::from_secs(60),
            patience: Duration::from_secs(60),
            failures_max: 1,
        }
    }
}

fn program() -> PathBuf {
    PathBuf::from(env!("CARGO_BIN_EXE_mackrl"))
}

fn star_craft(map: &str, pool: &Arc<GamePool>) -> StarCraft2 {
    let units = UnitTypes::load(UnitData::default()).expect("shipped statistics");
    let scenario = Scenario::shipped(map, &units)
        .expect("a shipped map")
        .expect("a sound map");
    let settings = SkirmishSettings::default();
    StarCraft2::new(Arc::new(scenario), settings, Arc::clone(pool)).expect("sound settings")
}

/// The available action that a number in [0, 1) points at.
fn choose(observations: &Observations, agent: usize, uniform: f64) -> Action {
    let available = observations.local_view(0, AgentId::new(agent)).available();
    let open: Vec<usize> = (0..available.len())
        .filter(|action| available[*action])
        .collect();
    let place = (0..open.len())
        .rev()
        .find(|place| *place as f64 <= uniform * open.len() as f64);
    Action::new(open[place.unwrap_or(0)])
}

#[test]
fn every_map_is_the_simulators_to_the_bit_restarts_included() {
    let place = Place::new();
    for map in mackrl_skirmish::map_names() {
        let pool = Arc::new(GamePool::new(place.settings()));
        let mut game = star_craft(map, &pool);
        let mut skirmish = mackrl_skirmish::make(map, &SkirmishSettings::default()).expect("a map");
        let mut shown = [0, 1].map(|_| Observations::new(skirmish.spec(), 1));
        for episode in 0..2 {
            let key = EpisodeKey::new(3, Stream::Evaluation, episode);
            let [simulated, played] = &mut shown;
            skirmish.reset(key, &mut simulated.row_mut(0));
            game.reset(key, &mut played.row_mut(0));
            for step in 0.. {
                assert!(simulated == played, "{map}, episode {episode}, step {step}");
                let actions: Vec<Action> = (0..skirmish.spec().agents)
                    .map(|agent| {
                        let uniform = key.uniform(step, mackrl_env::Draw::Agent(agent));
                        choose(simulated, agent, uniform)
                    })
                    .collect();
                let expected = skirmish.step(&actions, &mut simulated.row_mut(0));
                let found = game.step(&actions, &mut played.row_mut(0));
                assert_eq!(expected, found, "{map}, episode {episode}, step {step}");
                if expected.expect("an available action").end.is_some() {
                    assert!(simulated == played, "{map}, episode {episode}, at its end");
                    assert_eq!(
                        skirmish.battle_statistics(),
                        game.battle_statistics(),
                        "{map}, episode {episode}"
                    );
                    break;
                }
            }
        }
        assert_eq!(
            pool.counts().launches,
            1,
            "{map}: one process for both episodes"
        );
    }
}

#[test]
fn the_game_keeps_every_promise_of_an_environment() {
    let place = Place::new();
    let pool = Arc::new(GamePool::new(place.settings()));
    check_environment(&mut star_craft("MMM", &pool), 2);
}

#[test]
fn hundreds_of_faults_of_every_kind_change_no_bit_of_a_run() {
    let place = Place::new();
    // A failure repeats all episodes of a shard, a hundred times at most: shards are small here, where failures are frequent.
    let train = "train --map 3m --preset paper --steps 1500 --set algorithm.shards=4 --set test.episodes=2 --threads 2";
    place.printed(&format!("{train} --out simulated"));
    // Without what the file says of itself, which names the world.
    let weights = |run: &str| {
        let bytes = std::fs::read(place.path(run).join("weights.safetensors")).expect("weights");
        let (length, rest) = bytes.split_first_chunk().expect("a header");
        let header = usize::try_from(u64::from_le_bytes(*length)).expect("a short header");
        rest[header..].to_vec()
    };
    let expected = weights("simulated");
    // More with MACKRL_FAULTS=10000; each costs up to 0.15 s.
    let wanted: u64 =
        std::env::var("MACKRL_FAULTS").map_or(200, |text| text.parse().expect("a number"));
    let (mut faults, mut kinds) = (0, [0_u64; 5]);
    for seed in 0.. {
        let plan = format!("rate=0.003,seed={seed},late=0.3");
        let output = place
            .command(&format!("{train} --env sc2 --out played{seed}"))
            .envs([
                ("MACKRL_SC2_FAULTS", plan.as_str()),
                ("MACKRL_SC2_PATIENCE_S", "0.15"),
            ])
            .envs([
                ("MACKRL_SC2_START_PATIENCE_S", "5"),
                ("MACKRL_SC2_FAILURES", "1000"),
            ])
            .output()
            .expect("the program runs");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(
            weights(&format!("played{seed}")) == expected,
            "a fault of plan {plan} became data"
        );
        assert_eq!(place.games(), [], "a game is left behind");
        let row = last_row(&place.path(&format!("played{seed}")));
        for (count, kind) in kinds
            .iter_mut()
            .zip(["launch", "late", "closed", "garbage", "refused"])
        {
            let found = row[format!("sys/game_faults_{kind}")]
                .as_u64()
                .expect("a count");
            *count += found;
            faults += found;
        }
        if faults >= wanted {
            break;
        }
    }
    assert!(
        kinds.iter().all(|count| *count > 0),
        "faults of every kind: {kinds:?}"
    );
}

#[test]
fn no_game_outlives_us_whatever_signal_we_die_by() {
    let place = Place::new();
    // Not HUP, which is ignored below `nohup`.
    for signal in ["INT", "TERM", "ALRM", "USR2", "ABRT", "KILL"] {
        let mut training = place
            .command(&format!(
                "train --env sc2 --map 3m --steps 100000000 --out {signal}"
            ))
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("the program runs");
        let games = wait_for_games(&place, &mut training);
        send(signal, training.id());
        // Of these, INT and TERM ask for a checkpoint first.
        training.wait().expect("it ends");
        let began = Instant::now();
        let lives = |&(pid, start): &(u32, u64)| lifetime::is_running(pid, start);
        while games.iter().any(lives) {
            assert!(
                began.elapsed() < Duration::from_secs(2),
                "SIG{signal}: a game lives on"
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

#[test]
fn another_version_than_the_one_found_is_refused_at_once() {
    let place = Place::new();
    let versions = place.path("game/Versions");
    std::fs::rename(versions.join("Base75689"), versions.join("Base69232"))
        .expect("it was laid out");
    let output = place.run("play --env sc2 --map 3m --episodes 1");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(74), "{words}");
    assert!(
        words.contains("the wrong game: it says that it is 4.10.0 (75689), expected 69232"),
        "{words}"
    );
    let output = place.run("sc2 doctor --game-version 4.10.0");
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(found.contains("StarCraft II 4.10.0 is not in "), "{found}");
}

#[test]
fn a_replay_of_the_stand_in_is_one_of_ours() {
    let place = Place::new();
    let played =
        place.printed("play --env sc2 --map 2s3z --policy nearest --save-replay r.gz --json");
    let played: serde_json::Value = serde_json::from_str(&played).expect("JSON");
    let again = place.printed("replay r.gz --json");
    let again: serde_json::Value = serde_json::from_str(&again).expect("JSON");
    for name in [
        "map",
        "battle_won",
        "ep_length",
        "dead_allies",
        "dead_enemies",
    ] {
        assert_eq!(played[name], again[name], "{name}");
    }
}

#[test]
fn only_our_own_games_are_listed_and_killed() {
    let place = Place::new();
    let mut training = place
        .command("train --env sc2 --map 3m --steps 100000000 --out run")
        .env("MACKRL_SC2_FAILURES", "2")
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("the program runs");
    let games = wait_for_games(&place, &mut training);
    let stranger = place.run(&format!("sc2 kill {}", training.id()));
    assert_eq!(stranger.status.code(), Some(2));
    let words = String::from_utf8_lossy(&stranger.stderr).into_owned();
    assert!(
        words.contains("is no game that this program started"),
        "{words}"
    );
    assert!(
        training.try_wait().expect("it can be asked").is_none(),
        "it was left alone"
    );
    let (pid, start) = games[0];
    assert_eq!(place.printed(&format!("sc2 kill {pid}")), "killed: 1\n");
    assert!(!lifetime::is_running(pid, start), "it was killed");
    training.kill().expect("it runs");
    training.wait().expect("it ends");
}

#[test]
fn the_doctor_names_what_is_wrong_and_what_mends_it() {
    let place = Place::new();
    let healthy = place.printed("sc2 doctor --start --map 2s3z");
    assert!(
        healthy.contains("ok     start    2s3z with 10 units"),
        "{healthy}"
    );
    assert!(
        healthy.contains("ok     ground   as the simulator has it"),
        "{healthy}"
    );
    std::fs::remove_file(place.path("game/Maps/SMAC_Maps/MMM2.SC2Map")).expect("it was laid out");
    let output = place.run("sc2 doctor");
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(74), "{found}");
    assert!(
        found.contains("WRONG  maps     1 of 23 are missing"),
        "{found}"
    );
    assert!(found.contains("try: unzip SMAC_Maps.zip -d "), "{found}");
    let nowhere = place
        .command("train --env sc2 --map 3m")
        .env("SC2PATH", "/nowhere")
        .output();
    let nowhere = nowhere.expect("the program runs");
    assert_eq!(nowhere.status.code(), Some(64));
    let words = String::from_utf8_lossy(&nowhere.stderr).into_owned();
    assert!(
        words.contains("no StarCraft II in /nowhere; try: export SC2PATH="),
        "{words}"
    );
}

fn last_row(run: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(run.join("metrics.jsonl")).expect("metrics");
    serde_json::from_str(text.lines().last().expect("a row")).expect("JSON")
}

/// Waits until the games of a run are there.
fn wait_for_games(place: &Place, training: &mut Child) -> Vec<(u32, u64)> {
    let began = Instant::now();
    loop {
        let games = place.games();
        if games.len() >= 8 {
            return games;
        }
        assert!(
            training.try_wait().expect("it can be asked").is_none(),
            "training goes on"
        );
        assert!(
            began.elapsed() < Duration::from_secs(60),
            "games are started"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn send(signal: &str, pid: u32) {
    let kill = Command::new("kill")
        .args([&format!("-{signal}"), &pid.to_string()])
        .status();
    assert!(kill.expect("kill runs").success(), "SIG{signal} is sent");
}
