//! You will see each agent of a team, alone with its own views and the shared seed, choose what the central run chooses for it.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl::{
    experience::Experience,
    policy::{Behaviour, Recording, Situation},
};
use mackrl_env::{Action, AgentId, EpisodeKey, Observations, Stream};
use mackrl_run::{
    config::Config,
    training::assembly::{self, RunWorld},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Config::with(&["env.map=3m", "algorithm.name=mackrl"])?;
    let world = RunWorld::new(&config)?;
    let team = assembly::algorithm(&config, &world, 1)?;
    let (policy, parameters) = (team.policy(), team.parameters());
    let behaviour = Behaviour::sampled(0.1);
    let key = EpisodeKey::new(1, Stream::Other, 0);

    let (mut central, mut experience) = (policy.actor(1), Experience::default());
    central.begin(Recording::Off, &mut experience);
    let agents = (0..world.spec().agents).map(AgentId::new);
    let mut alone: Vec<_> = agents
        .map(|agent| (agent, policy.executor(agent)))
        .collect();
    alone.iter_mut().for_each(|(_, executor)| executor.begin());

    let mut environment = world.environments(1).remove(0);
    let mut observations = Observations::new(world.spec(), 1);
    environment.reset(key, &mut observations.row_mut(0));
    let mut action_n = vec![Action::default(); world.spec().agents];
    let (mut compared, mut different) = (0, 0);
    println!("step   central run   agents alone");
    for step in 0.. {
        let situation = Situation {
            step,
            playing: &[0],
            keys: &[key],
            observations: &observations,
            behaviour,
        };
        central.act(parameters, situation, &mut experience, &mut action_n)?;
        // An agent alone is given nothing but its own view: no state, no other agent, no message.
        let own: Vec<Action> = (alone.iter_mut())
            .map(|(agent, executor)| {
                let view = observations.local_view(0, *agent);
                executor.act(parameters, view, &key, step, behaviour)
            })
            .collect();
        println!("{step:4} {:>13} {:>14}", list(&action_n), list(&own));
        let pairs = action_n.iter().zip(&own);
        different += pairs.filter(|(central, own)| central != own).count();
        compared += own.len();
        let time_step = environment.step(&action_n, &mut observations.row_mut(0))?;
        if time_step.end.is_some() {
            break;
        }
    }
    println!("\n{compared} actions compared, {different} of them different");
    Ok(())
}

fn list(action_n: &[Action]) -> String {
    let names: Vec<String> = action_n.iter().map(ToString::to_string).collect();
    names.join(" ")
}
