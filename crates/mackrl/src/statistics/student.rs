//! How wide an interval has to be when its width comes from a few numbers itself.

use std::f64::consts::PI;

/// Width of a step of the integration.
const STEP: f64 = 1.0 / 256.0;
/// Share of the distribution that lies inside.
const INSIDE: f64 = 0.95;
/// From here on the distribution is a normal one, to all digits that matter.
const DEGREES_MOST: f64 = 1e6;

/// How many standard errors on either side of a mean make its 95 % interval: the 97.5 % quantile of Student's t distribution with so
/// many degrees of freedom, ≥ 1.
///
/// # Equation
/// ∫ f(x) dx over [0, t] = 0.95 / 2, f(x) = Γ((ν + 1)/2) / (√(νπ) Γ(ν/2)) (1 + x²/ν)^(−(ν + 1)/2), by Simpson's rule.
///
/// # Examples
/// ```
/// // Five runs of each of two learners.
/// assert!((mackrl::statistics::student_factor(8.0) - 2.306).abs() < 1e-3);
/// ```
#[must_use]
pub fn student_factor(degrees: f64) -> f64 {
    let degrees = degrees.clamp(1.0, DEGREES_MOST);
    let half = degrees / 2.0;
    let log_gammas = libm::lgamma(half + 0.5) - libm::lgamma(half);
    let scale = libm::exp(log_gammas) / (degrees * PI).sqrt();
    let density = |x: f64| scale * libm::pow(1.0 + x * x / degrees, -half - 0.5);
    let (mut x, mut inside) = (0.0, 0.0);
    loop {
        let part = STEP / 6.0 * (density(x) + 4.0 * density(x + STEP / 2.0) + density(x + STEP));
        let missing = INSIDE / 2.0 - inside;
        if part >= missing {
            return x + STEP * missing / part;
        }
        inside += part;
        x += STEP;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the tables of every textbook.
    #[test]
    fn factors_are_those_of_the_tables() {
        for (degrees, expected) in [
            (1.0, 12.706_20),
            (2.0, 4.302_65),
            (3.0, 3.182_45),
            (4.0, 2.776_45),
            (8.0, 2.306_00),
            (10.0, 2.228_14),
            (30.0, 2.042_27),
            (1e9, 1.959_96),
        ] {
            let found = student_factor(degrees);
            assert!((found - expected).abs() < 2e-5, "{degrees}: {found}");
        }
    }
}
