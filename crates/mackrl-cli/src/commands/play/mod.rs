//! `mackrl play`: scripted teams, one episode or many.

mod report;
mod statistics;

use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::{ConfigBuilder, EnvironmentConfig},
    replay::{Replay, record_script},
};
use report::Report;
use statistics::{Row, play_many};

use crate::{
    args::{PlayArgs, world},
    commands::sc2,
    failure::Failure,
    output,
    progress::Meter,
    replay::{Opened, picture},
};

/// The word that stands for every map.
const ALL: &str = "all";

/// Plays, and prints or keeps what happened.
pub(crate) fn run(args: &PlayArgs) -> anyhow::Result<()> {
    let maps = maps(args)?;
    let policies = args.policy.policies();
    let kept = match (&args.save_replay, &args.svg) {
        (None, None) => return many(args, &maps, &policies),
        (Some(_), _) => "--save-replay",
        (None, Some(_)) => "--svg",
    };
    let ([map], [policy]) = (&maps[..], &policies[..]) else {
        return Err(
            Failure::usage(format!("{kept} takes one map and one policy, not `all`")).into(),
        );
    };
    let key = EpisodeKey::new(args.seed, Stream::Other, 0);
    if map.is_star_craft() {
        if args.svg.is_some() {
            return Err(Failure::usage(
                "--svg draws battles of the simulator, and StarCraft II keeps its own replays",
            )
            .into());
        }
        return sc2::play_one(args, map, *policy, key);
    }
    one(args, record_script(map, *policy, key)?)
}

/// Keeps one episode as a replay, as a picture or as both, and prints how it went.
fn one(args: &PlayArgs, replay: Replay) -> anyhow::Result<()> {
    if let Some(file) = &args.save_replay {
        output::write_file(file, &replay.to_bytes())?;
    }
    let opened = Opened::of(replay)?;
    if let Some(file) = &args.svg {
        let step = opened.check_step(args.step.unwrap_or(opened.playback.steps() / 2))?;
        output::write_file(file, picture(&opened, step, &[]).to_svg().as_bytes())?;
    }
    let summary = opened.summary();
    if args.json {
        output::print_json(&summary)
    } else {
        output::print(&format!("played: {summary}\n"))
    }
}

/// The worlds that were asked for.
fn maps(args: &PlayArgs) -> anyhow::Result<Vec<EnvironmentConfig>> {
    let names = match args.map.as_str() {
        ALL => mackrl_skirmish::map_names(),
        name => vec![name],
    };
    let map = |name: &str| {
        let typed = format!("--env {}", args.env);
        let kind = ConfigBuilder::new(crate::registry());
        let kind = kind.flag(&typed, &format!("env.name={}", args.env))?;
        world(kind, &format!("--map {name}"), name, &args.set)
    };
    names.into_iter().map(map).collect()
}

/// Plays many episodes of each map by each policy, and prints how they went.
fn many(
    args: &PlayArgs,
    maps: &[EnvironmentConfig],
    policies: &[mackrl_skirmish::scripted::ScriptedPolicy],
) -> anyhow::Result<()> {
    if let Some(folder) = &args.out {
        report::make_folder(folder)?;
    }
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
    if let Some(folder) = &args.out {
        Report::new(args.command(folder), &rows).write(folder)?;
    }
    match (&rows[..], args.json) {
        ([row], true) => output::print_json(row),
        (rows, true) => output::print_json(&rows),
        (rows, false) => output::print(&Row::table(rows)),
    }
}
