//! Adam for a short vector of `f64` parameters.
//!
//! Apart from the optimiser of [`crate::nn`] because nothing here depends on the networks that it is an oracle for.

const MEAN_DECAY: f64 = 0.9;
const SQUARE_DECAY: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// Adam (Kingma and Ba, 2015, Algorithm 1) with its usual constants, climbing.
#[derive(Debug, Clone)]
pub(super) struct Adam<const PARAMETERS: usize> {
    learning_rate: f64,
    mean: [f64; PARAMETERS],
    square: [f64; PARAMETERS],
    updates: i32,
}

impl<const PARAMETERS: usize> Adam<PARAMETERS> {
    pub(super) const fn new(learning_rate: f64) -> Self {
        Self {
            learning_rate,
            mean: [0.0; PARAMETERS],
            square: [0.0; PARAMETERS],
            updates: 0,
        }
    }

    /// Moves `parameters` one step up the `gradient`.
    pub(super) fn ascend(
        &mut self,
        parameters: &mut [f64; PARAMETERS],
        gradient: &[f64; PARAMETERS],
    ) {
        self.updates += 1;
        let mean_scale = 1.0 / (1.0 - MEAN_DECAY.powi(self.updates));
        let square_scale = 1.0 / (1.0 - SQUARE_DECAY.powi(self.updates));
        for (i, parameter) in parameters.iter_mut().enumerate() {
            let g = gradient[i];
            self.mean[i] = MEAN_DECAY * self.mean[i] + (1.0 - MEAN_DECAY) * g;
            self.square[i] = SQUARE_DECAY * self.square[i] + (1.0 - SQUARE_DECAY) * g * g;
            let step =
                self.mean[i] * mean_scale / ((self.square[i] * square_scale).sqrt() + EPSILON);
            *parameter += self.learning_rate * step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_has_the_length_of_the_learning_rate() {
        let (mut adam, mut parameters) = (Adam::new(0.05), [1.0, 1.0, 1.0]);
        adam.ascend(&mut parameters, &[3.0, -0.001, 0.0]);
        for (parameter, expected) in parameters.into_iter().zip([1.05, 0.95, 1.0]) {
            assert!((parameter - expected).abs() < 1e-6, "{parameter}");
        }
    }

    #[test]
    fn two_steps_follow_the_algorithm_worked_by_hand() {
        let (mut adam, mut parameters) = (Adam::new(0.1), [0.0]);
        adam.ascend(&mut parameters, &[1.0]);
        adam.ascend(&mut parameters, &[-1.0]);
        // m = 0.9·0.1 − 0.1 = −0.01, v = 0.999·0.001 + 0.001 = 0.001999; m̂ = m/0.19, v̂ = v/0.001999 = 1.
        let expected = 0.1 + 0.1 * (-0.01 / 0.19);
        assert!((parameters[0] - expected).abs() < 1e-8, "{parameters:?}");
    }
}
