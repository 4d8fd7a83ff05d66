//! Figure 7 as text.

use std::fmt::{Display, Formatter, Result};

use super::{ENEMIES, Figure7Report};

impl Display for Figure7Report {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        writeln!(
            out,
            "Figure 7, share of chosen pairs that delegate on 2s3z, by commonly known enemies: mean of {} seeds",
            self.seeds
        )?;
        writeln!(out, "{}\n", self.command)?;
        write!(out, "{:>18}            ", "")?;
        (0..=ENEMIES).try_for_each(|enemies| write!(out, "{enemies:>8}"))?;
        for moment in &self.moments {
            write!(out, "\n{:>18}  ours      ", moment.when())?;
            for rate in &moment.rates {
                match rate.mean {
                    Some(mean) => write!(out, "{mean:>8.3}")?,
                    None => write!(out, "{:>8}", "–")?,
                }
            }
            write!(out, "\n{:>18}  published ", "")?;
            moment
                .published
                .iter()
                .try_for_each(|rate| write!(out, "{rate:>8.3}"))?;
        }
        writeln!(out, "\n\nVerdicts")?;
        self.claims.iter().try_for_each(|claim| claim.write(out))
    }
}
