//! One update repeated under a magnifying glass: what every tensor held, and which was the first to break.
//!
//! An update that is refused leaves nothing behind in the trainer's state, but the buffers that it worked in still hold its
//! numbers. Looking at them afterwards costs a healthy update nothing.

use mackrl::{
    Error, NotFinite,
    learner::Reached,
    nn::{Moments, Named, ParameterLayout},
    rollout::Rollout,
};
use serde::{Deserialize, Serialize};

use super::Trainer;

/// How the names of log-probabilities end.
const LOG_P: &str = " log p";

/// An update that was repeated, tensor by tensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Examination {
    /// Why the update is refused; `None` if it is not.
    pub refused: Option<NotFinite>,
    /// What it computed, in that order, as far as it came.
    pub tensors: Vec<TensorStatistics>,
}

/// A part of an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// What was there before it.
    Before,
    /// What the world gave.
    World,
    /// The controllers, while acting.
    Acting,
    /// The critic's sweep: of all time steps what it keeps, else of the last one that it came to.
    Critic,
    /// The backward pass through the controllers, last layer first.
    Backward,
    /// The optimiser's step.
    Step,
}

/// What a tensor holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TensorStatistics {
    /// Where it belongs.
    pub part: Part,
    /// Its name.
    pub name: String,
    /// How many numbers it holds; masked log-probabilities are not counted.
    pub count: usize,
    /// How many of them are infinite or NaN.
    pub not_finite: usize,
    /// The least of the others.
    pub min: Option<f32>,
    /// The greatest of the others.
    pub max: Option<f32>,
    /// Where the first of them is: names of axes, and indices.
    pub first: Option<Vec<(String, usize)>>,
}

impl Examination {
    /// The first tensor that is not finite throughout.
    #[must_use]
    pub fn origin(&self) -> Option<&TensorStatistics> {
        self.tensors.iter().find(|tensor| tensor.not_finite > 0)
    }
}

impl TensorStatistics {
    fn new(part: Part, name: &str) -> Self {
        Self {
            part,
            name: name.to_owned(),
            count: 0,
            not_finite: 0,
            min: None,
            max: None,
            first: None,
        }
    }

    /// Adds numbers, which belong to `group` if the tensor has more than one part.
    fn add(&mut self, named: &Named<'_, f32>, group: Option<(&str, usize)>) {
        // A log-probability of −∞ is that of a masked choice.
        let masked = |value: &f32| self.name.ends_with(LOG_P) && *value == f32::NEG_INFINITY;
        let place = |index: usize| {
            let within = [index / named.columns, index % named.columns];
            let axes = named.axes.into_iter().zip(within);
            let place = group.into_iter().chain(axes);
            let named = place.filter(|(axis, _)| !axis.is_empty());
            named
                .map(|(axis, index)| (axis.to_owned(), index))
                .collect()
        };
        let numbers = named.values.iter().enumerate();
        for (index, &value) in numbers.filter(|(_, value)| !masked(value)) {
            self.count += 1;
            if value.is_finite() {
                self.min = Some(self.min.map_or(value, |min| min.min(value)));
                self.max = Some(self.max.map_or(value, |max| max.max(value)));
            } else {
                self.not_finite += 1;
                self.first.get_or_insert_with(|| place(index));
            }
        }
    }
}

/// Collects the statistics of tensors in the order in which they are first named.
#[derive(Debug, Default)]
struct Collection(Vec<TensorStatistics>);

