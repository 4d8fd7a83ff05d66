//! The state of an algorithm by names, so that whatever stores it needs to know nothing else of it.

use std::collections::BTreeMap;

use crate::{
    Error,
    critics::CriticState,
    experience::MemoryState,
    nn::{Moments, OptimiserKind, ParameterLayout},
};

/// How the names of a target critic's tensors begin.
const TARGET: &str = "target.";

/// Everything that an algorithm's future depends on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlgorithmState {
    /// Vectors, each with the names and shapes of its tensors.
    pub tensors: Vec<(ParameterLayout, Vec<f32>)>,
    /// Counts, each at most 2⁵³.
    pub counters: BTreeMap<String, u64>,
    /// What a replay memory holds, if there is one.
    pub memory: Option<MemoryState>,
}

/// The policy of an actor-critic, as a checkpoint holds it.
#[derive(Debug)]
pub(crate) struct PolicyState {
    pub(crate) parameters: Vec<f32>,
    pub(crate) moments: Moments<f32>,
    pub(crate) updates: u64,
}

/// A state that was stored.
pub trait StoredState {
    /// The values of the tensors that `layout` names.
    ///
    /// # Errors
    /// [`Error::Data`] if a tensor is missing, has another shape, or holds a number that is not finite.
    fn tensors(&self, layout: &ParameterLayout) -> Result<Vec<f32>, Error>;

    /// A count.
    ///
    /// # Errors
    /// [`Error::Data`] if it is missing.
    fn counter(&self, name: &str) -> Result<u64, Error>;

    /// What a replay memory held.
    ///
    /// # Errors
    /// [`Error::Data`] if it is missing.
    fn memory(&self) -> Result<MemoryState, Error> {
        Err(Error::Data("no replay memory was stored".to_owned()))
    }
}

impl AlgorithmState {
    /// Adds a vector under the names of `layout`.
    pub fn add_tensors(&mut self, layout: &ParameterLayout, values: &[f32]) {
        self.tensors.push((layout.clone(), values.to_vec()));
    }

    /// Adds a count.
    pub fn add_counter(&mut self, name: &str, count: u64) {
        self.counters.insert(name.to_owned(), count);
    }

    /// Adds what an optimiser remembers of the parameters of `layout`: tensors `opt.adam.m.NAME` and so on, and the number of
    /// its steps as `NAME.optimiser_steps`.
    pub fn add_moments(
        &mut self,
        name: &str,
        kind: OptimiserKind,
        layout: &ParameterLayout,
        moments: &Moments<f32>,
    ) {
        let [first, second] = moment_layouts(kind, layout);
        self.add_tensors(&second, &moments.second);
        if has_first_moments(kind) {
            self.add_tensors(&first, &moments.first);
        }
        self.add_counter(&format!("{name}.optimiser_steps"), moments.steps);
    }
}

impl AlgorithmState {
    /// Of a policy and its critic, whose tensors the layouts name in this order.
    pub(crate) fn of_actor_critic(
        kind: OptimiserKind,
        [layout, critic_layout]: [&ParameterLayout; 2],
        (parameters, moments, updates): (&[f32], &Moments<f32>, u64),
        critic: &CriticState,
    ) -> Self {
        let mut state = Self::default();
        state.add_tensors(layout, parameters);
        state.add_tensors(critic_layout, &critic.parameters);
        let target = critic_layout.prefixed(TARGET);
        state.add_tensors(&target, &critic.target_parameters);
        state.add_moments("policy", kind, layout, moments);
        state.add_moments("critic", kind, critic_layout, &critic.moments);
        state.add_counter("policy.updates", updates);
        state.add_counter("critic.updates", critic.updates);
        state.add_counter("critic.updates_at_refresh", critic.updates_at_refresh);
        state
    }
}

/// What [`AlgorithmState::of_actor_critic`] stored.
pub(crate) fn read_actor_critic(
    stored: &dyn StoredState,
    kind: OptimiserKind,
    [layout, critic_layout]: [&ParameterLayout; 2],
) -> Result<(PolicyState, CriticState), Error> {
    let policy = PolicyState {
        parameters: stored.tensors(layout)?,
        moments: read_moments(stored, "policy", kind, layout)?,
        updates: stored.counter("policy.updates")?,
    };
    let critic = CriticState {
        parameters: stored.tensors(critic_layout)?,
        target_parameters: stored.tensors(&critic_layout.prefixed(TARGET))?,
        moments: read_moments(stored, "critic", kind, critic_layout)?,
        updates: stored.counter("critic.updates")?,
        updates_at_refresh: stored.counter("critic.updates_at_refresh")?,
    };
    if critic.updates_at_refresh > critic.updates {
        return Err(Error::Data(format!(
            "the target critic was refreshed after {} updates, expected at most {}",
            critic.updates_at_refresh, critic.updates
        )));
    }
    Ok((policy, critic))
}

/// What [`AlgorithmState::add_moments`] stored.
pub(crate) fn read_moments(
    stored: &dyn StoredState,
    name: &str,
    kind: OptimiserKind,
    layout: &ParameterLayout,
) -> Result<Moments<f32>, Error> {
    let [first, second] = moment_layouts(kind, layout);
    Ok(Moments {
        steps: stored.counter(&format!("{name}.optimiser_steps"))?,
        first: if has_first_moments(kind) {
            stored.tensors(&first)?
        } else {
            Vec::new()
        },
        second: stored.tensors(&second)?,
    })
}

/// The names of the first and the second moments.
fn moment_layouts(kind: OptimiserKind, layout: &ParameterLayout) -> [ParameterLayout; 2] {
    let name = match kind {
        OptimiserKind::Adam { .. } => "adam",
        OptimiserKind::RmsProp { .. } => "rmsprop",
    };
    ["m", "v"].map(|moment| layout.prefixed(&format!("opt.{name}.{moment}.")))
}

const fn has_first_moments(kind: OptimiserKind) -> bool {
    matches!(kind, OptimiserKind::Adam { .. })
}
