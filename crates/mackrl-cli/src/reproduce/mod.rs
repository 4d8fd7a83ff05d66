//! One command for each figure of the paper, and for the comparisons and teams of this project.
//!
//! Figures of learning are values of one type, which [`learning`] trains, draws and judges.

pub(crate) mod ablations;
pub(crate) mod all;
pub(crate) mod calibration;
mod claim;
pub(crate) mod comparison;
pub(crate) mod figure4_neurips;
pub(crate) mod figure5;
pub(crate) mod figure6;
pub(crate) mod figure7;
mod learning;
mod page;
pub(crate) mod ppo;
pub(crate) mod protocol;
pub(crate) mod zoo;

use std::{fs, path::Path};

use anyhow::Context as _;
use mackrl::statistics::Interval;
use mackrl_run::run_folder;
use serde::Serialize;

use crate::plot::{LineChart, SmallMultiples};
pub(crate) use claim::{Claim, ClaimSource, Verdict, write_verdicts};

/// A drawing.
pub(crate) enum Chart {
    Lines(LineChart),
    Multiples(SmallMultiples),
}

impl Chart {
    /// The drawing as SVG.
    pub(crate) fn to_svg(&self) -> String {
        match self {
            Self::Lines(chart) => chart.to_svg(),
            Self::Multiples(chart) => chart.to_svg(),
        }
    }

    fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        match self {
            Self::Lines(chart) => chart.to_png(),
            Self::Multiples(chart) => chart.to_png(),
        }
    }
}

/// Makes the folder of a figure: one that cannot be written should be found out before the work, not after it.
fn make_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("creating the folder {}", folder.display()))
}

/// Writes a report as `NAME.json`, and each chart as .svg and .png.
fn save(
    folder: &Path,
    name: &str,
    report: &impl Serialize,
    charts: &[(String, Chart)],
) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(report)? + "\n";
    write(folder, &format!("{name}.json"), json.as_bytes())?;
    for (name, chart) in charts {
        write(folder, &format!("{name}.svg"), chart.to_svg().as_bytes())?;
        write(folder, &format!("{name}.png"), &chart.to_png()?)?;
    }
    Ok(())
}

/// Writes a file whole: a reader finds the old one or the new one, never a part.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    Ok(run_folder::replace(&folder.join(name), bytes)?)
}

/// "0.500", or a dash for what does not exist.
fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"))
}

/// "0.500 ± 0.010"
fn entry(mean: f64, error: f64) -> String {
    format!("{mean:.3} ± {error:.3}")
}

/// "0.500 [0.400, 0.600]"
pub(crate) fn interval(interval: Interval) -> String {
    let Interval {
        estimate,
        low,
        high,
    } = interval;
    format!("{estimate:.3} [{low:.3}, {high:.3}]")
}
