//! The loss against its equation step by step and against differences, and VDN as a QMIX that adds.

use mackrl_env::{Action, Draw, EpisodeEnd, EpisodeKey, Stream};

use super::*;
use crate::{
    Real,
    algorithms::{Summed, Unmixed},
    critics::{Monotonic, MonotonicSizes},
    experience::{Episode, EpisodeShape, RememberedEpisode, ReplayMemory},
    nn::{NetworkSizes, ParameterLayout},
};

const SHAPE: EpisodeShape = EpisodeShape {
    agents: 2,
    actions: 5,
    observation: 3,
    state: 7,
};
const INPUTS: usize = 3 + 2 + 5;
const GAMMA: f64 = 0.9;

fn numbers(count: usize, kind: usize) -> Vec<f64> {
    let key = EpisodeKey::new(2, Stream::Other, 0);
    (0..count)
        .map(|i| key.normal(kind, Draw::World(i)))
        .collect()
}

/// Three episodes of 5, 3 and 2 steps; time ends the second.
fn episodes() -> Vec<RememberedEpisode> {
    let mut memory = ReplayMemory::new(SHAPE, 3);
    let lengths = [
        (5, EpisodeEnd::Terminated),
        (3, EpisodeEnd::Truncated),
        (2, EpisodeEnd::Terminated),
    ];
    for (number, (steps, end)) in lengths.into_iter().enumerate() {
        let kind = 10 * number;
        let narrow =
            |numbers: Vec<f64>| -> Vec<f32> { numbers.into_iter().map(Real::from_f64).collect() };
        let available: Vec<bool> = (0..(steps + 1) * 10)
            .map(|i| i % 5 == 0 || (i + number) % 3 != 0)
            .collect();
        let available_of = |i: usize, action: usize| available[i * 5 + action];
        let episode = Episode {
            observation_tno: narrow(numbers((steps + 1) * 6, kind)),
            state_tg: narrow(numbers((steps + 1) * 7, kind + 1)),
            reward_t: narrow(numbers(steps, kind + 2)),
            action_tn: (0..2 * steps)
                .map(|i| {
                    (1..5)
                        .rev()
                        .find(|&action| available_of(i, action) && action != i % 5)
                })
                .map(|action| Action::new(action.unwrap_or(0)))
                .collect(),
            available_tna: available.clone(),
            end: Some(end),
            ..Episode::default()
        };
        memory.add(&episode).unwrap();
    }
    (0..3)
        .map(|index| {
            let mut episode = RememberedEpisode::default();
            memory.read(index, &mut episode);
            episode
        })
        .collect()
}

fn minibatch(bootstrap_at_time_limit: bool) -> Minibatch<f64> {
    let episodes = episodes();
    let mut narrow = Minibatch::default();
    let order: Vec<&RememberedEpisode> = episodes.iter().collect();
    narrow.fill(SHAPE, &order, bootstrap_at_time_limit);
    let wide = |numbers: &[f32]| numbers.iter().map(|&x| f64::from(x)).collect();
    Minibatch {
        shown_t: narrow.shown_t.clone(),
        input_rf: wide(&narrow.input_rf),
        available_ra: narrow.available_ra.clone(),
        action_sn: narrow.action_sn.clone(),
        reward_s: wide(&narrow.reward_s),
        state_sg: wide(&narrow.state_sg),
        next_state_sg: wide(&narrow.next_state_sg),
        steps_b: narrow.steps_b.clone(),
        goes_on_b: narrow.goes_on_b,
    }
}

fn agents(layout: &mut ParameterLayout) -> RecurrentNetwork {
    let sizes = NetworkSizes {
        inputs: INPUTS,
        hidden: 3,
        outputs: 5,
    };
    RecurrentNetwork::new(layout, "agent_controller", sizes)
}

fn rule(lambda: f64, double_q: bool) -> Rule<f64> {
    Rule {
        returns: ReturnSettings {
            gamma: GAMMA,
            lambda,
        },
        double_q,
        weight: 0.1,
    }
}

