//! The whole hierarchy at work in the environments of one shard.
//!
//! At every step the recurrence of each living agent and of each pair of living agents advances, chosen or not: which
//! partition a later step will choose is not known now. Rows of the dead are dropped, since their one choice is forced. Which
//! pairs *can* be chosen at this step is known: where partitions take turns, only the pairs of the one in force are asked
//! for their choice, which is exact, since nobody reads what the others would have said. Of 27 agents that is 13 pairs of 351.

use std::sync::Arc;

use mackrl_env::{Action, AgentId, EntitySet, EpisodeKey, KnownEntities, Observations};

use super::{
    Hierarchy,
    agent_controller::is_alive,
    controller::ControllerMemory,
    sampling::{Path, Sampler},
    statistics::HierarchyStatistics,
    thought,
};
use crate::{
    NotFinite, Phase, Real, Stopwatch,
    common_knowledge::common_knowledge,
    marginalisation::{MarginalGradient, log_likelihood_with_gradient},
    nn::Named,
    partition::{Pair, Partition, PartitionBuffer},
    policy::{
        Actor, ControllerId, ControllerInput, DELEGATE, PolicyTable, Recording, Situation, Tally,
        Thought, Weights,
    },
};

/// An actor of pairwise MACKRL.
pub(super) struct PairwiseActor {
    hierarchy: Arc<Hierarchy>,
    recording: Recording,
    selector: Option<ControllerMemory>,
    pairs: ControllerMemory,
    agents: ControllerMemory,
    /// Environment and pair of each row of `pairs` at this step.
    pair_rows: Vec<(usize, Pair)>,
    /// Rows of `pairs` that are asked for their choice at this step.
    asked_rows: Vec<usize>,
    /// Environment and agent of each row of `agents` at this step.
    agent_rows: Vec<(usize, AgentId)>,
    worlds: Vec<World>,
    gradient: MarginalGradient<f32>,
    statistics: HierarchyStatistics,
    stopwatch: Stopwatch,
    /// Members' available actions, \[2, A\] and \[N, A\].
    pair_available_ga: Vec<bool>,
    team_available_ga: Vec<bool>,
}

/// One environment's tables at one step, and what was made of them.
struct Decision<'a> {
    table: PolicyTable<'a, f32>,
    path: &'a mut Path,
    known_k: &'a [EntitySet],
    alive_n: &'a [bool],
}

/// What an actor keeps of one environment.
struct World {
    last_action_n: Vec<Option<Action>>,
    alive_n: Vec<bool>,
    /// Common knowledge of every pair.
    known_k: Vec<EntitySet>,
    /// Whether each pair can be formed at this step.
    in_force_k: Vec<bool>,
    partition_buffer: PartitionBuffer,
    path: Path,
    /// log `p(u_t)` at each step so far, if recorded.
    log_p_t: Vec<f32>,
    log_p_selector_p: Vec<f32>,
    log_p_pair_kc: Vec<f32>,
    log_p_agent_na: Vec<f32>,
}

impl PairwiseActor {
    pub(super) fn new(hierarchy: Arc<Hierarchy>, environments: usize) -> Self {
        let selector = hierarchy.selector.as_ref();
        let agents = hierarchy.shape.agents;
        Self {
            recording: Recording::Off,
            selector: selector.map(|selector| ControllerMemory::new(selector.controller())),
            pairs: if hierarchy.partitions.are_fixed() {
                ControllerMemory::new(hierarchy.pairs.controller())
            } else {
                ControllerMemory::selective(hierarchy.pairs.controller())
            },
            agents: ControllerMemory::new(hierarchy.agents.controller()),
            pair_rows: Vec::new(),
            asked_rows: Vec::new(),
            agent_rows: Vec::new(),
            worlds: (0..environments).map(|_| World::new(&hierarchy)).collect(),
            gradient: MarginalGradient::new(hierarchy.shape, hierarchy.partitions.count()),
            statistics: HierarchyStatistics::new(hierarchy.spec.entities - agents),
            stopwatch: Stopwatch::default(),
            pair_available_ga: vec![false; 2 * hierarchy.shape.actions],
            team_available_ga: vec![false; agents * hierarchy.shape.actions],
            hierarchy,
        }
    }

