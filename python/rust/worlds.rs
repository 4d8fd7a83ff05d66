//! B worlds that are played together, and write what they show into the caller's arrays.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};

use mackrl_env::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd,
    EpisodeKey, IllegalAction, KnownEntities, ObservationMut, PriorKnowledge, StepError, Stream,
    random_play::random_action,
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};
use serde::{Deserialize, Serialize};

use crate::{
    arrays::{Read, Written, parts_mut, read, written},
    configuration::Layers,
    errors::{illegal_action, learning, world_failed},
};

/// What becomes of a world whose episode is over, as Gymnasium names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Autoreset {
    /// The next episode begins within the step that ended the last.
    SameStep,
    /// The next step begins it, whatever its actions.
    NextStep,
    /// Nothing: the world is left alone until it is reset.
    Disabled,
}

/// The arrays that worlds write, by their names in Python.
pub(crate) struct Shown<'py> {
    observations: Written<'py, f32>,
    state: Written<'py, f32>,
    avail_actions: Written<'py, bool>,
    visible: Written<'py, bool>,
    entities: Written<'py, f32>,
}

/// The same five arrays, as Python hands them over.
type ShownArrays<'py> = [Bound<'py, PyAny>; 5];

/// One world's part of them.
struct Row<'a> {
    observation_no: &'a mut [f32],
    state_g: &'a mut [f32],
    available_na: &'a mut [bool],
    visible_nm: &'a mut [bool],
    entity_mf: &'a mut [f32],
}

impl<'py> Shown<'py> {
    fn of(spec: &EnvironmentSpec, worlds: usize, arrays: &ShownArrays<'py>) -> PyResult<Self> {
        let EnvironmentSpec {
            agents,
            entities,
            entity_features,
            actions,
            observation_size,
            state_size,
            ..
        } = *spec;
        let [observations, state, avail_actions, visible, entity] = arrays;
        let b = worlds;
        Ok(Self {
            observations: written("observations", observations, &[b, agents, observation_size])?,
            state: written("state", state, &[b, state_size])?,
            avail_actions: written("avail_actions", avail_actions, &[b, agents, actions])?,
            visible: written("visible", visible, &[b, agents, entities])?,
            entities: written("entities", entity, &[b, entities, entity_features])?,
        })
    }

    /// The parts of the worlds, one after the other.
    fn rows(&mut self, spec: &EnvironmentSpec, worlds: usize) -> PyResult<Vec<Row<'_>>> {
        let n = spec.agents;
        let sizes = [
            n * spec.observation_size,
            spec.state_size,
            spec.entities * spec.entity_features,
        ];
        let mut observations = parts_mut(self.observations.as_slice_mut()?, sizes[0], worlds);
        let mut states = parts_mut(self.state.as_slice_mut()?, sizes[1], worlds);
        let mut entities = parts_mut(self.entities.as_slice_mut()?, sizes[2], worlds);
        let masks = self.avail_actions.as_slice_mut()?;
        let mut masks = parts_mut(masks, n * spec.actions, worlds);
        let mut visible = parts_mut(self.visible.as_slice_mut()?, n * spec.entities, worlds);
        let mut rows = Vec::with_capacity(worlds);
        while let (Some(observation_no), Some(state_g), Some(entity_mf)) =
            (observations.next(), states.next(), entities.next())
        {
            let (Some(available_na), Some(visible_nm)) = (masks.next(), visible.next()) else {
                break;
            };
            rows.push(Row {
                observation_no,
                state_g,
                available_na,
                visible_nm,
                entity_mf,
            });
        }
        Ok(rows)
    }
}

impl Row<'_> {
    fn copy_from(&mut self, other: &Row<'_>) {
        self.observation_no.copy_from_slice(other.observation_no);
        self.state_g.copy_from_slice(other.state_g);
        self.available_na.copy_from_slice(other.available_na);
        self.visible_nm.copy_from_slice(other.visible_nm);
        self.entity_mf.copy_from_slice(other.entity_mf);
    }
}

/// One world and where its episode stands.
struct Seat {
    environment: Box<dyn Environment>,
    key: EpisodeKey,
    /// By how much the number of its next episode is greater.
    stride: u64,
    end: Option<EpisodeEnd>,
    /// What was done since the episode began \[T·N\]: with the key, all that the episode is.
    played: Vec<Action>,
    visible_n: Vec<EntitySet>,
    available_na: Vec<bool>,
    action_n: Vec<Action>,
    entities: usize,
}

