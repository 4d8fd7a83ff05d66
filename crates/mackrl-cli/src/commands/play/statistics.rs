//! Many episodes on many threads, and their means.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use mackrl_env::{Action, Environment, EpisodeKey, Observations, StepError, Stream, World};
use mackrl_run::config::EnvironmentConfig;
use mackrl_skirmish::{
    BattleStatistics,
    scripted::{ScriptedPolicy, ScriptedTeam},
};
use serde::Serialize;

use crate::{commands::sc2, output};

/// Episodes that a thread takes at once.
const PORTION: usize = 16;
/// What is averaged: won, return, length, allies lost, enemies lost, out of time.
type Outcome = [f64; 6];

/// Means over the episodes of one map and one policy, each with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    map: String,
    policy: &'static str,
    episodes: usize,
    seed: u64,
    battle_won_mean: f64,
    battle_won_sem: f64,
    return_mean: f64,
    return_sem: f64,
    ep_length_mean: f64,
    ep_length_sem: f64,
    dead_allies_mean: f64,
    dead_allies_sem: f64,
    dead_enemies_mean: f64,
    dead_enemies_sem: f64,
    timed_out_mean: f64,
    timed_out_sem: f64,
}

/// Plays episodes 0 to `episodes` of `map` by `policy`; `report` hears how many are done. `threads` changes no result.
pub(super) fn play_many(
    map: &EnvironmentConfig,
    policy: ScriptedPolicy,
    seed: u64,
    episodes: usize,
    threads: usize,
    report: impl Fn(usize) + Sync,
) -> anyhow::Result<Row> {
    let portions = episodes.div_ceil(PORTION);
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let finished = Mutex::new(Vec::new());
    let world = sc2::world_of(map)?;
    std::thread::scope(|scope| {
        let work = || -> anyhow::Result<()> {
            let mut player = Player::new(map, policy, &*world)?;
            loop {
                let portion = next.fetch_add(1, Ordering::Relaxed);
                if portion >= portions {
                    return Ok(());
                }
                let mut sums = Sums::default();
                for episode in portion * PORTION..((portion + 1) * PORTION).min(episodes) {
                    sums.add(player.play(EpisodeKey::new(seed, Stream::Other, episode as u64))?);
                    report(done.fetch_add(1, Ordering::Relaxed) + 1);
                }
                let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
                finished.push((portion, sums));
            }
        };
        let workers: Vec<_> = (0..threads.clamp(1, portions.max(1)))
            .map(|_| scope.spawn(work))
            .collect();
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().expect("a player does not panic"))
    })?;
    let mut finished = finished
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    // Sums of floats depend on their order.
    finished.sort_by_key(|(portion, _)| *portion);
    let mut sums = Sums::default();
    finished.iter().for_each(|(_, part)| sums.merge(part));
    Ok(Row::new(map, policy, seed, &sums))
}

/// One thread's world and team.
struct Player {
    environment: Box<dyn Environment>,
    team: ScriptedTeam,
    observations: Observations,
    actions: Vec<Action>,
}

impl Player {
    fn new(
        map: &EnvironmentConfig,
        policy: ScriptedPolicy,
        world: &dyn World,
    ) -> anyhow::Result<Self> {
        let environment = world.make();
        // Scripts know a map by its skirmish, whoever plays it.
        let team = ScriptedTeam::new(policy, &map.simulated().skirmish()?);
        Ok(Self {
            team,
            observations: Observations::new(environment.spec(), 1),
            actions: vec![Action::default(); environment.spec().agents],
            environment,
        })
    }

    /// Plays an episode, again from its beginning if the world fails under it.
    fn play(&mut self, key: EpisodeKey) -> anyhow::Result<Outcome> {
        loop {
            match self.attempt(key) {
                Err(StepError::Interrupted(failure)) if failure.can_be_repeated => {}
                outcome => return Ok(outcome.map_err(mackrl::Error::from)?),
            }
        }
    }

