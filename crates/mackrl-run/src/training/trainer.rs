//! The training loop: a batch of episodes, an update, now and then a test.

use std::sync::{Arc, atomic::AtomicBool};

use mackrl::{
    Error, Moment, Phase, Stopwatch,
    algorithms::Algorithm,
    experience::{Collector, Episode, Piece, PlaySettings},
    nn::ParameterLayout,
    policy::Recording,
};
use mackrl_env::{EnvironmentSpec, EpisodeKey, Stream};

use super::{
    Checkpoint, Evaluation, MetricRow, Score, StoredWeights, Teams, assembly,
    checkpoint::Counters,
    description::{description, with_description},
    evaluation::Evaluator,
    experience::ExperienceHash,
    interval::Interval,
    metrics::is_explained,
    teams::{Best, episodes_of_judgement},
    write_weights,
};
use crate::{config::Config, provenance::sha256};

/// Trains one team.
pub struct Trainer {
    config: Config,
    world: assembly::RunWorld,
    algorithm: Box<dyn Algorithm>,
    collector: Collector,
    evaluator: Evaluator,
    steps_env: u64,
    episodes: u64,
    tests: u64,
    experience: ExperienceHash,
    next_test: u64,
    next_row: u64,
    interval: Interval,
    best: Option<Best>,
    stopwatch: Stopwatch,
}

impl Trainer {
    /// Prepares the run that `config` describes. `threads` changes no result.
    ///
    /// # Errors
    /// [`Error::Config`] if the configuration describes nothing that can be trained.
    pub fn new(config: &Config, threads: usize) -> Result<Self, Error> {
        Self::in_world(config, &assembly::RunWorld::new(config)?, threads)
    }

    /// As [`Trainer::new`], in a world that need not be the built-in simulator's.
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn in_world(
        config: &Config,
        world: &assembly::RunWorld,
        threads: usize,
    ) -> Result<Self, Error> {
        if !config.run.initial_weights.is_empty() {
            return Err(Error::Config(format!(
                "the run begins with the weights of SHA-256 {}, which are not given: `mackrl train --from` gives them",
                config.run.initial_weights
            )));
        }
        let algorithm = assembly::algorithm(config, world, threads)?;
        Self::of(algorithm, config, world, threads)
    }

    /// As [`Trainer::in_world`], of a team that begins with `weights`, a safetensors file of which the configuration has the hash.
    ///
    /// # Errors
    /// As [`Trainer::in_world`], and [`Error::Data`] if the weights are others, or those of another kind of team.
    pub fn beginning_with(
        weights: &[u8],
        config: &Config,
        world: &assembly::RunWorld,
        threads: usize,
    ) -> Result<Self, Error> {
        let (expected, found) = (&config.run.initial_weights, sha256(weights));
        if found != *expected {
            return Err(Error::Data(format!(
                "the run began with weights of SHA-256 {expected}, these have {found}"
            )));
        }
        assembly::expect_room(config, world, weights)?;
        let mut algorithm = assembly::algorithm(config, world, threads)?;
        algorithm.load(&StoredWeights(weights))?;
        Self::of(algorithm, config, world, threads)
    }

