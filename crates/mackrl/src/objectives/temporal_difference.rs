//! The loss of action values: squared errors to targets that other parameters gave.

use crate::Real;

/// What the errors of some values come to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ValueErrors {
    /// `w Σ_i (v_i − y_i)²`
    pub loss: f64,
    /// `Σ_i |v_i − y_i|`
    pub absolute: f64,
}

/// Writes ∂ loss / ∂ v of `w Σ_i (v_i − y_i)²`, and gives the errors' sums.
///
/// # Shapes
/// `value_i`, `target_i` and `d_value_i` have one length.
///
/// # Panics
/// If they have not.
pub fn squared_errors<F: Real>(
    weight: F,
    [value_i, target_i]: [&[F]; 2],
    d_value_i: &mut [F],
) -> ValueErrors {
    assert_eq!(value_i.len(), target_i.len(), "a target for every value");
    assert_eq!(value_i.len(), d_value_i.len(), "a slope for every value");
    let mut errors = ValueErrors::default();
    let pairs = value_i.iter().zip(target_i);
    for (d_value, (&value, &target)) in d_value_i.iter_mut().zip(pairs) {
        let error = value - target;
        *d_value = (error + error) * weight;
        errors.loss += (error * error).to_f64();
        errors.absolute += error.to_f64().abs();
    }
    errors.loss *= weight.to_f64();
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_that_of_the_loss() {
        let (values, targets) = ([0.5, -2.0, 3.0_f64], [1.0, -1.0, 2.5]);
        let mut slopes = [0.0; 3];
        let errors = squared_errors(0.25, [&values, &targets], &mut slopes);
        assert!((errors.loss - 0.25 * 1.5).abs() < 1e-12);
        assert!((errors.absolute - 2.0).abs() < 1e-12);
        for (i, slope) in slopes.iter().enumerate() {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut moved = values;
                moved[i] += step;
                squared_errors(0.25, [&moved, &targets], &mut [0.0; 3]).loss
            });
            assert!((slope - (above - below) / 2e-6).abs() < 1e-8);
        }
    }
}
