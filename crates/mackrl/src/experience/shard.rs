//! A shard: a few environments, the actor that plays in them, and the episodes that come out.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use mackrl_env::{Action, Environment, EpisodeKey, Observations, StepError};

use super::{Experience, PlaySettings};
use crate::{
    Error, NotFinite, Phase,
    nn::first_not_finite,
    policy::{Actor, Parameters, Situation},
};

/// Times that the same episodes are begun anew because a world fails under them, before the run gives up.
pub(crate) const ATTEMPTS_MAX: usize = 100;

/// A piece of a batch: the experience of one shard, and the actor that left it and may still hold activations of it.
pub struct Piece {
    /// The latest episodes, at most one per environment.
    pub experience: Experience,
    /// The actor that played them.
    pub actor: Box<dyn Actor>,
}

/// Some environments that are stepped together by one actor.
pub struct Shard {
    environments: Vec<Box<dyn Environment>>,
    observations: Observations,
    actions_bn: Vec<Action>,
    agents: usize,
    piece: Piece,
    /// Whether to give up: episodes of large teams last seconds.
    stop: Arc<AtomicBool>,
    /// Episodes that were played in vain.
    discarded: u64,
}

impl Shard {
    /// A shard of `environments`, all of the same kind, played by `actor`.
    ///
    /// # Panics
    /// If there is no environment.
    #[must_use]
    pub fn new(environments: Vec<Box<dyn Environment>>, actor: Box<dyn Actor>) -> Self {
        let spec = environments
            .first()
            .expect("a shard has at least one environment")
            .spec();
        let agents = spec.agents;
        let observations = Observations::new(spec, environments.len());
        Self {
            actions_bn: vec![Action::default(); environments.len() * agents],
            environments,
            observations,
            agents,
            piece: Piece {
                experience: Experience::default(),
                actor,
            },
            stop: Arc::default(),
            discarded: 0,
        }
    }

    /// Gives episodes up, between two steps, as soon as `stop` is set.
    pub fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.stop = Arc::clone(stop);
    }

    /// Number of environments.
    #[must_use]
    pub fn environments(&self) -> usize {
        self.environments.len()
    }

    /// The latest experience and its actor.
    pub const fn piece(&mut self) -> &mut Piece {
        &mut self.piece
    }

    /// Episodes so far that were played in vain because a world failed.
    #[must_use]
    pub const fn discarded(&self) -> u64 {
        self.discarded
    }

    /// Plays the episodes named `keys`, at most one per environment, to their ends.
    ///
    /// If a world fails under one of them, all are played again from their beginnings: the actor holds what it computed for
    /// all rows of a step together, and a failure is rare. Nothing of the failed attempt is kept.
    ///
    /// # Errors
    /// If an environment refuses an action, which means that the policy's masks disagree with it, or cannot be played in any
    /// more (or fails a hundred times in a row), or if something that an environment or a controller gives is not finite;
    /// [`Error::Stopped`] if asked to stop.
    pub fn play(
        &mut self,
        parameters: &Parameters,
        keys: &[EpisodeKey],
        settings: PlaySettings,
    ) -> Result<(), Error> {
        let mut attempts = 1;
        loop {
            match self.attempt(parameters, keys, settings) {
                Err(Error::Step(StepError::Interrupted(failure)))
                    if failure.can_be_repeated && attempts < ATTEMPTS_MAX =>
                {
                    attempts += 1;
                    self.discarded += keys.len() as u64;
                }
                outcome => return outcome,
            }
        }
    }

    fn attempt(
        &mut self,
        parameters: &Parameters,
        keys: &[EpisodeKey],
        settings: PlaySettings,
    ) -> Result<(), Error> {
        let Piece { experience, actor } = &mut self.piece;
        experience.begin(keys, settings.behaviour);
        actor.begin(settings.recording, experience);
        actor.stopwatch().skip();
        for (b, key) in keys.iter().enumerate() {
            self.environments[b].reset(*key, &mut self.observations.row_mut(b));
            check_finite(&self.observations, b, 0)?;
            let episode = &mut experience.episodes[b];
            let shown = (&self.observations, b);
            episode.remember(settings.recording, shown, self.agents, actor.needs_views());
        }
        actor.stopwatch().lap(Phase::Simulate);
        let mut playing: Vec<usize> = (0..keys.len()).collect();
        for step in 0.. {
            if playing.is_empty() {
                break;
            }
            if self.stop.load(Ordering::Relaxed) {
                return Err(Error::Stopped);
            }
            let situation = Situation {
                step,
                playing: &playing,
                keys,
                observations: &self.observations,
                behaviour: settings.behaviour,
            };
            let Piece { experience, actor } = &mut self.piece;
            actor.act(parameters, situation, experience, &mut self.actions_bn)?;
            for &b in &playing {
                self.step(b, step, settings)?;
            }
            self.piece.actor.stopwatch().lap(Phase::Simulate);
            playing.retain(|&b| self.piece.experience.episodes[b].end.is_none());
        }
        Ok(())
    }

    /// Plays the chosen actions of a step in environment `b`.
    fn step(&mut self, b: usize, step: usize, settings: PlaySettings) -> Result<(), Error> {
        let actions = &self.actions_bn[b * self.agents..(b + 1) * self.agents];
        let time_step = self.environments[b].step(actions, &mut self.observations.row_mut(b))?;
        if !time_step.reward.is_finite() {
            let place = [("episode", b), ("step", step)];
            return Err(NotFinite::new("reward", &place, time_step.reward).into());
        }
        check_finite(&self.observations, b, step + 1)?;
        let needs_views = self.piece.actor.needs_views();
        let episode = &mut self.piece.experience.episodes[b];
        episode.action_tn.extend_from_slice(actions);
        episode.reward_t.push(time_step.reward);
        episode.end = time_step.end;
        let shown = (&self.observations, b);
        episode.remember(settings.recording, shown, self.agents, needs_views);
        if time_step.end.is_some() {
            let environment = &self.environments[b];
            let count = environment.spec().statistics.len();
            episode.statistics_s.resize(count, 0.0);
            environment.statistics(&mut episode.statistics_s);
        }
        Ok(())
    }
}

/// Refuses what environment `b` shows before step `step` if a number of it is not finite.
fn check_finite(observations: &Observations, b: usize, step: usize) -> Result<(), NotFinite> {
    for (whose, width, numbers) in observations.numbers(b) {
        if let Some(index) = first_not_finite(numbers) {
            let mut place = vec![("episode", b), ("step", step)];
            let tensor = match whose {
                "state" => whose.to_owned(),
                row => {
                    place.push((row, index / width));
                    format!("observation of an {row}")
                }
            };
            place.push(("feature", index % width));
            return Err(NotFinite::new(tensor, &place, numbers[index]));
        }
    }
    Ok(())
}

impl fmt::Debug for Piece {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Piece")
            .field("experience", &self.experience)
            .finish_non_exhaustive()
    }
}

impl fmt::Debug for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Shard")
            .field("piece", &self.piece)
            .finish_non_exhaustive()
    }
}
