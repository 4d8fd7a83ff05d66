//! Random available actions, episode after episode: what the speed of an environment is measured with.

use std::fmt;

use crate::{
    Action, AgentId, Draw, Environment, EpisodeKey, Observations, StepError, Stream, TimeStep,
};

/// Somebody who plays an environment for ever, without any skill.
pub struct RandomPlay {
    environment: Box<dyn Environment>,
    observations: Observations,
    actions: Vec<Action>,
    seed: u64,
    /// Episodes begun.
    episodes: u64,
    /// Steps of this episode.
    steps: usize,
}

impl RandomPlay {
    /// Begins the first episode of `environment`; all choices follow from `seed`.
    #[must_use]
    pub fn new(environment: Box<dyn Environment>, seed: u64) -> Self {
        let spec = environment.spec();
        let mut play = Self {
            observations: Observations::new(spec, 1),
            actions: vec![Action::default(); spec.agents],
            environment,
            seed,
            episodes: 0,
            steps: 0,
        };
        play.begin_episode();
        play
    }

    /// What is played.
    #[must_use]
    pub fn environment(&self) -> &dyn Environment {
        &*self.environment
    }

    /// Episodes begun so far.
    #[must_use]
    pub const fn episodes(&self) -> u64 {
        self.episodes
    }

    /// Plays one step, with observations, state and availability written, and begins a new episode where one ends.
    ///
    /// # Errors
    /// [`StepError`] if the environment fails, or refuses an action that it offered, against its contract.
    pub fn step(&mut self) -> Result<TimeStep, StepError> {
        let key = self.key();
        for (agent, action) in self.actions.iter_mut().enumerate() {
            let view = self.observations.local_view(0, AgentId::new(agent));
            let uniform = key.uniform(self.steps, Draw::Agent(agent));
            *action = random_action(view.available(), uniform);
        }
        let mut row = self.observations.row_mut(0);
        let time_step = self.environment.step(&self.actions, &mut row)?;
        self.steps += 1;
        if time_step.end.is_some() {
            self.begin_episode();
        }
        Ok(time_step)
    }

    fn begin_episode(&mut self) {
        self.episodes += 1;
        self.steps = 0;
        let key = self.key();
        self.environment
            .reset(key, &mut self.observations.row_mut(0));
    }

    const fn key(&self) -> EpisodeKey {
        EpisodeKey::new(self.seed, Stream::Other, self.episodes)
    }
}

impl fmt::Debug for RandomPlay {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("RandomPlay")
            .field("environment", self.environment.spec())
            .field("episodes", &self.episodes)
            .field("steps", &self.steps)
            .finish_non_exhaustive()
    }
}

/// The available action at `uniform`, in [0, 1), of the way through all that are available; the first of all if none is.
///
/// # Shapes
/// `available_a` \[A\].
#[must_use]
pub fn random_action(available_a: &[bool], uniform: f64) -> Action {
    let count = available_a.iter().filter(|&&available| available).count();
    let mut left = uniform * count as f64;
    let is_chosen = |available: &bool| {
        left -= f64::from(u8::from(*available));
        *available && left < 0.0
    };
    Action::new(available_a.iter().position(is_chosen).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix_game::{MatrixGame, MatrixGameSettings};

    #[test]
    fn only_available_actions_are_chosen_and_all_of_them() {
        let available_a = [false, true, false, true, true];
        let chosen = [0.0, 0.34, 0.67, 1.0 - f64::EPSILON]
            .map(|uniform| random_action(&available_a, uniform).index());
        assert_eq!(chosen, [1, 3, 4, 4]);
    }

    #[test]
    fn episodes_follow_each_other_and_repeat_from_the_seed() {
        let play = |seed| {
            let game = MatrixGame::new(MatrixGameSettings::default()).unwrap();
            let mut play = RandomPlay::new(Box::new(game), seed);
            let steps: Vec<TimeStep> = (0..211).map(|_| play.step().unwrap()).collect();
            let ends = steps.iter().filter(|step| step.end.is_some()).count() as u64;
            assert_eq!(play.episodes(), 1 + ends);
            assert_eq!(ends, 211, "an episode of the matrix game has one step");
            steps
        };
        assert_eq!(play(7), play(7));
        assert_ne!(play(7), play(11));
    }
}
