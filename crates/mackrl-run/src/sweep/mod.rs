//! Many runs: which there are, how each stands, and how they are made side by side.
//!
//! Every run has a process and a run folder of its own, with checkpoints like any other, so that nothing is lost when one of them,
//! the sweep or the machine stops, and so that a batch system can make single runs elsewhere. What is done is not a
//! separate ledger but the run folders themselves. The figures of the paper make their runs in the same way.

mod engine;
mod plan;

use std::path::PathBuf;

use serde::Serialize;

use crate::{
    config::Config,
    error::{Result, RunError},
    run_folder::{self, LatestRow, RunFolder, Status},
};
pub use engine::{Observer, Outcome, make_all};
pub use plan::Plan;

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Says what is different about it; the name of its folder.
    pub name: String,
    /// Its run folder.
    pub folder: PathBuf,
    /// Everything that determines its result.
    pub config: Config,
}

/// How a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Not begun.
    Waiting,
    /// Begun and not finished, and no process makes it now.
    Stopped,
    /// A process makes it now.
    Running,
    /// At its end.
    Finished,
    /// Stopped by an error.
    Failed,
}

impl State {
    /// As it is printed.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Stopped => "stopped",
            Self::Running => "running",
            Self::Finished => "finished",
            Self::Failed => "failed",
        }
    }
}

impl Entry {
    /// How the run stands.
    ///
    /// # Errors
    /// [`RunError::OtherConfiguration`] if the folder holds a run with another configuration.
    pub fn state(&self) -> Result<State> {
        if !run_folder::is_run(&self.folder) {
            match RunFolder::check_free(&self.folder) {
                Ok(()) => return Ok(State::Waiting),
                // Another process has begun it since.
                Err(RunError::UnfinishedRun { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        let (config, description) = run_folder::read_description(&self.folder)?;
        if let Some(key) = self.first_difference(&config) {
            let folder = self.folder.clone();
            return Err(RunError::OtherConfiguration { folder, key });
        }
        Ok(match description.status {
            Status::Finished => State::Finished,
            _ if RunFolder::is_in_use(&self.folder) => State::Running,
            Status::Failed => State::Failed,
            Status::Running | Status::Interrupted => State::Stopped,
        })
    }

    /// The first setting in which the run that is there differs from this one.
    fn first_difference(&self, there: &Config) -> Option<String> {
        let keys = self.config.keys();
        let mut differing = keys.filter(|key| self.config.get(key) != there.get(key));
        differing.next()
    }

    /// Makes the folder ready for a process that goes on with the run in it, and says so; where another process is doing that now,
    /// says no.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn prepare(&self) -> Result<bool> {
        if run_folder::is_run(&self.folder) {
            return Ok(true);
        }
        match RunFolder::prepare(&self.folder, &self.config, 1) {
            Err(RunError::FolderLocked { .. }) => Ok(false),
            Err(RunError::UnfinishedRun { .. }) => Ok(true),
            Err(RunError::FolderInUse { .. }) if run_folder::is_run(&self.folder) => Ok(true),
            outcome => outcome.map(|()| true),
        }
    }

    /// What the run last wrote down.
    pub fn latest(&self) -> LatestRow {
        run_folder::latest_row(&self.folder)
    }
}
