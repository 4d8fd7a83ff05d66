//! The training loop: a batch of episodes, an update, now and then a test.

use std::{
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

use mackrl::{
    Error, Moment, Phase, Stopwatch,
    decentralised::Decentralised,
    learner::{Learner, UpdateReport},
    policy::{Behaviour, Recording, Tally},
    rollout::{Episode, Rollout, RolloutSettings},
};
use mackrl_env::{EpisodeKey, Statistic, Stream};

use super::{
    Checkpoint, Evaluation, MetricRow, assembly,
    checkpoint::{Counters, Layouts, State},
    evaluation::Evaluator,
    experience::ExperienceHash,
    read_weights, write_weights,
};
use crate::config::Config;

/// Environments of a shard: half of the paper's eight, so that two cores have one shard each.
const SHARD_SIZE: usize = 4;

/// Trains one team.
pub struct Trainer {
    config: Config,
    world: assembly::World,
    pub(super) policy: Box<dyn Decentralised>,
    pub(super) learner: Learner,
    pub(super) rollout: Rollout,
    pub(super) evaluator: Evaluator,
    steps_env: u64,
    episodes: u64,
    tests: u64,
    experience: ExperienceHash,
    next_test: u64,
    next_row: u64,
    interval: Interval,
    stopwatch: Stopwatch,
}

/// What happened since the last row of metrics.
struct Interval {
    tally: Tally,
    began: Instant,
    /// Environment steps when the interval began; a row after a resumption still tells of the whole interval.
    steps_env: u64,
    /// Environment steps when the clock began: later than `steps_env` after a resumption.
    steps_env_timed: u64,
}

impl Trainer {
    /// Prepares the run that `config` describes. `threads` changes no result.
    ///
    /// # Errors
    /// [`Error::Config`] if the configuration describes nothing that can be trained.
    pub fn new(config: &Config, threads: usize) -> Result<Self, Error> {
        Self::in_world(config, &assembly::World::new(config)?, threads)
    }

    /// As [`Trainer::new`], in a world that need not be the built-in simulator's.
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn in_world(
        config: &Config,
        world: &assembly::World,
        threads: usize,
    ) -> Result<Self, Error> {
        let policy = assembly::policy(config, world)?;
        let environments = world.environments(config.learner.environments);
        let sizes = [world.spec().agents, world.spec().state_size];
        let settings = assembly::learner(config);
        Ok(Self {
            learner: Learner::new(&*policy, sizes, settings, config.run.seed, threads),
            rollout: Rollout::new(&*policy, environments, SHARD_SIZE, threads),
            evaluator: Evaluator::new(&*policy, world, config.test.episodes, threads),
            world: world.clone(),
            policy,
            config: config.clone(),
            steps_env: 0,
            episodes: 0,
            tests: 0,
            experience: ExperienceHash::default(),
            next_test: 0,
            next_row: config.run.metrics_interval_steps_env,
            interval: Interval::new(0),
            stopwatch: Stopwatch::default(),
        })
    }

    /// As [`Self::in_world`], continued where `checkpoint` was taken; see [`Self::restore`]. Nothing large is made before it is
    /// known that the checkpoint holds a policy of the configured size, because both may be a stranger's.
    ///
    /// # Errors
    /// As [`Self::in_world`] and [`Self::restore`].
    pub fn resumed(
        config: &Config,
        world: &assembly::World,
        threads: usize,
        checkpoint: &Checkpoint,
    ) -> Result<Self, Error> {
        let policy = assembly::policy(config, world)?;
        read_weights(policy.layout(), &checkpoint.tensors)?;
        let mut trainer = Self::in_world(config, world, threads)?;
        trainer.restore(checkpoint)?;
        Ok(trainer)
    }

    /// Lets [`Self::update`] give up, with [`Error::Stopped`], as soon as `stop` is set: episodes of large teams, and long tests,
    /// last longer than somebody who wants to stop should wait.
    pub fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.rollout.stop_when(stop);
        self.evaluator.stop_when(stop);
    }

    /// Environment steps so far, summed over the parallel environments.
    #[must_use]
    pub const fn steps_env(&self) -> u64 {
        self.steps_env
    }

    /// Whether the configured number of steps has been played and the last test is done.
    #[must_use]
    pub const fn finished(&self) -> bool {
        self.steps_env >= self.config.run.steps_env && self.next_test > self.steps_env
    }

    /// Plays and learns from one batch of episodes, or plays a test if one is due: before the first batch, at every interval,
    /// and after the last batch. Gives a row of metrics at every test, at every interval between, and after the first batch, which an
    /// untrained team played.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if a number is not finite: one that an environment gives, a logit, a number of the critic's, a
    /// gradient, a moment or a parameter after the step. [`Error::Step`] if a world cannot be played in any more,
    /// [`Error::Stopped`] if asked to stop. The trainer is as it was before then, and can make the same update again.
    pub fn update(&mut self) -> Result<Option<MetricRow>, Error> {
        if self.is_test_due() {
            return self.test().map(Some);
        }
        self.play()?;
        self.learn_from_batch()?;
        Ok(self.row_of_batch())
    }

    /// The weights of the policy and of the critic as safetensors.
    #[must_use]
    pub fn weights(&self) -> Vec<u8> {
        let critic = self.learner.critic();
        write_weights(&[
            (self.policy.layout(), self.learner.parameters()),
            (critic.layout(), critic.parameters()),
        ])
    }

    /// Starts measuring where the time goes; until then, that costs nothing.
    pub fn start_stopwatch(&mut self) {
        self.stopwatch.start();
        self.rollout.stopwatches().for_each(Stopwatch::start);
    }

    /// Where the time since [`Self::start_stopwatch`] went: wall-clock time, that of a rollout divided in the proportions of
    /// what its threads were doing.
    #[must_use]
    pub const fn stopwatch(&self) -> &Stopwatch {
        &self.stopwatch
    }

    /// Updates and tests so far: the number of times that [`update`](Self::update) went well in this run, resumptions included.
    #[must_use]
    pub const fn iterations(&self) -> u64 {
        self.learner.updates() + self.tests
    }

    /// Hash of all states and rewards of the training episodes so far: once two runs differ in it, they do so for ever.
    #[must_use]
    pub const fn experience_hash(&self) -> u64 {
        self.experience.0
    }

    /// Training episodes before the latest batch.
    pub(super) const fn episodes_before_batch(&self) -> u64 {
        self.episodes.saturating_sub(self.batch())
    }

    /// Everything that the rest of the run depends on, the configuration aside.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        let state = State {
            learner: self.learner.state(),
            counters: Counters {
                steps_env: self.steps_env,
                episodes: self.episodes,
                tests: self.tests,
                experience_hash: self.experience.0,
                next_test: self.next_test,
                next_row: self.next_row,
                interval_steps_env: self.interval.steps_env,
                interval: self.interval.tally.clone(),
            },
        };
        Checkpoint::write(&self.layouts(), &state)
    }

    /// Continues where `checkpoint` was taken: what follows is the same to the byte as if there had been no interruption.
    ///
    /// # Errors
    /// [`Error::Data`] if the checkpoint is damaged or belongs to another configuration. Nothing has changed then.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), Error> {
        let State { learner, counters } = checkpoint.read(&self.layouts())?;
        self.learner.restore(&*self.policy, learner);
        self.steps_env = counters.steps_env;
        self.episodes = counters.episodes;
        self.tests = counters.tests;
        self.experience = ExperienceHash(counters.experience_hash);
        self.next_test = counters.next_test;
        self.next_row = counters.next_row;
        self.interval = Interval {
            tally: counters.interval,
            steps_env: counters.interval_steps_env,
            ..Interval::new(counters.steps_env)
        };
        Ok(())
    }

    fn layouts(&self) -> Layouts<'_> {
        Layouts {
            policy: self.policy.layout(),
            critic: self.learner.critic().layout(),
            optimiser: assembly::learner(&self.config).optimiser,
            statistics: &self.world.spec().statistics,
        }
    }

    /// Whether the next iteration is a test.
    pub(super) const fn is_test_due(&self) -> bool {
        self.steps_env >= self.next_test
    }

    /// What a number that is not finite is dated with.
    const fn moment(&self) -> Moment {
        Moment {
            update: self.learner.updates(),
            steps_env: self.steps_env,
        }
    }

    /// ε of the bounded softmax now: it falls linearly with the environment steps.
    fn exploration(&self) -> f64 {
        let schedule = &self.config.exploration;
        let progress = (self.steps_env as f64 / schedule.steps_env as f64).min(1.0);
        schedule.start + (schedule.finish - schedule.start) * progress
    }

    /// Plays a batch of training episodes.
    pub(super) fn play(&mut self) -> Result<(), Error> {
        let settings = RolloutSettings {
            behaviour: Behaviour::sampled(self.exploration()),
            recording: Recording::ForLearning,
        };
        let moment = self.moment();
        let seed = self.config.run.seed;
        let keys: Vec<EpisodeKey> = (self.episodes..self.episodes + self.batch())
            .map(|episode| EpisodeKey::new(seed, Stream::Training, episode))
            .collect();
        self.stopwatch.lap(Phase::Other);
        self.rollout
            .play(self.learner.weights(), &keys, settings)
            .map_err(|error| dated(error, moment))?;
        self.stopwatch.lap_shared_by(self.rollout.stopwatches());
        Ok(())
    }

    /// Learns from the batch that was played last.
    pub(super) fn learn_from_batch(&mut self) -> Result<(), Error> {
        let (exploration, moment) = (self.exploration(), self.moment());
        let batches = self.rollout.batches().collect();
        self.stopwatch.lap(Phase::Other);
        let report = self
            .learner
            .update(&*self.policy, batches, &mut self.stopwatch)
            .map_err(|broken| dated(broken.into(), moment))?;
        self.episodes += self.batch();
        for episode in self.rollout.batches().flat_map(|batch| &batch.episodes) {
            self.steps_env += episode.steps() as u64;
            self.experience.add(episode);
            self.interval
                .note_episode(episode, &self.world.spec().statistics);
        }
        self.interval.note_update(&report, exploration);
        self.interval.tally.merge(&self.rollout.tally());
        Ok(())
    }

    /// The row that is due after a batch, if one is; a test, which is due after the last batch, gives its own.
    pub(super) fn row_of_batch(&mut self) -> Option<MetricRow> {
        if self.steps_env >= self.config.run.steps_env {
            self.next_test = self.steps_env;
        }
        let is_due = self.steps_env >= self.next_row && !self.is_test_due();
        is_due.then(|| self.row())
    }

    /// Episodes of a batch.
    const fn batch(&self) -> u64 {
        self.config.learner.environments as u64
    }

    /// Plays greedy test episodes.
    fn test(&mut self) -> Result<MetricRow, Error> {
        self.stopwatch.lap(Phase::Other);
        let moment = self.moment();
        let test = &self.config.test;
        let (seed, first) = (self.config.run.seed, self.tests * test.episodes as u64);
        let evaluation = self
            .evaluator
            .play(self.learner.weights(), test.episodes, |episode| {
                EpisodeKey::new(seed, Stream::Test, first + episode)
            })
            .map_err(|error| dated(error, moment))?;
        self.stopwatch.lap(Phase::Test);
        self.tests += 1;
        self.next_test = (self.steps_env / test.interval_steps_env + 1) * test.interval_steps_env;
        let mut row = self.row();
        append_test(&mut row, &evaluation);
        Ok(row)
    }

    /// Everything since the last row.
    fn row(&mut self) -> MetricRow {
        let interval = std::mem::replace(&mut self.interval, Interval::new(self.steps_env));
        let every = self.config.run.metrics_interval_steps_env;
        self.next_row = match self.steps_env {
            0 => 1,
            played => (played / every + 1) * every,
        };
        let mut row = MetricRow::default();
        row.push_count("t_env", self.steps_env);
        row.push_count("episode", self.episodes);
        row.push_count("update", self.learner.updates());
        row.set_experience_hash(self.experience.0);
        interval
            .tally
            .means()
            .for_each(|(name, mean)| row.push(name, mean));
        let played = (self.steps_env - interval.steps_env_timed) as f64;
        if played > 0.0 {
            row.push(
                "sys/sps",
                played / interval.began.elapsed().as_secs_f64().max(1e-9),
            );
        }
        let discarded = self.rollout.discarded() + self.evaluator.discarded();
        if discarded > 0 {
            row.push_count("sys/episodes_discarded", discarded);
        }
        for counter in self.world.source().counters() {
            row.push_count(format!("sys/{}", counter.name), counter.value);
        }
        row
    }
}

