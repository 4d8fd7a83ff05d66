//! Whole teams with small networks in real worlds.

use mackrl::{
    algorithms::{ActorCritic, ActorCriticSettings, AlgorithmKind, CentralV, Mackrl},
    common_knowledge::CommonKnowledgeFeatures,
    experience::{Collector, Episode, PlaySettings},
    hierarchy::{Hierarchy, HierarchySettings, NetworkStyle},
    policy::{Behaviour, Declaration, Parameters, Policy, Recording},
};
use mackrl_env::{EpisodeKey, Stream, settings::Settings};
use mackrl_run::{config::Config, training::assembly::RunWorld};

/// From which initial parameters and sampled partitions follow.
const SEED: u64 = 3;

/// Settings of a run that several tests need, whatever configurations call them.
pub(crate) const MACKRL: &str = "algorithm.name=mackrl";
pub(crate) const CENTRAL_V: &str = "algorithm.name=central-v";

/// The configuration with these settings over the built-in ones of the paper's algorithm.
pub(crate) fn config(settings: &[&str]) -> Config {
    let settings = [&["algorithm.name=mackrl"], settings].concat();
    Config::with(&settings).expect("known settings within their ranges")
}

/// The setting that chooses a map, or a world that has none.
pub(crate) fn world_setting(map: &str) -> String {
    match map {
        "matrix-game" => format!("env.name={map}"),
        map => format!("env.map={map}"),
    }
}

/// The world of the configuration with these settings.
pub(crate) fn world(settings: &[&str]) -> RunWorld {
    RunWorld::new(&config(settings)).expect("a world that can be built")
}

/// A hierarchy and the worlds it plays in.
pub(crate) struct Team {
    pub(crate) world: RunWorld,
    pub(crate) hierarchy: Hierarchy,
}

impl Team {
    /// Pairwise MACKRL, whose settings are TOML under the names that the algorithm declares.
    pub(crate) fn mackrl(world_settings: &[&str], settings: &str) -> Self {
        let world = world(world_settings);
        let table = table(settings);
        let (own, learning) = Mackrl::read(&table).expect("settings of the algorithm");
        let declaration = own
            .declaration([world.spec().agents, world.spec().actions], SEED)
            .expect("a team that has these partitions");
        let networks = HierarchySettings {
            common_knowledge: own.common_knowledge,
            hidden: learning.hidden,
            networks: NetworkStyle::Plain,
        };
        Self::declared(world, declaration, networks).which_is(&Mackrl, &table)
    }

    /// Central-V, whose settings are TOML under the names that the algorithm declares.
    pub(crate) fn central_v(world_settings: &[&str], settings: &str) -> Self {
        let world = world(world_settings);
        let table = table(settings);
        let learning = ActorCriticSettings::read(&table).expect("settings of the algorithm");
        let declaration = Declaration::agents_alone([world.spec().agents, world.spec().actions]);
        let networks = HierarchySettings {
            common_knowledge: CommonKnowledgeFeatures::default(),
            hidden: learning.hidden,
            networks: NetworkStyle::Plain,
        };
        Self::declared(world, declaration, networks).which_is(&CentralV, &table)
    }

    /// Team → fours → pairs → agents, with H = `hidden`.
    pub(crate) fn fours(world_settings: &[&str], hidden: usize) -> Self {
        Self::mackrl(
            world_settings,
            &format!("hidden = {hidden}\nlevels = \"fours\""),
        )
    }

    pub(crate) fn declared(
        world: RunWorld,
        declaration: Declaration,
        networks: HierarchySettings,
    ) -> Self {
        let hierarchy = Hierarchy::new(declaration, world.spec(), &world.prior(), networks);
        Self { world, hierarchy }
    }

    /// This team, after a check that the algorithm which configurations name acts with the same networks.
    fn which_is(self, kind: &dyn AlgorithmKind, table: &toml::Table) -> Self {
        let built = kind.build(table, self.learners(&self.world.prior(), 1));
        let built = built.expect("settings of the algorithm");
        assert_eq!(
            built.policy().layout().tensors(),
            self.hierarchy.layout().tensors(),
            "tensors of the team that the kind builds"
        );
        assert_eq!(
            built.parameters().values(),
            self.initialise(),
            "initial parameters of the team that the kind builds"
        );
        self
    }

