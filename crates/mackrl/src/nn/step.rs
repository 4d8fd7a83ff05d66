//! One step of an optimiser that refuses numbers that are not finite, by the names of their tensors.

use crate::{
    NotFinite,
    nn::{Optimiser, ParameterLayout, Stepped, clip_gradient_norm, first_not_finite},
};

/// Clips a gradient, takes one step against it, and gives the norm that the gradient had.
///
/// # Errors
/// [`NotFinite`] if the gradient, a moment or a parameter after the step is not finite; the parameters and the optimiser are
/// as they were then.
pub(crate) fn finite_step(
    optimiser: &mut Optimiser<f32>,
    layout: &ParameterLayout,
    [learning_rate, gradient_norm_max]: [f64; 2],
    gradient: &mut [f32],
    parameters: &mut Vec<f32>,
) -> Result<f64, NotFinite> {
    let norm = clip_gradient_norm(gradient, gradient_norm_max);
    // A sum of squares in double precision is finite only if all of them are.
    if !norm.is_finite() {
        let index = first_not_finite(gradient).expect("a norm that is not finite has such a term");
        return Err(NotFinite::in_layout("gradient of", layout, index, gradient));
    }
    if let Err(broken) = optimiser.propose(learning_rate, gradient, parameters) {
        let (moments, parameters) = optimiser.latest(&[]);
        let (what, values) = match broken.what {
            Stepped::FirstMoment => ("first moment of", moments.first.as_slice()),
            Stepped::SecondMoment => ("second moment of", moments.second.as_slice()),
            Stepped::Parameter => ("after the step,", parameters),
        };
        return Err(NotFinite::in_layout(what, layout, broken.index, values));
    }
    optimiser.accept(parameters);
    Ok(norm)
}
