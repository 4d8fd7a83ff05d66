//! Looking into replays: how they are opened, told, drawn and shown.

mod caption;
mod explanation;
mod film;
mod picture;

use std::path::Path;

use mackrl_env::AgentId;
use mackrl_run::{
    bounded,
    replay::{self, Names, Playback, Replay, ReplayError, Summary},
};

use crate::failure::Failure;
pub(crate) use explanation::{About, Explanation};
pub(crate) use film::film;
pub(crate) use picture::picture;

/// A replay that was opened and played again.
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) replay: Replay,
    pub(crate) playback: Playback,
    pub(crate) names: Names,
}

impl Opened {
    /// Reads and plays the file.
    ///
    /// # Errors
    /// What is wrong with the file, by its name.
    pub(crate) fn read(file: &Path) -> anyhow::Result<Self> {
        let bytes = bounded::read(file, Replay::FILE_MOST)?;
        let failed = |error| failure(file, &error);
        Self::of(Replay::from_bytes(&bytes).map_err(failed)?).map_err(|error| failed(error).into())
    }

    /// Reads and plays the content of a file.
    ///
    /// # Errors
    /// What is wrong with it.
    #[cfg(feature = "serve")]
    pub(crate) fn from_bytes(bytes: &[u8]) -> anyhow::Result<Self> {
        Ok(Self::of(Replay::from_bytes(bytes)?)?)
    }

    /// Plays a replay.
    pub(crate) fn of(replay: Replay) -> Result<Self, ReplayError> {
        let playback = replay.play()?;
        Ok(Self {
            names: Names::new(&playback.skirmish),
            replay,
            playback,
        })
    }

    /// How the episode went.
    pub(crate) fn summary(&self) -> Summary {
        Summary::of(&self.replay, &self.playback)
    }

    /// The page for the browser, which first shows `step`.
    pub(crate) fn page(&self, step: usize) -> String {
        replay::page(&self.replay, &self.playback, step)
    }

    /// `step`, if the episode is so long.
    ///
    /// # Errors
    /// [`Failure::Usage`] if it is not.
    pub(crate) fn check_step(&self, step: usize) -> Result<usize, Failure> {
        let steps = self.playback.steps();
        if step <= steps {
            return Ok(step);
        }
        let message =
            format!("--step {step} is after the end, expected at most {steps} in this episode");
        Err(Failure::Usage { message })
    }

    /// All agents.
    pub(crate) fn agents(&self) -> impl Iterator<Item = AgentId> + use<> {
        let agents = self.playback.moments[0].visible_n.len();
        (0..agents).map(AgentId::new)
    }

    /// The agents that somebody typed, by letter or by number.
    ///
    /// # Errors
    /// [`Failure::Usage`] if there is no such agent.
    pub(crate) fn group(&self, typed: &[String]) -> Result<Vec<AgentId>, Failure> {
        let find = |word: &String| {
            let word = word.trim();
            let is_meant = |agent: &AgentId| {
                self.names.agent(*agent).eq_ignore_ascii_case(word)
                    || agent.index().to_string() == word
            };
            self.agents().find(is_meant).ok_or_else(|| {
                let names: Vec<String> =
                    self.agents().map(|agent| self.names.agent(agent)).collect();
                Failure::Usage {
                    message: format!(
                        "no agent is called `{word}`, expected some of {}",
                        names.join(", ")
                    ),
                }
            })
        };
        let mut group: Vec<AgentId> = typed.iter().map(find).collect::<Result<_, _>>()?;
        group.sort_unstable();
        group.dedup();
        Ok(group)
    }
}

/// What the program says of a file that cannot be used.
fn failure(file: &Path, error: &ReplayError) -> Failure {
    let message = format!("{}: {error}", file.display());
    match error {
        ReplayError::OtherSimulator { program, .. } => Failure::OtherSimulator {
            message,
            program: program.clone(),
        },
        ReplayError::Differs { .. } => Failure::ReplayDiffers { message },
        _ => Failure::BadData { message },
    }
}
