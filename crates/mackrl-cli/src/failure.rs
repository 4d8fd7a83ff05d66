//! From errors to exit codes and words: the one place that knows both.

use std::{
    fmt,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use mackrl::{NotFinite, nn::UnknownInstructionSet};
use mackrl_env::StepError;
use mackrl_run::config::ConfigError;

use crate::provenance::CODE;

/// What can go wrong in this program beyond what its libraries say.
#[derive(Debug)]
pub(crate) enum Failure {
    /// A folder in which nothing may be overwritten.
    FolderInUse {
        folder: PathBuf,
        /// What lies there, for "holds ...".
        holds: String,
    },
    /// A folder in which a run can go on.
    UnfinishedRun { folder: PathBuf },
    /// A folder in which another process writes.
    FolderLocked { folder: PathBuf },
    /// A run that was asked to stop, and can go on.
    Interrupted { folder: PathBuf, steps_env: u64 },
    /// A folder in which no run lies.
    NotARun { folder: PathBuf },
    /// Stored data that cannot be used.
    BadData { message: String },
    /// An update with a number that is not finite, of which nothing was kept.
    UpdateRefused {
        number: Box<NotFinite>,
        folder: PathBuf,
    },
    /// Two things that were compared are not the same.
    Different {
        /// The first difference, in words.
        first: String,
    },
    /// A result of another version of this program, among which results of this one were to stand.
    OtherCode { path: PathBuf, code: String },
    /// StarCraft II is not as it has to be.
    #[cfg_attr(
        not(all(feature = "sc2", target_os = "linux")),
        expect(dead_code, reason = "only the commands around the game make it")
    )]
    NotReady {
        /// How much is wrong.
        problems: usize,
    },
    /// A team that does not run decentralised.
    CertificateFailed { mismatches: u64 },
    /// Flags that do not go together.
    Usage { message: String },
    /// A folder that holds another run than the one that should be made there.
    OtherConfiguration {
        folder: PathBuf,
        /// A setting in which they differ.
        key: String,
    },
    /// Many runs that were asked to stop, and can go on.
    SweepInterrupted { finished: usize, runs: usize },
    /// A metric that a run does not have.
    MissingMetric { message: String },
    /// Runs that are not repetitions of one experiment.
    UnlikeRuns {
        message: String,
        /// What can be done.
        remedy: String,
    },
    /// A recorded episode that does not play as it did.
    ReplayDiffers { message: String },
    /// A replay that another version of this program plays.
    OtherSimulator {
        message: String,
        /// Version of the program that plays it.
        program: String,
    },
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FolderInUse { folder, holds } => write!(
                formatter,
                "{} already holds {holds}, and is not overwritten",
                folder.display()
            ),
            Self::UnfinishedRun { folder } => write!(
                formatter,
                "{} already holds an unfinished run, and is not overwritten",
                folder.display()
            ),
            Self::FolderLocked { folder } => write!(
                formatter,
                "another process is writing in {}",
                folder.display()
            ),
            Self::Interrupted { folder, steps_env } => write!(
                formatter,
                "{} was interrupted at {steps_env} environment steps",
                folder.display()
            ),
            Self::NotARun { folder } => write!(
                formatter,
                "{} is not a run folder: it has no config.toml",
                folder.display()
            ),
            Self::OtherCode { path, code } => write!(
                formatter,
                "{} was made by code {code}, expected {CODE}",
                path.display()
            ),
            Self::OtherConfiguration { folder, key } => write!(
                formatter,
                "{} holds a run with another configuration: `{key}` is different",
                folder.display()
            ),
            Self::SweepInterrupted { finished, runs } => {
                write!(
                    formatter,
                    "interrupted when {finished} of {runs} runs were finished"
                )
            }
            Self::UpdateRefused { number, .. } => {
                write!(formatter, "the run cannot go on: {number}")
            }
            Self::Different { first } => write!(formatter, "they differ, first in {first}"),
            Self::BadData { message }
            | Self::Usage { message }
            | Self::MissingMetric { message }
            | Self::UnlikeRuns { message, .. }
            | Self::ReplayDiffers { message }
            | Self::OtherSimulator { message, .. } => formatter.write_str(message),
            Self::NotReady { problems } => {
                write!(
                    formatter,
                    "StarCraft II cannot be played on here: problems: {problems}"
                )
            }
            Self::CertificateFailed { mismatches } => write!(
                formatter,
                "not decentralised: {mismatches} actions differ from the central run"
            ),
        }
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// Flags that do not go together, in words.
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self::Usage {
            message: message.to_string(),
        }
    }

    /// Whether a run lacks a metric that it was asked for.
    pub(crate) fn is_missing_metric(error: &anyhow::Error) -> bool {
        matches!(error.downcast_ref(), Some(Self::MissingMetric { .. }))
    }

    /// Whether a run ended because it was asked to.
    pub(crate) fn is_interruption(error: &anyhow::Error) -> bool {
        matches!(error.downcast_ref(), Some(Self::Interrupted { .. }))
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
    let mut text = format!("error: {}\n", printable(&format!("{error:#}")));
    if let Some(hint) = hint(error) {
        text.push_str(&format!("hint: {hint}\n"));
    }
    text
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

fn exit(error: &anyhow::Error) -> Exit {
    error.chain().find_map(exit_of).unwrap_or(Exit::Defect)
}

fn exit_of(cause: &(dyn std::error::Error + 'static)) -> Option<Exit> {
    if let Some(failure) = cause.downcast_ref::<Failure>() {
        return Some(match failure {
            Failure::FolderInUse { .. }
            | Failure::UnfinishedRun { .. }
            | Failure::FolderLocked { .. }
            | Failure::NotARun { .. }
            | Failure::OtherCode { .. }
            | Failure::OtherConfiguration { .. }
            | Failure::MissingMetric { .. }
            | Failure::UnlikeRuns { .. }
            | Failure::Usage { .. } => Exit::Usage,
            Failure::Interrupted { .. } | Failure::SweepInterrupted { .. } => Exit::Interrupted,
            Failure::BadData { .. }
            | Failure::UpdateRefused { .. }
            | Failure::ReplayDiffers { .. }
            | Failure::OtherSimulator { .. } => Exit::Data,
            Failure::NotReady { .. } => Exit::InputOutput,
            Failure::CertificateFailed { .. } | Failure::Different { .. } => Exit::Differs,
        });
    }
    if let Some(error) = cause.downcast_ref::<mackrl::Error>() {
        return Some(match error {
            mackrl::Error::Config(_) => Exit::Configuration,
            mackrl::Error::Step(StepError::Interrupted(_)) => Exit::InputOutput,
            mackrl::Error::Data(_) | mackrl::Error::NotFinite { .. } => Exit::Data,
            _ => Exit::Defect,
        });
    }
    if cause.is::<ConfigError>() || cause.is::<UnknownInstructionSet>() {
        return Some(Exit::Configuration);
    }
    cause.is::<io::Error>().then_some(Exit::InputOutput)
}

fn hint(error: &anyhow::Error) -> Option<String> {
    error.chain().find_map(hint_of)
}

fn hint_of(cause: &(dyn std::error::Error + 'static)) -> Option<String> {
    if let Some(failure) = cause.downcast_ref::<Failure>() {
        return match failure {
            Failure::FolderInUse { .. } => {
                Some("choose another folder with --out, or move this one away".to_owned())
            }
            Failure::UnfinishedRun { folder } => Some(format!(
                "go on with `mackrl resume {}`, or choose another folder with --out",
                folder.display()
            )),
            Failure::Interrupted { folder, .. } => {
                Some(format!("go on with `mackrl resume {}`", folder.display()))
            }
            Failure::NotARun { .. } => Some(
                "give the folder that `mackrl train` wrote, such as runs/3m-mackrl-seed1"
                    .to_owned(),
            ),
            Failure::OtherConfiguration { .. } => Some(
                "choose another folder with --out, or move this run away".to_owned(),
            ),
            Failure::SweepInterrupted { .. } => Some("go on with the same command".to_owned()),
            Failure::UnlikeRuns { remedy, .. } => Some(remedy.clone()),
            Failure::UpdateRefused { folder, .. } => Some(format!(
                "`mackrl resume {}` goes on from the last checkpoint and repeats the update to the bit; smaller learning rates, gradients or rewards avoid it",
                folder.display()
            )),
            Failure::OtherCode { .. } => Some(
                "take such results as they are with --any-code, or choose another folder with --out"
                    .to_owned(),
            ),
            Failure::ReplayDiffers { .. } => Some(
                "the file was changed, or its program simulated otherwise: record it again"
                    .to_owned(),
            ),
            Failure::OtherSimulator { program, .. } => {
                Some(format!("mackrl {program}, which recorded it, plays it"))
            }
            _ => None,
        };
    }
    if let Some(mackrl::Error::Step(StepError::Interrupted(_))) = cause.downcast_ref() {
        return Some("`mackrl sc2 doctor --start` looks for the cause".to_owned());
    }
    if let Some(error) = cause.downcast_ref::<io::Error>() {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        return matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge).then(|| {
            "make room; a run that was being trained goes on with `mackrl resume DIR`".to_owned()
        });
    }
    match cause.downcast_ref::<ConfigError>()? {
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
            .is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use anyhow::Context;
    use mackrl_run::config::Config;

    use super::*;

    #[test]
    fn every_kind_of_error_has_its_exit_code() {
        let config = Config::with(&["a=1"]).unwrap_err();
        let missing = io::Error::from(io::ErrorKind::NotFound);
        let folder = PathBuf::from("x");
        let cases: [(anyhow::Error, Exit); 8] = [
            (config.clone().into(), Exit::Configuration),
            (mackrl::Error::from(config).into(), Exit::Configuration),
            (mackrl::Error::Data(String::new()).into(), Exit::Data),
            (missing.into(), Exit::InputOutput),
            (
                Failure::Interrupted {
                    folder: folder.clone(),
                    steps_env: 1,
                }
                .into(),
                Exit::Interrupted,
            ),
            (Failure::NotARun { folder }.into(), Exit::Usage),
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
