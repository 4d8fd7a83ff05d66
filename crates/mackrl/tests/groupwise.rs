//! Groups whose choices are weighed by advantages of their own: what they compare with, that the baseline costs nothing, and that
//! they learn.

mod support;

use mackrl::{
    algorithms::{AlgorithmKind, Coma, Iac, MackrlComa},
    common_knowledge::CommonKnowledgeFeatures,
    experience::{Piece, PlaySettings},
    hierarchy::{HierarchySettings, NetworkStyle, Weighing},
    marginalisation::pair::{PairGradient, PairRows, gradient_alone},
    partition::{PartitionSchedule, all_partitions},
    policy::{Behaviour, Declaration, Delegation, Parameters, Recording, Selection},
    tabular::{self, Learner, Logits, PARAMETERS, TabularGame},
};
use mackrl_env::{
    Action, AgentId, Draw, EpisodeKey, Stream,
    matrix_game::{ACTIONS, ObservationDistribution, Payoffs, payoff},
};
use support::{
    Tables, assert_close,
    learner::{Run, assert_repeats, tensors},
    team::{Team, keys, world},
};

const SMALL: &str = "hidden = 5\ncritic_hidden = 7\nenvironments = 4\n";

/// Probabilities, and their logarithms.
fn both(log_p: &[f64]) -> [Vec<f64>; 2] {
    [
        log_p.iter().map(|log_p| log_p.exp()).collect(),
        log_p.to_vec(),
    ]
}

/// One step of five agents under one partition, with a value of each joint action.
struct Step {
    tables: Tables,
    /// Members of each group.
    groups: Vec<Vec<usize>>,
}

impl Step {
    fn random(seed: u64, partition: usize) -> Self {
        let partition = all_partitions(5)[partition].clone();
        let pairs = partition.pairs().iter();
        let pairs = pairs.map(|pair| pair.agents().map(|agent| agent.index()).to_vec());
        let alone = partition.singleton().map(|agent| vec![agent.index()]);
        Self {
            groups: pairs.chain(alone).collect(),
            tables: Tables::random_with(seed, 3, vec![partition]),
        }
    }

    /// Q of a joint action, with nothing that a smooth function would have.
    fn value(u: &[Action]) -> f64 {
        let number = u
            .iter()
            .fold(0, |number, action| number * 3 + action.index());
        (1.7 * number as f64).sin() + (0.9 * (number * number) as f64).cos()
    }

    /// The joint actions that are u but for what a group does, in the order of the group's joint actions.
    fn alternatives(&self, u: &[Action], group: &[usize]) -> Vec<Vec<Action>> {
        let count = (0..group.len()).fold(1, |count, _| count * 3);
        (0..count)
            .map(|number| {
                let mut other = u.to_vec();
                let mut rest = number;
                for &member in group.iter().rev() {
                    other[member] = Action::new(rest % 3);
                    rest /= 3;
                }
                other
            })
            .collect()
    }

    /// What the program computes: Σ over the group's joint actions of its marginal times Q, others as in u.
    fn baseline(&self, u: &[Action], group: &[usize]) -> f64 {
        let values = self.alternatives(u, group);
        let values: Vec<f64> = values.iter().map(|u| Self::value(u)).collect();
        self.with_rows(group, |rows| match rows {
            Rows::Alone([p, _]) => p.iter().zip(&values).map(|(p, v)| p * v).sum(),
            Rows::Pair(rows) => rows.expectation(&values),
        })
    }

