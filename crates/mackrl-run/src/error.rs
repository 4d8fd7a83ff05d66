//! What can go wrong with a run on disk.
//!
//! Every kind has a type, so that a program can say what helps; the files and numbers that are to blame stand in the message.

use std::{fmt::Write as _, io, path::PathBuf};

use mackrl::NotFinite;
use thiserror::Error;

use crate::{
    config::ConfigError,
    run_folder::{Holder, WhichWeights},
};

/// What this crate's functions give.
pub type Result<T, E = RunError> = std::result::Result<T, E>;

/// What can go wrong with a run on disk.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// A folder in which nothing may be overwritten.
    #[error("{} already holds {holds}, and is not overwritten", folder.display())]
    FolderInUse {
        /// The folder.
        folder: PathBuf,
        /// What lies there, for "holds ...".
        holds: &'static str,
    },
    /// A folder in which a run can go on.
    #[error("{} already holds an unfinished run, and is not overwritten", folder.display())]
    UnfinishedRun {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder in which another process writes.
    #[error("another process is writing in {}{}", folder.display(), in_brackets(holder.as_deref()))]
    FolderLocked {
        /// The folder.
        folder: PathBuf,
        /// Who that is, if it says so.
        holder: Option<Box<Holder>>,
    },
    /// A folder that was moved or removed while a run was being made in it.
    #[error("{} was moved or removed while the run was being made", folder.display())]
    FolderReplaced {
        /// Where it lay.
        folder: PathBuf,
    },
    /// A folder in which no run lies.
    #[error("{} is not a run folder: it has no config.toml", folder.display())]
    NotARun {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder that holds another run than the one that should be made there.
    #[error("{} holds a run with another configuration: `{key}` is different", folder.display())]
    OtherConfiguration {
        /// The folder.
        folder: PathBuf,
        /// A setting in which they differ.
        key: String,
    },
    /// A run that was to be extended, and is planned for more.
    #[error("{} is planned for {planned} environment steps, expected more than that", folder.display())]
    NotFurther {
        /// Its folder.
        folder: PathBuf,
        /// Environment steps that are planned.
        planned: u64,
    },
    /// A run that ended and has no checkpoint from before its end.
    #[error("{} keeps no checkpoint from before its end, from which it could go further", folder.display())]
    NoWayFurther {
        /// Its folder.
        folder: PathBuf,
    },
    /// A run that was asked to stop, and can go on.
    #[error("{} was stopped at {steps_env} environment steps; its metrics and its latest checkpoint are kept", folder.display())]
    Interrupted {
        /// Its folder.
        folder: PathBuf,
        /// How far it came.
        steps_env: u64,
    },
    /// Many runs that were asked to stop, and can go on.
    #[error(
        "stopped when {finished} of {runs} runs were finished; the others keep their latest checkpoints"
    )]
    SweepInterrupted {
        /// Runs that have reached their end.
        finished: usize,
        /// All runs.
        runs: usize,
    },
    /// An update with a number that is not finite, of which nothing was kept.
    #[error("the run cannot go on: {number}")]
    UpdateRefused {
        /// The number, and where it turned up.
        number: Box<NotFinite>,
        /// The folder of the run.
        folder: PathBuf,
    },
    /// Stored data that cannot be used.
    #[error("{message}")]
    BadData {
        /// What is wrong with which file.
        message: String,
    },
    /// No run, or no metric of that name, is where one was asked for.
    #[error("{message}")]
    Selection {
        /// What was asked for, and what there is.
        message: String,
    },
    /// Runs of which none has reached its end.
    #[error("none of the {runs} runs is finished")]
    NoneFinished {
        /// How many there are.
        runs: usize,
    },
    /// Weights that a run does not keep.
    #[error("{} keeps no weights `{asked}`{}; there are: {there}", folder.display(), suggested(nearest.as_ref()))]
    NoSuchWeights {
        /// Its folder.
        folder: PathBuf,
        /// Which were asked for.
        asked: WhichWeights,
        /// Those of the nearest number of steps, if a number was asked for and there are any.
        nearest: Option<WhichWeights>,
        /// Those that it has, in words.
        there: String,
    },
    /// A metric that a run does not have.
    #[error("{message}")]
    MissingMetric {
        /// Which, and what it may be mistaken for.
        message: String,
    },
    /// Runs that are not repetitions of one experiment.
    #[error("{message}")]
    UnlikeRuns {
        /// In what they differ.
        message: String,
        /// The setting, if it is one.
        key: Option<String>,
    },
    /// A file, a folder or a process with which the operating system could not do something.
    #[error("{what}")]
    System {
        /// What could not be done: "cannot write PATH (N bytes)".
        what: String,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// An error, and what it kept from being done.
    #[error("{what}")]
    Within {
        /// What could not be done.
        what: String,
        /// Why.
        #[source]
        source: Box<Self>,
    },
    /// A configuration that cannot be used.
    #[error(transparent)]
    Config(Box<ConfigError>),
    /// What went wrong while learning or playing.
    #[error(transparent)]
    Learning(#[from] mackrl::Error),
}

impl From<ConfigError> for RunError {
    fn from(error: ConfigError) -> Self {
        Self::Config(Box::new(error))
    }
}

/// That there can be no further thread.
impl From<io::Error> for RunError {
    fn from(source: io::Error) -> Self {
        Self::System {
            what: "cannot start a thread".to_owned(),
            source,
        }
    }
}

impl RunError {
    /// The error and what caused it, on one line.
    #[must_use]
    pub fn chain(&self) -> String {
        let mut text = self.to_string();
        let mut cause = std::error::Error::source(self);
        while let Some(error) = cause {
            let _ = write!(text, ": {error}");
            cause = error.source();
        }
        text
    }

    /// The error itself, without what it kept from being done.
    #[must_use]
    pub fn root(&self) -> &Self {
        match self {
            Self::Within { source, .. } => source.root(),
            error => error,
        }
    }

    /// Whether this is [`RunError::Interrupted`].
    #[must_use]
    pub const fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted { .. })
    }

    /// Whether this is [`RunError::MissingMetric`].
    #[must_use]
    pub const fn is_missing_metric(&self) -> bool {
        matches!(self, Self::MissingMetric { .. })
    }
}

