//! Robots on a grid that see a few cells, and two buttons that pay only if two robots press at once.
//!
//! A press that is answered pays 1 and ends the episode; a press alone costs. While robots still try things, a press is seldom
//! answered, so each robot by itself learns not to press. Two robots that see each other on the buttons commonly know it, and
//! can decide together.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd,
    EpisodeKey, IllegalAction, KnownEntities, ObservationMut, PriorKnowledge, Statistic, StepError,
    TimeStep, declare_settings, settings::Accepts,
};

/// What a robot can do: wait, go north, east, south or west, press.
const ACTIONS: usize = 6;
const MOVES: [[i32; 2]; 5] = [[0, 0], [0, -1], [1, 0], [0, 1], [-1, 0]];
const PRESS: usize = 5;
const BUTTONS: [[i32; 2]; 2] = [[0, 1], [1, 1]];

declare_settings! {
    /// The grid and what is on it.
    pub struct RendezvousSettings {
        /// Robots.
        robots: usize = 2, Accepts::integer(2, 16);
        /// Cells of a side.
        side: i32 = 3, Accepts::integer(3, 64);
        /// Cells that a robot sees in each direction.
        sight: i32 = 1, Accepts::integer(1, 64);
        /// What a press alone costs.
        penalty: f32 = 0.25, Accepts::within(0.0, 100.0);
        /// Steps of an episode.
        steps: usize = 20, Accepts::integer(1, 1000);
    }
}

/// The world.
#[derive(Debug, Clone)]
pub struct Rendezvous {
    settings: RendezvousSettings,
    spec: EnvironmentSpec,
    cells: Vec<[i32; 2]>,
    step: usize,
    has_met: bool,
}

impl Rendezvous {
    /// The world of these settings.
    pub fn new(settings: RendezvousSettings) -> Self {
        let entities = settings.robots + BUTTONS.len();
        Self {
            spec: EnvironmentSpec {
                name: format!("rendezvous-{}", settings.robots),
                agents: settings.robots,
                entities,
                entity_features: 2,
                position_features: 2,
                actions: ACTIONS,
                observation_size: 3 * entities,
                state_size: 2 * settings.robots + 1,
                episode_limit: settings.steps,
                distance_scale: settings.side as f32,
                statistics: vec![Statistic::new("met", "1 if two pressed at once, else 0")],
                success: Some(0),
            },
            cells: vec![[0, 0]; settings.robots],
            settings,
            step: 0,
            has_met: false,
        }
    }

    /// Where every entity is: the robots, then the buttons.
    fn places(&self) -> impl Iterator<Item = [i32; 2]> + '_ {
        self.cells.iter().copied().chain(BUTTONS)
    }

    fn show(&self, out: &mut ObservationMut<'_>) {
        let entities = self.spec.entities;
        for (features, [x, y]) in out.entity_mf.chunks_mut(2).zip(self.places()) {
            features.copy_from_slice(&[x as f32, y as f32]);
        }
        out.observation_no.fill(0.0);
        for (robot, &own) in self.cells.iter().enumerate() {
            let mut seen = EntitySet::EMPTY;
            for (entity, place) in self.places().enumerate() {
                if is_near(own, place, self.settings.sight) {
                    seen.insert(EntityId::new(entity));
                    let [dx, dy] = [place[0] - own[0], place[1] - own[1]];
                    let at = (robot * entities + entity) * 3;
                    out.observation_no[at..at + 3].copy_from_slice(&[1.0, dx as f32, dy as f32]);
                }
            }
            out.visible_n[robot] = seen;
            let available_a = &mut out.available_na[robot * ACTIONS..(robot + 1) * ACTIONS];
            write_available(own, self.settings.side, available_a);
        }
        for (state, [x, y]) in out.state_g.chunks_mut(2).zip(&self.cells) {
            state.copy_from_slice(&[*x as f32, *y as f32]);
        }
        out.state_g[2 * self.cells.len()] = self.step as f32 / self.settings.steps as f32;
    }
}

