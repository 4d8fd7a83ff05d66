//! The runs that are served: what lies in their folders now.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use mackrl_run::{
    folder::{Folder, Kind},
    provenance::sha256,
    recorded::{self, Measurements, RecordedRun, setting},
    run_folder::{self, REPLAYS, Status},
};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::words::did;

/// Most bytes of metrics in one answer; the browser asks for the rest.
const METRICS_MOST: u64 = 4 << 20;
/// Newest replays that are listed: by their names, which end with the number of the episode.
const REPLAYS_LISTED: usize = 12;
/// Runs that are listed.
const RUNS_MOST: usize = 500;
/// Digits of the name by which a run is asked for.
const ID_DIGITS: usize = 16;
/// The metric that is kept of recorded runs.
const WON: &str = "test_battle_won_mean";

/// Folders of runs, or of folders of runs.
#[derive(Debug)]
pub(super) struct Served {
    folders: Vec<PathBuf>,
}

/// All runs, and why there are no more.
#[derive(Debug, Serialize)]
pub(super) struct List {
    runs: Vec<Listed>,
    problems: Vec<String>,
}

/// A run in the list.
#[derive(Debug, Serialize)]
pub(super) struct Listed {
    /// Name by which it is asked for.
    id: String,
    name: String,
    status: String,
    /// Every setting with its value.
    settings: BTreeMap<String, String>,
    /// Names of some replays.
    replays: Vec<String>,
    /// Why it cannot be shown, if it cannot.
    problem: Option<String>,
}

/// Rows of a run.
#[derive(Debug, Serialize)]
pub(super) struct Rows {
    rows: Vec<Map<String, Value>>,
    /// The byte to go on from.
    next: u64,
    problem: Option<String>,
}

impl Served {
    pub(super) fn new(folders: &[PathBuf]) -> Self {
        Self {
            folders: folders.to_vec(),
        }
    }

    /// Where the runs lie that are there now, and why there are none at some places.
    fn located(&self) -> (Vec<PathBuf>, Vec<String>) {
        let (mut found, mut problems) = (Vec::new(), Vec::new());
        for folder in &self.folders {
            match recorded::locate(std::slice::from_ref(folder)) {
                Ok(runs) => found.extend(
                    runs.into_iter()
                        .filter(|run| !found.contains(run))
                        .collect::<Vec<_>>(),
                ),
                Err(error) => problems.push(error.chain()),
            }
        }
        if found.len() > RUNS_MOST {
            problems.push(format!(
                "there are {} runs, of which the first {RUNS_MOST} are shown",
                found.len()
            ));
            found.truncate(RUNS_MOST);
        }
        (found, problems)
    }

    /// All runs.
    pub(super) fn list(&self) -> List {
        let (found, problems) = self.located();
        let runs = found.into_iter().map(|path| listed(&path)).collect();
        List { runs, problems }
    }

    /// The rows of a run from byte `from` on; `None` if there are not so many.
    pub(super) fn rows(&self, id: &str, from: u64) -> Option<Rows> {
        let path = self.path(id)?;
        if path.is_dir() {
            return match run_folder::follow_rows(&path, from, METRICS_MOST) {
                Ok(following) => following.map(|following| Rows {
                    rows: following.rows,
                    next: following.next,
                    problem: following.problem,
                }),
                Err(error) => Some(Rows {
                    rows: Vec::new(),
                    next: from,
                    problem: Some(error.chain()),
                }),
            };
        }
        let kept = recorded::open(path).and_then(|run| Measurements::read(&run, WON));
        let (rows, problem) = match kept {
            Ok(_) if from > 0 => (Vec::new(), None),
            Ok(found) => {
                let points = found.steps.iter().zip(&found.values);
                let row = |(steps, won): (&f64, &f64)| match json!({ "t_env": steps, WON: won }) {
                    Value::Object(row) => row,
                    _ => Map::new(),
                };
                (points.map(row).collect(), None)
            }
            Err(error) => (Vec::new(), Some(error.chain())),
        };
        Some(Rows {
            rows,
            next: 1,
            problem,
        })
    }

    /// A replay, if it is one of those that are listed.
    pub(super) fn replay(&self, id: &str, name: &str, length_max: usize) -> Option<Vec<u8>> {
        let path = self.path(id)?;
        if !replays(&path).iter().any(|listed| listed == name) {
            return None;
        }
        let folder = Folder::open(&path).ok()?;
        let place = Path::new(REPLAYS).join(name);
        folder.read(place, length_max).ok()?
    }

    fn path(&self, id: &str) -> Option<PathBuf> {
        let (found, _) = self.located();
        found.into_iter().find(|path| self::id(path) == id)
    }
}

/// A name for a path, which stays the same when other runs come and go.
fn id(path: &Path) -> String {
    sha256(path.as_os_str().as_encoded_bytes())[..ID_DIGITS].to_owned()
}

fn listed(path: &Path) -> Listed {
    let described = recorded::open(path.to_owned());
    let (status, settings, problem) = match &described {
        Ok(run) => (status(run), settings(run), None),
        Err(error) => (
            "unreadable".to_owned(),
            BTreeMap::new(),
            Some(error.chain()),
        ),
    };
    Listed {
        id: id(path),
        name: path.display().to_string(),
        status,
        settings,
        replays: replays(path),
        problem,
    }
}

fn status(run: &RecordedRun) -> String {
    let status = match run.status {
        _ if run.kept.is_some() => "recorded",
        Status::Running => "running",
        Status::Finished => "finished",
        Status::Interrupted => "interrupted",
        Status::Failed => "failed",
    };
    let best = (run.teams.as_ref()).and_then(|teams| Some((teams, teams.best.as_ref()?)));
    match best {
        Some((teams, best)) => format!(
            "{status}, best weights {} (step {})",
            did(&teams.measure, best),
            best.steps_env
        ),
        None => status.to_owned(),
    }
}

fn settings(run: &RecordedRun) -> BTreeMap<String, String> {
    let keys = run.config.keys();
    keys.map(|key| (key.to_string(), setting(&run.config, &key)))
        .collect()
}

fn replays(run: &Path) -> Vec<String> {
    let entries = Folder::open(run).and_then(|folder| match folder.kind(REPLAYS)? {
        Some(Kind::Folder) => folder.entries(REPLAYS),
        _ => Ok(Vec::new()),
    });
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let mut replays: Vec<String> = entries
        .unwrap_or_default()
        .into_iter()
        .filter(|(name, kind)| {
            *kind == Kind::File && name.ends_with(".replay.gz") && name.chars().all(plain)
        })
        .map(|(name, _)| name)
        .collect();
    replays.truncate(REPLAYS_LISTED);
    replays
}
