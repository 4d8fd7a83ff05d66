//! The marginal of one pair, `q(u) = π(u) + π(delegate) π_a(u_a) π_b(u_b)`: its logarithm, its entropy, what it can expect, and the
//! way back to logits.
//!
//! Where one partition is in force, p(u) is the product of its groups' marginals, and a learner may weigh each group by itself.
//! The entropy is that of the *marginal*, over all A² joint actions: a bonus on the pair controller's own choices would reward it
//! for not delegating, because it has one choice to delegate and A² not to.

use super::logarithm::{log_sum_exp, share};
use crate::{
    Real,
    nn::{Element, logarithms},
};

/// Below this a probability counts as this in a logarithm.
const LEAST: f64 = 1e-30;

/// The controllers of a pair and of its members at one step: probabilities, and their logarithms.
#[derive(Debug, Clone, Copy)]
pub struct PairRows<'a, F> {
    /// Delegate, then the joint actions \[1 + A·A\].
    pub pair: [&'a [F]; 2],
    /// Of the first member \[A\].
    pub first: [&'a [F]; 2],
    /// Of the second member \[A\].
    pub second: [&'a [F]; 2],
}

/// What is made of an objective's derivatives with respect to log q(u) and to the entropy of q.
#[derive(Debug)]
pub struct PairGradient<'a, F> {
    /// Of the pair's logits \[1 + A·A\].
    pub pair: &'a mut [F],
    /// Of the first member's \[A\].
    pub first: &'a mut [F],
    /// Of the second member's \[A\].
    pub second: &'a mut [F],
}

impl<F: Element> PairRows<'_, F> {
    /// log q(u) of the members' actions.
    #[must_use]
    pub fn log_q(&self, actions: [usize; 2]) -> F {
        let (joint, delegated) = self.terms(actions);
        log_sum_exp([joint, delegated])
    }

    /// How likely each of both ways to the members' actions is, given that they led there: jointly, and by delegation. These are the
    /// derivatives of log q(u) with respect to log π(u), and to log π(delegate), log `π_a(u_a)` and log `π_b(u_b)`; 0 if q(u) = 0.
    #[must_use]
    pub fn posteriors(&self, actions: [usize; 2]) -> [F; 2] {
        let (joint, delegated) = self.terms(actions);
        let total = log_sum_exp([joint, delegated]);
        [share(joint, total), share(delegated, total)]
    }

    /// What the pair can expect of a value of its joint action: exact, a sum over all of them.
    ///
    /// # Shapes
    /// `value_ab` \[A·A\], the first member's action outermost.
    ///
    /// # Equation
    /// `Σ_u q(u) v(u) = Σ_ab (π(a, b) + π(delegate) π_a(a) π_b(b)) v(a, b)`
    #[must_use]
    pub fn expectation(&self, value_ab: &[F]) -> F {
        let ([pair, _], [first, _], [second, _]) = (self.pair, self.first, self.second);
        let rows = value_ab.chunks_exact(second.len());
        let rows = rows.zip(pair[1..].chunks_exact(second.len()));
        let terms = rows.zip(first).map(|((value_b, joint_b), &p_a)| {
            let delegated = pair[0] * p_a;
            let columns = value_b.iter().zip(joint_b).zip(second);
            columns
                .map(|((&value, &joint), &p_b)| (joint + delegated * p_b) * value)
                .sum::<F>()
        });
        terms.sum()
    }

    /// The logarithms of the joint way to u and of the delegated one.
    fn terms(&self, [a, b]: [usize; 2]) -> (F, F) {
        let [_, pair] = self.pair;
        let joint = pair[1 + a * self.first[0].len() + b];
        (joint, pair[0] + self.first[1][a] + self.second[1][b])
    }

    /// Writes the gradient of `weights[0] · log q(u) + weights[1] · H(q)` with respect to all logits, and gives H(q).
    ///
    /// # Equation
    /// With `δ = π(d) π_a π_b / q(u)` and `G = ∂H/∂π` up to a constant, for each head with probabilities π
    ///
    /// ```text
    /// ∂ log q / ∂ pair logits    = (1 − δ) 1[u] + δ 1[d] − π          ∂ log q / ∂ member logits = δ (1[u_a] − π_a)
    /// H(q) = −Σ_ij q_ij log q_ij                                      ∂ H / ∂ logits = π ∘ (G − Σ_c π_c G_c)
    /// G_ij = −log q_ij      G_d = −Σ_ij π_a(i) π_b(j) log q_ij        G_a(i) = −π(d) Σ_j π_b(j) log q_ij
    /// ```
    ///
    /// # Panics
    /// If a gradient has another length than its row.
    pub fn gradient(
        &self,
        actions: [usize; 2],
        weights: [F; 2],
        log_q: &mut Vec<F>,
        to: PairGradient<'_, F>,
    ) -> F {
        let [weight, entropy_weight] = weights;
        let entropy = self.entropy_gradient(entropy_weight, log_q, to.pair, [to.first, to.second]);
        let [joint, delta] = self.posteriors(actions);
        let [a, b] = actions;
        for (gradient, &p) in to.pair.iter_mut().zip(self.pair[0]) {
            *gradient += -weight * p;
        }
        to.pair[0] += weight * delta;
        to.pair[1 + a * self.first[0].len() + b] += weight * joint;
        for (gradient, p, action) in [(to.first, self.first[0], a), (to.second, self.second[0], b)]
        {
            let weight = weight * delta;
            for (gradient, &p) in gradient.iter_mut().zip(p) {
                *gradient += -weight * p;
            }
            gradient[action] += weight;
        }
        entropy
    }

    /// Overwrites the gradients with those of `weight · H(q)`, and gives H(q).
    fn entropy_gradient(
        &self,
        weight: F,
        log_q: &mut Vec<F>,
        pair: &mut [F],
        [first, second]: [&mut [F]; 2],
    ) -> F {
        let (p, p_a, p_b) = (self.pair[0], self.first[0], self.second[0]);
        let actions = p_a.len();
        let (delegate, joint) = (p[0], &p[1..]);
        let least = F::from_f64(LEAST);
        log_q.clear();
        for (joint, &p_a) in joint.chunks_exact(actions).zip(p_a) {
            let factor = delegate * p_a;
            let q = joint.iter().zip(p_b).map(|(&p, &p_b)| p + factor * p_b);
            log_q.extend(q.map(|q| if q < least { least } else { q }));
        }
        // q is kept in the place of the joint gradient until its logarithms are known.
        pair[1..].copy_from_slice(log_q);
        logarithms(log_q);
        let mut entropy = F::ZERO;
        let mut g_delegate = F::ZERO;
        second.fill(F::ZERO);
        for (i, log_q) in log_q.chunks_exact(actions).enumerate() {
            let mut sum = F::ZERO;
            let factor = delegate * p_a[i];
            for ((second, &p_b), &log_q) in second.iter_mut().zip(p_b).zip(log_q) {
                sum += p_b * log_q;
                *second += -factor * log_q;
            }
            first[i] = -delegate * sum;
            g_delegate += -p_a[i] * sum;
        }
        let mut mean = delegate * g_delegate;
        for ((q, &log_q), &p) in pair[1..].iter_mut().zip(&*log_q).zip(joint) {
            entropy += -(*q * log_q);
            mean += -(p * log_q);
            *q = -log_q;
        }
        pair[0] = g_delegate;
        scale(pair, p, weight, mean);
        for (gradient, p) in [(first, p_a), (second, p_b)] {
            let terms = gradient.iter().zip(p).map(|(&g, &p)| g * p);
            let mean = terms.sum::<F>();
            scale(gradient, p, weight, mean);
        }
        entropy
    }
}

