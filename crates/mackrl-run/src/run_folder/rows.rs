//! The rows of metrics of a run, which may be a stranger's: read one by one, and checked in one place.
//!
//! A row counts only if it can be one of this run: its steps come after those of the row before, its counts do not fall, its
//! shares lie in [0, 1], and it names a provenance that `run.json` has.

use std::{
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    path::Path,
};

use serde_json::{Map, Value};

use super::{METRICS, manifest::Growing, stored::StoredRun};
use crate::{
    error::{Context, Result, RunError},
    folder::Folder,
};

/// A row of metrics.
pub type Row = Map<String, Value>;

/// Longest row of metrics that is read, in bytes.
const LENGTH_MAX: u64 = 1 << 20;
/// Steps, episodes and updates are counted below this number, above which floating-point numbers have gaps.
const COUNT_MAX: u64 = 1 << 53;
/// Counts that never fall, where a row has them.
const COUNTS: [&str; 2] = ["episode", "update"];

/// What the rows so far say, and what those to come have to agree with.
#[derive(Debug, Default)]
pub(super) struct RowCheck {
    steps_env: Option<u64>,
    counts: [u64; COUNTS.len()],
    /// Ids of the provenance that `run.json` has; of early runs, which do not say, none.
    ids: Vec<String>,
}

impl RowCheck {
    /// Of the rows of a run with these ids of its provenance.
    pub(super) fn of(ids: Vec<String>) -> Self {
        Self {
            ids,
            ..Self::default()
        }
    }

    /// Whether this can be the next row; otherwise, why not.
    pub(super) fn check(&mut self, row: &Row) -> Result<(), String> {
        let steps_env = count(row, "t_env")?.ok_or("it has no `t_env`")?;
        if let Some(before) = self.steps_env.filter(|before| steps_env <= *before) {
            return Err(format!(
                "`t_env` is {steps_env} after {before}, expected more"
            ));
        }
        self.steps_env = Some(steps_env);
        for (name, before) in COUNTS.iter().zip(&mut self.counts) {
            let counted = count(row, name)?.unwrap_or(*before);
            if counted < *before {
                return Err(format!(
                    "`{name}` is {counted} after {before}, expected no less"
                ));
            }
            *before = counted;
        }
        for (name, value) in row.iter().filter(|(name, _)| is_share(name)) {
            let is_in_range = value
                .as_f64()
                .is_some_and(|share| (0.0..=1.0).contains(&share));
            if !is_in_range {
                return Err(format!("`{name}` is {value}, expected 0 to 1"));
            }
        }
        match row.get("provenance").and_then(Value::as_str) {
            Some(id) if !self.ids.is_empty() && !self.ids.iter().any(|own| own == id) => Err(
                format!("it comes from another run: run.json has no provenance `{id}`"),
            ),
            _ => Ok(()),
        }
    }
}

/// A count that a row may have.
fn count(row: &Row, name: &str) -> Result<Option<u64>, String> {
    let Some(value) = row.get(name) else {
        return Ok(None);
    };
    match value.as_u64().filter(|count| *count < COUNT_MAX) {
        Some(count) => Ok(Some(count)),
        None => Err(format!("`{name}` is {value}, expected a count")),
    }
}

/// Whether a metric of this name is a share.
fn is_share(name: &str) -> bool {
    name.ends_with("battle_won_mean") || name.contains("delegation_rate")
}

impl StoredRun {
    /// Gives every row to `note`, in their order.
    ///
    /// # Errors
    /// [`RunError::BadData`] with the first row that cannot be one of this run, or if the run is finished and its metrics are not
    /// those that it ended with.
    pub(crate) fn rows(&self, mut note: impl FnMut(Row)) -> Result<()> {
        let path = self.folder.shown(METRICS);
        let name = path.display();
        let seal = self.seal(METRICS);
        let Some(file) = self.folder.file(METRICS)? else {
            return match seal {
                Some(_) => Err(self.differs(METRICS)),
                None => Ok(()),
            };
        };
        let mut reader = BufReader::new(file);
        let mut so_far = Growing::default();
        let mut check = RowCheck::of(self.provenance_ids());
        for number in 1.. {
            let mut line = Vec::new();
            (&mut reader)
                .take(LENGTH_MAX)
                .read_until(b'\n', &mut line)
                .with_context(|| self.folder.cannot("read", Path::new(METRICS)))?;
            so_far.append(&line);
            let bad = |reason: String| RunError::BadData {
                message: format!("{name}:{number}: {reason}"),
            };
            if line.len() as u64 == LENGTH_MAX {
                let reason = format!("the row is longer than {LENGTH_MAX} bytes");
                return Err(bad(reason));
            }
            // A row without its end is still being written.
            if line.last() != Some(&b'\n') {
                break;
            }
            let row: Row = serde_json::from_slice(&line)
                .map_err(|error| bad(format!("not a JSON object: {error}")))?;
            check.check(&row).map_err(bad)?;
            note(row);
        }
        match seal {
            Some(seal) if so_far.fingerprint() != *seal => Err(self.differs(METRICS)),
            _ => Ok(()),
        }
    }
}

