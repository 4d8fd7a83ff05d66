//! Terrain drawn in characters: one line for each row of cells, north at the top.

use std::sync::Arc;

use crate::terrain::{MAP_SIZE, Terrain};

const WALKABLE: char = '.';
const WALL: char = '#';

/// The terrain of a drawing: [`MAP_SIZE`] lines of as many characters, `.` walkable and `#` not. The first line is the
/// northernmost row, y from 31 to 32; empty lines before and after do not count.
pub(super) fn terrain(drawing: &str) -> Result<Arc<Terrain>, String> {
    let lines: Vec<&str> = drawing.trim().lines().map(str::trim_end).collect();
    if lines.len() != MAP_SIZE {
        return Err(format!(
            "the terrain has {} lines, expected {MAP_SIZE}",
            lines.len()
        ));
    }
    let mut walkable = vec![false; MAP_SIZE * MAP_SIZE];
    for (row, line) in lines.iter().enumerate() {
        let columns = line.chars().count();
        if columns != MAP_SIZE {
            return Err(format!(
                "line {} of the terrain has {columns} characters, expected {MAP_SIZE}",
                row + 1
            ));
        }
        let y = MAP_SIZE - 1 - row;
        for (x, character) in line.chars().enumerate() {
            walkable[y * MAP_SIZE + x] = match character {
                WALKABLE => true,
                WALL => false,
                other => {
                    return Err(format!(
                        "line {}, character {} of the terrain is `{}`, expected `{WALKABLE}` (walkable) or `{WALL}` (wall)",
                        row + 1,
                        x + 1,
                        other.escape_default()
                    ));
                }
            };
        }
    }
    if !walkable.contains(&true) {
        return Err("the terrain has no walkable cell".to_owned());
    }
    Ok(Arc::new(Terrain::from_cells(walkable, true)))
}
