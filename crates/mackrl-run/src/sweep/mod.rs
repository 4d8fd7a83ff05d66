//! Many runs: which there are, how each stands, and how they are made side by side.
//!
//! Every run has a process and a run folder of its own, with checkpoints like any other, so that nothing is lost when one of them,
//! the sweep or the machine stops, and so that a batch system can make single runs elsewhere. What is done is not a
//! separate ledger but the run folders themselves. The figures of the paper make their runs in the same way.

mod engine;
mod plan;

use std::{path::PathBuf, thread};

use serde::Serialize;

use crate::{
    config::Config,
    error::{Result, RunError},
    run_folder::{self, Holder, LatestRow, Occupation, RunFolder, Status},
};
pub use engine::{Making, Observer, Outcome, make_all};
pub use plan::Plan;

/// Runs that are looked at side by side: a disk that many machines share answers late, and to many questions at once.
const LOOKS: usize = 16;

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

/// How a run stands, and what else is known then.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Standing {
    /// How it stands.
    pub state: State,
    /// Of a running one, where: the process that makes it, if it says who it is.
    pub holder: Option<Holder>,
    /// Of a failed one, why, if it says so.
    pub failure: Option<String>,
}

impl Standing {
    /// Of a run of which nothing more is known.
    const fn only(state: State) -> Self {
        Self {
            state,
            holder: None,
            failure: None,
        }
    }
}

/// How these runs stand. A batch system is asked once, for all that are made in jobs of it on other machines.
pub fn standings<'a>(entries: impl IntoIterator<Item = &'a Entry>) -> Vec<Result<Standing>> {
    let seen = look_at(&entries.into_iter().collect::<Vec<_>>());
    let occupation = |seen: &Result<Seen>| match seen {
        Ok(Seen { occupation, .. }) => occupation.clone(),
        Err(_) => Occupation::Free,
    };
    let occupations = Occupation::settled(seen.iter().map(occupation).collect());
    let both = seen.into_iter().zip(occupations);
    both.map(|(seen, occupation)| Ok(seen?.standing(occupation)))
        .collect()
}

/// Looks at these runs, in their order, several at a time.
fn look_at(entries: &[&Entry]) -> Vec<Result<Seen>> {
    let own = entries.len().div_ceil(LOOKS).max(1);
    thread::scope(|scope| {
        let looks: Vec<_> = (entries.chunks(own))
            .map(|own| scope.spawn(|| own.iter().map(|entry| entry.look()).collect::<Vec<_>>()))
            .collect();
        let seen = looks.into_iter().map(|look| look.join());
        seen.flat_map(|seen| seen.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    })
}

/// What can be seen of a run without asking a batch system.
struct Seen {
    /// How far it has come; nothing, if it has not begun.
    status: Option<Status>,
    failure: Option<String>,
    occupation: Occupation,
}

impl Seen {
    fn standing(self, occupation: Occupation) -> Standing {
        let mut standing = Standing::only(match self.status {
            None => State::Waiting,
            Some(Status::Finished) => State::Finished,
            _ if occupation != Occupation::Free => State::Running,
            Some(Status::Failed) => State::Failed,
            Some(Status::Running | Status::Interrupted) => State::Stopped,
        });
        match (standing.state, occupation) {
            (State::Running, Occupation::Held(holder)) => standing.holder = holder,
            (State::Failed, _) => standing.failure = self.failure,
            _ => {}
        }
        standing
    }
}

impl Entry {
    /// How the run stands.
    ///
    /// # Errors
    /// [`RunError::OtherConfiguration`] if the folder holds a run with another configuration.
    pub fn state(&self) -> Result<State> {
        match standings([self]).pop() {
            Some(standing) => Ok(standing?.state),
            None => Ok(State::Waiting),
        }
    }

    fn look(&self) -> Result<Seen> {
        if !run_folder::is_run(&self.folder) {
            match RunFolder::check_free(&self.folder) {
                Ok(()) => {
                    return Ok(Seen {
                        status: None,
                        failure: None,
                        occupation: Occupation::Free,
                    });
                }
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
        let occupation = match description.status {
            Status::Finished => Occupation::Free,
            _ => Occupation::of(&self.folder),
        };
        Ok(Seen {
            status: Some(description.status),
            failure: description.failure,
            occupation,
        })
    }

    /// The first setting in which the run that is there differs from this one.
    fn first_difference(&self, there: &Config) -> Option<String> {
        if self.config == *there {
            return None;
        }
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

    /// The folder of its latest whole checkpoint, if it has one.
    pub fn checkpoint(&self) -> Option<PathBuf> {
        run_folder::latest_checkpoint(&self.folder)
    }

    /// What the run last wrote down.
    pub fn latest(&self) -> LatestRow {
        run_folder::latest_row(&self.folder)
    }
}