    /// As [`Trainer::in_world`], of an algorithm that was built.
    fn of(
        algorithm: Box<dyn Algorithm>,
        config: &Config,
        world: &assembly::RunWorld,
        threads: usize,
    ) -> Result<Self, Error> {
        let (policy, shards) = (algorithm.policy(), algorithm.shards());
        let environments = world.environments(algorithm.environments());
        Ok(Self {
            collector: Collector::new(policy, environments, shards, threads),
            evaluator: Evaluator::new(policy, world, config.test.episodes, threads),
            world: world.clone(),
            algorithm,
            config: config.clone(),
            steps_env: 0,
            episodes: 0,
            tests: 0,
            experience: ExperienceHash::default(),
            next_test: 0,
            next_row: config.run.metrics_interval_steps_env,
            interval: Interval::new(0),
            best: None,
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
        world: &assembly::RunWorld,
        threads: usize,
        checkpoint: &Checkpoint,
    ) -> Result<Self, Error> {
        assembly::expect_room(config, world, &checkpoint.tensors)?;
        let mut algorithm = assembly::algorithm(config, world, threads)?;
        algorithm.load(&StoredWeights(&checkpoint.tensors))?;
        let mut trainer = Self::of(algorithm, config, world, threads)?;
        trainer.restore(checkpoint)?;
        Ok(trainer)
    }

    /// Lets [`Self::update`] give up, with [`Error::Stopped`], as soon as `stop` is set: episodes of large teams, and long tests,
    /// last longer than somebody who wants to stop should wait.
    pub fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.collector.stop_when(stop);
        self.evaluator.stop_when(stop);
    }

    /// Sizes of the world, and what its episodes are reported by.
    #[must_use]
    pub fn spec(&self) -> &EnvironmentSpec {
        self.world.spec()
    }

    /// Environment steps so far, summed over the parallel environments.
    #[must_use]
    pub const fn steps_env(&self) -> u64 {
        self.steps_env
    }

    /// Whether the configured number of steps has been played and the last test is done.
    #[must_use]
    pub const fn finished(&self) -> bool {
        self.steps_env >= self.config.run.steps_env && !self.is_test_due()
    }

    /// Plays and learns from one batch of episodes, or plays a test if one is due: before the first batch, at every interval,
    /// and after the last batch. Gives a row of metrics at every test, at every interval between, and after the first batch, which an
    /// untrained team played.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if a number is not finite: one that an environment gives, a logit, a number of the critic's, a
    /// gradient, a moment or a parameter after the step; the trainer is not to be used any more then, and a run resumed from
    /// its latest checkpoint repeats the failure. [`Error::Step`] if a world cannot be played in any more, [`Error::Stopped`] if
    /// asked to stop: the trainer is as it was before then, and can make the same update again.
    pub fn update(&mut self) -> Result<Option<MetricRow>, Error> {
        if self.is_test_due() {
            return self.test().map(Some);
        }
        if let Some(row) = self.row_of_batch() {
            // The run ended here until it was made longer.
            return Ok(Some(row));
        }
        self.play()?;
        self.learn_from_batch()?;
        Ok(self.row_of_batch())
    }

    /// The weights of the policy and of whatever else the algorithm keeps, as safetensors without a word.
    #[must_use]
    pub fn weights(&self) -> Vec<u8> {
        write_weights(&self.algorithm.models())
    }

    /// As [`Self::weights`], with what somebody needs to know who acts with them: the file that a run leaves.
    #[must_use]
    pub fn described_weights(&self) -> Vec<u8> {
        let exploration = self.algorithm.behaviour(self.steps_env).exploration;
        let texts = description(
            &self.config,
            &self.world,
            self.algorithm.policy(),
            (self.steps_env, exploration),
        );
        with_description(&self.weights(), &texts)
    }

    /// The weights that did best in a test so far, as the file that a run leaves, and how they did: among equals the later ones.
    #[must_use]
    pub fn best(&self) -> Option<(&Score, &[u8])> {
        let best = self.best.as_ref();
        best.map(|best| (&best.test, best.weights.as_slice()))
    }

    /// How the weights play that the team has now, and how the best do, in greedy episodes that neither training nor tests have
    /// seen: the first that [`evaluate`](super::evaluate) plays with the run's seed. It changes nothing of the run.
    ///
    /// # Errors
    /// [`Error::Step`] if a world cannot be played in any more, [`Error::Stopped`] if asked to stop, [`Error::Data`] if the best
    /// weights came from a damaged checkpoint.
    pub fn judge(&mut self) -> Result<Teams, Error> {
        let episodes = episodes_of_judgement(self.config.test.episodes);
        let seed = self.config.run.seed;
        let key = |episode| EpisodeKey::new(seed, Stream::Evaluation, episode);
        let evaluator = &mut self.evaluator;
        let evaluation = evaluator.play(self.algorithm.parameters(), episodes, key)?;
        let last = Score::of(&evaluation, self.steps_env);
        let best = match &self.best {
            Some(best) if best.test.steps_env == self.steps_env => Some(last),
            Some(best) => {
                let team = assembly::trained(&self.config, &self.world, &best.weights)?;
                let evaluation = evaluator.play(team.parameters(), episodes, key)?;
                Some(Score::of(&evaluation, best.test.steps_env))
            }
            None => None,
        };
        let measure = evaluation.quantities.into_iter().next();
        Ok(Teams {
            measure: measure.map_or_else(String::new, |first| first.name),
            last,
            best,
        })
    }

    /// The latest batch.
    pub(super) fn latest(&mut self) -> Vec<&Episode> {
        let pieces = self.collector.pieces();
        pieces
            .flat_map(|piece| &piece.experience.episodes)
            .collect()
    }

    /// What is kept of the algorithm when training is over.
    pub(super) fn models(&self) -> Vec<(&ParameterLayout, &[f32])> {
        self.algorithm.models()
    }

    /// Starts measuring where the time goes; until then, that costs nothing.
    pub fn start_stopwatch(&mut self) {
        self.stopwatch.start();
        self.collector.stopwatches().for_each(Stopwatch::start);
    }

    /// Where the time since [`Self::start_stopwatch`] went: wall-clock time, that of a rollout divided in the proportions of
    /// what its threads were doing.
    #[must_use]
    pub const fn stopwatch(&self) -> &Stopwatch {
        &self.stopwatch
    }

    /// Updates and tests so far: the number of times that [`update`](Self::update) went well in this run, resumptions included.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.algorithm.updates() + self.tests
    }

    /// Hash of all states and rewards of the training episodes so far: once two runs differ in it, they do so for ever.
    #[must_use]
    pub const fn experience_hash(&self) -> u64 {
        self.experience.0
    }

    /// Training episodes before the latest batch.
    pub(super) fn episodes_before_batch(&self) -> u64 {
        self.episodes.saturating_sub(self.batch())
    }

