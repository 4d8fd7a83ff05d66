//! A batch script for Slurm that makes a plan.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    io::{self, Write as _},
    num::NonZeroUsize,
    path::Path,
    time::Duration,
};

use anyhow::Context;
use mackrl_run::{
    stop_request::StopRequest,
    sweep::{Entry, Plan, State, standings},
};

use super::{
    Numbered,
    calibration::{Needs, measure},
};
use crate::{
    args::SweepArgs,
    commands::this_program,
    failure::{Failure, printable},
    output,
};

/// How long is measured, for all kinds of runs together.
const CALIBRATION: Duration = Duration::from_secs(20);
/// How long an array task should last at least: starting one takes seconds, and a scheduler has others to look after.
const TASK: Duration = Duration::from_secs(600);
/// Most array tasks: the greatest index that Slurm allows unless it was set up otherwise, and one.
const TASKS_MAX: usize = 1001;
/// Nodes differ, and runs side by side share caches: the time limit is so many times what was measured, and so many seconds.
const TIME_MARGIN: (f64, f64) = (1.5, 300.0);
/// Longest time limit that is proposed, in seconds; a task that needs longer is requeued.
const TIME_MAX_S: f64 = 24.0 * 3600.0;
/// How long before the time limit the runs are told, in seconds, if the limit is not short.
const NOTICE_S: u64 = 120;
/// Memory for an array task beside that of its runs, in bytes.
const MEMORY_MARGIN: u64 = 256 << 20;

/// Map, algorithm and length: what decides how long a run takes, more than anything else.
type Kind = (String, String, u64);

/// What the script asks Slurm for.
#[derive(Debug, Clone, PartialEq)]
struct Request {
    /// Numbers of the array tasks.
    tasks: Vec<usize>,
    /// Runs that a task makes.
    block: usize,
    /// Of these at a time.
    jobs: usize,
    time_s: u64,
    /// In bytes.
    memory: Option<u64>,
}

/// Prints the script.
///
/// # Errors
/// If nothing is left to do, or a run cannot begin.
pub(super) fn print(
    plan: &Plan,
    chosen: &[Numbered<'_>],
    args: &SweepArgs,
    stop: &StopRequest,
) -> anyhow::Result<()> {
    let states = standings(chosen.iter().map(|(_, entry)| *entry));
    let mut left = Vec::new();
    for (entry, standing) in chosen.iter().zip(states) {
        if standing?.state != State::Finished {
            left.push(*entry);
        }
    }
    if left.is_empty() {
        return Err(Failure::usage("nothing is left to do").into());
    }
    let needs = calibrate(&left, stop)?;
    let times: Vec<(usize, f64)> = (left.iter())
        .map(|(index, entry)| (*index, needs[&kind(entry)].run_s))
        .collect();
    let memory = needs.values().filter_map(|needs| needs.memory).max();
    let mut request = Request::of(&times, args.jobs(), args.block, memory);
    if let Some(limit) = args.time_limit {
        request.time_s = limit.as_secs();
    }
    let longest_s = times.iter().map(|(_, time_s)| *time_s).fold(0.0, f64::max);
    let program = this_program()?.display().to_string();
    let here = std::env::current_dir().context("cannot find the working folder")?;
    let script = script(
        &request,
        &Surroundings {
            program: &program,
            here: &here,
            plan: &args.plan,
            out: &plan.out,
            scratch: args.scratch.as_deref(),
        },
        (left.len(), longest_s),
    )?;
    output::print(&script)
}

fn kind(entry: &Entry) -> Kind {
    let config = &entry.config;
    (
        config.env.map().to_owned(),
        config.algorithm.name().to_owned(),
        config.run.steps_env,
    )
}

/// Measures a run of each kind, and tells what came of it.
fn calibrate(left: &[Numbered<'_>], stop: &StopRequest) -> anyhow::Result<BTreeMap<Kind, Needs>> {
    let firsts: BTreeMap<Kind, &Entry> = (left.iter().rev())
        .map(|(_, entry)| (kind(entry), *entry))
        .collect();
    let budget = CALIBRATION / u32::try_from(firsts.len()).unwrap_or(u32::MAX);
    let mut needs = BTreeMap::new();
    for (kind, entry) in firsts {
        let measured = measure(&entry.config, budget, stop)
            .with_context(|| format!("cannot measure {}", entry.name))?;
        let Some(measured) = measured else {
            return Err(Failure::RunsStopped {
                message: "stopped while measuring".to_owned(),
            }
            .into());
        };
        let told = format!(
            "{}: {:.0} s on a core of this machine",
            entry.name, measured.run_s
        );
        // The script is the result.
        let _ = writeln!(io::stderr(), "{}", printable(&told));
        needs.insert(kind, measured);
    }
    Ok(needs)
}

impl Request {
    /// For runs with these numbers, which take so many seconds each and so much memory.
    fn of(
        times: &[(usize, f64)],
        jobs: NonZeroUsize,
        block: Option<NonZeroUsize>,
        memory: Option<u64>,
    ) -> Self {
        let jobs = jobs.get();
        let runs = times.last().map_or(1, |(index, _)| index + 1);
        let mean_s = times.iter().map(|(_, time_s)| time_s).sum::<f64>() / times.len() as f64;
        let rounds = TASK.as_millis().div_ceil(whole(mean_s).as_millis().max(1));
        let rounds = usize::try_from(rounds).unwrap_or(runs).clamp(1, runs);
        let usual = (jobs * rounds).max(runs.div_ceil(TASKS_MAX)).min(runs);
        let block = block.map_or(usual, NonZeroUsize::get);
        let jobs = jobs.min(block);
        let mut tasks: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (index, time_s) in times {
            let (sum, longest) = tasks.entry(index / block).or_default();
            *sum += time_s;
            *longest = time_s.max(*longest);
        }
        // So long a task takes at most that begins the next run whenever a core is free.
        let task_s = |(sum, longest): &(f64, f64)| sum / jobs as f64 + longest;
        let longest_s = tasks.values().map(task_s).fold(0.0, f64::max);
        let time_s = whole(TIME_MARGIN.0 * longest_s + TIME_MARGIN.1).as_secs();
        Self {
            tasks: tasks.into_keys().collect(),
            block,
            jobs,
            time_s: time_s.next_multiple_of(60),
            // Half as much again.
            memory: memory.map(|memory| jobs as u64 * memory / 2 * 3 + MEMORY_MARGIN),
        }
    }
}

/// So many seconds, as far as anybody asks for them.
fn whole(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds.clamp(0.0, TIME_MAX_S))
}

/// What a script names.
struct Surroundings<'a> {
    program: &'a str,
    here: &'a Path,
    plan: &'a Path,
    out: &'a Path,
    scratch: Option<&'a Path>,
}

