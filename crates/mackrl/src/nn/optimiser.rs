//! Adam and `RMSprop` with PyTorch's semantics, and the clipping of gradients.
//!
//! A step is computed beside the present state and takes its place only when it is accepted: a step to numbers that are not
//! finite can be refused without a trace. To keep a copy of the state and put it back would cost a pass over everything.

use crate::{
    Real,
    nn::{
        finite::first_not_finite,
        lanes::{Element, Kernel, Lanes},
    },
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
    /// Where [`propose`](Self::propose) writes.
    next: Proposal<R>,
    /// Whether the latest proposal was not accepted.
    refused: bool,
}

/// What would be after a step.
#[derive(Debug, Clone, PartialEq)]
struct Proposal<R> {
    moments: Moments<R>,
    parameters: Vec<R>,
}

/// A step to numbers that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BrokenStep {
    /// Which of the numbers after the step.
    pub what: Stepped,
    /// Its index in the flat vector.
    pub index: usize,
}

/// What a step changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stepped {
    /// Averages of gradients.
    FirstMoment,
    /// Averages of squared gradients.
    SecondMoment,
    /// The parameters.
    Parameter,
}

impl<E: Element> Optimiser<E> {
    /// An optimiser of `parameters` parameters that has taken no step.
    #[must_use]
    pub fn new(kind: OptimiserKind, parameters: usize) -> Self {
        let first = match kind {
            OptimiserKind::Adam { .. } => vec![E::ZERO; parameters],
            OptimiserKind::RmsProp { .. } => Vec::new(),
        };
        let moments = Moments {
            steps: 0,
            first,
            second: vec![E::ZERO; parameters],
        };
        let next = Proposal {
            moments: moments.clone(),
            parameters: vec![E::ZERO; parameters],
        };
        Self {
            kind,
            moments,
            next,
            refused: false,
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

    /// Takes one step against `gradient`, whatever numbers come out.
    ///
    /// # Panics
    /// As [`propose`](Self::propose).
    pub fn step(&mut self, learning_rate: f64, gradient: &[E], parameters: &mut [E]) {
        // Nobody asked whether the numbers are finite.
        let _ = self.propose(learning_rate, gradient, parameters);
        parameters.copy_from_slice(&self.next.parameters);
        std::mem::swap(&mut self.moments, &mut self.next.moments);
        self.refused = false;
    }

    /// Computes one step against `gradient`, to be taken by [`accept`](Self::accept).
    ///
    /// # Errors
    /// [`BrokenStep`] if a number after the step would not be finite.
    ///
    /// # Panics
    /// If `parameters` or `gradient` are not as many as the optimiser was made for.
    pub fn propose(
        &mut self,
        learning_rate: f64,
        gradient: &[E],
        parameters: &[E],
    ) -> Result<(), BrokenStep> {
        let Self {
            kind,
            moments,
            next,
            refused,
        } = self;
        *refused = true;
        assert_eq!(
            gradient.len(),
            moments.second.len(),
            "length of the gradient"
        );
        assert_eq!(
            parameters.len(),
            moments.second.len(),
            "number of parameters"
        );
        next.moments.steps = moments.steps + 1;
        let broken = match *kind {
            OptimiserKind::Adam {
                beta1,
                beta2,
                epsilon,
            } => {
                let exponent = i32::try_from(next.moments.steps).unwrap_or(i32::MAX);
                let rates = [beta1, beta2, (1.0 - beta2.powi(exponent)).sqrt(), epsilon];
                let size = learning_rate / (1.0 - beta1.powi(exponent));
                let rule = [rates[0], rates[1], rates[2], rates[3], size].map(E::from_f64);
                E::dispatch(Adam {
                    rule,
                    gradient,
                    parameters,
                    moments,
                    next,
                })
            }
            OptimiserKind::RmsProp { smoothing, epsilon } => {
                let rule = [smoothing, epsilon, learning_rate].map(E::from_f64);
                E::dispatch(RmsProp {
                    rule,
                    gradient,
                    parameters,
                    moments,
                    next,
                })
            }
        };
        if broken {
            Err(next.first_broken())
        } else {
            Ok(())
        }
    }

    /// Takes the step that was proposed last.
    ///
    /// # Panics
    /// If `parameters` are not as many as the optimiser was made for.
    pub fn accept(&mut self, parameters: &mut Vec<E>) {
        let next = &mut self.next;
        assert_eq!(
            parameters.len(),
            next.parameters.len(),
            "number of parameters"
        );
        std::mem::swap(parameters, &mut next.parameters);
        std::mem::swap(&mut self.moments, &mut next.moments);
        self.refused = false;
    }

    /// The moments and the parameters after the latest step, whether or not it was accepted; `parameters` are the present ones.
    #[must_use]
    pub fn latest<'a>(&'a self, parameters: &'a [E]) -> (&'a Moments<E>, &'a [E]) {
        if self.refused {
            (&self.next.moments, &self.next.parameters)
        } else {
            (&self.moments, parameters)
        }
    }
}

impl<E: Element> Proposal<E> {
    /// The first number that is not finite, moments first: a parameter is broken by its moments.
    fn first_broken(&self) -> BrokenStep {
        let Moments { first, second, .. } = &self.moments;
        let found = [
            (Stepped::FirstMoment, first),
            (Stepped::SecondMoment, second),
            (Stepped::Parameter, &self.parameters),
        ]
        .into_iter()
        .find_map(|(what, numbers)| Some((what, first_not_finite(numbers)?)));
        let (what, index) = found.expect("a step is searched that holds such a number");
        BrokenStep { what, index }
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

/// One step of Adam; gives whether a number of it is not finite.
struct Adam<'a, R> {
    /// β₁, β₂, √(1 − β₂ᵗ), ε and α / (1 − β₁ᵗ)
    rule: [R; 5],
    gradient: &'a [R],
    parameters: &'a [R],
    moments: &'a Moments<R>,
    next: &'a mut Proposal<R>,
}

impl<E: Element> Kernel<E> for Adam<'_, E> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, _: L) -> bool {
        let [beta1, beta2, correction, epsilon, size] = self.rule;
        let Proposal {
            moments,
            parameters,
        } = self.next;
        let before = self.moments.first.iter().zip(&self.moments.second);
        let before = self.gradient.iter().zip(self.parameters.iter().zip(before));
        let after = moments.first.iter_mut().zip(&mut moments.second);
        let mut broken = 0;
        for ((&g, (&parameter, (&m, &v))), (next, (next_m, next_v))) in
            before.zip(parameters.iter_mut().zip(after))
        {
            let m = beta1 * m + (E::ONE - beta1) * g;
            let v = beta2 * v + (E::ONE - beta2) * (g * g);
            let parameter = parameter - size * m / (v.sqrt() / correction + epsilon);
            (*next, *next_m, *next_v) = (parameter, m, v);
            // A broken m breaks the parameter; a broken v need not: it makes the step zero.
            broken |= u32::from(!v.is_finite()) | u32::from(!parameter.is_finite());
        }
        broken != 0
    }
}

