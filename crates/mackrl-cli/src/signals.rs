//! Being asked to stop, by signals and otherwise.

use std::{io, sync::Arc, thread, time::Duration};

use anyhow::Context;
use mackrl_run::stop_request::StopRequest;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

use crate::failure;

/// Exit code of a program that a second SIGINT stopped at once: 128 + SIGINT, as shells have it.
const STOPPED_AT_ONCE: i32 = 130;

/// Listens for SIGINT, SIGTERM and SIGUSR1 (which batch systems send before a time limit). After the first of them, SIGINT
/// stops the program at once.
///
/// # Errors
/// If the operating system refuses.
pub(crate) fn listen() -> anyhow::Result<StopRequest> {
    let request = StopRequest::default();
    register(&request).context("cannot listen for signals")?;
    Ok(request)
}

fn register(request: &StopRequest) -> io::Result<()> {
    let flag = || Arc::clone(request.flag());
    // Handlers run in this order: the first SIGINT finds the flag down, and the second finds it up.
    flag::register_conditional_shutdown(SIGINT, STOPPED_AT_ONCE, flag())?;
    flag::register(SIGINT, flag())?;
    flag::register(SIGTERM, flag())?;
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGUSR1, flag())?;
    Ok(())
}

/// Ends the program if it was asked to stop, in work of which nothing is kept.
pub(crate) fn end_if_asked(request: &StopRequest, what: &str) {
    if request.is_made() {
        failure::end_stopped(what);
    }
}

/// Asks to stop, as a signal would, when the other end of stdin is closed.
pub(crate) fn stop_when_stdin_ends(request: &StopRequest) {
    let request = request.clone();
    thread::spawn(move || {
        // Whatever comes is ignored; an error is an end as well.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        request.make();
    });
}

/// Asks to stop, as a signal would, after some time.
pub(crate) fn stop_after(request: &StopRequest, limit: Duration) {
    let request = request.clone();
    thread::spawn(move || {
        thread::sleep(limit);
        request.make();
    });
}
