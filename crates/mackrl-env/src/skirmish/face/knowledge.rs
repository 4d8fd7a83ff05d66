//! What agents know before the battle: the map, the field of view, the range of commands.

use std::sync::Arc;

use crate::{
    Action, AgentId, EntityId, KnownEntities, PriorKnowledge,
    skirmish::{face::layout::TARGET_ACTIONS_FROM, settings::SkirmishSettings, terrain::Terrain},
};

/// The field of view and the rules of availability, as functions of positions alone.
///
/// The environment itself decides by these functions, so that what an agent derives from features is what the environment
/// says, to the bit.
#[derive(Debug, Clone)]
pub struct SkirmishKnowledge {
    terrain: Arc<Terrain>,
    agents: usize,
    sight_squared: f32,
    shoot_squared: f32,
    /// How far ahead a move looks: half of what it goes.
    move_ahead: f64,
}

impl SkirmishKnowledge {
    pub(super) fn new(terrain: Arc<Terrain>, agents: usize, settings: &SkirmishSettings) -> Self {
        Self {
            terrain,
            agents,
            sight_squared: settings.sight_range * settings.sight_range,
            shoot_squared: settings.shoot_range * settings.shoot_range,
            move_ahead: f64::from(settings.move_amount) / 2.0,
        }
    }

    /// Whether somebody at distance (`dx`, `dy`) is in sight.
    #[must_use]
    pub fn is_in_sight(&self, dx: f32, dy: f32) -> bool {
        dx * dx + dy * dy < self.sight_squared
    }

    /// Whether somebody at distance (`dx`, `dy`) can be chosen as a target.
    #[must_use]
    pub fn is_in_shooting_range(&self, dx: f32, dy: f32) -> bool {
        dx * dx + dy * dy <= self.shoot_squared
    }

    /// Whether moves north, south, east and west are available at (`x`, `y`): SMAC looks at the cell half a move ahead,
    /// with coordinates truncated towards zero.
    #[must_use]
    pub fn moves(&self, x: f32, y: f32) -> [bool; 4] {
        let (x, y) = (f64::from(x), f64::from(y));
        let ahead = self.move_ahead;
        [
            (x, y + ahead),
            (x, y - ahead),
            (x + ahead, y),
            (x - ahead, y),
        ]
        .map(|(x, y)| self.terrain.is_walkable(truncated(x), truncated(y)))
    }
}

impl PriorKnowledge for SkirmishKnowledge {
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        entity_f: &[f32],
    ) -> bool {
        EntityId::from(observer) == entity
            || self.is_in_sight(entity_f[0] - observer_f[0], entity_f[1] - observer_f[1])
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(false);
        let Some(own) = known.get(agent) else { return };
        available_a[1] = true;
        available_a[2..TARGET_ACTIONS_FROM].copy_from_slice(&self.moves(own[0], own[1]));
        for (enemy, available) in available_a[TARGET_ACTIONS_FROM..].iter_mut().enumerate() {
            *available = known
                .get(EntityId::new(self.agents + enemy))
                .is_some_and(|f| self.is_in_shooting_range(f[0] - own[0], f[1] - own[1]));
        }
    }

    fn action_on(&self, entity: EntityId) -> Option<Action> {
        let enemy = entity.index().checked_sub(self.agents)?;
        Some(Action::new(TARGET_ACTIONS_FROM + enemy))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "Python's int() truncates, and so do we"
)]
fn truncated(coordinate: f64) -> i32 {
    coordinate as i32
}
