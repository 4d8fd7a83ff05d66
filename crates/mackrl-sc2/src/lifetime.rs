//! Processes that must not outlive those who need them.
//!
//! Linux kills a process when its parent dies, however that happens, if the process asked for it and nobody else stepped in
//! between. The request survives `exec`, so a game that knows nothing of it is started by a process of ours that asks and then
//! becomes the game ([`become_game`]). The kernel means the parent's *thread*, so games are started by one thread that lives as
//! long as this process ([`spawn`]).

use std::{
    io,
    process::{Child, Command},
    sync::{OnceLock, mpsc},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, getppid};

/// How often a process looks whether its parent is still there.
const LOOK: Duration = Duration::from_millis(200);

/// A process to be started, and whom to tell.
type Order = (Command, mpsc::Sender<io::Result<Child>>);

/// Ends this process soon after its parent has gone.
pub fn end_with_parent() {
    let parent = getppid();
    thread::spawn(move || {
        while getppid() == parent {
            thread::sleep(LOOK);
        }
        std::process::exit(0);
    });
}

/// Starts `command` from a thread that lives as long as this process.
///
/// # Errors
/// What the operating system says.
pub fn spawn(command: Command) -> io::Result<Child> {
    static ORDERS: OnceLock<mpsc::Sender<Order>> = OnceLock::new();
    let orders = ORDERS.get_or_init(|| {
        let (orders, incoming) = mpsc::channel::<Order>();
        thread::spawn(move || {
            for (mut command, reply) in incoming {
                // Whoever ordered waits for the reply.
                let _ = reply.send(command.spawn());
            }
        });
        orders
    });
    let (reply, answer) = mpsc::channel();
    let gone = || io::Error::other("the thread that starts processes is gone");
    orders.send((command, reply)).map_err(|_| gone())?;
    answer.recv().map_err(|_| gone())?
}

/// Becomes `command`, to be killed when the process `parent`, which must be this one's parent, dies. Returns only if it fails.
#[cfg(target_os = "linux")]
#[must_use]
pub fn become_game(parent: u32, mut command: Command) -> io::Error {
    use std::os::unix::process::CommandExt;

    if let Err(error) = rustix::process::set_parent_process_death_signal(Some(Signal::KILL)) {
        return error.into();
    }
    // The parent may have died before the kernel knew that it matters.
    if getppid()
        .map(Pid::as_raw_nonzero)
        .map(|pid| pid.get().unsigned_abs())
        != Some(parent)
    {
        return io::Error::other("the process that wanted the game has ended");
    }
    command.exec()
}

/// Is the number of a running process whose start the kernel dates `start`; see [`start_of`].
#[must_use]
pub fn is_running(pid: u32, start: u64) -> bool {
    start_of(pid) == Some(start)
}

/// When the process `pid` was started, in the kernel's ticks since the machine was: with it, a number that was given again
/// is not mistaken for the process that had it.
#[must_use]
pub fn start_of(pid: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name, in brackets, may hold anything; the start is field 22, the 20th after it. A zombie (Z) has ended.
    let (_, rest) = text.rsplit_once(')')?;
    let mut fields = rest.split_whitespace();
    let state = fields.next()?;
    let start = fields.nth(18)?.parse().ok()?;
    (state != "Z").then_some(start)
}

/// Kills the process `pid`.
///
/// # Errors
/// What the operating system says.
pub fn kill(pid: u32) -> io::Result<()> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    let pid = pid.ok_or(io::ErrorKind::InvalidInput)?;
    Ok(rustix::process::kill_process(pid, Signal::KILL)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_told_from_another_with_its_number_by_its_start() {
        let mut command = Command::new("sleep");
        command.arg("60");
        let mut child = spawn(command).unwrap();
        let start = start_of(child.id()).unwrap();
        assert!(is_running(child.id(), start));
        assert!(!is_running(child.id(), start + 1));
        kill(child.id()).unwrap();
        child.wait().unwrap();
        assert!(!is_running(child.id(), start));
    }
}
