//! What a run has recorded, for whoever compares it with another.

use std::{fs, io, path::Path};

use anyhow::Context;
use mackrl_run::config::Config;
use serde_json::{Map, Value};

use super::{METRICS, WEIGHTS, disk::cannot, read_record, run::read_config};
use crate::{failure::Failure, provenance::Provenance};

/// A row of metrics.
pub(crate) type Row = Map<String, Value>;

/// What a run has recorded.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    pub(crate) config: Config,
    /// That of the latest version of the program that wrote here, if it says.
    pub(crate) provenance: Option<Provenance>,
    /// The rows of metrics, without what [`timeless`] leaves out.
    pub(crate) rows: Vec<Row>,
    /// The final weights, if the run has come so far.
    pub(crate) weights: Option<Vec<u8>>,
}

impl Recorded {
    /// Reads the run at `path`.
    ///
    /// # Errors
    /// [`Failure::NotARun`] if there is none, [`Failure::BadData`] with the first line that is no row.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let config = read_config(path)?;
        let record = read_record(path);
        Ok(Self {
            config,
            provenance: record.and_then(|record| record.provenance.last().cloned()),
            rows: read_rows(&path.join(METRICS))?,
            weights: if_there(fs::read(path.join(WEIGHTS)), &path.join(WEIGHTS))?,
        })
    }
}

/// A row without what differs between two runs of the same numbers: what depends on the clock, and the provenance.
pub(crate) fn timeless(mut row: Row) -> Row {
    row.retain(|name, _| !name.starts_with("sys/") && name != "provenance");
    row
}

fn read_rows(path: &Path) -> anyhow::Result<Vec<Row>> {
    let text = if_there(fs::read_to_string(path), path)?.unwrap_or_default();
    // A run that goes on may be in the middle of a line.
    let whole = text.rsplit_once('\n').map_or("", |(lines, _)| lines);
    let rows = whole.lines().enumerate().map(|(line, text)| {
        let row = serde_json::from_str(text).map_err(|error| Failure::BadData {
            message: format!("{}:{}: {error}", path.display(), line + 1),
        })?;
        Ok(timeless(row))
    });
    rows.collect()
}

fn if_there<T>(read: io::Result<T>, path: &Path) -> anyhow::Result<Option<T>> {
    match read {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        read => Ok(Some(read.with_context(|| cannot("read", path))?)),
    }
}