/// `w p ∘ (G − mean)` in place of G.
fn scale<F: Real>(gradient: &mut [F], p: &[F], weight: F, mean: F) {
    for (gradient, &p) in gradient.iter_mut().zip(p) {
        *gradient = weight * p * (*gradient - mean);
    }
}

/// The same for an agent alone: writes the gradient of `weights[0] · log π(u) + weights[1] · H(π)` with respect to its logits, and
/// gives H(π). `row` are its probabilities and their logarithms \[A\].
pub fn gradient_alone<F: Real>(
    [p, log_p]: [&[F]; 2],
    action: usize,
    [weight, entropy_weight]: [F; 2],
    gradient: &mut [F],
) -> F {
    let possible = |log_p: F| {
        if log_p == F::NEG_INFINITY {
            F::ZERO
        } else {
            log_p
        }
    };
    let terms = p.iter().zip(log_p).map(|(&p, &log_p)| p * possible(log_p));
    let entropy = -terms.sum::<F>();
    for ((gradient, &p), &log_p) in gradient.iter_mut().zip(p).zip(log_p) {
        *gradient = -p * (weight + entropy_weight * (possible(log_p) + entropy));
    }
    gradient[action] += weight;
    entropy
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACTIONS: usize = 3;

    /// The probabilities of logits, and their logarithms; those at −∞ are masked.
    fn softmax(logits: &[f64]) -> [Vec<f64>; 2] {
        let total: f64 = logits.iter().map(|x| x.exp()).sum();
        [
            logits.iter().map(|x| x.exp() / total).collect(),
            logits.iter().map(|x| x - total.ln()).collect(),
        ]
    }

    /// Logits of pair, first and second; in `pair` and `second` an action is not available.
    fn logits() -> [Vec<f64>; 3] {
        let masked = f64::NEG_INFINITY;
        [
            vec![
                0.4, -0.3, 0.9, masked, 0.1, 1.2, masked, masked, -0.8, masked,
            ],
            vec![0.2, -0.5, 0.7],
            vec![1.1, masked, -0.4],
        ]
    }

    /// q over all joint actions, by the formula.
    fn literal(logits: &[Vec<f64>; 3]) -> Vec<f64> {
        let [[p, _], [a, _], [b, _]] = logits.each_ref().map(|row| softmax(row));
        let joint =
            (0..ACTIONS * ACTIONS).map(|u| p[1 + u] + p[0] * a[u / ACTIONS] * b[u % ACTIONS]);
        joint.collect()
    }

    fn with_rows<T>(logits: &[Vec<f64>; 3], run: impl FnOnce(PairRows<'_, f64>) -> T) -> T {
        let [pair, first, second] = logits.each_ref().map(|row| softmax(row));
        run(PairRows {
            pair: [&pair[0], &pair[1]],
            first: [&first[0], &first[1]],
            second: [&second[0], &second[1]],
        })
    }

    fn gradient(
        logits: &[Vec<f64>; 3],
        actions: [usize; 2],
        weights: [f64; 2],
    ) -> ([Vec<f64>; 3], f64) {
        let mut rows = logits.each_ref().map(|row| vec![7.0; row.len()]);
        let [pair, first, second] = &mut rows;
        let to = PairGradient {
            pair,
            first,
            second,
        };
        let entropy = with_rows(logits, |own| {
            own.gradient(actions, weights, &mut Vec::new(), to)
        });
        (rows, entropy)
    }

    #[test]
    fn log_q_is_that_of_the_formula_and_sums_to_one() {
        let logits = logits();
        let literal = literal(&logits);
        assert!((literal.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for (u, q) in literal.iter().enumerate() {
            let found = with_rows(&logits, |rows| rows.log_q([u / ACTIONS, u % ACTIONS]));
            assert!((found.exp() - q).abs() < 1e-12, "{u}: {found}");
        }
    }

    #[test]
    fn the_entropy_is_that_of_the_marginal() {
        let logits = logits();
        let q = literal(&logits);
        let expected: f64 = q.iter().filter(|q| **q > 0.0).map(|q| -q * q.ln()).sum();
        let (_, found) = gradient(&logits, [0, 0], [0.0, 1.0]);
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn gradients_are_those_of_log_q_and_entropy() {
        let logits = logits();
        for (weights, actions) in [
            ([1.0, 0.0], [0, 2]),
            ([0.0, 1.0], [1, 0]),
            ([-0.7, 0.3], [1, 0]),
        ] {
            let value = |logits: &[Vec<f64>; 3]| {
                let q = literal(logits);
                let entropy: f64 = q.iter().filter(|q| **q > 0.0).map(|q| -q * q.ln()).sum();
                weights[0] * q[actions[0] * ACTIONS + actions[1]].ln() + weights[1] * entropy
            };
            let (found, _) = gradient(&logits, actions, weights);
            for head in 0..3 {
                for column in 0..logits[head].len() {
                    let slope = if logits[head][column].is_finite() {
                        let [above, below] = [1e-6, -1e-6].map(|step| {
                            let mut moved = logits.clone();
                            moved[head][column] += step;
                            value(&moved)
                        });
                        (above - below) / 2e-6
                    } else {
                        0.0
                    };
                    let own = found[head][column];
                    assert!((own - slope).abs() < 1e-8, "{head} {column}: {own} {slope}");
                }
            }
        }
    }

    #[test]
    fn posteriors_are_the_derivatives_of_log_q() {
        let logits = logits();
        with_rows(&logits, |rows| {
            for u in 0..ACTIONS * ACTIONS {
                let actions = [u / ACTIONS, u % ACTIONS];
                // log q is a function of logarithms of probabilities, each of which can be moved by itself.
                let moved = |place: usize, step: f64| {
                    let [mut pair, mut first, mut second] =
                        [rows.pair, rows.first, rows.second].map(|[_, log_p]| log_p.to_vec());
                    match place {
                        0 => pair[1 + u] += step,
                        1 => pair[0] += step,
                        2 => first[actions[0]] += step,
                        _ => second[actions[1]] += step,
                    }
                    let moved = PairRows {
                        pair: [rows.pair[0], &pair],
                        first: [rows.first[0], &first],
                        second: [rows.second[0], &second],
                    };
                    moved.log_q(actions)
                };
                let [joint, delegated] = rows.posteriors(actions);
                if rows.log_q(actions) == f64::NEG_INFINITY {
                    assert_eq!([joint, delegated], [0.0, 0.0]);
                    continue;
                }
                let all = [joint, delegated, delegated, delegated];
                for (place, found) in all.into_iter().enumerate() {
                    let slope = (moved(place, 1e-6) - moved(place, -1e-6)) / 2e-6;
                    assert!((found - slope).abs() < 1e-9, "{u} {place}: {found} {slope}");
                }
            }
        });
    }

    /// The counterfactual baseline of a pair is a literal sum over its joint actions; as two agents that choose by themselves, it is a
    /// sum over both, whose order does not matter.
    #[test]
    fn what_a_pair_expects_is_the_sum_over_its_joint_actions() {
        let value = |u: usize| (3.0 * u as f64).sin() - 0.4;
        let values: Vec<f64> = (0..ACTIONS * ACTIONS).map(value).collect();
        let mut logits = logits();
        let sum = |q: &[f64]| q.iter().zip(&values).map(|(q, v)| q * v).sum::<f64>();
        let found = with_rows(&logits, |rows| rows.expectation(&values));
        let expected = sum(&literal(&logits));
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");

        logits[0][1..].fill(f64::NEG_INFINITY);
        let found = with_rows(&logits, |rows| rows.expectation(&values));
        let [[a, _], [b, _]] = [&logits[1], &logits[2]].map(|row| softmax(row));
        let of_first = |i: usize| {
            (0..ACTIONS)
                .map(|j| b[j] * values[i * ACTIONS + j])
                .sum::<f64>()
        };
        let expected: f64 = (0..ACTIONS).map(|i| a[i] * of_first(i)).sum();
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }

    #[test]
    fn a_pair_that_only_delegates_is_two_agents_alone() {
        let mut logits = logits();
        logits[0][1..].fill(f64::NEG_INFINITY);
        let (found, entropy) = gradient(&logits, [2, 0], [0.6, 0.2]);
        let mut sum = 0.0;
        for (head, action) in [(1, 2), (2, 0)] {
            let [p, log_p] = softmax(&logits[head]);
            let mut own = vec![0.0; ACTIONS];
            sum += gradient_alone([&p, &log_p], action, [0.6, 0.2], &mut own);
            for (own, found) in own.iter().zip(&found[head]) {
                assert!((own - found).abs() < 1e-9, "{own} {found}");
            }
        }
        assert!((entropy - sum).abs() < 1e-9);
        assert!(found[0].iter().all(|g| g.abs() < 1e-12), "{:?}", found[0]);
    }
}
