//! Training runs for the figures that show learning: many seeds, each learner with the same settings.
//!
//! Every run is an independent job with its own file, so a reproduction that was stopped goes on where it was: a run whose file
//! holds the same configuration is not repeated. Runs use one thread each, because many runs side by side use a machine
//! better than one run on all of it, and because their number of threads changes no result.

mod curve;
mod options;
mod run;

use std::{
    collections::VecDeque,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

pub(crate) use curve::{Curve, Difference};
pub(crate) use options::LearningOptions;
pub(crate) use run::{Job, Learner, TrainingRun};

/// Environment steps that progress is counted in.
const PROGRESS_STEPS: u64 = 1_000;

/// Plays all `jobs`, on as many threads as `options` says, and gives their runs in the order of the jobs.
///
/// `progress` hears how many thousands of environment steps of how many are done.
///
/// # Errors
/// The first job that failed.
pub(crate) fn train_all(
    jobs: &[Job],
    options: &LearningOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Vec<TrainingRun>> {
    let queue: Mutex<VecDeque<usize>> = Mutex::new((0..jobs.len()).collect());
    let per_job = usize::try_from(options.steps / PROGRESS_STEPS).unwrap_or(usize::MAX);
    let done = AtomicUsize::new(0);
    let advance = |thousands: usize| {
        let before = done.fetch_add(thousands, Ordering::Relaxed);
        progress(before + thousands, per_job * jobs.len());
    };
    let work = || -> Vec<(usize, anyhow::Result<TrainingRun>)> {
        let next = || {
            queue
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .pop_front()
        };
        let run = |index: usize| (index, jobs[index].run_or_load(options, per_job, &advance));
        std::iter::from_fn(next).map(run).collect()
    };
    let mut results: Vec<_> = thread::scope(|scope| {
        let workers: Vec<_> = (0..options.jobs().get())
            .map(|_| scope.spawn(work))
            .collect();
        let join = |worker: thread::ScopedJoinHandle<'_, _>| {
            worker
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        workers.into_iter().flat_map(join).collect()
    });
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
