//! `mackrl train`: from a configuration to a run folder.

use std::path::{Path, PathBuf};

use mackrl::nn::InstructionSet;
use mackrl_run::{config::Config, training::Trainer};

use crate::{
    args::TrainArgs,
    commands::sc2,
    progress,
    run_folder::RunFolder,
    signals::StopRequest,
    training_loop::{self, Reporting},
};

/// Trains a team. Everything that can be wrong with what was typed is found before the run folder is created.
pub(crate) fn run(args: &TrainArgs) -> anyhow::Result<()> {
    let config = args.configuration.layers()?.build()?;
    let path = args.out.clone().unwrap_or_else(|| default_folder(&config));
    RunFolder::check_free(&path)?;
    let stop = StopRequest::listen()?;
    let threads = args.threads.count();
    let mut training = Reporting::new(
        Trainer::in_world(&config, &sc2::world(&config)?, threads)?,
        &config,
        &stop,
    );
    let mut folder = RunFolder::create(&path, &config, threads)?;
    progress::announce(InstructionSet::chosen()?, threads);
    let summary = training_loop::train_into(&mut folder, &mut training, &config, &stop)?;
    training_loop::print(&summary, args.json)
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
        assert_eq!(
            default_folder(&Config::default()),
            Path::new("runs/3m-mackrl-seed1")
        );
    }
}
