//! Policies that are written, not learnt: a measure for the learnt ones and a check of the game's balance.
//!
//! Each agent decides from its own local view, its own past and what everybody knows before the game (the map, the unit
//! types, where the enemy starts), so the results bound what decentralised agents can do without learning.

mod sight;
mod walk;

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, Draw, Environment, EnvironmentSpec, EpisodeKey, LocalView, Observations,
    PriorKnowledge,
};
use serde::{Deserialize, Serialize};
use sight::{Foe, Sight};

use crate::{
    Scenario, Skirmish,
    actions::{NO_OPERATION, STOP},
    scenario::EnemyOrder,
};

/// Map units between an ally and an enemy within which they are taken to be fighting.
const ENGAGED: f32 = 6.0;
/// Map units to an enemy below which one that backs off does not stop to shoot.
const RESPITE: f32 = 3.0;
/// Map units to a friend beyond which a healer with nobody to heal follows it.
const ESCORT: f32 = 3.0;
/// Map units from a place that count as having been there.
const ARRIVED: f32 = 2.5;

/// How a scripted team plays. Healers, which have no weapon, heal the friend in range that has lost the greatest share of its
/// life and otherwise follow the nearest one, whatever the script of the others, unless that is `Random` or `Idle`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScriptedPolicy {
    /// Any available action, all equally likely.
    Random,
    /// Stands; never shoots.
    Idle,
    /// Shoots at the nearest enemy in range. Without one it walks to the nearest in sight, and without any in sight to where
    /// enemies are likely. Against an enemy that comes by itself it first waits, until an ally is fighting or a quarter of the
    /// episode is over: whoever walks into the enemy's fire first loses a volley.
    Nearest,
    /// As `Nearest`, but shoots at the enemy in range with the least life and shields; all agents prefer the same one of
    /// equals.
    FocusFire,
    /// As `Nearest`, but while its weapon reloads or enemies are close it backs off from those that shoot less far than
    /// itself.
    Kite,
}

impl ScriptedPolicy {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Random,
        Self::Idle,
        Self::Nearest,
        Self::FocusFire,
        Self::Kite,
    ];

    /// The name that users type.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Idle => "idle",
            Self::Nearest => "nearest",
            Self::FocusFire => "focus-fire",
            Self::Kite => "kite",
        }
    }
}

/// A scripted team on one map, with what each of its agents remembers of the episode.
#[derive(Debug, Clone)]
pub struct ScriptedTeam {
    policy: ScriptedPolicy,
    spec: EnvironmentSpec,
    prior: Arc<dyn PriorKnowledge>,
    scenario: Arc<Scenario>,
    /// Game loops in a step.
    step_loops: f32,
    /// Where enemies are looked for, one place after the other.
    haunts: Vec<[f32; 2]>,
    memories: Vec<Memory>,
}

/// What an agent remembers.
#[derive(Debug, Clone, Copy, Default)]
struct Memory {
    /// Which of the haunts it goes to next.
    haunt: usize,
    /// Step from which its weapon is ready again.
    ready_at: usize,
}

impl ScriptedTeam {
    /// A team that plays `skirmish` by `policy`.
    #[must_use]
    pub fn new(policy: ScriptedPolicy, skirmish: &Skirmish) -> Self {
        let scenario = skirmish.scenario();
        Self {
            policy,
            spec: skirmish.spec().clone(),
            prior: skirmish.prior_knowledge(),
            step_loops: f32::from(skirmish.settings().step_mul),
            haunts: haunts(scenario),
            memories: vec![Memory::default(); scenario.agents],
            scenario: Arc::new(scenario.clone()),
        }
    }

    /// Writes the actions \[N\] of all agents of environment `b` at `step` of the episode `key`; step 0 begins a new episode.
    pub fn act(
        &mut self,
        observations: &Observations,
        b: usize,
        (key, step): (EpisodeKey, usize),
        actions_n: &mut [Action],
    ) {
        if step == 0 {
            self.memories.fill(Memory::default());
        }
        for (agent, action) in actions_n.iter_mut().enumerate() {
            let view = observations.local_view(b, AgentId::new(agent));
            let uniform = key.uniform(step, Draw::Agent(agent));
            *action = Action::new(self.choose(view, uniform, step));
        }
    }

    fn choose(&mut self, view: LocalView<'_>, uniform: f64, step: usize) -> usize {
        let available = view.available();
        if available[NO_OPERATION] {
            return NO_OPERATION;
        }
        let sight = Sight::new(view, self.prior.as_ref(), &self.scenario);
        match self.policy {
            ScriptedPolicy::Idle => STOP,
            ScriptedPolicy::Random => nth_available(available, uniform),
            _ if sight.is_healer => self.heal(&sight),
            ScriptedPolicy::Nearest => self.attack(&sight, step, |foe| foe.distance_squared),
            ScriptedPolicy::FocusFire => self.attack(&sight, step, |foe| foe.strength),
            ScriptedPolicy::Kite => self.kite(&sight, step),
        }
    }

    /// Attacks the enemy in range that scores least, or goes where enemies are.
    fn attack(&mut self, sight: &Sight<'_>, step: usize, score: impl Fn(&Foe) -> f32) -> usize {
        match sight.best_target(score) {
            Some(foe) => foe.action,
            None => self.approach(sight, step).unwrap_or(STOP),
        }
    }

