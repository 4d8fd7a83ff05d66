//! What judges, and what it learns from: V(state, last actions) of the team, a value of each member that reads what the member
//! sees as well, values of everything that a member or a pair could have done, or a mixture of what members expect of their choices.
//!
//! A critic may be central and see the state, which holds the last actions of all agents. It is needed for learning alone,
//! so it takes nothing away from decentralised execution.

mod central;
mod choices;
mod members;
mod mixers;
mod team;

pub use central::{CentralCritic, CriticMinibatch, CriticReport, CriticSettings, CriticState};
pub use choices::{ChoiceCritic, ChoiceCriticSettings, ChoiceRows};
pub use members::{MemberCritic, MemberCriticSettings, MemberRows};
pub use mixers::{Mixer, Monotonic, MonotonicSizes, MonotonicTrace, MonotonicWeights};
pub use team::{ReturnScale, TeamCritic, TeamCriticSettings, ValueInputs};

use crate::experience::Episode;

/// What the names of the critic's parameters begin with.
const CRITIC: &str = "critic";

/// Goes along the rows of each member through each episode, and writes what `rule` makes of the rewards \[T\] and the values \[T + 1\]
/// there, the last state of an episode being worth nothing: returns or advantages \[T\].
///
/// # Shapes
/// `row` gives the row of step `[episode, t]` and a member, `value` the value of a row, and `result_r` \[R\] has all rows.
pub(crate) fn write_along_members<'e>(
    episodes: impl IntoIterator<Item = &'e Episode>,
    members: usize,
    row: impl Fn([usize; 2], usize) -> usize,
    value: impl Fn(usize) -> f32,
    rule: impl Fn(&[f32], &[f32], &mut [f32]),
    result_r: &mut [f32],
) {
    let (mut value_t, mut result_t) = (Vec::new(), Vec::new());
    for (b, episode) in episodes.into_iter().enumerate() {
        for member in 0..members {
            let rows = (0..episode.steps()).map(|t| row([b, t], member));
            value_t.clear();
            value_t.extend(rows.clone().map(&value));
            value_t.push(0.0);
            result_t.clear();
            result_t.resize(episode.steps(), 0.0);
            rule(&episode.reward_t, &value_t, &mut result_t);
            for (row, &result) in rows.zip(&result_t) {
                result_r[row] = result;
            }
        }
    }
}

/// `1 − Var(return − V) / Var(return)` over pairs of them; 0 where returns do not vary.
fn explained<'a>(pairs: impl Iterator<Item = (&'a f32, &'a f32)>) -> f64 {
    let (mut count, mut returns, mut errors) = (0.0, [0.0; 2], [0.0; 2]);
    for (&return_, &value) in pairs {
        let (return_, error) = (f64::from(return_), f64::from(return_ - value));
        count += 1.0;
        returns = [returns[0] + return_, returns[1] + return_ * return_];
        errors = [errors[0] + error, errors[1] + error * error];
    }
    let variance = |[sum, squares]: [f64; 2]| squares / count - (sum / count).powi(2);
    let of_returns = variance(returns);
    if of_returns > 0.0 {
        1.0 - variance(errors) / of_returns
    } else {
        0.0
    }
}