/// A [`Seat`] on disk.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    key: EpisodeKey,
    stride: u64,
    played: Vec<Action>,
}

impl Seat {
    fn new(environment: Box<dyn Environment>) -> Self {
        let spec = environment.spec();
        let (agents, actions, entities) = (spec.agents, spec.actions, spec.entities);
        Self {
            environment,
            key: EpisodeKey::new(0, Stream::Other, 0),
            stride: 1,
            end: None,
            played: Vec::new(),
            visible_n: vec![EntitySet::EMPTY; agents],
            available_na: vec![false; agents * actions],
            action_n: vec![Action::default(); agents],
            entities,
        }
    }

    fn steps(&self) -> usize {
        self.played.len() / self.action_n.len()
    }

    /// Begins the episode `key`.
    fn begin(&mut self, key: EpisodeKey, row: &mut Row<'_>) {
        self.key = key;
        self.end = None;
        self.played.clear();
        let mut out = ObservationMut {
            observation_no: row.observation_no,
            state_g: row.state_g,
            available_na: row.available_na,
            visible_n: &mut self.visible_n,
            entity_mf: row.entity_mf,
        };
        self.environment.reset(key, &mut out);
        self.settle(row);
    }

    fn begin_next(&mut self, row: &mut Row<'_>) {
        let episode = self.key.episode + self.stride;
        self.begin(
            EpisodeKey {
                episode,
                ..self.key
            },
            row,
        );
    }

    /// Plays the step of `action_n`.
    fn play(&mut self, row: &mut Row<'_>) -> Result<f32, StepError> {
        let mut out = ObservationMut {
            observation_no: row.observation_no,
            state_g: row.state_g,
            available_na: row.available_na,
            visible_n: &mut self.visible_n,
            entity_mf: row.entity_mf,
        };
        let step = self.environment.step(&self.action_n, &mut out)?;
        self.played.extend_from_slice(&self.action_n);
        self.end = step.end;
        self.settle(row);
        Ok(step.reward)
    }

    /// Spreads sets into an array, and keeps what the next actions are checked against.
    fn settle(&mut self, row: &mut Row<'_>) {
        let visible_nm = parts_mut(row.visible_nm, self.entities, self.visible_n.len());
        for (set, visible_m) in self.visible_n.iter().zip(visible_nm) {
            let bits = set.bits();
            for (entity, visible) in visible_m.iter_mut().enumerate() {
                *visible = bits >> entity & 1 == 1;
            }
        }
        self.available_na.copy_from_slice(row.available_na);
    }

    /// Takes over actions \[N\], if all are available.
    fn take(&mut self, action_n: &[i64]) -> Result<(), Refused> {
        let actions = self.available_na.len() / self.action_n.len();
        for (agent, (&found, own)) in action_n.iter().zip(&mut self.action_n).enumerate() {
            let action = usize::try_from(found)
                .ok()
                .filter(|&action| action < actions);
            let Some(action) = action else {
                return Err(Refused::NoAction { agent, found });
            };
            if !self.available_na[agent * actions + action] {
                let (agent, action) = (AgentId::new(agent), Action::new(action));
                return Err(Refused::Illegal(IllegalAction { agent, action }));
            }
            *own = Action::new(action);
        }
        Ok(())
    }
}

/// Why actions were not taken.
enum Refused {
    Illegal(IllegalAction),
    NoAction { agent: usize, found: i64 },
}

impl Refused {
    fn into_exception(self, world: usize, actions: usize) -> PyErr {
        match self {
            Self::Illegal(illegal) => illegal_action(world, illegal),
            Self::NoAction { agent, found } => PyValueError::new_err(format!(
                "actions[{world}, {agent}] is {found}, expected an integer in [0, {}]",
                actions - 1
            )),
        }
    }
}

/// One world's part of a step.
struct Job<'a> {
    seat: &'a mut Seat,
    row: Row<'a>,
    last: Option<Row<'a>>,
    reward: &'a mut f32,
    terminated: &'a mut bool,
    truncated: &'a mut bool,
    statistics_s: &'a mut [f64],
    outcome: Result<(), StepError>,
}

