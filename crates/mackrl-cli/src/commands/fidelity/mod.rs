//! `mackrl fidelity`: the simulator beside recorded runs of the real game.

mod chart;
mod page;

use anyhow::Context;
use mackrl_skirmish::{
    SIMULATOR_VERSION, SkirmishSettings,
    fidelity::{Finding, Policy, References, Sample, Spread, judge, passed, play},
};
use serde::Serialize;

use crate::{args::FidelityArgs, failure::Failure, output, progress::Meter};

/// All that was found.
#[derive(Debug, Serialize)]
struct Comparison {
    command: String,
    simulator_version: u32,
    episodes: usize,
    checks: Vec<Finding>,
    summary: Vec<Check>,
    lengths: Vec<LengthRow>,
}

/// One check, over all of its rows.
#[derive(Debug, Serialize)]
struct Check {
    name: String,
    pass: bool,
}

/// How long episodes of random play are, in both.
#[derive(Debug, Serialize)]
struct LengthRow {
    map: String,
    real: [f64; 5],
    real_episodes: usize,
    ours: Spread,
    /// Share of our episodes of at most each length.
    #[serde(skip)]
    shares: Vec<[f64; 2]>,
}

/// Plays, compares, and prints or keeps what came out.
pub(crate) fn run(args: &FidelityArgs) -> anyhow::Result<()> {
    let settings = settings(&args.set)?;
    let references = References::load()?;
    let worlds = worlds(&references, args.map.as_deref())?;
    let samples = samples(args, &settings, &worlds)?;
    let mut checks = judge(&references, &samples);
    checks.retain(|row| args.map.as_ref().is_none_or(|map| *map == row.map));
    let summary = passed(&checks)
        .into_iter()
        .map(|(name, pass)| Check { name, pass })
        .collect();
    let comparison = Comparison {
        command: args.command(),
        simulator_version: SIMULATOR_VERSION,
        episodes: args.episodes.get(),
        checks,
        summary,
        lengths: lengths(&references, &samples),
    };
    if let Some(file) = &args.html {
        output::write_file(file, page::html(&comparison, &references).as_bytes())?;
    }
    if let Some(file) = &args.markdown {
        let picture = file.with_extension("svg");
        let name = picture.file_name().unwrap_or_default().to_string_lossy();
        let text = page::markdown(&comparison, &references, &name);
        output::write_file(file, text.as_bytes())?;
        output::write_file(
            &picture,
            chart::lengths(&comparison.lengths).to_svg().as_bytes(),
        )?;
    }
    if args.json {
        output::print_json(&comparison)?;
    } else {
        output::print(&page::terminal(&comparison))?;
    }
    let judged: Vec<bool> = comparison
        .checks
        .iter()
        .filter_map(|row| row.pass)
        .collect();
    match judged.iter().filter(|pass| !**pass).count() {
        0 => Ok(()),
        failed => Err(Failure::Unfaithful {
            failed,
            rows: judged.len(),
        }
        .into()),
    }
}

/// The settings of the game that were typed, over its own.
fn settings(typed: &[String]) -> anyhow::Result<SkirmishSettings> {
    let mut table = toml::Table::new();
    for setting in typed {
        let wrong = || Failure::usage(format!("--set {setting}: expected env.KEY=VALUE"));
        let (key, value) = setting.split_once('=').ok_or_else(wrong)?;
        let key = key.strip_prefix("env.").ok_or_else(wrong)?;
        let value = format!("x = {value}")
            .parse::<toml::Table>()
            .ok()
            .and_then(|mut table| table.remove("x"))
            .unwrap_or_else(|| toml::Value::String(value.to_owned()));
        table.insert(key.to_owned(), value);
    }
    let settings: SkirmishSettings = table
        .try_into()
        .map_err(|error| Failure::usage(format!("--set: {error}")))?;
    settings.validate().context("--set")?;
    Ok(settings)
}

/// The maps and policies of the rows that can be played, each once.
fn worlds(references: &References, map: Option<&str>) -> anyhow::Result<Vec<(String, Policy)>> {
    let mut worlds = Vec::new();
    for row in &references.references {
        let Some(policy) = row.policy else { continue };
        let world = (row.map.clone(), policy);
        if map.is_none_or(|map| map == row.map) && !worlds.contains(&world) {
            worlds.push(world);
        }
    }
    if worlds.is_empty() {
        let mut maps: Vec<&str> = references.references.iter().map(|row| &*row.map).collect();
        maps.sort_unstable();
        maps.dedup();
        let maps = maps.join(", ");
        return Err(Failure::usage(format!(
            "--map {}: no recorded runs of the real game, expected one of {maps}",
            map.unwrap_or_default()
        ))
        .into());
    }
    Ok(worlds)
}

fn samples(
    args: &FidelityArgs,
    settings: &SkirmishSettings,
    worlds: &[(String, Policy)],
) -> anyhow::Result<Vec<Sample>> {
    let (episodes, meter) = (args.episodes.get(), Meter::new("episodes"));
    let total = episodes * worlds.len();
    let sample = |(index, (map, policy)): (usize, &(String, Policy))| {
        let report = |done| meter.report(index * episodes + done, total);
        let world = (map.as_str(), *policy);
        Ok(play(
            world,
            settings,
            episodes,
            args.threads.count(),
            report,
        )?)
    };
    worlds.iter().enumerate().map(sample).collect()
}

fn lengths(references: &References, samples: &[Sample]) -> Vec<LengthRow> {
    let of_map = |map: &str| {
        let mut samples = samples.iter();
        samples.find(|sample| sample.map == map && sample.policy == Policy::Random)
    };
    let row = |real: &mackrl_skirmish::fidelity::Lengths| {
        let mut values = of_map(&real.map)?.values(|played| played.length as f64);
        let ours = Spread::of(&values)?;
        values.sort_by(f64::total_cmp);
        let count = values.len() as f64;
        let share = |(index, length): (usize, &f64)| [*length, (index + 1) as f64 / count];
        Some(LengthRow {
            map: real.map.clone(),
            real: real.quantiles,
            real_episodes: real.episodes,
            ours,
            shares: values.iter().enumerate().map(share).collect(),
        })
    };
    references.lengths.iter().filter_map(row).collect()
}
