//! The loss of values that may not move far from where they were, and that few large errors do not rule.

use crate::Real;

/// How a value's loss is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueLoss<F> {
    /// How far a value may move from where it was before its loss stops falling, > 0; infinite for no bound.
    pub clip: F,
    /// Errors beyond this count linearly (Huber, 1964), > 0.
    pub huber: F,
}

impl<F: Real> ValueLoss<F> {
    /// The loss, and its derivative with respect to every value.
    ///
    /// # Shapes
    /// All \[I\]; `d_value_i` is overwritten.
    ///
    /// # Equation
    /// With `v'_i = v_i^old + clip(v_i − v_i^old, ±c)` and Huber's `h(e) = e²/2` for |e| ≤ δ, else `δ (|e| − δ/2)`
    ///
    /// ```text
    /// L = w Σ_i max( h(v_i − G_i), h(v'_i − G_i) )
    /// ```
    ///
    /// # Panics
    /// If the lengths do not fit each other.
    pub fn of(
        &self,
        weight: F,
        [value_i, old_value_i, target_i]: [&[F]; 3],
        d_value_i: &mut [F],
    ) -> f64 {
        assert_eq!(value_i.len(), old_value_i.len(), "where each value was");
        assert_eq!(value_i.len(), target_i.len(), "a target for each value");
        assert_eq!(
            value_i.len(),
            d_value_i.len(),
            "a derivative for each value"
        );
        let mut loss = 0.0;
        let known = value_i.iter().zip(old_value_i).zip(target_i);
        for (((&value, &old), &target), d_value) in known.zip(d_value_i) {
            let step = value - old;
            let (bounded, slope) = if step > self.clip {
                (old + self.clip, F::ZERO)
            } else if step < -self.clip {
                (old - self.clip, F::ZERO)
            } else {
                (value, F::ONE)
            };
            let (free, d_free) = self.huber(value - target);
            let (bound, d_bound) = self.huber(bounded - target);
            let (own, d_own) = if free >= bound {
                (free, d_free)
            } else {
                (bound, slope * d_bound)
            };
            *d_value = weight * d_own;
            loss += (weight * own).to_f64();
        }
        loss
    }

    /// h(e) and its derivative.
    fn huber(&self, error: F) -> (F, F) {
        let half = F::from_f64(0.5);
        if error.abs() <= self.huber {
            (half * error * error, error)
        } else {
            let slope = if error > F::ZERO {
                self.huber
            } else {
                -self.huber
            };
            (self.huber * (error.abs() - half * self.huber), slope)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: [f64; 6] = [0.0, 0.5, 1.0, -1.0, 0.2, 0.0];
    const VALUE: [f64; 6] = [0.1, 1.0, 0.5, -1.1, 0.9, -0.6];
    const TARGET: [f64; 6] = [0.4, 0.8, 3.0, 9.0, 2.0, -7.0];
    const LOSS: ValueLoss<f64> = ValueLoss {
        clip: 0.2,
        huber: 3.0,
    };

    fn run(value: &[f64]) -> (f64, Vec<f64>) {
        let mut d = vec![0.0; value.len()];
        let loss = LOSS.of(0.5, [value, &OLD, &TARGET], &mut d);
        (loss, d)
    }

    #[test]
    fn the_loss_is_that_of_the_formula_term_by_term() {
        let huber = |e: f64| {
            if e.abs() <= 3.0 {
                e * e / 2.0
            } else {
                3.0 * (e.abs() - 1.5)
            }
        };
        let terms = VALUE.iter().zip(OLD).zip(TARGET).map(|((v, old), target)| {
            let bounded = old + (v - old).clamp(-0.2, 0.2);
            huber(v - target).max(huber(bounded - target))
        });
        let expected = 0.5 * terms.sum::<f64>();
        assert!((run(&VALUE).0 - expected).abs() < 1e-12);
    }

    #[test]
    fn the_derivative_is_that_of_the_loss() {
        let (_, d) = run(&VALUE);
        for i in 0..VALUE.len() {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut value = VALUE;
                value[i] += step;
                run(&value).0
            });
            let slope = (above - below) / 2e-6;
            assert!((d[i] - slope).abs() < 1e-8, "{i}: {} {slope}", d[i]);
        }
        assert!(d.contains(&0.0), "no value is past its bound");
    }
}
