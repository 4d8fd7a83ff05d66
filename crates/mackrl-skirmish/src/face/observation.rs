//! Writing what agents see: SMAC's observation vectors, availability, and the local views of our own contract.

use mackrl_env::{Action, EntitySet, ObservationMut};

use crate::{
    actions::{MOVES_FROM, NO_OPERATION, STOP, TARGETS_FROM},
    face::{knowledge::SkirmishKnowledge, layout::Layout},
    rules::{BattleState, Battlefield, Profile, Unit},
};

/// All that observations are made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) layout: &'a Layout,
    pub(super) knowledge: &'a SkirmishKnowledge,
    /// What never changes.
    pub(super) field: &'a Battlefield,
    /// Everybody, wherever that was learnt.
    pub(super) state: &'a BattleState,
    pub(super) last_actions: &'a [Option<Action>],
    pub(super) sight_range: f32,
    /// Part of the episode's limit that has passed, in \[0, 1\].
    pub(super) time: f32,
}

/// Fills a buffer from the front.
pub(super) struct Cursor<'a>(pub(super) &'a mut [f32]);

impl Cursor<'_> {
    pub(super) fn put(&mut self, value: f32) {
        let rest = std::mem::take(&mut self.0);
        let (first, rest) = rest
            .split_first_mut()
            .expect("the layout leaves room for everything");
        *first = value;
        self.0 = rest;
    }

    pub(super) fn put_one_hot(&mut self, place: Option<usize>, len: usize) {
        let rest = std::mem::take(&mut self.0);
        let (row, rest) = rest.split_at_mut(len);
        row.fill(0.0);
        if let Some(place) = place {
            row[place] = 1.0;
        }
        self.0 = rest;
    }

    pub(super) fn put_zeros(&mut self, len: usize) {
        self.put_one_hot(None, len);
    }
}

