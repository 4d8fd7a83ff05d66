//! Worlds that are written in Python, as a kind of world among the others.
//!
//! A configuration names the class (`env.map = "package.module:Class"`) and its arguments (`env.arguments`, JSON), so a run can be
//! opened again wherever the class can be imported. What a class has to offer stands in `mackrl.World`. Every call goes through the
//! interpreter, so several threads gain nothing.

use std::{
    panic::{self, AssertUnwindSafe},
    sync::{Arc, Mutex, PoisonError},
};

use mackrl_env::{
    Action, AgentId, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd, EpisodeKey,
    IllegalAction, Interruption, KnownEntities, ObservationMut, PriorKnowledge, Statistic,
    StepError, TimeStep, World, WorldError, WorldKind,
    contract::check_environment,
    declare_settings,
    settings::{Accepts, Setting, Settings},
};
use mackrl_run::config::Registry;
use numpy::{
    Element, PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1,
    ndarray::{Dimension, IntoDimension},
};
use pyo3::{
    exceptions::{PyAssertionError, PyValueError},
    prelude::*,
};

use crate::configuration::Layers;

/// The name by which configurations call this kind.
const PYTHON: &str = "python";
/// What panics of a world's methods say that have no other way to fail.
pub(crate) const OF_THE_WORLD: &str = "of the world failed";

declare_settings! {
    /// Which world.
    pub(crate) struct PythonSettings {
        /// The class, as `package.module:Class`.
        map: String = String::new(), Accepts::Text { expects: "the name of a class, as package.module:Class", pattern: None };
        /// The arguments that it is made with, as a JSON object.
        arguments: String = "{}".to_owned(), Accepts::Text { expects: "a JSON object", pattern: None };
    }
}

/// Adds the kind to what configurations can name in this process.
pub(crate) fn install() {
    // It fails if it was done before, and then it was done.
    drop(
        Registry::built_in()
            .with_world(Arc::new(PythonKind))
            .install(),
    );
}

/// Worlds of Python classes.
#[derive(Debug)]
struct PythonKind;

impl WorldKind for PythonKind {
    fn name(&self) -> &str {
        PYTHON
    }

    fn summary(&self) -> &str {
        "a class in Python"
    }

    fn settings(&self) -> Vec<Setting> {
        PythonSettings::DECLARED.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        PythonSettings::defaults()
    }

    fn build(&self, table: &toml::Table) -> Result<Arc<dyn World>, WorldError> {
        let PythonSettings { map, arguments } = PythonSettings::read(table)?;
        let built = Python::attach(|py| -> PyResult<PythonWorld> {
            let module = PyModule::import(py, "mackrl.worlds")?;
            let factory = module
                .getattr("_factory")?
                .call1((map.as_str(), arguments))?;
            PythonWorld::new(&factory)
        });
        let world = built.map_err(|error| WorldError::Unavailable(format!("{map}: {error}")))?;
        world.spec.validate()?;
        Ok(Arc::new(world))
    }
}

/// A class with its arguments.
#[derive(Debug)]
struct PythonWorld {
    factory: Py<PyAny>,
    spec: EnvironmentSpec,
    prior: Arc<PythonKnowledge>,
    version: String,
    source: String,
}

