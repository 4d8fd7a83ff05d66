//! A long run takes no more memory, no more file handles and no more time for a step at its end than at its beginning.
//!
//! The hour, with its samples and its verdict kept in a folder:
//!
//! ```sh
//! MACKRL_SOAK_SECONDS=3600 MACKRL_SOAK_OUT=results/robustness/soak cargo test --release -p mackrl --features slow-tests --test soak
//! ```
//!
//! Time for a step is time of the processor, because a machine that does other things as well slows a run without its fault.
//! It is measured always and judged only where it is watched for long enough: within seconds, other work on the machine and what
//! the team learns change it by a quarter. The first quarter of the time is not judged: buffers reach their sizes.
#![cfg(target_os = "linux")]

mod support;

use std::{
    fmt::Write as _,
    fs::{self, File},
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    process::{Child, Command},
    time::{Duration, Instant},
};

use serde_json::json;
use support::{mackrl, wait_until};

/// Seconds that are watched unless the environment asks for another number.
const SECONDS: f64 = 10.0;
/// Looks at the process, evenly over that time.
const SAMPLES: u32 = 240;
/// Greatest growth of memory over the judged time. An hour has some 10⁸ environment steps: one byte leaked in ten is found.
const MEMORY_GROWTH_MAX_KIB: f64 = 8192.0;
/// Greatest growth of the processor's time for a step, from the first half of the judged time to the second, as a share.
const COST_GROWTH_MAX: f64 = 0.2;
/// Seconds from which on the time for a step is judged.
const COST_JUDGED_FROM_S: f64 = 600.0;
/// A checkpoint that is being written has a few files open; a look that meets one is no leak.
const HANDLES_GROWTH_MAX: usize = 3;
/// Ticks of /proc/PID/stat in a second: the same on every Linux that this runs on.
const TICKS_PER_S: f64 = 100.0;

/// What is run: the paper's settings, until somebody says stop.
const TRAINING: &[&str] = &[
    "train",
    "--map",
    "3m",
    "--preset",
    "paper",
    "--steps",
    "1000000000000",
    "--threads",
    "2",
];

/// One look at the process.
#[derive(Debug, Clone, Copy)]
struct Sample {
    wall_s: f64,
    processor_s: f64,
    steps_env: f64,
    resident_kib: f64,
    handles: usize,
}

impl Sample {
    /// Looks at a process that trains into `run`; `None` before its first row of metrics.
    fn of(child: &Child, run: &Path, start: Instant) -> Option<Self> {
        let process = PathBuf::from(format!("/proc/{}", child.id()));
        let status = fs::read_to_string(process.join("status")).ok()?;
        let resident = status
            .lines()
            .find_map(|line| line.strip_prefix("VmRSS:"))?;
        let stat = fs::read_to_string(process.join("stat")).ok()?;
        // The name of the program, in brackets, may hold spaces; user and system time are the 12th and 13th fields after it.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |index: usize| fields.get(index)?.parse::<f64>().ok();
        Some(Self {
            wall_s: start.elapsed().as_secs_f64(),
            processor_s: (ticks(11)? + ticks(12)?) / TICKS_PER_S,
            steps_env: latest_steps_env(&run.join("metrics.jsonl"))?,
            resident_kib: resident.split_whitespace().next()?.parse().ok()?,
            handles: fs::read_dir(process.join("fd")).ok()?.count(),
        })
    }
}

/// Environment steps in the last whole row of metrics.
fn latest_steps_env(metrics: &Path) -> Option<f64> {
    const LONGER_THAN_TWO_ROWS: u64 = 16 << 10;
    let mut file = File::open(metrics).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LONGER_THAN_TWO_ROWS)))
        .ok()?;
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    let row = text[..=text.rfind('\n')?].lines().last()?;
    let row: serde_json::Value = serde_json::from_str(row).ok()?;
    row["t_env"].as_f64()
}

/// How much a line through points rises from the first to the last, and its mean; fitted by least squares.
fn trend(points: &[(f64, f64)]) -> [f64; 2] {
    let count = points.len() as f64;
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
    let products = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y));
    let squares = points.iter().map(|(x, _)| (x - mean_x).powi(2));
    let slope = products.sum::<f64>() / squares.sum::<f64>();
    [slope * (points[points.len() - 1].0 - points[0].0), mean_y]
}

/// What changes from the first of these samples to the last, for each second of the clock and of the processor.
fn steps_env_per_s(part: &[Sample]) -> [f64; 2] {
    let (first, last) = (part[0], part[part.len() - 1]);
    let steps_env = last.steps_env - first.steps_env;
    [
        steps_env / (last.wall_s - first.wall_s),
        steps_env / (last.processor_s - first.processor_s),
    ]
}

