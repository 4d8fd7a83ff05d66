//! A run as curves on a terminal, drawn again and again over itself.
//!
//! The curves are of the rows that stand in `metrics.jsonl`: what is shown is what is written. A library of terminal widgets would
//! bring dozens of crates for these few lines of block characters.

use std::collections::VecDeque;

use serde_json::{Map, Value};

/// What is shown: the name of a metric, what it is called here, and its decimal places.
const CURVES: [(&str, &str, usize); 8] = [
    ("test_battle_won_mean", "won in tests", 3),
    ("battle_won_mean", "won in training", 3),
    ("return_mean", "return", 2),
    ("mackrl/delegation_rate", "delegation", 3),
    ("mackrl/entropy_l1", "entropy, partition", 3),
    ("mackrl/entropy_l2", "entropy, pairs", 3),
    ("mackrl/entropy_l3", "entropy, agents", 3),
    ("sys/sps", "steps a second", 0),
];
/// Eighths of a block, from the lowest.
const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Lines of a curve.
const HEIGHT: usize = 2;
/// Columns before and after a curve.
const MARGINS: usize = 20 + 24;
/// Numbers that are kept of a curve; older ones are thinned out.
const NUMBERS_MOST: usize = 4096;
/// Least columns and lines of a terminal on which there is room.
pub(super) const ROOM: [u16; 2] = [70, 22];

/// The curves so far.
#[derive(Debug, Default)]
pub(super) struct Dashboard {
    curves: [VecDeque<f64>; CURVES.len()],
    /// Lines that were drawn, to be drawn over.
    lines: usize,
}

impl Dashboard {
    /// Hears a row of metrics as it is written.
    pub(super) fn hear(&mut self, row: &str) {
        let Ok(row) = serde_json::from_str::<Map<String, Value>>(row) else {
            return;
        };
        for ((name, ..), curve) in CURVES.iter().zip(&mut self.curves) {
            let Some(number) = row.get(*name).and_then(Value::as_f64) else {
                continue;
            };
            curve.push_back(number);
            if curve.len() > NUMBERS_MOST {
                let mut is_even = false;
                curve.retain(|_| {
                    is_even = !is_even;
                    is_even
                });
            }
        }
    }

    /// What to write in order to show `headline`, how much is done, in [0, 1], and the curves, over what was shown before.
    pub(super) fn draw(&mut self, headline: &str, done: f64, width: u16) -> String {
        let columns = usize::from(width).saturating_sub(MARGINS).max(8);
        let mut lines = vec![headline.to_owned(), bar(done, usize::from(width) - 1)];
        for ((_, name, places), curve) in CURVES.iter().zip(&self.curves) {
            if !curve.is_empty() {
                lines.extend(draw_curve(name, *places, curve, columns));
            }
        }
        let up = match self.lines {
            0 => String::new(),
            lines => format!("\x1b[{lines}A"),
        };
        // A shorter drawing leaves nothing of a longer one.
        let height = lines.len().max(self.lines);
        lines.resize(height, String::new());
        self.lines = height;
        let lines: Vec<String> = lines
            .iter()
            .map(|line| format!("\r{line}\x1b[K\n"))
            .collect();
        up + &lines.concat()
    }
}

fn bar(done: f64, width: usize) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a number of columns"
    )]
    let full = (done.clamp(0.0, 1.0) * width as f64).round() as usize;
    "█".repeat(full) + &"░".repeat(width - full)
}

/// Name, curve, latest number, and the range that the curve spans.
fn draw_curve(
    name: &str,
    places: usize,
    curve: &VecDeque<f64>,
    columns: usize,
) -> [String; HEIGHT] {
    let means = means(curve, columns);
    let least = means.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = means.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let latest = curve.back().copied().unwrap_or_default();
    let mut rows = [String::new(), String::new()];
    for mean in means {
        let share = (mean - least) / (greatest - least).max(f64::MIN_POSITIVE);
        let level = share * (HEIGHT * BLOCKS.len() - 1) as f64;
        for (row, below) in rows.iter_mut().zip([BLOCKS.len() as f64, 0.0]) {
            row.push(block(level - below));
        }
    }
    let [upper, lower] = rows;
    [
        format!("{name:<19} {upper:<columns$} {latest:.places$}"),
        format!(
            "{:<19} {lower:<columns$} {least:.places$} to {greatest:.places$}",
            ""
        ),
    ]
}

/// The block that is filled up to `level` eighths; nothing below the lowest.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the blocks"
)]
fn block(level: f64) -> char {
    if level < -0.5 {
        return ' ';
    }
    let index = level.round().clamp(0.0, (BLOCKS.len() - 1) as f64);
    BLOCKS[index as usize]
}

/// The curve in at most `columns` numbers, each the mean of those that fall into its column.
fn means(curve: &VecDeque<f64>, columns: usize) -> Vec<f64> {
    let count = curve.len();
    let columns = columns.min(count);
    (0..columns)
        .map(|column| {
            let range = column * count / columns..(column + 1) * count / columns;
            let width = range.len() as f64;
            curve.range(range).sum::<f64>() / width
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dashboard(numbers: &[f64]) -> Dashboard {
        let mut dashboard = Dashboard::default();
        for number in numbers {
            dashboard.hear(&format!("{{\"return_mean\":{number},\"t_env\":1}}"));
        }
        dashboard
    }

    #[test]
    fn a_curve_rises_from_its_least_to_its_greatest_number() {
        let drawn = dashboard(&[0.0, 1.0, 2.0, 3.0]).draw("run", 0.5, 70);
        let lines: Vec<&str> = drawn
            .lines()
            .map(|line| line.trim_end_matches("\x1b[K"))
            .collect();
        assert_eq!(lines[1].matches('█').count(), 35);
        let curve = |line: &str| line.chars().skip(21).take(4).collect::<String>();
        assert_eq!(curve(lines[2]), "  ▃█");
        assert_eq!(curve(lines[3]), "▁▆██");
        assert!(lines[2].ends_with(" 3.00"), "{}", lines[2]);
        assert!(lines[3].ends_with(" 0.00 to 3.00"), "{}", lines[3]);
    }

    #[test]
    fn a_drawing_lies_over_the_one_before() {
        let mut dashboard = dashboard(&[1.0, 2.0]);
        let first = dashboard.draw("run", 0.1, 80);
        assert!(!first.contains("\x1b[4A"), "nothing lies above the first");
        assert!(dashboard.draw("run", 0.2, 80).starts_with("\x1b[4A\r"));
    }

    #[test]
    fn a_long_run_is_thinned_out_and_keeps_its_shape() {
        let numbers: Vec<f64> = (0..3 * NUMBERS_MOST).map(|number| number as f64).collect();
        let dashboard = dashboard(&numbers);
        let curve = &dashboard.curves[2];
        assert!(curve.len() <= NUMBERS_MOST, "{}", curve.len());
        let means = means(curve, 10);
        assert!(means.is_sorted() && means.len() == 10, "{means:?}");
    }

    #[test]
    fn a_curve_without_change_is_drawn() {
        assert!(
            dashboard(&[2.0; 3])
                .draw("run", 1.0, 80)
                .contains("2.00 to 2.00")
        );
    }
}
