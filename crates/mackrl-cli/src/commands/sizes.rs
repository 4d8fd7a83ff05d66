//! Whether a team that was trained on one map can play on another.

use mackrl::Error;
use mackrl_env::EnvironmentSpec;
use mackrl_run::{config::Config, training::assembly::RunWorld};

use crate::failure::Failure;

/// Refuses a world whose sizes are not those of the map that the run was trained on.
///
/// # Errors
/// [`Failure::Usage`], which says what `typed` asks for, and every size that differs.
pub(super) fn expect_same(
    trained: &Config,
    world: &RunWorld,
    (typed, run): (&str, &str),
) -> anyhow::Result<()> {
    let differing = differing(&spec(trained)?, world.spec());
    if differing.is_empty() {
        return Ok(());
    }
    let message = format!(
        "{typed}: the team of {run} cannot play there, because it was trained on {} and sizes differ: {}",
        trained.env.map(),
        differing.join(", ")
    );
    Err(Failure::Usage { message }.into())
}

/// The sizes of the map that a run was trained on.
fn spec(trained: &Config) -> Result<EnvironmentSpec, Error> {
    let mut config = trained.clone();
    config.env = config.env.simulated();
    Ok(RunWorld::new(&config)?.spec().clone())
}

/// Which sizes differ, each as "8 agents, not 3".
fn differing(own: &EnvironmentSpec, other: &EnvironmentSpec) -> Vec<String> {
    let sizes = |spec: &EnvironmentSpec| {
        [
            ("agents", spec.agents),
            ("units", spec.entities),
            ("features of a unit", spec.entity_features),
            ("features of a position", spec.position_features),
            ("actions", spec.actions),
            ("numbers in an observation", spec.observation_size),
            ("numbers in the state", spec.state_size),
        ]
    };
    let pairs = sizes(own).into_iter().zip(sizes(other));
    pairs
        .filter(|((_, own), (_, other))| own != other)
        .map(|((what, own), (_, other))| format!("{other} {what}, not {own}"))
        .collect()
}
