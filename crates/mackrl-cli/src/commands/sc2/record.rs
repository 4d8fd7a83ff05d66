//! `mackrl sc2 record`: traces of the real game, one loop a line.

use std::{
    fs::File,
    io::{BufWriter, Write},
    sync::{Arc, Mutex, PoisonError},
};

use anyhow::Context;
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::config::{EnvironmentConfig, StarCraftKind};
use mackrl_sc2::protocol::Unit;
use serde_json::{Value, json};

use super::{
    play,
    worlds::{StarCraftWorld, settings},
};
use crate::{args::RecordArgs, failure::Failure, output, progress::Meter};

/// Plays, and writes every loop down.
pub(super) fn run(args: &RecordArgs) -> anyhow::Result<()> {
    let [policy] = args.policy.policies()[..] else {
        return Err(Failure::Usage {
            message: "--policy takes one policy, not `all`".to_owned(),
        }
        .into());
    };
    let mut map = EnvironmentConfig::new(Arc::new(StarCraftKind));
    map.set("map", args.map.as_str())?;
    map.set(
        "game_version",
        args.game_version.clone().unwrap_or_default(),
    )?;
    let step_mul = map.skirmish_settings()?.1.step_mul;
    let mut environment = StarCraftWorld::new(&map, 1)?.star_craft();
    let cannot = || format!("cannot write {}", args.out.display());
    let mut file = BufWriter::new(File::create(&args.out).with_context(cannot)?);
    let head = json!({
        "format": "mackrl-sc2-trace",
        "version": 1,
        "map": args.map,
        "policy": policy.name(),
        "seed": args.seed,
        "game": settings(map.text("game_version"))?.installation.version(),
        "fields": ["tag", "type", "owner", "x", "y", "facing", "health", "shield", "energy", "cooldown"],
    });
    writeln!(file, "{head}").with_context(cannot)?;
    let lines = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&lines);
    environment.watch(Box::new(move |game_loop, units| {
        let line =
            json!({ "loop": game_loop, "units": units.iter().map(unit).collect::<Vec<_>>() });
        seen.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(line);
    }));
    let meter = Meter::new("episodes");
    let episodes = usize::try_from(args.episodes.get()).unwrap_or(usize::MAX);
    for episode in 0..args.episodes.get() {
        let key = EpisodeKey::new(args.seed, Stream::Other, episode);
        let steps = play::play(&mut environment, &map, policy, key)?;
        // Of an episode that was played twice because the game failed, the last loops are the good ones.
        let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
        let loops = steps * usize::from(step_mul);
        let good = lines.len().saturating_sub(loops);
        writeln!(file, "{}", json!({ "episode": episode, "steps": steps })).with_context(cannot)?;
        for line in lines.drain(..).skip(good) {
            writeln!(file, "{line}").with_context(cannot)?;
        }
        meter.report(usize::try_from(episode + 1).unwrap_or(episodes), episodes);
    }
    file.flush().with_context(cannot)?;
    output::print(&format!(
        "{}: {} episodes of {}\n",
        args.out.display(),
        args.episodes,
        args.map
    ))
}

fn unit(unit: &Unit) -> Value {
    let pos = unit.pos.unwrap_or_default();
    json!([
        unit.tag,
        unit.unit_type,
        unit.owner,
        pos.x,
        pos.y,
        unit.facing,
        unit.health,
        unit.shield,
        unit.energy,
        unit.weapon_cooldown
    ])
}
