//! Two writers: a live run's folder is removed or moved, and another run begins there.

use std::{fs, thread, time::Duration};

use super::{cases, random, signal};
use crate::support::{Outcome, exits, outcome, resume, train};

/// Settings that make a run last for about a second.
const LONGER: [&str; 1] = ["run.steps_env=6000"];
const OTHER: [&str; 2] = ["run.steps_env=6000", "run.seed=4"];

fn reference(settings: &[&str]) -> Outcome {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(train(&run, settings), 0);
    outcome(&run)
}

#[test]
fn a_run_whose_folder_another_run_took_leaves_it_alone() {
    let expected = reference(&OTHER);
    let mut random = random("writers");
    let count = cases(3);
    let mut met = 0;
    for case in 0..count {
        let parent = tempfile::tempdir().expect("a folder for runs");
        let run = parent.path().join("run");
        let old = train(&run, &LONGER).spawn().expect("the program starts");
        thread::sleep(Duration::from_millis(random.u64(50..400)));
        match random.u8(0..3) {
            0 => drop(fs::rename(&run, parent.path().join("moved"))),
            1 => drop(fs::remove_dir_all(&run)),
            _ => {
                for entry in fs::read_dir(&run).into_iter().flatten().flatten() {
                    let _ = fs::remove_file(entry.path());
                    let _ = fs::remove_dir_all(entry.path());
                }
            }
        }
        let mut new = train(&run, &OTHER).spawn().expect("the program starts");
        thread::sleep(Duration::from_millis(random.u64(0..300)));
        let kind = random.choice(["TERM", "KILL"]).expect("one of two");
        signal(new.id(), kind);
        let new = new.wait().expect("a child can be waited for");
        let old = old.wait_with_output().expect("a child can be waited for");
        let code = old.status.code();
        // What was done before the folder went is done; what came later is refused.
        let words = String::from_utf8_lossy(&old.stderr);
        assert!(
            matches!(code, Some(0 | 74)),
            "case {case}: {code:?} {words}"
        );
        met += usize::from(code == Some(74));
        if !run.join("config.toml").exists() {
            // The new run was killed before it began, or the removal met it.
            continue;
        }
        assert!(
            matches!(new.code(), Some(0 | 75 | 2) | None),
            "case {case}: {new:?}"
        );
        let config = fs::read_to_string(run.join("config.toml")).expect("a configuration");
        if !config.contains("seed = 4") {
            // The removal came before the old run had begun.
            continue;
        }
        exits(resume(&run, 1), 0);
        assert!(outcome(&run) == expected, "case {case}: a mixture");
    }
    println!("two writers: {count} cases, {met} of them stopped the old run");
}
