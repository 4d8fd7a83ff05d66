//! The state of an algorithm by names, so that whatever stores it needs to know nothing else of it.

use std::collections::BTreeMap;

use crate::{
    Error,
    experience::MemoryState,
    nn::{Moments, OptimiserKind, ParameterLayout},
};

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
