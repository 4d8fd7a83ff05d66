//! Whether controllers still read their input: units at the end of their range pass nothing on, and logits that are the same in
//! every situation are no answer to it.

use super::{Activations, Hierarchy};
use crate::policy::Tally;

/// Beyond this a recurrent unit counts as saturated; its range is (−1, 1).
const SATURATED: f32 = 0.99;

impl Hierarchy {
    /// Adds to `tally`, for each level that learns, `saturation_LEVEL`, the share of recurrent units with |h| > .99, and
    /// `logit_variation_LEVEL`, the standard deviation of a logit over situations, averaged over choices.
    pub fn report_health(&self, activations: &Activations, tally: &mut Tally) {
        let levels = self.parts.declaration.levels().iter();
        for (level, own) in levels.zip(&activations.banks) {
            let Some(own) = own else {
                continue;
            };
            let hidden = own.trace.all_hidden();
            let saturated = hidden.iter().filter(|h| h.abs() > SATURATED).count();
            let name = format!("saturation_{}", level.name);
            tally.add(name, saturated as f64, hidden.len() as f64);
            let columns = own.law().columns;
            let logits = own.trace.all_logits();
            let rows = logits.len() / columns;
            if rows > 0 {
                let name = format!("logit_variation_{}", level.name);
                tally.add(name, variation(logits, columns) * rows as f64, rows as f64);
            }
        }
    }
}

/// The standard deviation over rows, averaged over columns.
fn variation(logits: &[f32], columns: usize) -> f64 {
    let rows = (logits.len() / columns) as f64;
    let mut sums = vec![[0.0_f64; 2]; columns];
    for row in logits.chunks_exact(columns) {
        for (sum, &logit) in sums.iter_mut().zip(row) {
            sum[0] += f64::from(logit);
            sum[1] += f64::from(logit).powi(2);
        }
    }
    let deviations = sums.iter().map(|[sum, squares]| {
        let mean = sum / rows;
        (squares / rows - mean * mean).max(0.0).sqrt()
    });
    deviations.sum::<f64>() / columns as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logits_that_are_the_same_in_every_situation_do_not_vary() {
        assert_eq!(variation(&[3.0, -1.0, 3.0, -1.0, 3.0, -1.0], 2), 0.0);
        // Deviations of 1 and 0.
        assert!((variation(&[1.0, 5.0, 3.0, 5.0], 2) - 0.5).abs() < 1e-9);
    }
}