/// The script for so many runs, the longest of which takes so many seconds.
fn script(
    request: &Request,
    names: &Surroundings<'_>,
    (runs, longest_s): (usize, f64),
) -> anyhow::Result<String> {
    let Request {
        tasks,
        block,
        jobs,
        time_s,
        memory,
    } = request;
    let path = |path: &Path| quoted(&path.display().to_string());
    let (plan, out) = (path(names.plan)?, path(names.out)?);
    let stem = names.plan.file_stem().unwrap_or_default();
    let name = quoted(&stem.to_string_lossy())?;
    let runs = match runs {
        1 => "a run".to_owned(),
        runs => format!("{runs} runs"),
    };
    let mut text = format!(
        "#!/bin/sh\n\
         # What is left of the plan: {runs}. An array task makes {block} runs, {jobs} at a time; a run takes {longest_s:.0} s at most on a core\n\
         # of the machine that measured it. A task that needs more than its time is told {notice} s before, and goes on in another turn.\n\
         #SBATCH --job-name={name} --array={array}\n\
         #SBATCH --nodes=1 --ntasks=1 --cpus-per-task={jobs}\n\
         #SBATCH --time={time}\n",
        notice = notice_s(*time_s),
        array = ranges(tasks),
        time = clock(*time_s),
    );
    if let Some(memory) = memory {
        let mebibytes = memory.div_ceil(1 << 20);
        let _ = writeln!(text, "#SBATCH --mem={mebibytes}M");
    }
    let scratch = match names.scratch {
        // The node knows what a variable of it means.
        Some(scratch) => format!(
            " --scratch \"{}\"",
            doubly_quoted(&scratch.display().to_string())?
        ),
        None => String::new(),
    };
    let _ = write!(
        text,
        "#SBATCH --chdir={here}\n\
         #SBATCH --requeue --open-mode=append --signal=USR1@{notice}\n\
         \n\
         srun --ntasks=1 --cpus-per-task={jobs} {program} sweep {plan} --out {out}{scratch} \\\n    \
             --index \"$SLURM_ARRAY_TASK_ID\" --block {block} --jobs {jobs}\n\
         code=$?\n\
         # 75: it was told to stop, has written checkpoints and wants another turn.\n\
         if [ $code -eq 75 ] && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt 99 ]; then\n    \
             scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\" && exit 0\n\
         fi\n\
         exit $code\n",
        here = path(names.here)?,
        notice = notice_s(*time_s),
        program = quoted(names.program)?,
    );
    Ok(text)
}

/// How long before a time limit runs are told.
fn notice_s(time_s: u64) -> u64 {
    NOTICE_S.min(time_s / 4)
}

