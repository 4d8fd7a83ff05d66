//! `mackrl sc2 doctor`: whether StarCraft II can be played on here, and what to do if not.

use std::{net::TcpListener, sync::Arc};

use mackrl_run::config::{EnvironmentConfig, StarCraftKind};
use mackrl_sc2::{
    adapter::{Game, Installation},
    protocol::{ImageData, ResponseGameInfo},
    stand_in::install::is_stand_in,
};
use mackrl_skirmish::{map_names, terrain::MAP_SIZE};
use serde::Serialize;

use super::worlds::{scenario, settings};
use crate::{args::DoctorArgs, failure::Failure, output};

/// One thing that was looked at.
#[derive(Debug, Serialize)]
struct Check {
    name: &'static str,
    is_fine: bool,
    /// What was found.
    found: String,
    /// The one command that mends it.
    #[serde(skip_serializing_if = "Option::is_none")]
    remedy: Option<String>,
}

impl Check {
    fn fine(name: &'static str, found: impl Into<String>) -> Self {
        Self {
            name,
            is_fine: true,
            found: found.into(),
            remedy: None,
        }
    }

    fn wrong(name: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            name,
            is_fine: false,
            found: found.into(),
            remedy: Some(remedy.into()),
        }
    }
}

/// Looks, prints, and fails if anything is wrong.
pub(super) fn run(args: &DoctorArgs) -> anyhow::Result<()> {
    let mut checks = Vec::new();
    let root = Installation::default_root();
    match Installation::find(&root, args.game_version.as_deref()) {
        Err(problem) => checks.push(Check::wrong("game", problem.to_string(), problem.remedy())),
        Ok(game) => {
            let kind = if is_stand_in(&game.program) {
                "the stand-in"
            } else {
                "the game"
            };
            checks.push(Check::fine(
                "game",
                format!("{} in {}", game.version(), root.display()),
            ));
            checks.push(Check::fine(
                "program",
                format!("{}, {kind}", game.program.display()),
            ));
            checks.push(maps(&game));
        }
    }
    checks.push(port());
    if args.start && checks.iter().all(|check| check.is_fine) {
        checks.extend(start(args));
    }
    if args.json {
        output::print_json(&checks)?;
    } else {
        output::print(&table(&checks))?;
    }
    match checks.iter().filter(|check| !check.is_fine).count() {
        0 => Ok(()),
        problems => Err(Failure::NotReady { problems }.into()),
    }
}

fn maps(game: &Installation) -> Check {
    let names = map_names();
    let problems: Vec<_> = names
        .iter()
        .filter_map(|map| game.map_file(map).err())
        .collect();
    match problems.first() {
        None => Check::fine("maps", format!("all {} of SMAC's", names.len())),
        Some(problem) => {
            let found = format!(
                "{} of {} are missing: {problem}",
                problems.len(),
                names.len()
            );
            Check::wrong("maps", found, problem.remedy())
        }
    }
}

fn port() -> Check {
    match TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()) {
        Ok(address) => Check::fine("ports", format!("free ones, such as {}", address.port())),
        Err(error) => Check::wrong("ports", error.to_string(), "ip link set lo up"),
    }
}

/// Starts the game and compares its map with the simulator's.
fn start(args: &DoctorArgs) -> Vec<Check> {
    match look(args) {
        Ok(checks) => checks,
        Err(error) => {
            let remedy = "MACKRL_SC2_START_PATIENCE_S=600 mackrl sc2 doctor --start";
            vec![Check::wrong("start", format!("{error:#}"), remedy)]
        }
    }
}

fn look(args: &DoctorArgs) -> anyhow::Result<Vec<Check>> {
    let mut map = EnvironmentConfig::new(Arc::new(StarCraftKind));
    map.set("map", args.map.as_str())?;
    let scenario = scenario(&map)?;
    let settings = settings(args.game_version.as_deref().unwrap_or_default())?;
    let mut game = Game::launch(&settings, &scenario, 1)?;
    let units = game.observe()?.len();
    let mut checks = vec![Check::fine(
        "start",
        format!("{} with {units} units", args.map),
    )];
    let info = game.info()?;
    let differing = differing_cells(&info, &scenario.field.terrain);
    checks.push(match differing {
        Some(0) => Check::fine("ground", "as the simulator has it"),
        // Agents go by the simulator's ground, which costs nothing but a step that leads nowhere.
        Some(cells) => Check::fine(
            "ground",
            format!("{cells} cells are walkable in one and not in the other"),
        ),
        None => Check::fine("ground", "of a form that cannot be compared"),
    });
    Ok(checks)
}

/// Cells in which the game's pathing grid differs from the simulator's ground.
fn differing_cells(
    info: &ResponseGameInfo,
    terrain: &mackrl_skirmish::terrain::Terrain,
) -> Option<usize> {
    let ImageData {
        bits_per_pixel: Some(1),
        data: Some(data),
        ..
    } = info.start_raw.as_ref()?.pathing_grid.as_ref()?
    else {
        return None;
    };
    let side = i32::try_from(MAP_SIZE).ok()?;
    let cells = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    let mut differing = 0;
    for (index, (x, y)) in cells.enumerate() {
        let is_walkable = data.get(index / 8)? >> (7 - index % 8) & 1 == 1;
        differing += usize::from(is_walkable != terrain.is_walkable(x, y));
    }
    Some(differing)
}

fn table(checks: &[Check]) -> String {
    let mut text = String::new();
    for check in checks {
        let mark = if check.is_fine { "ok   " } else { "WRONG" };
        text.push_str(&format!("{mark}  {:<8} {}\n", check.name, check.found));
        if let Some(remedy) = &check.remedy {
            text.push_str(&format!("                try: {remedy}\n"));
        }
    }
    text
}