impl Scene<'_> {
    /// Writes everything but the state vector.
    pub(super) fn write(&self, out: &mut ObservationMut<'_>) {
        self.write_entities(out.entity_mf);
        let (o, a) = (self.layout.observation_size(), self.layout.actions);
        for agent in 0..self.layout.agents {
            let observation_o = &mut out.observation_no[agent * o..(agent + 1) * o];
            let available_a = &mut out.available_na[agent * a..(agent + 1) * a];
            out.visible_n[agent] = self.write_agent(agent, observation_o, available_a);
        }
    }

    /// Whether `action` is available to `agent`.
    pub(super) fn is_available(&self, agent: usize, action: usize) -> bool {
        let state = self.state;
        if !state.units[agent].is_alive() {
            return action == NO_OPERATION;
        }
        let (x, y) = (state.x[agent], state.y[agent]);
        match action {
            NO_OPERATION => false,
            STOP => true,
            MOVES_FROM..TARGETS_FROM => self.knowledge.moves(x, y)[action - MOVES_FROM],
            _ => self.can_aim(agent, action - TARGETS_FROM),
        }
    }

    /// Whether `agent` can choose its target number `target`, which lives and is in range.
    fn can_aim(&self, agent: usize, target: usize) -> bool {
        let state = self.state;
        let Some(target) = self.knowledge.target(agent, target) else {
            return false;
        };
        state.units[target].is_alive()
            && self.knowledge.is_in_shooting_range(
                state.x[target] - state.x[agent],
                state.y[target] - state.y[agent],
            )
    }

    /// Entity features \[M, F\]: position, life, shield, kind; zeros for the dead.
    fn write_entities(&self, entity_mf: &mut [f32]) {
        let state = self.state;
        for (index, row) in entity_mf
            .chunks_exact_mut(self.layout.entity_features())
            .enumerate()
        {
            let unit = &state.units[index];
            if !unit.is_alive() {
                row.fill(0.0);
                continue;
            }
            let profile = self.profile(unit);
            let mut row = Cursor(row);
            row.put(state.x[index]);
            row.put(state.y[index]);
            row.put(unit.life / profile.life);
            if self.layout.entity_shields {
                row.put(shield_fraction(unit, profile));
            }
            row.put_one_hot(
                Some(usize::from(unit.kind)).filter(|_| self.layout.entity_kinds > 0),
                self.layout.entity_kinds,
            );
        }
    }

    /// One agent's observation vector and availability; returns whom it sees.
    fn write_agent(
        &self,
        agent: usize,
        observation_o: &mut [f32],
        available_a: &mut [bool],
    ) -> EntitySet {
        let state = self.state;
        let own = &state.units[agent];
        available_a.fill(false);
        let observation_o = if self.layout.obs_timestep_number {
            let (last, rest) = observation_o
                .split_last_mut()
                .expect("the layout leaves room for the time");
            *last = self.time;
            rest
        } else {
            observation_o
        };
        if !own.is_alive() {
            observation_o.fill(0.0);
            available_a[NO_OPERATION] = true;
            return EntitySet::EMPTY;
        }
        let moves = self.knowledge.moves(state.x[agent], state.y[agent]);
        available_a[STOP] = true;
        available_a[MOVES_FROM..TARGETS_FROM].copy_from_slice(&moves);
        let mut seen = 1_u128 << agent;
        let mut row = Cursor(observation_o);
        for is_possible in moves {
            row.put(if is_possible { 1.0 } else { 0.0 });
        }
        self.write_ground(agent, &mut row);
        let heals = self.knowledge.is_healer(agent);
        for enemy in 0..self.layout.enemies {
            let index = self.layout.agents + enemy;
            // SMAC shows a healer, beside each enemy, whether the action of that number is available.
            let can_heal = heals.then(|| self.can_aim(agent, enemy));
            let can_shoot = self.write_enemy((agent, index), can_heal, &mut row, &mut seen);
            available_a[TARGETS_FROM + enemy] = can_heal.unwrap_or(can_shoot);
        }
        let beyond = TARGETS_FROM + self.layout.enemies;
        for (number, available) in available_a[beyond..].iter_mut().enumerate() {
            *available = self.can_aim(agent, self.layout.enemies + number);
        }
        for ally in (0..self.layout.agents).filter(|ally| *ally != agent) {
            self.write_ally(agent, ally, &mut row, &mut seen);
        }
        let profile = self.profile(own);
        if self.layout.obs_own_health {
            row.put(own.life / profile.life);
            if self.layout.ally_shields > 0 {
                row.put(shield_fraction(own, profile));
            }
        }
        row.put_one_hot(
            self.layout.ally_type[usize::from(own.kind)],
            self.layout.type_bits,
        );
        EntitySet::from_bits(seen)
    }

    /// Walkability and heights around an agent, if shown.
    fn write_ground(&self, agent: usize, row: &mut Cursor<'_>) {
        let state = self.state;
        let (x, y) = (state.x[agent], state.y[agent]);
        if self.layout.obs_pathing_grid {
            for value in self.knowledge.pathing(x, y) {
                row.put(value);
            }
        }
        if self.layout.obs_terrain_height {
            for value in self.knowledge.heights(x, y) {
                row.put(value);
            }
        }
    }

    /// A row about an enemy, which begins with `flag` or else with whether it can be shot at; returns whether it can.
    fn write_enemy(
        &self,
        (agent, index): (usize, usize),
        flag: Option<bool>,
        row: &mut Cursor<'_>,
        seen: &mut u128,
    ) -> bool {
        let Some((dx, dy)) = self.sighted(agent, index) else {
            row.put_zeros(self.layout.enemy_row());
            return false;
        };
        *seen |= 1 << index;
        let can_shoot = self.knowledge.is_in_shooting_range(dx, dy);
        row.put(f32::from(u8::from(flag.unwrap_or(can_shoot))));
        self.write_unit(index, dx, dy, self.layout.enemy_shields, row);
        let kind = usize::from(self.state.units[index].kind);
        row.put_one_hot(self.layout.enemy_type[kind], self.layout.type_bits);
        can_shoot
    }

    fn write_ally(&self, agent: usize, ally: usize, row: &mut Cursor<'_>, seen: &mut u128) {
        let Some((dx, dy)) = self.sighted(agent, ally) else {
            row.put_zeros(self.layout.ally_row());
            return;
        };
        *seen |= 1 << ally;
        row.put(1.0);
        self.write_unit(ally, dx, dy, self.layout.ally_shields, row);
        let kind = usize::from(self.state.units[ally].kind);
        row.put_one_hot(self.layout.ally_type[kind], self.layout.type_bits);
        if self.layout.obs_last_action {
            let last = self.last_actions[ally].map(Action::index);
            row.put_one_hot(last, self.layout.actions);
        }
    }

    /// \[distance, x, y\] over the sight range; life and shield if shown.
    fn write_unit(&self, index: usize, dx: f32, dy: f32, shields: usize, row: &mut Cursor<'_>) {
        let unit = &self.state.units[index];
        let profile = self.profile(unit);
        row.put((dx * dx + dy * dy).sqrt() / self.sight_range);
        row.put(dx / self.sight_range);
        row.put(dy / self.sight_range);
        if !self.layout.obs_all_health {
            return;
        }
        row.put(unit.life / profile.life);
        if shields > 0 {
            row.put(shield_fraction(unit, profile));
        }
    }

    /// Where `index` is relative to `agent`, if it lives and is in sight.
    fn sighted(&self, agent: usize, index: usize) -> Option<(f32, f32)> {
        let state = self.state;
        let (dx, dy) = (
            state.x[index] - state.x[agent],
            state.y[index] - state.y[agent],
        );
        let is_seen = state.units[index].is_alive() && self.knowledge.is_in_sight(dx, dy);
        is_seen.then_some((dx, dy))
    }

    pub(super) fn profile(&self, unit: &Unit) -> &Profile {
        &self.field.profiles[usize::from(unit.kind)]
    }
}

/// Shield over full shield; 0 for units without.
pub(super) fn shield_fraction(unit: &Unit, profile: &Profile) -> f32 {
    if profile.shield > 0.0 {
        unit.shield / profile.shield
    } else {
        0.0
    }
}