/// ", the nearest are 50000"
fn suggested(nearest: Option<&WhichWeights>) -> String {
    nearest.map_or_else(String::new, |nearest| {
        format!(", the nearest are {nearest}")
    })
}

/// " (process 7 on node1)"; nothing, if it is not known.
fn in_brackets(holder: Option<&Holder>) -> String {
    holder.map_or_else(String::new, |holder| format!(" ({holder})"))
}

/// Says what could not be done.
pub(crate) trait Context<T> {
    /// The error with the words of `what` before it.
    fn with_context<W: Into<String>>(self, what: impl FnOnce() -> W) -> Result<T>;
}

impl<T> Context<T> for io::Result<T> {
    fn with_context<W: Into<String>>(self, what: impl FnOnce() -> W) -> Result<T> {
        self.map_err(|source| RunError::System {
            what: what().into(),
            source,
        })
    }
}

impl<T> Context<T> for Result<T> {
    fn with_context<W: Into<String>>(self, what: impl FnOnce() -> W) -> Self {
        self.map_err(|source| RunError::Within {
            what: what().into(),
            source: Box::new(source),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_names_every_cause_once() {
        let missing: io::Result<()> = Err(io::Error::other("it is gone"));
        let error = missing
            .with_context(|| "cannot read x")
            .with_context(|| "cannot use y")
            .unwrap_err();
        assert_eq!(error.chain(), "cannot use y: cannot read x: it is gone");
        let message = "z is damaged".to_owned();
        let learning = RunError::from(mackrl::Error::Data(message.clone()));
        assert_eq!(learning.chain(), message);
    }
}
