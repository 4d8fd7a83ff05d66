//! `mackrl train`: from a configuration to a run folder.

use std::path::{Path, PathBuf};

use anyhow::Context;
use mackrl::nn::InstructionSet;
use mackrl_run::{
    config::Config,
    provenance::sha256,
    run_folder::{InitialSource, InitialWeights, Run, RunFolder, WhichWeights, read_description},
    training::{
        Teams,
        assembly::{self, RunWorld},
    },
    training_loop::{self, Summary},
};
use mackrl_skirmish::SKIRMISH;

use crate::{
    args::TrainArgs,
    commands::{sc2, sizes},
    output,
    progress::RunProgress,
    signals,
    words::{BATTLE_WON, between, did},
};

/// How many of the latest tests are spoken of.
const TESTS_SHOWN: usize = 5;

/// Trains a team. Everything that can be wrong with what was typed is found before the run folder is created.
pub(crate) fn run(args: &TrainArgs) -> anyhow::Result<()> {
    let source = match &args.from {
        Some(run) => Some(Run::open(run, args.checkpoint)?),
        None => None,
    };
    let layers = match &source {
        Some(run) => args.configuration.over_run(&run.config)?,
        None => args.configuration.layers()?,
    };
    let resolved = layers.resolve()?;
    let mut config = resolved.config().clone();
    let path = args.out.clone().unwrap_or_else(|| default_folder(&config));
    RunFolder::check_free(&path)?;
    let stop = signals::listen()?;
    let world = sc2::world(&config)?;
    let initial = match (&args.from, &source) {
        (Some(folder), Some(run)) => {
            let initial = initial_weights(folder, args.checkpoint, run);
            check_weights(folder, run, &config, &world)?;
            config.run.initial_weights = sha256(&initial.bytes);
            Some(initial)
        }
        _ => None,
    };
    let threads = args.threads.count();
    let mut progress = RunProgress::new();
    progress.announce(&resolved, InstructionSet::chosen()?, threads);
    let summary = training_loop::train_from(
        &path,
        &config,
        initial.as_ref(),
        &world,
        threads,
        &stop,
        &mut progress,
    )?;
    print(&summary, args.json)
}

/// The weights that `--from` asks for, and where they come from.
fn initial_weights(folder: &Path, checkpoint: WhichWeights, run: &Run) -> InitialWeights {
    InitialWeights {
        bytes: run.weights.clone(),
        source: InitialSource {
            run: folder.display().to_string(),
            checkpoint,
            steps_env: run.steps_env(),
        },
    }
}

/// Refuses weights with which the run cannot begin, before anything is made.
fn check_weights(
    folder: &Path,
    run: &Run,
    config: &Config,
    world: &RunWorld,
) -> anyhow::Result<()> {
    let shown = folder.display().to_string();
    let asked = format!("train on {}", config.env.map());
    sizes::expect_same(&run.config, world, (&asked, &shown))?;
    let [own, wanted] = [&run.config, config].map(|config| config.algorithm.name());
    assembly::trained(config, world, &run.weights).with_context(|| {
        let algorithms = if own == wanted {
            String::new()
        } else {
            format!(", which {own} trained, with {wanted}")
        };
        format!("cannot begin with the weights of {shown}{algorithms}")
    })?;
    Ok(())
}

/// Prints what a finished run says of itself: how its team plays, then what it cost, then what to do next.
pub(super) fn print(summary: &Summary, json: bool) -> anyhow::Result<()> {
    if json {
        return output::print_json(summary);
    }
    let folder = summary.folder.display();
    output::print(&format!(
        "{}{}{folder}: {} environment steps in {:.1} s ({:.0} a second)\nnext: mackrl evaluate {folder}{}\n",
        playing(&summary.teams, &summary.tests),
        meaning(summary),
        summary.steps_env,
        summary.wall_s,
        summary.steps_per_s,
        flags(summary),
    ))
}

/// What a measure means that is not the winning of battles, where the world says so.
fn meaning(summary: &Summary) -> String {
    let measure = &summary.teams.measure;
    let described = read_description(&summary.folder).ok();
    let world = described.and_then(|(config, _)| config.env.simulated().world().ok());
    let told = world.filter(|_| measure != BATTLE_WON).and_then(|world| {
        let mut declared = world.spec().statistics.iter();
        let meaning = declared
            .find(|statistic| statistic.name == **measure)?
            .meaning
            .clone();
        Some(format!("({measure}: {meaning}.)\n"))
    });
    told.unwrap_or_default()
}

/// What is worth adding to the next command: the better weights, or battles to look at, if they can be had.
fn flags(summary: &Summary) -> &'static str {
    if summary.teams.better().is_some() {
        return " --checkpoint best";
    }
    match read_description(&summary.folder) {
        Ok((config, _)) if config.env.name() == SKIRMISH => " --save-replays 3",
        _ => "",
    }
}

/// How the last weights and the best play, in sentences.
fn playing(teams: &Teams, tests: &[f64]) -> String {
    let Teams {
        measure,
        last,
        best,
    } = teams;
    let mut text = format!("The team {} that it had not seen.\n", did(measure, last));
    let recent = &tests[tests.len().saturating_sub(TESTS_SHOWN)..];
    if recent.len() == TESTS_SHOWN {
        let [least, most] = [f64::min, f64::max].map(|of| recent.iter().copied().reduce(of));
        let [least, most] = [least, most].map(|share| share.unwrap_or_default());
        text += &format!(
            "Its last {TESTS_SHOWN} tests {}.\n",
            between(measure, least, most)
        );
    }
    match best {
        Some(best) if best.steps_env == last.steps_env => {
            text += "No earlier weights did better in a test.\n";
        }
        Some(best) => {
            text += &format!(
                "The best in a test were the weights of step {}, which {} as well.\n",
                best.steps_env,
                did(measure, best)
            );
        }
        None => {}
    }
    text
}

/// Where a run lies if nothing else is asked for.
fn default_folder(config: &Config) -> PathBuf {
    let Config {
        env,
        algorithm,
        run,
        ..
    } = config;
    let map = Path::new(env.map()).file_stem().unwrap_or_default();
    let name = format!("{}-{}-seed{}", map.display(), algorithm.name(), run.seed);
    Path::new("runs").join(name)
}

#[cfg(test)]
mod tests {
    use mackrl_run::training::Score;

    use super::*;

    #[test]
    fn a_run_is_named_after_what_makes_it_different() {
        let config = Config::default();
        let algorithm = config.algorithm.name();
        let expected = format!("runs/3m-{algorithm}-seed1");
        assert_eq!(default_folder(&config), Path::new(&expected));
    }

    #[test]
    fn a_run_ends_with_words() {
        let score = |steps_env, mean, standard_error| Score {
            steps_env,
            mean,
            standard_error,
            episodes: 320,
        };
        let mut teams = Teams {
            measure: "battle_won".to_owned(),
            last: score(150_112, 0.978, 0.008),
            best: Some(score(120_016, 0.984, 0.007)),
        };
        insta::assert_snapshot!(playing(&teams, &[0.0, 0.5, 0.9375, 1.0, 1.0, 0.96875]), @r"
        The team won 97.8 % ± 0.8 of 320 battles that it had not seen.
        Its last 5 tests won 50.0 to 100.0 %.
        The best in a test were the weights of step 120016, which won 98.4 % ± 0.7 of 320 battles as well.
        ");
        teams.best = Some(teams.last);
        insta::assert_snapshot!(playing(&teams, &[0.0]), @r"
        The team won 97.8 % ± 0.8 of 320 battles that it had not seen.
        No earlier weights did better in a test.
        ");
    }
}
