//! The runs that are served: what lies in their folders now.

use std::{
    fs::{self, File},
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::Value;

/// Most bytes of metrics in one answer; the browser asks for the rest.
const METRICS_MOST: u64 = 4 << 20;
/// Most bytes of a run's description.
const DESCRIPTION_MOST: u64 = 1 << 20;
/// Newest replays that are listed.
const REPLAYS_LISTED: usize = 12;
/// Runs of a folder of runs.
const RUNS_MOST: usize = 200;

/// Folders of runs, or of folders of runs.
#[derive(Debug)]
pub(super) struct Served {
    folders: Vec<PathBuf>,
}

/// A run in the list.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(super) struct Listed {
    /// Number by which it is asked for.
    id: usize,
    name: String,
    status: String,
    /// Names of the newest replays, the newest first.
    replays: Vec<String>,
}

impl Served {
    pub(super) fn new(folders: &[PathBuf]) -> Self {
        Self {
            folders: folders.to_vec(),
        }
    }

    /// The runs that are there now: the folders that were named, and those within them.
    fn runs(&self) -> Vec<PathBuf> {
        let is_run = |path: &Path| path.join("config.toml").is_file();
        let mut runs = Vec::new();
        for folder in &self.folders {
            if is_run(folder) {
                runs.push(folder.clone());
                continue;
            }
            let entries = fs::read_dir(folder).into_iter().flatten().flatten();
            let mut within: Vec<PathBuf> = entries
                .map(|entry| entry.path())
                .filter(|path| is_run(path))
                .collect();
            within.sort();
            runs.extend(within);
        }
        runs.truncate(RUNS_MOST);
        runs
    }

    /// All runs.
    pub(super) fn list(&self) -> Vec<Listed> {
        let runs = self.runs().into_iter().enumerate();
        runs.map(|(id, path)| Listed {
            id,
            name: path.display().to_string(),
            status: status(&path),
            replays: replays(&path),
        })
        .collect()
    }

    /// The metrics of a run from byte `from` on, up to the end of a line; `None` if there are not so many.
    pub(super) fn metrics(&self, run: &str, from: u64) -> Option<Vec<u8>> {
        let mut file = File::open(self.run(run)?.join("metrics.jsonl")).ok()?;
        let length = file.metadata().ok()?.len();
        if from > length {
            return None;
        }
        file.seek(SeekFrom::Start(from)).ok()?;
        let mut rows = Vec::new();
        file.take(METRICS_MOST).read_to_end(&mut rows).ok()?;
        // A line that is being written comes next time.
        let whole = rows.iter().rposition(|byte| *byte == b'\n');
        rows.truncate(whole.map_or(0, |end| end + 1));
        Some(rows)
    }

    /// Where a replay lies, if it is one of those that are listed.
    pub(super) fn replay(&self, run: &str, name: &str) -> Option<PathBuf> {
        let path = self.run(run)?;
        let is_listed = replays(&path).iter().any(|listed| listed == name);
        is_listed.then(|| path.join("replays").join(name))
    }

    fn run(&self, id: &str) -> Option<PathBuf> {
        let id: usize = id.parse().ok()?;
        self.runs().into_iter().nth(id)
    }
}

/// What `run.json` says of how far the run has come.
fn status(run: &Path) -> String {
    let read = || {
        let mut text = String::new();
        let file = File::open(run.join("run.json")).ok()?;
        file.take(DESCRIPTION_MOST).read_to_string(&mut text).ok()?;
        let description: Value = serde_json::from_str(&text).ok()?;
        Some(description.get("status")?.as_str()?.to_owned())
    };
    read().unwrap_or_else(|| "unknown".to_owned())
}

fn replays(run: &Path) -> Vec<String> {
    let entries = fs::read_dir(run.join("replays")).into_iter().flatten();
    let mut replays: Vec<_> = entries
        .flatten()
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
            let is_replay = name.ends_with(".replay.gz") && name.chars().all(plain);
            let time = entry.metadata().ok()?.modified().ok()?;
            is_replay.then_some((std::cmp::Reverse(time), name))
        })
        .collect();
    replays.sort();
    replays.truncate(REPLAYS_LISTED);
    replays.into_iter().map(|(_, name)| name).collect()
}