impl Environment for Rendezvous {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        let RendezvousSettings { side, sight, .. } = self.settings;
        Arc::new(Grid { side, sight })
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        let side = self.settings.side;
        let cell = |draw| one_of(0..side, key.uniform(0, Draw::World(draw)));
        for (robot, place) in self.cells.iter_mut().enumerate() {
            *place = [cell(2 * robot), cell(2 * robot + 1)];
        }
        (self.step, self.has_met) = (0, false);
        self.show(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        for (robot, &action) in actions.iter().enumerate() {
            let mut available_a = [false; ACTIONS];
            write_available(self.cells[robot], self.settings.side, &mut available_a);
            if !available_a
                .get(action.index())
                .is_some_and(|&available| available)
            {
                let agent = AgentId::new(robot);
                return Err(IllegalAction { agent, action }.into());
            }
        }
        let is_pressed = BUTTONS.map(|button| {
            let mut pressing = self.cells.iter().zip(actions);
            pressing.any(|(cell, action)| *cell == button && action.index() == PRESS)
        });
        for (cell, action) in self.cells.iter_mut().zip(actions) {
            if let Some([dx, dy]) = MOVES.get(action.index()) {
                *cell = [cell[0] + dx, cell[1] + dy];
            }
        }
        self.step += 1;
        self.has_met = is_pressed == [true; 2];
        self.show(out);
        let end = match (self.has_met, self.step >= self.settings.steps) {
            (true, _) => Some(EpisodeEnd::Terminated),
            (false, true) => Some(EpisodeEnd::Truncated),
            (false, false) => None,
        };
        let reward = match is_pressed {
            [true, true] => 1.0,
            [false, false] => 0.0,
            _ => -self.settings.penalty,
        };
        Ok(TimeStep { reward, end })
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s[0] = f64::from(u8::from(self.has_met));
    }

    /// Robots that `agent` does not see stand somewhere else that it does not see.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        let RendezvousSettings { side, sight, .. } = self.settings;
        let own = self.cells[agent.index()];
        let mut has_altered = false;
        for (robot, cell) in self.cells.iter_mut().enumerate() {
            let unseen: Vec<[i32; 2]> = (0..side * side)
                .map(|place| [place % side, place / side])
                .filter(|&place| !is_near(own, place, sight) && place != *cell)
                .collect();
            if !is_near(own, *cell, sight) && !unseen.is_empty() {
                let uniform = key.uniform(self.step, Draw::World(1000 + robot));
                *cell = one_of(unseen, uniform);
                has_altered = true;
            }
        }
        self.show(out);
        has_altered
    }
}

/// What all robots know before they start: the size of the grid, where the buttons are, and how far everybody sees.
#[derive(Debug)]
struct Grid {
    side: i32,
    sight: i32,
}

impl PriorKnowledge for Grid {
    fn sees(&self, _: AgentId, observer_f: &[f32], _: EntityId, entity_f: &[f32]) -> bool {
        is_near(cell(observer_f), cell(entity_f), self.sight)
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        match known.get(agent) {
            Some(features) => write_available(cell(features), self.side, available_a),
            None => available_a.fill(false),
        }
    }

    fn action_on(&self, _: EntityId) -> Option<Action> {
        None
    }
}

#[expect(clippy::cast_possible_truncation, reason = "features are whole")]
fn cell(features: &[f32]) -> [i32; 2] {
    [features[0] as i32, features[1] as i32]
}

/// One of `choices`, which are some, by a number in [0, 1).
fn one_of<T>(choices: impl IntoIterator<Item = T>, uniform: f64) -> T {
    let mut choices: Vec<T> = choices.into_iter().collect();
    let count = choices.len() as f64;
    let chosen = (1..choices.len())
        .take_while(|&i| i as f64 <= uniform * count)
        .count();
    choices.swap_remove(chosen)
}

fn is_near(from: [i32; 2], to: [i32; 2], sight: i32) -> bool {
    (from[0] - to[0]).abs().max((from[1] - to[1]).abs()) <= sight
}

/// Robots stay on the grid, and press where there is a button.
fn write_available(own: [i32; 2], side: i32, available_a: &mut [bool]) {
    for (available, [dx, dy]) in available_a.iter_mut().zip(MOVES) {
        let inside = |place: i32| (0..side).contains(&place);
        *available = inside(own[0] + dx) && inside(own[1] + dy);
    }
    available_a[PRESS] = BUTTONS.contains(&own);
}

#[cfg(test)]
mod tests {
    use mackrl_env::contract::check_environment;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        for robots in [2, 5] {
            let settings = RendezvousSettings {
                robots,
                side: 6,
                ..RendezvousSettings::default()
            };
            let coverage = check_environment(&mut Rendezvous::new(settings), 20);
            assert!(coverage.alterations > 20, "{coverage:?}");
        }
    }
}
