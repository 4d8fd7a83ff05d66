//! `mackrl maps`: what can be played.

mod card;
mod row;

use std::path::Path;

use anyhow::Context;
use card::Card;
use mackrl_env::matrix_game::MATRIX_GAME;
use mackrl_run::{
    config::{ConfigBuilder, ConfigError},
    scenario_file::read_scenario,
};
use mackrl_skirmish::{Skirmish, SkirmishSettings};
use row::Row;

use crate::{
    args::{MapsArgs, world},
    output,
};

/// What the list does not hold: people who want "all maps" want SMAC's.
const ALSO: &str = "\nBesides these, --map takes matrix-game, the game of the paper's Figure 5, and FILE.toml, a scenario of your own.\n\
                    `mackrl maps NAME` shows one of them with its armies and its terrain.\n";

pub(crate) fn run(args: &MapsArgs) -> anyhow::Result<()> {
    if let Some(name) = &args.map {
        return show(name, args.json);
    }
    let rows = match &args.check {
        Some(file) => vec![Row::of(&checked(file)?)],
        None => all()?,
    };
    if args.json {
        return output::print_json(&rows);
    }
    let also = if args.check.is_none() { ALSO } else { "" };
    output::print(&(Row::table(&rows) + also))
}

/// SMAC's maps.
fn all() -> anyhow::Result<Vec<Row>> {
    let names = mackrl_skirmish::map_names().into_iter();
    names
        .map(|name| {
            let skirmish = mackrl_skirmish::make(name, &SkirmishSettings::default());
            Ok(Row::of(&skirmish.context("cannot list the maps")?))
        })
        .collect()
}

/// One map, with all that a person asks about it.
fn show(name: &str, json: bool) -> anyhow::Result<()> {
    let world = world(
        ConfigBuilder::new(crate::registry()),
        &format!("maps {name}"),
        name,
        &[],
    )?;
    if world.name() == MATRIX_GAME {
        let game = card::MatrixGameCard::new(world.world()?.spec());
        return if json {
            output::print_json(&game)
        } else {
            output::print(&game.to_string())
        };
    }
    let card = Card::of(&world.skirmish()?);
    if json {
        output::print_json(&card)
    } else {
        output::print(&card.to_string())
    }
}

/// The scenario in `file`, if nothing is wrong with it.
fn checked(file: &Path) -> anyhow::Result<Skirmish> {
    let text = read_scenario(file)?;
    let name = file.display().to_string();
    let skirmish = mackrl_skirmish::make_custom(&name, &text, &SkirmishSettings::default());
    let skirmish = skirmish.map_err(|error| ConfigError::Scenario {
        message: error.to_string(),
    })?;
    Ok(skirmish)
}