impl Collection {
    /// Adds tensors, those that are there already to themselves.
    fn add(&mut self, part: Part, named: &[Named<'_, f32>], group: Option<(&str, usize)>) {
        for named in named.iter().filter(|named| !named.values.is_empty()) {
            let same = |own: &TensorStatistics| (own.part, &own.name) == (part, &named.name);
            let index = self.0.iter().position(same).unwrap_or_else(|| {
                self.0.push(TensorStatistics::new(part, &named.name));
                self.0.len() - 1
            });
            self.0[index].add(named, group);
        }
    }

    /// Adds lists of which each belongs to an episode.
    fn add_episodes(&mut self, part: Part, named_b: &[Named<'_, f32>]) {
        for (b, named) in named_b.iter().enumerate() {
            self.add(part, std::slice::from_ref(named), Some(("episode", b)));
        }
    }

    /// Adds what the worlds of a rollout gave and what its actors computed.
    fn add_rollout(&mut self, rollout: &mut Rollout) {
        let mut first = 0;
        for batch in rollout.batches() {
            for (b, episode) in batch.episodes.iter().enumerate() {
                let states = episode.state_tg.len() / (episode.steps() + 1);
                let world = [
                    Named::new("rewards", ["step", ""], 1, &episode.reward_t[..]),
                    Named::new("states", ["step", "feature"], states, &episode.state_tg[..]),
                ];
                self.add(Part::World, &world, Some(("episode", first + b)));
            }
            first += batch.episodes.len();
        }
        for (shard, batch) in rollout.batches().enumerate() {
            self.add(
                Part::Acting,
                &batch.actor.activations(),
                Some(("shard", shard)),
            );
        }
    }

    /// Adds parameters and moments.
    fn add_state(&mut self, layout: &ParameterLayout, parameters: &[f32], moments: &Moments<f32>) {
        for (prefix, values) in [
            ("", parameters),
            ("first moment of ", &moments.first),
            ("second moment of ", &moments.second),
        ] {
            if !values.is_empty() {
                self.add(Part::Before, &layout.named(prefix, values), None);
            }
        }
    }
}

impl Trainer {
    /// Does what [`Trainer::update`] would do, and tells what every tensor held on the way. If the update is refused, the
    /// trainer is as it was before.
    ///
    /// # Errors
    /// What stops an update other than numbers that are not finite.
    pub fn examine(&mut self) -> Result<Examination, Error> {
        let mut tensors = Collection::default();
        let state = self.learner.state();
        tensors.add_state(self.policy.layout(), &state.parameters, &state.moments);
        let critic = state.critic;
        let layout = self.learner.critic().layout();
        tensors.add_state(layout, &critic.parameters, &critic.moments);
        let target = layout.named("target copy of ", &critic.target_parameters);
        tensors.add(Part::Before, &target, None);
        let updated = if self.is_test_due() {
            let updated = self.update();
            tensors.add_rollout(self.evaluator.rollout());
            updated.map(drop)
        } else {
            self.learn_examined(&mut tensors)
        };
        let refused = match updated {
            Ok(()) => None,
            Err(Error::NotFinite(broken)) => Some(*broken),
            Err(other) => return Err(other),
        };
        let Collection(tensors) = tensors;
        Ok(Examination { refused, tensors })
    }

    fn learn_examined(&mut self, tensors: &mut Collection) -> Result<(), Error> {
        let played = self.play();
        tensors.add_rollout(&mut self.rollout);
        played?;
        let learnt = self.learn_from_batch();
        let (learner, critic) = (&self.learner, self.learner.critic());
        tensors.add_episodes(Part::Critic, &critic.returns());
        tensors.add(Part::Critic, &critic.activations(), None);
        tensors.add(Part::Critic, &critic.step_numbers(), None);
        if learner.reached() >= Reached::Gradient {
            tensors.add_episodes(Part::Backward, &learner.advantages());
            for (shard, batch) in self.rollout.batches().enumerate() {
                tensors.add(
                    Part::Backward,
                    &batch.actor.gradients(),
                    Some(("shard", shard)),
                );
            }
            tensors.add(Part::Backward, &learner.gradient(&*self.policy), None);
        }
        if learner.reached() >= Reached::Step {
            tensors.add(Part::Step, &learner.after_step(&*self.policy), None);
        }
        learnt?;
        self.row_of_batch();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn trainer() -> Trainer {
        let mut config = Config::default();
        config.policy.hidden = 5;
        config.learner.environments = 5;
        config.test.episodes = 1;
        Trainer::new(&config, 2).unwrap()
    }

    #[test]
    fn examining_a_sound_update_is_that_update() {
        let (mut examined, mut updated) = (trainer(), trainer());
        // The first iteration is a test, the second an update.
        for _ in 0..2 {
            let examination = examined.examine().unwrap();
            updated.update().unwrap();
            assert_eq!(examination.refused, None);
            assert_eq!(examination.origin(), None);
            assert_eq!(examined.checkpoint(), updated.checkpoint());
        }
        let parts = examined.examine().unwrap().tensors;
        let of = |part: Part| parts.iter().filter(|tensor| tensor.part == part).count();
        assert_eq!(of(Part::World), 2);
        assert_eq!(
            of(Part::Acting),
            18,
            "three controllers with six tensors each"
        );
        assert!(of(Part::Before) > 0 && of(Part::Critic) > 0);
        assert!(of(Part::Backward) > 0 && of(Part::Step) > 0);
    }

    #[test]
    fn the_first_broken_tensor_is_the_origin_of_all_that_follow() {
        for test_is_due in [true, false] {
            let mut trainer = trainer();
            if !test_is_due {
                trainer.update().unwrap();
            }
            let before = trainer.checkpoint();
            let mut state = trainer.learner.state();
            let layout = trainer.policy.layout();
            let tensor = layout.tensors().iter();
            let place = tensor
                .clone()
                .find(|tensor| tensor.name == "pair_controller.input.bias");
            let index = place.unwrap().range.start + 2;
            let sound = std::mem::replace(&mut state.parameters[index], f32::NAN);
            trainer.learner.restore(&*trainer.policy, state.clone());
            let examination = trainer.examine().unwrap();
            let refused = examination.refused.as_ref().unwrap();
            assert_eq!(refused.tensor, "logits of pair_controller");
            assert_eq!(refused.moment.map(|moment| moment.update), Some(0));
            let origin = examination.origin().unwrap();
            assert_eq!((origin.part, origin.not_finite), (Part::Before, 1));
            assert_eq!(origin.name, "pair_controller.input.bias");
            assert_eq!(origin.first, Some(vec![("output".to_owned(), 2)]));
            let broken = examination
                .tensors
                .iter()
                .filter(|tensor| tensor.not_finite > 0);
            let names: Vec<&str> = broken.map(|tensor| tensor.name.as_str()).collect();
            assert_eq!(names[1], "pair_controller input layer");
            state.parameters[index] = sound;
            trainer.learner.restore(&*trainer.policy, state);
            assert_eq!(trainer.checkpoint(), before, "nothing else has changed");
        }
    }
}
