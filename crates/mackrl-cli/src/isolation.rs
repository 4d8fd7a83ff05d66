//! Keeping a process from everything but its stdin, stdout and stderr.
//!
//! On Linux a filter of system calls (seccomp) lets through what computing needs: reading from stdin, writing to stdout and stderr,
//! memory, the clock, ending. Any other call ends the process at once: opening a file, a socket or shared memory, starting or
//! signalling a process. Elsewhere there is no such filter, and the certificate says so.

use mackrl::decentralised::Isolation;

/// Keeps this process from now on from everything but its standard streams, if the system can; says what it achieved.
#[cfg(all(
    target_os = "linux",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
pub(crate) fn isolate() -> Isolation {
    match linux::filter().map(|filter| seccompiler::apply_filter_all_threads(&filter)) {
        Some(Ok(())) => Isolation::SystemCalls,
        _ => Isolation::Processes,
    }
}

#[cfg(not(all(
    target_os = "linux",
    any(target_arch = "x86_64", target_arch = "aarch64")
)))]
pub(crate) const fn isolate() -> Isolation {
    Isolation::Processes
}

/// Whether a process was ended because it tried to reach something else.
#[cfg(target_os = "linux")]
pub(crate) fn was_ended_by_it(status: std::process::ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    status.signal() == Some(signal_hook::consts::SIGSYS)
}

#[cfg(not(target_os = "linux"))]
pub(crate) const fn was_ended_by_it(_status: std::process::ExitStatus) -> bool {
    false
}

#[cfg(all(
    target_os = "linux",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
mod linux {
    use std::collections::BTreeMap;

    use seccompiler::{
        BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
        SeccompRule,
    };

    /// Calls that reach nothing outside the process.
    const HARMLESS: [i64; 22] = [
        libc::SYS_munmap,
        libc::SYS_mremap,
        libc::SYS_mprotect,
        libc::SYS_madvise,
        libc::SYS_brk,
        libc::SYS_futex,
        libc::SYS_close,
        libc::SYS_exit,
        libc::SYS_exit_group,
        libc::SYS_rt_sigreturn,
        libc::SYS_rt_sigprocmask,
        libc::SYS_rt_sigaction,
        libc::SYS_sigaltstack,
        libc::SYS_restart_syscall,
        libc::SYS_clock_gettime,
        libc::SYS_getrandom,
        libc::SYS_sched_yield,
        libc::SYS_sched_getaffinity,
        libc::SYS_getpid,
        libc::SYS_gettid,
        libc::SYS_rseq,
        libc::SYS_membarrier,
    ];

    /// The filter, if it can be built.
    pub(super) fn filter() -> Option<BpfProgram> {
        let mut rules: BTreeMap<i64, Vec<SeccompRule>> =
            HARMLESS.iter().map(|call| (*call, Vec::new())).collect();
        let of_stream = |stream| rule(0, SeccompCmpOp::Eq, stream);
        rules.insert(libc::SYS_read, vec![of_stream(0)?]);
        for call in [libc::SYS_write, libc::SYS_writev] {
            rules.insert(call, vec![of_stream(1)?, of_stream(2)?]);
        }
        // Memory of its own, and no file's.
        let anonymous = u64::try_from(libc::MAP_ANONYMOUS).ok()?;
        let own = rule(3, SeccompCmpOp::MaskedEq(anonymous), anonymous)?;
        rules.insert(libc::SYS_mmap, vec![own]);
        let filter = SeccompFilter::new(
            rules,
            SeccompAction::KillProcess,
            SeccompAction::Allow,
            std::env::consts::ARCH.try_into().ok()?,
        );
        filter.ok()?.try_into().ok()
    }

    /// Allows a call whose argument with this number compares so with `value`.
    fn rule(argument: u8, comparison: SeccompCmpOp, value: u64) -> Option<SeccompRule> {
        let condition =
            SeccompCondition::new(argument, SeccompCmpArgLen::Dword, comparison, value).ok()?;
        SeccompRule::new(vec![condition]).ok()
    }
}

#[cfg(all(test, target_os = "linux", target_arch = "x86_64"))]
mod tests {
    use std::{
        env, fs,
        net::TcpStream,
        process::{Command, Stdio},
    };

    use super::*;

    /// Tells the test below, in a process of its own, what to try.
    const TRIES: &str = "MACKRL_TEST_TRIES";

    /// Does nothing, unless the test below has started it.
    #[test]
    fn tries_to_reach_out() {
        let Ok(what) = env::var(TRIES) else {
            return;
        };
        assert_eq!(isolate(), Isolation::SystemCalls);
        match &*what {
            "nothing" => {}
            "reads a file" => drop(fs::read("/etc/hostname")),
            "writes a file" => drop(fs::write("/tmp/message", "left")),
            "connects" => drop(TcpStream::connect("127.0.0.1:9")),
            "starts a process" => drop(Command::new("true").spawn()),
            other => panic!("unknown: {other}"),
        }
        std::process::exit(0);
    }

    #[test]
    fn an_agent_that_reaches_out_is_ended() {
        for (what, is_ended) in [
            ("nothing", false),
            ("reads a file", true),
            ("writes a file", true),
            ("connects", true),
            ("starts a process", true),
        ] {
            let status = Command::new(env::current_exe().unwrap())
                .args(["--exact", "isolation::tests::tries_to_reach_out"])
                .args(["--nocapture", "--test-threads=1"])
                .env(TRIES, what)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()
                .unwrap();
            assert_eq!(was_ended_by_it(status), is_ended, "{what}: {status}");
        }
    }
}
