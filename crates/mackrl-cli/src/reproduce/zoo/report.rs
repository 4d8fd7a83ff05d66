//! What the teams of the zoo win.

use std::fmt::{Display, Formatter};

use mackrl_run::{
    provenance::Provenance,
    recorded::{Measurements, RecordedRun},
    run_folder::{Run, WhichWeights},
    sweep::Entry,
    training::{Score, Teams},
};
use serde::Serialize;

use crate::{failure::Failure, output, reproduce::page};

/// In every row of metrics that ends an interval of training or a test.
const TESTED: &str = "test_return_mean";

/// All teams.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Report {
    /// Where they come from.
    provenance: Vec<Provenance>,
    pub(super) teams: Vec<Team>,
}

/// A team.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Team {
    pub(super) map: String,
    pub(super) algorithm: String,
    /// Environment steps of its training.
    pub(super) steps_env: u64,
    pub(super) seed: u64,
    /// Seconds that training and tests took, on one thread.
    pub(super) wall_s: f64,
    /// Bytes of its file of weights.
    weights_bytes: usize,
    /// How the weights at the end and the best in a test play.
    #[serde(flatten)]
    pub(super) judged: Teams,
}

impl Report {
    /// Reads finished runs.
    ///
    /// # Errors
    /// [`Failure::BadData`] if a run does not say how its teams play.
    pub(super) fn read(entries: &[Entry]) -> anyhow::Result<Self> {
        let mut provenance = Vec::new();
        let mut teams = Vec::with_capacity(entries.len());
        for entry in entries {
            let run = RecordedRun::open(entry.folder.clone())?;
            let judged = run.teams.clone().ok_or_else(|| Failure::BadData {
                message: format!(
                    "{} does not say how its team plays: a version made it that did not judge it",
                    entry.folder.display()
                ),
            })?;
            let wall_s = Measurements::read(&run, TESTED)?.wall_s;
            let weights = Run::open(&entry.folder, WhichWeights::Last)?.weights;
            provenance.extend(run.provenance.iter().cloned());
            teams.push(Team {
                map: entry.name.clone(),
                algorithm: run.algorithm(),
                steps_env: run.config.run.steps_env,
                seed: run.config.run.seed,
                wall_s: wall_s.last().copied().unwrap_or_default(),
                weights_bytes: weights.len(),
                judged,
            });
        }
        Ok(Self {
            provenance: Provenance::merged(&provenance),
            teams,
        })
    }

    /// The versions of simulator and learning that made the teams.
    pub(super) fn versions(&self) -> String {
        let versions = self.provenance.first().map(|one| one.versions.to_string());
        versions.unwrap_or_default()
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let row = |team: &Team| {
            let Teams { last, best, .. } = &team.judged;
            vec![
                team.map.clone(),
                best.as_ref().map_or_else(dash, won),
                best.map_or_else(dash, |best| thousands(best.steps_env)),
                won(last),
                thousands(team.steps_env),
                format!("{:.1}", team.wall_s / 60.0),
                format!("{:.0} KiB", team.weights_bytes as f64 / 1024.0),
            ]
        };
        self.teams.iter().map(row).collect()
    }

    /// The table in Markdown, with what made it.
    pub(super) fn markdown(&self) -> String {
        let episodes = self
            .teams
            .first()
            .map_or(0, |team| team.judged.last.episodes);
        format!(
            "{}\nMean ± standard error over {episodes} battles that neither training nor tests have seen; minutes on one thread. \
             Made by {}.\n",
            page::table(&HEADING, &self.rows()),
            self.versions()
        )
    }
}

const HEADING: [&str; 7] = [
    "map",
    "best weights win",
    "of step",
    "last weights win",
    "steps",
    "minutes",
    "weights",
];

impl Display for Report {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let heading = HEADING.map(str::to_owned).to_vec();
        let rows = [vec![heading], self.rows()].concat();
        formatter.write_str(&output::table(&rows))
    }
}

/// "98.1 % ± 0.8"; where all battles end alike, there is no spread to estimate an error from.
pub(super) fn won(score: &Score) -> String {
    if score.standard_error == 0.0 {
        return format!("{:.0} %", 100.0 * score.mean);
    }
    format!(
        "{:.1} % ± {:.1}",
        100.0 * score.mean,
        100.0 * score.standard_error
    )
}

/// "300 k"
fn thousands(steps: u64) -> String {
    format!("{:.0} k", steps as f64 / 1000.0)
}

fn dash() -> String {
    "–".to_owned()
}
