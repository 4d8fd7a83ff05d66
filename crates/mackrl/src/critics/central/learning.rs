//! How the central critic learns from a batch, and the advantages that come out.

use super::{super::explained, CentralCritic, CriticMinibatch};
use crate::{
    NotFinite,
    experience::Episode,
    nn::finite_step,
    objectives::{ReturnSettings, generalised_advantages, lambda_returns},
};

/// What one sweep did: means over its updates, unless something else is said.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CriticReport {
    /// Mean squared error to the λ-returns.
    pub loss: f64,
    /// Norm of the gradient before clipping.
    pub gradient_norm: f64,
    /// Mean |λ-return − V|.
    pub td_error_abs: f64,
    /// Mean λ-return.
    pub target_mean: f64,
    /// `1 − Var(λ-return − V) / Var(λ-return)` over the states of the batch, V being what its *first* sweep met; 0 where λ-returns do
    /// not vary.
    pub explained_variance: f64,
}

/// What a sweep keeps of one episode.
#[derive(Debug, Default)]
struct Sweep {
    /// λ-returns \[T\].
    return_t: Vec<f32>,
    /// V of all states \[T + 1\], each as it was when the sweep passed it.
    value_t: Vec<f32>,
}

/// A state of a batch: the episode and the time.
type Place = (usize, usize);

impl CentralCritic {
    /// Learns from a batch of episodes, in as many sweeps as its settings say, and writes the advantages. Gives what the last sweep
    /// did.
    ///
    /// The targets of a sweep come from the target copy and are fixed before it. [`CriticMinibatch`] says on which states the critic
    /// takes one optimiser step. With those of one time, from the last to the first, advantages use the values that the last sweep
    /// meets on its way: `V(s_{t+1})` before, `V(s_t)` after the update at t + 1. With all states they use the values after the last
    /// update.
    ///
    /// # Shapes
    /// `advantage_bt` becomes \[B\]\[T\], each episode with its own T.
    ///
    /// # Equation
    /// `A_t = r_t + γ V(s_{t+1}) − V(s_t) + γ λ A_{t+1}`, with V = 0 after the end; λ = 0 is the paper's (eq. 6).
    ///
    /// # Errors
    /// [`NotFinite`] if a value, a λ-return, a gradient, or a number after a step is not finite; the critic has taken the steps
    /// before then.
    pub fn learn(
        &mut self,
        episodes: &[&Episode],
        advantage_bt: &mut Vec<Vec<f32>>,
    ) -> Result<CriticReport, NotFinite> {
        let mut report = CriticReport::default();
        let mut explained_variance = None;
        let mut sweeps = Vec::new();
        for _ in 0..self.settings.sweeps {
            if self.refresh_target_if_due() || sweeps.is_empty() {
                sweeps.clear();
                sweeps.extend(episodes.iter().map(|episode| self.prepare(episode)));
            }
            for (sweep, episode) in sweeps.iter_mut().zip(episodes) {
                sweep.value_t[episode.steps()] = self.value_of_end(episode);
            }
            report = self.sweep(episodes, &mut sweeps)?;
            explained_variance.get_or_insert_with(|| {
                let sweeps = sweeps.iter();
                explained(sweeps.flat_map(|sweep| sweep.return_t.iter().zip(&sweep.value_t)))
            });
        }
        report.explained_variance = explained_variance.unwrap_or(0.0);
        if self.settings.minibatch == CriticMinibatch::Batch {
            for (sweep, episode) in sweeps.iter_mut().zip(episodes) {
                let steps = episode.steps();
                self.value_states(episode);
                sweep.value_t[..steps].copy_from_slice(&self.trace.outputs()[..steps]);
                sweep.value_t[steps] = self.value_of_end(episode);
            }
        }
        let settings = ReturnSettings {
            gamma: self.settings.returns.gamma,
            lambda: self.settings.advantage_lambda,
        };
        advantage_bt.clear();
        advantage_bt.extend(sweeps.iter().zip(episodes).map(|(sweep, episode)| {
            let mut advantage_t = vec![0.0; episode.steps()];
            generalised_advantages(
                settings,
                &episode.reward_t,
                &sweep.value_t,
                &mut advantage_t,
            );
            advantage_t
        }));
        Ok(report)
    }

    /// One pass over the batch.
    fn sweep(
        &mut self,
        episodes: &[&Episode],
        sweeps: &mut [Sweep],
    ) -> Result<CriticReport, NotFinite> {
        let steps = |b: usize| episodes[b].steps();
        let longest = (0..episodes.len()).map(steps).max().unwrap_or(0);
        let mut places: Vec<Place> = Vec::new();
        if self.settings.minibatch == CriticMinibatch::Batch {
            places.extend((0..episodes.len()).flat_map(|b| (0..steps(b)).map(move |t| (b, t))));
            return self.update(&places, episodes, sweeps);
        }
        let mut total = CriticReport::default();
        for t in (0..longest).rev() {
            places.clear();
            places.extend(
                (0..episodes.len())
                    .filter(|&b| t < steps(b))
                    .map(|b| (b, t)),
            );
            let report = self.update(&places, episodes, sweeps)?;
            total.loss += report.loss / longest as f64;
            total.gradient_norm += report.gradient_norm / longest as f64;
            total.td_error_abs += report.td_error_abs / longest as f64;
            total.target_mean += report.target_mean / longest as f64;
        }
        Ok(total)
    }