    /// Advances the pair selector in every environment.
    fn run_selector(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
    ) -> Result<(), NotFinite> {
        let (Some(selector), Some(memory), Some(weights)) = (
            &self.hierarchy.selector,
            &mut self.selector,
            &weights.selector,
        ) else {
            return Ok(());
        };
        memory.begin_step(situation.playing.iter().copied());
        for (row, &b) in situation.playing.iter().enumerate() {
            let known = common_knowledge(selector.team(), situation.observations.visible(b));
            let known = known_entities(situation.observations, b, selector.team()[0], known);
            selector.write_row(memory, row, known, &mut self.team_available_ga);
        }
        self.stopwatch.lap(Phase::CommonKnowledge);
        // The paper explores at the second and the third level only.
        memory.run(selector.controller(), weights, 0.0);
        memory.check_logits(|row| {
            [
                ("episode", situation.playing[row]),
                ("step", situation.step),
            ]
        })?;
        for (row, &b) in situation.playing.iter().enumerate() {
            self.worlds[b]
                .log_p_selector_p
                .copy_from_slice(memory.log_p(row));
        }
        self.stopwatch.lap(Phase::Act);
        Ok(())
    }

    /// Advances the controllers of all pairs of living agents.
    fn run_pairs(&mut self, weights: &Weights, situation: Situation<'_>) -> Result<(), NotFinite> {
        let Some(weights) = &weights.pairs else {
            return Ok(());
        };
        let controller = &self.hierarchy.pairs;
        let pairs = self.hierarchy.shape.pairs();
        self.pair_rows.clear();
        for &b in situation.playing {
            let living = self
                .hierarchy
                .active_pairs
                .iter()
                .filter(|p| self.worlds[b].lives(**p));
            self.pair_rows.extend(living.map(|&pair| (b, pair)));
        }
        let memory = &mut self.pairs;
        memory.begin_step(
            self.pair_rows
                .iter()
                .map(|(b, pair)| b * pairs + pair.index()),
        );
        self.asked_rows.clear();
        if self.hierarchy.partitions.are_fixed() {
            self.asked_rows.extend(0..self.pair_rows.len());
        } else {
            for (row, (b, pair)) in self.pair_rows.iter().enumerate() {
                let in_force = &self.worlds[*b].in_force_k;
                if in_force[pair.index()] {
                    self.asked_rows.push(row);
                }
            }
            memory.ask(&self.asked_rows);
        }
        for (row, &(b, pair)) in self.pair_rows.iter().enumerate() {
            let known = self.worlds[b].known_k[pair.index()];
            let known = known_entities(situation.observations, b, pair.agents()[0], known);
            controller.write_row(memory, row, known, pair, &mut self.pair_available_ga);
        }
        self.stopwatch.lap(Phase::CommonKnowledge);
        memory.run(
            controller.controller(),
            weights,
            situation.behaviour.exploration,
        );
        memory.check_logits(|asked| {
            let (b, pair) = self.pair_rows[self.asked_rows[asked]];
            let [first, second] = pair.agents().map(AgentId::index);
            let step = situation.step;
            [
                ("episode", b),
                ("step", step),
                ("agent", first),
                ("agent", second),
            ]
        })?;
        for &row in &self.asked_rows {
            let (b, pair) = self.pair_rows[row];
            let log_p_c = memory.log_p(row);
            let first = pair.index() * log_p_c.len();
            self.worlds[b].log_p_pair_kc[first..first + log_p_c.len()].copy_from_slice(log_p_c);
        }
        Ok(())
    }

