//! Being asked to stop.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use anyhow::Context;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

/// Exit code of a program that a second SIGINT stopped at once: 128 + SIGINT, as shells have it.
const STOPPED_AT_ONCE: i32 = 130;

/// Whether somebody asked this program to stop.
#[derive(Debug, Clone, Default)]
pub(crate) struct StopRequest(Arc<AtomicBool>);

impl StopRequest {
    /// Listens for SIGINT, SIGTERM and SIGUSR1 (which batch systems send before a time limit). After the first of them, SIGINT
    /// stops the program at once.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(crate) fn listen() -> anyhow::Result<Self> {
        let request = Self::default();
        request.register().context("cannot listen for signals")?;
        Ok(request)
    }

    fn register(&self) -> io::Result<()> {
        // Handlers run in this order: the first SIGINT finds the flag down, and the second finds it up.
        flag::register_conditional_shutdown(SIGINT, STOPPED_AT_ONCE, Arc::clone(&self.0))?;
        flag::register(SIGINT, Arc::clone(&self.0))?;
        flag::register(SIGTERM, Arc::clone(&self.0))?;
        #[cfg(unix)]
        flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&self.0))?;
        Ok(())
    }

    /// Whether a signal has arrived.
    pub(crate) fn is_made(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Asks to stop, as a signal would, when nobody holds the other end of stdin any more.
    pub(crate) fn make_when_stdin_ends(&self) {
        let request = self.clone();
        thread::spawn(move || {
            // Whatever comes is ignored; an error is an end as well.
            let _ = io::copy(&mut io::stdin(), &mut io::sink());
            request.make();
        });
    }

    /// Asks to stop, as a signal would, after some time.
    pub(crate) fn make_after(&self, limit: Duration) {
        let request = self.clone();
        thread::spawn(move || {
            thread::sleep(limit);
            request.make();
        });
    }

    /// What is set as soon as a signal has arrived.
    pub(crate) const fn flag(&self) -> &Arc<AtomicBool> {
        &self.0
    }

    /// Asks to stop, as a signal would.
    pub(crate) fn make(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