/// One step of `RMSprop`; gives whether a number of it is not finite.
struct RmsProp<'a, R> {
    /// ρ, ε and α
    rule: [R; 3],
    gradient: &'a [R],
    parameters: &'a [R],
    moments: &'a Moments<R>,
    next: &'a mut Proposal<R>,
}

impl<E: Element> Kernel<E> for RmsProp<'_, E> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, _: L) -> bool {
        let [smoothing, epsilon, size] = self.rule;
        let before = self.parameters.iter().zip(&self.moments.second);
        let after = (self.next.parameters.iter_mut()).zip(&mut self.next.moments.second);
        let mut broken = 0;
        for ((&g, (&parameter, &v)), (next, next_v)) in self.gradient.iter().zip(before).zip(after)
        {
            let v = smoothing * v + (E::ONE - smoothing) * (g * g);
            let parameter = parameter - size * g / (v.sqrt() + epsilon);
            (*next, *next_v) = (parameter, v);
            broken |= u32::from(!v.is_finite()) | u32::from(!parameter.is_finite());
        }
        broken != 0
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

    /// One step from `parameter`, by Adam from moments of zero.
    fn broken_step(gradient: f32, parameter: f32, learning_rate: f64) -> Option<Stepped> {
        let mut optimiser = Optimiser::new(OptimiserKind::ADAM, 3);
        let mut parameters = vec![0.5, parameter, -0.5];
        let before = (optimiser.moments().clone(), parameters.clone());
        let proposed = optimiser.propose(learning_rate, &[0.1, gradient, 0.1], &parameters);
        assert_eq!(before, (optimiser.moments().clone(), parameters.clone()));
        match proposed {
            Ok(()) => {
                optimiser.accept(&mut parameters);
                assert_eq!(optimiser.moments().steps, 1);
                assert_ne!(parameters, before.1);
                None
            }
            Err(broken) => {
                assert_eq!(broken.index, 1);
                Some(broken.what)
            }
        }
    }

    #[test]
    fn a_step_to_numbers_that_are_not_finite_is_refused_and_changes_nothing() {
        assert_eq!(broken_step(0.1, 0.5, 1e-3), None);
        assert_eq!(broken_step(f32::NAN, 0.5, 1e-3), Some(Stepped::FirstMoment));
        let infinite = broken_step(f32::INFINITY, 0.5, 1e-3);
        assert_eq!(infinite, Some(Stepped::FirstMoment));
        assert_eq!(broken_step(1e20, 0.5, 1e-3), Some(Stepped::SecondMoment));
        let overflowing = broken_step(-0.1, f32::MAX, 1e37);
        assert_eq!(overflowing, Some(Stepped::Parameter));
        let proposed = Optimiser::new(OptimiserKind::RMSPROP, 1).propose(1e-3, &[1e25_f32], &[0.0]);
        assert_eq!(proposed.unwrap_err().what, Stepped::SecondMoment);
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
