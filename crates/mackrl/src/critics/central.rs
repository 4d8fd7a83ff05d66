//! The central critic and its sweep backwards through time.

use mackrl_env::EpisodeKey;

use crate::{
    NotFinite,
    experience::Episode,
    nn::{
        FeedForward, FeedForwardTrace, FeedForwardWeights, Moments, NetworkSizes, Optimiser,
        OptimiserKind, ParameterLayout, finite_step,
    },
    objectives::{ReturnSettings, lambda_returns},
};

/// How the critic learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticSettings {
    /// H: width of the hidden layer, at least 1.
    pub hidden: usize,
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size, > 0.
    pub learning_rate: f64,
    /// Largest norm of a gradient, > 0; longer ones are scaled down.
    pub gradient_norm_max: f64,
    /// γ and λ of the returns.
    pub returns: ReturnSettings,
    /// Critic updates after which the target copy is refreshed.
    pub target_interval_updates: u64,
    /// Whether the state at which time ran out has a value; otherwise a time limit counts as the end of the game.
    pub bootstrap_at_time_limit: bool,
}

/// What one sweep did; means over its updates.
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
}

/// All that a critic has learnt: with its settings, everything that its future depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticState {
    /// The parameters.
    pub parameters: Vec<f32>,
    /// Those of the target copy.
    pub target_parameters: Vec<f32>,
    /// What the optimiser remembers.
    pub moments: Moments<f32>,
    /// Updates so far.
    pub updates: u64,
    /// Updates when the target copy was refreshed.
    pub updates_at_refresh: u64,
}

/// V(s), a feed-forward network, with a target copy.
#[derive(Debug)]
pub struct CentralCritic {
    settings: CriticSettings,
    layout: ParameterLayout,
    network: FeedForward,
    parameters: Vec<f32>,
    weights: FeedForwardWeights<f32>,
    target_parameters: Vec<f32>,
    target_weights: FeedForwardWeights<f32>,
    optimiser: Optimiser<f32>,
    gradient: Vec<f32>,
    trace: FeedForwardTrace<f32>,
    updates: u64,
    updates_at_refresh: u64,
}

/// What the sweep keeps of one episode.
#[derive(Debug, Default)]
struct Sweep {
    /// λ-returns \[T\].
    return_t: Vec<f32>,
    /// `r_t + γ V(s_{t+1}) − V(s_t)` \[T\].
    advantage_t: Vec<f32>,
    /// V(s_{t+1}) as it was when the sweep passed it.
    next_value: f32,
}

impl CentralCritic {
    /// A critic for states of `state_size` numbers; initial parameters are drawn from `key`.
    #[must_use]
    pub fn new(state_size: usize, settings: CriticSettings, key: &EpisodeKey) -> Self {
        let sizes = NetworkSizes {
            inputs: state_size,
            hidden: settings.hidden,
            outputs: 1,
        };
        let mut layout = ParameterLayout::new();
        let network = FeedForward::new(&mut layout, super::CRITIC, sizes);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(key, &mut parameters);
        let optimiser = Optimiser::new(settings.optimiser, parameters.len());
        Self {
            settings,
            weights: network.weights(&parameters),
            target_parameters: parameters.clone(),
            target_weights: network.weights(&parameters),
            optimiser,
            gradient: vec![0.0; parameters.len()],
            trace: FeedForwardTrace::new(sizes),
            layout,
            network,
            parameters,
            updates: 0,
            updates_at_refresh: 0,
        }
    }

    /// How many parameters a critic for states of `state_size` numbers has.
    #[must_use]
    pub fn size(state_size: usize, hidden: usize) -> usize {
        let sizes = NetworkSizes {
            inputs: state_size,
            hidden,
            outputs: 1,
        };
        let mut layout = ParameterLayout::new();
        FeedForward::new(&mut layout, super::CRITIC, sizes);
        layout.len()
    }

