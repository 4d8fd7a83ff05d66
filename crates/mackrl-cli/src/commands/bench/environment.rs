//! `mackrl bench env`: environment steps a second.

use std::time::{Duration, Instant};

use mackrl::nn::InstructionSet;
use mackrl_env::{StepError, random_play::RandomPlay};
use mackrl_run::config::ConfigBuilder;
use serde::Serialize;

use super::print_rows;
use crate::{
    args::{BenchEnvironmentArgs, world},
    output,
};

/// Equal parts of which the fastest is reported beside the whole.
const PARTS: u64 = 5;

#[derive(Debug, Serialize)]
struct EnvironmentSpeed {
    map: String,
    simd: &'static str,
    threads: usize,
    steps: u64,
    episodes: u64,
    wall_s: f64,
    env_steps_per_s: f64,
    env_steps_per_s_best_part: f64,
}

/// One thread's environment, and how its latest part went.
struct Player {
    play: RandomPlay,
    outcome: Result<(), StepError>,
}

pub(super) fn run(args: &BenchEnvironmentArgs) -> anyhow::Result<()> {
    let world = world(
        ConfigBuilder::new(crate::registry()),
        &format!("--map {}", args.map),
        &args.map,
        &[],
    )?;
    let players = (0..args.threads.get() as u64).map(|seed| {
        Ok(Player {
            play: RandomPlay::new(world.world()?.make(), seed),
            outcome: Ok(()),
        })
    });
    let players = players.collect::<Result<Vec<_>, mackrl::Error>>()?;
    let speed = measure(players, args.steps.get(), InstructionSet::chosen()?)?;
    if args.json {
        return output::print_json(&speed);
    }
    print_rows(&[
        ("map", speed.map),
        ("threads", speed.threads.to_string()),
        ("environment steps", speed.steps.to_string()),
        ("episodes", speed.episodes.to_string()),
        ("seconds", format!("{:.3}", speed.wall_s)),
        ("steps a second", format!("{:.0}", speed.env_steps_per_s)),
        (
            "steps a second, best part",
            format!("{:.0}", speed.env_steps_per_s_best_part),
        ),
    ])
}

fn measure(
    mut players: Vec<Player>,
    steps: u64,
    instructions: InstructionSet,
) -> Result<EnvironmentSpeed, StepError> {
    let mut parts = Vec::new();
    for part in 0..PARTS {
        let steps = share(steps, part, PARTS);
        let start = Instant::now();
        play_together(&mut players, steps)?;
        parts.push((steps, start.elapsed()));
    }
    let wall: Duration = parts.iter().map(|(_, wall)| wall).sum();
    let rate = |steps: u64, wall: Duration| steps as f64 / wall.as_secs_f64().max(1e-9);
    let rates = parts.iter().map(|&(steps, wall)| rate(steps, wall));
    Ok(EnvironmentSpeed {
        map: players[0].play.environment().spec().name.clone(),
        simd: instructions.name(),
        threads: players.len(),
        steps,
        episodes: players.iter().map(|player| player.play.episodes()).sum(),
        wall_s: wall.as_secs_f64(),
        env_steps_per_s: rate(steps, wall),
        env_steps_per_s_best_part: rates.fold(0.0, f64::max),
    })
}

/// Plays `steps` steps in all, each player on a thread of its own.
fn play_together(players: &mut [Player], steps: u64) -> Result<(), StepError> {
    let threads = players.len() as u64;
    std::thread::scope(|scope| {
        for (player, thread) in players.iter_mut().zip(0..) {
            scope.spawn(move || {
                player.outcome = (0..share(steps, thread, threads))
                    .try_for_each(|_| player.play.step().map(drop));
            });
        }
    });
    players
        .iter_mut()
        .try_for_each(|player| std::mem::replace(&mut player.outcome, Ok(())))
}

/// Share number `index` of `total` things dealt out to `parts`.
const fn share(total: u64, index: u64, parts: u64) -> u64 {
    (index + 1) * total / parts - index * total / parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_differ_by_one_at_most_and_add_up() {
        let shares: Vec<u64> = (0..5).map(|part| share(13, part, 5)).collect();
        assert_eq!(shares.iter().sum::<u64>(), 13);
        assert!(shares.iter().all(|s| [2, 3].contains(s)), "{shares:?}");
    }
}
