//! Settings of a skirmish, with the names that SMAC gives them.

use serde::{Deserialize, Serialize};

use crate::skirmish::{error::SkirmishError, unit_types::UnitData};

/// Which of SMAC's peculiarities are kept.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compatibility {
    /// All of them: rewards are absolute values, so enemies whose shields recharge pay the team, and on maps of stalkers and
    /// zealots the one-hot types of enemies are swapped against those of allies.
    #[default]
    Smac,
    /// None: rewards are cut off at 0, and a type has the same one-hot on both sides.
    Clean,
}

/// What the enemies are told when an episode begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EnemyBehaviour {
    /// The map's own order. Most maps send the enemies to where the agents started; there they stay, and a team that hides is
    /// never found.
    #[default]
    Map,
    /// To go for the nearest agent, wherever it is, until none is left.
    Hunt,
}

/// How a skirmish is played and shown to agents.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SkirmishSettings {
    /// Which statistics units have.
    pub units: UnitData,
    /// Which of SMAC's peculiarities are kept.
    pub compat: Compatibility,
    /// What the enemies are told when an episode begins. Not in SMAC, whose maps say it.
    pub enemy_order: EnemyBehaviour,
    /// Map units by which a unit starts beside its place on the map, at most, along each axis; drawn anew for every episode; in
    /// \[0, 4\]. Not in SMAC, where the engine places units: see `DEVIATIONS.md`.
    pub spawn_scatter: f32,
    /// Map units that a move is ordered to go, in (0, 32]. Half of it is how far ahead availability looks.
    pub move_amount: f32,
    /// Map units within which an agent sees, centre to centre, exclusive; in (0, 64].
    pub sight_range: f32,
    /// Map units within which a target may be chosen, centre to centre, inclusive; in (0, 64] and below `sight_range`.
    pub shoot_range: f32,
    /// Game loops in a step, in 1..=64.
    pub step_mul: u8,
    /// Whether only what happens to enemies is rewarded.
    pub reward_only_positive: bool,
    /// Whether rewards are scaled so that the greatest return is `reward_scale_rate`.
    pub reward_scale: bool,
    /// The greatest return after scaling, > 0.
    pub reward_scale_rate: f32,
    /// Reward for a killed enemy, ≥ 0.
    pub reward_death_value: f32,
    /// Reward for winning, ≥ 0.
    pub reward_win: f32,
    /// Reward for losing, usually ≤ 0.
    pub reward_defeat: f32,
    /// Weight of the team's own losses when `reward_only_positive` is off, ≥ 0.
    pub reward_negative_scale: f32,
    /// Whether only the outcome is rewarded: 1, 0 or −1.
    pub reward_sparse: bool,
    /// Whether agents see the last action of the allies they see.
    pub obs_last_action: bool,
    /// Whether agents see their own life and shield.
    pub obs_own_health: bool,
    /// Whether agents see the life and shields of those in sight.
    pub obs_all_health: bool,
    /// Whether agents see at eight points around them whether one can walk there.
    pub obs_pathing_grid: bool,
    /// Whether agents see the height of the ground at these points and below them.
    pub obs_terrain_height: bool,
    /// Whether agents see which part of the episode's limit has passed.
    pub obs_timestep_number: bool,
    /// Whether the state is the agents' observations, one behind the other.
    pub obs_instead_of_state: bool,
    /// Whether the state holds every agent's last action.
    pub state_last_action: bool,
    /// Whether the state holds which part of the episode's limit has passed.
    pub state_timestep_number: bool,
}

impl Default for SkirmishSettings {
    fn default() -> Self {
        Self {
            units: UnitData::Liberty,
            compat: Compatibility::Smac,
            enemy_order: EnemyBehaviour::Map,
            spawn_scatter: 0.5,
            move_amount: 2.0,
            sight_range: 9.0,
            shoot_range: 6.0,
            step_mul: 8,
            reward_only_positive: true,
            reward_scale: true,
            reward_scale_rate: 20.0,
            reward_death_value: 10.0,
            reward_win: 200.0,
            reward_defeat: 0.0,
            reward_negative_scale: 0.5,
            reward_sparse: false,
            obs_last_action: false,
            obs_own_health: true,
            obs_all_health: true,
            obs_pathing_grid: false,
            obs_terrain_height: false,
            obs_timestep_number: false,
            obs_instead_of_state: false,
            state_last_action: true,
            state_timestep_number: false,
        }
    }
}

impl SkirmishSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] names the first setting out of range.
    pub fn validate(&self) -> Result<(), SkirmishError> {
        let within = |value: f32, greatest: f32| value > 0.0 && value <= greatest;
        let weight = |value: f32| (0.0..=1e9).contains(&value);
        check(
            "spawn_scatter",
            self.spawn_scatter,
            (0.0..=4.0).contains(&self.spawn_scatter),
            "in [0, 4]",
        )?;
        check(
            "move_amount",
            self.move_amount,
            within(self.move_amount, 32.0),
            "in (0, 32]",
        )?;
        check(
            "sight_range",
            self.sight_range,
            within(self.sight_range, 64.0),
            "in (0, 64]",
        )?;
        check(
            "shoot_range",
            self.shoot_range,
            within(self.shoot_range, 64.0) && self.shoot_range < self.sight_range,
            "in (0, sight_range), because agents can only aim at what they see",
        )?;
        let step_mul = f32::from(self.step_mul);
        check("step_mul", step_mul, within(step_mul, 64.0), "in 1..=64")?;
        let rate = self.reward_scale_rate;
        check("reward_scale_rate", rate, within(rate, 1e9), "in (0, 1e9]")?;
        let weights = [
            ("reward_death_value", self.reward_death_value),
            ("reward_win", self.reward_win),
            ("reward_negative_scale", self.reward_negative_scale),
        ];
        for (key, value) in weights {
            check(key, value, weight(value), "in [0, 1e9]")?;
        }
        let defeat = self.reward_defeat;
        check(
            "reward_defeat",
            defeat,
            weight(defeat.abs()),
            "in [-1e9, 1e9]",
        )
    }
}

fn check(
    key: &'static str,
    found: f32,
    holds: bool,
    expected: &'static str,
) -> Result<(), SkirmishError> {
    if holds {
        Ok(())
    } else {
        Err(SkirmishError::Setting {
            key,
            found: found.to_string(),
            expected,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aiming_beyond_sight_is_refused() {
        let settings = SkirmishSettings {
            shoot_range: 9.0,
            ..SkirmishSettings::default()
        };
        let error = settings.validate().unwrap_err().to_string();
        assert!(error.starts_with("setting `shoot_range` is 9"), "{error}");
    }

    #[test]
    fn numbers_that_are_not_numbers_are_refused() {
        let settings = SkirmishSettings {
            reward_win: f32::NAN,
            ..SkirmishSettings::default()
        };
        settings.validate().unwrap_err();
    }

    #[test]
    fn unknown_settings_are_refused() {
        toml::from_str::<SkirmishSettings>("sight_rang = 9.0").unwrap_err();
    }
}