    /// Advances the controllers of all living agents.
    fn run_agents(&mut self, weights: &Weights, situation: Situation<'_>) -> Result<(), NotFinite> {
        let controller = &self.hierarchy.agents;
        let agents = self.hierarchy.shape.agents;
        self.agent_rows.clear();
        for &b in situation.playing {
            let living = (0..agents).filter(|&agent| self.worlds[b].alive_n[agent]);
            self.agent_rows
                .extend(living.map(|agent| (b, AgentId::new(agent))));
        }
        let memory = &mut self.agents;
        memory.begin_step(
            self.agent_rows
                .iter()
                .map(|(b, agent)| b * agents + agent.index()),
        );
        for (row, &(b, agent)) in self.agent_rows.iter().enumerate() {
            let view = situation.observations.local_view(b, agent);
            let last_action = self.worlds[b].last_action_n[agent.index()];
            controller.write_row(memory, row, view, last_action);
        }
        memory.run(
            controller.controller(),
            &weights.agents,
            situation.behaviour.exploration,
        );
        memory.check_logits(|row| {
            let (b, agent) = self.agent_rows[row];
            [
                ("episode", b),
                ("step", situation.step),
                ("agent", agent.index()),
            ]
        })?;
        for (row, &(b, agent)) in self.agent_rows.iter().enumerate() {
            let log_p_a = memory.log_p(row);
            let first = agent.index() * log_p_a.len();
            self.worlds[b].log_p_agent_na[first..first + log_p_a.len()].copy_from_slice(log_p_a);
        }
        Ok(())
    }

    /// Walks down the hierarchy in environment `b` and, if recording, remembers how log p(u) depends on each choice.
    fn choose(&mut self, b: usize, situation: Situation<'_>, action_n: &mut [Action]) {
        let world = &mut self.worlds[b];
        let Decision {
            table,
            path,
            known_k,
            alive_n,
        } = world.decision(&self.hierarchy, situation, b);
        let sampler = Sampler {
            key: situation.keys[b],
            step: situation.step,
            mode: situation.behaviour.mode,
        };
        if self.hierarchy.selector.is_some() {
            sampler.sample(&table, action_n, path);
        } else {
            let partition = sampler.draw_partition(table.partitions().len());
            sampler.sample_within(partition, &table, action_n, path);
        }
        self.statistics.observe(&table, path, known_k, alive_n);
        if self.recording == Recording::ForLearning {
            self.stopwatch.lap(Phase::Act);
            let log_p = log_likelihood_with_gradient(&table, action_n, &mut self.gradient);
            world.log_p_t.push(log_p);
            self.stopwatch.lap(Phase::Marginal);
        }
        for (last, &action) in world.last_action_n.iter_mut().zip(action_n.iter()) {
            *last = Some(action);
        }
    }

    /// Hands the posterior weights of environment `b`'s joint action to the rows whose choices they are weights of.
    fn record(&mut self, b: usize, situation: Situation<'_>, action_n: &[Action]) {
        let shape = self.hierarchy.shape;
        if let Some(memory) = &mut self.selector {
            let row = situation.playing.iter().position(|&playing| playing == b);
            let row = row.expect("only playing environments are recorded");
            for (partition, &weight) in self.gradient.selector_p.iter().enumerate() {
                memory.record(row, partition, b, weight);
            }
        }
        let rows = self
            .pair_rows
            .iter()
            .enumerate()
            .filter(|(_, (row_b, _))| *row_b == b);
        for (row, (_, pair)) in rows {
            let [first, second] = pair.agents().map(|agent| action_n[agent.index()]);
            let index = pair.index();
            self.pairs
                .record(row, DELEGATE, b, self.gradient.delegate_k[index]);
            self.pairs.record(
                row,
                shape.column(first, second),
                b,
                self.gradient.joint_k[index],
            );
        }
        let rows = self
            .agent_rows
            .iter()
            .enumerate()
            .filter(|(_, (row_b, _))| *row_b == b);
        for (row, (_, agent)) in rows {
            let (n, action) = (agent.index(), action_n[agent.index()].index());
            self.agents.record(row, action, b, self.gradient.agent_n[n]);
        }
    }
}

impl Actor for PairwiseActor {
    fn begin(&mut self, recording: Recording) {
        self.recording = recording;
        self.statistics.clear();
        let upper = self.selector.as_mut().into_iter();
        upper
            .chain([&mut self.pairs, &mut self.agents])
            .for_each(|memory| memory.begin(recording));
        self.worlds.iter_mut().for_each(World::begin);
    }

