//! SMAC's own client on the stand-in, as `scripts/sc2/parity.py` wrote it down: every message, and what it made of them.
//!
//! The files in `tests/client/` keep these tests independent of Python and of SMAC's sources, which are not on any index. What is
//! compared with them does not depend on the rules of battle, which may change: from the same messages, our code has to show
//! what the client observed. That the client observes what the *simulator* shows needs a client on the present rules; the script
//! plays one, names its folder in `MACKRL_SC2_CLIENT` and runs the tests that are ignored otherwise.

use std::{
    fs::{self, File},
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    sync::Arc,
};

use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::read::GzDecoder;
use mackrl_env::{
    Action, AgentId, Environment, EnvironmentSpec, EpisodeKey, Observations, Stream, TimeStep,
};
use mackrl_skirmish::{Encounter, Face, Skirmish, SkirmishSettings, UnitData};
use prost::Message;
use serde::Deserialize;

use crate::{
    adapter::roster::Roster,
    protocol::{Request, Response, request, response},
    stand_in::{Arena, Game},
};

/// Greatest difference between a number of the client's and ours, as a part of it above 1: the client computes in double
/// precision.
const TOLERANCE: f64 = 1e-6;

/// The first line of a file.
#[derive(Deserialize)]
struct Head {
    map: String,
    seed: u32,
    /// Messages in base64: what was asked, and what was answered; nothing to the last.
    exchanges: Vec<Vec<String>>,
}

impl Head {
    fn requests(&self) -> impl Iterator<Item = Request> {
        self.exchanges
            .iter()
            .map(|exchange| Request::decode(&bytes(&exchange[0])[..]).unwrap())
    }

    /// What the client was answered when it looked.
    fn observations(&self) -> impl Iterator<Item = Vec<crate::protocol::Unit>> {
        self.exchanges.iter().filter_map(|exchange| {
            let response = Response::decode(&bytes(exchange.get(1)?)[..]).unwrap();
            match response.kind? {
                response::Kind::Observation(found) => Some(found.observation?.raw_data?.units),
                _ => None,
            }
        })
    }
}

fn bytes(text: &str) -> Vec<u8> {
    STANDARD.decode(text).unwrap()
}

/// What the client was shown, after a reset or a step.
#[derive(Deserialize)]
struct Shown {
    /// Set after a reset.
    episode: Option<u64>,
    #[serde(default)]
    actions: Vec<usize>,
    #[serde(default)]
    reward: f64,
    #[serde(default)]
    end: bool,
    #[serde(default)]
    won: bool,
    observations: Vec<Vec<f64>>,
    state: Vec<f64>,
    available: Vec<String>,
}

impl Shown {
    fn actions(&self) -> Vec<Action> {
        self.actions.iter().copied().map(Action::new).collect()
    }
}

fn skirmish(map: &str) -> Skirmish {
    mackrl_skirmish::make(map, &SkirmishSettings::default()).unwrap()
}

fn files() -> Vec<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/client");
    let folder = std::env::var_os("MACKRL_SC2_CLIENT").map_or(beside, PathBuf::from);
    let entries = fs::read_dir(&folder).expect("a folder of recorded clients");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("it can be listed").path())
        .filter(|file| file.extension().is_some_and(|ending| ending == "gz"))
        .collect();
    files.sort();
    assert!(
        !files.is_empty(),
        "{} holds recorded clients",
        folder.display()
    );
    files
}

fn read(file: &Path) -> (Head, Vec<Shown>) {
    let mut lines =
        BufReader::new(GzDecoder::new(File::open(file).expect("it can be opened"))).lines();
    let mut next = || lines.next().map(|line| line.expect("text"));
    let head = serde_json::from_str(&next().expect("a first line")).expect("a head");
    let shown = std::iter::from_fn(next).map(|line| serde_json::from_str(&line).expect("a line"));
    (head, shown.collect())
}

/// Compares what we show with what the client observed, at a place that messages name.
struct Comparison {
    observations: Observations,
    place: String,
}

impl Comparison {
    fn new(spec: &EnvironmentSpec) -> Self {
        Self {
            observations: Observations::new(spec, 1),
            place: String::new(),
        }
    }

    fn payment(&self, shown: &Shown, step: TimeStep, won: bool) {
        let (found, expected) = (step.reward, shown.reward);
        let place = &self.place;
        assert!(
            are_equal(expected, found),
            "{place}: reward {found}, the client has {expected}"
        );
        assert_eq!((step.end.is_some(), won), (shown.end, shown.won), "{place}");
    }

    fn with(&self, shown: &Shown) {
        for (agent, expected) in shown.observations.iter().enumerate() {
            let view = self.observations.local_view(0, AgentId::new(agent));
            let what = format!("observation of agent {agent}");
            self.compare_numbers(&what, expected, view.observation());
            let bit = |open: &bool| if *open { '1' } else { '0' };
            let available: String = view.available().iter().map(bit).collect();
            assert_eq!(
                available, shown.available[agent],
                "{}, agent {agent}",
                self.place
            );
        }
        self.compare_numbers("state", &shown.state, self.observations.state(0));
    }

