//! You will see that joint actions are sampled as often as the marginal likelihood, which reads the same table, says.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl::{
    Error,
    marginalisation::log_likelihood,
    partition::PartitionSchedule,
    policy::{
        Declaration, Delegation, DivisionBuffer, Mode, Path, PolicyTable, Sampler, Selection,
    },
};
use mackrl_env::{Action, EpisodeKey, Stream};

const AGENTS: usize = 3;
const ACTIONS: usize = 2;
const EPISODES: u64 = 200_000;

fn main() -> Result<(), Error> {
    let sizes = [AGENTS, ACTIONS];
    let (all, selection) = (PartitionSchedule::All, Selection::Learned);
    let declaration = Declaration::pairwise(sizes, all, selection, Delegation::Learned, 1)?;
    let (key, mut buffer) = (
        EpisodeKey::new(1, Stream::Other, 0),
        DivisionBuffer::default(),
    );
    let partitions = declaration.in_force(&key, 0, &mut buffer);
    let selector_p = log(&[0.5, 0.3, 0.2]);
    // For each pair: delegate, then the joint actions 00, 01, 10, 11. The last pair knows nothing in common.
    let pair_kc = log(&[
        [0.2, 0.1, 0.3, 0.1, 0.3],
        [0.5, 0.0, 0.0, 0.25, 0.25],
        [1.0, 0.0, 0.0, 0.0, 0.0],
    ]
    .concat());
    let agent_na = log(&[0.9, 0.1, 0.4, 0.6, 0.5, 0.5]);
    let table = PolicyTable::new(
        &declaration,
        partitions,
        &[&selector_p, &pair_kc, &agent_na],
    )?;

    let mut counts = [0_u32; 1 << AGENTS];
    let (mut action_n, mut path) = (vec![Action::default(); AGENTS], Path::default());
    for episode in 0..EPISODES {
        let sampler = Sampler {
            key: EpisodeKey::new(1, Stream::Other, episode),
            step: 0,
            mode: Mode::Sampled,
        };
        sampler.walk(&table, None, &mut action_n, &mut path);
        counts[number(&action_n)] += 1;
    }

    println!("joint action   p(u) over all paths   sampled   difference in standard errors");
    let mut total = 0.0;
    for (joint, count) in counts.into_iter().enumerate() {
        let action_n: Vec<Action> = (0..AGENTS).map(|n| Action::new(joint >> n & 1)).collect();
        let p = log_likelihood(&table, &action_n).exp();
        let sampled = f64::from(count) / EPISODES as f64;
        let error = (p * (1.0 - p) / EPISODES as f64).sqrt();
        let names: Vec<String> = action_n.iter().map(ToString::to_string).collect();
        let difference = (sampled - p) / error;
        println!(
            "{:>12} {p:21.4} {sampled:9.4} {difference:31.1}",
            names.join(" ")
        );
        total += p;
    }
    println!("{:>12} {total:21.4}", "sum");
    Ok(())
}

fn log(probabilities: &[f64]) -> Vec<f64> {
    probabilities.iter().map(|p| p.ln()).collect()
}

/// The joint action as a binary number, agent 0 its lowest digit.
fn number(action_n: &[Action]) -> usize {
    let digits = action_n.iter().enumerate();
    digits.map(|(n, action)| action.index() << n).sum()
}
