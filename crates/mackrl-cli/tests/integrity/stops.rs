//! A stop takes no more than a few seconds, whatever is configured.

use std::{
    thread,
    time::{Duration, Instant},
};

use super::{cases, random, signal};
use crate::support::mackrl;

/// Longest that a stop may take on a machine that does nothing else; ours may do other things as well.
const LIMIT: Duration = Duration::from_secs(5);
/// How many times as long other work makes it.
const SLOWNESS: u32 = 3;

#[test]
fn a_stop_takes_five_seconds_over_the_whole_range_of_settings() {
    let mut random = random("stops");
    let count = cases(3);
    let mut longest = Duration::ZERO;
    for case in 0..count {
        let parent = tempfile::tempdir().expect("a folder for the run");
        let run = parent.path().join("run").display().to_string();
        let mut pick = |choices: &[u32]| random.choice(choices).copied().expect("one of some");
        let environments = format!("algorithm.environments={}", pick(&[1, 8, 64, 1024, 4096]));
        let hidden = format!("algorithm.hidden={}", pick(&[1, 64, 512, 2048, 4096]));
        let map = ["3m", "2s3z", "8m"][pick(&[0, 1, 2]) as usize];
        let words = [
            "train",
            "--map",
            map,
            "--threads",
            "1",
            "--out",
            &run,
            "--set",
            &environments,
            "--set",
            &hidden,
        ];
        let mut child = mackrl(&words).spawn().expect("the program starts");
        // Before its first moment a program has no say in how it is stopped.
        thread::sleep(Duration::from_millis(random.u64(500..6000)));
        let start = Instant::now();
        signal(child.id(), "TERM");
        let code = child.wait().expect("a child can be waited for").code();
        let took = start.elapsed();
        longest = longest.max(took);
        assert_eq!(code, Some(75), "case {case}: {environments} {hidden} {map}");
        assert!(
            took < LIMIT * SLOWNESS,
            "case {case}: {environments} {hidden} {map}: {took:?}"
        );
    }
    println!(
        "stops: {count} cases, the longest {:.1} s",
        longest.as_secs_f64()
    );
}
