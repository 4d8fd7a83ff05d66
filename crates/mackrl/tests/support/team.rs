//! Whole teams with small networks in real worlds.

use mackrl::{
    decentralised::Decentralised,
    policy::{Behaviour, Recording},
    rollout::{Episode, Rollout, RolloutSettings},
};
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::Config,
    training::assembly::{self, World},
};

/// The configuration with these settings over the built-in ones.
pub(crate) fn config(settings: &[&str]) -> Config {
    Config::with(settings).expect("known settings within their ranges")
}

/// The setting that chooses a map, or a world that has none.
pub(crate) fn world_setting(map: &str) -> String {
    match map {
        "matrix-game" => format!("env.name={map}"),
        map => format!("env.map={map}"),
    }
}

/// A policy and the worlds it plays in.
pub(crate) struct Team {
    pub(crate) world: World,
    pub(crate) policy: Box<dyn Decentralised>,
}

impl Team {
    pub(crate) fn new(settings: &[&str]) -> Self {
        let config = config(settings);
        let world = World::new(&config).expect("a world that can be built");
        let policy = assembly::policy(&config, &world).expect("a team that can be built");
        Self { world, policy }
    }

    /// `count` environments, `shard_size` of them to an actor.
    pub(crate) fn rollout(&self, count: usize, shard_size: usize) -> Rollout {
        let environments = self.world.environments(count);
        Rollout::new(&*self.policy, environments, shard_size, 1)
    }

    /// The flat places of the tensors whose names begin with `controller`.
    pub(crate) fn places(&self, controller: &str) -> Vec<usize> {
        let tensors = self.policy.layout().tensors().iter();
        tensors
            .filter(|tensor| tensor.name.starts_with(controller))
            .flat_map(|tensor| tensor.range.clone())
            .collect()
    }

    /// Plays the episodes `keys` with `parameters`, sampled with exploration 0.2, in one shard; gives the episodes,
    /// J = Σ w log p(u) and its gradient, where the weights w depend on step and environment.
    pub(crate) fn learnable(&self, parameters: &[f32], keys: &[EpisodeKey]) -> Played {
        let mut rollout = self.rollout(keys.len(), keys.len());
        let weights = self.policy.weights(parameters);
        let settings = RolloutSettings {
            behaviour: Behaviour::sampled(0.2),
            recording: Recording::ForLearning,
        };
        rollout
            .play(&weights, keys, settings)
            .expect("masks agree with the world");
        let batch = rollout.batches().next().expect("one shard");
        let episodes = batch.episodes.clone();
        let weight_bt: Vec<Vec<f32>> = (episodes.iter().enumerate())
            .map(|(b, episode)| (0..episode.steps()).map(|t| weight(b, t)).collect())
            .collect();
        let mut gradient = vec![0.0; parameters.len()];
        let objective = batch.actor.backward(&weights, &weight_bt, &mut gradient);
        Played {
            episodes,
            objective,
            gradient,
        }
    }
}

/// What [`Team::learnable`] gives.
pub(crate) struct Played {
    pub(crate) episodes: Vec<Episode>,
    pub(crate) objective: f64,
    pub(crate) gradient: Vec<f32>,
}

impl Played {
    /// The gradient at `places`.
    pub(crate) fn gradient_at(&self, places: &[usize]) -> Vec<f64> {
        (places.iter())
            .map(|&place| f64::from(self.gradient[place]))
            .collect()
    }
}

/// Names of `count` episodes.
pub(crate) fn keys(count: u64) -> Vec<EpisodeKey> {
    (0..count)
        .map(|episode| EpisodeKey::new(7, Stream::Training, episode))
        .collect()
}

pub(crate) fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A weight of either sign that no other step near it has.
fn weight(b: usize, t: usize) -> f32 {
    ((1 + 5 * b + 3 * t) as f32).sin()
}