    /// Names and shapes of the parameters.
    #[must_use]
    pub const fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Takes other parameters, to be asked for values.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.network.refresh(parameters, &mut self.weights);
        self.parameters.copy_from_slice(parameters);
    }

    /// V(s) of the state \[G\].
    ///
    /// # Panics
    /// If the state has another size.
    pub fn value(&mut self, state_g: &[f32]) -> f32 {
        self.trace.begin(1).copy_from_slice(state_g);
        self.network.forward(&self.weights, &mut self.trace);
        self.trace.outputs()[0]
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub fn state(&self) -> CriticState {
        CriticState {
            parameters: self.parameters.clone(),
            target_parameters: self.target_parameters.clone(),
            moments: self.optimiser.moments().clone(),
            updates: self.updates,
            updates_at_refresh: self.updates_at_refresh,
        }
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the state is that of a critic of another size or optimiser.
    pub fn restore(&mut self, state: CriticState) {
        self.network.refresh(&state.parameters, &mut self.weights);
        self.network
            .refresh(&state.target_parameters, &mut self.target_weights);
        self.optimiser.restore(state.moments);
        self.parameters = state.parameters;
        self.target_parameters = state.target_parameters;
        self.updates = state.updates;
        self.updates_at_refresh = state.updates_at_refresh;
    }

    /// Learns from a batch of episodes and writes their advantages.
    ///
    /// Targets come from the target copy and are fixed before the sweep. Then, from the last time step to the first, the
    /// critic takes one optimiser step on the states of that time step (one per episode that lasted so long). Advantages use
    /// the values that the sweep meets on its way: `V(s_{t+1})` before, `V(s_t)` after the update at t + 1.
    ///
    /// # Shapes
    /// `advantage_bt` becomes \[B\]\[T\], each episode with its own T.
    ///
    /// # Equation
    /// `A_t = r_t + γ V(s_{t+1}) − V(s_t)`, with V = 0 after the end (eq. 6).
    ///
    /// # Errors
    /// [`NotFinite`] if a value, a λ-return, a gradient, or a number after a step is not finite; the critic has taken the steps
    /// before then.
    pub fn sweep(
        &mut self,
        episodes: &[&Episode],
        advantage_bt: &mut Vec<Vec<f32>>,
    ) -> Result<CriticReport, NotFinite> {
        self.refresh_target_if_due();
        let prepared = episodes.iter().map(|episode| self.prepare_sweep(episode));
        let mut sweeps: Vec<Sweep> = prepared.collect();
        let longest = episodes
            .iter()
            .map(|episode| episode.steps())
            .max()
            .unwrap_or(0);
        let mut total = CriticReport::default();
        for t in (0..longest).rev() {
            let report = self.update(t, episodes, &mut sweeps)?;
            total.loss += report.loss / longest as f64;
            total.gradient_norm += report.gradient_norm / longest as f64;
            total.td_error_abs += report.td_error_abs / longest as f64;
            total.target_mean += report.target_mean / longest as f64;
        }
        advantage_bt.clear();
        advantage_bt.extend(sweeps.into_iter().map(|sweep| sweep.advantage_t));
        Ok(total)
    }

    fn refresh_target_if_due(&mut self) {
        if self.updates - self.updates_at_refresh >= self.settings.target_interval_updates {
            self.target_parameters.copy_from_slice(&self.parameters);
            self.network
                .refresh(&self.target_parameters, &mut self.target_weights);
            self.updates_at_refresh = self.updates;
        }
    }

    /// Computes an episode's λ-returns from the target copy.
    fn prepare_sweep(&mut self, episode: &Episode) -> Sweep {
        let steps = episode.steps();
        self.trace
            .begin(steps + 1)
            .copy_from_slice(&episode.state_tg);
        self.network.forward(&self.target_weights, &mut self.trace);
        let mut value_t = self.trace.outputs().to_vec();
        let mut next_value = 0.0;
        if self.settings.bootstrap_at_time_limit && episode.ends_by_time_limit() {
            self.trace.begin(1).copy_from_slice(episode.state(steps));
            self.network.forward(&self.weights, &mut self.trace);
            next_value = self.trace.outputs()[0];
        } else {
            value_t[steps] = 0.0;
        }
        let mut return_t = vec![0.0; steps];
        lambda_returns(
            self.settings.returns,
            &episode.reward_t,
            &value_t,
            &mut return_t,
        );
        Sweep {
            return_t,
            advantage_t: vec![0.0; steps],
            next_value,
        }
    }

    /// One optimiser step on the states at time `t`.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "γ is rounded to the networks' precision"
    )]
    fn update(
        &mut self,
        t: usize,
        episodes: &[&Episode],
        sweeps: &mut [Sweep],
    ) -> Result<CriticReport, NotFinite> {
        let gamma = self.settings.returns.gamma as f32;
        let live = || (0..episodes.len()).filter(|&b| t < episodes[b].steps());
        let rows = live().count();
        let input = self.trace.begin(rows);
        let state_size = input.len() / rows;
        for (state_g, b) in input.chunks_mut(state_size).zip(live()) {
            state_g.copy_from_slice(episodes[b].state(t));
        }
        self.network.forward(&self.weights, &mut self.trace);
        let mut report = CriticReport::default();
        let (values, value_gradients) = self.trace.outputs_and_gradient_mut();
        for ((&value, value_gradient), b) in values.iter().zip(value_gradients).zip(live()) {
            let sweep = &mut sweeps[b];
            let error = value - sweep.return_t[t];
            *value_gradient = 2.0 * error / rows as f32;
            sweep.advantage_t[t] = episodes[b].reward_t[t] + gamma * sweep.next_value - value;
            sweep.next_value = value;
            report.loss += f64::from(error).powi(2) / rows as f64;
            report.td_error_abs += f64::from(error.abs()) / rows as f64;
            report.target_mean += f64::from(sweep.return_t[t]) / rows as f64;
        }
        // A sum of magnitudes is finite only if all of them are.
        if !report.td_error_abs.is_finite() {
            return Err(self.broken_error(t, &live().collect::<Vec<_>>(), sweeps));
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

    /// The value or the λ-return that makes an error at time `t` infinite or NaN.
    fn broken_error(&self, t: usize, live: &[usize], sweeps: &[Sweep]) -> NotFinite {
        let of = |row: usize, b: usize| {
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
        let mut rows = live.iter().enumerate();
        rows.find_map(|(row, &b)| of(row, b))
            .expect("a sum that is not finite has such a term")
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::{EpisodeEnd, Stream};

    use super::*;

    const STATE_SIZE: usize = 2;

    fn critic(learning_rate: f64, target_interval_updates: u64, bootstrap: bool) -> CentralCritic {
        let settings = CriticSettings {
            hidden: 5,
            optimiser: OptimiserKind::ADAM,
            learning_rate,
            gradient_norm_max: 10.0,
            returns: ReturnSettings {
                gamma: 0.9,
                lambda: 0.5,
            },
            target_interval_updates,
            bootstrap_at_time_limit: bootstrap,
        };
        CentralCritic::new(STATE_SIZE, settings, &EpisodeKey::new(1, Stream::Other, 1))
    }

    fn two_steps(end: EpisodeEnd) -> Episode {
        Episode {
            state_tg: vec![0.5, -1.0, 2.0, 0.3, -0.7, 1.1],
            reward_t: vec![3.0, 7.0],
            end: Some(end),
            ..Episode::default()
        }
    }

    /// V of the three states of an episode.
    fn values(critic: &mut CentralCritic, episode: &Episode) -> [f32; 3] {
        critic.trace.begin(3).copy_from_slice(&episode.state_tg);
        critic.network.forward(&critic.weights, &mut critic.trace);
        let values = critic.trace.outputs();
        [values[0], values[1], values[2]]
    }

    /// With a step size that changes nothing, V is the same throughout a sweep.
    #[test]
    fn advantages_of_two_steps_are_those_worked_by_hand() {
        let cases = [
            (EpisodeEnd::Terminated, true, 0.0),
            (EpisodeEnd::Truncated, false, 0.0),
            (EpisodeEnd::Truncated, true, 0.9),
        ];
        for (end, bootstrap, discount_at_end) in cases {
            let mut critic = critic(1e-30, 200, bootstrap);
            let episode = two_steps(end);
            let [first, second, last] = values(&mut critic, &episode);
            let mut advantage_bt = Vec::new();
            let report = critic.sweep(&[&episode], &mut advantage_bt).unwrap();
            let expected = [
                3.0 + 0.9 * second - first,
                7.0 + discount_at_end * last - second,
            ];
            for (found, expected) in advantage_bt[0].iter().zip(expected) {
                assert!((found - expected).abs() < 1e-5, "{end:?}: {advantage_bt:?}");
            }
            let return_1 = 7.0 + discount_at_end * last;
            let return_0 = 3.0 + 0.9 * (0.5 * second + 0.5 * return_1);
            let target_mean = f64::from((return_0 + return_1) / 2.0);
            assert!(
                (report.target_mean - target_mean).abs() < 1e-5,
                "{report:?}"
            );
        }
    }

    /// An episode of two steps makes two updates, so an interval of three has passed before the third sweep, not the second.
    #[test]
    fn targets_change_when_the_interval_has_passed() {
        let mut critic = critic(0.01, 3, false);
        let episode = two_steps(EpisodeEnd::Terminated);
        let mut targets = || {
            let report = critic.sweep(&[&episode], &mut Vec::new()).unwrap();
            report.target_mean
        };
        let [first, second, third] = [targets(), targets(), targets()];
        assert_eq!(first, second);
        assert_ne!(second, third);
    }
}
