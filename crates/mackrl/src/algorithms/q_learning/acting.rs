//! A team that acts by action values: each agent takes the best of its own, or any with probability ε.
//!
//! The rows of all agents advance at every step, those of the dead too: what a dead agent's network says of its only action is
//! a part of what the team expects (as in PyMARL). An agent alone computes its own row, from its local view, and the same bits.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, EntityId, EntitySet, EnvironmentSpec, EpisodeKey, LocalView, Stream,
};

use super::choice::Choice;
use crate::{
    Error, NotFinite, Phase, Stopwatch,
    experience::Experience,
    nn::{
        NetworkSizes, ParameterLayout, RecurrentNetwork, RecurrentWeights, Retention, Trace,
        first_not_finite,
    },
    policy::{
        Actor, AgentThought, Behaviour, ControllerDescription, ControllerId, ControllerInput,
        ControllerOutput, Executor, Memory, Parameters, Policy, Recording, Situation, Thought,
    },
};

/// As the tensors of the agents' network begin.
const NAME: &str = "agent_controller";

/// The policy of a team whose agents share a network of action values.
#[derive(Debug, Clone)]
pub struct ActionValues {
    parts: Arc<Parts>,
}

/// What does not change while the team acts.
#[derive(Debug)]
struct Parts {
    sizes: InputSizes,
    layout: ParameterLayout,
    network: RecurrentNetwork,
}

/// What an agent reads: its observation, who it is, and what it did last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct InputSizes {
    pub(super) observation: usize,
    pub(super) agents: usize,
    pub(super) actions: usize,
}

impl InputSizes {
    pub(super) const fn of(spec: &EnvironmentSpec) -> Self {
        Self {
            observation: spec.observation_size,
            agents: spec.agents,
            actions: spec.actions,
        }
    }

    /// Length of a row.
    pub(super) const fn total(self) -> usize {
        self.observation + self.agents + self.actions
    }

    /// Writes a row, which is zero; the dead observe zeros.
    pub(super) fn write(
        self,
        row: &mut [f32],
        observation: &[f32],
        agent: usize,
        last_action: Option<usize>,
    ) {
        row[..self.observation].copy_from_slice(observation);
        row[self.observation + agent] = 1.0;
        if let Some(action) = last_action {
            row[self.observation + self.agents + action] = 1.0;
        }
    }
}

impl ActionValues {
    /// A team for a world of these sizes, whose network has `hidden` units in each layer.
    #[must_use]
    pub fn new(spec: &EnvironmentSpec, hidden: usize) -> Self {
        let sizes = InputSizes::of(spec);
        let mut layout = ParameterLayout::new();
        let network_sizes = NetworkSizes {
            inputs: sizes.total(),
            hidden,
            outputs: spec.actions,
        };
        let network = RecurrentNetwork::new(&mut layout, NAME, network_sizes);
        Self {
            parts: Arc::new(Parts {
                sizes,
                layout,
                network,
            }),
        }
    }

    /// The network that all agents share.
    pub(super) fn network(&self) -> &RecurrentNetwork {
        &self.parts.network
    }
}

impl Policy for ActionValues {
    fn layout(&self) -> &ParameterLayout {
        &self.parts.layout
    }

    fn description(&self) -> Vec<ControllerDescription> {
        let InputSizes {
            observation,
            agents,
            actions,
        } = self.parts.sizes;
        vec![ControllerDescription {
            name: NAME,
            groups: (0..agents).map(|agent| vec![AgentId::new(agent)]).collect(),
            inputs: vec![
                ("observation", observation),
                ("members", agents),
                ("last_action", actions),
            ],
            hidden: self.parts.network.sizes().hidden,
            divisions: 0,
            joint_actions: actions,
            acts: None,
            explores: true,
            memory: Memory::Episode,
            normalised: false,
        }]
    }

    fn initialise(&self, seed: u64) -> Vec<f32> {
        let key = EpisodeKey::new(seed, Stream::Other, 0);
        let mut parameters = vec![0.0; self.parts.layout.len()];
        self.parts.network.initialise(&key, &mut parameters);
        parameters
    }

    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(TeamActor {
            rows: Rows::new(Arc::clone(&self.parts), environments),
            recording: Recording::Off,
            alive_b: vec![EntitySet::EMPTY; environments],
            stopwatch: Stopwatch::default(),
        })
    }

    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        Box::new(AgentAlone {
            rows: Rows::new(Arc::clone(&self.parts), 1),
            agent,
        })
    }

    fn draws_when_greedy(&self) -> bool {
        false
    }
}

