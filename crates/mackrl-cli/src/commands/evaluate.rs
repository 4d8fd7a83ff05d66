//! `mackrl evaluate`: how well a trained team plays.

use std::{
    io::{self, Write},
    path::Path,
};

use anyhow::Context;
use mackrl::policy::Behaviour;
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    provenance::{Choice, Judgement, Provenance},
    replay::record_policy,
    run_folder::{self, REPLAYS, Run},
    training::{Episodes, Evaluation, evaluate_in},
};
use serde_json::Value;

use crate::{
    args::EvaluateArgs,
    commands::sc2,
    failure::{Failure, printable},
    output::{self, Sourced},
    progress::Meter,
};

/// Plays greedy episodes with a trained team and prints how it did.
pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let run = Run::open(&args.run)?;
    let seed = args.seed.unwrap_or(run.config.run.seed);
    let episodes = args.episodes.get();
    let threads = args.threads.count();
    if args.save_replays > episodes {
        let message = format!(
            "--save-replays {} of {episodes} episodes, expected at most --episodes",
            args.save_replays
        );
        return Err(Failure::Usage { message }.into());
    }
    if args.save_replays > 0 && run.config.env.is_star_craft() {
        let message = "--save-replays plays episodes again in the simulator, but this run is one of StarCraft II";
        return Err(Failure::Usage {
            message: message.to_owned(),
        }
        .into());
    }
    let chosen = Episodes {
        count: episodes,
        seed,
    };
    let world = sc2::world(&run.config)?;
    let evaluation = evaluate_in(&world, &run.config, &run.weights, chosen, threads)
        .with_context(|| format!("cannot evaluate {}", args.run.display()))?;
    save_replays(&args.run, &run, seed, args.save_replays)?;
    let judgement = Judgement {
        actions: Choice::Greedy,
        episodes,
    };
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    print(provenance, &evaluation, args.json)
}

/// Plays the first `count` of the episodes again and keeps them.
fn save_replays(folder: &Path, run: &Run, seed: u64, count: usize) -> anyhow::Result<()> {
    if count == 0 {
        return Ok(());
    }
    let meter = Meter::new("replays");
    for episode in 0..count {
        let key = EpisodeKey::new(seed, Stream::Evaluation, episode as u64);
        let replay = record_policy(&run.config, &run.weights, Behaviour::GREEDY, key)
            .with_context(|| format!("cannot make a replay of {}", folder.display()))?;
        let name = format!("seed{seed}-episode{episode}.replay.gz");
        run_folder::keep_replay(folder, &name, &replay.to_bytes())?;
        meter.report(episode + 1, count);
    }
    // The replays are there, whether anybody reads this or not.
    let _ = writeln!(
        io::stderr(),
        "{count} replays are in {}: see `mackrl replay FILE --html OUT`",
        printable(&folder.join(REPLAYS).display().to_string())
    );
    Ok(())
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