impl PythonWorld {
    fn new(factory: &Bound<'_, PyAny>) -> PyResult<Self> {
        let object = factory.call0()?;
        let number = |name: &str| -> PyResult<usize> { object.getattr(name)?.extract() };
        let declared: Vec<(String, String)> = object
            .getattr("statistics")?
            .call_method0("items")?
            .try_iter()?
            .map(|item| item?.extract())
            .collect::<PyResult<_>>()?;
        let success: Option<String> = object.getattr("success")?.extract()?;
        let place = |name: &String| declared.iter().position(|(other, _)| other == name);
        let unknown = || PyValueError::new_err("success names none of the statistics");
        let spec = EnvironmentSpec {
            name: object.getattr("name")?.extract()?,
            agents: number("n_agents")?,
            entities: number("n_entities")?,
            entity_features: number("entity_features")?,
            position_features: number("position_features")?,
            actions: number("n_actions")?,
            observation_size: number("obs_size")?,
            state_size: number("state_size")?,
            episode_limit: number("episode_limit")?,
            distance_scale: object.getattr("distance_scale")?.extract()?,
            success: match &success {
                Some(name) => Some(place(name).ok_or_else(unknown)?),
                None => None,
            },
            statistics: (declared.into_iter())
                .map(|(name, meaning)| Statistic::new(name, meaning))
                .collect(),
        };
        Ok(Self {
            version: object.getattr("version")?.str()?.to_string(),
            source: factory.getattr("source")?.extract()?,
            prior: Arc::new(PythonKnowledge {
                object: object.unbind(),
                agents: spec.agents,
            }),
            spec,
            factory: factory.clone().unbind(),
        })
    }
}

impl World for PythonWorld {
    fn kind(&self) -> &str {
        PYTHON
    }

    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::clone(&self.prior) as Arc<dyn PriorKnowledge>
    }

    fn make(&self) -> Box<dyn Environment> {
        Box::new(Python::attach(|py| PythonEnvironment {
            made: self
                .factory
                .call0(py)
                .and_then(|object| Made::new(object.bind(py), &self.spec)),
            spec: self.spec.clone(),
            prior: Arc::clone(&self.prior),
            failed: None,
            available_na: Vec::new(),
            statistics_s: vec![0.0; self.spec.statistics.len()],
        }))
    }

    fn version(&self) -> &str {
        &self.version
    }

    fn data(&self) -> &str {
        &self.source
    }
}

/// One object of the class, and the arrays that it writes.
struct Made {
    object: Py<PyAny>,
    /// `mackrl.Buffers` of one world, without the first axis.
    view: Py<PyAny>,
    observations: Py<PyArray2<f32>>,
    state: Py<PyArray1<f32>>,
    avail_actions: Py<PyArray2<bool>>,
    visible: Py<PyArray2<bool>>,
    entities: Py<PyArray2<f32>>,
}

impl Made {
    fn new(object: &Bound<'_, PyAny>, spec: &EnvironmentSpec) -> PyResult<Self> {
        let py = object.py();
        let (n, m) = (spec.agents, spec.entities);
        let observations = zeros(py, [n, spec.observation_size]);
        let state = zeros(py, [spec.state_size]);
        let avail_actions = zeros(py, [n, spec.actions]);
        let visible = zeros(py, [n, m]);
        let entities = zeros(py, [m, spec.entity_features]);
        let arrays = (&observations, &state, &avail_actions, &visible, &entities);
        let view = PyModule::import(py, "mackrl.arrays")?
            .getattr("Buffers")?
            .call1(arrays)?;
        Ok(Self {
            object: object.clone().unbind(),
            view: view.unbind(),
            observations: observations.unbind(),
            state: state.unbind(),
            avail_actions: avail_actions.unbind(),
            visible: visible.unbind(),
            entities: entities.unbind(),
        })
    }

    /// Copies what the object wrote.
    fn show(&self, py: Python<'_>, out: &mut ObservationMut<'_>) -> PyResult<()> {
        copy(py, &self.observations, out.observation_no)?;
        copy(py, &self.state, out.state_g)?;
        copy(py, &self.avail_actions, out.available_na)?;
        copy(py, &self.entities, out.entity_mf)?;
        let visible = self.visible.bind(py).try_readonly()?;
        let visible = visible.as_slice()?;
        let entities = visible.len() / out.visible_n.len();
        for (set, visible_m) in out.visible_n.iter_mut().zip(visible.chunks(entities)) {
            *set = crate::set(visible_m);
        }
        Ok(())
    }
}

fn zeros<'py, T: Element, const D: usize, I>(
    py: Python<'py>,
    shape: [usize; D],
) -> Bound<'py, PyArray<T, I>>
where
    [usize; D]: IntoDimension<Dim = I>,
    I: Dimension,
{
    PyArray::zeros(py, shape, false)
}

