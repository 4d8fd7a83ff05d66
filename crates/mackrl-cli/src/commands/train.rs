//! `mackrl train`: from a configuration to a run folder.

use std::path::{Path, PathBuf};

use mackrl::nn::InstructionSet;
use mackrl_run::{
    config::Config,
    run_folder::RunFolder,
    training_loop::{self, Summary},
};

use crate::{args::TrainArgs, commands::sc2, output, progress::RunProgress, signals};

/// Trains a team. Everything that can be wrong with what was typed is found before the run folder is created.
pub(crate) fn run(args: &TrainArgs) -> anyhow::Result<()> {
    let config = args.configuration.layers()?.build()?;
    let path = args.out.clone().unwrap_or_else(|| default_folder(&config));
    RunFolder::check_free(&path)?;
    let stop = signals::listen()?;
    let world = sc2::world(&config)?;
    let threads = args.threads.count();
    let mut progress = RunProgress::new();
    progress.announce(&config, InstructionSet::chosen()?, threads);
    let summary = training_loop::train(&path, &config, &world, threads, &stop, &mut progress)?;
    print(&summary, args.json)
}

/// Prints what a finished run says of itself.
pub(super) fn print(summary: &Summary, json: bool) -> anyhow::Result<()> {
    if json {
        return output::print_json(summary);
    }
    let won = summary.battle_won_mean.map_or_else(String::new, |won| {
        format!("; the team wins {:.0} % of its last test", 100.0 * won)
    });
    output::print(&format!(
        "{}: {} environment steps in {:.1} s ({:.0} a second){won}\n",
        summary.folder.display(),
        summary.steps_env,
        summary.wall_s,
        summary.steps_per_s
    ))
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
    use super::*;

    #[test]
    fn a_run_is_named_after_what_makes_it_different() {
        let config = Config::default();
        let algorithm = config.algorithm.name();
        let expected = format!("runs/3m-{algorithm}-seed1");
        assert_eq!(default_folder(&config), Path::new(&expected));
    }
}