    fn learners<'a>(
        &'a self,
        prior: &'a std::sync::Arc<dyn mackrl_env::PriorKnowledge>,
        threads: usize,
    ) -> mackrl::algorithms::Team<'a> {
        mackrl::algorithms::Team {
            spec: self.world.spec(),
            prior,
            seed: SEED,
            threads,
        }
    }

    /// This team with a critic, on `threads` threads; `settings` are TOML.
    pub(crate) fn actor_critic(&self, settings: &str, threads: usize) -> ActorCritic {
        let settings = ActorCriticSettings::read(&table(settings)).expect("known settings");
        let prior = self.world.prior();
        ActorCritic::new(
            self.hierarchy.clone(),
            settings,
            self.learners(&prior, threads),
        )
    }

    /// Random initial parameters, always the same.
    pub(crate) fn initialise(&self) -> Vec<f32> {
        self.hierarchy.initialise(SEED)
    }

    /// `count` environments, cut into `shards`.
    pub(crate) fn collector(&self, count: usize, shards: usize) -> Collector {
        Collector::new(&self.hierarchy, self.world.environments(count), shards, 1)
    }

    /// The flat places of the tensors whose names begin with `controller`.
    pub(crate) fn places(&self, controller: &str) -> Vec<usize> {
        let tensors = self.hierarchy.layout().tensors().iter();
        tensors
            .filter(|tensor| tensor.name.starts_with(controller))
            .flat_map(|tensor| tensor.range.clone())
            .collect()
    }

    /// Plays the episodes `keys` with `parameters`, sampled with exploration 0.2, in one shard; gives the episodes,
    /// J = Σ w log p(u) and its gradient, where the weights w depend on step and environment.
    pub(crate) fn learnable(&self, parameters: &[f32], keys: &[EpisodeKey]) -> Played {
        let mut collector = self.collector(keys.len(), 1);
        let parameters = Parameters::new(parameters.to_vec());
        collector
            .play(&parameters, keys, FOR_LEARNING)
            .expect("masks agree with the world");
        let piece = collector.pieces().next().expect("one shard");
        let evaluated = self.hierarchy.evaluate(&parameters, piece);
        let (experience, activations) = evaluated.expect("its own experience");
        let mut episodes = experience.episodes.clone();
        let acted_with = episodes.iter_mut();
        let acted_with: Vec<Vec<f32>> = acted_with
            .map(|episode| std::mem::take(&mut episode.log_p_t))
            .collect();
        assert_eq!(
            activations.log_p_bt(),
            acted_with,
            "log p(u) while acting and after"
        );
        let weight_bt = weights(&episodes);
        let objective = weighted_sum(activations.log_p_bt(), &weight_bt);
        let mut gradient = vec![0.0; parameters.values().len()];
        self.hierarchy.backward(
            &parameters,
            experience,
            activations,
            &weight_bt,
            &mut gradient,
        );
        Played {
            episodes,
            objective,
            gradient,
        }
    }

    /// J under `parameters` of the episodes `keys`, which are played with others.
    pub(crate) fn objective_of(
        &self,
        played_with: &[f32],
        keys: &[EpisodeKey],
        parameters: &[f32],
    ) -> f64 {
        let mut collector = self.collector(keys.len(), 1);
        let [played_with, parameters] =
            [played_with, parameters].map(|values| Parameters::new(values.to_vec()));
        collector
            .play(&played_with, keys, FOR_LEARNING)
            .expect("masks agree with the world");
        let piece = collector.pieces().next().expect("one shard");
        let evaluated = self.hierarchy.evaluate(&parameters, piece);
        let (experience, activations) = evaluated.expect("its own experience");
        weighted_sum(activations.log_p_bt(), &weights(&experience.episodes))
    }
}

fn weighted_sum(log_p_bt: &[Vec<f32>], weight_bt: &[Vec<f32>]) -> f64 {
    let terms = log_p_bt.iter().flatten().zip(weight_bt.iter().flatten());
    terms
        .map(|(&log_p, &weight)| f64::from(log_p) * f64::from(weight))
        .sum()
}

/// How episodes are played that will be learnt from: sampled, with exploration 0.2.
pub(crate) const FOR_LEARNING: PlaySettings = PlaySettings {
    behaviour: Behaviour::sampled(0.2),
    recording: Recording::ForLearning,
};

/// What [`Team::learnable`] gives.
pub(crate) struct Played {
    /// What happened: episodes without log p(u), whose last bits depend on the parameters.
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

/// A weight for each step of `episodes` \[B\]\[T\], of either sign, that no other step near it has.
pub(crate) fn weights(episodes: &[Episode]) -> Vec<Vec<f32>> {
    let weight = |b: usize, t: usize| ((1 + 5 * b + 3 * t) as f32).sin();
    let episodes = episodes.iter().enumerate();
    episodes
        .map(|(b, episode)| (0..episode.steps()).map(|t| weight(b, t)).collect())
        .collect()
}

fn table(settings: &str) -> toml::Table {
    toml::from_str(settings).expect("TOML")
}
