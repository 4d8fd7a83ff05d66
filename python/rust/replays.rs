//! Recorded episodes: made, checked by playing them again, and shown.

use std::path::PathBuf;

use mackrl::policy::Behaviour;
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    RunError,
    replay::{self, Playback, Replay, ReplayError, Summary},
    run_folder::Run,
};
use mackrl_skirmish::scripted::ScriptedPolicy;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};

use crate::{
    configuration::Layers,
    errors::{self, IntoException, learning},
};

/// Plays an episode with the team of the run at `path`, and gives it as the content of a file.
#[pyfunction]
pub(crate) fn record_policy<'py>(
    py: Python<'py>,
    path: PathBuf,
    seed: Option<u64>,
    episode: u64,
    exploration: Option<f64>,
    checkpoint: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let which = crate::runs::which(checkpoint)?;
    let recorded = py.detach(|| -> Result<Vec<u8>, RunError> {
        let run = Run::open(&path, which)?;
        let seed = seed.unwrap_or(run.config.run.seed);
        let key = EpisodeKey::new(seed, Stream::Evaluation, episode);
        let behaviour = exploration.map_or(Behaviour::GREEDY, Behaviour::sampled);
        let replay = replay::record_policy(&run.config, &run.weights, behaviour, key)?;
        Ok(replay.to_bytes())
    });
    let bytes = recorded.map_err(IntoException::into_exception)?;
    Ok(PyBytes::new(py, &bytes))
}

/// Plays an episode by the script called `policy`.
#[pyfunction]
pub(crate) fn record_script<'py>(
    py: Python<'py>,
    layers: &Layers,
    policy: &str,
    seed: u64,
    episode: u64,
) -> PyResult<Bound<'py, PyBytes>> {
    let env = layers.environment()?;
    let policy: ScriptedPolicy = serde_json::from_value(policy.into())
        .map_err(|error| PyValueError::new_err(format!("policy: {error}")))?;
    let key = EpisodeKey::new(seed, Stream::Other, episode);
    let recorded = py.detach(|| replay::record_script(&env, policy, key));
    Ok(PyBytes::new(py, &recorded.map_err(learning)?.to_bytes()))
}

fn open(bytes: &[u8]) -> Result<(Replay, Playback), ReplayError> {
    let replay = Replay::from_bytes(bytes)?;
    let playback = replay.play()?;
    Ok((replay, playback))
}

/// How the episode went, as JSON. Every state is as recorded, or this fails.
#[pyfunction]
pub(crate) fn replay_summary(py: Python<'_>, bytes: &[u8]) -> PyResult<String> {
    let summary = py.detach(|| {
        open(bytes).map(|(replay, playback)| crate::json(&Summary::of(&replay, &playback)))
    });
    summary.map_err(|error| errors::replay(&error))
}

/// A page that shows it, for a browser.
#[pyfunction]
pub(crate) fn replay_page(py: Python<'_>, bytes: &[u8], step: usize) -> PyResult<String> {
    let page = py.detach(|| {
        open(bytes)
            .map(|(replay, playback)| replay::page(&replay, &playback, step.min(playback.steps())))
    });
    page.map_err(|error| errors::replay(&error))
}

/// The world's settings and the episode's name, what was done and thought at every step, and what each paid, as JSON.
#[pyfunction]
pub(crate) fn replay_steps(py: Python<'_>, bytes: &[u8]) -> PyResult<(String, String, Vec<f32>)> {
    let steps = py.detach(|| {
        open(bytes).map(|(replay, playback)| {
            let name = crate::json(&(&replay.env, &replay.key));
            (name, crate::json(&replay.steps), playback.reward_t)
        })
    });
    steps.map_err(|error| errors::replay(&error))
}
