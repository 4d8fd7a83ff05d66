//! Averages of one sample.

/// Share of a sample that the interquartile mean leaves out at each end.
const TRIMMED: usize = 4;

/// The arithmetic mean; NaN of an empty sample, which has none.
#[must_use]
pub fn mean(sample: &[f64]) -> f64 {
    sample.iter().sum::<f64>() / sample.len() as f64
}

/// The mean and its standard error s/√n, with the unbiased sample variance s²; the error of a single number is 0.
///
/// # Examples
/// ```
/// let (mean, error) = mackrl::statistics::mean_and_standard_error(&[1.0, 2.0, 4.0, 5.0]);
/// assert_eq!(mean, 3.0);
/// assert!((error - (10.0_f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15);
/// ```
#[must_use]
pub fn mean_and_standard_error(sample: &[f64]) -> (f64, f64) {
    let count = sample.len() as f64;
    let mean = mean(sample);
    if sample.len() < 2 {
        return (mean, 0.0);
    }
    let squares: f64 = sample.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

/// The middle of a sample: of an even number, the mean of the two in the middle; NaN of an empty sample.
#[must_use]
pub fn median(sample: &[f64]) -> f64 {
    quantile(sample, 0.5)
}

/// The number below which a share of the sample lies, interpolated linearly between the order statistics that stand at the
/// shares 0, 1/(n − 1), …, 1 (`NumPy`'s default); NaN of an empty sample.
///
/// # Panics
/// If `share` is not in [0, 1].
#[must_use]
pub fn quantile(sample: &[f64], share: f64) -> f64 {
    assert!((0.0..=1.0).contains(&share), "{share} is not in [0, 1]");
    let sorted = sorted(sample);
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share * last as f64;
    let (below, above) = (index(place.floor(), last), index(place.ceil(), last));
    sorted[below] + (place - place.floor()) * (sorted[above] - sorted[below])
}

/// The mean of the middle half: of the sorted sample, ⌊n/4⌋ numbers at each end are left out.
///
/// # Examples
/// ```
/// let scores = [0.0, 0.5, 0.6, 0.7, 100.0];
/// assert!((mackrl::statistics::interquartile_mean(&scores) - 0.6).abs() < 1e-12);
/// ```
#[must_use]
pub fn interquartile_mean(sample: &[f64]) -> f64 {
    let sorted = sorted(sample);
    let left_out = sorted.len() / TRIMMED;
    mean(&sorted[left_out..sorted.len() - left_out])
}

fn sorted(sample: &[f64]) -> Vec<f64> {
    let mut sorted = sample.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a whole number in 0..=last"
)]
fn index(place: f64, last: usize) -> usize {
    (place as usize).min(last)
}
