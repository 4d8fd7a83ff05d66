//! `--episodes-out`: a row for each episode.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use mackrl_run::training::EpisodeResult;
use serde_json::{Map, Value};

use crate::failure::Failure;

/// How rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    /// A JSON object a line.
    JsonLines,
    /// Names in the first line, then values, all separated by commas.
    Csv,
}

/// A file that gets a row for each episode. What goes wrong is told at the end.
#[derive(Debug)]
pub(super) struct EpisodesFile {
    path: PathBuf,
    format: Format,
    seed: u64,
    file: BufWriter<File>,
    written: io::Result<()>,
}

impl EpisodesFile {
    /// Creates the file, before anything is played; its ending says how it is written.
    ///
    /// # Errors
    /// [`Failure::Usage`] if the ending is another than .jsonl and .csv; otherwise what the operating system says.
    pub(super) fn create(path: &Path, seed: u64) -> anyhow::Result<Self> {
        let format = match path.extension().and_then(|ending| ending.to_str()) {
            Some("jsonl") => Format::JsonLines,
            Some("csv") => Format::Csv,
            _ => {
                let path = path.display();
                let message =
                    format!("--episodes-out {path}: expected a name that ends in .jsonl or .csv");
                return Err(Failure::Usage { message }.into());
            }
        };
        let file = File::create(path).with_context(|| cannot(path))?;
        Ok(Self {
            path: path.to_owned(),
            format,
            seed,
            file: BufWriter::new(file),
            written: Ok(()),
        })
    }

    /// Writes the row of an episode.
    pub(super) fn add(&mut self, result: &EpisodeResult<'_>) {
        if self.written.is_ok() {
            let text = text(self.format, self.seed, result);
            self.written = self.file.write_all(text.as_bytes());
        }
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The first thing that went wrong.
    pub(super) fn end(mut self) -> anyhow::Result<()> {
        let written = self.written.and_then(|()| self.file.flush());
        written.with_context(|| cannot(&self.path))
    }
}

fn cannot(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

/// A row; before the first one, in a CSV file, the line of names.
fn text(format: Format, seed: u64, result: &EpisodeResult<'_>) -> String {
    let EpisodeResult { episode, values } = result;
    match format {
        Format::JsonLines => {
            let counts = [("episode", *episode), ("seed", seed)];
            let counts = counts.map(|(name, count)| (name.to_owned(), Value::from(count)));
            let values = values.iter();
            let values = values.map(|&(name, value)| (name.to_owned(), Value::from(value)));
            let row: Map<String, Value> = counts.into_iter().chain(values).collect();
            format!("{}\n", Value::Object(row))
        }
        Format::Csv => {
            let mut text = String::new();
            if *episode == 0 {
                let names: String = values.iter().map(|(name, _)| format!(",{name}")).collect();
                text += &format!("episode,seed{names}\n");
            }
            let values: String = (values.iter())
                .map(|(_, value)| format!(",{value}"))
                .collect();
            text + &format!("{episode},{seed}{values}\n")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_holds_what_was_measured_of_an_episode() {
        let result = |episode| EpisodeResult {
            episode,
            values: vec![("battle_won", 1.0), ("return", 18.25)],
        };
        let csv = [0, 1]
            .map(|episode| text(Format::Csv, 7, &result(episode)))
            .concat();
        assert_eq!(
            csv,
            "episode,seed,battle_won,return\n0,7,1,18.25\n1,7,1,18.25\n"
        );
        let row: Value = serde_json::from_str(&text(Format::JsonLines, 7, &result(3))).unwrap();
        let expected =
            serde_json::json!({ "episode": 3, "seed": 7, "battle_won": 1.0, "return": 18.25 });
        assert_eq!(row, expected);
    }

    #[test]
    fn another_ending_is_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episodes.txt");
        let error = EpisodesFile::create(&path, 1).unwrap_err().to_string();
        assert!(
            error.ends_with("expected a name that ends in .jsonl or .csv"),
            "{error}"
        );
        assert!(!path.exists());
    }
}
