//! `mackrl reproduce all`: every figure, and one page that shows them with their verdicts.

mod page;

use std::{
    fmt::{self, Display, Formatter},
    iter,
    path::PathBuf,
};

use clap::{Args, Command, FromArgMatches as _};
use serde::Serialize;

use super::{
    Claim, ablations, figure5,
    figure5::{Figure5Options, Figure5Report},
    figure6, figure7,
    learning::{LearningOptions, Report},
    make_folder, write,
};
use crate::{progress::Meter, signals};
use page::Section;

/// The page's name.
const PAGE: &str = "report.html";
/// Above the section of the matrix game.
const FIGURE5: &str = "Figure 5: the matrix game";

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
#[derive(Debug, Clone, Serialize)]
pub(crate) struct AllReport {
    /// Where the page lies.
    pub(crate) page: PathBuf,
    /// Repeats these numbers.
    pub(crate) command: String,
    pub(crate) figure5: Figure5Report,
    pub(crate) figure6: Report,
    pub(crate) figure7: Report,
    pub(crate) ablations: Option<Report>,
}

/// Makes everything that is not there and writes the page.
///
/// # Errors
/// If a run fails or a file cannot be written.
pub(crate) fn run(options: &AllOptions) -> anyhow::Result<AllReport> {
    let learning = &options.learning;
    let out = &learning.out;
    make_folder(out)?;
    let meter = Meter::new("runs of figure 5");
    let stop = signals::listen()?;
    let figure5 = figure5::run(&figure5_options(out)?, &|done, total| {
        signals::end_if_asked(&stop, "figure 5");
        meter.report(done, total);
    })?;
    let figure6 = figure6::FIGURE.run(learning, None)?;
    let figure7 = figure7::FIGURE.run(learning, None)?;
    let ablations = (!options.without_ablations)
        .then(|| ablations::FIGURE.run(learning, Some("2s3z")))
        .transpose()?;
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
    /// The figures of learning.
    fn learning(&self) -> impl Iterator<Item = &Report> {
        [
            Some(&self.figure6),
            Some(&self.figure7),
            self.ablations.as_ref(),
        ]
        .into_iter()
        .flatten()
    }

    /// Every claim, with the figure that it is about.
    fn claims(&self) -> Vec<(&'static str, &Claim)> {
        let learning = self
            .learning()
            .map(|report| (report.figure.section, &report.claims));
        iter::once((FIGURE5, &self.figure5.claims))
            .chain(learning)
            .flat_map(|(section, claims)| {
                let figure = section
                    .split_once(':')
                    .map_or(section, |(figure, _)| figure);
                claims.iter().map(move |claim| (figure, claim))
            })
            .collect()
    }

    fn html(&self) -> anyhow::Result<String> {
        let figure5 = &self.figure5;
        let mut sections = vec![Section {
            title: FIGURE5,
            charts: vec![figure5.chart().to_svg()],
            claims: &figure5.claims,
            text: figure5.to_string(),
            provenance: serde_json::to_string_pretty(&figure5.provenance)?,
        }];
        for report in self.learning() {
            sections.push(Section {
                title: report.figure.section,
                charts: (report.charts().iter().map(|(_, chart)| chart.to_svg())).collect(),
                claims: &report.claims,
                text: report.to_string(),
                provenance: serde_json::to_string_pretty(&report.provenance)?,
            });
        }
        Ok(page::html(&self.command, &self.claims(), &sections))
    }
}

impl Display for AllReport {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}\n", self.command)?;
        for (figure, claim) in self.claims() {
            let verdict = claim.verdict.words();
            writeln!(out, "  {figure:<10} {verdict:<14} {}", claim.claim)?;
        }
        writeln!(out, "\n{}", self.page.display())
    }
}
