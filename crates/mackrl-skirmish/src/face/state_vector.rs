//! The state vector of SMAC, which critics see.

use mackrl_env::Action;

use crate::{
    face::observation::{Cursor, Scene, shield_fraction},
    rules::Profile,
    terrain::MAP_SIZE,
};

/// What SMAC divides weapon cooldowns by, in loops, for the types that its agents have. They fit no set of statistics well, and
/// with some types the feature exceeds 1.
const COOLDOWN_SCALES: &[(&str, f32)] = &[
    ("marine", 15.0),
    ("marauder", 25.0),
    ("stalker", 35.0),
    ("zealot", 22.0),
    ("colossus", 24.0),
    ("hydralisk", 10.0),
    ("zergling", 11.0),
    ("baneling", 1.0),
];

/// What weapon cooldowns of a type are divided by: what SMAC divides them by, or the period of the weapon if it has no such
/// type. Only the jitter can then exceed 1.
pub(super) fn cooldown_scale(profile: &Profile) -> f32 {
    let of_smac = COOLDOWN_SCALES
        .iter()
        .find(|(known, _)| *known == profile.name);
    let own = profile.strike.as_ref().map(|strike| strike.period);
    of_smac.map(|(_, scale)| *scale).or(own).unwrap_or(1.0)
}

impl Scene<'_> {
    /// Writes the state \[G\]: rows of allies, rows of enemies, last actions. Rows of the dead are zeros.
    ///
    /// `cooldown_scales` holds [`cooldown_scale`] for each kind.
    pub(super) fn write_state(&self, cooldown_scales: &[f32], state_g: &mut [f32]) {
        let layout = self.layout;
        let mut row = Cursor(state_g);
        for agent in 0..layout.agents {
            self.write_state_ally(agent, cooldown_scales, &mut row);
        }
        for index in layout.agents..layout.agents + layout.enemies {
            self.write_state_enemy(index, &mut row);
        }
        if layout.state_last_action {
            for last_action in self.last_actions {
                row.put_one_hot(last_action.map(Action::index), layout.actions);
            }
        }
        if layout.state_timestep_number {
            row.put(self.time);
        }
    }

    fn write_state_ally(&self, agent: usize, cooldown_scales: &[f32], row: &mut Cursor<'_>) {
        let unit = &self.state.units[agent];
        if !unit.is_alive() {
            row.put_zeros(self.layout.state_ally_row());
            return;
        }
        let profile = self.profile(unit);
        let kind = usize::from(unit.kind);
        row.put(unit.life / profile.life);
        // A healer, which has no weapon, shows its energy in the place of a cooldown.
        row.put(if profile.care.is_some() {
            unit.energy / profile.greatest_energy
        } else {
            unit.cooldown.max(0.0) / cooldown_scales[kind]
        });
        self.write_place(agent, row);
        if self.layout.ally_shields > 0 {
            row.put(shield_fraction(unit, profile));
        }
        row.put_one_hot(self.layout.ally_type[kind], self.layout.type_bits);
    }

    fn write_state_enemy(&self, index: usize, row: &mut Cursor<'_>) {
        let unit = &self.state.units[index];
        if !unit.is_alive() {
            row.put_zeros(self.layout.state_enemy_row());
            return;
        }
        let profile = self.profile(unit);
        row.put(unit.life / profile.life);
        self.write_place(index, row);
        if self.layout.enemy_shields > 0 {
            row.put(shield_fraction(unit, profile));
        }
        row.put_one_hot(
            self.layout.enemy_type[usize::from(unit.kind)],
            self.layout.type_bits,
        );
    }

    /// Position relative to the middle of the map, over its size.
    fn write_place(&self, index: usize, row: &mut Cursor<'_>) {
        let state = self.state;
        let size = MAP_SIZE as f32;
        row.put((state.x[index] - size / 2.0) / size);
        row.put((state.y[index] - size / 2.0) / size);
    }
}
