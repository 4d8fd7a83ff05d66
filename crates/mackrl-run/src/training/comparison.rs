//! Two trainers side by side: where what they play and what they learn first differs.

use mackrl::{Error, NotFinite, experience::Episode, nn::ParameterLayout};
use safetensors::{SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};

use super::{MetricRow, Trainer};

/// The first number in which two trainers differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// What it is a number of: `reward`, `state`, `critic.input.weight`.
    pub what: String,
    /// Its place: names of axes, and indices.
    pub place: Vec<(String, usize)>,
    /// The number in the first and in the second trainer.
    pub values: [f64; 2],
}

impl Difference {
    fn new(what: impl Into<String>, place: &[(&str, usize)], values: [f64; 2]) -> Self {
        Self {
            what: what.into(),
            place: place
                .iter()
                .map(|(axis, index)| ((*axis).to_owned(), *index))
                .collect(),
            values,
        }
    }
}

/// The first number in which two safetensors files differ, in the order of the names of their tensors.
///
/// # Errors
/// [`Error::Data`] if a file is damaged.
pub fn compare_tensors(own: &[u8], other: &[u8]) -> Result<Option<Difference>, Error> {
    let read = |file| {
        SafeTensors::deserialize(file)
            .map_err(|error| Error::Data(format!("tensors are no safetensors file: {error}")))
    };
    let files = [read(own)?, read(other)?];
    let mut names: Vec<&str> = files.iter().flat_map(SafeTensors::names).collect();
    names.sort_unstable();
    names.dedup();
    let differing = names.into_iter().find_map(|name| {
        let [own, other] = [&files[0], &files[1]].map(|file| file.tensor(name).ok());
        let length = |tensor: Option<&TensorView<'_>>| {
            tensor.map_or(0.0, |tensor| tensor.data().len() as f64)
        };
        let sizes = [length(own.as_ref()), length(other.as_ref())];
        let (Some(own), Some(other)) = (own, other) else {
            return Some(Difference::new(format!("bytes of {name}"), &[], sizes));
        };
        if own.shape() != other.shape() || own.dtype() != other.dtype() {
            return Some(Difference::new(format!("bytes of {name}"), &[], sizes));
        }
        let [own, other] = [own, other].map(|tensor| tensor.data().as_chunks::<4>().0);
        let index = own.iter().zip(other).position(|(a, b)| a != b)?;
        let values = [own, other].map(|data| f64::from(f32::from_le_bytes(data[index])));
        Some(Difference::new(name, &[("index", index)], values))
    });
    Ok(differing)
}

impl Trainer {
    /// Plays and learns as [`update`](Self::update) does until a batch has been learnt from or the run is finished; gives the
    /// rows of metrics on the way.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    pub fn next_batch(&mut self) -> Result<Vec<MetricRow>, Error> {
        let mut rows = Vec::new();
        while !self.finished() {
            let is_test = self.is_test_due();
            rows.extend(self.update()?);
            if !is_test {
                break;
            }
        }
        Ok(rows)
    }

    /// The first game step in which the latest batches of two trainers differ: the earliest step, and of several episodes that
    /// differ in it the first. Episodes are numbered from the beginning of the run.
    pub fn compare_batches(&mut self, other: &mut Self) -> Option<Difference> {
        let first_episode = usize::try_from(self.episodes_before_batch()).unwrap_or(usize::MAX);
        let own = self.latest();
        let others = other.latest();
        if own.len() != others.len() {
            let counts = [own.len() as f64, others.len() as f64];
            return Some(Difference::new("number of episodes", &[], counts));
        }
        let differing = own.iter().zip(&others).enumerate();
        differing
            .filter_map(|(b, (own, other))| {
                let (step, what, feature, values) = compare_episodes(own, other)?;
                let mut place = vec![("episode", first_episode + b), ("step", step)];
                place.extend(feature.map(|feature| ("feature", feature)));
                Some((step, b, Difference::new(what, &place, values)))
            })
            .min_by_key(|(step, b, _)| (*step, *b))
            .map(|(_, _, difference)| difference)
    }

    /// The first parameter in which the models of two trainers differ.
    #[must_use]
    pub fn compare_parameters(&self, other: &Self) -> Option<Difference> {
        let (own, others) = (self.models(), other.models());
        if own.len() != others.len() {
            let counts = [own.len() as f64, others.len() as f64];
            return Some(Difference::new("number of models", &[], counts));
        }
        let mut both = own.into_iter().zip(others);
        both.find_map(|(own, other)| compare_models(own, other))
    }
}