fn copy<T: Element + Copy, D: Dimension>(
    py: Python<'_>,
    array: &Py<PyArray<T, D>>,
    out: &mut [T],
) -> PyResult<()> {
    let array = array.bind(py).try_readonly()?;
    out.copy_from_slice(array.as_slice()?);
    Ok(())
}

/// A world in Python as an environment.
struct PythonEnvironment {
    made: PyResult<Made>,
    spec: EnvironmentSpec,
    prior: Arc<PythonKnowledge>,
    /// Why the episode is void, if it is.
    failed: Option<String>,
    /// What the latest observations offer.
    available_na: Vec<bool>,
    statistics_s: Vec<f64>,
}

/// An exception with where it came from, in one line.
fn told(py: Python<'_>, error: &PyErr) -> String {
    let traceback = error
        .traceback(py)
        .and_then(|traceback| traceback.format().ok());
    let place = traceback.and_then(|text| {
        let mut lines = text.lines().rev();
        let line = lines.find(|line| line.trim_start().starts_with("File "))?;
        Some(format!(" ({})", line.trim()))
    });
    format!("{error}{}", place.unwrap_or_default())
}

impl PythonEnvironment {
    fn made(&self, py: Python<'_>) -> PyResult<&Made> {
        self.made.as_ref().map_err(|error| error.clone_ref(py))
    }

    fn note_statistics(&mut self, py: Python<'_>) -> PyResult<()> {
        if self.statistics_s.is_empty() {
            return Ok(());
        }
        let reported = self.made(py)?.object.bind(py).call_method0("report")?;
        let mut statistics_s = Vec::new();
        for Statistic { name, .. } in &self.spec.statistics {
            statistics_s.push(reported.get_item(&**name)?.extract()?);
        }
        self.statistics_s = statistics_s;
        Ok(())
    }

    fn begin(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) -> PyResult<()> {
        Python::attach(|py| {
            let made = self.made(py)?;
            let rng = PyModule::import(py, "mackrl.worlds")?.getattr("_generator")?;
            let rng = rng.call1((key.seed, crate::json(&key.stream), key.episode))?;
            made.object
                .bind(py)
                .call_method1("reset", (rng, &made.view))?;
            made.show(py, out)?;
            self.note_statistics(py)
        })
    }

    fn advance(&mut self, actions: &[Action], out: &mut ObservationMut<'_>) -> PyResult<TimeStep> {
        Python::attach(|py| {
            let made = self.made(py)?;
            let actions = actions.iter().map(|action| action.index());
            let actions = actions.map(|action| i64::try_from(action).expect("actions are few"));
            let actions = PyArray1::from_iter(py, actions);
            let stepped = made
                .object
                .bind(py)
                .call_method1("step", (actions, &made.view))?;
            let (reward, terminated, truncated): (f32, bool, bool) = stepped.extract()?;
            made.show(py, out)?;
            self.note_statistics(py)?;
            let end = match (terminated, truncated) {
                (true, _) => Some(EpisodeEnd::Terminated),
                (false, true) => Some(EpisodeEnd::Truncated),
                (false, false) => None,
            };
            Ok(TimeStep { reward, end })
        })
    }
}

impl Environment for PythonEnvironment {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::clone(&self.prior) as Arc<dyn PriorKnowledge>
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.failed = None;
        if let Err(error) = self.begin(key, out) {
            self.failed = Some(Python::attach(|py| told(py, &error)));
            out.visible_n.fill(EntitySet::EMPTY);
            out.available_na.fill(true);
        }
        self.available_na = out.available_na.to_vec();
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        let void = |reason: String| Interruption {
            reason,
            can_be_repeated: false,
        };
        if let Some(reason) = &self.failed {
            return Err(void(reason.clone()).into());
        }
        let masks = self.available_na.chunks(self.spec.actions);
        for (agent, (&action, available_a)) in actions.iter().zip(masks).enumerate() {
            if !available_a[action.index()] {
                let agent = AgentId::new(agent);
                return Err(IllegalAction { agent, action }.into());
            }
        }
        let advanced = self.advance(actions, out).map_err(|error| {
            let reason = Python::attach(|py| told(py, &error));
            self.failed = Some(reason.clone());
            void(reason)
        });
        self.available_na.copy_from_slice(out.available_na);
        Ok(advanced?)
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s.copy_from_slice(&self.statistics_s);
    }
}

