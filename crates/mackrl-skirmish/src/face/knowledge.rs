//! What agents know before the battle: the map, the field of view, the range of commands.

use std::sync::Arc;

use mackrl_env::{Action, AgentId, EntityId, KnownEntities, PriorKnowledge};

use crate::{
    actions::{DIRECTIONS, MOVES_FROM, STOP, TARGETS_FROM},
    scenario::Scenario,
    settings::SkirmishSettings,
    terrain::Terrain,
};

/// The field of view and the rules of availability, as functions of positions alone.
///
/// The environment itself decides by these functions, so that what an agent derives from features is what the environment
/// says, to the bit.
#[derive(Debug, Clone)]
pub struct SkirmishKnowledge {
    terrain: Arc<Terrain>,
    agents: usize,
    enemies: usize,
    /// Per agent: whether its targets are friends to heal instead of enemies.
    heals: Vec<bool>,
    /// The agents that healers choose from.
    patients: Vec<usize>,
    sight_squared: f32,
    shoot_squared: f32,
    /// How far ahead a move looks: half of what it goes.
    move_ahead: f64,
}

impl SkirmishKnowledge {
    pub(super) fn new(scenario: &Scenario, settings: &SkirmishSettings) -> Self {
        Self {
            terrain: scenario.field.terrain.clone(),
            agents: scenario.agents,
            enemies: scenario.enemies(),
            heals: (0..scenario.agents)
                .map(|agent| scenario.is_healer(agent))
                .collect(),
            patients: scenario.patients().collect(),
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

    /// Whether the targets of `agent` are friends to heal.
    #[must_use]
    pub fn is_healer(&self, agent: usize) -> bool {
        self.heals[agent]
    }

    /// The unit that the `target`-th action with a target of `agent` is about, if there is one: an enemy, or for a healer a friend
    /// that is none. In SMAC, where there are no more actions with a target than enemies, healers cannot choose friends beyond
    /// that number; here there is an action for each.
    #[must_use]
    pub fn target(&self, agent: usize, target: usize) -> Option<usize> {
        if self.heals[agent] {
            self.patients.get(target).copied()
        } else {
            (target < self.enemies).then_some(self.agents + target)
        }
    }

    /// The walkable cells around (`x`, `y`) that agents may be told of: eight points at twice the move north, south, east and
    /// west and at one move along the diagonals; 1 if walkable or outside the map, else 0.
    pub(super) fn pathing(&self, x: f32, y: f32) -> [f32; 8] {
        self.surroundings(x, y).map(|(x, y)| {
            let is_outside = !Terrain::is_inside(x, y);
            f32::from(u8::from(is_outside || self.terrain.is_walkable(x, y)))
        })
    }

    /// Heights at the points of [`Self::pathing`] and at the unit's own cell.
    pub(super) fn heights(&self, x: f32, y: f32) -> [f32; 9] {
        let around = self.surroundings(x, y);
        std::array::from_fn(|point| {
            let (x, y) = around
                .get(point)
                .copied()
                .unwrap_or((truncated(x.into()), truncated(y.into())));
            self.terrain.height(x, y)
        })
    }

    /// Cells of SMAC's surrounding points, from the truncated position.
    fn surroundings(&self, x: f32, y: f32) -> [(i32, i32); 8] {
        let (x, y) = (f64::from(x).trunc(), f64::from(y).trunc());
        let near = 2.0 * self.move_ahead;
        let far = 2.0 * near;
        [
            (0.0, far),
            (0.0, -far),
            (far, 0.0),
            (-far, 0.0),
            (near, near),
            (-near, -near),
            (near, -near),
            (-near, near),
        ]
        .map(|(dx, dy)| (truncated((x + dx).floor()), truncated((y + dy).floor())))
    }

    /// Whether moves north, south, east and west are available at (`x`, `y`): SMAC looks at the cell half a move ahead,
    /// with coordinates truncated towards zero.
    #[must_use]
    pub fn moves(&self, x: f32, y: f32) -> [bool; 4] {
        let ahead = self.move_ahead;
        DIRECTIONS.map(|[dx, dy]| {
            let x = f64::from(x) + f64::from(dx) * ahead;
            let y = f64::from(y) + f64::from(dy) * ahead;
            self.terrain.is_walkable(truncated(x), truncated(y))
        })
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
        available_a[STOP] = true;
        available_a[MOVES_FROM..TARGETS_FROM].copy_from_slice(&self.moves(own[0], own[1]));
        for (target, available) in available_a[TARGETS_FROM..].iter_mut().enumerate() {
            *available = self
                .target(agent.index(), target)
                .and_then(|target| known.get(EntityId::new(target)))
                .is_some_and(|f| self.is_in_shooting_range(f[0] - own[0], f[1] - own[1]));
        }
    }

    fn action_on(&self, entity: EntityId) -> Option<Action> {
        let enemy = entity.index().checked_sub(self.agents)?;
        Some(Action::new(TARGETS_FROM + enemy))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "Python's int() truncates, and so do we"
)]
fn truncated(coordinate: f64) -> i32 {
    coordinate as i32
}