impl Job<'_> {
    fn run(&mut self, autoreset: Autoreset) {
        let Self { seat, row, .. } = self;
        *self.reward = 0.0;
        let is_over = seat.end.is_some();
        if is_over && autoreset == Autoreset::NextStep {
            seat.begin_next(row);
        } else if !is_over {
            match seat.play(row) {
                Ok(reward) => *self.reward = reward,
                Err(error) => {
                    self.outcome = Err(error);
                    return;
                }
            }
        }
        seat.environment.statistics(self.statistics_s);
        *self.terminated = seat.end == Some(EpisodeEnd::Terminated);
        *self.truncated = seat.end == Some(EpisodeEnd::Truncated);
        if seat.end.is_some() && autoreset == Autoreset::SameStep {
            if let Some(last) = &mut self.last {
                last.copy_from(row);
            }
            seat.begin_next(row);
        }
    }
}

/// B worlds.
#[pyclass(module = "mackrl._native", frozen)]
pub(crate) struct Worlds {
    seats: Mutex<Vec<Seat>>,
    count: usize,
    spec: EnvironmentSpec,
    prior: Arc<dyn PriorKnowledge>,
    threads: usize,
    autoreset: Autoreset,
}

impl Worlds {
    /// Only ever called without the interpreter: a world may be Python's.
    fn seats(&self) -> MutexGuard<'_, Vec<Seat>> {
        self.seats.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Worlds {
    #[new]
    fn new(layers: &Layers, num_envs: usize, threads: usize, autoreset: &str) -> PyResult<Self> {
        let world = layers.world()?;
        Ok(Self {
            seats: Mutex::new((0..num_envs).map(|_| Seat::new(world.make())).collect()),
            count: num_envs,
            spec: world.spec().clone(),
            prior: world.prior_knowledge(),
            threads: threads.max(1),
            autoreset: match autoreset {
                "same-step" => Autoreset::SameStep,
                "next-step" => Autoreset::NextStep,
                "disabled" => Autoreset::Disabled,
                _ => {
                    return Err(PyValueError::new_err(format!(
                        "autoreset is {autoreset:?}, expected \"same-step\", \"next-step\" or \"disabled\""
                    )));
                }
            },
        })
    }

    /// Sizes and limits, as JSON.
    fn spec(&self) -> String {
        crate::json(&self.spec)
    }

    /// Begins the episode `keys[b]` = (seed, number) in every world, or the next one; only where `mask` is true, if given.
    #[pyo3(signature = (keys, stride, stream, mask, out))]
    fn reset(
        &self,
        py: Python<'_>,
        keys: Option<Vec<(u64, u64)>>,
        stride: u64,
        stream: &str,
        mask: Option<Vec<bool>>,
        out: ShownArrays<'_>,
    ) -> PyResult<()> {
        let stream = crate::stream(stream)?;
        let mut shown = Shown::of(&self.spec, self.count, &out)?;
        let rows = shown.rows(&self.spec, self.count)?;
        py.detach(|| {
            for (b, (seat, mut row)) in self.seats().iter_mut().zip(rows).enumerate() {
                if mask.as_ref().is_some_and(|mask| !mask[b]) {
                    continue;
                }
                match &keys {
                    Some(keys) => {
                        let (seed, episode) = keys[b];
                        seat.stride = stride;
                        seat.begin(EpisodeKey::new(seed, stream, episode), &mut row);
                    }
                    None => seat.begin_next(&mut row),
                }
            }
        });
        Ok(())
    }

    /// Plays one step in every world. If an action is not available, none has moved.
    fn step(
        &self,
        py: Python<'_>,
        actions: &Bound<'_, PyAny>,
        out: ShownArrays<'_>,
        outcome: [Bound<'_, PyAny>; 4],
        last: Option<ShownArrays<'_>>,
    ) -> PyResult<()> {
        let (b, n, s) = (self.count, self.spec.agents, self.spec.statistics.len());
        let actions: Read<'_, i64> = read("actions", actions, &[b, n])?;
        let actions_bn = actions.as_slice()?;
        let mut shown = Shown::of(&self.spec, b, &out)?;
        let rows = shown.rows(&self.spec, b)?;
        let mut last = match last {
            Some(last) => Some(Shown::of(&self.spec, b, &last)?),
            None => None,
        };
        let last_rows = match &mut last {
            Some(last) => last.rows(&self.spec, b)?,
            None => Vec::new(),
        };
        let [rewards, terminated, truncated, statistics] = &outcome;
        let mut rewards: Written<'_, f32> = written("rewards", rewards, &[b])?;
        let mut terminated: Written<'_, bool> = written("terminated", terminated, &[b])?;
        let mut truncated: Written<'_, bool> = written("truncated", truncated, &[b])?;
        let mut statistics: Written<'_, f64> = written("statistics", statistics, &[b, s])?;
        let places = (rewards.as_slice_mut()?.iter_mut())
            .zip(terminated.as_slice_mut()?)
            .zip(truncated.as_slice_mut()?);
        let statistics_bs = parts_mut(statistics.as_slice_mut()?, s, b);
        let autoreset = self.autoreset;
        // Iterators over slices may leave this thread; those that own a `Bound` may not.
        let places: Vec<_> = places.zip(statistics_bs).collect();
        let failed = py.detach(|| -> Result<Option<(usize, StepError)>, (usize, Refused)> {
            let mut seats = self.seats();
            for (world, seat) in seats.iter_mut().enumerate() {
                if seat.end.is_none() {
                    let action_n = &actions_bn[world * n..(world + 1) * n];
                    seat.take(action_n).map_err(|refused| (world, refused))?;
                }
            }
            let mut last_rows = last_rows.into_iter();
            let jobs = seats.iter_mut().zip(rows).zip(places);
            let mut jobs: Vec<Job<'_>> = jobs
                .map(
                    |((seat, row), (((reward, terminated), truncated), statistics_s))| Job {
                        seat,
                        row,
                        last: last_rows.next(),
                        reward,
                        terminated,
                        truncated,
                        statistics_s,
                        outcome: Ok(()),
                    },
                )
                .collect();
            on_threads(self.threads, &mut jobs, |job| job.run(autoreset));
            let outcomes = jobs.into_iter().map(|job| job.outcome).enumerate();
            let mut failed = outcomes.filter_map(|(world, outcome)| Some((world, outcome.err()?)));
            Ok(failed.next())
        });
        match failed {
            Ok(None) => Ok(()),
            Ok(Some((world, error))) => Err(world_failed(format!("world {world}: {error}"))),
            Err((world, refused)) => Err(refused.into_exception(world, self.spec.actions)),
        }
    }

    /// Writes a random available action for every agent, a function of the episode and the step.
    fn random_actions(&self, py: Python<'_>, actions: &Bound<'_, PyAny>) -> PyResult<()> {
        let n = self.spec.agents;
        let mut actions: Written<'_, i64> = written("actions", actions, &[self.count, n])?;
        let actions_bn = actions.as_slice_mut()?;
        py.detach(|| {
            for (seat, action_n) in self.seats().iter().zip(actions_bn.chunks_mut(n)) {
                let step = seat.steps();
                let masks = seat.available_na.chunks(self.spec.actions);
                for (agent, (action, mask)) in action_n.iter_mut().zip(masks).enumerate() {
                    let uniform = seat.key.uniform(step, Draw::Agent(agent));
                    let chosen = random_action(mask, uniform).index();
                    *action = i64::try_from(chosen).expect("actions are few");
                }
            }
        });
        Ok(())
    }

    /// Which episode each world plays: (seed, number, steps so far).
    fn episodes(&self, py: Python<'_>) -> Vec<(u64, u64, usize)> {
        py.detach(|| {
            let seats = self.seats();
            let episode = |seat: &Seat| (seat.key.seed, seat.key.episode, seat.steps());
            seats.iter().map(episode).collect()
        })
    }

    /// Where all worlds stand.
    fn save<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let text = py.detach(|| {
            let seats = self.seats();
            let kept = seats.iter().map(|seat| Kept {
                key: seat.key,
                stride: seat.stride,
                played: seat.played.clone(),
            });
            crate::json(&kept.collect::<Vec<_>>())
        });
        PyBytes::new(py, text.as_bytes())
    }

    /// Brings all worlds to where `kept` says, by playing it again.
    fn load(&self, py: Python<'_>, kept: &[u8], out: ShownArrays<'_>) -> PyResult<()> {
        let wrong = |what: String| PyValueError::new_err(format!("state of worlds: {what}"));
        let kept: Vec<Kept> =
            serde_json::from_slice(kept).map_err(|error| wrong(error.to_string()))?;
        if kept.len() != self.count {
            let (found, expected) = (kept.len(), self.count);
            return Err(wrong(format!("of {found} worlds, expected {expected}")));
        }
        let mut shown = Shown::of(&self.spec, self.count, &out)?;
        let rows = shown.rows(&self.spec, self.count)?;
        let played = py.detach(|| -> Result<(), StepError> {
            for ((seat, mut row), kept) in self.seats().iter_mut().zip(rows).zip(kept) {
                seat.stride = kept.stride;
                seat.begin(kept.key, &mut row);
                for action_n in kept.played.chunks_exact(self.spec.agents) {
                    if action_n
                        .iter()
                        .any(|action| action.index() >= self.spec.actions)
                    {
                        let (agent, action) = (AgentId::new(0), action_n[0]);
                        return Err(IllegalAction { agent, action }.into());
                    }
                    seat.action_n.copy_from_slice(action_n);
                    seat.play(&mut row)?;
                }
            }
            Ok(())
        });
        played.map_err(|error| wrong(error.to_string()))
    }

    /// Which actions of `agent` are surely available to somebody who knows only `known` \[M\] of `entities` \[M, F\].
    fn available(
        &self,
        entities: &Bound<'_, PyAny>,
        known: &Bound<'_, PyAny>,
        agent: usize,
    ) -> PyResult<Vec<bool>> {
        let (m, f) = (self.spec.entities, self.spec.entity_features);
        let entities: Read<'_, f32> = read("entities", entities, &[m, f])?;
        let known: Read<'_, bool> = read("known", known, &[m])?;
        let known = crate::set(known.as_slice()?);
        let agent = self.agent(agent)?;
        let mut available = vec![false; self.spec.actions];
        let known = KnownEntities::new(known, entities.as_slice()?, f);
        self.prior.available(known, agent, &mut available);
        Ok(available)
    }

    /// Whether agent `observer` sees `entity`, both given by their features \[F\].
    fn sees(
        &self,
        observer: usize,
        observer_features: &Bound<'_, PyAny>,
        entity: usize,
        entity_features: &Bound<'_, PyAny>,
    ) -> PyResult<bool> {
        let f = self.spec.entity_features;
        let own: Read<'_, f32> = read("observer_features", observer_features, &[f])?;
        let its: Read<'_, f32> = read("entity_features", entity_features, &[f])?;
        let observer = self.agent(observer)?;
        if entity >= self.spec.entities {
            let most = self.spec.entities - 1;
            let problem = format!("entity is {entity}, expected an integer in [0, {most}]");
            return Err(PyValueError::new_err(problem));
        }
        let (own, its) = (own.as_slice()?, its.as_slice()?);
        Ok(self.prior.sees(observer, own, EntityId::new(entity), its))
    }
}

impl Worlds {
    fn agent(&self, agent: usize) -> PyResult<AgentId> {
        crate::agent(agent, &self.spec)
    }
}

/// Does `work` for every job, on so many threads; each thread does neighbouring ones.
fn on_threads<T: Send>(threads: usize, jobs: &mut [T], work: impl Fn(&mut T) + Sync) {
    if threads == 1 || jobs.len() < 2 {
        return jobs.iter_mut().for_each(work);
    }
    let work = &work;
    let mut shares = jobs.chunks_mut(jobs.len().div_ceil(threads));
    let own = shares.next();
    thread::scope(|scope| {
        for share in shares {
            scope.spawn(move || share.iter_mut().for_each(work));
        }
        own.into_iter().flatten().for_each(work);
    });
}

/// What a skirmish shows: SMAC's bits for shields of allies and enemies, and for types; the greatest return before scaling.
#[pyfunction]
pub(crate) fn skirmish_layout(layers: &Layers) -> PyResult<(usize, usize, usize, f32)> {
    let skirmish = layers.environment()?.skirmish().map_err(learning)?;
    let layout = skirmish.layout();
    let bits = (layout.ally_shields, layout.enemy_shields, layout.type_bits);
    Ok((bits.0, bits.1, bits.2, skirmish.max_reward()))
}
