//! The native part of the Python package `mackrl`: conversion between NumPy arrays and the libraries, and nothing else.
//!
//! What users see is Python, in `python/mackrl`; the classes here are its private engine. The interpreter is released
//! wherever a world, a network or a run is at work.

mod arrays;
mod configuration;
mod errors;
mod own_world;
mod policy;
mod replays;
mod runs;
mod worlds;

use mackrl_env::{AgentId, EntityId, EntitySet, EnvironmentSpec, Stream};
use pyo3::{exceptions::PyValueError, prelude::*};
use serde::Serialize;

/// The native part of `mackrl`.
#[pymodule(gil_used = false)]
mod _native {
    #[pymodule_export]
    use super::{
        configuration::Layers,
        own_world::check_world,
        policy::{Agent, Play, Team},
        replays::{record_policy, record_script, replay_page, replay_steps, replay_summary},
        runs::{evaluate, maps, resume, run_description, run_rows, train},
        worlds::{Worlds, skirmish_layout},
    };

    use super::{PyModule, PyResult, own_world};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        own_world::install();
        module.add("CODE", mackrl_run::provenance::CODE)?;
        module.add("VERSION", env!("CARGO_PKG_VERSION"))
    }
}

/// Plain data as JSON.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain data can be written")
}

/// The stream of episodes that Python names so.
fn stream(name: &str) -> PyResult<Stream> {
    match name {
        "training" => Ok(Stream::Training),
        "test" => Ok(Stream::Test),
        "evaluation" => Ok(Stream::Evaluation),
        "other" => Ok(Stream::Other),
        _ => Err(PyValueError::new_err(format!(
            "stream is {name:?}, expected \"training\", \"test\", \"evaluation\" or \"other\""
        ))),
    }
}

/// The agent at this index of a world.
fn agent(index: usize, spec: &EnvironmentSpec) -> PyResult<AgentId> {
    if index < spec.agents {
        return Ok(AgentId::new(index));
    }
    let most = spec.agents - 1;
    let problem = format!("agent is {index}, expected an integer in [0, {most}]");
    Err(PyValueError::new_err(problem))
}

/// The entities whose place in `member_m` holds true.
fn set(member_m: &[bool]) -> EntitySet {
    let members = member_m.iter().enumerate();
    let members = members.filter(|&(_, member)| *member);
    members.map(|(entity, _)| EntityId::new(entity)).collect()
}
