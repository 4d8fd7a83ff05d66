//! Runs on disk: trained, resumed, evaluated.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{self, RecvTimeoutError, Sender},
    thread,
    time::Duration,
};

use mackrl_run::{
    RunError,
    config::Config,
    run_folder::{Description, Run, WhichWeights, read_description, read_rows},
    stop_request::StopRequest,
    training::{Episodes, assembly::RunWorld, evaluate_in},
    training_loop::{self, Observer, Standing, Summary},
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    configuration::Layers,
    errors::{IntoException, learning, world_failed},
    own_world::OF_THE_WORLD,
};

/// How long an interruption by the user may wait to be seen.
const POLL: Duration = Duration::from_millis(50);

/// What a run tells while it goes on.
enum News {
    Standing(Standing),
    Warning(String),
}

/// Sends news from the thread that trains.
struct Reporter(Sender<News>);

impl Observer for Reporter {
    fn begin(&mut self, standing: &Standing) {
        self.progress(standing);
    }

    fn progress(&mut self, standing: &Standing) {
        // Nobody may be left to read it.
        let _ = self.0.send(News::Standing(*standing));
    }

    fn warn(&mut self, message: &str) {
        let _ = self.0.send(News::Warning(message.to_owned()));
    }
}

/// Trains the run that `layers` describe in a new folder; `report` is called with (steps, steps in all, share of battles won
/// in the latest test), and with a warning's text. Gives the summary as JSON.
#[pyfunction]
#[pyo3(signature = (path, layers, threads, report=None))]
pub(crate) fn train(
    py: Python<'_>,
    path: PathBuf,
    layers: &Layers,
    threads: usize,
    report: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let config = layers.config()?;
    let world = RunWorld::new(&config).map_err(learning)?;
    let summary = watched(py, report, |stop, reporter| {
        training_loop::train(&path, &config, &world, threads, stop, reporter)
    })?;
    Ok(crate::json(&summary))
}

/// Goes on with the run at `path`; gives its summary as JSON, or nothing if it is finished.
#[pyfunction]
#[pyo3(signature = (path, threads, report=None))]
pub(crate) fn resume(
    py: Python<'_>,
    path: PathBuf,
    threads: usize,
    report: Option<Bound<'_, PyAny>>,
) -> PyResult<Option<String>> {
    let world = |config: &Config| RunWorld::new(config);
    let summary: Option<Summary> = watched(py, report, |stop, reporter| {
        training_loop::resume(&path, world, threads, stop, reporter)
    })?;
    Ok(summary.map(|summary| crate::json(&summary)))
}

/// Does `work` on a thread of its own, without the interpreter, while this one passes news on and waits for the user to
/// interrupt: then the work is asked to stop, and ends with a checkpoint.
fn watched<T: Send>(
    py: Python<'_>,
    report: Option<Bound<'_, PyAny>>,
    work: impl FnOnce(&StopRequest, &mut Reporter) -> Result<T, RunError> + Send,
) -> PyResult<T> {
    let stop = StopRequest::default();
    let report = report.map(Bound::unbind);
    let (outcome, interruption) = py.detach(|| {
        let (sender, news) = mpsc::channel();
        thread::scope(|scope| {
            let worker = scope.spawn(|| work(&stop, &mut Reporter(sender)));
            let mut interruption = None;
            loop {
                let first = news.recv_timeout(POLL);
                if matches!(first, Err(RecvTimeoutError::Disconnected)) {
                    break;
                }
                let latest = first.into_iter().chain(news.try_iter());
                let passed = Python::attach(|py| {
                    py.check_signals()?;
                    pass_on(py, report.as_ref(), latest)
                });
                if let Err(error) = passed {
                    stop.make();
                    interruption.get_or_insert(error);
                }
            }
            (worker.join(), interruption)
        })
    });
    let outcome = match outcome {
        Ok(outcome) => outcome,
        // What a world of the user's raises where nothing can be returned.
        Err(panic) => match panic.downcast::<String>() {
            Ok(text) if text.contains(OF_THE_WORLD) => return Err(world_failed(*text)),
            Ok(text) => std::panic::resume_unwind(text),
            Err(panic) => std::panic::resume_unwind(panic),
        },
    };
    match (outcome, interruption) {
        // What the user did says more than that the run stopped for it.
        (Err(error), Some(interruption)) if error.is_interruption() => Err(interruption),
        (outcome, _) => outcome.map_err(IntoException::into_exception),
    }
}

/// Calls `report` with every warning and with the latest standing.
fn pass_on(
    py: Python<'_>,
    report: Option<&Py<PyAny>>,
    news: impl Iterator<Item = News>,
) -> PyResult<()> {
    let Some(report) = report else {
        return Ok(());
    };
    let mut latest = None;
    for one in news {
        match one {
            News::Standing(standing) => latest = Some(standing),
            News::Warning(message) => drop(report.call1(py, (message,))?),
        }
    }
    if let Some(Standing {
        steps_env,
        steps_env_total,
        battle_won_mean,
        ..
    }) = latest
    {
        report.call1(py, (steps_env, steps_env_total, battle_won_mean))?;
    }
    Ok(())
}

/// The weights that are called so: `last`, `best`, or a number of steps.
pub(crate) fn which(checkpoint: &str) -> PyResult<WhichWeights> {
    (checkpoint.parse())
        .map_err(|problem: String| PyValueError::new_err(format!("checkpoint is {problem}")))
}

/// Plays greedy episodes with the team of the run at `path`; gives means and standard errors as JSON.
#[pyfunction]
pub(crate) fn evaluate(
    py: Python<'_>,
    path: PathBuf,
    episodes: usize,
    seed: Option<u64>,
    threads: usize,
    checkpoint: &str,
) -> PyResult<String> {
    let which = which(checkpoint)?;
    py.detach(|| -> Result<String, RunError> {
        let run = Run::open(Path::new(&path), which)?;
        let chosen = Episodes {
            count: episodes,
            seed: seed.unwrap_or(run.config.run.seed),
        };
        let world = RunWorld::new(&run.config)?;
        let evaluation = evaluate_in(&world, &run.config, &run.weights, chosen, threads)?;
        Ok(crate::json(&evaluation))
    })
    .map_err(IntoException::into_exception)
}

/// How far the run at `path` has come, its configuration, and how its teams play, as JSON.
#[pyfunction]
pub(crate) fn run_description(py: Python<'_>, path: PathBuf) -> PyResult<(String, String, String)> {
    let (config, description) = py
        .detach(|| read_description(&path))
        .map_err(IntoException::into_exception)?;
    let Description { status, teams, .. } = description;
    Ok((
        crate::json(&status),
        crate::json(&config),
        crate::json(&teams),
    ))
}

/// The rows of metrics of the run at `path`, as JSON.
#[pyfunction]
pub(crate) fn run_rows(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let rows = py.detach(|| read_rows(&path));
    Ok(crate::json(&rows.map_err(IntoException::into_exception)?))
}

/// The maps of the simulator.
#[pyfunction]
pub(crate) fn maps() -> Vec<String> {
    mackrl_skirmish::map_names()
        .into_iter()
        .map(str::to_owned)
        .collect()
}
