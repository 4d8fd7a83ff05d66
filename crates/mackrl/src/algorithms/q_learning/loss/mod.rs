//! The loss of a minibatch and its gradient: agents' networks, targets, mixer, and the way back.
//!
//! Written once over both kinds of number: learning runs it in `f32`, tests compare it in `f64` with differences.

use super::{choice::best, minibatch::Minibatch};
use crate::{
    critics::Mixer,
    nn::{Element, RecurrentNetwork, RecurrentWeights, Retention, Trace},
    objectives::{ReturnSettings, ValueErrors, lambda_returns, squared_errors},
};

/// The networks of a team, as places in one flat parameter vector: the agents' first.
#[derive(Debug, Clone)]
pub(super) struct Networks<M> {
    pub(super) agents: RecurrentNetwork,
    pub(super) mixer: M,
}

/// Their weights as kernels read them.
#[derive(Debug)]
pub(super) struct Weights<M: Mixer, E: Element> {
    agents: RecurrentWeights<E>,
    mixer: M::Weights<E>,
}

/// How targets are made, and what each error counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule<E> {
    pub(super) returns: ReturnSettings,
    pub(super) double_q: bool,
    pub(super) weight: E,
}

/// Room to work on a minibatch.
#[derive(Debug)]
pub(super) struct Workspace<M: Mixer, E: Element> {
    trace: Trace<E>,
    target_trace: Trace<E>,
    mixer_trace: M::Trace<E>,
    /// Values of what was done, and the target networks' of what is best next \[S, N\].
    chosen_sn: Vec<E>,
    next_sn: Vec<E>,
    d_chosen_sn: Vec<E>,
    /// What mixers make of them \[S, outputs\].
    mixed_so: Vec<E>,
    next_mixed_so: Vec<E>,
    target_so: Vec<E>,
    d_mixed_so: Vec<E>,
}

/// Sums over the steps of a minibatch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) errors: ValueErrors,
    pub(super) value: f64,
    pub(super) target: f64,
    /// Values that were compared with targets.
    pub(super) count: f64,
}

impl Sums {
    pub(super) fn add(&mut self, other: Self) {
        self.errors.loss += other.errors.loss;
        self.errors.absolute += other.errors.absolute;
        self.value += other.value;
        self.target += other.target;
        self.count += other.count;
    }
}

impl<M: Mixer> Networks<M> {
    pub(super) fn weights<E: Element>(&self, parameters: &[E]) -> Weights<M, E> {
        Weights {
            agents: self.agents.weights(parameters),
            mixer: self.mixer.weights(parameters),
        }
    }

    pub(super) fn workspace<E: Element>(&self) -> Workspace<M, E> {
        Workspace {
            trace: Trace::new(self.agents.sizes(), Retention::Episode),
            target_trace: Trace::new(self.agents.sizes(), Retention::LastStep),
            mixer_trace: self.mixer.trace(),
            chosen_sn: Vec::new(),
            next_sn: Vec::new(),
            d_chosen_sn: Vec::new(),
            mixed_so: Vec::new(),
            next_mixed_so: Vec::new(),
            target_so: Vec::new(),
            d_mixed_so: Vec::new(),
        }
    }

    /// Adds the gradient of the loss to `gradient`, and gives what the steps come to.
    ///
    /// # Equation
    /// `w Σ_s (Q(s, u) − y)²` with `y = r + γ Q⁻(s', argmax_u' q(·, u'))`, or the λ-return of these; q and Q are the agents' and the
    /// mixed values, Q⁻ those of the target networks. After an end, y = r.
    pub(super) fn differentiate<E: Element>(
        &self,
        [online, target]: [&Weights<M, E>; 2],
        rule: Rule<E>,
        batch: &Minibatch<E>,
        work: &mut Workspace<M, E>,
        gradient: &mut [E],
    ) -> Sums {
        self.run_agents([online, target], rule, batch, work);
        let outputs = self.mixer.outputs() * batch.steps();
        for numbers in [
            &mut work.mixed_so,
            &mut work.next_mixed_so,
            &mut work.target_so,
            &mut work.d_mixed_so,
        ] {
            numbers.resize(outputs, E::ZERO);
        }
        // The target networks' first: the way back needs what the latest mixing left.
        self.mixer.mix(
            &target.mixer,
            [&batch.next_state_sg, &work.next_sn],
            &mut work.mixer_trace,
            &mut work.next_mixed_so,
        );
        self.mixer.mix(
            &online.mixer,
            [&batch.state_sg, &work.chosen_sn],
            &mut work.mixer_trace,
            &mut work.mixed_so,
        );
        write_targets(
            rule.returns,
            batch,
            &work.next_mixed_so,
            &mut work.target_so,
        );
        let errors = squared_errors(
            rule.weight,
            [&work.mixed_so, &work.target_so],
            &mut work.d_mixed_so,
        );
        work.d_chosen_sn.resize(work.chosen_sn.len(), E::ZERO);
        self.mixer.backward(
            &online.mixer,
            [&work.chosen_sn, &work.d_mixed_so],
            &mut work.mixer_trace,
            &mut work.d_chosen_sn,
            gradient,
        );
        self.write_value_gradients(batch, work);
        self.agents
            .backward(&online.agents, &batch.input_rf, &mut work.trace, gradient);
        let sum = |numbers: &[E]| numbers.iter().map(|number| number.to_f64()).sum();
        Sums {
            errors,
            value: sum(&work.mixed_so),
            target: sum(&work.target_so),
            count: outputs as f64,
        }
    }

