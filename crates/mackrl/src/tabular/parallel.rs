//! Independent jobs on several threads, collected in index order.

use std::{
    num::NonZeroUsize,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

/// `job(0), …, job(count − 1)`, the same for any number of threads. `done` hears how many jobs are finished after each one,
/// from any thread.
pub(super) fn map_in_order<T: Send>(
    count: usize,
    threads: NonZeroUsize,
    job: impl Fn(usize) -> T + Sync,
    done: impl Fn(usize) + Sync,
) -> Vec<T> {
    let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        let mut results = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return results;
            }
            results.push((index, job(index)));
            done(finished.fetch_add(1, Ordering::Relaxed) + 1);
        }
    };
    let mut results: Vec<(usize, T)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.get()).map(|_| scope.spawn(work)).collect();
        let join = |worker: thread::ScopedJoinHandle<'_, _>| {
            (worker.join()).unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        workers.into_iter().flat_map(join).collect()
    });
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_back_in_index_order_for_any_number_of_threads() {
        for threads in [1, 2, 7] {
            let heard = AtomicUsize::new(0);
            let squares = map_in_order(
                53,
                NonZeroUsize::new(threads).unwrap(),
                |i| i * i,
                |_| {
                    heard.fetch_add(1, Ordering::Relaxed);
                },
            );
            assert_eq!(squares, (0..53).map(|i| i * i).collect::<Vec<_>>());
            assert_eq!(heard.into_inner(), 53);
        }
    }
}
