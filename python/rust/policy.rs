//! Trained teams: one agent alone, the whole team, and the probabilities of all levels.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use mackrl::{
    Error,
    algorithms::Algorithm,
    experience::Experience,
    policy::{
        Actor, Behaviour, Executor, Parameters, Part, PolicyTable, Recording, Situation, TEAM,
    },
};
use mackrl_env::{Action, EnvironmentSpec, EpisodeKey, KnownEntities, LocalView, Observations};
use mackrl_run::{
    run_folder::Run,
    training::assembly::{RunWorld, trained},
};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*, sync::MutexExt, types::PyBytes};

use crate::{
    arrays::{Read, read},
    errors::{IntoException, learning},
};

/// A team that was trained.
#[pyclass(module = "mackrl._native", frozen)]
pub(crate) struct Team {
    algorithm: Mutex<Box<dyn Algorithm>>,
    parameters: Arc<Parameters>,
    spec: EnvironmentSpec,
    run: Run,
}

/// Waits for a lock without keeping the interpreter from its holder, whose world may be Python's.
fn locked<'a, T>(py: Python<'_>, mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    mutex
        .lock_py_attached(py)
        .unwrap_or_else(PoisonError::into_inner)
}

/// How a team plays: which episode, and how choices are made.
fn behaviour(exploration: Option<f64>) -> PyResult<Behaviour> {
    match exploration {
        None => Ok(Behaviour::GREEDY),
        Some(epsilon) if (0.0..=1.0).contains(&epsilon) => Ok(Behaviour::sampled(epsilon)),
        Some(epsilon) => {
            let problem = format!("exploration is {epsilon}, expected a number in [0, 1]");
            Err(PyValueError::new_err(problem))
        }
    }
}

#[pymethods]
impl Team {
    #[new]
    fn new(path: PathBuf, checkpoint: &str) -> PyResult<Self> {
        let which = crate::runs::which(checkpoint)?;
        let run = Run::open(&path, which).map_err(IntoException::into_exception)?;
        let world = RunWorld::new(&run.config).map_err(learning)?;
        let algorithm = trained(&run.config, &world, &run.weights).map_err(learning)?;
        Ok(Self {
            parameters: Arc::new(algorithm.parameters().clone()),
            algorithm: Mutex::new(algorithm),
            spec: world.spec().clone(),
            run,
        })
    }

    /// Sizes of its world, as JSON.
    fn spec(&self) -> String {
        crate::json(&self.spec)
    }

    /// The configuration of its run, as JSON.
    fn config(&self) -> String {
        crate::json(&self.run.config)
    }

    /// Its file of weights.
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.run.weights)
    }

    /// One agent alone in the episode (seed, number).
    fn agent(
        &self,
        agent: usize,
        key: (u64, u64),
        stream: &str,
        exploration: Option<f64>,
    ) -> PyResult<Agent> {
        let id = crate::agent(agent, &self.spec)?;
        let algorithm = self.algorithm.lock();
        let algorithm = algorithm.unwrap_or_else(PoisonError::into_inner);
        let mut executor = algorithm.policy().executor(id);
        executor.begin();
        Ok(Agent {
            parameters: Arc::clone(&self.parameters),
            spec: self.spec.clone(),
            agent,
            key: EpisodeKey::new(key.0, crate::stream(stream)?, key.1),
            behaviour: behaviour(exploration)?,
            acting: Mutex::new((executor, 0)),
        })
    }

    /// The whole team in the episodes `keys`, one for each world.
    fn play(
        &self,
        keys: Vec<(u64, u64)>,
        stream: &str,
        exploration: Option<f64>,
    ) -> PyResult<Play> {
        let stream = crate::stream(stream)?;
        let algorithm = self.algorithm.lock();
        let algorithm = algorithm.unwrap_or_else(PoisonError::into_inner);
        let mut actor = algorithm.policy().actor(keys.len());
        let mut experience = Experience::default();
        actor.begin(Recording::Off, &mut experience);
        let key = |&(seed, episode): &(u64, u64)| EpisodeKey::new(seed, stream, episode);
        Ok(Play {
            parameters: Arc::clone(&self.parameters),
            spec: self.spec.clone(),
            behaviour: behaviour(exploration)?,
            acting: Mutex::new(Acting {
                actor,
                experience,
                observations: Observations::new(&self.spec, keys.len()),
                actions_bn: vec![Action::default(); keys.len() * self.spec.agents],
                playing: (0..keys.len()).collect(),
                keys: keys.iter().map(key).collect(),
                steps: 0,
            }),
        })
    }
}

