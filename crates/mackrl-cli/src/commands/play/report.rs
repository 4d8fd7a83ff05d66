//! A folder that keeps what scripted teams did: the numbers as JSON, and a page that shows them.

use std::{fmt::Write as _, fs, path::Path};

use mackrl_run::provenance::CODE;

use anyhow::Context;
use serde::Serialize;

use super::statistics::Row;
use crate::output::write_file;

/// Names of the files.
const DATA: &str = "scripted.json";
const PAGE: &str = "README.md";

/// All rows, and where they come from.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    /// The command that makes the same files again, byte for byte.
    command: String,
    /// Version and source of the program that made them.
    code: &'static str,
    rows: &'a [Row],
}

/// Makes the folder for a report, if it is not there.
///
/// A folder that cannot be written should be found out before the work, not after it.
pub(super) fn make_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))
}

impl<'a> Report<'a> {
    pub(super) fn new(command: String, rows: &'a [Row]) -> Self {
        Self {
            command,
            code: CODE,
            rows,
        }
    }

    /// Writes both files.
    pub(super) fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let json = serde_json::to_string_pretty(self).context("cannot write the rows as JSON")?;
        write_file(&folder.join(DATA), (json + "\n").as_bytes())?;
        write_file(&folder.join(PAGE), self.page().as_bytes())
    }

    fn page(&self) -> String {
        let Self { command, code, .. } = self;
        format!(
            "# How scripted teams fare\n\n\
             Means over episodes, each ± its standard error. Every script decides from the agents' own local views;\n\
             `crates/mackrl-skirmish/src/scripted/mod.rs` says how. An error of 0 means that all episodes ended alike, which they may\n\
             not always do: of n such episodes, up to 3/n could have gone otherwise (with 95 % confidence).\n\n\
             [`{DATA}`]({DATA}) holds all numbers: episode lengths and losses of either side too. Version {code} made both files by\n\n\
             ```text\n{command}\n```\n\n\
             and the same command makes them again, byte for byte, on any number of threads.\n\n\
             ## Share of battles won\n\n{}\n## Return\n\n20 is a clean victory; what grows back on an enemy pays again.\n\n{}",
            self.pivot(|row| row.won()),
            self.pivot(|row| row.total()),
        )
    }

    /// A table of maps by policies.
    fn pivot(&self, cell: impl Fn(&Row) -> String) -> String {
        let mut policies: Vec<&str> = Vec::new();
        let mut maps: Vec<&str> = Vec::new();
        for row in self.rows {
            for (list, name) in [(&mut policies, row.policy()), (&mut maps, row.map())] {
                if !list.contains(&name) {
                    list.push(name);
                }
            }
        }
        let mut table = format!("| map | {} |\n|---|", policies.join(" | "));
        table += &("---:|".repeat(policies.len()) + "\n");
        for map in maps {
            let rows = self.rows.iter().filter(|row| row.map() == map);
            let cells: Vec<String> = rows.map(&cell).collect();
            let _ = writeln!(table, "| `{map}` | {} |", cells.join(" | "));
        }
        table
    }
}
