//! Policies that are written, not learnt: a measure for the learnt ones and a check of the game's balance.
//!
//! Each decides from the local views alone, so its results bound what decentralised agents can do without learning.

use serde::{Deserialize, Serialize};

use crate::{
    Action, AgentId, Draw, EntityId, EnvironmentSpec, EpisodeKey, LocalView, Observations,
    PriorKnowledge,
};

/// First features of an entity: position and life.
const LIFE: usize = 2;
/// Map units between an ally and an enemy within which they are taken to be fighting.
const ENGAGED: f32 = 6.0;

/// How a scripted team plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScriptedPolicy {
    /// Any available action, all equally likely.
    Random,
    /// Stands; never shoots.
    Idle,
    /// Shoots at the nearest enemy in range. Without one it stands until an ally in sight has one, or a quarter of the
    /// episode is over, and then walks towards the nearest enemy in sight: whoever walks into the enemy's fire first loses a
    /// volley.
    Nearest,
    /// As `Nearest`, but shoots at the weakest enemy in range; all agents prefer the same one of equals.
    FocusFire,
}

impl ScriptedPolicy {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Random, Self::Idle, Self::Nearest, Self::FocusFire];

    /// Writes the actions \[N\] of all agents of environment `b` at `step` of the episode `key`.
    pub fn act(
        self,
        spec: &EnvironmentSpec,
        prior: &dyn PriorKnowledge,
        observations: &Observations,
        b: usize,
        (key, step): (EpisodeKey, usize),
        actions_n: &mut [Action],
    ) {
        for (agent, action) in actions_n.iter_mut().enumerate() {
            let view = observations.local_view(b, AgentId::new(agent));
            let uniform = key.uniform(step, Draw::Agent(agent));
            let is_patient = step < spec.episode_limit / 4;
            *action = Action::new(self.choose(prior, view, uniform, is_patient));
        }
    }

    fn choose(
        self,
        prior: &dyn PriorKnowledge,
        view: LocalView<'_>,
        uniform: f64,
        is_patient: bool,
    ) -> usize {
        let available = view.available();
        if available[0] {
            return 0;
        }
        match self {
            Self::Idle => 1,
            Self::Random => nth_available(available, uniform),
            Self::Nearest => best_target(prior, view, |_, square| square)
                .or_else(|| approach(prior, view, is_patient))
                .unwrap_or(1),
            Self::FocusFire => best_target(prior, view, |features, _| features[LIFE])
                .or_else(|| approach(prior, view, is_patient))
                .unwrap_or(1),
        }
    }
}

fn nth_available(available: &[bool], uniform: f64) -> usize {
    let count = available
        .iter()
        .filter(|is_available| **is_available)
        .count();
    let mut left = uniform * count as f64;
    let mut last = 0;
    for (action, _) in available
        .iter()
        .enumerate()
        .filter(|(_, is_available)| **is_available)
    {
        last = action;
        left -= 1.0;
        if left < 0.0 {
            break;
        }
    }
    last
}

/// The available attack on the entity that scores least; the score is given its features and its squared distance.
fn best_target(
    prior: &dyn PriorKnowledge,
    view: LocalView<'_>,
    score: impl Fn(&[f32], f32) -> f32,
) -> Option<usize> {
    let own = view.seen().get(view.agent())?;
    let mut best = None;
    let mut least = f32::INFINITY;
    for entity in view.seen().set().iter() {
        let Some(action) = prior.action_on(entity).map(Action::index) else {
            continue;
        };
        let Some(features) = view.seen().get(entity) else {
            continue;
        };
        let found = score(features, distance_squared(own, features));
        if view.available()[action] && found < least {
            (best, least) = (Some(action), found);
        }
    }
    best
}

/// A move along the longer axis towards the nearest enemy in sight; the patient wait until an ally is close to one.
fn approach(prior: &dyn PriorKnowledge, view: LocalView<'_>, is_patient: bool) -> Option<usize> {
    let own = view.seen().get(view.agent())?;
    let is_enemy = |entity: &EntityId| prior.action_on(*entity).is_some();
    let features = |entity| view.seen().get(entity);
    let enemies = || {
        view.seen()
            .set()
            .iter()
            .filter(is_enemy)
            .filter_map(features)
    };
    let mut allies = view
        .seen()
        .set()
        .iter()
        .filter(|entity| !is_enemy(entity))
        .filter_map(features);
    let has_begun = allies
        .any(|ally| enemies().any(|enemy| distance_squared(ally, enemy) <= ENGAGED * ENGAGED));
    if is_patient && !has_begun {
        return None;
    }
    let nearest =
        enemies().min_by(|a, b| distance_squared(own, a).total_cmp(&distance_squared(own, b)))?;
    let (dx, dy) = (nearest[0] - own[0], nearest[1] - own[1]);
    let action = match (dx.abs() >= dy.abs(), dx >= 0.0, dy >= 0.0) {
        (true, true, _) => 4,
        (true, false, _) => 5,
        (false, _, true) => 2,
        (false, _, false) => 3,
    };
    view.available()[action].then_some(action)
}

fn distance_squared(a: &[f32], b: &[f32]) -> f32 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    dx * dx + dy * dy
}