/// What the samples say.
fn verdict(samples: &[Sample]) -> serde_json::Value {
    let judged = &samples[samples.len() / 4..];
    let (early, late) = judged.split_at(judged.len() / 2);
    let resident: Vec<_> = judged.iter().map(|s| (s.wall_s, s.resident_kib)).collect();
    let [memory_growth_kib, resident_kib_mean] = trend(&resident);
    let [early_rate, late_rate] = [early, late].map(steps_env_per_s);
    let cost_growth = early_rate[1] / late_rate[1] - 1.0;
    let [early_handles, late_handles] =
        [early, late].map(|part| part.iter().map(|s| s.handles).max().unwrap_or(0));
    let last = judged[judged.len() - 1];
    let judges_cost = last.wall_s >= COST_JUDGED_FROM_S;
    json!({
        "training": TRAINING.join(" "),
        "version": env!("CARGO_PKG_VERSION"),
        "samples": samples.len(),
        "watched_s": last.wall_s,
        "judged_s": last.wall_s - judged[0].wall_s,
        "steps_env": last.steps_env,
        "steps_env_per_s": [early_rate[0], late_rate[0]],
        "steps_env_per_processor_s": [early_rate[1], late_rate[1]],
        "cost_growth": cost_growth,
        "cost_growth_max": judges_cost.then_some(COST_GROWTH_MAX),
        "resident_kib_mean": resident_kib_mean,
        "memory_growth_kib": memory_growth_kib,
        "memory_growth_max_kib": MEMORY_GROWTH_MAX_KIB,
        "file_handles": [early_handles, late_handles],
        "file_handles_growth_max": HANDLES_GROWTH_MAX,
        "flat": memory_growth_kib <= MEMORY_GROWTH_MAX_KIB
            && (!judges_cost || cost_growth <= COST_GROWTH_MAX)
            && late_handles <= early_handles + HANDLES_GROWTH_MAX,
    })
}

/// Keeps samples and verdict in `folder`, a path from the root of the repository.
fn keep(folder: &str, samples: &[Sample], verdict: &serde_json::Value) {
    let mut table = "wall_s,processor_s,steps_env,resident_kib,file_handles\n".to_owned();
    for sample in samples {
        let Sample {
            wall_s,
            processor_s,
            steps_env,
            resident_kib,
            handles,
        } = sample;
        writeln!(
            table,
            "{wall_s:.2},{processor_s:.2},{steps_env},{resident_kib},{handles}"
        )
        .expect("a string can be written");
    }
    let json = serde_json::to_string_pretty(verdict).expect("a verdict is JSON") + "\n";
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    fs::create_dir_all(&folder).expect("the folder can be made");
    fs::write(folder.join("samples.csv"), table).expect("the folder can be written");
    fs::write(folder.join("verdict.json"), json).expect("the folder can be written");
}

#[test]
fn a_long_run_is_flat() {
    let seconds = std::env::var("MACKRL_SOAK_SECONDS").map_or(SECONDS, |text| {
        text.parse().expect("MACKRL_SOAK_SECONDS is a number")
    });
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    // Nobody reads the other end while it runs, and a line every 30 s would fill a pipe in the end.
    let log = File::create(parent.path().join("log")).expect("a log can be made");
    let mut command = mackrl(TRAINING);
    command.arg("--out").arg(&run).stderr(log);
    let mut child = command.spawn().expect("the program starts");
    let metrics = run.join("metrics.jsonl");
    assert!(wait_until(&mut child, || latest_steps_env(&metrics).is_some()));
    let start = Instant::now();
    let mut samples = Vec::new();
    for number in 1..=SAMPLES {
        let due = Duration::from_secs_f64(seconds * f64::from(number) / f64::from(SAMPLES));
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        samples.push(Sample::of(&child, &run, start).expect("the run goes on"));
    }
    let stopped = Command::new("kill")
        .args(["-s", "TERM", &child.id().to_string()])
        .status();
    assert!(stopped.expect("`kill` can be run").success());
    let output = child.wait_with_output().expect("a child ends");
    assert_eq!(output.status.code(), Some(75), "an orderly stop");
    let verdict = verdict(&samples);
    println!("{verdict:#}");
    if let Ok(folder) = std::env::var("MACKRL_SOAK_OUT") {
        keep(&folder, &samples, &verdict);
    }
    assert_eq!(verdict["flat"], true, "{verdict:#}");
}
