//! Whether controllers still read their input: units at the end of their range pass nothing on, and logits that are the same in
//! every situation are no answer to it.

use super::{Activations, Hierarchy, metrics::OfLevel};
use crate::policy::Tally;

/// Beyond this a recurrent unit counts as saturated; its range is (−1, 1).
const SATURATED: f32 = 0.99;
/// One row in so many is looked at, so that it costs next to nothing; no number of groups or environments is likely to share a
/// factor with it.
const STRIDE: usize = 7;

impl Hierarchy {
    /// Adds to `tally`, for each level that learns, `saturation_LEVEL`, the share of recurrent units with |h| > .99,
    /// `logit_variation_LEVEL`, the standard deviation of a logit over situations, averaged over choices, and
    /// `logit_spread_LEVEL`, the standard deviation of a situation's logits over choices, averaged over situations. Masked choices
    /// count: the mask is not what a controller has learnt. A seventh of the rows is looked at.
    pub fn report_health(&self, activations: &Activations, tally: &mut Tally) {
        let levels = self.parts.declaration.levels().iter();
        for (level, own) in levels.zip(&activations.banks) {
            let Some(own) = own else {
                continue;
            };
            let hidden = Rows::new(own.trace.all_hidden(), own.trace.sizes.hidden);
            let saturated = hidden.of_all(|h| usize::from(h.abs() > SATURATED));
            let units = hidden.count() * hidden.width;
            let name = OfLevel::Saturation.name(level);
            tally.add(name, saturated as f64, units as f64);
            let logits = Rows::new(own.trace.all_logits(), own.law().columns);
            let rows = logits.count() as f64;
            if rows > 0.0 {
                for (quantity, deviation) in [
                    (OfLevel::LogitVariation, logits.variation()),
                    (OfLevel::LogitSpread, logits.spread()),
                ] {
                    tally.add(quantity.name(level), deviation * rows, rows);
                }
            }
        }
    }
}

/// A sample of the rows of a table.
#[derive(Debug, Clone, Copy)]
struct Rows<'a> {
    values: &'a [f32],
    width: usize,
}

impl<'a> Rows<'a> {
    const fn new(values: &'a [f32], width: usize) -> Self {
        Self { values, width }
    }

    fn iter(self) -> impl Iterator<Item = &'a [f32]> {
        self.values.chunks_exact(self.width).step_by(STRIDE)
    }

    const fn count(self) -> usize {
        (self.values.len() / self.width).div_ceil(STRIDE)
    }

    /// The sum of `of` each value.
    fn of_all(self, of: impl Fn(f32) -> usize) -> usize {
        let of = &of;
        self.iter().flatten().map(|&value| of(value)).sum()
    }

    /// The standard deviation over rows, averaged over columns.
    fn variation(self) -> f64 {
        let mut sums = vec![[0.0_f64; 2]; self.width];
        for row in self.iter() {
            for (sums, &value) in sums.iter_mut().zip(row) {
                *sums = added(*sums, value);
            }
        }
        let rows = self.count() as f64;
        let deviations = sums.iter().map(|&sums| deviation(rows, sums));
        deviations.sum::<f64>() / self.width as f64
    }

    /// The standard deviation over columns, averaged over rows.
    fn spread(self) -> f64 {
        let sums = |row: &[f32]| row.iter().fold([0.0; 2], |sums, &value| added(sums, value));
        let deviations = self
            .iter()
            .map(|row| deviation(self.width as f64, sums(row)));
        deviations.sum::<f64>() / self.count() as f64
    }
}

fn added([sum, squares]: [f64; 2], value: f32) -> [f64; 2] {
    let value = f64::from(value);
    [sum + value, squares + value * value]
}

/// Of numbers by their count, their sum and the sum of their squares.
fn deviation(count: f64, [sum, squares]: [f64; 2]) -> f64 {
    let mean = sum / count;
    (squares / count - mean * mean).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of two columns with such rows between them as are not looked at.
    fn rows(seen: &[[f32; 2]]) -> Vec<f32> {
        let unseen = [[100.0, -100.0]; STRIDE - 1];
        let all = seen.iter().flat_map(|row| [*row].into_iter().chain(unseen));
        all.flatten().collect()
    }

    #[test]
    fn logits_that_are_the_same_in_every_situation_do_not_vary() {
        let same = rows(&[[3.0, -1.0]; 3]);
        assert_eq!(Rows::new(&same, 2).variation(), 0.0);
        // Deviations of 1 and 0.
        let one_varies = rows(&[[1.0, 5.0], [3.0, 5.0]]);
        assert!((Rows::new(&one_varies, 2).variation() - 0.5).abs() < 1e-9);
    }

    #[test]
    fn logits_spread_over_the_choices_of_each_situation() {
        // Deviations of 2 and 0.
        let values = rows(&[[1.0, 5.0], [3.0, 3.0]]);
        assert!((Rows::new(&values, 2).spread() - 1.0).abs() < 1e-9);
    }
}
