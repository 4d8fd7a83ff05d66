//! `mackrl execute-agent`: one agent of a trained team, alone in a process.

use std::io;

use mackrl::decentralised::serve_agent;
use mackrl_env::AgentId;
use mackrl_run::{
    run_folder::Run,
    training::assembly::{self, RunWorld},
};

use crate::{args::ExecuteAgentArgs, failure::Failure};

/// Answers what arrives on stdin until it ends.
pub(crate) fn run(args: &ExecuteAgentArgs) -> anyhow::Result<()> {
    let run = match &args.weights {
        Some(weights) => Run::open_with_weights(&args.run, weights)?,
        None => Run::open(&args.run)?,
    };
    // An agent needs to know its world; it does not play in it.
    let mut config = run.config.clone();
    config.env = config.env.simulated();
    let world = RunWorld::new(&config)?;
    let agents = world.spec().agents;
    if args.agent >= agents {
        let message = format!("--agent is {}, expected less than {agents}", args.agent);
        return Err(Failure::BadData { message }.into());
    }
    let algorithm = assembly::trained(&run.config, &world, &run.weights)?;
    let mut executor = algorithm.policy().executor(AgentId::new(args.agent));
    serve_agent(
        &mut *executor,
        algorithm.parameters(),
        io::stdin().lock(),
        io::stdout().lock(),
    )?;
    Ok(())
}