/// The values of all agents of an episode at all times \[T + 1\]\[N\]\[A\], each agent by itself.
fn values(
    network: &RecurrentNetwork,
    parameters: &[f64],
    episode: &RememberedEpisode,
) -> Vec<Vec<Vec<f64>>> {
    let weights = network.weights(parameters);
    let mut values = vec![Vec::new(); episode.steps() + 1];
    for agent in 0..2 {
        let mut trace = Trace::new(network.sizes(), Retention::LastStep);
        trace.begin_episode();
        for (t, value_na) in values.iter_mut().enumerate() {
            let observations = episode.observations(SHAPE, t);
            let own = observations[3 * agent..3 * (agent + 1)].iter();
            let mut input: Vec<f64> = own.map(|&x| f64::from(x)).collect();
            input.extend((0..2).map(|i| f64::from(u8::from(i == agent))));
            let last = (t > 0).then(|| usize::from(episode.action_tn[2 * (t - 1) + agent]));
            input.extend((0..5).map(|i| f64::from(u8::from(Some(i) == last))));
            trace.begin_step(1, None);
            network.step(&weights, &input, &mut trace);
            value_na.push(trace.last_logits().to_vec());
        }
    }
    values
}

/// PyMARL's loss of VDN (or IQL), step by step: squared errors of all steps.
fn literal(
    parameters: [&[f64]; 2],
    (double_q, bootstrap): (bool, bool),
    network: &RecurrentNetwork,
    is_summed: bool,
) -> f64 {
    let mut loss = 0.0;
    for episode in episodes() {
        let [online, target] = parameters.map(|own| values(network, own, &episode));
        for t in 0..episode.steps() {
            let terminated = t + 1 == episode.steps() && !(bootstrap && episode.ends_by_time_limit);
            let (mut taken, mut next) = (Vec::new(), Vec::new());
            for n in 0..2 {
                taken.push(online[t][n][usize::from(episode.action_tn[2 * t + n])]);
                let judge = if double_q { &online } else { &target };
                let available = |a: &usize| episode.available_tna[((t + 1) * 2 + n) * 5 + a];
                let best = (0..5).filter(available).max_by(|&a, &b| {
                    let [a_value, b_value] = [a, b].map(|a| judge[t + 1][n][a]);
                    a_value.total_cmp(&b_value)
                });
                next.push(target[t + 1][n][best.unwrap()]);
            }
            if is_summed {
                (taken, next) = (vec![taken.iter().sum()], vec![next.iter().sum()]);
            }
            for (taken, next) in taken.iter().zip(next) {
                let y =
                    f64::from(episode.reward_t[t]) + if terminated { 0.0 } else { GAMMA * next };
                loss += (taken - y).powi(2);
            }
        }
    }
    loss
}

fn loss<M: Mixer>(
    networks: &Networks<M>,
    [online, target]: [&[f64]; 2],
    rule: Rule<f64>,
    batch: &Minibatch<f64>,
) -> (f64, Vec<f64>) {
    let mut gradient = vec![0.0; online.len()];
    let weights = [online, target].map(|parameters| networks.weights(parameters));
    let sums = networks.differentiate(
        weights.each_ref(),
        rule,
        batch,
        &mut networks.workspace(),
        &mut gradient,
    );
    (sums.errors.loss, gradient)
}

#[test]
fn the_loss_is_that_of_the_equation_step_by_step() {
    let mut layout = ParameterLayout::new();
    let agents = agents(&mut layout);
    let (online, target) = (numbers(layout.len(), 1), numbers(layout.len(), 2));
    let parameters = [online.as_slice(), &target];
    for double_q in [false, true] {
        for bootstrap in [false, true] {
            let batch = minibatch(bootstrap);
            let (rule, choices) = (rule(0.0, double_q), (double_q, bootstrap));
            let summed = Networks {
                agents: agents.clone(),
                mixer: Summed { members: 2 },
            };
            let expected = 0.1 * literal(parameters, choices, &agents, true);
            let (found, _) = loss(&summed, parameters, rule, &batch);
            assert!((found - expected).abs() < 1e-12 * expected, "{found}");
            let unmixed = Networks {
                agents: agents.clone(),
                mixer: Unmixed { members: 2 },
            };
            let expected = 0.1 * literal(parameters, choices, &agents, false);
            let (found, _) = loss(&unmixed, parameters, rule, &batch);
            assert!((found - expected).abs() < 1e-12 * expected, "{found}");
        }
    }
}

