//! `mackrl bench`: how fast this machine is.

use std::time::{Duration, Instant};

use mackrl::config::ConfigBuilder;
use mackrl_env::{Action, AgentId, Draw, Environment, EpisodeKey, Observations, Stream};
use serde::Serialize;

use crate::{
    args::{BenchArgs, BenchCommand, BenchEnvironmentArgs, with_scenario},
    output,
};

/// Equal parts of which the fastest is reported beside the whole.
const PARTS: u64 = 5;

#[derive(Debug, Serialize)]
struct EnvironmentSpeed {
    map: String,
    steps: u64,
    episodes: u64,
    wall_s: f64,
    steps_per_s: f64,
    steps_per_s_best_part: f64,
}

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    match &args.command {
        BenchCommand::Env(args) => environment(args),
    }
}

fn environment(args: &BenchEnvironmentArgs) -> anyhow::Result<()> {
    let typed = format!("--map {}", args.map);
    let layers = ConfigBuilder::new().flag(&typed, &format!("env.map={}", args.map))?;
    let config = with_scenario(layers)?.build()?;
    let speed = measure(config.env.make()?, args.steps.get())?;
    if args.json {
        return output::print_json(&speed);
    }
    let rows = [
        ("map", speed.map.clone()),
        ("environment steps", speed.steps.to_string()),
        ("episodes", speed.episodes.to_string()),
        ("seconds", format!("{:.3}", speed.wall_s)),
        ("steps a second", format!("{:.0}", speed.steps_per_s)),
        (
            "steps a second, best part",
            format!("{:.0}", speed.steps_per_s_best_part),
        ),
    ];
    let rows = rows.map(|(name, value)| vec![name.to_owned(), value]);
    output::print(&output::table(&rows))
}

fn measure(environment: Box<dyn Environment>, steps: u64) -> anyhow::Result<EnvironmentSpeed> {
    let mut play = RandomPlay::new(environment);
    let mut parts = Vec::new();
    for part in 0..PARTS {
        let steps = (part + 1) * steps / PARTS - part * steps / PARTS;
        let start = Instant::now();
        for _ in 0..steps {
            play.step()?;
        }
        parts.push((steps, start.elapsed()));
    }
    let wall: Duration = parts.iter().map(|(_, wall)| wall).sum();
    let rate = |steps: u64, wall: Duration| steps as f64 / wall.as_secs_f64().max(1e-9);
    Ok(EnvironmentSpeed {
        map: play.environment.spec().name.clone(),
        steps,
        episodes: play.episode + 1,
        wall_s: wall.as_secs_f64(),
        steps_per_s: rate(steps, wall),
        steps_per_s_best_part: parts
            .iter()
            .map(|&(steps, wall)| rate(steps, wall))
            .fold(0.0, f64::max),
    })
}

/// Episodes of random available actions, one after the other.
struct RandomPlay {
    environment: Box<dyn Environment>,
    observations: Observations,
    actions: Vec<Action>,
    episode: u64,
    step: usize,
}

impl RandomPlay {
    fn new(environment: Box<dyn Environment>) -> Self {
        let spec = environment.spec();
        let mut play = Self {
            observations: Observations::new(spec, 1),
            actions: vec![Action::default(); spec.agents],
            environment,
            episode: 0,
            step: 0,
        };
        play.reset();
        play
    }

    fn key(&self) -> EpisodeKey {
        EpisodeKey::new(1, Stream::Other, self.episode)
    }

    fn reset(&mut self) {
        self.step = 0;
        self.environment
            .reset(self.key(), &mut self.observations.row_mut(0));
    }

    fn step(&mut self) -> Result<(), mackrl_env::IllegalAction> {
        let key = self.key();
        for (agent, action) in self.actions.iter_mut().enumerate() {
            let view = self.observations.local_view(0, AgentId::new(agent));
            let bits = key.bits(self.step, Draw::Agent(agent));
            *action = any_available(view.available(), bits);
        }
        let time_step = self
            .environment
            .step(&self.actions, &mut self.observations.row_mut(0))?;
        self.step += 1;
        if time_step.end.is_some() {
            self.episode += 1;
            self.reset();
        }
        Ok(())
    }
}

/// The available action that `bits` choose; no less even than 64 bits allow.
fn any_available(available_a: &[bool], bits: u64) -> Action {
    let count = available_a.iter().filter(|&&available| available).count();
    let chosen = usize::try_from(bits % count.max(1) as u64).unwrap_or(0);
    let action = available_a
        .iter()
        .enumerate()
        .filter(|(_, available)| **available)
        .nth(chosen)
        .map_or(0, |(action, _)| action);
    Action::new(action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_available_actions_are_chosen_and_all_of_them() {
        let available_a = [false, true, false, true, true];
        let chosen: Vec<usize> = (0..3)
            .map(|bits| any_available(&available_a, bits).index())
            .collect();
        assert_eq!(chosen, [1, 3, 4]);
    }
}
