//! Time of a step with random available actions, observations, state and availability included.
//!
//! Episodes are restarted as they end, so the time of a reset is spread over the steps of its episode, as in training.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mackrl_env::{
    Action, AgentId, Draw, Environment, EpisodeKey, Observations, Stream, registry,
    skirmish::SkirmishSettings,
};

const MAPS: &[&str] = &["3m", "2s3z", "MMM2", "27m_vs_30m", "2c_vs_64zg"];
/// Steps whose actions are drawn before the clock runs.
const DRAWS: usize = 64;

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    group.throughput(Throughput::Elements(1));
    for name in MAPS {
        let Ok(mut environment) = registry::make(name, &SkirmishSettings::default()) else {
            continue;
        };
        let mut player = Player::new(environment.as_ref());
        player.reset(environment.as_mut());
        group.bench_function(*name, |bencher| {
            bencher.iter(|| black_box(player.step(environment.as_mut())));
        });
    }
    group.finish();
}

/// Plays random available actions for ever.
struct Player {
    observations: Observations,
    actions: Vec<Action>,
    uniform: Vec<f64>,
    episode: u64,
    draw: usize,
}

impl Player {
    fn new(environment: &dyn Environment) -> Self {
        let key = EpisodeKey::new(1, Stream::Other, 0);
        let agents = environment.spec().agents;
        Self {
            observations: Observations::new(environment.spec(), 1),
            actions: vec![Action::default(); agents],
            uniform: (0..agents * DRAWS)
                .map(|i| key.uniform(0, Draw::Setup(i)))
                .collect(),
            episode: 0,
            draw: 0,
        }
    }

    fn reset(&mut self, environment: &mut dyn Environment) {
        let key = EpisodeKey::new(1, Stream::Other, self.episode);
        environment.reset(key, &mut self.observations.row_mut(0));
        self.episode += 1;
    }

    fn step(&mut self, environment: &mut dyn Environment) -> f32 {
        for (agent, action) in self.actions.iter_mut().enumerate() {
            let view = self.observations.local_view(0, AgentId::new(agent));
            self.draw = (self.draw + 1) % self.uniform.len();
            *action = nth_available(view.available(), self.uniform[self.draw]);
        }
        let time_step = environment
            .step(&self.actions, &mut self.observations.row_mut(0))
            .expect("only available actions are chosen");
        if time_step.end.is_some() {
            self.reset(environment);
        }
        time_step.reward
    }
}

fn nth_available(available: &[bool], uniform: f64) -> Action {
    let count = available
        .iter()
        .filter(|is_available| **is_available)
        .count();
    let mut left = uniform * count as f64;
    let is_chosen = |is_available: &bool| {
        left -= f64::from(u8::from(*is_available));
        *is_available && left < 0.0
    };
    Action::new(available.iter().position(is_chosen).unwrap_or(0))
}

criterion_group!(benches, step);
criterion_main!(benches);
