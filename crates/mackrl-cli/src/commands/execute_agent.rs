//! `mackrl execute-agent`: one agent of a trained team, alone in a process.

use std::io::{self, BufRead, Read, Write};

use mackrl::decentralised::{Isolation, serve_agent};
use mackrl_env::AgentId;
use mackrl_run::{
    config::{Config, ConfigBuilder},
    training::assembly::{self, RunWorld, tensors_bytes_max},
};
use serde::{Deserialize, Serialize};

use crate::{failure::Failure, isolation::isolate};

/// Longest first line, in bytes: a configuration, which may hold a scenario.
const FIRST_LINE_MOST: u64 = 4 << 20;

/// The first line that an agent is told; the bytes of the weights follow it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Introduction {
    /// Its number.
    pub(super) agent: usize,
    /// The run's configuration as TOML.
    pub(super) config: String,
    /// Length of the weights.
    pub(super) weights_bytes: usize,
}

/// The first line that an agent says.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Readiness {
    /// What it is kept from.
    pub(super) isolation: Isolation,
}

/// Learns from stdin who it is, gives up access to everything else, and answers what arrives until stdin ends.
pub(crate) fn run() -> anyhow::Result<()> {
    let mut stdin = io::stdin().lock();
    let mut line = String::new();
    (&mut stdin).take(FIRST_LINE_MOST).read_line(&mut line)?;
    let bad = |message: String| Failure::BadData { message };
    let introduction: Introduction = serde_json::from_str(&line)
        .map_err(|error| bad(format!("cannot understand who the agent is: {error}")))?;
    let run = ConfigBuilder::new(crate::registry())
        .recorded("config.toml", &introduction.config)?
        .build()?;
    // An agent needs to know its world; it does not play in it.
    let config = Config {
        env: run.env.simulated(),
        ..run.clone()
    };
    let most = tensors_bytes_max(&config)?;
    if introduction.weights_bytes > most {
        let message = format!("weights are too long, expected at most {most} bytes");
        return Err(bad(message).into());
    }
    let mut weights = vec![0; introduction.weights_bytes];
    stdin.read_exact(&mut weights)?;
    let world = RunWorld::new(&config)?;
    let agents = world.spec().agents;
    if introduction.agent >= agents {
        let number = introduction.agent;
        let message = format!("the agent has the number {number}, expected less than {agents}");
        return Err(bad(message).into());
    }
    let algorithm = assembly::trained(&run, &world, &weights)?;
    let mut executor = algorithm
        .policy()
        .executor(AgentId::new(introduction.agent));
    let mut stdout = io::stdout().lock();
    let isolation = isolate();
    let ready = serde_json::to_string(&Readiness { isolation })?;
    writeln!(stdout, "{ready}").and_then(|()| stdout.flush())?;
    serve_agent(&mut *executor, algorithm.parameters(), stdin, stdout)?;
    Ok(())
}