    fn act(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite> {
        for &b in situation.playing {
            self.worlds[b].observe(&self.hierarchy, situation.observations, b);
            self.worlds[b].note_partitions(&self.hierarchy, &situation.keys[b], situation.step);
        }
        self.stopwatch.lap(Phase::CommonKnowledge);
        self.run_selector(weights, situation)?;
        self.run_pairs(weights, situation)?;
        self.run_agents(weights, situation)?;
        let agents = self.hierarchy.shape.agents;
        for &b in situation.playing {
            let action_n = &mut actions_bn[b * agents..(b + 1) * agents];
            self.choose(b, situation, action_n);
            if self.recording == Recording::ForLearning {
                self.record(b, situation, action_n);
                self.stopwatch.lap(Phase::Marginal);
            }
        }
        self.stopwatch.lap(Phase::Act);
        Ok(())
    }

    fn backward(&mut self, weights: &Weights, weight_bt: &[Vec<f32>], gradient: &mut [f32]) -> f64 {
        let hierarchy = &*self.hierarchy;
        if let (Some(selector), Some(memory), Some(weights)) =
            (&hierarchy.selector, &mut self.selector, &weights.selector)
        {
            memory.backward(selector.controller(), weights, weight_bt, gradient);
        }
        if let Some(weights) = &weights.pairs {
            self.pairs
                .backward(hierarchy.pairs.controller(), weights, weight_bt, gradient);
        }
        self.agents.backward(
            hierarchy.agents.controller(),
            &weights.agents,
            weight_bt,
            gradient,
        );
        let products = self.worlds.iter().zip(weight_bt).map(|(world, weight_t)| {
            let steps = world.log_p_t.iter().zip(weight_t);
            steps
                .map(|(&log_p, &weight)| f64::from(log_p) * f64::from(weight))
                .sum::<f64>()
        });
        products.sum()
    }

    fn report(&self, tally: &mut Tally) {
        self.statistics.report(tally);
    }

    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }

    fn activations(&self) -> Vec<Named<'_, f32>> {
        let upper = self.selector.iter();
        let memories = upper.chain([&self.pairs, &self.agents]);
        memories.flat_map(ControllerMemory::activations).collect()
    }

    fn gradients(&self) -> Vec<Named<'_, f32>> {
        let upper = self.selector.iter();
        let memories = upper.chain([&self.pairs, &self.agents]);
        memories.flat_map(ControllerMemory::gradients).collect()
    }

    fn controller_inputs(&self, b: usize) -> Vec<ControllerInput> {
        let mut inputs = Vec::new();
        if let Some(memory) = &self.selector
            && let Some(row) = memory.row_of(b)
        {
            inputs.push(memory.input(row, ControllerId::PairSelector));
        }
        for (row, &(_, pair)) in self
            .pair_rows
            .iter()
            .enumerate()
            .filter(|(_, (row_b, _))| *row_b == b)
        {
            let [first, second] = pair.agents();
            inputs.push(
                self.pairs
                    .input(row, ControllerId::PairController(first, second)),
            );
        }
        for (row, &(_, agent)) in self
            .agent_rows
            .iter()
            .enumerate()
            .filter(|(_, (row_b, _))| *row_b == b)
        {
            inputs.push(self.agents.input(row, ControllerId::AgentController(agent)));
        }
        inputs
    }

    fn thought(&mut self, b: usize, situation: Situation<'_>, action_n: &[Action]) -> Thought {
        let possible = self.hierarchy.active_pairs.iter().copied();
        let in_force_k = &self.worlds[b].in_force_k;
        // The others were not asked what they would do.
        let possible: Vec<Pair> = possible.filter(|pair| in_force_k[pair.index()]).collect();
        let decision = self.worlds[b].decision(&self.hierarchy, situation, b);
        let log_p = log_likelihood_with_gradient(&decision.table, action_n, &mut self.gradient);
        thought::describe(
            &thought::Subject {
                table: decision.table,
                path: decision.path,
                known_k: decision.known_k,
                alive_n: decision.alive_n,
                action_n,
            },
            &possible,
            (log_p, &self.gradient),
        )
    }
}

