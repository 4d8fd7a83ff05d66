//! An evaluation as a table: a line for each thing that a person asks about.

use mackrl_run::training::Evaluation;

use crate::output;

/// What the world counts, in its order and without the success, which stands in the sentence above; then what the controllers did,
/// rates that differ in a number alone in one line.
pub(super) fn table(evaluation: &Evaluation) -> String {
    let quantities = evaluation.quantities.iter().skip(1);
    let mut rows: Vec<Vec<String>> = quantities
        .map(|quantity| {
            vec![
                quantity.name.clone(),
                format!("{:.4}", quantity.mean),
                format!("± {:.4}", quantity.standard_error),
            ]
        })
        .collect();
    let mut families: Vec<Family<'_>> = Vec::new();
    for (name, &mean) in &evaluation.controllers {
        let (stem, number) = numbered(name);
        let known = families
            .iter_mut()
            .find(|family| number.is_some() && !family.numbers.is_empty() && family.stem == stem);
        match known {
            Some(family) => family.add(number, mean),
            None => families.push(Family::new(stem, number, mean)),
        }
    }
    rows.extend(families.iter().map(Family::row));
    let text = output::table(&rows);
    if families.iter().any(|family| family.numbers.len() > 1) {
        return text + "\n--json gives every number.\n";
    }
    text
}

/// Rates whose names differ in the number at their end alone.
struct Family<'a> {
    stem: &'a str,
    numbers: Vec<u64>,
    least: f64,
    most: f64,
}

impl<'a> Family<'a> {
    fn new(stem: &'a str, number: Option<u64>, mean: f64) -> Self {
        Self {
            stem,
            numbers: Vec::from_iter(number),
            least: mean,
            most: mean,
        }
    }

    fn add(&mut self, number: Option<u64>, mean: f64) {
        self.numbers.extend(number);
        self.least = self.least.min(mean);
        self.most = self.most.max(mean);
    }

    fn row(&self) -> Vec<String> {
        let (first, last) = (self.numbers.iter().min(), self.numbers.iter().max());
        let name = match (first, last) {
            (Some(first), Some(last)) if first < last => format!("{}{first} … {last}", self.stem),
            (Some(only), _) => format!("{}{only}", self.stem),
            _ => self.stem.to_owned(),
        };
        let mut row = vec![name, format!("{:.4}", self.least)];
        if self.least < self.most {
            row.push(format!("to {:.4}", self.most));
        }
        row
    }
}

/// A name, and the number that it ends with.
fn numbered(name: &str) -> (&str, Option<u64>) {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    match name[stem.len()..].parse() {
        Ok(number) => (stem, Some(number)),
        Err(_) => (name, None),
    }
}

#[cfg(test)]
mod tests {
    use mackrl_run::training::Quantity;

    use super::*;

    #[test]
    fn a_mean_stands_beside_its_standard_error_and_numbered_rates_in_one_line() {
        let quantity = |name: &str, mean, standard_error| Quantity {
            name: name.to_owned(),
            mean,
            standard_error,
        };
        let rates = [
            ("mackrl/rate_10", 0.5),
            ("mackrl/rate_2", 0.25),
            ("mackrl/a", 1.0),
            ("mackrl/alone_3", 0.75),
        ];
        let evaluation = Evaluation {
            episodes: 320,
            distinct_openings: 0.5,
            quantities: vec![
                quantity("battle_won", 0.9375, 0.013_64),
                quantity("ep_length", 25.5, 0.25),
            ],
            controllers: rates.map(|(name, rate)| (name.to_owned(), rate)).into(),
        };
        insta::assert_snapshot!(table(&evaluation), @r"
        ep_length           25.5000   ± 0.2500
        mackrl/a             1.0000
        mackrl/alone_3       0.7500
        mackrl/rate_2 … 10   0.2500  to 0.5000

        --json gives every number.
        ");
    }
}
