//! You will see three robots win a battle, each of which has its own view, the weights, a number, and the name of the episode.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::{error::Error, path::Path};

use mackrl::{algorithms::Algorithm, policy::Behaviour, policy::Executor};
use mackrl_env::{Action, AgentId, EpisodeKey, LocalView, Observations, Stream};
use mackrl_run::{
    run_folder::{Run, WhichWeights},
    training::assembly::{RunWorld, trained},
};

/// One robot: nothing in here belongs to another one.
struct Robot {
    team: Box<dyn Algorithm>,
    alone: Box<dyn Executor>,
    episode: EpisodeKey,
}

impl Robot {
    fn new(run: &Path, me: AgentId, episode: EpisodeKey) -> Result<Self, Box<dyn Error>> {
        let run = Run::open(run, WhichWeights::Best)?;
        let team = trained(&run.config, &RunWorld::new(&run.config)?, &run.weights)?;
        let mut alone = team.policy().executor(me);
        alone.begin();
        Ok(Self {
            team,
            alone,
            episode,
        })
    }

    /// What to do at this step of the common clock.
    fn act(&mut self, step: usize, view: LocalView<'_>) -> Action {
        let (weights, episode) = (self.team.parameters(), &self.episode);
        self.alone
            .act(weights, view, episode, step, Behaviour::GREEDY)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../zoo/3m");
    let episode = EpisodeKey::new(1, Stream::Other, 0);

    // The battlefield stands for the robots' sensors and motors.
    let world = RunWorld::new(&Run::open(&run, WhichWeights::Best)?.config)?;
    let mut battle = world.environments(1).remove(0);
    let mut sensors = Observations::new(world.spec(), 1);
    battle.reset(episode, &mut sensors.row_mut(0));

    let me = (0..world.spec().agents).map(AgentId::new);
    let robots: Result<Vec<Robot>, _> = me.map(|me| Robot::new(&run, me, episode)).collect();
    let mut robots = robots?;
    for step in 0.. {
        let actions: Vec<Action> = (robots.iter_mut().enumerate())
            .map(|(me, robot)| robot.act(step, sensors.local_view(0, AgentId::new(me))))
            .collect();
        let played = battle.step(&actions, &mut sensors.row_mut(0))?;
        if played.end.is_some() {
            println!(
                "over after {} steps, the last paid {}",
                step + 1,
                played.reward
            );
            break;
        }
    }
    Ok(())
}
