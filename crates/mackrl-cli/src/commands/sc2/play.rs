//! One scripted episode on StarCraft II, and the game's own replay of it.

use anyhow::Context;
use mackrl_env::{Action, Environment, EpisodeKey, Observations, StepError};
use mackrl_run::config::EnvironmentConfig;
use mackrl_sc2::adapter::StarCraft2;
use mackrl_skirmish::{
    BattleStatistics,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

use super::worlds::StarCraftWorld;
use crate::{args::PlayArgs, output};

/// Plays one episode, writes the game's replay, and says how it went.
pub(crate) fn play_one(
    args: &PlayArgs,
    map: &EnvironmentConfig,
    policy: ScriptedPolicy,
    key: EpisodeKey,
) -> anyhow::Result<()> {
    let mut environment = StarCraftWorld::new(map, 1)?.star_craft();
    environment.keep_replays();
    let steps = play(&mut environment, map, policy, key)?;
    if let Some(file) = &args.save_replay {
        let replay = environment
            .take_replay()
            .context("the game gave no replay")?;
        std::fs::write(file, replay).with_context(|| format!("cannot write {}", file.display()))?;
    }
    let BattleStatistics {
        battle_won,
        dead_allies,
        dead_enemies,
        timed_out,
    } = environment.battle_statistics();
    if args.json {
        return output::print_json(&serde_json::json!({
            "map": map.map(),
            "policy": policy.name(),
            "seed": key.seed,
            "episode": key.episode,
            "battle_won": battle_won,
            "ep_length": steps,
            "dead_allies": dead_allies,
            "dead_enemies": dead_enemies,
            "timed_out": timed_out,
        }));
    }
    let outcome = mackrl_run::replay::outcome_in_words(battle_won, timed_out);
    output::print(&format!(
        "played: {} on StarCraft II by {}, {outcome} after {steps} steps, allies lost: {dead_allies}, enemies lost: {dead_enemies}\n",
        map.map(),
        policy.name()
    ))
}

/// Plays the episode `key`, again from its beginning if the game fails under it; gives its length in steps.
pub(super) fn play(
    environment: &mut StarCraft2,
    map: &EnvironmentConfig,
    policy: ScriptedPolicy,
    key: EpisodeKey,
) -> anyhow::Result<usize> {
    let mut team = ScriptedTeam::new(policy, &map.simulated().skirmish()?);
    loop {
        match attempt(environment, &mut team, key) {
            Err(StepError::Interrupted(failure)) if failure.can_be_repeated => {}
            outcome => return Ok(outcome.map_err(mackrl::Error::from)?),
        }
    }
}

fn attempt(
    environment: &mut StarCraft2,
    team: &mut ScriptedTeam,
    key: EpisodeKey,
) -> Result<usize, StepError> {
    let mut observations = Observations::new(environment.spec(), 1);
    let mut actions = vec![Action::default(); environment.spec().agents];
    environment.reset(key, &mut observations.row_mut(0));
    for step in 0.. {
        team.act(&observations, 0, (key, step), &mut actions);
        let time_step = environment.step(&actions, &mut observations.row_mut(0))?;
        if time_step.end.is_some() {
            return Ok(step + 1);
        }
    }
    Ok(0)
}
