//! One update of the pair controllers, one thread: `cargo bench -p mackrl --bench update`.
//!
//! 80 rows are 8 environments with 10 pairs; 6 and 12 rows are what `3m` has.

use criterion::{Criterion, criterion_group, criterion_main};
use mackrl::nn::benchmark::UpdateProbe;

const STEPS: usize = 60;

fn update(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update");
    for rows in [80, 24, 12, 6] {
        let mut probe = UpdateProbe::new(UpdateProbe::PAIR_CONTROLLER, rows, STEPS);
        group.bench_function(format!("{rows} rows, {STEPS} steps"), |bencher| {
            bencher.iter(|| probe.run());
        });
    }
    group.finish();
}

criterion_group!(benches, update);
criterion_main!(benches);
