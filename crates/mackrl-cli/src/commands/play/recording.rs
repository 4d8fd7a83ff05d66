//! An episode on disk: what was done, and a hash of what came of it.

use std::path::Path;

use anyhow::Context;
use mackrl::config::EnvironmentConfig;
use mackrl_env::{
    Action, Environment, EpisodeKey, Observations, skirmish::scripted::ScriptedPolicy,
};
use serde::{Deserialize, Serialize};

use super::{episode::Episode, write};
use crate::{bounded, failure::Failure};

const FORMAT: &str = "mackrl-recording";
const VERSION: u32 = 1;
/// Greatest length of a recording in bytes: 128 agents for 100 000 steps need about 55 MB.
const LENGTH_MAX: usize = 64 << 20;

/// A recorded episode. A scenario's text is part of `env`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Recording {
    format: String,
    version: u32,
    /// Version of the program that recorded it.
    program: String,
    env: EnvironmentConfig,
    policy: ScriptedPolicy,
    key: EpisodeKey,
    steps: Vec<RecordedStep>,
    /// Hash of the state after the last step, in hexadecimal.
    final_state_hash: String,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedStep {
    /// One number for each agent.
    actions: Vec<usize>,
    /// Hash of the state after the step, in hexadecimal.
    state_hash: String,
}

/// Only what has to be known to understand the rest.
#[derive(Debug, Deserialize)]
struct Head {
    format: String,
    version: u32,
}

impl Recording {
    /// Of an episode that was played.
    pub(super) fn of(episode: &Episode) -> Self {
        let steps = episode.steps.iter().map(|step| RecordedStep {
            actions: step.actions.iter().map(|action| action.index()).collect(),
            state_hash: hexadecimal(step.hash),
        });
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            env: episode.map.clone(),
            policy: episode.policy,
            key: episode.key,
            steps: steps.collect(),
            final_state_hash: hexadecimal(episode.skirmish.state_hash()),
        }
    }

    /// Writes it as JSON.
    pub(super) fn write(&self, file: &Path) -> anyhow::Result<()> {
        let json = serde_json::to_string(self).context("cannot write the recording as JSON")?;
        write(file, (json + "\n").as_bytes())
    }

    /// Reads what somebody wrote.
    ///
    /// # Errors
    /// [`Failure::BadData`] with line and column if it is no recording, or one of another version.
    pub(super) fn read(file: &Path) -> anyhow::Result<Self> {
        let bytes = bounded::read(file, LENGTH_MAX)?;
        let bad = |message: String| Failure::BadData {
            message: format!("{}: {message}", file.display()),
        };
        let head: Head = serde_json::from_slice(&bytes)
            .map_err(|error| bad(format!("no recording of mackrl: {error}")))?;
        if head.format != FORMAT || head.version != VERSION {
            let message = format!(
                "format {:?} version {}, expected {FORMAT:?} version {VERSION}",
                head.format.chars().take(40).collect::<String>(),
                head.version
            );
            return Err(bad(message).into());
        }
        let recording: Self = serde_json::from_slice(&bytes)
            .map_err(|error| bad(format!("damaged recording: {error}")))?;
        if recording.key.episode >= 1 << 56 {
            return Err(bad("key.episode is 2^56 or more, expected less".to_owned()).into());
        }
        Ok(recording)
    }

    /// Plays it again.
    ///
    /// # Errors
    /// [`Failure::ReplayDiffers`] with the first step that differs, [`Failure::BadData`] for actions that cannot be played.
    pub(super) fn replay(&self, file: &Path) -> anyhow::Result<Episode> {
        let context = || format!("{}", file.display());
        self.env.validate().with_context(context)?;
        let mut episode = Episode::new(&self.env, self.policy, self.key).with_context(context)?;
        let spec = episode.skirmish.spec().clone();
        let bad = |step: usize, message: String| Failure::BadData {
            message: format!("{}: step {step}: {message}", file.display()),
        };
        let mut observations = Observations::new(&spec, 1);
        episode.begin(&mut observations);
        for (index, recorded) in self.steps.iter().enumerate() {
            let step = index + 1;
            if episode.end.is_some() {
                return Err(bad(step, "the episode is over, expected no more steps".into()).into());
            }
            if recorded.actions.len() != spec.agents {
                let message = format!(
                    "{} actions, expected one for each of {} agents",
                    recorded.actions.len(),
                    spec.agents
                );
                return Err(bad(step, message).into());
            }
            if let Some(action) = recorded
                .actions
                .iter()
                .find(|action| **action >= spec.actions)
            {
                let message = format!("action {action}, expected less than {}", spec.actions);
                return Err(bad(step, message).into());
            }
            let actions = recorded.actions.iter().map(|action| Action::new(*action));
            episode
                .advance(actions.collect(), &mut observations)
                .map_err(|error| bad(step, error.to_string()))?;
            let hash = hexadecimal(episode.skirmish.state_hash());
            if hash != recorded.state_hash {
                return Err(self.differs(file, step, &hash, &recorded.state_hash));
            }
        }
        let hash = hexadecimal(episode.skirmish.state_hash());
        if hash != self.final_state_hash {
            return Err(self.differs(file, self.steps.len(), &hash, &self.final_state_hash));
        }
        Ok(episode)
    }

    fn differs(&self, file: &Path, step: usize, found: &str, expected: &str) -> anyhow::Error {
        let recorded: String = expected.chars().take(16).collect();
        let message = format!(
            "{}: the replay first differs after step {step} of {}: state {found}, recorded {recorded} by mackrl {}",
            file.display(),
            self.steps.len(),
            self.program.chars().take(20).collect::<String>(),
        );
        Failure::ReplayDiffers { message }.into()
    }
}

fn hexadecimal(hash: u64) -> String {
    format!("{hash:016x}")
}
