//! Each agent's own linear softmax over its own observation.

use mackrl::{
    Error, Stopwatch,
    experience::{Experience, Instance, Rows},
    nn::ParameterLayout,
    policy::{
        Actor, Behaviour, ControllerId, ControllerInput, Executor, Mode, Parameters, Policy,
        Recording, Situation,
    },
};
use mackrl_env::{Action, AgentId, Draw, EnvironmentSpec, EpisodeKey, LocalView};

/// A matrix of weights \[observation, actions\] for each agent.
#[derive(Debug, Clone)]
pub struct LinearPolicy {
    layout: ParameterLayout,
    agents: usize,
    inputs: usize,
    actions: usize,
}

impl LinearPolicy {
    /// The policy for a world of these sizes.
    #[must_use]
    pub fn new(spec: &EnvironmentSpec) -> Self {
        let (inputs, actions) = (spec.observation_size, spec.actions);
        let mut layout = ParameterLayout::new();
        for agent in 0..spec.agents {
            layout.add(format!("agent_{agent}.weight"), &[actions, inputs]);
        }
        Self {
            layout,
            agents: spec.agents,
            inputs,
            actions,
        }
    }

    /// A: actions of an agent.
    #[must_use]
    pub const fn actions(&self) -> usize {
        self.actions
    }

    /// Where the weight of an input for an action of an agent stands.
    #[must_use]
    pub const fn place(&self, agent: usize, input: usize, action: usize) -> usize {
        (agent * self.inputs + input) * self.actions + action
    }

    /// The probabilities of an agent's actions.
    ///
    /// # Shapes
    /// `values` as the layout, `input` \[O\], `mask` \[A\].
    #[must_use]
    pub fn probabilities(
        &self,
        values: &[f32],
        agent: usize,
        input: &[f32],
        mask: &[bool],
    ) -> Vec<f64> {
        let logit = |action: usize| {
            let products = input
                .iter()
                .enumerate()
                .map(|(i, x)| x * values[self.place(agent, i, action)]);
            f64::from(products.sum::<f32>())
        };
        let weights: Vec<f64> = (0..self.actions)
            .map(|action| {
                if mask[action] {
                    logit(action).exp()
                } else {
                    0.0
                }
            })
            .collect();
        let total: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / total).collect()
    }

    fn choose(
        &self,
        parameters: &Parameters,
        view: LocalView<'_>,
        (key, step): (&EpisodeKey, usize),
        mode: Mode,
    ) -> Action {
        let agent = view.agent().index();
        let values = parameters.values();
        let p_a = self.probabilities(values, agent, view.observation(), view.available());
        let chosen = match mode {
            Mode::Greedy => {
                (0..p_a.len()).max_by(|&a, &b| p_a[a].total_cmp(&p_a[b]).then(b.cmp(&a)))
            }
            Mode::Sampled => {
                let mut rest = key.uniform(step, Draw::Agent(agent));
                (0..p_a.len()).find(|&action| {
                    rest -= p_a[action];
                    rest < 0.0
                })
            }
        };
        Action::new(chosen.unwrap_or_default())
    }
}

impl Policy for LinearPolicy {
    fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    fn initialise(&self, _seed: u64) -> Vec<f32> {
        vec![0.0; self.layout.len()]
    }

    fn actor(&self, _environments: usize) -> Box<dyn Actor> {
        Box::new(LinearActor {
            policy: self.clone(),
            stopwatch: Stopwatch::default(),
        })
    }

    fn executor(&self, _agent: AgentId) -> Box<dyn Executor> {
        Box::new(LinearExecutor {
            policy: self.clone(),
            read: None,
        })
    }
}

/// All agents of a few environments: one bank with a row for each agent.
struct LinearActor {
    policy: LinearPolicy,
    stopwatch: Stopwatch,
}

impl Actor for LinearActor {
    fn begin(&mut self, recording: Recording, experience: &mut Experience) {
        let LinearPolicy {
            agents,
            inputs,
            actions,
            ..
        } = self.policy;
        if experience.banks.is_empty() {
            experience
                .banks
                .push(Rows::new([agents, inputs, actions], false));
        }
        experience.banks[0].begin(recording);
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), Error> {
        let agents = self.policy.agents;
        let instances: Vec<Instance> = situation
            .playing
            .iter()
            .flat_map(|&environment| (0..agents).map(move |group| Instance { environment, group }))
            .collect();
        let rows = &mut experience.banks[0];
        rows.begin_step(instances.iter().copied(), |_| true);
        for (row, &Instance { environment, group }) in instances.iter().enumerate() {
            let view = situation
                .observations
                .local_view(environment, AgentId::new(group));
            let (input, mask) = rows.row_mut(row);
            input.copy_from_slice(view.observation());
            if let Some(mask) = mask {
                mask.copy_from_slice(view.available());
            }
            let moment = (&situation.keys[environment], situation.step);
            let mode = situation.behaviour.mode;
            actions_bn[environment * agents + group] =
                self.policy.choose(parameters, view, moment, mode);
        }
        Ok(())
    }

    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }

    fn controller_inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput> {
        let rows = &experience.banks[0];
        let instances = rows.instances_of(rows.latest()).iter().enumerate();
        let own = instances.filter(|(_, instance)| instance.environment == b);
        own.map(|(row, instance)| input_of(AgentId::new(instance.group), rows.input(row)))
            .collect()
    }
}

/// One agent alone.
struct LinearExecutor {
    policy: LinearPolicy,
    read: Option<ControllerInput>,
}

impl Executor for LinearExecutor {
    fn begin(&mut self) {
        self.read = None;
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        self.read = Some(input_of(view.agent(), view.observation()));
        self.policy
            .choose(parameters, view, (key, step), behaviour.mode)
    }

    fn controller_inputs(&self) -> Vec<ControllerInput> {
        self.read.clone().into_iter().collect()
    }
}

fn input_of(agent: AgentId, values: &[f32]) -> ControllerInput {
    ControllerInput {
        controller: ControllerId {
            name: "agent".into(),
            agents: vec![agent],
        },
        values: values.to_vec(),
    }
}
