//! From errors to exit codes and words: the one place that has both.

use std::{
    error::Error as StdError,
    fmt,
    io::{self, ErrorKind, Write},
    process::ExitCode,
};

use mackrl::nn::UnknownInstructionSet;
use mackrl_env::StepError;
use mackrl_run::{RunError, config::ConfigError, provenance::Versions};
use thiserror::Error;

/// What can go wrong in this program beyond what its libraries say.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// Flags that do not go together.
    #[error("{message}")]
    Usage { message: String },
    /// A result that could not be printed; it is lost, and nothing else.
    #[error("cannot write to stdout")]
    Stdout(#[source] io::Error),
    /// Data that cannot be used.
    #[error("{message}")]
    BadData { message: String },
    /// Runs of a sweep that the operating system kept from going on.
    #[error("{message}")]
    RunsWithoutSystem { message: String },
    /// Runs of a sweep that were stopped from outside.
    #[error("{message}")]
    RunsStopped { message: String },
    /// Work that was stopped from outside, of which nothing is kept.
    #[error("{what} was stopped, and nothing of it is kept")]
    Stopped {
        /// What was done.
        what: String,
    },
    /// A run that another process is making at the moment.
    #[error("{message}")]
    MadeElsewhere { message: String },
    /// Two things that were compared are not the same.
    #[error("they differ, first in {first}")]
    Different {
        /// The first difference, in words.
        first: String,
    },
    /// Results that were to stand together, and were computed by different versions.
    #[error(
        "some runs were computed by {one} and others by {other}, or are still to be made by it"
    )]
    OtherVersions { one: Versions, other: Versions },
    /// StarCraft II is not as it has to be.
    #[cfg_attr(
        not(all(feature = "sc2", target_os = "linux")),
        expect(dead_code, reason = "only the commands around the game make it")
    )]
    #[error("StarCraft II cannot be played on here: problems: {problems}")]
    NotReady {
        /// How much is wrong.
        problems: usize,
    },
    /// A team that does not run decentralised.
    #[error("not decentralised: {mismatches} comparisons with the central run failed")]
    CertificateFailed { mismatches: u64 },
    /// An agent that was ended because it tried to reach something beyond what it is told.
    #[error(
        "not decentralised: agent {agent} tried to reach a file, the network or another process, and was ended by the system"
    )]
    ReachedOut {
        /// Its number.
        agent: usize,
    },
    /// Quantities in which the simulator is not the game.
    #[error("the simulator differs from the real game in {failed} of {rows} quantities")]
    Unfaithful {
        failed: usize,
        /// How many were compared.
        rows: usize,
    },
    /// A recorded episode that does not play as it did.
    #[error("{message}")]
    ReplayDiffers { message: String },
    /// A replay that another version of this program plays.
    #[error("{message}")]
    OtherSimulator {
        message: String,
        /// Version of the program that plays it.
        program: String,
    },
}

impl Failure {
    /// Flags that do not go together, in words.
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self::Usage {
            message: message.to_string(),
        }
    }
}

/// Why the program ends, by the number that the shell sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    Differs = 1,
    Usage = 2,
    Configuration = 64,
    Data = 65,
    Defect = 70,
    InputOutput = 74,
    Interrupted = 75,
}

/// What a cause means for the program: its exit code, and what helps, as far as either is known.
type Verdict = (Option<Exit>, Option<String>);

/// Tells what went wrong, if something did, and gives the exit code.
pub(crate) fn report(outcome: anyhow::Result<()>) -> ExitCode {
    let Err(error) = outcome else {
        return ExitCode::SUCCESS;
    };
    if reader_has_gone(&error) {
        return ExitCode::SUCCESS;
    }
    // Nothing is left to do if stderr cannot be written either.
    let _ = io::stderr().write_all(explain(&error).as_bytes());
    ExitCode::from(exit(&error) as u8)
}

/// The chain of causes on one line, and the remedy on another if one is known.
fn explain(error: &anyhow::Error) -> String {
    let kind = if is_stop(error) { "note" } else { "error" };
    let mut text = format!("{kind}: {}\n", printable(&format!("{error:#}")));
    let is_of_stdout =
        |cause: &(dyn StdError + 'static)| matches!(cause.downcast_ref(), Some(Failure::Stdout(_)));
    let mut causes = error.chain().take_while(|cause| !is_of_stdout(*cause));
    if let Some(hint) = causes.find_map(|cause| verdict(cause).1) {
        text.push_str(&format!("hint: {}\n", printable(&hint)));
    }
    text
}

/// Whether somebody asked the program to stop, which is no error.
fn is_stop(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let run = cause.downcast_ref().map(RunError::root);
        let is_of_run = matches!(
            run,
            Some(RunError::Interrupted { .. } | RunError::SweepInterrupted { .. })
        );
        is_of_run
            || matches!(
                cause.downcast_ref(),
                Some(Failure::RunsStopped { .. } | Failure::Stopped { .. })
            )
    })
}

