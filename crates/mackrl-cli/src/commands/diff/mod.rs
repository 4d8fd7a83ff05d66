//! `mackrl diff`: where two runs, two checkpoints or two results first differ.

mod files;
mod replay;
mod runs;

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::{args::DiffArgs, failure::Failure, output};

/// What can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Run,
    Checkpoint,
    File,
}

/// What a comparison found, for people and as JSON.
trait Comparison: Serialize {
    /// The first difference in words, if there is one.
    fn first(&self) -> Option<String>;
    /// Name and finding of every part that was compared.
    fn lines(&self) -> Vec<(&'static str, String)>;
}

/// Two things that differ in a value.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Differing {
    /// The name or path of the value.
    name: String,
    /// What `a` has; `null` if it has none.
    a: Value,
    /// What `b` has; `null` if it has none.
    b: Value,
}

/// Compares two things of one kind, prints what was found, and fails if they differ.
pub(crate) fn run(args: &DiffArgs) -> anyhow::Result<()> {
    let kinds = [Kind::of(&args.a), Kind::of(&args.b)];
    match kinds {
        [Kind::Run, Kind::Run] => conclude(&runs::compare(args)?, args),
        [Kind::Checkpoint, Kind::Checkpoint] => {
            conclude(&files::compare_checkpoints(&args.a, &args.b)?, args)
        }
        [Kind::File, Kind::File] => conclude(&files::compare_json(&args.a, &args.b)?, args),
        [a, b] => {
            let message = format!(
                "{} is {}, and {} is {}; expected two of one kind",
                args.a.display(),
                a.name(),
                args.b.display(),
                b.name()
            );
            Err(Failure::Usage { message }.into())
        }
    }
}

impl Kind {
    fn of(path: &Path) -> Self {
        if path.is_file() {
            Self::File
        } else if path.join("counters.json").exists() {
            Self::Checkpoint
        } else {
            Self::Run
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Run => "a run folder",
            Self::Checkpoint => "a checkpoint",
            Self::File => "a file",
        }
    }
}

impl Differing {
    fn new(name: impl Into<String>, a: impl Into<Value>, b: impl Into<Value>) -> Self {
        Self {
            name: name.into(),
            a: a.into(),
            b: b.into(),
        }
    }

    /// "NAME: A, B"
    fn words(&self) -> String {
        let show = |value: &Value| match value {
            Value::Null => "nothing".to_owned(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        format!("{}: {}, {}", self.name, show(&self.a), show(&self.b))
    }
}

fn conclude(comparison: &impl Comparison, args: &DiffArgs) -> anyhow::Result<()> {
    if args.json {
        output::print_json(comparison)?;
    } else {
        let sides = [("a", &args.a), ("b", &args.b)];
        let sides = sides.map(|(name, path)| (name, path.display().to_string()));
        let lines = sides.into_iter().chain(comparison.lines());
        let text: String = lines
            .map(|(name, finding)| format!("{name:<14}{finding}\n"))
            .collect();
        output::print(&text)?;
    }
    match comparison.first() {
        Some(first) => Err(Failure::Different { first }.into()),
        None => Ok(()),
    }
}
