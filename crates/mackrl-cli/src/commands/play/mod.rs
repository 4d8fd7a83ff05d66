//! `mackrl play`: scripted teams, one episode or many.

mod statistics;

use anyhow::Context;
use mackrl::{
    config::{ConfigBuilder, Engine, EnvironmentConfig},
    replay::record_script,
};
use mackrl_env::{EpisodeKey, Stream, registry};

use crate::{
    args::{PlayArgs, with_scenario},
    commands::sc2,
    failure::Failure,
    output,
    replay::{Opened, Summary},
    reproduce::Meter,
};
use statistics::{Row, play_many};

/// The word that stands for every map.
const ALL: &str = "all";

/// Plays, and prints or keeps what happened.
pub(crate) fn run(args: &PlayArgs) -> anyhow::Result<()> {
    let maps = maps(args)?;
    let policies = args.policy.policies();
    let Some(file) = &args.save_replay else {
        return many(args, &maps, &policies);
    };
    let ([map], [policy]) = (&maps[..], &policies[..]) else {
        return Err(Failure::Usage {
            message: "--save-replay takes one map and one policy, not `all`".to_owned(),
        }
        .into());
    };
    let key = EpisodeKey::new(args.seed, Stream::Other, 0);
    if map.engine == Engine::Sc2 {
        return sc2::play_one(args, map, *policy, key);
    }
    let replay = record_script(map, *policy, key)?;
    output::write_file(file, &replay.to_bytes())?;
    let summary = Summary::of(&Opened::of(replay)?);
    if args.json {
        output::print_json(&summary)
    } else {
        output::print(&format!("played: {summary}\n"))
    }
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
    let typed = format!("--env {}", args.env);
    builder = builder.flag(&typed, &format!("env.engine={}", args.env))?;
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
