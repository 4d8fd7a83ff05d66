//! What a run has recorded, to be compared with another.

use std::path::Path;

use super::{rows::Row, stored::StoredRun};
use crate::{config::Config, error::Result, provenance::Provenance};

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
    /// [`RunError::NotARun`](crate::RunError::NotARun) if there is none, [`RunError::BadData`](crate::RunError::BadData) with the
    /// first line that is no row of it, or if it is finished and something is not as it was then.
    pub fn open(path: &Path) -> Result<Self> {
        let run = StoredRun::open(path)?;
        let mut rows = Vec::new();
        run.rows(|row| rows.push(timeless(row)))?;
        let weights = run.weights()?;
        let record = run.record.as_ref();
        Ok(Self {
            provenance: record.and_then(|record| record.provenance.last().cloned()),
            rows,
            weights,
            config: run.config.config,
        })
    }
}

/// A row without what differs between two runs of the same numbers: what depends on the clock, and the provenance.
pub fn timeless(mut row: Row) -> Row {
    row.retain(|name, _| !name.starts_with("sys/") && name != "provenance");
    row
}
