//! Runs that were made earlier, as plots and reports need them: found below some folders, read, grouped into series.
//!
//! A run is its configuration and its curves; weights and checkpoints are left alone. Two kinds of record are read: run folders,
//! and the compact files that `mackrl reproduce` keeps of finished runs. Grouping is strict: runs count as repetitions of one
//! experiment only if nothing but their seeds differs, and are drawn together only if nothing but the algorithm (and what one
//! asked to compare) differs as well. Whoever wants to compare apples with pears says `--mix`.

mod curve;
mod find;
mod grid;
mod kept;
mod series;

use std::path::PathBuf;

use crate::{
    config::Config,
    error::{Context, Result},
    provenance::Provenance,
    run_folder::{self, Status},
    training::{Teams, headline},
};
pub use curve::{Axis, Measurements, final_mean, share_of};
pub use find::{find, locate, open};
pub use grid::Gridded;
pub use kept::{ByEnemies, TrainingRun};
pub use series::{Grouping, Selection, Series, group};

/// Folder of the files that are kept of the runs of a figure, below the figure's.
pub const KEPT: &str = "runs";
/// Folder of the run folders of a figure, below the figure's.
pub const TRAINING: &str = "training";

/// A run that was made earlier, or is being made.
#[derive(Debug, Clone)]
pub struct RecordedRun {
    /// Its folder, or its compact file.
    pub path: PathBuf,
    /// Everything that determines its result.
    pub config: Config,
    /// Its curves, if they are kept in a file and not in a folder.
    pub kept: Option<TrainingRun>,
    /// How far it has come.
    pub status: Status,
    /// Where its results come from: one entry for each version of the program that went on with it.
    pub provenance: Vec<Provenance>,
    /// Whether rows of its metrics are missing, because they were found damaged when the run continued.
    pub misses_rows: bool,
    /// How its last and its best weights play, if its folder says so.
    pub teams: Option<Teams>,
}

impl RecordedRun {
    /// Reads what is known about the run in a folder.
    ///
    /// # Errors
    /// If the folder holds no run, or one with a configuration that this program does not understand.
    pub fn open(path: PathBuf) -> Result<Self> {
        let (config, description) = run_folder::read_description(&path)
            .with_context(|| format!("cannot use {}", path.display()))?;
        Ok(Self {
            path,
            config,
            kept: None,
            status: description.status,
            provenance: description.provenance,
            misses_rows: !description.metrics_put_aside.is_empty(),
            teams: description.teams,
        })
    }

    /// Reads the run that is kept in a file.
    ///
    /// # Errors
    /// If the file holds no such run.
    pub fn open_kept(path: PathBuf) -> Result<Self> {
        let run = TrainingRun::load(&path)?;
        Ok(Self {
            config: run.config()?,
            status: Status::Finished,
            provenance: vec![run.provenance().clone()],
            misses_rows: false,
            teams: None,
            kept: Some(run),
            path,
        })
    }

    /// The metric that says best how well a team plays in its world; see [`headline`].
    #[must_use]
    pub fn headline(&self) -> String {
        let world = self.config.env.world();
        world.map_or_else(
            |_| "test_return_mean".to_owned(),
            |world| headline(world.spec()),
        )
    }

    /// Name of what learns, as configurations have it.
    pub fn algorithm(&self) -> String {
        self.config.algorithm.name().to_owned()
    }
}

/// The value at a key, as it is typed.
pub fn setting(config: &Config, key: &str) -> String {
    match config.get(key) {
        Some(toml::Value::String(text)) => text,
        Some(value) => value.to_string(),
        None => String::new(),
    }
}