/// Tells that the program was asked to stop, and ends it.
pub(crate) fn end_stopped(what: &str) -> ! {
    let error = anyhow::Error::from(Failure::Stopped {
        what: what.to_owned(),
    });
    // Several threads may notice; the first keeps the others waiting until the program has ended.
    let mut stderr = io::stderr().lock();
    // Nothing is left to do if stderr cannot be written either.
    let _ = stderr.write_all(explain(&error).as_bytes());
    std::process::exit(exit(&error) as i32)
}

fn exit(error: &anyhow::Error) -> Exit {
    let known = error.chain().find_map(|cause| verdict(cause).0);
    known.unwrap_or(Exit::Defect)
}

/// What may be shown of a text that quotes a stranger's file: one line, not endless, and nothing that controls a terminal.
pub(crate) fn printable(text: &str) -> String {
    const LENGTH_MAX: usize = 1000;
    let mut characters = text.chars();
    let shown = characters.by_ref().take(LENGTH_MAX);
    let mut shown: String = shown
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    if characters.next().is_some() {
        shown.push('…');
    }
    shown
}

/// What one cause in a chain means.
fn verdict(cause: &(dyn StdError + 'static)) -> Verdict {
    if let Some(failure) = cause.downcast_ref() {
        of_failure(failure)
    } else if let Some(error) = cause.downcast_ref() {
        of_run(error)
    } else if let Some(error) = cause.downcast_ref() {
        of_library(error)
    } else if let Some(error) = cause.downcast_ref() {
        (Some(Exit::Configuration), hint_of_config(error))
    } else if cause.is::<UnknownInstructionSet>() {
        (Some(Exit::Configuration), None)
    } else if let Some(error) = cause.downcast_ref::<io::Error>() {
        use ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let is_full = matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge);
        let hint = "make room, and give the command again; a run that has begun goes on with `mackrl resume DIR`";
        (Some(Exit::InputOutput), is_full.then(|| hint.to_owned()))
    } else {
        (None, None)
    }
}

fn of_failure(failure: &Failure) -> Verdict {
    let (exit, hint) = match failure {
        Failure::Usage { .. } => (Exit::Usage, None),
        Failure::BadData { .. } => (Exit::Data, None),
        Failure::Stdout(_) => (Exit::InputOutput, None),
        Failure::RunsWithoutSystem { .. } => (
            Exit::InputOutput,
            Some("go on with the same command when that is repaired".to_owned()),
        ),
        Failure::RunsStopped { .. } | Failure::Stopped { .. } => (
            Exit::Interrupted,
            Some("go on with the same command".to_owned()),
        ),
        Failure::MadeElsewhere { .. } => (Exit::Interrupted, None),
        Failure::Different { .. }
        | Failure::CertificateFailed { .. }
        | Failure::ReachedOut { .. }
        | Failure::Unfaithful { .. } => (Exit::Differs, None),
        Failure::OtherVersions { .. } => (
            Exit::Usage,
            Some(
                "take them together as they are with --mix, or choose another folder with --out"
                    .to_owned(),
            ),
        ),
        Failure::NotReady { .. } => (Exit::InputOutput, None),
        Failure::ReplayDiffers { .. } => (
            Exit::Data,
            Some(
                "the file was changed, or its program simulated otherwise: record it again"
                    .to_owned(),
            ),
        ),
        Failure::OtherSimulator { program, .. } => (
            Exit::Data,
            Some(format!("mackrl {program}, which recorded it, plays it")),
        ),
    };
    (Some(exit), hint)
}

fn of_run(error: &RunError) -> Verdict {
    let resume = |folder: &std::path::Path| format!("`mackrl resume {}`", folder.display());
    let (exit, hint) = match error {
        RunError::Config(error) => return verdict(&**error),
        RunError::Learning(error) => return of_library(error),
        RunError::Within { source, .. } => return of_run(source),
        RunError::FolderInUse { .. } => (
            Exit::Usage,
            Some("choose another folder with --out, or move this one away".to_owned()),
        ),
        RunError::UnfinishedRun { folder } => (
            Exit::Usage,
            Some(format!(
                "go on with {}, or choose another folder with --out",
                resume(folder)
            )),
        ),
        RunError::FolderLocked { .. }
        | RunError::MissingMetric { .. }
        | RunError::Selection { .. } => (Exit::Usage, None),
        RunError::NotARun { .. } => (
            Exit::Usage,
            Some(
                "give the folder that `mackrl train` wrote, such as runs/3m-mackrl-ppo-seed1"
                    .to_owned(),
            ),
        ),
        RunError::NoSuchWeights { .. } => (
            Exit::Usage,
            Some(
                "run.weights_interval_steps_env=N keeps weights every N steps; a run's first test chooses its best"
                    .to_owned(),
            ),
        ),
        RunError::NotFurther { .. } => (Exit::Usage, None),
        RunError::NoWayFurther { folder } => (
            Exit::Usage,
            Some(format!(
                "`mackrl train --from {} --steps N --out DIR` begins another run with its weights",
                folder.display()
            )),
        ),
        RunError::OtherConfiguration { .. } => (
            Exit::Usage,
            Some("choose another folder with --out, or move this run away".to_owned()),
        ),
        RunError::NoneFinished { .. } => (
            Exit::Usage,
            Some("--unfinished uses them as far as they have come".to_owned()),
        ),
        RunError::UnlikeRuns { key: Some(key), .. } => (
            Exit::Usage,
            Some(format!(
                "tell them apart with --by {key}, or use them together all the same with --mix"
            )),
        ),
        RunError::UnlikeRuns { key: None, .. } => (
            Exit::Usage,
            Some("use them together all the same with --mix".to_owned()),
        ),
        RunError::Interrupted { folder, .. } => (
            Exit::Interrupted,
            Some(format!("go on with {}", resume(folder))),
        ),
        RunError::SweepInterrupted { .. } => (
            Exit::Interrupted,
            Some("go on with the same command".to_owned()),
        ),
        RunError::UpdateRefused { folder, .. } => (
            Exit::Data,
            Some(format!(
                "{} goes on from the last checkpoint and repeats the update to the bit; smaller learning rates, gradients or rewards avoid it",
                resume(folder)
            )),
        ),
        RunError::BadData { .. } => (Exit::Data, None),
        RunError::FolderReplaced { .. } => (
            Exit::InputOutput,
            Some(
                "nothing was written into what lies there now; where the run's own folder still exists, `mackrl resume` goes on with it".to_owned(),
            ),
        ),
        // What caused these says more.
        _ => return (None, None),
    };
    (Some(exit), hint)
}

