//! Eq. (6): the policy gradient of actor-critic learning.

/// The loss `−J` whose gradient is the policy gradient, and its derivative with respect to every log p(u).
///
/// # Shapes
/// `log_p_bt`, `advantage_bt` \[B\]\[T\], each episode with its own T; `weight_t` \[longest T\], the weights of the steps, which
/// [`LossAverage`](super::LossAverage) gives. `d_log_p_bt` becomes \[B\]\[T\].
///
/// # Equation
/// Eq. (6), with advantages that are constants: for b in 0..B and t in 0..`T_b`
///
/// ```text
/// J = Σ_{b,t} w_t A_bt log p(u_bt)          ∂(−J) / ∂ log p(u_bt) = −w_t A_bt
/// ```
///
/// # Panics
/// If the lengths do not fit each other.
#[must_use]
pub fn policy_gradient(
    log_p_bt: &[Vec<f32>],
    advantage_bt: &[Vec<f32>],
    weight_t: &[f32],
    d_log_p_bt: &mut Vec<Vec<f32>>,
) -> f64 {
    assert_eq!(log_p_bt.len(), advantage_bt.len(), "advantages are [B][T]");
    d_log_p_bt.resize_with(log_p_bt.len(), Vec::new);
    let mut loss = 0.0;
    for ((log_p_t, advantage_t), d_log_p_t) in log_p_bt.iter().zip(advantage_bt).zip(d_log_p_bt) {
        assert_eq!(log_p_t.len(), advantage_t.len(), "advantages are [B][T]");
        assert!(log_p_t.len() <= weight_t.len(), "every step has a weight");
        d_log_p_t.clear();
        d_log_p_t.extend(advantage_t.iter().zip(weight_t).map(|(a, w)| -w * a));
        let terms = log_p_t.iter().zip(&*d_log_p_t);
        loss += terms
            .map(|(&log_p, &d)| f64::from(log_p) * f64::from(d))
            .sum::<f64>();
    }
    loss
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (Vec<Vec<f32>>, Vec<Vec<f32>>, Vec<f32>) {
        let log_p = vec![vec![-0.5, -1.25, -2.0], vec![-0.25, -3.0]];
        let advantage = vec![vec![2.0, -1.0, 0.5], vec![-4.0, 1.5]];
        (log_p, advantage, vec![0.5, 0.25, 0.125])
    }

    #[test]
    fn the_loss_is_the_one_worked_by_hand() {
        let (log_p, advantage, weight) = example();
        let mut d = Vec::new();
        let loss = policy_gradient(&log_p, &advantage, &weight, &mut d);
        // 0.5 − 0.3125 + 0.125 of the first episode, −0.5 + 1.125 of the second.
        assert!((loss - 0.937_5).abs() < 1e-12, "{loss}");
        assert_eq!(d, [vec![-1.0, 0.25, -0.0625], vec![2.0, -0.375]]);
    }

    /// Also rejects a derivative with one wrong sign.
    #[test]
    fn the_derivative_is_that_of_the_loss() {
        let (log_p, advantage, weight) = example();
        let mut d = Vec::new();
        let _ = policy_gradient(&log_p, &advantage, &weight, &mut d);
        let slope = |b: usize, t: usize| {
            let [above, below] = [0.125_f32, -0.125].map(|h| {
                let mut moved = log_p.clone();
                moved[b][t] += h;
                policy_gradient(&moved, &advantage, &weight, &mut Vec::new())
            });
            (above - below) / 0.25
        };
        let fits = |d: &[Vec<f32>]| {
            let places = d
                .iter()
                .enumerate()
                .flat_map(|(b, d_t)| (0..d_t.len()).map(move |t| (b, t)));
            places.clone().count() == 5
                && places
                    .into_iter()
                    .all(|(b, t)| (f64::from(d[b][t]) - slope(b, t)).abs() < 1e-6)
        };
        assert!(fits(&d));
        d[1][0] = -d[1][0];
        assert!(!fits(&d), "a wrong sign passes");
    }
}