/// One agent, with the weights, the shared seed and its own views.
#[pyclass(module = "mackrl._native", frozen)]
pub(crate) struct Agent {
    parameters: Arc<Parameters>,
    spec: EnvironmentSpec,
    agent: usize,
    key: EpisodeKey,
    behaviour: Behaviour,
    acting: Mutex<(Box<dyn Executor>, usize)>,
}

#[pymethods]
impl Agent {
    /// Its action at the next step, from its own view: observation \[O\], available actions \[A\], whom it sees \[M\] of
    /// `entities` \[M, F\].
    fn act(
        &self,
        py: Python<'_>,
        observation: &Bound<'_, PyAny>,
        avail_actions: &Bound<'_, PyAny>,
        visible: &Bound<'_, PyAny>,
        entities: &Bound<'_, PyAny>,
    ) -> PyResult<usize> {
        let EnvironmentSpec {
            entities: m,
            entity_features: f,
            actions,
            observation_size,
            ..
        } = self.spec;
        let observation: Read<'_, f32> = read("observation", observation, &[observation_size])?;
        let available: Read<'_, bool> = read("avail_actions", avail_actions, &[actions])?;
        let visible: Read<'_, bool> = read("visible", visible, &[m])?;
        let entities: Read<'_, f32> = read("entities", entities, &[m, f])?;
        let seen = KnownEntities::new(crate::set(visible.as_slice()?), entities.as_slice()?, f);
        let agent = crate::agent(self.agent, &self.spec)?;
        let view = LocalView::new(agent, seen, observation.as_slice()?, available.as_slice()?);
        Ok(py.detach(|| {
            let mut acting = self.acting.lock().unwrap_or_else(PoisonError::into_inner);
            let (executor, step) = &mut *acting;
            let key = &self.key;
            let action = executor.act(&self.parameters, view, key, *step, self.behaviour);
            *step += 1;
            action.index()
        }))
    }

    /// What its controllers read at the latest step: name, members, numbers.
    fn inputs<'py>(&self, py: Python<'py>) -> Vec<(String, Vec<usize>, Bound<'py, PyArray1<f32>>)> {
        let acting = locked(py, &self.acting);
        let inputs = acting.0.controller_inputs().into_iter();
        inputs
            .map(|input| {
                let members = input.controller.agents.iter();
                (
                    input.controller.name.into_owned(),
                    members.map(|agent| agent.index()).collect(),
                    PyArray1::from_vec(py, input.values),
                )
            })
            .collect()
    }
}

/// Members of each group.
type Groups = Vec<Vec<usize>>;
/// A level's name, its groups \[G\]\[members\] and the probabilities of their choices \[G, C\].
type LevelTable<'py> = (String, Groups, Bound<'py, PyArray2<f32>>);

/// The whole team at work in a few worlds.
#[pyclass(module = "mackrl._native", frozen)]
pub(crate) struct Play {
    parameters: Arc<Parameters>,
    spec: EnvironmentSpec,
    behaviour: Behaviour,
    acting: Mutex<Acting>,
}

struct Acting {
    actor: Box<dyn Actor>,
    experience: Experience,
    observations: Observations,
    actions_bn: Vec<Action>,
    /// Worlds whose episode goes on, ascending.
    playing: Vec<usize>,
    keys: Vec<EpisodeKey>,
    /// Steps so far.
    steps: usize,
}

impl Acting {
    const fn situation<'a>(
        (playing, keys): (&'a [usize], &'a [EpisodeKey]),
        observations: &'a Observations,
        (step, behaviour): (usize, Behaviour),
    ) -> Situation<'a> {
        Situation {
            step,
            playing,
            keys,
            observations,
            behaviour,
        }
    }

    fn act(&mut self, parameters: &Parameters, behaviour: Behaviour) -> Result<(), Error> {
        let situation = Self::situation(
            (&self.playing, &self.keys),
            &self.observations,
            (self.steps, behaviour),
        );
        self.actor.act(
            parameters,
            situation,
            &mut self.experience,
            &mut self.actions_bn,
        )?;
        self.steps += 1;
        Ok(())
    }
}

