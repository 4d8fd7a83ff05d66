//! Settings of a skirmish, with the names that SMAC gives them.

use mackrl_env::{
    declare_settings, declare_words,
    settings::{Accepts, SettingsError, WrongSetting},
};

use crate::{error::SkirmishError, unit_types::UnitData};

declare_words! {
    /// Which of SMAC's peculiarities are kept.
    pub enum Compatibility {
        /// All of them: rewards are absolute values, so enemies whose shields recharge pay the team, and on maps of stalkers and
        /// zealots the one-hot types of enemies are swapped against those of allies.
        #[default]
        Smac = "smac",
        /// None: rewards are cut off at 0, and a type has the same one-hot on both sides.
        Clean = "clean",
    }
}

declare_words! {
    /// What the enemies are told when an episode begins.
    pub enum EnemyBehaviour {
        /// The map's own order. Most maps send the enemies to where the agents started; there they stay, and a team that hides is
        /// never found.
        #[default]
        Map = "map",
        /// To go for the nearest agent, wherever it is, until none is left.
        Hunt = "hunt",
    }
}

declare_settings! {
    /// How a skirmish is played and shown to agents.
    pub struct SkirmishSettings {
        /// Which statistics units have: those of Legacy of the Void, or those of Wings of Liberty, on whose data SMAC's maps depend by
        /// their files. Recorded runs of the game speak for the former: see `DEVIATIONS.md`.
        units: UnitData = UnitData::Lotv, UnitData::ACCEPTS;
        /// Which of SMAC's peculiarities are kept: all (absolute rewards, swapped one-hot types of enemies) or none.
        compat: Compatibility = Compatibility::Smac, Compatibility::ACCEPTS;
        /// What the enemies are told when an episode begins: what their map says, or to go for the nearest agent, wherever it is. Not in
        /// SMAC, whose maps say it.
        enemy_order: EnemyBehaviour = EnemyBehaviour::Map, EnemyBehaviour::ACCEPTS;
        /// Map units by which a unit starts beside its place on the map, at most, along each axis; drawn anew for every episode. The
        /// least that keeps mirror images of an army from fighting as one. Not in SMAC, where the engine places units: see
        /// `DEVIATIONS.md`.
        spawn_scatter: f32 = 0.02, Accepts::within(0.0, 4.0);
        /// Map units that a move is ordered to go. Half of it is how far ahead availability looks.
        move_amount: f32 = 2.0, Accepts::above_within(0.0, 32.0);
        /// Map units within which an agent sees, centre to centre, exclusive.
        sight_range: f32 = 9.0, Accepts::above_within(0.0, 64.0);
        /// Map units within which a target may be chosen, centre to centre, inclusive; below `sight_range`.
        shoot_range: f32 = 6.0, Accepts::above_within(0.0, 64.0);
        /// Steps after which an episode ends undecided; 0 for the limit of the map. Running out of time is no defeat and pays nothing.
        /// Not in SMAC, whose maps say it.
        episode_limit: usize = 0, Accepts::integer(0, 100_000);
        /// Game loops in a step, of which the game has 22.4 in a second.
        step_mul: u8 = 8, Accepts::integer(1, 64);
        /// Whether only what happens to enemies is rewarded.
        reward_only_positive: bool = true, Accepts::Flag;
        /// Whether rewards are scaled so that the greatest return is `reward_scale_rate`.
        reward_scale: bool = true, Accepts::Flag;
        /// The greatest return after scaling, in units of reward.
        reward_scale_rate: f32 = 20.0, Accepts::above_within(0.0, 1e9);
        /// Reward for a killed enemy, before scaling, where a point of damage gives 1.
        reward_death_value: f32 = 10.0, Accepts::within(0.0, 1e9);
        /// Reward for winning, before scaling.
        reward_win: f32 = 200.0, Accepts::within(0.0, 1e9);
        /// Reward for losing, before scaling; usually 0 or less. Running out of time is no defeat and pays none.
        reward_defeat: f32 = 0.0, Accepts::within(-1e9, 1e9);
        /// Weight of the team's own losses when `reward_only_positive` is off.
        reward_negative_scale: f32 = 0.5, Accepts::within(0.0, 1e9);
        /// Whether only the outcome is rewarded: 1, 0 or −1.
        reward_sparse: bool = false, Accepts::Flag;
        /// Whether agents see the last action of the allies they see.
        obs_last_action: bool = false, Accepts::Flag;
        /// Whether agents see their own life and shield.
        obs_own_health: bool = true, Accepts::Flag;
        /// Whether agents see the life and shields of those in sight.
        obs_all_health: bool = true, Accepts::Flag;
        /// Whether agents see at eight points around them whether one can walk there.
        obs_pathing_grid: bool = false, Accepts::Flag;
        /// Whether agents see the height of the ground at these points and below them.
        obs_terrain_height: bool = false, Accepts::Flag;
        /// Whether agents see which part of the episode's limit has passed.
        obs_timestep_number: bool = false, Accepts::Flag;
        /// Whether the state is the agents' observations, one behind the other.
        obs_instead_of_state: bool = false, Accepts::Flag;
        /// Whether the state holds every agent's last action.
        state_last_action: bool = true, Accepts::Flag;
        /// Whether the state holds which part of the episode's limit has passed.
        state_timestep_number: bool = false, Accepts::Flag;
    }
}

