//! How long a step would be: an optimiser that divides by a running mean makes long ones after a calm.

use crate::nn::{Optimiser, OptimiserKind, lanes::Element};

/// The root mean square, over all parameters, of the step that the optimiser would take against `gradient` with a step size of 1.
///
/// # Equation
/// `√(mean (g / (√v′ + ε))²)` with `v′ = ρ v + (1 − ρ) g²` for `RMSprop`, and Adam's likewise. Where gradients are as large as they
/// have been it is about 1; at the first large one after small ones it comes near `1 / √(1 − ρ)`: 10 with ρ = .99.
/// ("Update clipping": Shazeer and Stern, "Adafactor", 2018, section 6.)
///
/// # Panics
/// If there are not as many gradients as the optimiser was made for.
#[must_use]
pub fn update_length<E: Element>(optimiser: &Optimiser<E>, gradient: &[E]) -> f64 {
    let moments = optimiser.moments();
    assert_eq!(
        gradient.len(),
        moments.second.len(),
        "length of the gradient"
    );
    let square = |(place, (&g, &v)): (usize, (&E, &E))| {
        let (g, v) = (g.to_f64(), v.to_f64());
        let step = match optimiser.kind() {
            OptimiserKind::RmsProp { smoothing, epsilon } => {
                g / ((smoothing * v + (1.0 - smoothing) * g * g).sqrt() + epsilon)
            }
            OptimiserKind::Adam {
                beta1,
                beta2,
                epsilon,
            } => {
                let t = i32::try_from(moments.steps + 1).unwrap_or(i32::MAX);
                let m = beta1 * moments.first[place].to_f64() + (1.0 - beta1) * g;
                let v = beta2 * v + (1.0 - beta2) * g * g;
                let v = v / (1.0 - beta2.powi(t));
                m / (1.0 - beta1.powi(t)) / (v.sqrt() + epsilon)
            }
        };
        step * step
    };
    let terms = gradient.iter().zip(&moments.second).enumerate();
    let sum: f64 = terms.map(square).sum();
    (sum / gradient.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step that is taken with a step size of 1, beside the length that was foretold.
    fn foretold_and_taken(kind: OptimiserKind) {
        let mut optimiser = Optimiser::<f64>::new(kind, 2);
        let mut parameters = [0.0, 0.0];
        for gradient in [[0.1, -0.2], [0.3, 0.1], [4.0, -0.1]] {
            let foretold = update_length(&optimiser, &gradient);
            let before = parameters;
            optimiser.step(1.0, &gradient, &mut parameters);
            let squares = (0..2).map(|i| f64::powi(parameters[i] - before[i], 2));
            let taken = (squares.sum::<f64>() / 2.0).sqrt();
            assert!((foretold - taken).abs() < 1e-12, "{foretold} {taken}");
        }
    }

    #[test]
    fn the_length_is_that_of_the_step() {
        foretold_and_taken(OptimiserKind::ADAM);
        foretold_and_taken(OptimiserKind::RMSPROP);
    }

    #[test]
    fn the_first_large_gradient_after_small_ones_makes_a_long_step() {
        let mut optimiser = Optimiser::<f32>::new(OptimiserKind::RMSPROP, 1);
        let mut parameters = [0.0];
        for _ in 0..1000 {
            optimiser.step(1e-3, &[1e-3], &mut parameters);
        }
        let usual = update_length(&optimiser, &[1e-3]);
        let long = update_length(&optimiser, &[1.0]);
        assert!((usual - 1.0).abs() < 0.01, "{usual}");
        assert!((long - 10.0).abs() < 0.01, "{long}");
    }
}
