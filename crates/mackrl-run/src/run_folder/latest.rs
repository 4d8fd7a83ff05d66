//! How far a run has come, by what it last wrote down.

use std::{
    io::{Read, Seek, SeekFrom},
    path::Path,
};

use serde_json::Value;

use super::{
    METRICS,
    rows::{Row, RowCheck},
};
use crate::folder::Folder;

/// Bytes at the end of the metrics that are read: more than one row, and mostly with a test among them.
const TAIL: u64 = 64 * 1024;

/// The latest of the numbers that progress is told by.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LatestRow {
    /// Environment steps played.
    pub steps_env: u64,
    /// Environment steps a second.
    pub steps_per_s: Option<f64>,
    /// Share of battles won in a greedy test, in [0, 1].
    pub battle_won_mean: Option<f64>,
}

/// Reads the end of the metrics of the run at `path`; whatever cannot be read is not known.
pub fn latest_row(path: &Path) -> LatestRow {
    let mut latest = LatestRow::default();
    for line in tail(path).unwrap_or_default().split(|&byte| byte == b'\n') {
        // The first line may be cut, and the last is perhaps still being written.
        let Ok(row) = serde_json::from_slice::<Row>(line) else {
            continue;
        };
        if RowCheck::default().check(&row).is_err() {
            continue;
        }
        let number = |name: &str| row.get(name).and_then(Value::as_f64);
        latest.steps_env = (row.get("t_env").and_then(Value::as_u64)).unwrap_or(latest.steps_env);
        latest.steps_per_s = number("sys/sps").or(latest.steps_per_s);
        latest.battle_won_mean = number("test_battle_won_mean").or(latest.battle_won_mean);
    }
    latest
}

fn tail(run: &Path) -> Option<Vec<u8>> {
    let mut file = Folder::open(run).ok()?.file(METRICS).ok()??;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL)))
        .ok()?;
    let mut bytes = Vec::new();
    file.take(TAIL).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_numbers_win_and_cut_lines_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(latest_row(folder.path()), LatestRow::default());
        let rows = "nv\": 3}\n{\"t_env\": 10, \"test_battle_won_mean\": 0.5}\n{\"t_env\": 20, \"sys/sps\": 7}\n{\"t_e";
        std::fs::write(folder.path().join(METRICS), rows).unwrap();
        let expected = LatestRow {
            steps_env: 20,
            steps_per_s: Some(7.0),
            battle_won_mean: Some(0.5),
        };
        assert_eq!(latest_row(folder.path()), expected);
    }
}