/// Rows of agents' values, advanced step by step; of all agents of some environments, or of one agent.
struct Rows {
    parts: Arc<Parts>,
    trace: Trace<f32>,
    /// The environments that the latest step was played in, ascending.
    playing: Vec<usize>,
    carry: Vec<usize>,
    input_rf: Vec<f32>,
    /// The agents whose rows these are, environment by environment.
    agent_r: Vec<AgentId>,
    choice_r: Vec<Choice>,
    available_ra: Vec<bool>,
    /// \[B, N\]
    last_action_bn: Vec<Option<Action>>,
}

impl Rows {
    fn new(parts: Arc<Parts>, environments: usize) -> Self {
        Self {
            trace: Trace::new(parts.network.sizes(), Retention::LastStep),
            playing: Vec::new(),
            carry: Vec::new(),
            input_rf: Vec::new(),
            agent_r: Vec::new(),
            choice_r: Vec::new(),
            available_ra: Vec::new(),
            last_action_bn: vec![None; environments * parts.sizes.agents],
            parts,
        }
    }

    fn begin(&mut self) {
        self.trace.begin_episode();
        self.playing.clear();
        self.last_action_bn.fill(None);
    }

    /// Rows of each environment at the latest step.
    fn rows_each(&self) -> usize {
        self.agent_r.len() / self.playing.len().max(1)
    }

    /// Computes the values of one step, for `each` rows of every environment that plays, whose views come in that order.
    fn advance<'a>(
        &mut self,
        parameters: &Parameters,
        playing: &[usize],
        each: usize,
        views: impl Iterator<Item = LocalView<'a>>,
    ) {
        let parts = Arc::clone(&self.parts);
        let sizes = parts.sizes;
        self.carry.clear();
        if self.playing != playing && self.trace.steps() > 0 {
            for b in playing {
                let before = self.playing.binary_search(b);
                let first = each * before.expect("no environment comes back");
                self.carry.extend(first..first + each);
            }
        }
        self.playing.clear();
        self.playing.extend_from_slice(playing);
        let rows = playing.len() * each;
        self.input_rf.clear();
        self.input_rf.resize(rows * sizes.total(), 0.0);
        self.agent_r.clear();
        self.available_ra.clear();
        let inputs = self.input_rf.chunks_exact_mut(sizes.total());
        for (row, (view, input)) in views.zip(inputs).enumerate() {
            let (b, agent) = (playing[row / each], view.agent().index());
            let last_action = self.last_action_bn[b * sizes.agents + agent];
            let last_action = last_action.map(Action::index);
            sizes.write(input, view.observation(), agent, last_action);
            self.agent_r.push(view.agent());
            self.available_ra.extend_from_slice(view.available());
        }
        let carry = (!self.carry.is_empty()).then_some(self.carry.as_slice());
        self.trace.begin_step(rows, carry);
        let weights: &RecurrentWeights<f32> =
            parameters.prepared(|values| parts.network.weights(values));
        parts.network.step(weights, &self.input_rf, &mut self.trace);
    }

    /// Chooses for every row of the latest step, and remembers what was done.
    fn choose(&mut self, step: usize, behaviour: Behaviour, key_of: impl Fn(usize) -> EpisodeKey) {
        let InputSizes {
            agents, actions, ..
        } = self.parts.sizes;
        let each = self.rows_each();
        self.choice_r.clear();
        let values = self.trace.last_logits().chunks_exact(actions);
        let rows = values.zip(self.available_ra.chunks_exact(actions));
        for (row, (value_a, available_a)) in rows.enumerate() {
            let (b, agent) = (self.playing[row / each], self.agent_r[row]);
            let choice = Choice::of(value_a, available_a, behaviour);
            let action = choice.draw(available_a, &key_of(b), step, agent);
            self.last_action_bn[b * agents + agent.index()] = Some(Action::new(action));
            self.choice_r.push(choice);
        }
    }

    /// What the rows of environment `b` at the latest step were computed from.
    fn inputs(&self, b: usize) -> Vec<ControllerInput> {
        let total = self.parts.sizes.total();
        let inputs = self.rows_of(b).map(|row| ControllerInput {
            controller: controller(self.agent_r[row]),
            values: self.input_rf[row * total..(row + 1) * total].to_vec(),
        });
        inputs.collect()
    }

    /// The log-probabilities of the choices of environment `b` at the latest step.
    fn outputs(&self, b: usize) -> Vec<ControllerOutput> {
        let outputs = self.rows_of(b).map(|row| ControllerOutput {
            controller: controller(self.agent_r[row]),
            log_p: self.log_p(row),
        });
        outputs.collect()
    }

    fn log_p(&self, row: usize) -> Vec<f32> {
        let actions = self.parts.sizes.actions;
        self.choice_r[row].log_p(&self.available_ra[row * actions..(row + 1) * actions])
    }

    fn rows_of(&self, b: usize) -> std::ops::Range<usize> {
        let each = self.rows_each();
        match self.playing.binary_search(&b) {
            Ok(place) => place * each..(place + 1) * each,
            Err(_) => 0..0,
        }
    }
}

