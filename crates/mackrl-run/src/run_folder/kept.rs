//! Weights that stay in the folder of a run beside the last ones: those that did best in a test, and those of every so many steps.
//!
//! ```text
//! weights/best.safetensors            the best so far
//! weights/000000050000.safetensors    those that had just seen 50 000 environment steps
//! ```
//!
//! Each file is replaced atomically. A checkpoint holds the best weights itself and knows the others by length and hash, so a
//! run that goes on from it has what it had then: later files are removed, and will be written again.

use std::{
    collections::BTreeMap,
    fmt::{self, Display},
    path::{Path, PathBuf},
    str::FromStr,
};

use serde::{Deserialize, Serialize};

use super::{
    KEPT, WEIGHTS,
    disk::{self, Disk},
    manifest::Fingerprint,
};
use crate::{
    error::{Context, Result, RunError},
    folder::Folder,
    number,
};

/// Digits of a number of steps in the name of a file: names sort as numbers do.
const DIGITS: usize = 12;
const BEST: &str = "best";
const LAST: &str = "last";
const ENDING: &str = ".safetensors";

/// Which weights of a run are meant.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum WhichWeights {
    /// Those at its end, or those of its latest checkpoint.
    #[default]
    Last,
    /// Those that did best in a test.
    Best,
    /// Those that were kept when so many environment steps had been played; see `run.weights_interval_steps_env`.
    Step(u64),
}

/// "last", "best", or a number of steps.
impl Display for WhichWeights {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Last => formatter.write_str(LAST),
            Self::Best => formatter.write_str(BEST),
            Self::Step(steps) => steps.fmt(formatter),
        }
    }
}

impl FromStr for WhichWeights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            LAST => Ok(Self::Last),
            BEST => Ok(Self::Best),
            number => number::whole(number)
                .map(Self::Step)
                .ok_or_else(|| format!("`{text}`, expected {LAST}, {BEST} or a number of steps")),
        }
    }
}

impl From<WhichWeights> for String {
    fn from(which: WhichWeights) -> Self {
        which.to_string()
    }
}

impl TryFrom<String> for WhichWeights {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl WhichWeights {
    /// Where they lie in the folder of their run.
    #[must_use]
    pub fn path(self) -> PathBuf {
        match self {
            Self::Last => WEIGHTS.into(),
            Self::Best => Path::new(KEPT).join(format!("{BEST}{ENDING}")),
            Self::Step(steps) => Path::new(KEPT).join(format!("{steps:0DIGITS$}{ENDING}")),
        }
    }

    /// What `run.json` calls their file, on every system.
    pub(super) fn name(self) -> String {
        self.path().display().to_string().replace('\\', "/")
    }

    /// Those in the file of this name in the folder of kept weights.
    fn of_file(name: &str) -> Option<Self> {
        match name.strip_suffix(ENDING)? {
            BEST => Some(Self::Best),
            digits if digits.len() >= DIGITS => digits.parse().ok().map(Self::Step),
            _ => None,
        }
    }
}

/// Weights that are kept, by length and hash.
pub(super) type Kept = BTreeMap<WhichWeights, Fingerprint>;

/// Puts a file of weights into the folder of a run, in place of one of its name.
///
/// # Errors
/// Path, bytes and what the operating system says; what was there is intact then.
pub(super) fn write(
    disk: &dyn Disk,
    run: &Folder,
    which: WhichWeights,
    weights: &[u8],
) -> Result<()> {
    if which != WhichWeights::Last {
        disk::ensure_folder(disk, run, Path::new(KEPT))?;
    }
    disk::replace(disk, run, &which.path(), weights)
}

/// Which weights the folder of a run holds beside the last, in order: the best first, then by steps.
pub(super) fn listed(run: &Folder) -> Result<Vec<WhichWeights>> {
    let entries = run.entries(KEPT)?;
    let mut listed: Vec<WhichWeights> = (entries.iter())
        .filter_map(|(name, _)| WhichWeights::of_file(name))
        .collect();
    listed.sort_unstable();
    Ok(listed)
}

/// Makes the kept weights those of a checkpoint: the best are put in their place, and what the checkpoint does not know is removed.
/// Gives those that are there, and what is wrong with others: these are not kept any more.
///
/// # Errors
/// What the operating system says.
pub(super) fn restore(
    disk: &dyn Disk,
    run: &Folder,
    known: &Kept,
    best: Option<&[u8]>,
    length_max: usize,
) -> Result<(Kept, Vec<String>)> {
    let mut kept = Kept::new();
    let mut lost = Vec::new();
    for (&which, fingerprint) in known {
        let path = which.path();
        match run.read(&path, length_max) {
            Ok(Some(found)) if Fingerprint::of(&found) == *fingerprint => {
                kept.insert(which, fingerprint.clone());
            }
            Ok(_) | Err(RunError::BadData { .. }) => {
                lost.push(run.shown(path).display().to_string());
            }
            Err(error) => return Err(error),
        }
    }
    if let Some(best) = best {
        kept.insert(WhichWeights::Best, Fingerprint::of(best));
    }
    for (name, _) in run.entries(KEPT)? {
        if !WhichWeights::of_file(&name).is_some_and(|which| kept.contains_key(&which)) {
            let path = Path::new(KEPT).join(name);
            (run.dir().remove_file(&path)).with_context(|| run.cannot("remove", &path))?;
        }
    }
    if let Some(best) = best {
        write(disk, run, WhichWeights::Best, best)?;
    }
    Ok((kept, lost))
}

/// That a run does not have the weights that were asked for.
pub(super) fn missing(run: &Folder, asked: WhichWeights) -> RunError {
    let mut there = vec![WhichWeights::Last];
    there.extend(listed(run).unwrap_or_default());
    let distance = |which: &WhichWeights| match (which, asked) {
        (WhichWeights::Step(steps), WhichWeights::Step(asked)) => Some(steps.abs_diff(asked)),
        _ => None,
    };
    let steps = there.iter().filter(|which| distance(which).is_some());
    RunError::NoSuchWeights {
        folder: run.path().to_owned(),
        asked,
        nearest: steps.min_by_key(|which| distance(which)).copied(),
        there: there
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_called_as_they_are_typed() {
        for which in [
            WhichWeights::Last,
            WhichWeights::Best,
            WhichWeights::Step(50_000),
        ] {
            assert_eq!(which.to_string().parse(), Ok(which));
        }
        assert_eq!(
            WhichWeights::Step(50_000).name(),
            "weights/000000050000.safetensors"
        );
        assert!("bets".parse::<WhichWeights>().is_err());
        for (name, which) in [
            ("best.safetensors", Some(WhichWeights::Best)),
            ("000000000007.safetensors", Some(WhichWeights::Step(7))),
            ("7.safetensors", None),
            ("best.safetensors.tmp", None),
            ("last.safetensors", None),
        ] {
            assert_eq!(WhichWeights::of_file(name), which, "{name}");
        }
    }
}
