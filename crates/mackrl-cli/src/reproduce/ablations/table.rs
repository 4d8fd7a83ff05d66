//! The ablations as text.

use std::fmt::{Display, Formatter, Result};

use super::AblationReport;
use crate::output;

impl Display for AblationReport {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        writeln!(
            out,
            "Ablations on {}: share of battles won, mean of the last tenth of a run's tests",
            self.map
        )?;
        writeln!(out, "{}\n", self.command)?;
        let heading = ["", "mean ± error", "IQM [95 %]", "− MACKRL", "P(better)"];
        let rows = self.variants.iter().map(|variant| {
            let versus = variant.versus_mackrl.as_ref();
            vec![
                format!("{} ({})", variant.label, variant.curve.runs),
                format!("{:.3} ± {:.3}", variant.final_mean, variant.final_error),
                format!(
                    "{:.3} [{:.3}, {:.3}]",
                    variant.final_iqm.estimate, variant.final_iqm.low, variant.final_iqm.high
                ),
                versus.map_or_else(String::new, |versus| {
                    format!("{:+.3} ± {:.3}", versus.difference, versus.error)
                }),
                versus.map_or_else(String::new, |versus| {
                    let better = versus.probability_of_improvement;
                    format!(
                        "{:.2} [{:.2}, {:.2}]",
                        better.estimate, better.low, better.high
                    )
                }),
            ]
        });
        let heading = heading.map(str::to_owned).to_vec();
        let rows: Vec<Vec<String>> = std::iter::once(heading).chain(rows).collect();
        out.write_str(&output::table(&rows))?;
        writeln!(
            out,
            "\nP(better): that a run of the variant ends higher than a run of MACKRL\n"
        )?;
        for variant in self.variants.iter().skip(1) {
            writeln!(out, "  {:<28} asks {}", variant.label, variant.question)?;
        }
        writeln!(out, "\nVerdicts")?;
        self.claims.iter().try_for_each(|claim| claim.write(out))
    }
}
