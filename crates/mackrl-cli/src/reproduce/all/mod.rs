//! `mackrl reproduce all`: every figure, and one page that shows them with their verdicts.

mod page;

use std::{
    fmt::{self, Display, Formatter},
    fs,
    path::PathBuf,
};

use anyhow::Context as _;
use clap::{Args, Command, FromArgMatches as _};
use serde::Serialize;

use super::{
    Claim, ablations,
    ablations::{AblationOptions, AblationReport},
    figure5,
    figure5::{Figure5Options, Figure5Report},
    figure6,
    figure6::{Figure6Options, Figure6Report},
    figure7,
    figure7::{Figure7Options, Figure7Report},
    learning::LearningOptions,
    write,
};
use crate::{plot::LineChart, progress::Meter};
use page::Section;

/// The page's name.
const PAGE: &str = "report.html";

/// Reproduce all figures and the ablations, and make one self-contained HTML report of them.
///
/// Makes figure5, figure6, figure7 and ablations in one folder, with the runs that they share made once. Finished runs are used as
/// they are, unfinished ones go on, so the command can be stopped and given again.
///
/// Writes what those commands write, and report.html: every figure, the claims of the paper with their verdicts, the published
/// numbers beside ours, and where each number comes from. The page needs no other file and no network.
///
/// Example: mackrl reproduce all --seeds 10 --steps 2500000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct AllOptions {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,

    /// Leave the ablations out: they are most of the work.
    #[arg(long)]
    pub(crate) without_ablations: bool,
}

/// Everything in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct AllReport {
    /// Where the page lies.
    pub(crate) page: PathBuf,
    /// Repeats these numbers.
    pub(crate) command: String,
    pub(crate) figure5: Figure5Report,
    pub(crate) figure6: Figure6Report,
    pub(crate) figure7: Figure7Report,
    pub(crate) ablations: Option<AblationReport>,
}

/// Makes everything that is not there and writes the page.
///
/// # Errors
/// If a run fails or a file cannot be written.
pub(crate) fn run(options: &AllOptions) -> anyhow::Result<AllReport> {
    let learning = &options.learning;
    let out = &learning.out;
    fs::create_dir_all(out).with_context(|| format!("creating the folder {}", out.display()))?;
    let meter = Meter::new("runs of figure 5");
    let figure5 = figure5::run(&figure5_options(out)?, &|done, total| {
        meter.report(done, total);
    })?;
    let figure6 = figure6::run(&Figure6Options {
        learning: learning.clone(),
    })?;
    let figure7 = figure7::run(&Figure7Options {
        learning: learning.clone(),
    })?;
    let ablations = if options.without_ablations {
        None
    } else {
        Some(ablations::run(&AblationOptions {
            learning: learning.clone(),
            map: "2s3z".to_owned(),
        })?)
    };
    let mut command = learning.resolved().command("all");
    if options.without_ablations {
        command += " --without-ablations";
    }
    let report = AllReport {
        page: out.join(PAGE),
        command,
        figure5,
        figure6,
        figure7,
        ablations,
    };
    write(out, PAGE, report.html()?.as_bytes())?;
    Ok(report)
}

/// Figure 5 as the command makes it when nothing else is asked for.
fn figure5_options(out: &std::path::Path) -> anyhow::Result<Figure5Options> {
    let command = Figure5Options::augment_args(Command::new("figure5"));
    let words = ["figure5".into(), "--out".into(), out.as_os_str().to_owned()];
    let matches = command.try_get_matches_from(words)?;
    Ok(Figure5Options::from_arg_matches(&matches)?)
}

impl AllReport {
    /// Every claim, with the figure that it is about.
    fn claims(&self) -> Vec<(&'static str, &Claim)> {
        let ablations = self.ablations.as_ref();
        let ablations: &[Claim] = ablations.map_or(&[], |report| &report.claims);
        [
            ("Figure 5", &*self.figure5.claims),
            ("Figure 6", &self.figure6.claims),
            ("Figure 7", &self.figure7.claims),
            ("Ablations", ablations),
        ]
        .into_iter()
        .flat_map(|(figure, claims)| claims.iter().map(move |claim| (figure, claim)))
        .collect()
    }

    fn html(&self) -> anyhow::Result<String> {
        let provenance = |value: serde_json::Result<String>| value.context("writing a provenance");
        let mut sections = vec![
            Section {
                title: "Figure 5: the matrix game",
                charts: vec![self.figure5.chart().to_svg()],
                claims: &self.figure5.claims,
                text: self.figure5.to_string(),
                provenance: provenance(serde_json::to_string_pretty(&self.figure5.provenance))?,
            },
            Section {
                title: "Figure 6: battles won during training",
                charts: (self.figure6.charts().iter().map(LineChart::to_svg)).collect(),
                claims: &self.figure6.claims,
                text: self.figure6.to_string(),
                provenance: provenance(serde_json::to_string_pretty(&self.figure6.provenance))?,
            },
            Section {
                title: "Figure 7: when pairs delegate",
                charts: vec![self.figure7.chart().to_svg()],
                claims: &self.figure7.claims,
                text: self.figure7.to_string(),
                provenance: provenance(serde_json::to_string_pretty(&self.figure7.provenance))?,
            },
        ];
        if let Some(ablations) = &self.ablations {
            sections.push(Section {
                title: "Ablations: where the gain comes from",
                charts: vec![ablations.chart().to_svg()],
                claims: &ablations.claims,
                text: ablations.to_string(),
                provenance: provenance(serde_json::to_string_pretty(&ablations.provenance))?,
            });
        }
        Ok(page::html(&self.command, &self.claims(), &sections))
    }
}

impl Display for AllReport {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}\n", self.command)?;
        for (figure, claim) in self.claims() {
            let verdict = if claim.holds {
                "holds"
            } else {
                "does not hold"
            };
            writeln!(out, "  {figure:<10} {verdict:<14} {}", claim.claim)?;
        }
        writeln!(out, "\n{}", self.page.display())
    }
}
