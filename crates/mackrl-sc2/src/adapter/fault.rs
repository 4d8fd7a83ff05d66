//! What can go wrong with a game.

use std::{io, time::Duration};

use thiserror::Error;

use crate::websocket::WebsocketError;

/// Why a game is of no use any more.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GameFault {
    /// It did not start, or nobody listened.
    #[error("the game did not start: {0}")]
    Launch(String),
    /// It is not the version that was asked for, or plays by other numbers.
    #[error("the wrong game: {0}")]
    Version(String),
    /// It did not answer in time.
    #[error("the game did not answer {request} within {:.1} s", patience.as_secs_f64())]
    Late {
        /// What was asked.
        request: &'static str,
        /// How long was waited.
        patience: Duration,
    },
    /// It went away.
    #[error("the game went away at {request}")]
    Closed {
        /// What was asked.
        request: &'static str,
    },
    /// It answered something impossible.
    #[error("the game's answer to {request} makes no sense: {problem}")]
    Garbage {
        /// What was asked.
        request: &'static str,
        /// What was found and what was expected.
        problem: String,
    },
    /// It would not do what was asked.
    #[error("the game refused {request}: {reason}")]
    Refused {
        /// What was asked.
        request: &'static str,
        /// Its words.
        reason: String,
    },
}

/// The kinds of [`GameFault`], for counting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// [`GameFault::Launch`].
    Launch,
    /// [`GameFault::Version`].
    Version,
    /// [`GameFault::Late`].
    Late,
    /// [`GameFault::Closed`].
    Closed,
    /// [`GameFault::Garbage`].
    Garbage,
    /// [`GameFault::Refused`].
    Refused,
}

impl FaultKind {
    /// All of them, with their names in metrics.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Launch, "launch"),
        (Self::Version, "version"),
        (Self::Late, "late"),
        (Self::Closed, "closed"),
        (Self::Garbage, "garbage"),
        (Self::Refused, "refused"),
    ];
}

impl GameFault {
    /// What kind of fault it is.
    #[must_use]
    pub const fn kind(&self) -> FaultKind {
        match self {
            Self::Launch(_) => FaultKind::Launch,
            Self::Version(_) => FaultKind::Version,
            Self::Late { .. } => FaultKind::Late,
            Self::Closed { .. } => FaultKind::Closed,
            Self::Garbage { .. } => FaultKind::Garbage,
            Self::Refused { .. } => FaultKind::Refused,
        }
    }

    /// Whether another process of the same game may do better.
    #[must_use]
    pub const fn may_pass(&self) -> bool {
        !matches!(self, Self::Version(_))
    }

    pub(super) fn garbage(request: &'static str, problem: impl Into<String>) -> Self {
        Self::Garbage {
            request,
            problem: problem.into(),
        }
    }

    /// What a failed exchange means.
    pub(super) fn of_connection(request: &'static str, error: WebsocketError) -> Self {
        match error {
            WebsocketError::Late(patience) => Self::Late { request, patience },
            WebsocketError::Closed => Self::Closed { request },
            other => Self::garbage(request, other.to_string()),
        }
    }
}

impl From<io::Error> for GameFault {
    fn from(error: io::Error) -> Self {
        Self::Launch(error.to_string())
    }
}