    fn compare_numbers(&self, what: &str, expected: &[f64], found: &[f32]) {
        assert_eq!(
            expected.len(),
            found.len(),
            "{}: length of the {what}",
            self.place
        );
        for (index, (expected, found)) in expected.iter().zip(found).enumerate() {
            assert!(
                are_equal(*expected, *found),
                "{}: {what}[{index}] is {found}, the client has {expected}",
                self.place
            );
        }
    }
}

fn are_equal(expected: f64, found: f32) -> bool {
    (expected - f64::from(found)).abs() <= TOLERANCE * expected.abs().max(1.0)
}

#[test]
fn from_the_same_messages_we_show_what_the_client_observed() {
    for file in files() {
        let (head, lines) = read(&file);
        let scenario = skirmish(&head.map).scenario().clone();
        let scenario = Arc::new(scenario);
        let settings = SkirmishSettings::default();
        let mut state = Encounter::new(Arc::clone(&scenario), &settings)
            .muster()
            .clone();
        let mut face = Face::new(Arc::clone(&scenario), settings, &state).unwrap();
        let mut comparison = Comparison::new(face.spec());
        let mut roster = None;
        let looks: Vec<_> = head.observations().collect();
        assert_eq!(
            looks.len(),
            lines.len(),
            "{}: one look for each line",
            head.map
        );
        for (index, (units, shown)) in looks.iter().zip(&lines).enumerate() {
            comparison.place = format!("{} line {index}", head.map);
            let row = &mut comparison.observations.row_mut(0);
            if shown.episode.is_some() {
                roster = Roster::read(&scenario, units, &mut state).unwrap();
                face.begin(&state, row);
            } else {
                let roster = roster
                    .as_ref()
                    .expect("both armies are complete after a reset");
                let actions = shown.actions();
                face.check(&state, &actions).unwrap();
                roster.update(&scenario, units, &mut state).unwrap();
                let step = face.settle(&state, &actions, row);
                comparison.payment(shown, step, face.statistics().battle_won);
            }
            comparison.with(shown);
        }
    }
}

#[test]
fn the_clients_messages_are_all_answered() {
    for file in files() {
        let (head, _) = read(&file);
        let mut game = Game::new(UnitData::Liberty, 1, None);
        for request in head.requests() {
            let response = game.answer(&request);
            assert!(
                response.error.is_empty(),
                "{}: {:?}",
                head.map,
                response.error
            );
            assert_eq!(response.id, request.id, "{}", head.map);
        }
    }
}

#[test]
#[ignore = "needs a client on the present rules: scripts/sc2/parity.py"]
fn the_client_observes_and_is_paid_what_the_simulator_says_restarts_included() {
    for file in files() {
        let (head, lines) = read(&file);
        let mut skirmish = skirmish(&head.map);
        let mut comparison = Comparison::new(skirmish.spec());
        for (index, shown) in lines.iter().enumerate() {
            comparison.place = format!("{} line {index}", head.map);
            let row = &mut comparison.observations.row_mut(0);
            if let Some(episode) = shown.episode {
                let key = EpisodeKey::new(head.seed.into(), Stream::Other, episode);
                skirmish.reset(key, row);
            } else {
                let step = skirmish.step(&shown.actions(), row).unwrap();
                comparison.payment(shown, step, skirmish.battle_statistics().battle_won);
            }
            comparison.with(shown);
        }
        let episodes = lines.iter().filter(|shown| shown.end).count();
        assert!(episodes >= 1, "{}: whole episodes", head.map);
    }
}

#[test]
#[ignore = "needs a client on the present rules: scripts/sc2/parity.py"]
fn the_clients_messages_are_understood_as_the_actions_that_it_chose() {
    for file in files() {
        let (head, lines) = read(&file);
        let mut chosen: Vec<Vec<Vec<usize>>> = Vec::new();
        for shown in lines {
            match (shown.episode, chosen.last_mut()) {
                (None, Some(episode)) => episode.push(shown.actions),
                _ => chosen.push(Vec::new()),
            }
        }
        let mut game = Game::new(UnitData::Liberty, 1, None);
        let mut understood = Vec::new();
        let mut keep = |game: &Game| {
            let record = game.arena().map(Arena::record);
            let actions = record.into_iter().flat_map(|record| &record.steps);
            let actions =
                actions.map(|(actions, _)| actions.iter().map(|action| action.index()).collect());
            understood.push(actions.collect::<Vec<Vec<usize>>>());
        };
        for request in head.requests() {
            // An episode is over when the client kills everybody, and the last when it leaves.
            if matches!(
                request.kind,
                Some(request::Kind::Debug(_) | request::Kind::Quit(_))
            ) {
                keep(&game);
            }
            let response = game.answer(&request);
            assert!(
                response.error.is_empty(),
                "{}: {:?}",
                head.map,
                response.error
            );
            assert_eq!(response.id, request.id, "{}", head.map);
        }
        assert!(
            understood == chosen,
            "{}: other actions than the client's",
            head.map
        );
    }
}
