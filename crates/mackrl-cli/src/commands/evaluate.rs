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
    run_folder::{self, REPLAYS, Run, WhichWeights, read_description},
    training::{Episodes, Evaluation, Score, evaluate_in},
};
use serde::Serialize;

use crate::{
    args::EvaluateArgs,
    commands::sc2,
    failure::{Failure, printable},
    output::{self, Sourced},
    progress::Meter,
    words::did,
};

/// Plays greedy episodes with a trained team and prints how it did.
pub(crate) fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let which = args.weights.checkpoint;
    let run = Run::open(&args.run, which)?;
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
    save_replays(&args.run, &run, which, seed, args.save_replays)?;
    let judgement = Judgement {
        actions: Choice::Greedy,
        episodes,
    };
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    let evaluated = Evaluated {
        checkpoint: which,
        trained_steps_env: run.steps_env(),
        evaluation: &evaluation,
    };
    print(provenance, &evaluated, args.json)?;
    if which == WhichWeights::Last {
        note_better(&args.run);
    }
    Ok(())
}

/// Says so if weights of the run that did best in a test are better than its last.
fn note_better(folder: &Path) {
    let teams = read_description(folder).ok();
    let Some(teams) = teams.and_then(|(_, description)| description.teams) else {
        return;
    };
    if let Some(best) = teams.better() {
        // The result is the same whether anybody reads this or not.
        let _ = writeln!(
            io::stderr(),
            "note: when the run ended its best weights, of step {}, {}, and the last {}: evaluate those with --checkpoint best",
            best.steps_env,
            did(&teams.measure, best),
            did(&teams.measure, &teams.last)
        );
    }
}

/// An evaluation, and of what.
#[derive(Debug, Serialize)]
struct Evaluated<'a> {
    checkpoint: WhichWeights,
    /// Environment steps that the weights had seen, if they say so.
    trained_steps_env: Option<u64>,
    #[serde(flatten)]
    evaluation: &'a Evaluation,
}

/// Plays the first `count` of the episodes again and keeps them.
fn save_replays(
    folder: &Path,
    run: &Run,
    which: WhichWeights,
    seed: u64,
    count: usize,
) -> anyhow::Result<()> {
    if count == 0 {
        return Ok(());
    }
    let meter = Meter::new("replays");
    let of = match which {
        WhichWeights::Last => String::new(),
        other => format!("{other}-"),
    };
    for episode in 0..count {
        let key = EpisodeKey::new(seed, Stream::Evaluation, episode as u64);
        let replay = record_policy(&run.config, &run.weights, Behaviour::GREEDY, key)
            .with_context(|| format!("cannot make a replay of {}", folder.display()))?;
        let name = format!("{of}seed{seed}-episode{episode}.replay.gz");
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

/// Prints an evaluation: a JSON object of numbers and their provenance, or a sentence and a table in which each mean stands beside
/// its standard error.
fn print(provenance: Provenance, evaluated: &Evaluated<'_>, json: bool) -> anyhow::Result<()> {
    if json {
        return output::print_json(&Sourced {
            provenance,
            result: evaluated,
        });
    }
    let Evaluated {
        checkpoint,
        trained_steps_env,
        evaluation,
    } = evaluated;
    let measure = evaluation.quantities.first();
    let measure = measure.map_or("", |quantity| &quantity.name);
    let score = Score::of(evaluation, trained_steps_env.unwrap_or_default());
    let step = match (checkpoint, trained_steps_env) {
        (WhichWeights::Step(_), Some(steps)) => format!("weights of step {steps}"),
        (which, Some(steps)) => format!("{which} weights, of step {steps}"),
        (which, None) => format!("{which} weights"),
    };
    let text = format!("{} ({step})\n\n", did(measure, &score));
    output::print(&(text + &table(evaluation)))
}

/// One line for each number: what the world counts in the order in which it counts it, then what the controllers did.
fn table(evaluation: &Evaluation) -> String {
    let quantities = evaluation.quantities.iter().map(|quantity| {
        vec![
            format!("test_{}_mean", quantity.name),
            format!("{:.4}", quantity.mean),
            format!("± {:.4}", quantity.standard_error),
        ]
    });
    let mut controllers: Vec<(&String, &f64)> = evaluation.controllers.iter().collect();
    controllers.sort_by_key(|(name, _)| numbered(name));
    let controllers = controllers.into_iter();
    let controllers = controllers.map(|(name, mean)| vec![name.clone(), format!("{mean:.4}")]);
    output::table(&quantities.chain(controllers).collect::<Vec<_>>())
}

/// A name, and the number that it ends with: 2 comes before 10.
fn numbered(name: &str) -> (&str, Option<u64>) {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem, name[stem.len()..].parse().ok())
}

#[cfg(test)]
mod tests {
    use mackrl_run::training::Quantity;

    use super::*;

    #[test]
    fn a_mean_stands_beside_its_standard_error_and_numbers_are_in_order() {
        let quantity = |name: &str, mean, standard_error| Quantity {
            name: name.to_owned(),
            mean,
            standard_error,
        };
        let rates = [
            ("mackrl/rate_10", 0.5),
            ("mackrl/rate_2", 0.25),
            ("mackrl/a", 1.0),
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
        test_battle_won_mean   0.9375  ± 0.0136
        test_ep_length_mean   25.5000  ± 0.2500
        mackrl/a               1.0000
        mackrl/rate_2          0.2500
        mackrl/rate_10         0.5000
        ");
    }
}