/// The first step that differs, what of it, which feature, and the two numbers.
type Found = (usize, &'static str, Option<usize>, [f64; 2]);

/// Compares the state before each step, then its reward; the state after the last step counts to that step's successor.
fn compare_episodes(own: &Episode, other: &Episode) -> Option<Found> {
    let differ = |a: f32, b: f32| a.to_bits() != b.to_bits();
    let both = |a: f32, b: f32| [f64::from(a), f64::from(b)];
    let sizes = [own, other].map(|episode| episode.state(0).len());
    if sizes[0] != sizes[1] {
        return Some((0, "size of the state", None, sizes.map(|size| size as f64)));
    }
    let steps = own.steps().min(other.steps());
    for t in 0..=steps {
        let mut states = own.state(t).iter().zip(other.state(t)).enumerate();
        if let Some((feature, (&a, &b))) = states.find(|(_, (a, b))| differ(**a, **b)) {
            return Some((t, "state", Some(feature), both(a, b)));
        }
        if t < steps && differ(own.reward_t[t], other.reward_t[t]) {
            let rewards = both(own.reward_t[t], other.reward_t[t]);
            return Some((t, "reward", None, rewards));
        }
    }
    let lengths = [own.steps() as f64, other.steps() as f64];
    (own.steps() != other.steps()).then_some((steps, "length of the episode", None, lengths))
}

fn compare_models(
    (own_layout, own): (&ParameterLayout, &[f32]),
    (other_layout, other): (&ParameterLayout, &[f32]),
) -> Option<Difference> {
    if own_layout != other_layout {
        let counts = [own.len() as f64, other.len() as f64];
        return Some(Difference::new("number of parameters", &[], counts));
    }
    let mut pairs = own.iter().zip(other);
    let index = pairs.position(|(a, b)| a.to_bits() != b.to_bits())?;
    let place = NotFinite::in_layout("", own_layout, index, own);
    Some(Difference {
        what: place.tensor.trim_start().to_owned(),
        place: place.place,
        values: [f64::from(own[index]), f64::from(other[index])],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn trainer(threads: usize, change: impl FnOnce(&mut Config)) -> Trainer {
        let settings = [
            "algorithm.name=central-v",
            "algorithm.hidden=5",
            "algorithm.environments=3",
            "test.episodes=1",
            "run.steps_env=700",
        ];
        let mut config = Config::with(&settings).unwrap();
        change(&mut config);
        Trainer::new(&config, threads).unwrap()
    }

    #[test]
    fn equal_runs_differ_nowhere_whatever_their_threads() {
        let (mut one, mut other) = (trainer(1, |_| ()), trainer(3, |_| ()));
        while !one.finished() {
            assert_eq!(
                one.next_batch().unwrap().len(),
                other.next_batch().unwrap().len()
            );
            assert_eq!(one.compare_batches(&mut other), None);
            assert_eq!(one.compare_parameters(&other), None);
            assert_eq!(one.experience_hash(), other.experience_hash());
        }
        assert!(other.finished());
    }

    #[test]
    fn another_seed_differs_from_the_start_and_another_rate_from_the_first_update() {
        let (mut one, mut other) = (trainer(1, |_| ()), trainer(1, |config| config.run.seed = 2));
        let parameters = one.compare_parameters(&other).unwrap();
        assert_eq!(parameters.what, "agent_controller.input.weight");
        one.next_batch().unwrap();
        other.next_batch().unwrap();
        let step = one.compare_batches(&mut other).unwrap();
        assert_eq!(step.place[0].0, "episode");
        assert_ne!(one.experience_hash(), other.experience_hash());

        let faster = |config: &mut Config| config.algorithm.set("learning_rate", 1e-3).unwrap();
        let (mut one, mut other) = (trainer(1, |_| ()), trainer(1, faster));
        assert_eq!(one.compare_parameters(&other), None);
        one.next_batch().unwrap();
        other.next_batch().unwrap();
        assert_eq!(
            one.compare_batches(&mut other),
            None,
            "the same parameters played"
        );
        assert_eq!(one.experience_hash(), other.experience_hash());
        assert!(
            one.compare_parameters(&other).is_some(),
            "and learnt otherwise"
        );
    }

    #[test]
    fn the_earliest_step_of_any_episode_is_named() {
        let episode = |rewards: [f32; 3], last_state: f32| Episode {
            state_tg: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, last_state],
            reward_t: rewards.to_vec(),
            ..Episode::default()
        };
        let whole = episode([0.5, 0.25, 0.125], 7.0);
        assert_eq!(compare_episodes(&whole, &whole), None);
        let reward = episode([0.5, 0.75, 0.125], 7.0);
        let found = compare_episodes(&whole, &reward);
        assert_eq!(found, Some((1, "reward", None, [0.25, 0.75])));
        let state = episode([0.5, 0.25, 0.125], 9.0);
        let found = compare_episodes(&whole, &state);
        assert_eq!(found, Some((3, "state", Some(1), [7.0, 9.0])));
        let shorter = Episode {
            state_tg: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            reward_t: vec![0.5, 0.25],
            ..Episode::default()
        };
        let found = compare_episodes(&whole, &shorter);
        assert_eq!(found, Some((2, "length of the episode", None, [3.0, 2.0])));
    }
}
