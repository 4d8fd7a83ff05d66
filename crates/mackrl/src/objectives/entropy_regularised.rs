//! The policy gradient of return and entropy together (Williams and Peng, 1991), for the entropy of the *joint* action.
//!
//! The entropy of what the team does, over all ways to it, is what counts: a bonus on the heads of single controllers would
//! reward a pair controller for never delegating, which has more choices than delegating has.

/// The loss `−J` whose gradient is the entropy-regularised policy gradient, and its derivative with respect to every log p(u).
///
/// # Shapes
/// As [`policy_gradient`](super::policy_gradient), which it equals for τ = 0.
///
/// # Equation
/// The gradient of the entropy `H = −E log p(u)` is `−E[ log p(u) ∇ log p(u) ]`, so with the weight τ ≥ 0 of the entropy, for b in 0..B
/// and t in 0..`T_b`
///
/// ```text
/// J = Σ_{b,t} w_t ( A_bt log p(u_bt) − τ/2 (log p(u_bt))² )       ∂(−J) / ∂ log p(u_bt) = −w_t ( A_bt − τ log p(u_bt) )
/// ```
///
/// # Panics
/// If the lengths do not fit each other.
#[must_use]
pub fn entropy_regularised(
    log_p_bt: &[Vec<f32>],
    advantage_bt: &[Vec<f32>],
    weight_t: &[f32],
    entropy_weight: f32,
    d_log_p_bt: &mut Vec<Vec<f32>>,
) -> f64 {
    assert_eq!(log_p_bt.len(), advantage_bt.len(), "advantages are [B][T]");
    d_log_p_bt.resize_with(log_p_bt.len(), Vec::new);
    let mut loss = 0.0;
    for ((log_p_t, advantage_t), d_log_p_t) in log_p_bt.iter().zip(advantage_bt).zip(d_log_p_bt) {
        assert_eq!(log_p_t.len(), advantage_t.len(), "advantages are [B][T]");
        assert!(log_p_t.len() <= weight_t.len(), "every step has a weight");
        d_log_p_t.clear();
        for ((&log_p, &advantage), &weight) in log_p_t.iter().zip(advantage_t).zip(weight_t) {
            let bonus = entropy_weight * log_p;
            d_log_p_t.push(-weight * (advantage - bonus));
            loss -= f64::from(weight * log_p) * f64::from(advantage - 0.5 * bonus);
        }
    }
    loss
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objectives::policy_gradient;

    fn example() -> (Vec<Vec<f32>>, Vec<Vec<f32>>, Vec<f32>) {
        let log_p = vec![vec![-0.5, -1.25, -2.0], vec![-0.25, -3.0]];
        let advantage = vec![vec![2.0, -1.0, 0.5], vec![-4.0, 1.5]];
        (log_p, advantage, vec![0.5, 0.25, 0.125])
    }

    #[test]
    fn without_entropy_it_is_the_policy_gradient() {
        let (log_p, advantage, weight) = example();
        let (mut plain, mut own) = (Vec::new(), Vec::new());
        let expected = policy_gradient(&log_p, &advantage, &weight, &mut plain);
        let found = entropy_regularised(&log_p, &advantage, &weight, 0.0, &mut own);
        assert_eq!(own, plain);
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    /// Also rejects the derivative of another weight.
    #[test]
    fn the_derivative_is_that_of_the_loss() {
        let (log_p, advantage, weight) = example();
        let derivative = |tau: f32| {
            let mut d = Vec::new();
            let _ = entropy_regularised(&log_p, &advantage, &weight, tau, &mut d);
            d
        };
        let slope = |b: usize, t: usize| {
            let [above, below] = [0.125_f32, -0.125].map(|h| {
                let mut moved = log_p.clone();
                moved[b][t] += h;
                entropy_regularised(&moved, &advantage, &weight, 0.25, &mut Vec::new())
            });
            (above - below) / 0.25
        };
        let error = |d: &[Vec<f32>]| {
            let places = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1)];
            let errors = places.map(|(b, t)| (f64::from(d[b][t]) - slope(b, t)).abs());
            errors.into_iter().fold(0.0, f64::max)
        };
        assert!(
            error(&derivative(0.25)) < 1e-6,
            "{}",
            error(&derivative(0.25))
        );
        assert!(error(&derivative(0.5)) > 0.01, "another weight passes");
    }

    /// Over all joint actions, weighted by their probabilities, the gradient without advantages is that of the entropy.
    #[test]
    fn its_expectation_is_the_gradient_of_the_entropy() {
        let logits = [0.3_f64, -0.7, 1.1];
        let p = |logits: &[f64; 3]| {
            let total: f64 = logits.iter().map(|x| x.exp()).sum();
            logits.map(|x| x.exp() / total)
        };
        let entropy = |logits: &[f64; 3]| -p(logits).iter().map(|p| p * p.ln()).sum::<f64>();
        let own = p(&logits);
        for i in 0..3 {
            let mut expected = 0.0;
            for (u, p_u) in own.iter().enumerate() {
                let mut d = Vec::new();
                let log_p = log_of(*p_u);
                let _ = entropy_regularised(&[vec![log_p]], &[vec![0.0]], &[1.0], 1.0, &mut d);
                let indicator = f64::from(u8::from(u == i));
                expected -= p_u * f64::from(d[0][0]) * (indicator - own[i]);
            }
            let moved = |h: f64| {
                let mut moved = logits;
                moved[i] += h;
                entropy(&moved)
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((expected - slope).abs() < 1e-6, "{expected} {slope}");
        }
    }

    fn log_of(p: f64) -> f32 {
        crate::Real::from_f64(p.ln())
    }
}
