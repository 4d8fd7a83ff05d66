//! How the game numbers the units of SMAC's maps.
//!
//! Enemies have the game's own types. The agents' units have types of their own, which do not fight unasked; each map numbers
//! them in alphabetical order from some number on, which clients find out by the least number among them.

use mackrl_skirmish::{Scenario, rules::Team, scenario::Recruit};

/// Where SMAC's maps are in a folder of maps.
pub const MAP_FOLDER: &str = "SMAC_Maps";
/// What the names of map files end in.
pub const MAP_EXTENSION: &str = "SC2Map";

/// The path by which clients name a map.
#[must_use]
pub fn map_path(map: &str) -> String {
    format!("{MAP_FOLDER}/{map}.{MAP_EXTENSION}")
}

/// The map that a client names by `path`.
#[must_use]
pub fn map_name(path: &str) -> Option<&str> {
    let file = path.rsplit(['/', '\\']).next()?;
    file.strip_suffix(MAP_EXTENSION)?.strip_suffix('.')
}

/// Kinds of the agents of `scenario`, in the order in which their types are numbered.
#[must_use]
pub fn ally_kinds(scenario: &Scenario) -> Vec<u8> {
    let allies = scenario
        .recruits
        .iter()
        .filter(|recruit| recruit.team == Team::Ally);
    let mut kinds: Vec<u8> = allies.map(|recruit| recruit.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// The type of `recruit`, if the agents' types are numbered from `first_ally_type` on.
#[must_use]
pub fn unit_type(scenario: &Scenario, recruit: &Recruit, first_ally_type: u32) -> u32 {
    match recruit.team {
        Team::Enemy => scenario.type_ids[usize::from(recruit.kind)],
        Team::Ally => {
            let kinds = ally_kinds(scenario);
            let place = kinds
                .iter()
                .position(|kind| *kind == recruit.kind)
                .unwrap_or_default();
            first_ally_type + u32::try_from(place).unwrap_or_default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_named_by_its_file_wherever_that_lies() {
        assert_eq!(map_name(&map_path("2s3z")), Some("2s3z"));
        assert_eq!(map_name("C:\\Maps\\3m.SC2Map"), Some("3m"));
        assert_eq!(map_name("3m"), None);
        assert_eq!(map_name("SMAC_Maps/3mSC2Map"), None);
    }
}
