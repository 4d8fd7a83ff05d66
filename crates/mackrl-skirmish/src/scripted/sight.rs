//! What a scripted agent makes of its local view.

use mackrl_env::{Action, EntityId, LocalView, PriorKnowledge};

use crate::{Scenario, actions::TARGETS_FROM, scripted::walk::distance_squared};

/// First features of an entity are its position; then come the shares of life and, where anybody has shields, of shields.
const LIFE: usize = 2;
const SHIELD: usize = 3;

/// An agent's local view, read.
#[derive(Debug)]
pub(super) struct Sight<'a> {
    /// Index of the agent.
    pub(super) agent: usize,
    /// Where it stands.
    pub(super) own: [f32; 2],
    /// Its type among the battlefield's profiles.
    pub(super) own_kind: usize,
    /// Its available actions \[A\].
    pub(super) available: &'a [bool],
    /// Enemies in sight, in the order of entities.
    pub(super) foes: Vec<Foe>,
    /// Whether it heals friends instead of shooting at enemies.
    pub(super) is_healer: bool,
    /// Where the allies in sight stand, without the agent itself.
    allies: Vec<[f32; 2]>,
    /// For a healer: the friends in sight that it may be told to heal, in the order of entities.
    patients: Vec<Patient>,
}

/// A friend in sight of a healer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patient {
    /// Where it stands.
    pub(super) at: [f32; 2],
    /// Its life over its full life.
    life: f32,
    /// From the healer, between centres.
    pub(super) distance_squared: f32,
    /// The action that heals it.
    pub(super) action: usize,
}

/// An enemy in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foe {
    /// Where it stands.
    pub(super) at: [f32; 2],
    /// Its type among the battlefield's profiles.
    pub(super) kind: usize,
    /// Its life and shield points.
    pub(super) strength: f32,
    /// From the agent, between centres.
    pub(super) distance_squared: f32,
    /// The action that attacks it.
    pub(super) action: usize,
}

impl<'a> Sight<'a> {
    /// Reads a living agent's view.
    pub(super) fn new(
        view: LocalView<'a>,
        prior: &dyn PriorKnowledge,
        scenario: &Scenario,
    ) -> Self {
        let agent = view.agent().index();
        let seen = view.seen();
        let at = |entity: EntityId| seen.get(entity).map(|f| [f[0], f[1]]);
        let own = at(view.agent().into()).unwrap_or_default();
        let is_enemy = |entity: &EntityId| entity.index() >= scenario.agents;
        let foes = seen.set().iter().filter(is_enemy).filter_map(|entity| {
            let features = seen.get(entity)?;
            let at = [features[0], features[1]];
            Some(Foe {
                at,
                kind: usize::from(scenario.recruits[entity.index()].kind),
                strength: strength(scenario, entity, features),
                distance_squared: distance_squared(own, at),
                action: prior.action_on(entity).map(Action::index)?,
            })
        });
        let own_kind = usize::from(scenario.recruits[agent].kind);
        let is_healer = scenario.field.profiles[own_kind].care.is_some();
        let is_other_ally = |entity: &EntityId| !is_enemy(entity) && entity.index() != agent;
        let others = || seen.set().iter().filter(is_other_ally);
        let patients = others().filter(|_| is_healer).filter_map(|entity| {
            let features = seen.get(entity)?;
            let at = [features[0], features[1]];
            Some(Patient {
                at,
                life: features[LIFE],
                distance_squared: distance_squared(own, at),
                action: heal_action(scenario, entity)?,
            })
        });
        Self {
            agent,
            own,
            own_kind,
            is_healer,
            available: view.available(),
            foes: foes.collect(),
            allies: others().filter_map(at).collect(),
            patients: patients.collect(),
        }
    }

    /// The enemy that may be attacked now and scores least; the first of equals.
    pub(super) fn best_target(&self, score: impl Fn(&Foe) -> f32) -> Option<&Foe> {
        let targets = self.foes.iter().filter(|foe| self.available[foe.action]);
        targets.min_by(|a, b| score(a).total_cmp(&score(b)))
    }

    /// The wounded friend that may be healed now and has the least share of its life; the first of equals.
    pub(super) fn neediest_patient(&self) -> Option<&Patient> {
        let wounded = self.patients.iter().filter(|friend| friend.life < 1.0);
        wounded
            .filter(|friend| self.available[friend.action])
            .min_by(|a, b| a.life.total_cmp(&b.life))
    }

    /// The nearest friend in sight that can be healed.
    pub(super) fn nearest_patient(&self) -> Option<&Patient> {
        let patients = self.patients.iter();
        patients.min_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared))
    }

    /// The nearest enemy in sight.
    pub(super) fn nearest(&self) -> Option<&Foe> {
        let foes = self.foes.iter();
        foes.min_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared))
    }

    /// Whether an ally in sight is within `distance` of an enemy in sight.
    pub(super) fn is_an_ally_within(&self, distance: f32) -> bool {
        let near =
            |ally: &[f32; 2], foe: &Foe| distance_squared(*ally, foe.at) <= distance * distance;
        let allies = self.allies.iter().chain(std::iter::once(&self.own));
        allies
            .into_iter()
            .any(|ally| self.foes.iter().any(|foe| near(ally, foe)))
    }
}

/// The action by which a healer heals an agent. None for healers.
fn heal_action(scenario: &Scenario, entity: EntityId) -> Option<usize> {
    let mut patients = scenario.patients();
    let number = patients.position(|patient| patient == entity.index());
    number.map(|number| TARGETS_FROM + number)
}

/// Life and shield points of an entity with these features.
fn strength(scenario: &Scenario, entity: EntityId, features: &[f32]) -> f32 {
    let profiles = &scenario.field.profiles;
    let profile = &profiles[usize::from(scenario.recruits[entity.index()].kind)];
    let has_shields = profiles.iter().any(|profile| profile.shield > 0.0);
    let shield = if has_shields { features[SHIELD] } else { 0.0 };
    features[LIFE] * profile.life + shield * profile.shield
}
