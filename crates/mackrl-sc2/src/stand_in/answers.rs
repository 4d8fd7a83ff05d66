//! What the arena looks like in messages.

use mackrl_skirmish::{
    rules::{Profile, Unit as BattleUnit},
    terrain::MAP_SIZE,
    unit_types::Layer,
};

use super::arena::{Arena, owner};
use crate::{
    protocol::{
        ImageData, InterfaceOptions, Observation, ObservationRaw, PlayerCommon, PlayerInfo,
        PlayerType, Point, PointI, RectangleI, ResponseData, ResponseGameInfo, ResponseObservation,
        ResponsePing, Size2DI, StartRaw, Unit, UnitTypeData,
    },
    units,
};

/// The least type number of the agents' units. The real game's lie in this region.
const FIRST_ALLY_TYPE: u32 = 1970;
/// The number of the player who is the client.
pub(super) const AGENTS_PLAYER: u32 = 1;
/// The version whose API this is.
pub(super) const GAME_VERSION: &str = "4.10.0";
/// The number of that version, which names its folder.
pub(super) const BASE_BUILD: u32 = 75689;
/// Loops that speeds in messages are per: a second at normal speed.
const LOOPS_PER_SECOND: f32 = 16.0;

/// Who answers. People see by `data_version` that it is not the game.
pub(super) fn ping() -> ResponsePing {
    ResponsePing {
        game_version: Some(GAME_VERSION.to_owned()),
        data_version: Some(concat!("MACKRL-STAND-IN-", env!("CARGO_PKG_VERSION")).to_owned()),
        data_build: Some(BASE_BUILD),
        base_build: Some(BASE_BUILD),
    }
}

/// The map. `difficulty` is what was asked of the computer: the enemies follow their map's order at every one.
pub(super) fn game_info(arena: &Arena, difficulty: i32) -> ResponseGameInfo {
    let scenario = arena.scenario();
    let players = [
        (AGENTS_PLAYER, PlayerType::Participant, None),
        (AGENTS_PLAYER + 1, PlayerType::Computer, Some(difficulty)),
    ];
    ResponseGameInfo {
        map_name: Some(scenario.name.clone()),
        local_map_path: Some(units::map_path(&scenario.name)),
        player_info: players
            .map(|(number, kind, difficulty)| PlayerInfo {
                player_id: Some(number),
                r#type: Some(kind.into()),
                race_requested: Some(race(scenario.races[number as usize - 1]).into()),
                difficulty,
            })
            .into(),
        start_raw: Some(ground(arena)),
        options: Some(InterfaceOptions {
            raw: Some(true),
            score: Some(false),
            ..InterfaceOptions::default()
        }),
    }
}

/// Everybody who lives: agents in their order, then enemies in theirs.
pub(super) fn observation(arena: &Arena) -> ResponseObservation {
    let state = arena.state();
    let living = (0..state.units.len()).filter(|index| state.units[*index].is_alive());
    ResponseObservation {
        observation: Some(Observation {
            player_common: Some(PlayerCommon {
                player_id: Some(AGENTS_PLAYER),
            }),
            raw_data: Some(ObservationRaw {
                units: living.map(|index| unit(arena, index)).collect(),
            }),
            game_loop: Some(arena.game_loop()),
        }),
    }
}

/// The unit types of the map.
pub(super) fn data(arena: &Arena) -> ResponseData {
    let scenario = arena.scenario();
    let mut types: Vec<UnitTypeData> = scenario
        .recruits
        .iter()
        .map(|recruit| {
            let profile = &scenario.field.profiles[usize::from(recruit.kind)];
            UnitTypeData {
                unit_id: Some(units::unit_type(scenario, recruit, FIRST_ALLY_TYPE)),
                name: Some(profile.name.clone()),
                movement_speed: Some(profile.speed * LOOPS_PER_SECOND),
            }
        })
        .collect();
    types.sort_by_key(|kind| kind.unit_id);
    types.dedup_by_key(|kind| kind.unit_id);
    ResponseData { units: types }
}

/// The game's number of a people.
pub(crate) const fn race(race: mackrl_skirmish::scenario::Race) -> crate::protocol::Race {
    use mackrl_skirmish::scenario::Race;
    match race {
        Race::Terran => crate::protocol::Race::Terran,
        Race::Zerg => crate::protocol::Race::Zerg,
        Race::Protoss => crate::protocol::Race::Protoss,
    }
}

fn unit(arena: &Arena, index: usize) -> Unit {
    let (scenario, state) = (arena.scenario(), arena.state());
    let recruit = &scenario.recruits[index];
    let unit: &BattleUnit = &state.units[index];
    let profile: &Profile = &scenario.field.profiles[usize::from(unit.kind)];
    let owner = owner(unit.team);
    Unit {
        display_type: Some(1),
        alliance: Some(if owner == crate::protocol::OWNER_ALLY {
            1
        } else {
            4
        }),
        tag: Some(arena.tag(index)),
        unit_type: Some(units::unit_type(scenario, recruit, FIRST_ALLY_TYPE)),
        owner: Some(owner),
        pos: Some(Point {
            x: Some(state.x[index]),
            y: Some(state.y[index]),
            z: Some(0.0),
        }),
        facing: Some(0.0),
        radius: Some(profile.radius),
        build_progress: Some(1.0),
        health: Some(unit.life),
        health_max: Some(profile.life),
        shield: Some(unit.shield),
        shield_max: Some(profile.shield),
        energy: Some(unit.energy),
        energy_max: Some(profile.greatest_energy),
        is_flying: Some(profile.layer == Layer::Air),
        weapon_cooldown: Some(unit.cooldown.max(0.0)),
    }
}

fn ground(arena: &Arena) -> StartRaw {
    let terrain = &arena.scenario().field.terrain;
    let size = i32::try_from(MAP_SIZE).unwrap_or(i32::MAX);
    let cells = || (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
    let mut pathing = vec![0_u8; MAP_SIZE * MAP_SIZE / 8];
    for (index, (x, y)) in cells().enumerate() {
        pathing[index / 8] |= u8::from(terrain.is_walkable(x, y)) << (7 - index % 8);
    }
    // SMAC turns the rows of heights upside down, whatever the game sends.
    let heights = cells().map(|(x, y)| byte(terrain.height(x, size - 1 - y)));
    let image = |bits_per_pixel: i32, data: Vec<u8>| ImageData {
        bits_per_pixel: Some(bits_per_pixel),
        size: Some(Size2DI {
            x: Some(size),
            y: Some(size),
        }),
        data: Some(data),
    };
    let corner = |at: i32| PointI {
        x: Some(at),
        y: Some(at),
    };
    StartRaw {
        map_size: Some(Size2DI {
            x: Some(size),
            y: Some(size),
        }),
        terrain_height: Some(image(8, heights.collect())),
        pathing_grid: Some(image(1, pathing)),
        playable_area: Some(RectangleI {
            p0: Some(corner(0)),
            p1: Some(corner(size)),
        }),
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the range of a byte"
)]
fn byte(height: f32) -> u8 {
    (height * 255.0).round().clamp(0.0, 255.0) as u8
}
