//! Files from a stranger cost at most a bounded parse: nothing panics, memory and time are bounded, no path leads elsewhere.
//!
//! Every target takes files of one kind: sound ones, those that once failed (`corpus/TARGET/`), and mutations of both. Cases
//! follow from a seed, so a failure can be repeated; its input is kept, too.
//!
//! ```sh
//! cargo test -p mackrl --features slow-tests --test fuzz                                                      # half a minute, seed 1
//! MACKRL_FUZZ_SECONDS=7200 MACKRL_FUZZ_SEED=2 cargo test --release -p mackrl --features slow-tests --test fuzz -- --nocapture
//! MACKRL_FUZZ_TARGET=scenario MACKRL_FUZZ_INPUT=/path/to/kept/input cargo test -p mackrl --features slow-tests --test fuzz
//! ```
//!
//! The harness is our own because the usual ones need a nightly compiler (`cargo fuzz`) or, on a stable one, do without the
//! knowledge of formats (`bolero` draws bytes). What these parsers get wrong lies behind lengths, hashes and keys that match, so
//! knowing the format finds more here than watching branches.
#![cfg(unix)]

mod library;
mod mutation;
mod program;

use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    str::FromStr,
    time::{Duration, Instant},
};

use fastrand::Rng;
use peak_alloc::PeakAlloc;

/// Counts what is allocated; this program has one test, so it is that of one case.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Seconds for all targets together unless the environment asks for another number.
const SECONDS: f64 = 25.0;
/// Memory that a case may take, beside a multiple of its input.
const MEMORY_MAX: usize = 32 << 20;
/// Bytes that may be allocated for a byte of input.
const MEMORY_PER_BYTE: usize = 200;
/// Time that a case may take. The machine may be busy, so this is far more than any needs.
const TIME_MAX: Duration = Duration::from_secs(10);

/// A kind of file.
trait Target {
    /// What it is called in `MACKRL_FUZZ_TARGET` and in `corpus/`.
    fn name(&self) -> &'static str;

    /// Sound files, of which mutations are made.
    fn seeds(&self) -> Vec<Vec<u8>>;

    /// Words that mean something in these files.
    fn words(&self) -> Vec<String>;

    /// Makes an input of the seeds; most targets leave that to the usual mutations.
    fn input(&self, seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
        mutation::mutated(seeds, words, rng)
    }

    /// Reads an input and uses it as far as it can be used.
    ///
    /// # Errors
    /// What must not happen. A refusal is no error.
    fn read(&mut self, input: &[u8]) -> Result<(), String>;
}

fn targets() -> Vec<Box<dyn Target>> {
    vec![
        Box::new(library::Configuration),
        Box::new(library::Scenario),
        Box::new(library::Weights::default()),
        Box::new(library::Checkpoints::default()),
        Box::new(library::Replays),
        Box::new(program::RunFolders::default()),
    ]
}

#[test]
fn no_file_makes_the_program_panic_or_take_more_than_its_share() {
    let only = std::env::var("MACKRL_FUZZ_TARGET").ok();
    let mut targets = targets();
    targets.retain(|target| only.as_deref().is_none_or(|only| target.name() == only));
    assert!(!targets.is_empty(), "MACKRL_FUZZ_TARGET names no target");
    if let Ok(input) = std::env::var("MACKRL_FUZZ_INPUT") {
        let input = fs::read(input).expect("MACKRL_FUZZ_INPUT can be read");
        return attempt(&mut *targets[0], &input).expect("the input is refused or used");
    }
    let seconds = number("MACKRL_FUZZ_SECONDS").unwrap_or(SECONDS);
    let seed = number("MACKRL_FUZZ_SEED").unwrap_or(1);
    let share = Duration::from_secs_f64(seconds / targets.len() as f64);
    for target in &mut targets {
        let cases = fuzz(&mut **target, seed, share);
        println!("{}: {cases} cases", target.name());
        assert!(cases >= 10, "{} had {cases} cases", target.name());
    }
}

/// Reads the seeds, what once failed, and mutations for so long; gives the number of cases.
fn fuzz(target: &mut dyn Target, seed: u64, share: Duration) -> u64 {
    let start = Instant::now();
    let (words, mut seeds) = (target.words(), target.seeds());
    seeds.extend(corpus(target.name()));
    let mut cases = 0;
    for input in &seeds {
        check(target, input, "seed");
        cases += 1;
    }
    for case in 0.. {
        if start.elapsed() >= share {
            break;
        }
        let mut rng = Rng::with_seed(seed << 40 | case);
        let input = target.input(&seeds, &words, &mut rng);
        check(target, &input, &format!("{seed}-{case}"));
        cases += 1;
    }
    cases
}

/// Keeps an input while it is tried, and for ever if it fails: a stack that overflows leaves no time to keep it afterwards.
fn check(target: &mut dyn Target, input: &[u8], case: &str) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz");
    fs::create_dir_all(&folder).expect("a folder for inputs");
    let kept = folder.join(format!("{}-{case}", target.name()));
    fs::write(&kept, input).expect("an input can be kept");
    if let Err(problem) = attempt(target, input) {
        panic!(
            "{problem}\nrepeat with MACKRL_FUZZ_TARGET={} MACKRL_FUZZ_INPUT={} cargo test -p mackrl --features slow-tests --test fuzz",
            target.name(),
            kept.display()
        );
    }
    fs::remove_file(&kept).expect("a kept input can be removed");
}

/// Reads an input, and measures.
fn attempt(target: &mut dyn Target, input: &[u8]) -> Result<(), String> {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    catch_unwind(AssertUnwindSafe(|| target.read(input)))
        .map_err(|_| "it panicked".to_owned())??;
    let (took, memory) = (start.elapsed(), MEMORY.peak_usage() - before);
    let memory_max = MEMORY_MAX + MEMORY_PER_BYTE * input.len();
    if memory > memory_max {
        return Err(format!(
            "it took {memory} bytes, expected at most {memory_max}"
        ));
    }
    if took > TIME_MAX {
        return Err(format!("it took {took:?}, expected at most {TIME_MAX:?}"));
    }
    Ok(())
}

/// Files that once failed, or lead where mutations seldom come.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fuzz/corpus")
        .join(target);
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| fs::read(path).expect("the corpus can be read"))
        .collect()
}

fn number<N: FromStr>(variable: &str) -> Option<N> {
    let text = std::env::var(variable).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{variable} is a number")),
    )
}