/// The error with the moment of training at which it came, if it is a number that is not finite.
fn dated(error: Error, moment: Moment) -> Error {
    match error {
        Error::NotFinite(broken) => broken.at(moment).into(),
        other => other,
    }
}

impl Interval {
    fn new(steps_env: u64) -> Self {
        Self {
            tally: Tally::default(),
            began: Instant::now(),
            steps_env,
            steps_env_timed: steps_env,
        }
    }

    fn note_episode(&mut self, episode: &Episode, statistics: &[Statistic]) {
        let tally = &mut self.tally;
        tally.add("return_mean", episode.total_reward(), 1.0);
        tally.add("ep_length_mean", episode.steps() as f64, 1.0);
        for (statistic, value) in statistics.iter().zip(&episode.statistics_s) {
            tally.add(format!("{}_mean", statistic.name), *value, 1.0);
        }
    }

    fn note_update(&mut self, report: &UpdateReport, exploration: f64) {
        let mut add = |name: &str, value: f64| self.tally.add(name, value, 1.0);
        add("epsilon", exploration);
        add("pg_loss", report.policy_loss);
        add("agent_grad_norm", report.policy_gradient_norm);
        add("advantage_mean", report.advantage_mean);
        add("critic_loss", report.critic.loss);
        add("critic_grad_norm", report.critic.gradient_norm);
        add("td_error_abs", report.critic.td_error_abs);
        add("target_mean", report.critic.target_mean);
    }
}

