//! `mackrl evaluate`: how well a trained team plays.

use anyhow::Context;
use mackrl::training::{Evaluation, evaluate};
use serde_json::Value;

use crate::{
    args::EvaluateArgs,
    output::{self, Sourced},
    provenance::{Choice, Judgement, Provenance},
    run_folder::Run,
};

/// Plays greedy episodes with a trained team and prints how it did.
pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let run = Run::open(&args.run)?;
    let seed = args.seed.unwrap_or(run.config.run.seed);
    let episodes = args.episodes.get();
    let threads = args.threads.count();
    let evaluation = evaluate(&run.config, &run.weights, episodes, seed, threads)
        .with_context(|| format!("cannot evaluate {}", args.run.display()))?;
    let judgement = Judgement {
        actions: Choice::Greedy,
        episodes,
    };
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    print(provenance, &evaluation, args.json)
}

/// Prints an evaluation: a JSON object of numbers and their provenance, or a table in which each mean stands beside its standard error.
fn print(provenance: Provenance, evaluation: &Evaluation, json: bool) -> anyhow::Result<()> {
    if json {
        output::print_json(&Sourced {
            provenance,
            result: evaluation,
        })
    } else {
        output::print(&table(&serde_json::to_value(evaluation)?))
    }
}

/// One line for each number; `NAME_sem` joins the line of `NAME_mean`.
fn table(evaluation: &Value) -> String {
    let numbers = evaluation.as_object().into_iter().flatten();
    let rows: Vec<Vec<String>> = numbers
        .filter(|(name, _)| !name.ends_with("_sem"))
        .map(|(name, value)| {
            let error = name
                .strip_suffix("_mean")
                .and_then(|stem| evaluation.get(format!("{stem}_sem")))
                .map_or_else(String::new, |error| format!("± {}", number(error)));
            vec![name.clone(), number(value), error]
        })
        .collect();
    output::table(&rows)
}

fn number(value: &Value) -> String {
    match value.as_f64() {
        Some(float) if value.is_f64() => format!("{float:.4}"),
        _ => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_stands_beside_its_standard_error() {
        let evaluation = serde_json::json!({
            "episodes": 320,
            "test_battle_won_mean": 0.9375,
            "test_battle_won_sem": 0.013_64,
        });
        insta::assert_snapshot!(table(&evaluation), @r"
        episodes                 320
        test_battle_won_mean  0.9375  ± 0.0136
        ");
    }
}
