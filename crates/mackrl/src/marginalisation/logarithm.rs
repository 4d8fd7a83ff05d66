//! Sums and shares of probabilities that are held as logarithms.

use crate::Real;

/// e^{term − total}: the share of a term in a sum, both in logarithms; 0 if the sum is empty of probability.
pub(super) fn share<F: Real>(term: F, total: F) -> F {
    if term == F::NEG_INFINITY {
        F::ZERO
    } else {
        (term - total).exp()
    }
}

/// log Σ e^{x} in one pass, −∞ if there is no probability. If one term alone is not −∞, it is returned to the bit; a NaN
/// stays one, so that a check of the result finds it.
pub(super) fn log_sum_exp<F: Real>(terms: impl IntoIterator<Item = F>) -> F {
    let mut largest = F::NEG_INFINITY;
    // Σ e^{x − largest} over the terms so far.
    let mut sum = F::ZERO;
    for term in terms {
        if term > largest {
            sum = sum * (largest - term).exp() + F::ONE;
            largest = term;
        } else if term != F::NEG_INFINITY {
            sum += (term - largest).exp();
        }
    }
    largest + sum.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NEG_INFINITY;

    #[test]
    fn a_sum_without_probability_is_minus_infinity_and_has_no_shares() {
        assert_eq!(log_sum_exp::<f64>([]), NONE);
        assert_eq!(log_sum_exp([NONE, NONE]), NONE);
        assert_eq!(share(NONE, NONE), 0.0);
        assert_eq!(share(NONE, -3.0), 0.0);
    }

    #[test]
    fn a_sum_of_one_term_is_that_term_to_the_bit() {
        let term = -0.123_456_789_f64;
        for terms in [[term, NONE], [NONE, term]] {
            assert_eq!(log_sum_exp(terms).to_bits(), term.to_bits());
        }
    }

    #[test]
    fn sums_do_not_depend_on_where_the_largest_term_stands() {
        let expected = -1_000.0 + (1.0 + 2.0 * (-1.0_f64).exp()).ln();
        for terms in [
            [-1_000.0, -1_001.0, -1_001.0],
            [-1_001.0, -1_000.0, -1_001.0],
            [-1_001.0, -1_001.0, -1_000.0],
        ] {
            assert!((log_sum_exp(terms) - expected).abs() < 1e-12, "{terms:?}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        for terms in [[f64::NAN, 0.0], [0.0, f64::NAN], [NONE, f64::NAN]] {
            assert!(log_sum_exp(terms).is_nan(), "{terms:?}");
        }
    }
}