/// Hours, minutes and seconds, as Slurm has them.
fn clock(seconds: u64) -> String {
    let (minutes, hours) = (seconds / 60 % 60, seconds / 3600);
    format!("{hours:02}:{minutes:02}:{:02}", seconds % 60)
}

/// Numbers in order as Slurm lists them: `0-4,7`.
fn ranges(numbers: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let text = ranges.iter().map(|(first, last)| match last - first {
        0 => first.to_string(),
        _ => format!("{first}-{last}"),
    });
    text.collect::<Vec<_>>().join(",")
}

/// A word of a shell, and of a line for Slurm.
fn quoted(word: &str) -> Result<String, Failure> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./:=@%+,-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return Ok(word.to_owned());
    }
    expect_line(word)?;
    Ok(format!("'{}'", word.replace('\'', "'\\''")))
}

/// What stands between double quotes in a shell, where variables keep their meaning.
fn doubly_quoted(word: &str) -> Result<String, Failure> {
    expect_line(word)?;
    Ok(word
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('`', "\\`"))
}

fn expect_line(word: &str) -> Result<(), Failure> {
    if word.chars().any(char::is_control) {
        return Err(Failure::usage(format!(
            "`{}` cannot stand in a batch script",
            printable(word)
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(runs: usize, run_s: f64, jobs: usize, block: Option<usize>) -> Request {
        let times: Vec<(usize, f64)> = (0..runs).map(|index| (index, run_s)).collect();
        let count = |count| NonZeroUsize::new(count).unwrap();
        Request::of(&times, count(jobs), block.map(count), Some(10 << 20))
    }

    #[test]
    fn a_task_fills_its_cores_for_some_ten_minutes() {
        let short = request(640, 60.0, 8, None);
        assert_eq!((short.block, short.tasks.len()), (80, 8));
        // 10 rounds and one more of 60 s, and the margins.
        assert_eq!(short.time_s, 1320);
        assert_eq!(short.memory, Some((120 << 20) + (256 << 20)));
        let long = request(20, 7200.0, 8, None);
        assert_eq!((long.block, long.tasks.len()), (8, 3));
        let few = request(3, 7200.0, 8, None);
        assert_eq!((few.block, few.jobs), (3, 3));
        let endless = request(3, 1e9, 2, None);
        assert_eq!(endless.time_s, 24 * 3600);
        assert!(request(10_000, 700.0, 1, None).tasks.len() <= TASKS_MAX);
    }

    #[test]
    fn only_blocks_with_something_left_are_asked_for() {
        let times = [(0, 9.0), (7, 9.0), (8, 9.0), (9, 9.0)];
        let one = NonZeroUsize::MIN;
        let block = NonZeroUsize::new(3);
        let request = Request::of(&times, one, block, None);
        assert_eq!(request.tasks, [0, 2, 3]);
        assert_eq!(ranges(&request.tasks), "0,2-3");
        assert_eq!(ranges(&[5]), "5");
    }

    #[test]
    fn names_stay_what_they_are() {
        let request = request(4, 60.0, 2, Some(2));
        let names = |plan, scratch| Surroundings {
            program: "/opt/mackrl",
            here: Path::new("/home/a b"),
            plan: Path::new(plan),
            out: Path::new("runs"),
            scratch,
        };
        let text = |plan, scratch| script(&request, &names(plan, scratch), (4, 60.0));
        let made = text("it's.toml", Some(Path::new("$TMPDIR/x\"y"))).unwrap();
        for line in [
            "#SBATCH --job-name='it'\\''s' --array=0-1",
            "#SBATCH --nodes=1 --ntasks=1 --cpus-per-task=2",
            "#SBATCH --time=00:08:00",
            "#SBATCH --mem=286M",
            "#SBATCH --chdir='/home/a b'",
            "#SBATCH --requeue --open-mode=append --signal=USR1@120",
            "srun --ntasks=1 --cpus-per-task=2 /opt/mackrl sweep 'it'\\''s.toml' --out runs --scratch \"$TMPDIR/x\\\"y\" \\",
            "    --index \"$SLURM_ARRAY_TASK_ID\" --block 2 --jobs 2",
            "if [ $code -eq 75 ] && [ \"${SLURM_RESTART_COUNT:-0}\" -lt 99 ]; then",
            "    scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\" && exit 0",
        ] {
            assert!(made.lines().any(|found| found == line), "{line}\n{made}");
        }
        let refusal = text("a\nb.toml", None).unwrap_err().to_string();
        assert!(
            refusal.contains("cannot stand in a batch script"),
            "{refusal}"
        );
        assert_eq!(notice_s(60), 15);
    }
}
