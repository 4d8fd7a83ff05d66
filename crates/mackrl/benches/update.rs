//! Learning, on one thread: `cargo bench -p mackrl-core --bench update`.
//!
//! 80 rows are 8 environments with 10 pairs, as `2s3z` has; 24 are those of `3m`, and 12 those of one of its shards.

use criterion::{Criterion, criterion_group, criterion_main};
use mackrl::{
    Stopwatch,
    learner::Learner,
    nn::benchmark::UpdateProbe,
    policy::{Behaviour, Recording},
    rollout::{Rollout, RolloutSettings},
};
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::Config,
    training::assembly::{self, World},
};

const STEPS: usize = 60;
const ENVIRONMENTS: usize = 8;
const SHARD_SIZE: usize = 4;

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

/// Critic, all three levels and the optimiser, again and again on one recorded batch of 8 episodes of `3m`.
fn learner(criterion: &mut Criterion) {
    let config = Config::default();
    let world = World::new(&config).expect("3m is a map of this program");
    let policy = assembly::policy(&config, &world).expect("as above");
    let environments = world.environments(ENVIRONMENTS);
    let sizes = [world.spec().agents, world.spec().state_size];
    let mut learner = Learner::new(&*policy, sizes, assembly::learner(&config), 1, 1);
    let mut rollout = Rollout::new(&*policy, environments, SHARD_SIZE, 1);
    let keys: Vec<EpisodeKey> = (0..ENVIRONMENTS as u64)
        .map(|episode| EpisodeKey::new(1, Stream::Training, episode))
        .collect();
    let settings = RolloutSettings {
        behaviour: Behaviour::sampled(0.1),
        recording: Recording::ForLearning,
    };
    rollout
        .play(learner.weights(), &keys, settings)
        .expect("actors choose available actions");
    criterion.bench_function("update of the learner, 8 episodes of 3m", |bencher| {
        bencher.iter(|| {
            let batches = rollout.batches().collect();
            let report = learner.update(&*policy, batches, &mut Stopwatch::default());
            report.expect("gradients are finite")
        });
    });
}

criterion_group!(benches, pair_controllers, learner);
criterion_main!(benches);