fn of_library(error: &mackrl::Error) -> Verdict {
    match error {
        mackrl::Error::Config(_) => (Some(Exit::Configuration), None),
        mackrl::Error::Step(StepError::Interrupted(_)) => (
            Some(Exit::InputOutput),
            Some("`mackrl sc2 doctor --start` looks for the cause".to_owned()),
        ),
        mackrl::Error::Data(_) | mackrl::Error::NotFinite { .. } => (Some(Exit::Data), None),
        _ => (Some(Exit::Defect), None),
    }
}

fn hint_of_config(error: &ConfigError) -> Option<String> {
    match error {
        ConfigError::UnknownMap { .. } => Some(
            "`mackrl maps` lists every map; the name of a scenario file ends in .toml".to_owned(),
        ),
        ConfigError::Scenario { .. } => Some(
            "examples/scenarios/sniper-alley.toml explains every line of a scenario".to_owned(),
        ),
        ConfigError::UnknownKey { .. }
        | ConfigError::RenamedKey { .. }
        | ConfigError::ForeignKey { .. } => Some(
            "`mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one".to_owned(),
        ),
        ConfigError::WrongValue { key, .. } => {
            let settings = crate::registry().settings();
            let setting = settings.iter().find(|setting| setting.key == *key)?;
            Some(format!("{key}: {}", setting.meaning))
        }
        ConfigError::Syntax { .. } => {
            Some("settings are written as TOML, such as algorithm.gamma = 0.95".to_owned())
        }
        _ => None,
    }
}

/// Whether stdout was closed by a reader that has read enough, such as `head`.
fn reader_has_gone(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use anyhow::Context;
    use mackrl_run::config::Config;

    use super::*;

    #[test]
    fn every_kind_of_error_has_its_exit_code() {
        let config = Config::with(&["a=1"]).unwrap_err();
        let missing = io::Error::from(ErrorKind::NotFound);
        let folder = PathBuf::from("x");
        let damaged = RunError::Within {
            what: "cannot use x".to_owned(),
            source: Box::new(RunError::BadData {
                message: "x is damaged".to_owned(),
            }),
        };
        let cases: [(anyhow::Error, Exit); 9] = [
            (damaged.into(), Exit::Data),
            (config.clone().into(), Exit::Configuration),
            (mackrl::Error::from(config).into(), Exit::Configuration),
            (mackrl::Error::Data(String::new()).into(), Exit::Data),
            (missing.into(), Exit::InputOutput),
            (
                RunError::Interrupted {
                    folder: folder.clone(),
                    steps_env: 1,
                }
                .into(),
                Exit::Interrupted,
            ),
            (RunError::NotARun { folder }.into(), Exit::Usage),
            (
                Failure::CertificateFailed { mismatches: 1 }.into(),
                Exit::Differs,
            ),
            (anyhow::anyhow!("?"), Exit::Defect),
        ];
        for (error, expected) in cases {
            assert_eq!(exit(&error.context("while testing")), expected);
        }
    }

    #[test]
    fn what_is_quoted_controls_no_terminal_and_has_an_end() {
        assert_eq!(printable("a\u{1b}[2J\nb"), "a [2J b");
        assert_eq!(printable(&"é".repeat(5000)).chars().count(), 1001);
    }

    #[test]
    fn the_chain_of_causes_is_told_once_with_the_remedy() {
        let error = Err::<(), _>(Config::with(&["gama=1"]).unwrap_err())
            .context("cannot configure")
            .unwrap_err();
        assert_eq!(
            explain(&error),
            "error: cannot configure: --set gama=1: unknown key `gama`, did you mean `algorithm.gamma`?\n\
             hint: `mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one\n"
        );
    }
}