/// All gradients of a team with any mixer, against central differences.
fn check_gradient<M: Mixer>(networks: &Networks<M>, parameters: usize, lambda: f64) {
    let (online, target) = (numbers(parameters, 1), numbers(parameters, 2));
    let (rule, batch) = (rule(lambda, true), minibatch(true));
    let (_, gradient) = loss(networks, [&online, &target], rule, &batch);
    let largest = gradient.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
    for i in 0..parameters {
        let [above, below] = [1e-6, -1e-6].map(|step| {
            let mut moved = online.clone();
            moved[i] += step;
            loss(networks, [&moved, &target], rule, &batch).0
        });
        let slope = (above - below) / 2e-6;
        let error = (gradient[i] - slope).abs() / slope.abs().max(0.01 * largest);
        assert!(error < 1e-6, "{i}: {} is not {slope}", gradient[i]);
    }
}

#[test]
fn gradients_are_those_of_the_whole_loss() {
    for lambda in [0.0, 0.6] {
        let mut layout = ParameterLayout::new();
        let agents = agents(&mut layout);
        let members = 2;
        let own = Networks {
            agents: agents.clone(),
            mixer: Unmixed { members },
        };
        check_gradient(&own, layout.len(), lambda);
        let summed = Networks {
            agents: agents.clone(),
            mixer: Summed { members },
        };
        check_gradient(&summed, layout.len(), lambda);
        let sizes = MonotonicSizes {
            state: 7,
            members,
            hidden: 3,
            hypernetwork_hidden: Some(4),
        };
        let mixer = Monotonic::new(&mut layout, sizes);
        let mixed = Networks { agents, mixer };
        check_gradient(&mixed, layout.len(), lambda);
    }
}

#[test]
fn vdn_is_qmix_whose_mixer_adds() {
    let mut layout = ParameterLayout::new();
    let agents = agents(&mut layout);
    let own = layout.len();
    let sizes = MonotonicSizes {
        state: 7,
        members: 2,
        hidden: 1,
        hypernetwork_hidden: None,
    };
    let mixed = Networks {
        agents: agents.clone(),
        mixer: Monotonic::new(&mut layout, sizes),
    };
    let summed = Networks {
        agents,
        mixer: Summed { members: 2 },
    };
    // One unit: its weights are 1, and its bias, which the value takes away again, keeps it where elu is the identity.
    let adding = |kind: usize| -> Vec<f64> {
        let mut parameters = numbers(own, kind);
        parameters.resize(layout.len(), 0.0);
        for (name, value) in [
            ("mixer.first_weight.bias", 1.0),
            ("mixer.first_bias.bias", 100.0),
            ("mixer.second_weight.bias", -1.0),
            ("mixer.value.output.bias", -100.0),
        ] {
            let mut tensors = layout.tensors().iter();
            let tensor = tensors.find(|tensor| tensor.name == name).unwrap();
            parameters[tensor.range.clone()].fill(value);
        }
        parameters
    };
    let (online, target) = (adding(1), adding(2));
    for lambda in [0.0, 0.6] {
        let (rule, batch) = (rule(lambda, true), minibatch(true));
        let (qmix, qmix_gradient) = loss(&mixed, [&online, &target], rule, &batch);
        let (vdn, vdn_gradient) = loss(&summed, [&online[..own], &target[..own]], rule, &batch);
        assert!((qmix - vdn).abs() < 1e-9, "{qmix}, {vdn}");
        for (qmix, vdn) in qmix_gradient.iter().zip(&vdn_gradient) {
            assert!((qmix - vdn).abs() < 1e-9, "{qmix}, {vdn}");
        }
    }
}
