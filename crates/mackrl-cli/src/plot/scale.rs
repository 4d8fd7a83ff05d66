//! From numbers to places on an axis, and the round numbers that label it.

/// Distances between ticks that people read easily, up to a power of ten.
const ROUND: [f64; 5] = [1.0, 2.0, 2.5, 5.0, 10.0];

/// A linear axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    range: [f64; 2],
    pixels: [f64; 2],
    step: f64,
}

impl Scale {
    /// Shows `range` in about `ticks` steps; the pixel places of its ends come later, by [`Scale::onto`].
    pub(super) fn new(range: [f64; 2], ticks: f64) -> Self {
        let step = round_step((range[1] - range[0]) / ticks);
        Self {
            range,
            pixels: [0.0, 1.0],
            step,
        }
    }

    /// Fits `values` with ends at round numbers.
    pub(super) fn fitting(values: impl Iterator<Item = f64>, ticks: f64) -> Self {
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        let [low, high] = match high - low {
            width if width > 0.0 => [low, high],
            // No data, or all of it at one number.
            _ if low.is_finite() => [low - 0.5, low + 0.5],
            _ => [0.0, 1.0],
        };
        let step = round_step((high - low) / ticks);
        let down = (low / step + 1e-9).floor() * step;
        let up = (high / step - 1e-9).ceil() * step;
        Self::new([down, up], ticks)
    }

    /// The same axis between these two pixels.
    pub(super) fn onto(self, low: f64, high: f64) -> Self {
        Self {
            pixels: [low, high],
            ..self
        }
    }

    /// The place of `value` in pixels.
    pub(super) fn place(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        let share = (value - low) / (high - low);
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    /// Round numbers within the range, with their labels.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.range;
        let (unit, suffix) = match low.abs().max(high.abs()) {
            largest if largest >= 1e6 => (1e6, " M"),
            largest if largest >= 1e4 => (1e3, " k"),
            _ => (1.0, ""),
        };
        let decimals = decimals(self.step / unit);
        let mut ticks = Vec::new();
        let mut count = (low / self.step - 1e-9).ceil();
        while count * self.step <= high + 1e-9 * self.step {
            let value = count * self.step;
            let label = match format!("{:.*}", decimals, value / unit) {
                zero if count == 0.0 => zero.replace('-', ""),
                number => number.replace('-', "−") + suffix,
            };
            ticks.push((value, label));
            count += 1.0;
        }
        ticks
    }
}

/// The smallest round step that is at least `raw`.
fn round_step(raw: f64) -> f64 {
    let power = 10_f64.powf(raw.log10().floor());
    let factor = ROUND
        .into_iter()
        .find(|factor| factor * power >= raw * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// Decimals that show every multiple of `step`.
fn decimals(step: f64) -> usize {
    let shows = |decimals: &usize| {
        let scaled = step * 10_f64.powf(*decimals as f64);
        (scaled - scaled.round()).abs() < 1e-6 * scaled
    };
    (0..12).find(shows).unwrap_or(12)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: [f64; 2], ticks: f64) -> Vec<String> {
        Scale::new(range, ticks)
            .ticks()
            .into_iter()
            .map(|(_, label)| label)
            .collect()
    }

    #[test]
    fn ticks_are_round_numbers_with_as_many_decimals_as_they_need() {
        assert_eq!(
            labels([0.0, 1.0], 5.0),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
        assert_eq!(
            labels([0.0, 1.0], 4.0),
            ["0.00", "0.25", "0.50", "0.75", "1.00"]
        );
        assert_eq!(labels([-10.0, 10.0], 4.0), ["−10", "−5", "0", "5", "10"]);
    }

    #[test]
    fn large_numbers_are_counted_in_thousands_and_millions() {
        assert_eq!(
            labels([0.0, 4e5], 4.0),
            ["0", "100 k", "200 k", "300 k", "400 k"]
        );
        assert_eq!(
            labels([0.0, 2e6], 4.0),
            ["0.0", "0.5 M", "1.0 M", "1.5 M", "2.0 M"]
        );
    }

    #[test]
    fn a_fitted_axis_holds_all_values_between_round_ends() {
        assert_eq!(
            Scale::fitting([0.52, 0.97].into_iter(), 5.0).range,
            [0.5, 1.0]
        );
        let [low, high] = Scale::fitting([3.0].into_iter(), 5.0).range;
        assert!(low < 3.0 && high > 3.0, "{low} to {high}");
        assert_eq!(Scale::fitting(std::iter::empty(), 5.0).range, [0.0, 1.0]);
    }

    #[test]
    fn places_run_from_one_end_to_the_other() {
        let scale = Scale::new([2.0, 4.0], 4.0).onto(100.0, 0.0);
        assert_eq!(
            [2.0, 3.0, 4.0].map(|value| scale.place(value)),
            [100.0, 50.0, 0.0]
        );
    }
}