/// Reads the rows of metrics of the run at `path`, in their order.
///
/// # Errors
/// [`RunError::NotARun`] if there is none, [`RunError::BadData`] with the first row that cannot be one of it, or if it is finished and
/// its configuration or its metrics are not those that it ended with.
pub fn read_rows(path: &Path) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    StoredRun::open(path)?.rows(|row| rows.push(row))?;
    Ok(rows)
}

/// Rows from some place in the metrics on, for one who follows a run as it goes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Following {
    /// The rows that can be used.
    pub rows: Vec<Row>,
    /// The byte to go on from.
    pub next: u64,
    /// Why rows were left out, of the last of them.
    pub problem: Option<String>,
}

/// Reads the whole lines among the next `bytes_max` bytes of the metrics of the run at `path`, from byte `from` on. What cannot be a
/// row is left out and told; nothing, if there are not so many bytes.
///
/// # Errors
/// If there is no such folder, the metrics are no plain file, or they cannot be read.
pub fn follow_rows(path: &Path, from: u64, bytes_max: u64) -> Result<Option<Following>> {
    let folder = Folder::open(path)?;
    let Some(mut file) = folder.file(METRICS)? else {
        return Ok((from == 0).then(Following::default));
    };
    let cannot = || folder.cannot("read", Path::new(METRICS));
    let length = file.metadata().with_context(cannot)?.len();
    if from > length {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(from)).with_context(cannot)?;
    let mut bytes = Vec::new();
    file.take(bytes_max)
        .read_to_end(&mut bytes)
        .with_context(cannot)?;
    let mut following = Following::default();
    let whole = bytes.iter().rposition(|byte| *byte == b'\n');
    let whole = match whole {
        Some(end) => end + 1,
        // A row that is as long as all that is read will not come to an end.
        None if bytes.len() as u64 == bytes_max => {
            following.problem = Some(format!("a row is longer than {bytes_max} bytes"));
            bytes.len()
        }
        None => 0,
    };
    following.next = from + whole as u64;
    let mut check = RowCheck::default();
    for line in bytes[..whole].split(|byte| *byte == b'\n') {
        if line.is_empty() {
            continue;
        }
        let row = serde_json::from_slice::<Row>(line).map_err(|error| error.to_string());
        match row.and_then(|row| check.check(&row).map(|()| row)) {
            Ok(row) => following.rows.push(row),
            Err(reason) => following.problem = Some(format!("a row is left out: {reason}")),
        }
    }
    Ok(Some(following))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(rows: &[&str]) -> Result<(), String> {
        let mut check = RowCheck::of(vec!["own".to_owned()]);
        let mut rows = rows.iter();
        rows.try_for_each(|row| check.check(&serde_json::from_str(row).unwrap()))
    }

    #[test]
    fn rows_of_one_run_pass() {
        let rows = [
            r#"{"t_env":0,"test_battle_won_mean":0.0,"provenance":"own"}"#,
            r#"{"t_env":7,"episode":2,"update":1,"mackrl/delegation_rate":1.0,"return_mean":-1e30}"#,
            r#"{"t_env":9,"episode":2,"update":1}"#,
        ];
        assert_eq!(check(&rows), Ok(()));
    }

    #[test]
    fn what_cannot_be_a_row_of_the_run_is_refused_with_its_reason() {
        for (rows, expected) in [
            (&[r#"{"t_env":5}"#, r#"{"t_env":5}"#][..], "5 after 5"),
            (&[r#"{"t_env":5}"#, r#"{"t_env":4}"#], "4 after 5"),
            (&[r#"{"t_env":{}}"#], "expected a count"),
            (&[r#"{"t_env":1e308}"#], "expected a count"),
            (&[r#"{"t_env":-1}"#], "expected a count"),
            (&[r#"{"return_mean":1}"#], "no `t_env`"),
            (
                &[r#"{"t_env":1,"update":3}"#, r#"{"t_env":2,"update":2}"#],
                "2 after 3",
            ),
            (
                &[r#"{"t_env":1,"test_battle_won_mean":1.5}"#],
                "expected 0 to 1",
            ),
            (
                &[r#"{"t_env":1,"mackrl/delegation_rate":"a"}"#],
                "expected 0 to 1",
            ),
            (&[r#"{"t_env":1,"provenance":"other"}"#], "another run"),
        ] {
            let reason = check(rows).unwrap_err();
            assert!(reason.contains(expected), "{rows:?}: {reason}");
        }
    }
}
