//! Time of a step with random available actions, observations, state and availability included; time of building a world, and
//! of making an environment of one that is built.
//!
//! Episodes are restarted as they end, so the time of a reset is spread over the steps of its episode, as in training.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mackrl_env::random_play::RandomPlay;
use mackrl_skirmish::{PlaceSettings, SkirmishSettings};

const MAPS: &[&str] = &["3m", "2s3z", "27m_vs_30m"];

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    group.throughput(Throughput::Elements(1));
    for name in MAPS {
        let environment =
            mackrl_skirmish::make(name, &SkirmishSettings::default()).expect("a map of this crate");
        let mut play = RandomPlay::new(Box::new(environment), 1);
        group.bench_function(*name, |bencher| {
            bencher.iter(|| black_box(play.step().expect("only available actions are chosen")));
        });
    }
    group.finish();
}

fn world(criterion: &mut Criterion) {
    let settings = SkirmishSettings::default();
    for name in MAPS {
        let place = PlaceSettings {
            map: (*name).to_owned(),
            ..PlaceSettings::default()
        };
        let build = || place.world(&settings).expect("a map of this crate");
        criterion.bench_function(&format!("world/build/{name}"), |bencher| {
            bencher.iter(|| black_box(build()));
        });
        let built = build();
        criterion.bench_function(&format!("world/make/{name}"), |bencher| {
            bencher.iter(|| black_box(built.make()));
        });
    }
}

criterion_group!(benches, step, world);
criterion_main!(benches);