    /// Both networks over all times; collects the values of what was done, and of what is best next.
    fn run_agents<E: Element>(
        &self,
        [online, target]: [&Weights<M, E>; 2],
        rule: Rule<E>,
        batch: &Minibatch<E>,
        work: &mut Workspace<M, E>,
    ) {
        let (inputs, actions) = (self.agents.sizes().inputs, self.agents.sizes().outputs);
        let agents = batch.action_sn.len() / batch.steps().max(1);
        work.trace.begin_episode();
        work.target_trace.begin_episode();
        work.chosen_sn.clear();
        work.next_sn.clear();
        let mut first = 0;
        for (t, &shown) in batch.shown_t.iter().enumerate() {
            let rows = shown * agents;
            let x = &batch.input_rf[first * inputs..(first + rows) * inputs];
            let available = &batch.available_ra[first * actions..(first + rows) * actions];
            for (weights, trace) in [(online, &mut work.trace), (target, &mut work.target_trace)] {
                trace.begin_step(rows, None);
                self.agents.step(&weights.agents, x, trace);
            }
            let values = work.trace.last_logits().chunks_exact(actions);
            if let Some(&playing) = batch.shown_t.get(t + 1) {
                let first = agents * batch.first_step(t);
                let actions = &batch.action_sn[first..first + playing * agents];
                let rows = values.clone().zip(actions);
                work.chosen_sn
                    .extend(rows.map(|(value_a, &action)| value_a[action]));
            }
            if t > 0 {
                let target_values = work.target_trace.last_logits().chunks_exact(actions);
                let rows = values
                    .zip(target_values)
                    .zip(available.chunks_exact(actions));
                work.next_sn
                    .extend(rows.map(|((value_a, target_a), available_a)| {
                        let judge = if rule.double_q { value_a } else { target_a };
                        target_a[best(judge, available_a)]
                    }));
            }
            first += rows;
        }
    }

    /// Hands the slopes of the chosen values to the agents' networks.
    fn write_value_gradients<E: Element>(&self, batch: &Minibatch<E>, work: &mut Workspace<M, E>) {
        let actions = self.agents.sizes().outputs;
        let mut chosen = work.d_chosen_sn.iter().zip(&batch.action_sn);
        for t in 0..batch.shown_t.len() {
            let gradient = work.trace.logits_gradient_mut(t);
            gradient.fill(E::ZERO);
            let playing = batch.shown_t.get(t + 1).copied().unwrap_or(0);
            let agents = gradient.len() / actions / batch.shown_t[t].max(1);
            let rows = gradient.chunks_exact_mut(actions).take(playing * agents);
            for (row, (&slope, &action)) in rows.zip(&mut chosen) {
                row[action] = slope;
            }
        }
    }
}

/// Writes what the mixed values are to be.
///
/// # Shapes
/// `next_so` and `target_so` \[S, outputs\].
fn write_targets<E: Element>(
    returns: ReturnSettings,
    batch: &Minibatch<E>,
    next_so: &[E],
    target_so: &mut [E],
) {
    let outputs = next_so.len() / batch.steps().max(1);
    let first_t: Vec<usize> = (0..batch.shown_t.len())
        .map(|t| batch.first_step(t))
        .collect();
    let (mut reward_t, mut value_t, mut return_t) = (Vec::new(), Vec::new(), Vec::new());
    for (b, (&steps, &goes_on)) in batch.steps_b.iter().zip(&batch.goes_on_b).enumerate() {
        for output in 0..outputs {
            reward_t.clear();
            value_t.clear();
            // The value before the first step, which no return reads.
            value_t.push(E::ZERO);
            for &first in &first_t[..steps] {
                reward_t.push(batch.reward_s[first + b]);
                value_t.push(next_so[(first + b) * outputs + output]);
            }
            if !goes_on {
                value_t[steps] = E::ZERO;
            }
            return_t.clear();
            return_t.resize(steps, E::ZERO);
            lambda_returns(returns, &reward_t, &value_t, &mut return_t);
            for (&first, &return_) in first_t.iter().zip(&return_t) {
                target_so[(first + b) * outputs + output] = return_;
            }
        }
    }
}

#[cfg(test)]
mod tests;