    /// By definition, from the probability of whole joint actions alone: the mean of Q under what the others do.
    fn conditional_mean(&self, u: &[Action], group: &[usize]) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for other in self.alternatives(u, group) {
            let p = self.tables.log_likelihood(&other).exp();
            sum += p * Self::value(&other);
            total += p;
        }
        sum / total
    }

    /// ∇ log q of a group with respect to the logits of its pair and of its members, one after the other.
    fn gradient(&self, u: &[Action], group: &[usize]) -> Vec<f64> {
        let actions: Vec<usize> = group.iter().map(|&member| u[member].index()).collect();
        self.with_rows(group, |rows| match rows {
            Rows::Alone([p, log_p]) => {
                let mut gradient = vec![0.0; 3];
                gradient_alone([&p, &log_p], actions[0], [1.0, 0.0], &mut gradient);
                gradient
            }
            Rows::Pair(rows) => {
                let [mut pair, mut first, mut second] = [vec![0.0; 10], vec![0.0; 3], vec![0.0; 3]];
                let to = PairGradient {
                    pair: &mut pair,
                    first: &mut first,
                    second: &mut second,
                };
                rows.gradient([actions[0], actions[1]], [1.0, 0.0], &mut Vec::new(), to);
                [pair, first, second].concat()
            }
        })
    }

    fn with_rows<T>(&self, group: &[usize], run: impl FnOnce(Rows<'_>) -> T) -> T {
        let row = |member: usize| both(self.tables.agent_row(AgentId::new(member)));
        let &[first, second] = group else {
            return run(Rows::Alone(row(group[0])));
        };
        let pairs = self.tables.partitions[0].pairs().iter();
        let mut pairs = pairs.filter(|pair| pair.agents()[0].index() == first);
        let pair = both(
            self.tables
                .pair_row(*pairs.next().expect("a pair in force")),
        );
        let [first, second] = [row(first), row(second)];
        run(Rows::Pair(PairRows {
            pair: [&pair[0], &pair[1]],
            first: [&first[0], &first[1]],
            second: [&second[0], &second[1]],
        }))
    }
}

/// The rows of a group.
enum Rows<'a> {
    Alone([Vec<f64>; 2]),
    Pair(PairRows<'a, f64>),
}