    /// Everything that the rest of the run depends on, the configuration aside.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        let counters = Counters {
            steps_env: self.steps_env,
            episodes: self.episodes,
            tests: self.tests,
            experience_hash: self.experience.0,
            next_test: self.next_test,
            next_row: self.next_row,
            interval_steps_env: self.interval.steps_env,
            interval: self.interval.tally.clone(),
            best: self.best.as_ref().map(|best| best.test),
        };
        let mut state = self.algorithm.state();
        if self.finished() {
            // It is large, and nothing is learnt any more.
            state.memory = None;
        }
        Checkpoint::write(&state, &counters, self.best.as_ref())
    }

    /// Continues where `checkpoint` was taken: what follows is the same to the byte as if there had been no interruption.
    ///
    /// # Errors
    /// [`Error::Data`] if the checkpoint is damaged or belongs to another configuration. Nothing has changed then.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), Error> {
        let statistics = &self.world.spec().statistics;
        let own = &*self.algorithm;
        let mut opened = checkpoint.open(|name| is_explained(name, own, statistics))?;
        opened.is_last = opened.trainer.steps_env >= self.config.run.steps_env;
        self.algorithm.restore(&opened)?;
        self.best = opened.best;
        let counters = opened.trainer;
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

    /// Whether the next iteration is a test: because so many steps have been played, or because the run ends here, and has
    /// given no row here yet. How long the run is planned is no part of its state, so that it can be made longer.
    pub(super) const fn is_test_due(&self) -> bool {
        let ends_here =
            self.steps_env >= self.config.run.steps_env && self.interval.steps_env < self.steps_env;
        self.steps_env >= self.next_test || ends_here
    }

    /// What a number that is not finite is dated with.
    fn moment(&self) -> Moment {
        Moment {
            update: self.algorithm.updates(),
            steps_env: self.steps_env,
        }
    }

    /// Plays a batch of training episodes.
    pub(super) fn play(&mut self) -> Result<(), Error> {
        let settings = PlaySettings {
            behaviour: self.algorithm.behaviour(self.steps_env),
            recording: Recording::ForLearning,
        };
        let moment = self.moment();
        let seed = self.config.run.seed;
        let keys: Vec<EpisodeKey> = (self.episodes..self.episodes + self.batch())
            .map(|episode| EpisodeKey::new(seed, Stream::Training, episode))
            .collect();
        self.stopwatch.lap(Phase::Other);
        self.collector
            .play(self.algorithm.parameters(), &keys, settings)
            .map_err(|error| dated(error, moment))?;
        self.stopwatch.lap_shared_by(self.collector.stopwatches());
        Ok(())
    }

    /// Learns from the batch that was played last.
    pub(super) fn learn_from_batch(&mut self) -> Result<(), Error> {
        let moment = self.moment();
        let mut batch: Vec<&mut Piece> = self.collector.pieces().collect();
        self.stopwatch.lap(Phase::Other);
        let report = self
            .algorithm
            .learn(&mut batch, &mut self.stopwatch)
            .map_err(|error| dated(error, moment))?;
        self.episodes += self.batch();
        let pieces = self.collector.pieces();
        for episode in pieces.flat_map(|piece| &piece.experience.episodes) {
            self.steps_env += episode.steps() as u64;
            self.experience.add(episode);
            self.interval
                .note_episode(episode, &self.world.spec().statistics);
        }
        self.interval.tally.merge(&report);
        self.interval.tally.merge(&self.collector.tally());
        Ok(())
    }

    /// The row that is due after a batch, if one is; a test, which is due after the last batch, gives its own.
    pub(super) fn row_of_batch(&mut self) -> Option<MetricRow> {
        let is_due = self.steps_env >= self.next_row && !self.is_test_due();
        is_due.then(|| self.row())
    }

    /// Episodes of a batch.
    fn batch(&self) -> u64 {
        self.algorithm.environments() as u64
    }

    /// Plays greedy test episodes.
    fn test(&mut self) -> Result<MetricRow, Error> {
        self.stopwatch.lap(Phase::Other);
        let moment = self.moment();
        let test = &self.config.test;
        let (seed, first) = (self.config.run.seed, self.tests * test.episodes as u64);
        let evaluation = self
            .evaluator
            .play(self.algorithm.parameters(), test.episodes, |episode| {
                EpisodeKey::new(seed, Stream::Test, first + episode)
            })
            .map_err(|error| dated(error, moment))?;
        self.stopwatch.lap(Phase::Test);
        self.tests += 1;
        let score = Score::of(&evaluation, self.steps_env);
        if score.replaces(self.best.as_ref().map(|best| &best.test)) {
            self.best = Some(Best {
                test: score,
                weights: self.described_weights(),
            });
        }
        let test = &self.config.test;
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
        row.push_count("update", self.algorithm.updates());
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
        let discarded = self.collector.discarded() + self.evaluator.discarded();
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

fn append_test(row: &mut MetricRow, evaluation: &Evaluation) {
    for quantity in &evaluation.quantities {
        row.push(format!("test_{}_mean", quantity.name), quantity.mean);
    }
    row.push("test_distinct_openings", evaluation.distinct_openings);
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
        let settings = [
            "algorithm.hidden=3",
            "algorithm.environments=2",
            "test.episodes=2",
        ];
        let config = Config::with(&settings).unwrap();
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
}
