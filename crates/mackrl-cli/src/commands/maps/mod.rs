//! `mackrl maps`: what can be played.

mod card;
mod known;
mod row;

use std::path::Path;

use anyhow::Context;
use card::Card;
use known::Known;
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
const ALSO: &str = "\ndifficulty: on the real game, by Yu and others, 2021. scripted, trained: battles won here by the best script and the best\n\
                    trained team in this repository; empty where nothing is measured.\n\
                    Besides these, --map takes matrix-game, the game of the paper's Figure 5, and FILE.toml, a scenario of your own.\n\
                    `mackrl maps NAME` shows one of them with its armies, sizes of its arrays and terrain.\n";

pub(crate) fn run(args: &MapsArgs) -> anyhow::Result<()> {
    if let Some(name) = &args.map {
        return show(name, args.json);
    }
    let rows = match &args.check {
        Some(file) => vec![Row::of(&checked(file)?, None)],
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
            Ok(Row::of(
                &skirmish.context("cannot list the maps")?,
                Known::of(name),
            ))
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
    // A scenario of one's own may be called as a map of SMAC is.
    let known = Known::of(name).filter(|_| world.text("scenario").is_empty());
    let card = Card::of(&world.skirmish()?, known);
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