impl World {
    fn new(hierarchy: &Hierarchy) -> Self {
        let shape = hierarchy.shape;
        Self {
            last_action_n: vec![None; shape.agents],
            alive_n: vec![true; shape.agents],
            known_k: vec![EntitySet::EMPTY; shape.pairs()],
            in_force_k: vec![true; shape.pairs()],
            partition_buffer: PartitionBuffer::default(),
            path: Path::default(),
            log_p_t: Vec::new(),
            // A selector replaces these at every step.
            log_p_selector_p: uniform(hierarchy.partitions.count()),
            log_p_pair_kc: vec![0.0; shape.pairs() * shape.columns()],
            log_p_agent_na: vec![0.0; shape.agents * shape.actions],
        }
    }

    fn begin(&mut self) {
        self.last_action_n.fill(None);
        self.log_p_t.clear();
    }

    /// Notes who lives and what each pair commonly knows, and writes the tables of those whose choice is forced.
    fn observe(&mut self, hierarchy: &Hierarchy, observations: &Observations, b: usize) {
        let visible_n = observations.visible(b);
        for (agent, alive) in self.alive_n.iter_mut().enumerate() {
            let view = observations.local_view(b, AgentId::new(agent));
            *alive = is_alive(view);
            if !*alive {
                let actions = view.available().len();
                let log_p_a = &mut self.log_p_agent_na[agent * actions..(agent + 1) * actions];
                for (log_p, &available) in log_p_a.iter_mut().zip(view.available()) {
                    *log_p = if available { 0.0 } else { f32::NEG_INFINITY };
                }
            }
        }
        for &pair in &hierarchy.active_pairs {
            self.known_k[pair.index()] = common_knowledge(&pair.agents(), visible_n);
            if !self.lives(pair) {
                let columns = hierarchy.shape.columns();
                let first = pair.index() * columns;
                let log_p_c = &mut self.log_p_pair_kc[first..first + columns];
                log_p_c.fill(f32::NEG_INFINITY);
                log_p_c[DELEGATE] = 0.0;
            }
        }
    }

    /// Notes which pairs can be formed at `step` of the episode called `key`.
    fn note_partitions(&mut self, hierarchy: &Hierarchy, key: &EpisodeKey, step: usize) {
        if hierarchy.partitions.are_fixed() {
            return;
        }
        self.in_force_k.fill(false);
        let in_force = hierarchy
            .partitions
            .in_force(key, step, &mut self.partition_buffer);
        for pair in in_force.iter().flat_map(Partition::pairs) {
            self.in_force_k[pair.index()] = true;
        }
    }

    /// The tables of the latest step.
    fn decision<'a>(
        &'a mut self,
        hierarchy: &'a Hierarchy,
        situation: Situation<'_>,
        b: usize,
    ) -> Decision<'a> {
        let partitions = hierarchy.partitions.in_force(
            &situation.keys[b],
            situation.step,
            &mut self.partition_buffer,
        );
        let table = PolicyTable::new(
            hierarchy.shape,
            partitions,
            &self.log_p_selector_p,
            &self.log_p_pair_kc,
            &self.log_p_agent_na,
        )
        .expect("the buffers have the hierarchy's sizes");
        Decision {
            table,
            path: &mut self.path,
            known_k: &self.known_k,
            alive_n: &self.alive_n,
        }
    }

    fn lives(&self, pair: Pair) -> bool {
        pair.agents()
            .into_iter()
            .all(|agent| self.alive_n[agent.index()])
    }
}

/// The log-probabilities of `count` equally likely choices.
fn uniform(count: usize) -> Vec<f32> {
    vec![0.0 - Real::ln(count as f32); count]
}

/// The entities of `known` as `member` sees them in environment `b`.
fn known_entities(
    observations: &Observations,
    b: usize,
    member: AgentId,
    known: EntitySet,
) -> KnownEntities<'_> {
    observations
        .local_view(b, member)
        .seen()
        .restricted_to(known)
}