    /// Heals the friend in range that needs it most, or stays with the others.
    fn heal(&self, sight: &Sight<'_>) -> usize {
        let follow = || {
            let friend = sight.nearest_patient()?;
            let is_far = friend.distance_squared > ESCORT * ESCORT;
            is_far.then(|| walk::towards(sight, self.way(sight, friend.at)))?
        };
        match sight.neediest_patient() {
            Some(friend) => friend.action,
            None => follow().unwrap_or(STOP),
        }
    }

    /// Shoots when the weapon is ready and steps back while it is not.
    fn kite(&mut self, sight: &Sight<'_>, step: usize) -> usize {
        let agent = sight.agent;
        let own = &self.scenario.field.profiles[sight.own_kind];
        let Some(strike) = own.strike.as_ref() else {
            return self.attack(sight, step, |foe| foe.distance_squared);
        };
        let outranges = |foe: &Foe| {
            let other = &self.scenario.field.profiles[foe.kind];
            let reach = other.strike.as_ref().map_or(0.0, |strike| strike.range);
            !other.is_immobile() && strike.range > reach + 0.5
        };
        let is_pressed = sight
            .foes
            .iter()
            .any(|foe| foe.distance_squared < RESPITE * RESPITE && outranges(foe));
        let terrain = &self.scenario.field.terrain;
        if (is_pressed || step < self.memories[agent].ready_at)
            && let Some(action) = walk::back_off(sight, terrain, outranges)
        {
            return action;
        }
        if let Some(foe) = sight.best_target(|foe| foe.distance_squared) {
            let target = &self.scenario.field.profiles[foe.kind];
            let action = foe.action;
            if foe.distance_squared <= strike.reach_squared(own, target) {
                self.memories[agent].ready_at = step + steps(strike.period / self.step_loops);
            }
            return action;
        }
        self.approach(sight, step).unwrap_or(STOP)
    }

    /// A move towards enemies: those in sight, else where they are likely to be. The patient wait for them to come.
    fn approach(&mut self, sight: &Sight<'_>, step: usize) -> Option<usize> {
        let comes = !matches!(self.scenario.enemy_order, EnemyOrder::None);
        let is_patient = comes && step < self.spec.episode_limit / 4;
        if is_patient && !sight.is_an_ally_within(ENGAGED) {
            return None;
        }
        let goal = match sight.nearest() {
            Some(foe) => foe.at,
            None => self.next_haunt(sight)?,
        };
        walk::towards(sight, self.way(sight, goal))
    }

    /// Where an agent heads next on its way to `goal`, over cliffs and walls if it can.
    fn way(&self, sight: &Sight<'_>, goal: [f32; 2]) -> [f32; 2] {
        let field = &self.scenario.field;
        let own = &field.profiles[sight.own_kind];
        let terrain = field.terrain.for_layer(own.layer);
        terrain.map_or(goal, |terrain| {
            terrain.waypoint(sight.own, goal, own.inner_radius)
        })
    }

    /// The place where the agent looks for enemies; after it has been there, the next.
    fn next_haunt(&mut self, sight: &Sight<'_>) -> Option<[f32; 2]> {
        let memory = &mut self.memories[sight.agent];
        let count = self.haunts.len().max(1);
        let place = self.haunts.get(memory.haunt % count)?;
        if walk::distance_squared(sight.own, *place) <= ARRIVED * ARRIVED {
            memory.haunt += 1;
        }
        self.haunts.get(memory.haunt % count).copied()
    }
}

/// Where enemies are likely to be: where they start, where they are sent, and where the team itself started.
fn haunts(scenario: &Scenario) -> Vec<[f32; 2]> {
    let (agents, enemies) = scenario.recruits.split_at(scenario.agents);
    let nearest_to_middle = |recruits: &[crate::scenario::Recruit], middle: [f32; 2]| {
        let distance = |at| walk::distance_squared(at, middle);
        recruits
            .iter()
            .map(|recruit| recruit.at)
            .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
    };
    let ordered = match scenario.enemy_order {
        EnemyOrder::AttackMove(to) => vec![to],
        EnemyOrder::AttackMoveBetween(ends) => ends.to_vec(),
        EnemyOrder::None | EnemyOrder::Hunt => Vec::new(),
    };
    let start = nearest_to_middle(enemies, scenario.enemy_centre);
    let home = agents.first().map(|recruit| recruit.at);
    start.into_iter().chain(ordered).chain(home).collect()
}

/// The `uniform`-th part of the available actions, with `uniform` in [0, 1).
fn nth_available(available: &[bool], uniform: f64) -> usize {
    let actions = || (0..available.len()).filter(|&action| available[action]);
    let mut left = uniform * actions().count() as f64;
    let mut last = NO_OPERATION;
    for action in actions() {
        last = action;
        left -= 1.0;
        if left < 0.0 {
            break;
        }
    }
    last
}

/// Whole steps until a weapon with a period of `periods` steps is ready; a twentieth of a step early does not matter.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to small positive numbers"
)]
fn steps(periods: f32) -> usize {
    (periods - 0.05).ceil().clamp(1.0, 1e6) as usize
}

#[cfg(test)]
mod tests;
