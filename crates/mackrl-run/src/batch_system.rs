//! The batch system that this process runs under: Slurm, or none. It is asked one thing: whether another job still runs.

use std::{
    fmt,
    process::{Command, Stdio},
};

use serde::{Deserialize, Serialize};

/// A job, or a task of a job array, and how often it was begun again before.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Job {
    /// Its number as Slurm prints it, such as `1234` or `1234_5`.
    pub id: String,
    /// How often Slurm has begun it again. A job that was requeued keeps its number, and none of its processes.
    pub restarts: u32,
}

impl Job {
    /// The job that this process belongs to, if it belongs to one.
    pub fn own() -> Option<Self> {
        let variable = |name: &str| std::env::var(name).ok().filter(|text| !text.is_empty());
        let task = || {
            let array = variable("SLURM_ARRAY_JOB_ID")?;
            Some(format!("{array}_{}", variable("SLURM_ARRAY_TASK_ID")?))
        };
        let id = task().or_else(|| variable("SLURM_JOB_ID"))?;
        let restarts = variable("SLURM_RESTART_COUNT").and_then(|count| count.parse().ok());
        let restarts = restarts.unwrap_or(0);
        let job = Self { id, restarts };
        job.is_plain().then_some(job)
    }

    /// Whether the number is one: it stands in files that others may have written, and goes into a command.
    fn is_plain(&self) -> bool {
        self.id.starts_with(|first: char| first.is_ascii_digit())
            && self.id.len() <= 40
            && (self.id.bytes()).all(|byte| byte.is_ascii_digit() || byte == b'_')
    }
}

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.id)
    }
}

/// What the batch system says of a job, as it was at some time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It runs, or there is no answer.
    Runs,
    /// It was begun again since, or waits for that.
    BegunAgain,
    /// It is not known (any more).
    Unknown,
}

/// What has become of these jobs. Slurm is asked once, for all.
pub(crate) fn fates(jobs: &[Job]) -> Vec<Fate> {
    let plain: Vec<&str> = (jobs.iter().filter(|job| job.is_plain()))
        .map(|job| job.id.as_str())
        .collect();
    if plain.is_empty() {
        return vec![Fate::Runs; jobs.len()];
    }
    let answer = Command::new("squeue")
        .args(["--noheader", "--array", "--jobs", &plain.join(",")])
        .args(["--Format", "JobArrayID:50,State:20,RestartCnt:12"])
        .stdin(Stdio::null())
        .output();
    let answer = answer.ok().and_then(|output| {
        // Of a single job that it does not know, Slurm says so and fails.
        let unknown = String::from_utf8_lossy(&output.stderr).contains("Invalid job id");
        let known = output.status.success() || unknown;
        known.then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    });
    let fate = |job: &Job| match &answer {
        Some(answer) if job.is_plain() => fate(job, answer),
        _ => Fate::Runs,
    };
    jobs.iter().map(fate).collect()
}

/// What Slurm's list of jobs says of this one.
fn fate(job: &Job, answer: &str) -> Fate {
    let line = answer.lines().find_map(|line| {
        let mut words = line.split_whitespace();
        (words.next()? == job.id).then(|| (words.next(), words.next()))
    });
    match line {
        None => Fate::Unknown,
        Some((Some("PENDING"), _)) => Fate::BegunAgain,
        Some((_, restarts)) => match restarts.and_then(|count| count.parse::<u32>().ok()) {
            Some(count) if count > job.restarts => Fate::BegunAgain,
            _ => Fate::Runs,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(id: &str, restarts: u32) -> Job {
        let id = id.to_owned();
        Job { id, restarts }
    }

    #[test]
    fn a_job_that_waits_or_was_begun_more_often_has_lost_its_processes() {
        let answer = "12_3      RUNNING   1  \n12_4   PENDING   1\n13   COMPLETING   0\n";
        for (other, expected) in [
            (job("12_3", 1), Fate::Runs),
            (job("12_3", 0), Fate::BegunAgain),
            (job("12_4", 0), Fate::BegunAgain),
            (job("13", 0), Fate::Runs),
            (job("12", 0), Fate::Unknown),
        ] {
            assert_eq!(fate(&other, answer), expected, "{other:?}");
        }
    }

    #[test]
    fn what_is_no_number_of_a_job_is_never_asked_about() {
        for id in ["", "--help", "1;reboot", "x1", &"1".repeat(50)] {
            assert_eq!(fates(&[job(id, 0)]), [Fate::Runs], "{id}");
        }
    }
}
