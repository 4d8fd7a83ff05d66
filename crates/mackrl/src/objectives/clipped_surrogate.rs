//! The clipped surrogate of proximal policy optimisation (Schulman and others, 2017).

use crate::Real;

/// What a surrogate is and how far the policy has moved.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Surrogate {
    /// The loss.
    pub loss: f64,
    /// Terms without gradient, because their ratio is past its bound.
    pub clipped: f64,
    /// `Σ (ρ − 1 − log ρ)`: an estimate of the divergence from the policy that acted that is never negative.
    pub divergence: f64,
}

/// The loss whose descent follows the clipped surrogate, and its derivative with respect to every log q.
///
/// # Shapes
/// All \[I\]: one term for each choice that is weighed by itself, a group's at a step. `d_log_q_i` becomes as long.
///
/// # Equation
/// With the ratio `ρ_i = q_i / q_i^old`, for i in 0..I
///
/// ```text
/// L = −w Σ_i min( ρ_i A_i, clip(ρ_i, 1 − c, 1 + c) A_i )
/// ∂L / ∂ log q_i = −w ρ_i A_i     where that is the unclipped term, else 0
/// ```
///
/// # Panics
/// If the lengths do not fit each other.
pub fn clipped_surrogate<F: Real>(
    clip: F,
    weight: F,
    [log_q_i, old_log_q_i, advantage_i]: [&[F]; 3],
    d_log_q_i: &mut Vec<F>,
) -> Surrogate {
    assert_eq!(
        log_q_i.len(),
        old_log_q_i.len(),
        "a behaviour for each term"
    );
    assert_eq!(
        log_q_i.len(),
        advantage_i.len(),
        "an advantage for each term"
    );
    let mut result = Surrogate::default();
    d_log_q_i.clear();
    for ((&log_q, &old), &advantage) in log_q_i.iter().zip(old_log_q_i).zip(advantage_i) {
        let log_ratio = log_q - old;
        let ratio = log_ratio.exp();
        let least = F::ONE - clip;
        let most = F::ONE + clip;
        let bounded = if ratio < least {
            least
        } else if ratio > most {
            most
        } else {
            ratio
        };
        let (free, bound) = (ratio * advantage, bounded * advantage);
        let is_free = free <= bound;
        d_log_q_i.push(if is_free { -weight * free } else { F::ZERO });
        result.loss -= (weight * if is_free { free } else { bound }).to_f64();
        result.clipped += f64::from(u8::from(!is_free));
        result.divergence += ratio.to_f64() - 1.0 - log_ratio.to_f64();
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: [f64; 6] = [-1.0, -0.5, -2.0, -1.5, -0.7, -1.2];
    /// Ratios below, within and above the bounds, with advantages of both signs.
    const MOVE: [f64; 6] = [-0.5, -0.5, 0.05, -0.04, 0.4, 0.4];
    const ADVANTAGE: [f64; 6] = [1.0, -2.0, 0.5, -1.5, 3.0, -0.25];

    fn run(log_q: &[f64]) -> (Surrogate, Vec<f64>) {
        let mut d = Vec::new();
        let result = clipped_surrogate(0.2, 0.5, [log_q, &OLD, &ADVANTAGE], &mut d);
        (result, d)
    }

    fn moved() -> Vec<f64> {
        OLD.iter().zip(MOVE).map(|(old, by)| old + by).collect()
    }

    #[test]
    fn the_loss_is_that_of_the_formula_term_by_term() {
        let terms = MOVE.iter().zip(ADVANTAGE).map(|(by, advantage)| {
            let ratio = by.exp();
            (ratio * advantage).min(ratio.clamp(0.8, 1.2) * advantage)
        });
        let expected = -0.5 * terms.sum::<f64>();
        let (found, d) = run(&moved());
        assert!((found.loss - expected).abs() < 1e-12);
        // A good choice is not made more likely past its bound, a bad one not less.
        let without: Vec<bool> = d.iter().map(|d| *d == 0.0).collect();
        assert_eq!(without, [false, true, false, false, true, false]);
        assert_eq!(found.clipped, 2.0);
    }

    #[test]
    fn the_derivative_is_that_of_the_loss() {
        let at = moved();
        let (_, d) = run(&at);
        for i in 0..at.len() {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut log_q = at.clone();
                log_q[i] += step;
                run(&log_q).0.loss
            });
            let slope = (above - below) / 2e-6;
            assert!((d[i] - slope).abs() < 1e-8, "{i}: {} {slope}", d[i]);
        }
    }

    #[test]
    fn where_nothing_has_moved_it_is_the_policy_gradient() {
        let (result, d) = run(&OLD);
        for (d, advantage) in d.iter().zip(ADVANTAGE) {
            assert_eq!(*d, -0.5 * advantage);
        }
        assert_eq!((result.clipped, result.divergence), (0.0, 0.0));
    }
}
