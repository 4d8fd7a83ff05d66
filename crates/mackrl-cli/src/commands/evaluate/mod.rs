//! `mackrl evaluate`: how well a trained team plays.

mod elsewhere;
mod episodes;
mod table;

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
    training::{EpisodeResult, Episodes, Evaluation, Score, evaluate_each},
};
use serde::Serialize;

use self::episodes::EpisodesFile;
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
    let mut run = Run::open(&args.run, which)?;
    let trained_on = run.config.env.map().to_owned();
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
    let world = match &args.map {
        Some(map) => {
            let (config, world) = elsewhere::elsewhere(&args.run, &run.config, map)?;
            run.config = config;
            world
        }
        None => sc2::world(&run.config)?,
    };
    let mut rows = match &args.episodes_out {
        Some(file) => Some(EpisodesFile::create(file, seed)?),
        None => None,
    };
    let mut each = |result: &EpisodeResult<'_>| {
        if let Some(rows) = &mut rows {
            rows.add(result);
        }
    };
    let evaluation = evaluate_each(
        &world,
        &run.config,
        &run.weights,
        chosen,
        threads,
        &mut each,
    )
    .with_context(|| format!("cannot evaluate {}", args.run.display()))?;
    if let Some(rows) = rows {
        rows.end()?;
    }
    let name = name_of_replays(args, &run);
    save_replays(&args.run, &run, &name, seed, args.save_replays)?;
    let judgement = Judgement {
        actions: Choice::Greedy,
        episodes,
    };
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    let evaluated = Evaluated {
        checkpoint: which,
        trained_steps_env: run.steps_env(),
        trained_on: args.map.as_ref().map(|_| trained_on.as_str()),
        evaluation: &evaluation,
    };
    print(provenance, &evaluated, args.json)?;
    if which == WhichWeights::Last && args.map.is_none() {
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
        // The result is the same whether this can be written or not.
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
    /// The map of training, if the team played on another.
    #[serde(skip_serializing_if = "Option::is_none")]
    trained_on: Option<&'a str>,
    #[serde(flatten)]
    evaluation: &'a Evaluation,
}

/// What the names of replays begin with: the map and the weights, where they are not the run's own and not the last.
fn name_of_replays(args: &EvaluateArgs, run: &Run) -> String {
    let map = Path::new(run.config.env.map()).file_stem();
    let map = map
        .map(|stem| stem.to_string_lossy())
        .filter(|_| args.map.is_some());
    let map = map.map_or_else(String::new, |map| format!("{map}-"));
    match args.weights.checkpoint {
        WhichWeights::Last => map,
        other => format!("{map}{other}-"),
    }
}

/// Plays the first `count` of the episodes again and keeps them.
fn save_replays(folder: &Path, run: &Run, of: &str, seed: u64, count: usize) -> anyhow::Result<()> {
    if count == 0 {
        return Ok(());
    }
    let meter = Meter::new("replays");
    for episode in 0..count {
        let key = EpisodeKey::new(seed, Stream::Evaluation, episode as u64);
        let replay = record_policy(&run.config, &run.weights, Behaviour::GREEDY, key)
            .with_context(|| format!("cannot make a replay of {}", folder.display()))?;
        let name = format!("{of}seed{seed}-episode{episode}.replay.gz");
        run_folder::keep_replay(folder, &name, &replay.to_bytes())?;
        meter.report(episode + 1, count);
    }
    // The replays are there, whether this can be written or not.
    let _ = writeln!(
        io::stderr(),
        "{} in {}: see `mackrl replay FILE --html OUT`",
        if count == 1 {
            "1 replay is".to_owned()
        } else {
            format!("{count} replays are")
        },
        printable(&folder.join(REPLAYS).display().to_string())
    );
    Ok(())
}

/// Prints an evaluation: a JSON object of all numbers and their provenance, or a sentence and a table.
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
        trained_on,
        evaluation,
    } = evaluated;
    let measure = evaluation.quantities.first();
    let measure = measure.map_or("", |quantity| &quantity.name);
    let score = Score::of(evaluation, trained_steps_env.unwrap_or_default());
    let map = &provenance.map;
    let place = trained_on.map_or_else(String::new, |trained| {
        format!(" on {map}; trained on {trained}")
    });
    let step = match (checkpoint, trained_steps_env) {
        (WhichWeights::Step(_), Some(steps)) => format!("weights of step {steps}"),
        (which, Some(steps)) => format!("{which} weights, of step {steps}"),
        (which, None) => format!("{which} weights"),
    };
    let text = format!("{} ({step}{place})\n\n", did(measure, &score));
    output::print(&(text + &table::table(evaluation)))
}