    /// Copies the critic to its target if that is old enough; returns whether it was.
    fn refresh_target_if_due(&mut self) -> bool {
        let is_due =
            self.updates - self.updates_at_refresh >= self.settings.target_interval_updates;
        if is_due {
            self.target_parameters.copy_from_slice(&self.parameters);
            self.network
                .refresh(&self.target_parameters, &mut self.target_weights);
            self.updates_at_refresh = self.updates;
        }
        is_due
    }

    /// Computes an episode's λ-returns from the target copy.
    fn prepare(&mut self, episode: &Episode) -> Sweep {
        let steps = episode.steps();
        self.trace
            .begin(steps + 1)
            .copy_from_slice(&episode.state_tg);
        self.network.forward(&self.target_weights, &mut self.trace);
        let mut value_t = self.trace.outputs().to_vec();
        if !self.has_value_at_end(episode) {
            value_t[steps] = 0.0;
        }
        let mut return_t = vec![0.0; steps];
        lambda_returns(
            self.settings.returns,
            &episode.reward_t,
            &value_t,
            &mut return_t,
        );
        Sweep { return_t, value_t }
    }

    /// Whether the state after the last step counts for something.
    fn has_value_at_end(&self, episode: &Episode) -> bool {
        self.settings.bootstrap_at_time_limit && episode.ends_by_time_limit()
    }

    /// V of the state after the last step, 0 if the game is over.
    fn value_of_end(&mut self, episode: &Episode) -> f32 {
        if self.has_value_at_end(episode) {
            self.value(episode.state(episode.steps()))
        } else {
            0.0
        }
    }

    /// Computes V of all states of an episode.
    pub(super) fn value_states(&mut self, episode: &Episode) {
        self.trace
            .begin(episode.steps() + 1)
            .copy_from_slice(&episode.state_tg);
        self.network.forward(&self.weights, &mut self.trace);
    }

    /// One optimiser step on the states at `places`.
    fn update(
        &mut self,
        places: &[Place],
        episodes: &[&Episode],
        sweeps: &mut [Sweep],
    ) -> Result<CriticReport, NotFinite> {
        let rows = places.len();
        let input = self.trace.begin(rows);
        let state_size = input.len() / rows;
        for (state_g, &(b, t)) in input.chunks_mut(state_size).zip(places) {
            state_g.copy_from_slice(episodes[b].state(t));
        }
        self.network.forward(&self.weights, &mut self.trace);
        let mut report = CriticReport::default();
        let (values, value_gradients) = self.trace.outputs_and_gradient_mut();
        for ((&value, value_gradient), &(b, t)) in values.iter().zip(value_gradients).zip(places) {
            let sweep = &mut sweeps[b];
            let error = value - sweep.return_t[t];
            *value_gradient = 2.0 * error / rows as f32;
            sweep.value_t[t] = value;
            report.loss += f64::from(error).powi(2) / rows as f64;
            report.td_error_abs += f64::from(error.abs()) / rows as f64;
            report.target_mean += f64::from(sweep.return_t[t]) / rows as f64;
        }
        // A sum of magnitudes is finite only if all of them are.
        if !report.td_error_abs.is_finite() {
            return Err(self.broken_error(places, sweeps));
        }
        self.gradient.fill(0.0);
        self.network
            .backward(&self.weights, &mut self.trace, &mut self.gradient);
        report.gradient_norm = finite_step(
            &mut self.optimiser,
            &self.layout,
            [self.settings.learning_rate, self.settings.gradient_norm_max],
            &mut self.gradient,
            &mut self.parameters,
        )?;
        self.network.refresh(&self.parameters, &mut self.weights);
        self.updates += 1;
        Ok(report)
    }

    /// The value or the λ-return that makes an error at one of the `places` infinite or NaN.
    fn broken_error(&self, places: &[Place], sweeps: &[Sweep]) -> NotFinite {
        let of = |row: usize, (b, t): Place| {
            let (value, return_) = (self.trace.outputs()[row], sweeps[b].return_t[t]);
            let numbers = [
                ("λ-return", return_),
                ("value", value),
                ("error of the value", value - return_),
            ];
            let (name, number) = numbers.into_iter().find(|(_, x)| !x.is_finite())?;
            let place = [("episode", b), ("step", t)];
            Some(NotFinite::new(format!("critic.{name}"), &place, number))
        };
        let mut rows = places.iter().enumerate();
        rows.find_map(|(row, &place)| of(row, place))
            .expect("a sum that is not finite has such a term")
    }
}