#[test]
fn the_baseline_of_a_group_is_the_mean_of_q_given_what_the_others_do() {
    let mut compared = 0;
    for (seed, partition) in (0..7).zip((0..).step_by(2)) {
        let step = Step::random(seed, partition);
        for u in step.tables.joint_actions() {
            if step.tables.log_likelihood(&u) == f64::NEG_INFINITY {
                continue;
            }
            for group in &step.groups {
                let expected = step.conditional_mean(&u, group);
                assert_close(step.baseline(&u, group), expected, 1e-12);
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "{compared} baselines");
}

/// `Σ_u p(u) Σ_g A_g(u) ∇ log q_g(u_g)`, with every joint action counted: with Q as advantage, and with Q less the baseline.
#[test]
fn the_baseline_leaves_the_expected_gradient_as_it_is() {
    let mut discriminating = [0; 2];
    for (seed, partition) in (0..7).zip((0..).step_by(2)) {
        let step = Step::random(seed, partition);
        for group in &step.groups {
            let [mut without, mut with, mut weighed_wrongly] = [const { Vec::new() }; 3];
            for u in step.tables.joint_actions() {
                let p = step.tables.log_likelihood(&u).exp();
                if p == 0.0 {
                    continue;
                }
                let (q, baseline) = (Step::value(&u), step.baseline(&u, group));
                // A baseline that depends on what the group does is none.
                let wrong = baseline + u[group[0]].index() as f64;
                for (sum, advantage) in [
                    (&mut without, q),
                    (&mut with, q - baseline),
                    (&mut weighed_wrongly, q - wrong),
                ] {
                    let gradient = step.gradient(&u, group);
                    sum.resize(gradient.len(), 0.0);
                    let terms = sum.iter_mut().zip(gradient);
                    terms.for_each(|(sum, gradient)| *sum += p * advantage * gradient);
                }
            }
            let difference = |found: &[f64]| -> f64 {
                let pairs = found.iter().zip(&without);
                pairs
                    .map(|(found, expected)| (found - expected).abs())
                    .sum()
            };
            let size = without.iter().map(|g| g.abs()).sum::<f64>();
            let found = difference(&with);
            assert!(found < 1e-13, "{group:?}: {found}");
            if size > 0.01 && difference(&weighed_wrongly) > 0.01 {
                discriminating[group.len() - 1] += 1;
            }
        }
    }
    let [alone, pairs] = discriminating;
    assert!(alone >= 3 && pairs >= 6, "{alone} agents, {pairs} pairs");
}

/// On the matrix game the expected gradient is known in closed form, with Q(s, u) = R(u): all deals and joint actions are counted.
#[test]
fn on_the_matrix_game_the_expected_gradient_is_that_of_the_return() {
    let key = EpisodeKey::new(3, Stream::Other, 2);
    let logits = Logits(std::array::from_fn(|i| key.normal(0, Draw::Setup(i))));
    for p in [0.0, 0.3, 1.0] {
        let distribution = ObservationDistribution::Y2018;
        let game = TabularGame::new(Payoffs::Printed, distribution, p).unwrap();
        let policy = tabular::Policy::new(Learner::Mackrl, &logits, 1.0);
        let (_, expected) = tabular::expected_return_and_gradient(&game, &policy);
        let mut found = [0.0; PARAMETERS];
        for deal in game.deals() {
            let pair = 50 + 26 * deal.cards.common_knowledge().index();
            let agent = |agent: usize| (5 * agent + deal.cards.observation(agent).index()) * 5;
            let places = [
                pair..pair + 26,
                agent(0)..agent(0) + 5,
                agent(1)..agent(1) + 5,
            ];
            let rows = places
                .clone()
                .map(|own| both(&support::log_softmax(&logits.0[own])));
            let rows = PairRows {
                pair: [&rows[0][0], &rows[0][1]],
                first: [&rows[1][0], &rows[1][1]],
                second: [&rows[2][0], &rows[2][1]],
            };
            let value = |u: usize| {
                let [a, b] = [u / ACTIONS, u % ACTIONS];
                payoff(Payoffs::Printed, deal.cards.matrix, a, b)
            };
            let values: Vec<f64> = (0..ACTIONS * ACTIONS).map(value).collect();
            let baseline = rows.expectation(&values);
            for (u, value) in values.iter().enumerate() {
                let actions = [u / ACTIONS, u % ACTIONS];
                let weight = deal.probability * rows.log_q(actions).exp() * (value - baseline);
                let [mut pair, mut first, mut second] = [vec![0.0; 26], vec![0.0; 5], vec![0.0; 5]];
                let to = PairGradient {
                    pair: &mut pair,
                    first: &mut first,
                    second: &mut second,
                };
                rows.gradient(actions, [weight, 0.0], &mut Vec::new(), to);
                for (own, gradient) in places.clone().into_iter().zip([pair, first, second]) {
                    let terms = found[own].iter_mut().zip(gradient);
                    terms.for_each(|(sum, gradient)| *sum += gradient);
                }
            }
        }
        assert!(expected.iter().any(|g| g.abs() > 0.01), "no gradient");
        for (found, expected) in found.iter().zip(&expected) {
            assert_close(*found, *expected, 1e-14);
        }
    }
}

/// A team in which partitions into pairs take turns.
fn round_robin(map: &str) -> Team {
    let world = world(&[map]);
    let declaration = Declaration::pairwise(
        [world.spec().agents, world.spec().actions],
        PartitionSchedule::RoundRobin,
        Selection::Learned,
        Delegation::Learned,
        1,
    );
    let networks = HierarchySettings {
        common_knowledge: CommonKnowledgeFeatures::Complete,
        hidden: 13,
        networks: NetworkStyle::Plain,
    };
    let declaration = declaration
        .expect("a small team")
        .with_delegation_logit(2.0);
    Team::declared(world, declaration, networks)
}

#[test]
fn what_a_group_expects_of_a_value_is_its_mean_under_the_policy() {
    for (team, pairs) in [
        (Team::central_v(&["env.map=3m"], "hidden = 13"), false),
        (round_robin("env.map=3m"), true),
    ] {
        let parameters = Parameters::new(team.initialise());
        let mut collector = team.collector(2, 1);
        let settings = PlaySettings {
            behaviour: Behaviour::sampled(0.3),
            recording: Recording::ForLearning,
        };
        collector
            .play(&parameters, &keys(2), settings)
            .expect("masks agree with the world");
        let mut pieces: Vec<&mut Piece> = collector.pieces().collect();
        let hierarchy = &team.hierarchy;
        let (experience, activations) = hierarchy
            .networks(&parameters, pieces[0])
            .expect("its own experience");
        let factors = hierarchy.factors(experience, Weighing::Choosing);
        let of_pairs = factors.iter().filter(|factor| factor.second.is_some());
        let of_pairs = of_pairs.count();
        assert!(factors.len() > 50, "{} choices", factors.len());
        assert_eq!(of_pairs > 10, pairs, "{of_pairs} choices of pairs");
        let mut log_q = Vec::new();
        hierarchy.log_q(activations, &factors, &mut log_q);
        let actions = team.world.spec().actions;
        let choices = |place: usize| match factors[place].second {
            Some(_) => actions * actions,
            None => actions,
        };
        let chosen = |place: usize| {
            let factor = &factors[place];
            let taken = experience.episodes[factor.episode].actions(factor.step);
            let members = factor.members();
            members.fold(0, |number, member| number * actions + taken[member].index())
        };
        let (mut total, mut expected) = (vec![0.0; factors.len()], Vec::new());
        for choice in 0..actions * actions {
            let unit: Vec<f32> = (0..actions * actions)
                .map(|own| f32::from(u8::from(own == choice)))
                .collect();
            let value = |place: usize| &unit[..choices(place)];
            hierarchy.expectations(activations, &factors, value, &mut expected);
            for (place, &p) in expected.iter().enumerate() {
                total[place] += p;
                if chosen(place) == choice {
                    assert!((p - log_q[place].exp()).abs() < 1e-6, "{p}");
                }
            }
        }
        for total in total {
            assert!((total - 1.0).abs() < 1e-5, "{total}");
        }
    }
}

#[test]
fn mackrl_coma_that_always_delegates_is_coma_to_the_bit() {
    let world = world(&["env.map=2s3z"]);
    let mut coma = Run::new(&world, &Coma::default(), [SMALL, ""], 1);
    let mut mackrl = Run::new(&world, &MackrlComa, [SMALL, "delegation = \"always\""], 1);
    mackrl.share(&coma);
    for update in 0..3 {
        let reports = [&mut coma, &mut mackrl].map(|run| run.update());
        let states = [&coma, &mackrl].map(|run| run.algorithm.state());
        for name in [
            "agent_controller",
            "critic.",
            "target.critic.",
            "opt.rmsprop.v.agent",
            "opt.rmsprop.v.critic",
        ] {
            let [a, b] = states.each_ref().map(|state| tensors(state, name));
            assert!(!a.is_empty() && a == b, "{name} after update {update}");
        }
        let of_pairs = |name: &str| reports[1].means().find(|(own, _)| *own == name);
        assert_eq!(
            of_pairs("choices_of_pairs"),
            Some(("choices_of_pairs", 0.0))
        );
        assert_eq!(of_pairs("pair_critic_loss"), None);
    }
}

#[test]
fn a_run_has_the_same_bits_on_any_number_of_threads_and_after_a_restoration() {
    let world = world(&["env.map=3m"]);
    let kinds: [(&dyn AlgorithmKind, &str); 4] = [
        (&Iac::default(), ""),
        (&Coma::default(), "shards = 3"),
        (&MackrlComa, "shards = 3\noptimiser = \"adam\""),
        (&MackrlComa, "hold_steps_env = 0\npair_memory = \"episode\""),
    ];
    for (kind, settings) in kinds {
        assert_repeats(&world, kind, [SMALL, settings]);
    }
}

#[test]
fn agents_on_their_own_play_what_the_team_plays_and_all_that_is_reported_is_explained() {
    for map in ["env.map=2s3z", "env.name=matrix-game"] {
        let world = world(&[map]);
        for settings in ["", "hold_steps_env = 3\npair_memory = \"episode\""] {
            let mut run = Run::new(&world, &MackrlComa, [SMALL, settings], 1);
            run.assert_explained();
            run.assert_decentralised(&world, 0.3);
        }
    }
}
