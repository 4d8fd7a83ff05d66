//! What passes between the one who certifies and an agent in another process: the agent's own local views, and its actions.

use std::io::{BufRead, Write};

use mackrl_env::{Action, AgentId, EntityId, EntitySet, EpisodeKey, KnownEntities, LocalView};
use serde::{Deserialize, Serialize};

use super::computed::{Computed, Fingerprints};
use crate::{
    Error,
    policy::{Behaviour, ControllerInput, Executor, Parameters},
};

/// What an agent is told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Request {
    /// A new episode begins.
    Begin {
        /// The key of its choices, from which shared and private draws follow; it is not the world's.
        key: EpisodeKey,
        /// How to choose.
        behaviour: Behaviour,
    },
    /// What the agent sees at a step; it answers with [`Answer::Action`].
    Look {
        /// t, from 0.
        step: usize,
        /// Its own local view.
        view: ViewMessage,
    },
    /// Asks for what the controllers read at the latest step; the agent answers with [`Answer::Inputs`].
    Explain,
}

/// What an agent says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// Its action, and fingerprints of what the controllers of its groups read and gave.
    Action {
        /// What it does.
        action: Action,
        /// A fingerprint of each controller's input.
        inputs: Fingerprints,
        /// A fingerprint of the log-probabilities of each controller that was asked.
        outputs: Fingerprints,
    },
    /// What its controllers read.
    Inputs(Vec<ControllerInput>),
}

/// A local view by value: features of the entities that are seen, and of no others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViewMessage {
    agent: AgentId,
    entities: usize,
    entity_features: usize,
    seen: Vec<(EntityId, Vec<f32>)>,
    observation_o: Vec<f32>,
    available_a: Vec<bool>,
}

/// A received view, laid out as a [`LocalView`] borrows it. Features of entities that were not sent are zero and cannot be
/// reached.
#[derive(Debug, Clone)]
pub struct ReceivedView {
    message: ViewMessage,
    set: EntitySet,
    entity_mf: Vec<f32>,
}

impl From<LocalView<'_>> for ViewMessage {
    fn from(view: LocalView<'_>) -> Self {
        let seen = view.seen();
        let features = |entity| {
            (
                entity,
                seen.get(entity).map_or_else(Vec::new, <[f32]>::to_vec),
            )
        };
        let seen_entities: Vec<_> = seen.set().iter().map(features).collect();
        Self {
            agent: view.agent(),
            entities: seen.entities(),
            entity_features: seen_entities
                .first()
                .map_or(0, |(_, features)| features.len()),
            seen: seen_entities,
            observation_o: view.observation().to_vec(),
            available_a: view.available().to_vec(),
        }
    }
}

impl ViewMessage {
    /// Lays the view out.
    ///
    /// # Errors
    /// [`Error::Data`] if its parts do not fit each other.
    pub fn receive(self) -> Result<ReceivedView, Error> {
        let features = self.entity_features;
        if self.entities > EntitySet::CAPACITY {
            return Err(Error::Data(format!(
                "a view has {} entities, expected at most {}",
                self.entities,
                EntitySet::CAPACITY
            )));
        }
        let fits = |(entity, row): &(EntityId, Vec<f32>)| {
            entity.index() < self.entities && row.len() == features
        };
        if let Some((entity, row)) = self.seen.iter().find(|entry| !fits(entry)) {
            return Err(Error::Data(format!(
                "entity {entity} has {} features, expected one of {} entities with {features}",
                row.len(),
                self.entities
            )));
        }
        let mut entity_mf = vec![0.0; self.entities * features];
        for (entity, row) in &self.seen {
            let first = entity.index() * features;
            entity_mf[first..first + features].copy_from_slice(row);
        }
        let set = self.seen.iter().map(|(entity, _)| *entity).collect();
        Ok(ReceivedView {
            message: self,
            set,
            entity_mf,
        })
    }
}

impl ReceivedView {
    /// The view.
    #[must_use]
    pub fn view(&self) -> LocalView<'_> {
        let ViewMessage {
            agent,
            entity_features,
            observation_o,
            available_a,
            ..
        } = &self.message;
        let seen = KnownEntities::new(self.set, &self.entity_mf, *entity_features);
        LocalView::new(*agent, seen, observation_o, available_a)
    }
}

/// Lives as one agent: answers the requests that arrive as lines of JSON until there are no more.
///
/// # Errors
/// [`Error::Data`] if a line cannot be read, understood or answered.
pub fn serve_agent(
    executor: &mut dyn Executor,
    parameters: &Parameters,
    requests: impl BufRead,
    mut answers: impl Write,
) -> Result<(), Error> {
    let mut episode = None;
    for line in requests.lines() {
        let line = line.map_err(|error| Error::Data(format!("cannot read a request: {error}")))?;
        let request: Request = serde_json::from_str(&line)
            .map_err(|error| Error::Data(format!("cannot understand a request: {error}")))?;
        let Some(answer) = answer(executor, parameters, &mut episode, request)? else {
            continue;
        };
        serde_json::to_writer(&mut answers, &answer)
            .map_err(std::io::Error::from)
            .and_then(|()| answers.write_all(b"\n"))
            .and_then(|()| answers.flush())
            .map_err(|error| Error::Data(format!("cannot answer: {error}")))?;
    }
    Ok(())
}

/// Acts on one request.
pub(super) fn answer(
    executor: &mut dyn Executor,
    parameters: &Parameters,
    episode: &mut Option<(EpisodeKey, Behaviour)>,
    request: Request,
) -> Result<Option<Answer>, Error> {
    match request {
        Request::Begin { key, behaviour } => {
            executor.begin();
            *episode = Some((key, behaviour));
            Ok(None)
        }
        Request::Look { step, view } => {
            let Some((key, behaviour)) = episode else {
                return Err(Error::Data(
                    "a view arrived before its episode began".into(),
                ));
            };
            let received = view.receive()?;
            let action = executor.act(parameters, received.view(), key, step, *behaviour);
            let (inputs, outputs) = (executor.controller_inputs(), executor.controller_outputs());
            let Computed {
                action,
                inputs,
                outputs,
            } = Computed::of(received.view().agent(), action, &inputs, &outputs);
            Ok(Some(Answer::Action {
                action,
                inputs,
                outputs,
            }))
        }
        Request::Explain => Ok(Some(Answer::Inputs(executor.controller_inputs()))),
    }
}
