//! Adam and `RMSprop` with PyTorch's semantics, and what surrounds an update: clipping and the search for broken numbers.

use crate::{
    Real,
    nn::lanes::{Element, Kernel, Lanes},
};

/// A rule for turning gradients into steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptimiserKind {
    /// m ← β₁ m + (1 − β₁) g, v ← β₂ v + (1 − β₂) g², θ ← θ − α (m / (1 − β₁ᵗ)) / (√(v / (1 − β₂ᵗ)) + ε)
    Adam {
        /// β₁ in [0, 1)
        beta1: f64,
        /// β₂ in [0, 1)
        beta2: f64,
        /// ε > 0
        epsilon: f64,
    },
    /// v ← ρ v + (1 − ρ) g², θ ← θ − α g / (√v + ε)
    RmsProp {
        /// ρ in [0, 1)
        smoothing: f64,
        /// ε > 0
        epsilon: f64,
    },
}

impl OptimiserKind {
    /// Adam with its usual constants: 0.9, 0.999, 1e-8.
    pub const ADAM: Self = Self::Adam {
        beta1: 0.9,
        beta2: 0.999,
        epsilon: 1e-8,
    };
    /// `RMSprop` with PyTorch's usual constants: 0.99, 1e-8.
    pub const RMSPROP: Self = Self::RmsProp {
        smoothing: 0.99,
        epsilon: 1e-8,
    };
}

/// What an optimiser remembers between steps; stored in checkpoints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moments<R> {
    /// Steps taken.
    pub steps: u64,
    /// Averages of gradients; empty for `RMSprop`.
    pub first: Vec<R>,
    /// Averages of squared gradients.
    pub second: Vec<R>,
}

/// An optimiser of one flat parameter vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimiser<R> {
    kind: OptimiserKind,
    moments: Moments<R>,
}

impl<E: Element> Optimiser<E> {
    /// An optimiser of `parameters` parameters that has taken no step.
    #[must_use]
    pub fn new(kind: OptimiserKind, parameters: usize) -> Self {
        let first = match kind {
            OptimiserKind::Adam { .. } => vec![E::ZERO; parameters],
            OptimiserKind::RmsProp { .. } => Vec::new(),
        };
        let second = vec![E::ZERO; parameters];
        Self {
            kind,
            moments: Moments {
                steps: 0,
                first,
                second,
            },
        }
    }

    /// The rule.
    #[must_use]
    pub const fn kind(&self) -> OptimiserKind {
        self.kind
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub const fn moments(&self) -> &Moments<E> {
        &self.moments
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the moments are those of another rule or number of parameters.
    pub fn restore(&mut self, moments: Moments<E>) {
        assert_eq!(
            moments.first.len(),
            self.moments.first.len(),
            "number of first moments"
        );
        assert_eq!(
            moments.second.len(),
            self.moments.second.len(),
            "number of second moments"
        );
        self.moments = moments;
    }

    /// Takes one step against `gradient`.
    ///
    /// # Panics
    /// If `parameters` or `gradient` are not as many as the optimiser was made for.
    pub fn step(&mut self, learning_rate: f64, gradient: &[E], parameters: &mut [E]) {
        let Moments {
            steps,
            first,
            second,
        } = &mut self.moments;
        assert_eq!(gradient.len(), second.len(), "length of the gradient");
        assert_eq!(parameters.len(), second.len(), "number of parameters");
        *steps += 1;
        match self.kind {
            OptimiserKind::Adam {
                beta1,
                beta2,
                epsilon,
            } => {
                let exponent = i32::try_from(*steps).unwrap_or(i32::MAX);
                let rates = [beta1, beta2, (1.0 - beta2.powi(exponent)).sqrt(), epsilon];
                let size = learning_rate / (1.0 - beta1.powi(exponent));
                let rule = [rates[0], rates[1], rates[2], rates[3], size].map(E::from_f64);
                E::dispatch(Adam {
                    rule,
                    gradient,
                    first,
                    second,
                    parameters,
                });
            }
            OptimiserKind::RmsProp { smoothing, epsilon } => {
                let rule = [smoothing, epsilon, learning_rate].map(E::from_f64);
                E::dispatch(RmsProp {
                    rule,
                    gradient,
                    second,
                    parameters,
                });
            }
        }
    }
}

/// Scales the gradient so that its Euclidean norm is at most `max`, and returns the norm it had.
///
/// As PyTorch's `clip_grad_norm_`: the scale is max / (norm + 1e-6) where that is below 1. The norm is summed in `f64`, in
/// an order that never changes. A norm that is not finite leaves the gradient as it is.
pub fn clip_gradient_norm<R: Real>(gradient: &mut [R], max: f64) -> f64 {
    let mut sums = [0.0; 8];
    for part in gradient.chunks(sums.len()) {
        for (sum, &value) in sums.iter_mut().zip(part) {
            let value = value.to_f64();
            *sum += value * value;
        }
    }
    let norm = sums.iter().sum::<f64>().sqrt();
    let scale = max / (norm + 1e-6);
    if scale < 1.0 && norm.is_finite() {
        let scale = R::from_f64(scale);
        for value in gradient {
            *value *= scale;
        }
    }
    norm
}

/// The index of the first number that is infinite or NaN.
///
/// Which tensor that is, [`ParameterLayout::tensor_at`](crate::nn::ParameterLayout::tensor_at) tells.
#[must_use]
pub fn first_not_finite<R: Real>(values: &[R]) -> Option<usize> {
    // x · 0 is zero for finite x and NaN for others; a block of sums is quicker than a test of each number.
    const BLOCK: usize = 256;
    for (block, values) in values.chunks(BLOCK).enumerate() {
        if !values
            .iter()
            .map(|&value| value * R::ZERO)
            .sum::<R>()
            .is_finite()
        {
            let within = values.iter().position(|value| !value.is_finite());
            return within.map(|within| block * BLOCK + within);
        }
    }
    None
}

struct Adam<'a, R> {
    /// β₁, β₂, √(1 − β₂ᵗ), ε and α / (1 − β₁ᵗ)
    rule: [R; 5],
    gradient: &'a [R],
    first: &'a mut [R],
    second: &'a mut [R],
    parameters: &'a mut [R],
}

impl<E: Element> Kernel<E> for Adam<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, _: L) {
        let [beta1, beta2, correction, epsilon, size] = self.rule;
        let moments = self.first.iter_mut().zip(self.second);
        for ((&g, (m, v)), parameter) in self.gradient.iter().zip(moments).zip(self.parameters) {
            *m = beta1 * *m + (E::ONE - beta1) * g;
            *v = beta2 * *v + (E::ONE - beta2) * (g * g);
            *parameter -= size * *m / (v.sqrt() / correction + epsilon);
        }
    }
}

