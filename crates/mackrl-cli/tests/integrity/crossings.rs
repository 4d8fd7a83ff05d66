//! The same bits on every instruction set, and for runs that cross from one to another and back.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use super::{cases, random, signal};
use crate::support::{checkpoints, exits, outcome, resume, train_on, uninterrupted, wait_until};

/// What this machine can be asked to compute with.
fn sets() -> Vec<&'static str> {
    let mut sets = vec!["scalar"];
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
        {
            sets.push("avx2");
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            sets.push("avx512");
        }
    }
    #[cfg(target_arch = "aarch64")]
    sets.push("neon");
    sets
}

/// The programs that are compared: this one, and one of another build that the environment may name.
fn programs() -> Vec<PathBuf> {
    let own = assert_cmd::cargo::cargo_bin("mackrl");
    let other = env::var_os("MACKRL_OTHER_BUILD").map(PathBuf::from);
    std::iter::once(own).chain(other).collect()
}

/// The command as another program.
fn by(program: &Path, command: &Command) -> Command {
    let mut other = Command::new(program);
    other
        .args(command.get_args())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    other
}

#[test]
fn a_run_that_crosses_instruction_sets_builds_and_threads_gives_the_same_bits() {
    let expected = uninterrupted();
    let mut random = random("crossings");
    let (sets, programs) = (sets(), programs());
    let count = cases(4);
    let mut crossed = 0;
    for case in 0..count {
        let parent = tempfile::tempdir().expect("a folder for the run");
        let run = parent.path().join("run");
        let mut pick = || {
            let set = *random.choice(&sets).expect("a set");
            let program = random.choice(&programs).expect("a program").clone();
            (set, program, random.usize(1..5), random.usize(1..20))
        };
        let (set, program, threads, updates) = pick();
        let mut command = by(&program, &train_on(threads, &run, &[]));
        let mut child = command
            .env("MACKRL_SIMD", set)
            .spawn()
            .expect("the program starts");
        let named = format!("{updates:012}");
        let has_come_so_far = || {
            let last = checkpoints(&run).pop();
            last.is_some_and(|last| last.ends_with(&named))
        };
        if wait_until(&mut child, has_come_so_far) {
            signal(child.id(), "TERM");
        }
        if child.wait().expect("a child can be waited for").code() != Some(0) {
            crossed += 1;
            let (set, program, threads, _) = pick();
            let mut command = by(&program, &resume(&run, threads));
            command.env("MACKRL_SIMD", set);
            exits(command, 0);
        }
        assert!(outcome(&run) == expected, "case {case}");
    }
    println!(
        "crossings of builds: {count} cases, {crossed} of them crossed, sets {}, programs {}",
        sets.join(" "),
        programs.len()
    );
}
