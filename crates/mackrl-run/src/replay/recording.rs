//! Episodes that are played in order to be kept.

use mackrl::{
    Error,
    algorithms::Algorithm,
    experience::Experience,
    policy::{Actor, Behaviour, Recording, Situation, Thought},
};
use mackrl_env::{Action, Environment, EpisodeKey, Observations};
use mackrl_skirmish::{
    Skirmish,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

use super::{Player, Replay, STEPS_MOST, Step, hexadecimal};
use crate::{
    config::{Config, EnvironmentConfig},
    training::assembly::{self, RunWorld},
};

/// Plays the episode `key` by a script.
///
/// # Errors
/// [`Error::Config`] if the world cannot be built.
pub fn record_script(
    env: &EnvironmentConfig,
    policy: ScriptedPolicy,
    key: EpisodeKey,
) -> Result<Replay, Error> {
    let skirmish = env.skirmish()?;
    let mut team = ScriptedTeam::new(policy, &skirmish);
    let player = Player::Script { policy };
    record(
        skirmish,
        env,
        (player, key),
        |observations, step, actions| {
            team.act(observations, 0, (key, step), actions);
            Ok((None, None))
        },
    )
}

/// Plays the episode `key` by the policy of a run, whose weights are a safetensors file, and keeps what its controllers compute.
///
/// With [`Behaviour::GREEDY`] and the key of an episode of [`evaluate`](crate::training::evaluate) it is that very episode.
///
/// # Errors
/// [`Error::Config`] or [`Error::Data`] if configuration and weights cannot be used together or the map is no skirmish.
pub fn record_policy(
    config: &Config,
    weights: &[u8],
    behaviour: Behaviour,
    key: EpisodeKey,
) -> Result<Replay, Error> {
    let skirmish = config.env.skirmish()?;
    let mut watched = Watched::new(config, weights, behaviour, key)?;
    let player = Player::Policy {
        algorithm: config.algorithm.name().to_owned(),
        behaviour,
    };
    record(
        skirmish,
        &config.env,
        (player, key),
        |observations, step, actions| {
            let value = watched.algorithm.value(observations.state(0));
            let thought = watched.act(observations, step, actions)?;
            Ok((value, Some(thought)))
        },
    )
}

/// A learnt team that is looked at while it plays one episode.
struct Watched {
    algorithm: Box<dyn Algorithm>,
    actor: Box<dyn Actor>,
    experience: Experience,
    behaviour: Behaviour,
    keys: [EpisodeKey; 1],
}

impl Watched {
    fn new(
        config: &Config,
        weights: &[u8],
        behaviour: Behaviour,
        key: EpisodeKey,
    ) -> Result<Self, Error> {
        let algorithm = assembly::trained(config, &RunWorld::new(config)?, weights)?;
        let mut actor = algorithm.policy().actor(1);
        let mut experience = Experience::default();
        actor.begin(Recording::Off, &mut experience);
        Ok(Self {
            algorithm,
            actor,
            experience,
            behaviour,
            keys: [key],
        })
    }

    fn act(
        &mut self,
        observations: &Observations,
        step: usize,
        actions: &mut [Action],
    ) -> Result<Thought, Error> {
        let situation = Situation {
            step,
            playing: &[0],
            keys: &self.keys,
            observations,
            behaviour: self.behaviour,
        };
        let parameters = self.algorithm.parameters();
        self.actor
            .act(parameters, situation, &mut self.experience, actions)?;
        Ok(self.actor.thought(0, situation, actions))
    }
}

/// The critic's value, and what the controllers computed, of a team that has them.
type Chosen = (Option<f32>, Option<Thought>);

/// Plays one episode; `choose` is given observations, step and the actions to write.
fn record(
    mut skirmish: Skirmish,
    env: &EnvironmentConfig,
    (player, key): (Player, EpisodeKey),
    mut choose: impl FnMut(&Observations, usize, &mut [Action]) -> Result<Chosen, Error>,
) -> Result<Replay, Error> {
    let mut observations = Observations::new(skirmish.spec(), 1);
    let mut actions = vec![Action::default(); skirmish.spec().agents];
    let mut replay = Replay {
        program: env!("CARGO_PKG_VERSION").to_owned(),
        env: env.without_folder(),
        key,
        player,
        steps: Vec::new(),
    };
    skirmish.reset(key, &mut observations.row_mut(0));
    loop {
        let (value, thought) = choose(&observations, replay.steps.len(), &mut actions)?;
        let time_step = skirmish.step(&actions, &mut observations.row_mut(0))?;
        replay.steps.push(Step {
            actions: actions.clone(),
            state_hash: hexadecimal(skirmish.state_hash()),
            value,
            thought,
        });
        if time_step.end.is_some() {
            return Ok(replay);
        }
        if replay.steps.len() == STEPS_MOST {
            return Err(Error::Data(format!(
                "the episode has more than {STEPS_MOST} steps, expected at most so many in a replay"
            )));
        }
    }
}
