//! Learning, on one thread: `cargo bench -p mackrl-core --bench update`.
//!
//! 80 rows are 8 environments with 10 pairs, as `2s3z` has; 24 are those of `3m`, and 12 those of one of its shards.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use mackrl::{
    Stopwatch,
    algorithms::Algorithm,
    experience::{Collector, PlaySettings},
    nn::benchmark::UpdateProbe,
    policy::{Behaviour, Recording},
};
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::Config,
    training::assembly::{self, RunWorld},
};

const STEPS: usize = 60;
const ENVIRONMENTS: usize = 8;
const SHARDS: usize = 2;

fn pair_controllers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update of the pair controllers");
    for rows in [80, 24, 12] {
        let mut probe = UpdateProbe::new(UpdateProbe::PAIR_CONTROLLER, rows, STEPS);
        group.bench_function(format!("{rows} rows, {STEPS} steps"), |bencher| {
            bencher.iter(|| probe.run());
        });
    }
    group.finish();
}

/// Episodes of `3m`, and the team that has played them and learns.
struct Lesson {
    team: Box<dyn Algorithm>,
    collector: Collector,
}

impl Lesson {
    fn new() -> Self {
        let config =
            Config::with(&["algorithm.name=mackrl"]).expect("an algorithm of this program");
        let world = RunWorld::new(&config).expect("3m is a map of this program");
        let team = assembly::algorithm(&config, &world, 1).expect("as above");
        let environments = world.environments(ENVIRONMENTS);
        let collector = Collector::new(team.policy(), environments, SHARDS, 1);
        Self { team, collector }
    }

    fn play(&mut self) {
        let keys: Vec<EpisodeKey> = (0..ENVIRONMENTS as u64)
            .map(|episode| EpisodeKey::new(1, Stream::Training, episode))
            .collect();
        let settings = PlaySettings {
            behaviour: Behaviour::sampled(0.1),
            recording: Recording::ForLearning,
        };
        self.collector
            .play(self.team.parameters(), &keys, settings)
            .expect("actors choose available actions");
    }

    fn learn(&mut self) {
        let mut batch: Vec<_> = self.collector.pieces().collect();
        let report = self.team.learn(&mut batch, &mut Stopwatch::default());
        report.expect("gradients are finite");
    }
}

/// Critic, all three levels and the optimiser on a batch of 8 episodes of `3m`: as in training, where the activations that were
/// kept while acting serve the update, and again on a batch that was learnt from before, which has to compute them anew.
/// Playing is not measured.
fn learner(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update of the learner, 8 episodes of 3m");
    group.bench_function("just played", |bencher| {
        // The same state for every measurement: an untrained team plays, then learns.
        let played = || {
            let mut lesson = Lesson::new();
            lesson.play();
            lesson
        };
        bencher.iter_batched_ref(played, Lesson::learn, BatchSize::PerIteration);
    });
    group.bench_function("learnt from before", |bencher| {
        let mut lesson = Lesson::new();
        lesson.play();
        lesson.learn();
        bencher.iter(|| lesson.learn());
    });
    group.finish();
}

criterion_group!(benches, pair_controllers, learner);
criterion_main!(benches);