#[pymethods]
impl Play {
    /// Everybody's actions \[B, N\] at the next step. Worlds where `playing` is false have left and do not come back.
    fn act<'py>(
        &self,
        py: Python<'py>,
        out: [Bound<'py, PyAny>; 5],
        playing: Option<Vec<bool>>,
    ) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let EnvironmentSpec {
            agents: n,
            entities: m,
            entity_features: f,
            actions: a,
            observation_size: o,
            state_size: g,
            ..
        } = self.spec;
        let [observations, state, available, visible, entities] = &out;
        let mut acting = locked(py, &self.acting);
        let b = acting.keys.len();
        let observations: Read<'_, f32> = read("observations", observations, &[b, n, o])?;
        let state: Read<'_, f32> = read("state", state, &[b, g])?;
        let available: Read<'_, bool> = read("avail_actions", available, &[b, n, a])?;
        let visible: Read<'_, bool> = read("visible", visible, &[b, n, m])?;
        let entities: Read<'_, f32> = read("entities", entities, &[b, m, f])?;
        let (observations, state) = (observations.as_slice()?, state.as_slice()?);
        let (available, visible) = (available.as_slice()?, visible.as_slice()?);
        let entities = entities.as_slice()?;
        let part = |world: usize, size: usize| world * size..(world + 1) * size;
        for world in 0..b {
            let row = acting.observations.row_mut(world);
            row.observation_no
                .copy_from_slice(&observations[part(world, n * o)]);
            row.state_g.copy_from_slice(&state[part(world, g)]);
            row.available_na
                .copy_from_slice(&available[part(world, n * a)]);
            row.entity_mf.copy_from_slice(&entities[part(world, m * f)]);
            let visible = visible[part(world, n * m)].chunks(m);
            for (set, visible_m) in row.visible_n.iter_mut().zip(visible) {
                *set = crate::set(visible_m);
            }
        }
        if let Some(playing) = playing {
            if playing.len() != b {
                let problem = format!("playing has {} entries, expected {b}", playing.len());
                return Err(PyValueError::new_err(problem));
            }
            acting.playing.retain(|&world| playing[world]);
        }
        let at_work = &mut *acting;
        let acted = py.detach(|| at_work.act(&self.parameters, self.behaviour));
        acted.map_err(learning)?;
        let actions = acting.actions_bn.iter().map(|action| action.index());
        let actions = actions.map(|action| i64::try_from(action).expect("actions are few"));
        let actions: Vec<i64> = actions.collect();
        PyArray1::from_vec(py, actions).reshape([b, n])
    }

    /// The probabilities of all levels in world `b` at the latest step: the partitions in force, and the table of each level.
    /// Rows of groups that nothing in force leads to are NaN.
    fn tables<'py>(
        &self,
        py: Python<'py>,
        b: usize,
    ) -> PyResult<(Vec<Groups>, Vec<LevelTable<'py>>)> {
        let mut acting = locked(py, &self.acting);
        let Acting {
            actor,
            observations,
            playing,
            keys,
            steps,
            ..
        } = &mut *acting;
        if *steps == 0 || !playing.contains(&b) {
            let problem =
                format!("world {b} has no table: the team has not acted in it at this step");
            return Err(PyValueError::new_err(problem));
        }
        let situation =
            Acting::situation((playing, keys), observations, (*steps - 1, self.behaviour));
        let table = actor.table(b, situation).ok_or_else(|| {
            PyValueError::new_err("this algorithm has no hierarchy, and no tables of it")
        })?;
        let levels = levels(&table);
        let members = |part: Part| {
            let members = table.declaration().members(part).iter();
            members.map(|agent| agent.index()).collect()
        };
        let divisions = table.in_force().iter();
        let in_force = divisions
            .map(|division| division.parts.iter().copied().map(members).collect())
            .collect();
        let levels = levels.into_iter().map(|(name, groups, columns, rows)| {
            let count = groups.len();
            Ok((
                name,
                groups,
                PyArray1::from_vec(py, rows).reshape([count, columns])?,
            ))
        });
        Ok((in_force, levels.collect::<PyResult<_>>()?))
    }
}

/// Name, groups, columns and probabilities of each level.
fn levels(table: &PolicyTable<'_, f32>) -> Vec<(String, Groups, usize, Vec<f32>)> {
    let declaration = table.declaration();
    let mut reached = vec![Part {
        level: TEAM,
        group: 0,
    }];
    let mut next = 0;
    while let Some(&part) = reached.get(next) {
        for division in table.divisions(part) {
            for &part in &division.parts {
                if !reached.contains(&part) {
                    reached.push(part);
                }
            }
        }
        next += 1;
    }
    let levels = declaration.levels().iter().enumerate();
    levels
        .map(|(place, level)| {
            let groups = level.groups.iter();
            let groups = groups.map(|group| group.iter().map(|agent| agent.index()).collect());
            let rows: Vec<Vec<f32>> = (0..level.groups.len())
                .map(|group| {
                    let part = Part {
                        level: place,
                        group,
                    };
                    let row = table.row(part).iter();
                    if reached.contains(&part) {
                        row.map(|log_p| log_p.exp()).collect()
                    } else {
                        vec![f32::NAN; row.len()]
                    }
                })
                .collect();
            let columns = rows.first().map_or(0, Vec::len);
            (
                level.name.to_owned(),
                groups.collect(),
                columns,
                rows.concat(),
            )
        })
        .collect()
}
