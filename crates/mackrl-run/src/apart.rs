//! Work in a thread of its own, which one need not wait for to its end.
//!
//! Most work looks at the request to stop often enough. Some steps do not: the update of a very large network, or making one. They
//! go on in their thread, what they would give is given up, and the program may end meanwhile.

use std::{
    io,
    sync::mpsc::{self, Receiver, RecvTimeoutError, Sender},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crate::stop_request::StopRequest;

/// Longest wait for a step after a stop was asked for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);
/// Between two looks at the request to stop.
const PAUSE: Duration = Duration::from_millis(20);
/// Stack of the thread: as much as a main thread has.
const STACK_BYTES: usize = 8 << 20;

type Task<T> = Box<dyn FnOnce(&mut T) + Send>;

/// Something that lives in a thread of its own.
#[derive(Debug)]
pub(crate) struct Apart<T> {
    tasks: Sender<Task<T>>,
    thread: Option<JoinHandle<()>>,
}

/// A step that was given up, because it did not end soon enough after a stop was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GivenUp;

impl<T: 'static> Apart<T> {
    /// Makes something in a thread of its own.
    ///
    /// # Errors
    /// [`GivenUp`]; within it, what `make` says, and the operating system if there can be no thread.
    pub(crate) fn start<E: Send + From<io::Error> + 'static>(
        make: impl FnOnce() -> Result<T, E> + Send + 'static,
        stop: &StopRequest,
    ) -> Result<Result<Self, E>, GivenUp> {
        let (tasks, received) = mpsc::channel::<Task<T>>();
        let (made, is_made) = mpsc::channel();
        let live = move || {
            let mut value = match make() {
                Ok(value) => value,
                Err(error) => {
                    // It is received, or not waited for any more.
                    let _ = made.send(Err(error));
                    return;
                }
            };
            let _ = made.send(Ok(()));
            for task in received {
                task(&mut value);
            }
        };
        let thread = thread::Builder::new().stack_size(STACK_BYTES).spawn(live);
        let mut apart = match thread {
            Ok(thread) => Self {
                tasks,
                thread: Some(thread),
            },
            Err(error) => return Ok(Err(error.into())),
        };
        let outcome = apart.wait(&is_made, stop)?;
        Ok(outcome.map(|()| apart))
    }

    /// What `task` gives.
    ///
    /// # Errors
    /// [`GivenUp`] if `stop` is made meanwhile, and the task goes on for too long.
    ///
    /// # Panics
    /// With what the task panics with.
    pub(crate) fn ask<R: Send + 'static>(
        &mut self,
        stop: &StopRequest,
        task: impl FnOnce(&mut T) -> R + Send + 'static,
    ) -> Result<R, GivenUp> {
        let (answer, answered) = mpsc::channel();
        let task: Task<T> = Box::new(move |value| drop(answer.send(task(value))));
        // The thread has ended by a panic if it takes no task; waiting tells.
        let _ = self.tasks.send(task);
        self.wait(&answered, stop)
    }

    /// What `task` gives, however long it takes.
    ///
    /// # Panics
    /// With what the task panics with.
    pub(crate) fn complete<R: Send + 'static>(
        &mut self,
        task: impl FnOnce(&mut T) -> R + Send + 'static,
    ) -> R {
        self.ask(&StopRequest::default(), task)
            .unwrap_or_else(|GivenUp| unreachable!("a stop is never asked for"))
    }

    fn wait<R>(&mut self, answered: &Receiver<R>, stop: &StopRequest) -> Result<R, GivenUp> {
        let mut end = None;
        loop {
            match answered.recv_timeout(PAUSE) {
                Ok(answer) => return Ok(answer),
                Err(RecvTimeoutError::Timeout) => {
                    if stop.is_made() {
                        let end = *end.get_or_insert_with(|| Instant::now() + PATIENCE);
                        if Instant::now() >= end {
                            return Err(GivenUp);
                        }
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let thread = self.thread.take().map(JoinHandle::join);
                    match thread {
                        Some(Err(panic)) => std::panic::resume_unwind(panic),
                        _ => unreachable!("a thread answers before it ends"),
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_on_for_too_long_is_given_up_and_nothing_else() {
        let stop = StopRequest::default();
        let mut apart = Apart::start(|| Ok::<_, io::Error>(5), &stop)
            .unwrap()
            .unwrap();
        assert_eq!(apart.ask(&stop, |value| *value + 2), Ok(7));
        stop.make();
        assert_eq!(apart.ask(&stop, |value| *value + 6), Ok(11));
        let start = Instant::now();
        let endless = apart.ask(&stop, |_| thread::sleep(Duration::from_secs(60)));
        assert_eq!(endless, Err(GivenUp));
        assert!(start.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn an_error_and_a_panic_come_through() {
        let stop = StopRequest::default();
        let failed = Apart::<()>::start(|| Err(io::Error::other("none")), &stop).unwrap();
        assert_eq!(failed.unwrap_err().to_string(), "none");
        let panicked = std::panic::catch_unwind(|| {
            let stop = StopRequest::default();
            let mut apart = Apart::start(|| Ok::<_, io::Error>(()), &stop)
                .unwrap()
                .unwrap();
            apart.ask(&stop, |()| panic!("on purpose"))
        });
        assert_eq!(
            panicked.unwrap_err().downcast_ref::<&str>(),
            Some(&"on purpose")
        );
    }
}