/// What agents know before the game, as methods of an object that is never played with.
#[derive(Debug)]
struct PythonKnowledge {
    object: Py<PyAny>,
    agents: usize,
}

impl PythonKnowledge {
    fn available(
        &self,
        known: KnownEntities<'_>,
        agent: AgentId,
        available_a: &mut [bool],
    ) -> PyResult<()> {
        Python::attach(|py| {
            let entities = PyModule::import(py, "mackrl.worlds")?.getattr("_Known")?;
            let members: Vec<(usize, Vec<f32>)> = known
                .set()
                .iter()
                .filter_map(|entity| Some((entity.index(), known.get(entity)?.to_vec())))
                .collect();
            let known = entities.call1((members,))?;
            let object = self.object.bind(py);
            let available = object.call_method1("available", (known, agent.index()))?;
            let available: PyReadonlyArray1<'_, bool> = available.extract()?;
            if available.len()? != available_a.len() {
                return Err(PyValueError::new_err(
                    "available() gave another number of actions",
                ));
            }
            available_a.copy_from_slice(available.as_slice()?);
            Ok(())
        })
    }
}

impl PriorKnowledge for PythonKnowledge {
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        entity_f: &[f32],
    ) -> bool {
        let seen = Python::attach(|py| -> PyResult<bool> {
            let own = PyArray1::from_slice(py, observer_f);
            let its = PyArray1::from_slice(py, entity_f);
            let arguments = (observer.index(), own, entity.index(), its);
            self.object
                .bind(py)
                .call_method1("sees", arguments)?
                .extract()
        });
        seen.unwrap_or_else(|error| panic!("sees() {OF_THE_WORLD}: {error}"))
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        if !known.set().contains(agent) {
            available_a.fill(false);
            return;
        }
        debug_assert!(agent.index() < self.agents, "an agent of this world");
        if let Err(error) = Self::available(self, known, agent, available_a) {
            panic!("available() {OF_THE_WORLD}: {error}");
        }
    }

    fn action_on(&self, entity: EntityId) -> Option<Action> {
        let action = Python::attach(|py| -> PyResult<Option<usize>> {
            self.object
                .bind(py)
                .call_method1("action_on", (entity.index(),))?
                .extract()
        });
        let action = action.unwrap_or_else(|error| panic!("action_on() {OF_THE_WORLD}: {error}"));
        action.map(Action::new)
    }
}

/// Plays random episodes and checks every promise of the contract; gives how often states were compared that differ beyond an
/// agent's sight.
#[pyfunction]
pub(crate) fn check_world(py: Python<'_>, layers: &Layers, episodes: u64) -> PyResult<u64> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let world = layers.world()?;
    py.detach(|| {
        let _one = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        // The broken promise is told by an exception; it need not stand on the terminal too.
        let hook = panic::take_hook();
        panic::set_hook(Box::new(|_| {}));
        let mut environment = world.make();
        let checked = panic::catch_unwind(AssertUnwindSafe(|| {
            check_environment(&mut *environment, episodes)
        }));
        panic::set_hook(hook);
        checked
            .map(|coverage| coverage.other_actions)
            .map_err(|broken| {
                let text = broken.downcast_ref::<String>().map(String::as_str);
                let text = text.or_else(|| broken.downcast_ref::<&str>().copied());
                PyAssertionError::new_err(
                    text.unwrap_or("a promise of the contract is broken")
                        .to_owned(),
                )
            })
    })
}