impl SkirmishSettings {
    /// Whether agents aim no further than they see.
    #[must_use]
    pub fn aims_within_sight(&self) -> bool {
        self.shoot_range < self.sight_range
    }

    /// Checks that agents aim no further than they see.
    pub(crate) fn check_ranges(&self) -> Result<(), SettingsError> {
        if self.aims_within_sight() {
            return Ok(());
        }
        let (shoot, sight) = (self.shoot_range, self.sight_range);
        let why = "agents can only aim at what they see";
        Err(SettingsError::AtOdds(Box::new([
            WrongSetting {
                name: "shoot_range".to_owned(),
                found: format!("{shoot:?}"),
                expected: format!("less than {sight:?}, which is sight_range: {why}"),
                nearest: None,
            },
            WrongSetting {
                name: "sight_range".to_owned(),
                found: format!("{sight:?}"),
                expected: format!("more than {shoot:?}, which is shoot_range: {why}"),
                nearest: None,
            },
        ])))
    }

    /// Checks every range, and that agents aim no further than they see.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] names the first setting out of range.
    pub fn validate(&self) -> Result<(), SkirmishError> {
        if let Some(violation) = self.violation() {
            return Err(SkirmishError::Setting {
                key: violation.name,
                found: violation.found,
                expected: violation.accepts.to_string(),
            });
        }
        if self.aims_within_sight() {
            return Ok(());
        }
        Err(SkirmishError::Setting {
            key: "shoot_range",
            found: format!("{:?}", self.shoot_range),
            expected: "a number in (0, sight_range), because agents can only aim at what they see"
                .to_owned(),
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

    /// The arguments of `StarCraft2Env` that have a setting, with SMAC's default.
    const OF_SMAC: &str = "
        step_mul = 8
        move_amount = 2.0
        obs_all_health = true
        obs_own_health = true
        obs_last_action = false
        obs_pathing_grid = false
        obs_terrain_height = false
        obs_instead_of_state = false
        obs_timestep_number = false
        state_last_action = true
        state_timestep_number = false
        reward_sparse = false
        reward_only_positive = true
        reward_death_value = 10.0
        reward_win = 200.0
        reward_defeat = 0.0
        reward_negative_scale = 0.5
        reward_scale = true
        reward_scale_rate = 20.0";

    #[test]
    fn options_have_the_names_and_the_defaults_of_smac() {
        let ours = toml::Table::try_from(SkirmishSettings::default()).unwrap();
        let smac: toml::Table = toml::from_str(OF_SMAC).unwrap();
        for (name, default) in &smac {
            assert_eq!(ours.get(name), Some(default), "{name}");
        }
        // What SMAC has in its code, and what it has not.
        let further = [
            "compat",
            "enemy_order",
            "episode_limit",
            "shoot_range",
            "sight_range",
            "spawn_scatter",
            "units",
        ];
        // Tables have the order of their keys or of their declaration, as other crates of a build ask for.
        let names: std::collections::BTreeSet<&str> = ours
            .keys()
            .map(String::as_str)
            .filter(|name| !smac.contains_key(*name))
            .collect();
        assert_eq!(names, further.into());
    }

    #[test]
    fn unknown_settings_are_refused() {
        toml::from_str::<SkirmishSettings>("sight_rang = 9.0").unwrap_err();
    }
}
