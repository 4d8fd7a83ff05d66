//! What a run has recorded, for whoever compares it with another.

use std::{fs, io, path::Path};

use serde_json::{Map, Value};

use super::{METRICS, WEIGHTS, disk::cannot, read_record, run::read_config};
use crate::{
    config::Config,
    error::{Context, Result, RunError},
    provenance::Provenance,
};

/// A row of metrics.
pub type Row = Map<String, Value>;

/// What a run has recorded.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Everything that determines its result.
    pub config: Config,
    /// That of the latest version of the program that wrote here, if it says.
    pub provenance: Option<Provenance>,
    /// The rows of metrics, without what [`timeless`] leaves out.
    pub rows: Vec<Row>,
    /// The final weights, if the run has come so far.
    pub weights: Option<Vec<u8>>,
}

impl Recorded {
    /// Reads the run at `path`.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is none, [`RunError::BadData`] with the first line that is no row.
    pub fn open(path: &Path) -> Result<Self> {
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
pub fn timeless(mut row: Row) -> Row {
    row.retain(|name, _| !name.starts_with("sys/") && name != "provenance");
    row
}

fn read_rows(path: &Path) -> Result<Vec<Row>> {
    let text = if_there(fs::read_to_string(path), path)?.unwrap_or_default();
    // A run that goes on may be in the middle of a line.
    let whole = text.rsplit_once('\n').map_or("", |(lines, _)| lines);
    let rows = whole.lines().enumerate().map(|(line, text)| {
        let row = serde_json::from_str(text).map_err(|error| RunError::BadData {
            message: format!("{}:{}: {error}", path.display(), line + 1),
        })?;
        Ok(timeless(row))
    });
    rows.collect()
}

fn if_there<T>(read: io::Result<T>, path: &Path) -> Result<Option<T>> {
    match read {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        read => Ok(Some(read.with_context(|| cannot("read", path))?)),
    }
}
