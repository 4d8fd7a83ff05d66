//! Returns and advantages along an episode: TD(λ) (Sutton and Barto; the paper's critic uses λ = 0.8) and GAE.

use crate::Real;

/// Discount and trace decay of a [`lambda_returns`] computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReturnSettings {
    /// γ, the discount, in [0, 1].
    pub gamma: f64,
    /// λ, the trace decay, in [0, 1]: 0 is one-step TD, 1 is Monte Carlo.
    pub lambda: f64,
}

/// Writes the λ-return of every step of one episode.
///
/// # Shapes
/// `reward_t` and `return_t` have T elements. `value_t` has T + 1: the last is the value of the state after the last step,
/// which must be 0 if nothing comes after it (termination) and may bootstrap if the game would have gone on (truncation).
///
/// # Equation
/// `G_t = r_t + γ (1 − λ) V(s_{t+1}) + γ λ G_{t+1}` for t in 0..T, with `G_T = V(s_T)`.
///
/// # Panics
/// If the lengths do not fit each other.
pub fn lambda_returns<F: Real>(
    settings: ReturnSettings,
    reward_t: &[F],
    value_t: &[F],
    return_t: &mut [F],
) {
    let steps = reward_t.len();
    assert_eq!(
        value_t.len(),
        steps + 1,
        "a value for every state, the last included"
    );
    assert_eq!(return_t.len(), steps, "a return for every step");
    let one_step = F::from_f64(settings.gamma * (1.0 - settings.lambda));
    let traced = F::from_f64(settings.gamma * settings.lambda);
    let mut next_return = value_t[steps];
    for t in (0..steps).rev() {
        next_return = reward_t[t] + one_step * value_t[t + 1] + traced * next_return;
        return_t[t] = next_return;
    }
}

/// Writes the generalised advantage estimate of every step of one episode (Schulman and others, 2016).
///
/// # Shapes
/// As [`lambda_returns`]: `reward_t` and `advantage_t` \[T\], `value_t` \[T + 1\].
///
/// # Equation
/// `δ_t = r_t + γ V(s_{t+1}) − V(s_t)`, `A_t = δ_t + γ λ A_{t+1}` for t in 0..T, with `A_T = 0`.
///
/// # Panics
/// If the lengths do not fit each other.
pub fn generalised_advantages<F: Real>(
    settings: ReturnSettings,
    reward_t: &[F],
    value_t: &[F],
    advantage_t: &mut [F],
) {
    let steps = reward_t.len();
    assert_eq!(
        value_t.len(),
        steps + 1,
        "a value for every state, the last included"
    );
    assert_eq!(advantage_t.len(), steps, "an advantage for every step");
    let gamma = F::from_f64(settings.gamma);
    let traced = F::from_f64(settings.gamma * settings.lambda);
    let mut next = F::ZERO;
    for t in (0..steps).rev() {
        next = reward_t[t] + gamma * value_t[t + 1] - value_t[t] + traced * next;
        advantage_t[t] = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REWARD_T: [f64; 3] = [1.0, 2.0, 4.0];
    const VALUE_T: [f64; 4] = [0.3, 0.5, 0.7, 0.0];

    fn returns(gamma: f64, lambda: f64) -> [f64; 3] {
        let mut return_t = [0.0; 3];
        lambda_returns(
            ReturnSettings { gamma, lambda },
            &REWARD_T,
            &VALUE_T,
            &mut return_t,
        );
        return_t
    }

    #[test]
    fn lambda_zero_is_one_step_temporal_difference() {
        for (t, return_) in returns(0.9, 0.0).into_iter().enumerate() {
            assert!(
                (return_ - (REWARD_T[t] + 0.9 * VALUE_T[t + 1])).abs() < 1e-12,
                "step {t}"
            );
        }
    }

    #[test]
    fn lambda_one_is_the_discounted_sum_of_rewards() {
        let expected = [1.0 + 0.9 * (2.0 + 0.9 * 4.0), 2.0 + 0.9 * 4.0, 4.0];
        for (return_, expected) in returns(0.9, 1.0).into_iter().zip(expected) {
            assert!(
                (return_ - expected).abs() < 1e-12,
                "{return_} is not {expected}"
            );
        }
    }

    /// The definition by the mixture of n-step returns: `G = (1 − λ) Σ_n λ^{n−1} G^{(n)}`, the last with the remaining weight.
    #[test]
    fn the_recursion_equals_the_mixture_of_n_step_returns() {
        let (gamma, lambda) = (0.9_f64, 0.8_f64);
        let power = |base: f64, exponent: usize| base.powf(exponent as f64);
        let n_step = |t: usize, n: usize| {
            let rewards: f64 = (0..n).map(|i| power(gamma, i) * REWARD_T[t + i]).sum();
            rewards + power(gamma, n) * VALUE_T[t + n]
        };
        for (t, return_) in returns(gamma, lambda).into_iter().enumerate() {
            let longest = 3 - t;
            let mixture: f64 = (1..longest)
                .map(|n| (1.0 - lambda) * power(lambda, n - 1) * n_step(t, n))
                .sum::<f64>()
                + power(lambda, longest - 1) * n_step(t, longest);
            assert!(
                (return_ - mixture).abs() < 1e-12,
                "step {t}: {return_} is not {mixture}"
            );
        }
    }

    /// `A_t = G_t − V(s_t)`, whatever λ is.
    #[test]
    fn generalised_advantages_are_returns_less_values() {
        for lambda in [0.0, 0.4, 1.0] {
            let settings = ReturnSettings { gamma: 0.9, lambda };
            let mut advantage_t = [0.0; 3];
            generalised_advantages(settings, &REWARD_T, &VALUE_T, &mut advantage_t);
            for (t, return_) in returns(0.9, lambda).into_iter().enumerate() {
                let expected = return_ - VALUE_T[t];
                assert!(
                    (advantage_t[t] - expected).abs() < 1e-12,
                    "step {t}, λ {lambda}"
                );
            }
        }
    }
}
