//! The policy of Central-V (Foerster and others, 2018): agent controllers alone.

use mackrl_env::{Action, AgentId, EnvironmentSpec};

use crate::{
    NotFinite, Phase, Stopwatch,
    hierarchy::{
        Sampler,
        agent_controller::{AgentController, forced_action, is_alive},
        controller::ControllerMemory,
        initialisation_key,
        statistics::entropy,
    },
    nn::{Named, ParameterLayout},
    policy::{
        Actor, AgentThought, ControllerId, ControllerInput, Policy, Recording, Situation, Tally,
        Thought, Weights,
    },
};

/// The policy of Central-V.
#[derive(Debug, Clone)]
pub struct CentralV {
    layout: ParameterLayout,
    pub(crate) agents: AgentController,
    team: usize,
}

impl CentralV {
    /// The policy for a world of the given sizes, with recurrent states of `hidden` units.
    #[must_use]
    pub fn new(spec: &EnvironmentSpec, hidden: usize) -> Self {
        let mut layout = ParameterLayout::new();
        let agents = AgentController::new(&mut layout, spec, hidden);
        Self {
            layout,
            agents,
            team: spec.agents,
        }
    }
}

impl Policy for CentralV {
    fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    fn initialise(&self, seed: u64) -> Vec<f32> {
        let mut parameters = vec![0.0; self.layout.len()];
        self.agents
            .controller()
            .initialise(&initialisation_key(seed), &mut parameters);
        parameters
    }

    fn weights(&self, parameters: &[f32]) -> Weights {
        let agents = self.agents.controller().weights(parameters);
        Weights {
            selector: None,
            pairs: None,
            agents,
        }
    }

    fn refresh(&self, parameters: &[f32], weights: &mut Weights) {
        self.agents
            .controller()
            .refresh(parameters, &mut weights.agents);
    }

    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(CentralVActor {
            controller: self.agents.clone(),
            memory: ControllerMemory::new(self.agents.controller()),
            rows: Vec::new(),
            last_action_bn: vec![None; environments * self.team],
            log_p_bt: vec![Vec::new(); environments],
            team: self.team,
            recording: Recording::Off,
            entropy: (0.0, 0.0),
            stopwatch: Stopwatch::default(),
        })
    }
}

/// The agent controllers at work in the environments of one shard.
struct CentralVActor {
    controller: AgentController,
    memory: ControllerMemory,
    /// Environment and agent of each row at this step.
    rows: Vec<(usize, AgentId)>,
    last_action_bn: Vec<Option<Action>>,
    /// log `p(u_t)` at each step so far, if recorded.
    log_p_bt: Vec<Vec<f32>>,
    team: usize,
    recording: Recording,
    /// Sum and count of the agents' entropies.
    entropy: (f64, f64),
    stopwatch: Stopwatch,
}

impl CentralVActor {
    /// Advances the controllers of all living agents; the dead have their one action.
    fn run(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite> {
        let Self {
            controller,
            memory,
            rows,
            team,
            ..
        } = self;
        rows.clear();
        for &b in situation.playing {
            for agent in (0..*team).map(AgentId::new) {
                let view = situation.observations.local_view(b, agent);
                if is_alive(view) {
                    rows.push((b, agent));
                } else {
                    actions_bn[b * *team + agent.index()] = forced_action(view);
                }
            }
        }
        memory.begin_step(rows.iter().map(|(b, agent)| b * *team + agent.index()));
        for (row, &(b, agent)) in rows.iter().enumerate() {
            let view = situation.observations.local_view(b, agent);
            let last_action = self.last_action_bn[b * *team + agent.index()];
            controller.write_row(memory, row, view, last_action);
        }
        let exploration = situation.behaviour.exploration;
        memory.run(controller.controller(), &weights.agents, exploration);
        memory.check_logits(|row| {
            let (b, agent) = rows[row];
            [
                ("episode", b),
                ("step", situation.step),
                ("agent", agent.index()),
            ]
        })
    }
}

impl Actor for CentralVActor {
    fn begin(&mut self, recording: Recording) {
        self.recording = recording;
        self.memory.begin(recording);
        self.last_action_bn.fill(None);
        self.log_p_bt.iter_mut().for_each(Vec::clear);
        self.entropy = (0.0, 0.0);
    }

    fn act(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite> {
        self.run(weights, situation, actions_bn)?;
        if self.recording == Recording::ForLearning {
            situation
                .playing
                .iter()
                .for_each(|&b| self.log_p_bt[b].push(0.0));
        }
        for row in 0..self.rows.len() {
            let (b, agent) = self.rows[row];
            let log_p_a = self.memory.log_p(row);
            let sampler = Sampler {
                key: situation.keys[b],
                step: situation.step,
                mode: situation.behaviour.mode,
            };
            let action = sampler.choose_action(agent, log_p_a);
            let place = b * self.team + agent.index();
            actions_bn[place] = action;
            self.last_action_bn[place] = Some(action);
            self.entropy.0 += entropy(log_p_a);
            self.entropy.1 += 1.0;
            if self.recording == Recording::ForLearning {
                self.log_p_bt[b][situation.step] += log_p_a[action.index()];
                self.memory.record(row, action.index(), b, 1.0);
            }
        }
        self.stopwatch.lap(Phase::Act);
        Ok(())
    }

    fn backward(&mut self, weights: &Weights, weight_bt: &[Vec<f32>], gradient: &mut [f32]) -> f64 {
        self.memory.backward(
            self.controller.controller(),
            &weights.agents,
            weight_bt,
            gradient,
        );
        let products = self
            .log_p_bt
            .iter()
            .flatten()
            .zip(weight_bt.iter().flatten());
        products
            .map(|(&log_p, &weight)| f64::from(log_p) * f64::from(weight))
            .sum()
    }

    fn report(&self, tally: &mut Tally) {
        tally.add("mackrl/entropy_l3", self.entropy.0, self.entropy.1);
    }

    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }

    fn activations(&self) -> Vec<Named<'_, f32>> {
        self.memory.activations()
    }

    fn gradients(&self) -> Vec<Named<'_, f32>> {
        self.memory.gradients()
    }

    fn controller_inputs(&self, b: usize) -> Vec<ControllerInput> {
        let rows = self
            .rows
            .iter()
            .enumerate()
            .filter(|(_, (row_b, _))| *row_b == b);
        rows.map(|(row, &(_, agent))| self.memory.input(row, ControllerId::AgentController(agent)))
            .collect()
    }

    fn thought(&mut self, b: usize, _: Situation<'_>, action_n: &[Action]) -> Thought {
        let rows = self.rows.iter().enumerate();
        let own = rows.filter(|(_, (row_b, _))| *row_b == b);
        let mut thought = Thought::default();
        for (row, &(_, agent)) in own {
            let (log_p_a, taken) = (self.memory.log_p(row), action_n[agent.index()]);
            thought.log_p += f64::from(log_p_a[taken.index()]);
            thought
                .agents
                .push(AgentThought::new(agent, log_p_a, taken));
        }
        // There is one way only.
        thought.log_p_path = thought.log_p;
        thought
    }
}