    fn attempt(&mut self, key: EpisodeKey) -> Result<Outcome, StepError> {
        self.environment
            .reset(key, &mut self.observations.row_mut(0));
        let mut total = 0.0;
        let mut step = 0;
        loop {
            self.team
                .act(&self.observations, 0, (key, step), &mut self.actions);
            let row = &mut self.observations.row_mut(0);
            let time_step = self.environment.step(&self.actions, row)?;
            total += f64::from(time_step.reward);
            step += 1;
            if time_step.end.is_some() {
                break;
            }
        }
        let mut statistics_s = [0.0; BattleStatistics::COUNT];
        self.environment.statistics(&mut statistics_s);
        let [battle_won, dead_allies, dead_enemies, timed_out] = statistics_s;
        let length = step as f64;
        Ok([
            battle_won,
            total,
            length,
            dead_allies,
            dead_enemies,
            timed_out,
        ])
    }
}

/// Sums of outcomes and of their squares.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    first: Outcome,
    second: Outcome,
}

impl Sums {
    fn add(&mut self, outcome: Outcome) {
        self.count += 1.0;
        for (index, value) in outcome.into_iter().enumerate() {
            self.first[index] += value;
            self.second[index] += value * value;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for index in 0..self.first.len() {
            self.first[index] += other.first[index];
            self.second[index] += other.second[index];
        }
    }

    /// Mean and standard error of quantity `index`; the error of a single episode is not known and counted as 0.
    fn mean(&self, index: usize) -> [f64; 2] {
        let mean = self.first[index] / self.count;
        let spread = (self.second[index] - self.count * mean * mean).max(0.0);
        let variance = spread / (self.count - 1.0).max(1.0);
        [mean, (variance / self.count).sqrt()]
    }
}

impl Row {
    fn new(map: &EnvironmentConfig, policy: ScriptedPolicy, seed: u64, sums: &Sums) -> Self {
        let [won, total, length, allies, enemies, late] =
            [0, 1, 2, 3, 4, 5].map(|index| sums.mean(index));
        Self {
            map: map.map().to_owned(),
            policy: policy.name(),
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a count of episodes"
            )]
            episodes: sums.count as usize,
            seed,
            battle_won_mean: won[0],
            battle_won_sem: won[1],
            return_mean: total[0],
            return_sem: total[1],
            ep_length_mean: length[0],
            ep_length_sem: length[1],
            dead_allies_mean: allies[0],
            dead_allies_sem: allies[1],
            dead_enemies_mean: enemies[0],
            dead_enemies_sem: enemies[1],
            timed_out_mean: late[0],
            timed_out_sem: late[1],
        }
    }

    /// The map that was played.
    pub(super) fn map(&self) -> &str {
        &self.map
    }

    /// Who played.
    pub(super) const fn policy(&self) -> &'static str {
        self.policy
    }

    /// Share of battles won, with its error.
    pub(super) fn won(&self) -> String {
        with_error(self.battle_won_mean, self.battle_won_sem, 3)
    }

    /// Return of an episode, with its error.
    pub(super) fn total(&self) -> String {
        with_error(self.return_mean, self.return_sem, 2)
    }

    /// One line for each row, under a heading.
    pub(super) fn table(rows: &[Self]) -> String {
        let heading = [
            "map",
            "policy",
            "won",
            "return",
            "length",
            "allies lost",
            "enemies lost",
            "out of time",
        ];
        let mut cells = vec![heading.map(str::to_owned).to_vec()];
        cells.extend(rows.iter().map(|row| {
            vec![
                row.map.clone(),
                row.policy.to_owned(),
                row.won(),
                row.total(),
                with_error(row.ep_length_mean, row.ep_length_sem, 1),
                with_error(row.dead_allies_mean, row.dead_allies_sem, 2),
                with_error(row.dead_enemies_mean, row.dead_enemies_sem, 2),
                with_error(row.timed_out_mean, row.timed_out_sem, 3),
            ]
        }));
        output::table(&cells)
    }
}

fn with_error(mean: f64, error: f64, digits: usize) -> String {
    format!("{mean:.digits$} ± {error:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_and_its_error_are_those_of_the_textbook() {
        let mut sums = Sums::default();
        for value in [1.0, 2.0, 6.0] {
            sums.add([value; 6]);
        }
        let [mean, error] = sums.mean(2);
        assert!((mean - 3.0).abs() < 1e-12, "{mean}");
        assert!((error - (7.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{error}");
    }

    #[test]
    fn threads_change_no_result() {
        let map = mackrl_run::config::Config::default().env;
        let play = |threads| play_many(&map, ScriptedPolicy::Random, 3, 37, threads, |_| {});
        assert_eq!(play(1).unwrap(), play(3).unwrap());
    }
}