fn append_test(row: &mut MetricRow, evaluation: &Evaluation) {
    for quantity in &evaluation.quantities {
        row.push(format!("test_{}_mean", quantity.name), quantity.mean);
    }
    let delegation = evaluation.controllers.iter();
    for (name, value) in delegation.filter(|(name, _)| name.contains("delegation")) {
        row.push(format!("test_{name}"), *value);
    }
}

impl std::fmt::Debug for Trainer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Trainer")
            .field("config", &self.config)
            .field("steps_env", &self.steps_env)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_that_is_given_up_leaves_no_trace() {
        let mut config = Config::default();
        config.policy.hidden = 3;
        config.learner.environments = 2;
        config.test.episodes = 2;
        let mut trainer = Trainer::new(&config, 1).unwrap();
        let stop = Arc::default();
        trainer.stop_when(&stop);
        let mut undisturbed = Trainer::new(&config, 1).unwrap();
        // A test, and two updates.
        for _ in 0..3 {
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
            let before = trainer.checkpoint();
            assert!(matches!(trainer.update(), Err(Error::Stopped)));
            assert!(trainer.checkpoint() == before);
            stop.store(false, std::sync::atomic::Ordering::Relaxed);
            trainer.update().unwrap();
            undisturbed.update().unwrap();
            assert!(trainer.checkpoint() == undisturbed.checkpoint());
        }
    }

    #[test]
    fn exploration_falls_linearly_and_then_stays() {
        let mut config = Config::default();
        config.policy.hidden = 2;
        let mut trainer = Trainer::new(&config, 1).unwrap();
        for (steps, expected) in [(0, 0.5), (12_500, 0.3775), (50_000, 0.01), (70_000, 0.01)] {
            trainer.steps_env = steps;
            let found = trainer.exploration();
            assert!((found - expected).abs() < 1e-12, "{steps}: {found}");
        }
    }
}
