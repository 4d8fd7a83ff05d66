//! Learners at work, update by update.

use mackrl::{
    Error, Stopwatch,
    algorithms::{Algorithm, AlgorithmKind, AlgorithmState, StoredState},
    decentralised::{AgentLink, InProcessAgent, Isolation, Repetition, Subject},
    experience::{Collector, PlaySettings},
    nn::ParameterLayout,
    policy::{Behaviour, Recording, Tally},
};
use mackrl_env::{AgentId, EpisodeKey, Stream};
use mackrl_run::training::assembly::RunWorld;

/// A state that was stored, word for word.
pub(crate) struct Stored(pub(crate) AlgorithmState);

impl StoredState for Stored {
    fn tensors(&self, layout: &ParameterLayout) -> Result<Vec<f32>, Error> {
        let own = (self.0.tensors.iter()).find(|(own, _)| own.tensors() == layout.tensors());
        own.map(|(_, values)| values.clone())
            .ok_or_else(|| Error::Data("missing".to_owned()))
    }

    fn counter(&self, name: &str) -> Result<u64, Error> {
        let count = self.0.counters.get(name).copied();
        count.ok_or_else(|| Error::Data(format!("{name} is missing")))
    }
}

/// A learner and the worlds that it plays in.
pub(crate) struct Run {
    pub(crate) algorithm: Box<dyn Algorithm>,
    pub(crate) collector: Collector,
    pub(crate) episodes: u64,
}

impl Run {
    /// A run of 4 environments; the settings, in TOML, lie over each other and over the built-in ones.
    pub(crate) fn new(
        world: &RunWorld,
        kind: &dyn AlgorithmKind,
        settings: [&str; 2],
        threads: usize,
    ) -> Self {
        let mut table = kind.defaults();
        for own in settings {
            table.extend(toml::from_str::<toml::Table>(own).expect("TOML"));
        }
        kind.check(&table, world.spec())
            .expect("settings within their ranges");
        let prior = world.prior();
        let team = mackrl::algorithms::Team {
            spec: world.spec(),
            prior: &prior,
            seed: 1,
            threads,
        };
        let algorithm = kind.build(&table, team).expect("a team that can be built");
        let environments = world.environments(algorithm.environments());
        let collector = Collector::new(
            algorithm.policy(),
            environments,
            algorithm.shards(),
            threads,
        );
        Self {
            algorithm,
            collector,
            episodes: 0,
        }
    }

    pub(crate) fn update(&mut self) -> Tally {
        let keys = [0, 1, 2, 3].map(|i| EpisodeKey::new(1, Stream::Training, self.episodes + i));
        self.episodes += 4;
        let settings = PlaySettings {
            behaviour: self.algorithm.behaviour(0),
            recording: Recording::ForLearning,
        };
        let played = self
            .collector
            .play(self.algorithm.parameters(), &keys, settings);
        played.expect("masks agree with the world");
        let mut batch: Vec<_> = self.collector.pieces().collect();
        let learnt = self.algorithm.learn(&mut batch, &mut Stopwatch::default());
        learnt.expect("finite numbers")
    }

    /// Takes over all tensors of another run that have the same names and sizes.
    pub(crate) fn share(&mut self, other: &Self) {
        let (mut state, own) = (self.algorithm.state(), other.algorithm.state());
        for (layout, values) in &mut state.tensors {
            for tensor in layout.tensors() {
                let found = tensors(&own, &tensor.name);
                if found.len() == tensor.range.len() {
                    values[tensor.range.clone()].copy_from_slice(&found);
                }
            }
        }
        let restored = self.algorithm.restore(&Stored(state));
        restored.expect("its own state");
    }

    /// Asserts that whatever is reported has a meaning, and a finite value.
    pub(crate) fn assert_explained(&mut self) {
        let mut tally = self.update();
        tally.merge(&self.collector.tally());
        let of_policy = self.algorithm.policy().metrics();
        let of_learner = self.algorithm.metrics().iter().map(|(name, _)| *name);
        let names = of_policy.iter().map(|(name, _)| name.as_str());
        let metrics: Vec<&str> = of_learner.chain(names).collect();
        for name in tally.names() {
            let known = metrics
                .iter()
                .any(|known| name == *known || known.ends_with('_') && name.starts_with(known));
            assert!(known, "{name}");
        }
        let are_finite = tally.means().all(|(_, mean)| mean.is_finite());
        assert!(are_finite, "{tally:?}");
    }

    /// Asserts that agents on their own do what the team does, with all checks of the certificate, with exploration ε.
    pub(crate) fn assert_decentralised(&self, world: &RunWorld, exploration: f64) {
        let (policy, parameters) = (self.algorithm.policy(), self.algorithm.parameters());
        let mut links: Vec<Box<dyn AgentLink + '_>> = (0..world.spec().agents)
            .map(|agent| policy.executor(AgentId::new(agent)))
            .map(|executor| {
                Box::new(InProcessAgent::new(executor, parameters)) as Box<dyn AgentLink>
            })
            .collect();
        let mut environment = world.environments(1).remove(0);
        let mut subject = Subject {
            policy,
            parameters,
            environment: &mut *environment,
            repetition: Repetition::Exact,
            isolation: Isolation::None,
            links: &mut links,
            seed: 5,
            sampled: Behaviour::sampled(exploration),
        };
        let certificate = subject.certify(2, |_, _| {}).expect("agents answer");
        assert_eq!(certificate.first_mismatch, None, "an agent differs");
        let compared = certificate.actions_compared > 0 && certificate.altered_actions_compared > 0;
        assert!(compared, "{certificate:?}");
    }
}

/// The values of the tensors whose names begin with `name`.
pub(crate) fn tensors(state: &AlgorithmState, name: &str) -> Vec<f32> {
    let named = state.tensors.iter().flat_map(|(layout, values)| {
        let tensors = layout.tensors().iter();
        tensors.map(move |tensor| (tensor, &values[tensor.range.clone()]))
    });
    named
        .filter(|(tensor, _)| tensor.name.starts_with(name))
        .flat_map(|(_, values)| values.to_vec())
        .collect()
}

/// Asserts that a run has the same bits on any number of threads and after a restoration, and that it changes all that it learns.
pub(crate) fn assert_repeats(world: &RunWorld, kind: &dyn AlgorithmKind, settings: [&str; 2]) {
    let named = format!("{}: {}", kind.name(), settings[1]);
    let [mut whole, mut threads, mut resumed] =
        [1, 3, 2].map(|threads| Run::new(world, kind, settings, threads));
    let initial = whole.algorithm.state();
    for _ in 0..2 {
        assert_eq!(whole.update(), threads.update(), "{named}");
    }
    let stored = Stored(whole.algorithm.state());
    assert_eq!(threads.algorithm.state(), stored.0, "{named}");
    for (layout, before) in &initial.tensors {
        let name = &layout.tensors()[0].name;
        let (_, after) = (stored.0.tensors.iter())
            .find(|(own, _)| own.tensors() == layout.tensors())
            .expect("a learner keeps its tensors");
        assert!(
            name.starts_with("target.") || before != after,
            "{named}: {name}"
        );
    }
    resumed.algorithm.restore(&stored).expect("its own state");
    resumed.episodes = whole.episodes;
    assert_eq!(whole.update(), resumed.update(), "{named}");
    assert_eq!(
        whole.algorithm.state(),
        resumed.algorithm.state(),
        "{named}"
    );
}