/// Names an agent's controller.
fn controller(agent: AgentId) -> ControllerId {
    ControllerId {
        name: NAME.into(),
        agents: vec![agent],
    }
}

/// All agents of a few environments.
struct TeamActor {
    rows: Rows,
    recording: Recording,
    alive_b: Vec<EntitySet>,
    stopwatch: Stopwatch,
}

impl Actor for TeamActor {
    fn begin(&mut self, recording: Recording, experience: &mut Experience) {
        self.recording = recording;
        self.rows.begin();
        experience.banks.clear();
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), Error> {
        let (agents, actions) = (self.rows.parts.sizes.agents, self.rows.parts.sizes.actions);
        let everybody = || (0..agents).map(AgentId::new);
        let view = |b: usize, agent| situation.observations.local_view(b, agent);
        let views = situation.playing.iter();
        let views = views.flat_map(|&b| everybody().map(move |agent| view(b, agent)));
        self.rows
            .advance(parameters, situation.playing, agents, views);
        let values = self.rows.trace.last_logits();
        if let Some(index) = first_not_finite(values) {
            let row = index / actions;
            let place = [
                ("episode", situation.playing[row / agents]),
                ("step", situation.step),
                ("agent", row % agents),
                ("action", index % actions),
            ];
            return Err(NotFinite::new("action value", &place, values[index]).into());
        }
        self.rows
            .choose(situation.step, situation.behaviour, |b| situation.keys[b]);
        for (place, &b) in situation.playing.iter().enumerate() {
            let living = everybody().filter(|&agent| !view(b, agent).seen().set().is_empty());
            self.alive_b[b] = living.map(EntityId::from).collect();
            let mut log_p = 0.0;
            for n in 0..agents {
                let action = self.rows.last_action_bn[b * agents + n];
                let action = action.expect("every row was chosen for");
                actions_bn[b * agents + n] = action;
                log_p += self.rows.choice_r[place * agents + n].log_p_of(action.index());
            }
            if self.recording == Recording::ForLearning {
                let episode = &mut experience.episodes[b];
                episode.alive_t.push(self.alive_b[b]);
                episode.log_p_t.push(log_p);
            }
        }
        self.stopwatch.lap(Phase::Act);
        Ok(())
    }

    fn needs_views(&self) -> bool {
        true
    }

    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }

    fn controller_inputs(&self, _experience: &Experience, b: usize) -> Vec<ControllerInput> {
        self.rows.inputs(b)
    }

    fn controller_outputs(&self, _experience: &Experience, b: usize) -> Vec<ControllerOutput> {
        self.rows.outputs(b)
    }

    fn thought(&mut self, b: usize, _situation: Situation<'_>, action_n: &[Action]) -> Thought {
        let mut thought = Thought::default();
        for row in self.rows.rows_of(b) {
            let agent = self.rows.agent_r[row];
            let (log_p_a, taken) = (self.rows.log_p(row), action_n[agent.index()]);
            thought.log_p += f64::from(log_p_a[taken.index()]);
            if self.alive_b[b].contains(agent) {
                let own = AgentThought::new(agent, &log_p_a, taken);
                thought.agents.push(own);
            }
        }
        thought.log_p_path = thought.log_p;
        thought
    }
}

/// One agent from its own local views.
struct AgentAlone {
    rows: Rows,
    agent: AgentId,
}

impl Executor for AgentAlone {
    fn begin(&mut self) {
        self.rows.begin();
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        self.rows
            .advance(parameters, &[0], 1, std::iter::once(view));
        self.rows.choose(step, behaviour, |_| *key);
        self.rows.last_action_bn[self.agent.index()].expect("its row was chosen for")
    }

    fn controller_inputs(&self) -> Vec<ControllerInput> {
        self.rows.inputs(0)
    }

    fn controller_outputs(&self) -> Vec<ControllerOutput> {
        self.rows.outputs(0)
    }
}
