//! What a step of pairwise MACKRL costs beside its environment: `cargo bench -p mackrl-core --bench hierarchy`.
//!
//! Everything is measured in the middle of a battle, where agents see each other and some enemies.

use std::hint::black_box;

use criterion::{
    BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime,
};
use mackrl::{
    algorithms::Algorithm,
    common_knowledge::common_knowledge,
    experience::Experience,
    marginalisation::{MarginalGradient, log_likelihood_with_gradient},
    partition::{Pairs, PartitionSchedule},
    policy::{
        Actor, Behaviour, Declaration, Delegation, PolicyTable, Recording, Selection, Situation,
        TEAM,
    },
};
use mackrl_env::{Action, Environment, EpisodeKey, Observations, Stream};
use mackrl_run::{
    config::Config,
    training::assembly::{self, RunWorld},
};

/// Environments of a shard in training.
const ENVIRONMENTS: usize = 4;
/// Steps after which armies have met.
const STEPS: usize = 12;

fn common_knowledge_of_all_pairs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("common knowledge of all pairs");
    for map in ["3m", "2s3z", "27m_vs_30m"] {
        let scene = Scene::on(map);
        let pairs = Pairs::new(scene.agents);
        let visible_n = scene.observations.visible(0);
        group.bench_function(map, |bencher| {
            bencher.iter(|| {
                for pair in pairs.iter() {
                    black_box(common_knowledge(&pair.agents(), black_box(visible_n)));
                }
            });
        });
    }
    group.finish();
}

fn acting(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("one step of the hierarchy, 4 environments");
    for map in ["3m", "2s3z"] {
        let mut scene = Scene::on(map);
        group.bench_function(map, |bencher| bencher.iter(|| scene.act(STEPS)));
    }
    group.finish();
}

fn marginal(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("marginal with gradient");
    for (agents, actions) in [(3, 9), (5, 11), (8, 14)] {
        let (all, selection) = (PartitionSchedule::All, Selection::Learned);
        let pairwise =
            Declaration::pairwise([agents, actions], all, selection, Delegation::Learned, 1)
                .expect("small teams");
        let fours = Declaration::fours([agents, actions], Selection::Learned, Delegation::Learned)
            .expect("small teams");
        measure(&mut group, "partitions", &pairwise);
        measure(&mut group, "divisions into fours", &fours);
    }
    group.finish();
}

/// Measures the marginal of a team that chooses evenly.
fn measure(group: &mut BenchmarkGroup<'_, WallTime>, what: &str, declaration: &Declaration) {
    let (agents, actions) = (declaration.agents(), declaration.actions());
    let rows: Vec<Vec<f32>> = (declaration.levels().iter())
        .map(|level| {
            let columns = level.columns(actions);
            vec![-(columns as f32).ln(); columns * level.groups.len()]
        })
        .collect();
    let levels: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
    let in_force = &declaration.levels()[TEAM].divisions_gd[0];
    let table =
        PolicyTable::new(declaration, in_force, &levels).expect("the tables fit their declaration");
    let actions_n: Vec<Action> = (0..agents).map(Action::new).collect();
    let mut gradient = MarginalGradient::default();
    let name = format!("{agents} agents, {} {what}", in_force.len());
    group.bench_function(name, |bencher| {
        bencher.iter(|| log_likelihood_with_gradient(&table, black_box(&actions_n), &mut gradient));
    });
}

/// A few battles that have been going on for a while, and the untrained team that fights them.
struct Scene {
    agents: usize,
    environments: Vec<Box<dyn Environment>>,
    observations: Observations,
    keys: Vec<EpisodeKey>,
    team: Box<dyn Algorithm>,
    actor: Box<dyn Actor>,
    experience: Experience,
    actions_bn: Vec<Action>,
    playing: Vec<usize>,
}

impl Scene {
    fn on(map: &str) -> Self {
        let settings = [
            &format!("env.map={map}"),
            "algorithm.name=mackrl",
            "algorithm.partitions=round-robin",
        ];
        let config = Config::with(&settings).expect("a map of this program");
        let world = RunWorld::new(&config).expect("a world of this program");
        let team = assembly::algorithm(&config, &world, 1).expect("a team of this program");
        let environments = world.environments(ENVIRONMENTS);
        let agents = world.spec().agents;
        let episodes = 0..ENVIRONMENTS as u64;
        let mut scene = Self {
            agents,
            environments,
            observations: Observations::new(world.spec(), ENVIRONMENTS),
            keys: episodes
                .map(|episode| EpisodeKey::new(1, Stream::Other, episode))
                .collect(),
            actor: team.policy().actor(ENVIRONMENTS),
            team,
            experience: Experience::default(),
            actions_bn: vec![Action::default(); ENVIRONMENTS * agents],
            playing: (0..ENVIRONMENTS).collect(),
        };
        scene.play();
        scene
    }

    fn play(&mut self) {
        self.actor.begin(Recording::Off, &mut self.experience);
        for (b, environment) in self.environments.iter_mut().enumerate() {
            environment.reset(self.keys[b], &mut self.observations.row_mut(b));
        }
        for step in 0..STEPS {
            self.act(step);
            for (b, environment) in self.environments.iter_mut().enumerate() {
                let actions = &self.actions_bn[b * self.agents..(b + 1) * self.agents];
                let time_step = environment
                    .step(actions, &mut self.observations.row_mut(b))
                    .expect("actors choose available actions");
                assert!(time_step.end.is_none(), "a battle takes longer than this");
            }
        }
    }

    fn act(&mut self, step: usize) {
        let situation = Situation {
            step,
            playing: &self.playing,
            keys: &self.keys,
            observations: &self.observations,
            behaviour: Behaviour::sampled(0.1),
        };
        let parameters = self.team.parameters();
        self.actor
            .act(
                parameters,
                situation,
                &mut self.experience,
                &mut self.actions_bn,
            )
            .expect("logits are finite");
    }
}

criterion_group!(benches, common_knowledge_of_all_pairs, acting, marginal);
criterion_main!(benches);