struct RmsProp<'a, R> {
    /// ρ, ε and α
    rule: [R; 3],
    gradient: &'a [R],
    second: &'a mut [R],
    parameters: &'a mut [R],
}

impl<E: Element> Kernel<E> for RmsProp<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, _: L) {
        let [smoothing, epsilon, size] = self.rule;
        let states = self.second.iter_mut().zip(self.parameters);
        for (&g, (v, parameter)) in self.gradient.iter().zip(states) {
            *v = smoothing * *v + (E::ONE - smoothing) * (g * g);
            *parameter -= size * g / (v.sqrt() + epsilon);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_shortens_long_gradients_only() {
        let mut gradient = [3.0_f64, 0.0, -4.0];
        assert_eq!(clip_gradient_norm(&mut gradient, 10.0), 5.0, "norm");
        assert_eq!(gradient, [3.0, 0.0, -4.0], "a short gradient");
        assert_eq!(clip_gradient_norm(&mut gradient, 1.0), 5.0, "norm");
        let norm = clip_gradient_norm(&mut gradient, 1.0);
        assert!((norm - 1.0).abs() < 1e-6, "norm after clipping: {norm}");
    }

    #[test]
    fn the_first_broken_number_is_found() {
        let mut numbers = vec![1.0_f32; 1009];
        assert_eq!(first_not_finite(&numbers), None, "all finite");
        numbers[701] = f32::NAN;
        numbers[809] = f32::INFINITY;
        assert_eq!(first_not_finite(&numbers), Some(701), "first of two");
        numbers[13] = f32::NEG_INFINITY;
        assert_eq!(first_not_finite(&numbers), Some(13), "first of three");
    }

    #[test]
    fn an_optimiser_continues_from_its_moments() {
        for kind in [OptimiserKind::ADAM, OptimiserKind::RMSPROP] {
            let mut whole = Optimiser::<f32>::new(kind, 3);
            let mut parameters = [0.1, 0.2, 0.3];
            whole.step(0.01, &[1.0, -2.0, 3.0], &mut parameters);
            let mut resumed = Optimiser::new(kind, 3);
            resumed.restore(whole.moments().clone());
            let mut continued = parameters;
            whole.step(0.01, &[0.5, 0.5, -0.5], &mut parameters);
            resumed.step(0.01, &[0.5, 0.5, -0.5], &mut continued);
            assert_eq!(parameters, continued, "{kind:?}");
        }
    }
}
