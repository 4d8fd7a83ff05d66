//! `mackrl play`: scripted teams, one episode or many.

mod episode;
mod recording;
mod statistics;
mod view;

use std::path::Path;

use anyhow::Context;
use mackrl::config::{ConfigBuilder, EnvironmentConfig};
use mackrl_env::{EpisodeKey, Stream, registry};

use crate::{
    args::{PlayArgs, with_scenario},
    failure::Failure,
    output,
    reproduce::meter::Meter,
};
use episode::Episode;
use recording::Recording;
use statistics::{Row, play_many};

/// The word that stands for every map.
const ALL: &str = "all";

/// Plays, and prints, records or draws what happened.
pub(crate) fn run(args: &PlayArgs) -> anyhow::Result<()> {
    if let Some(file) = &args.replay {
        let recording = Recording::read(file)?;
        let episode = recording.replay(file)?;
        return one(args, &episode, "replayed, every state as recorded");
    }
    let maps = maps(args)?;
    let policies = args.policy.policies();
    if args.record.is_none() && args.svg.is_none() {
        return many(args, &maps, &policies);
    }
    let ([map], [policy]) = (&maps[..], &policies[..]) else {
        return Err(Failure::Usage {
            message: "--record and --svg take one map and one policy, not `all`".to_owned(),
        }
        .into());
    };
    let key = EpisodeKey::new(args.seed, Stream::Other, 0);
    let episode = Episode::play(map, *policy, key)?;
    if let Some(file) = &args.record {
        Recording::of(&episode).write(file)?;
    }
    one(args, &episode, "played")
}

/// The worlds that were asked for.
fn maps(args: &PlayArgs) -> anyhow::Result<Vec<EnvironmentConfig>> {
    let names = match args.map.as_str() {
        ALL => registry::map_names(),
        name => vec![name],
    };
    names.into_iter().map(|name| map(args, name)).collect()
}

fn map(args: &PlayArgs, name: &str) -> anyhow::Result<EnvironmentConfig> {
    let quoted = serde_json::to_string(name).context("a name is a string")?;
    let typed = format!("--map {name}");
    let mut builder = ConfigBuilder::new().flag(&typed, &format!("env.map={quoted}"))?;
    for assignment in &args.set {
        builder = builder.set(assignment)?;
    }
    Ok(with_scenario(builder)?.build_environment()?)
}

/// Plays many episodes of each map by each policy, and prints how they went.
fn many(
    args: &PlayArgs,
    maps: &[EnvironmentConfig],
    policies: &[mackrl_env::skirmish::scripted::ScriptedPolicy],
) -> anyhow::Result<()> {
    let meter = Meter::new("episodes");
    let each = usize::try_from(args.episodes.get()).unwrap_or(usize::MAX);
    let total = each.saturating_mul(maps.len() * policies.len());
    let mut rows = Vec::new();
    for map in maps {
        for policy in policies {
            let before = rows.len() * each;
            let summary = play_many(
                map,
                *policy,
                args.seed,
                each,
                args.threads.count(),
                |done| {
                    meter.report(before + done, total);
                },
            )?;
            rows.push(summary);
        }
    }
    match (&rows[..], args.json) {
        ([row], true) => output::print_json(row),
        (rows, true) => output::print_json(&rows),
        (rows, false) => output::print(&Row::table(rows)),
    }
}

/// Draws one episode if asked to, and prints how it went.
fn one(args: &PlayArgs, episode: &Episode, verb: &str) -> anyhow::Result<()> {
    if let Some(file) = &args.svg {
        let step = args.step.unwrap_or(episode.steps.len() / 2);
        if step > episode.steps.len() {
            let message = format!(
                "--step {step} is after the end, expected at most {} in this episode",
                episode.steps.len()
            );
            return Err(Failure::Usage { message }.into());
        }
        let picture = view::picture(episode, step);
        let is_image = file.extension().is_some_and(|name| name == "png");
        let content = if is_image {
            picture.to_png()?
        } else {
            picture.to_svg().into_bytes()
        };
        write(file, &content)?;
    }
    let summary = episode.summary();
    if args.json {
        return output::print_json(&summary);
    }
    output::print(&format!("{verb}: {summary}\n"))
}

fn write(file: &Path, content: &[u8]) -> anyhow::Result<()> {
    std::fs::write(file, content).with_context(|| format!("cannot write {}", file.display()))
}
