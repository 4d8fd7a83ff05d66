//! `mackrl reproduce zoo`: one trained team for each of some maps, with the default preset.
//!
//! The runs are those of a sweep: finished ones are kept, unfinished ones go on. What a team is worth stands in its `run.json`: how
//! its last and its best weights play in battles that neither training nor tests have seen.

mod card;
mod report;

use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use anyhow::Context as _;
use clap::Args;
use mackrl::policy::Behaviour;
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::{Config, ConfigBuilder},
    replay::record_policy,
    run_folder::{self, METRICS, Run, WhichWeights},
    sweep::Entry,
};

use super::{make_folder, page, write};
use crate::{
    commands::{resume::make_all, sweep::expect_all},
    failure::Failure,
    replay::Opened,
    signals,
};
pub(crate) use report::Report;
use report::Team;

/// The maps, and for how many environment steps a team learns there.
const MAPS: [(&str, u64); 10] = [
    ("3m", 300_000),
    ("8m", 1_000_000),
    ("2s3z", 1_000_000),
    ("3s5z", 2_000_000),
    ("5m_vs_6m", 2_000_000),
    ("3s_vs_3z", 2_000_000),
    ("so_many_baneling", 2_000_000),
    ("1c3s5z", 2_000_000),
    ("MMM", 3_000_000),
    ("MMM2", 3_000_000),
];
/// Tests during each training.
const TESTS: u64 = 30;
/// Episodes that are recorded of each published team.
const REPLAYS: u64 = 2;
/// The page that shows the first of them.
const BATTLE: &str = "battle.html";
/// Between these marks stands the table of a page.
const MARKS: &str = "zoo";

/// Train a team for each of ten maps with the default preset, and write the table of what they win
///
/// A run that is finished in the folder is not repeated and an unfinished one goes on, so the command can be stopped and given
/// again. Each team is judged in battles that neither training nor tests have seen.
///
/// Prints the table and writes it as zoo.json. --page fills it into a page, between the lines `<!-- zoo: begin -->` and
/// `<!-- zoo: end -->`. --publish copies what is worth keeping of each run: configuration, record, metrics, last and best weights;
/// with two battles of the best team as replays, one of them as a page for any browser, and a card that says what the team wins. A
/// published team is a run folder: `mackrl evaluate zoo/3m --checkpoint best`.
///
/// Examples: mackrl reproduce zoo --page docs/zoo.md; mackrl reproduce zoo --maps 3m,2s3z --publish zoo
#[derive(Debug, Clone, Args)]
pub(crate) struct ZooOptions {
    /// Maps to learn on, separated by commas [default: `3m,8m,2s3z,3s5z,5m_vs_6m,3s_vs_3z,so_many_baneling,1c3s5z,MMM,MMM2`]
    #[arg(long, value_name = "MAPS", value_delimiter = ',')]
    maps: Vec<String>,

    /// Environment steps of every team [default: 300 000 on 3m, 3 million on MMM and MMM2, between these elsewhere]
    #[arg(long, value_name = "N", value_parser = crate::args::number(1, crate::args::MOST))]
    steps: Option<u64>,

    /// Seed of every team
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,

    /// Folder of the run folders, one for each map
    #[arg(long, value_name = "DIR", default_value = "runs/zoo")]
    out: PathBuf,

    /// Page whose table is to be replaced
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,

    /// Folder into which the teams are copied, one folder for each map
    #[arg(long, value_name = "DIR")]
    publish: Option<PathBuf>,

    /// One setting laid over the preset for all teams, such as algorithm.hidden=32; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Runs side by side, each on one thread; changes no result [default: one for each processor]
    #[arg(long, value_name = "K", value_parser = crate::args::side_by_side)]
    jobs: Option<NonZeroUsize>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

impl ZooOptions {
    /// The runs, in the order of the maps.
    fn entries(&self) -> anyhow::Result<Vec<Entry>> {
        let all = MAPS.map(|(map, _)| map.to_owned());
        let maps = if self.maps.is_empty() {
            &all[..]
        } else {
            &self.maps[..]
        };
        let entry = |map: &String| {
            Ok(Entry {
                name: map.clone(),
                folder: self.out.join(map),
                config: self.config(map)?,
            })
        };
        maps.iter().map(entry).collect()
    }

    fn config(&self, map: &str) -> anyhow::Result<Config> {
        let own = MAPS.iter().find(|(name, _)| *name == map);
        let steps = self.steps.or(own.map(|(_, steps)| *steps));
        let steps = steps.ok_or_else(|| {
            let names = MAPS.map(|(name, _)| name).join(", ");
            let message = format!(
                "--maps {map}: how long a team learns is known of {names}; say it with --steps"
            );
            Failure::Usage { message }
        })?;
        let interval = (steps / TESTS).max(1);
        let settings = [
            format!("run.steps_env={steps}"),
            format!("run.seed={}", self.seed),
            format!("run.metrics_interval_steps_env={interval}"),
            format!("test.interval_steps_env={interval}"),
        ];
        let builder = ConfigBuilder::new(crate::registry())
            .preset("default")?
            .map(&format!("--maps {map}"), map);
        let mut settings = settings.iter().chain(&self.set);
        Ok(settings
            .try_fold(builder, |builder, setting| builder.set(setting))?
            .build()?)
    }

    fn jobs(&self) -> NonZeroUsize {
        let processors = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.jobs.unwrap_or_else(processors)
    }
}

/// Makes all runs that are not finished, and tells what their teams win.
///
/// # Errors
/// If a run fails, is stopped, or was made by a version that did not judge it; if something cannot be written.
pub(crate) fn run(options: &ZooOptions) -> anyhow::Result<Report> {
    let entries = options.entries()?;
    make_folder(&options.out)?;
    let outcome = make_all(&entries, options.jobs(), None, &signals::listen()?)?;
    expect_all(&outcome, entries.len())?;
    let report = Report::read(&entries)?;
    super::save(&options.out, "zoo", &report, &[])?;
    if let Some(file) = &options.page {
        page::fill(file, MARKS, &report.markdown())?;
    }
    if let Some(folder) = &options.publish {
        for (entry, team) in entries.iter().zip(&report.teams) {
            publish(entry, team, &report.versions(), &folder.join(&entry.name))?;
        }
    }
    Ok(report)
}

/// Copies what is worth keeping of a finished run, records battles of its best team, and says what it is.
fn publish(entry: &Entry, team: &Team, versions: &str, folder: &Path) -> anyhow::Result<()> {
    let run = Run::open(&entry.folder, WhichWeights::Best)?;
    let weights = [WhichWeights::Last, WhichWeights::Best].map(WhichWeights::path);
    let records = ["config.toml", "run.json", METRICS].map(PathBuf::from);
    for file in records.iter().chain(&weights) {
        let (from, to) = (entry.folder.join(file), folder.join(file));
        if let Some(parent) = to.parent() {
            make_folder(parent)?;
        }
        let content = fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
        run_folder::replace(&to, &content)?;
    }
    let seed = run.config.run.seed;
    let name = |episode| format!("best-seed{seed}-episode{episode}.replay.gz");
    for episode in 0..REPLAYS {
        let key = EpisodeKey::new(seed, Stream::Evaluation, episode);
        let replay = record_policy(&run.config, &run.weights, Behaviour::GREEDY, key)?;
        run_folder::keep_replay(folder, &name(episode), &replay.to_bytes())?;
        if episode == 0 {
            let page = Opened::of(replay)?.page(0);
            write(folder, BATTLE, page.as_bytes())?;
        }
    }
    let card = card::card(team, &name(0), versions);
    write(folder, "README.md", card.as_bytes())
}
