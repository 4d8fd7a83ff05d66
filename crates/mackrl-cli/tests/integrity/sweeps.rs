//! Several sweeps on one plan share its runs, whoever of them is killed.

use std::{
    fs, thread,
    time::{Duration, Instant},
};

use super::{cases, random, signal};
use crate::support::{Outcome, exits, mackrl, outcome};

const PLAN: &str = "maps = [\"3m\"]\nalgorithms = [\"central-v\"]\nseeds = 4\n[settings]\nrun.steps_env = 6000\n\
    run.checkpoint_interval_steps_env = 500\nalgorithm.hidden = 8\nalgorithm.environments = 2\ntest.episodes = 2\n\
    test.interval_steps_env = 2000\n";

#[test]
fn many_sweeps_on_one_plan_make_each_run_once_and_call_none_failed() {
    let parent = tempfile::tempdir().expect("a folder for sweeps");
    let plan = parent.path().join("plan.toml");
    fs::write(&plan, PLAN).expect("a plan");
    let sweep = |out: &str| {
        let out = parent.path().join(out);
        let (plan, out) = (plan.display().to_string(), out.display().to_string());
        mackrl(&["sweep", &plan, "--jobs", "2", "--out", &out])
    };
    let outcomes = |out: &str| -> Vec<Outcome> {
        let seeds = (1..=4).map(|seed| format!("{out}/3m-central-v-seed{seed}"));
        seeds.map(|run| outcome(&parent.path().join(run))).collect()
    };
    exits(sweep("reference"), 0);
    let expected = outcomes("reference");
    let mut random = random("sweeps");
    let count = cases(2);
    let mut killed = 0;
    for case in 0..count {
        let out = format!("case{case}");
        let mut sweeps: Vec<_> = (0..2 + case % 2)
            .map(|_| sweep(&out).spawn().expect("the program starts"))
            .collect();
        let start = Instant::now();
        let mut hits = random.usize(1..4);
        while start.elapsed() < Duration::from_secs(120) {
            thread::sleep(Duration::from_millis(random.u64(20..200)));
            let going = sweeps
                .iter_mut()
                .position(|sweep| sweep.try_wait().is_ok_and(|ended| ended.is_none()));
            let Some(one) = going else {
                break;
            };
            if hits > 0 {
                hits -= 1;
                killed += 1;
                let kind = random
                    .choice(["TERM", "KILL", "INT"])
                    .expect("one of three");
                signal(sweeps[one].id(), kind);
            }
        }
        for sweep in sweeps {
            let output = sweep.wait_with_output().expect("a child can be waited for");
            let words = String::from_utf8_lossy(&output.stderr);
            let code = output.status.code();
            assert!(
                matches!(code, Some(0 | 75) | None),
                "case {case}: {code:?} {words}"
            );
            assert!(!words.contains("failed"), "case {case}: {words}");
        }
        exits(sweep(&out), 0);
        assert!(outcomes(&out) == expected, "case {case}: other runs");
        fs::remove_dir_all(parent.path().join(out)).expect("a sweep can be removed");
    }
    println!("many sweeps: {count} cases, {killed} of their processes killed or stopped");
}
