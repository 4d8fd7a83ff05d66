//! Shortest ways over a grid of cells, from everywhere to everywhere.
//!
//! A map has at most a thousand cells, so all ways are found once, when the terrain is made, and walking costs a look-up.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::terrain::MAP_SIZE;

/// Steps to the eight neighbours and their lengths in tenths of a cell.
const STEPS: [(isize, isize, u32); 8] = [
    (1, 0, 10),
    (-1, 0, 10),
    (0, 1, 10),
    (0, -1, 10),
    (1, 1, 14),
    (1, -1, 14),
    (-1, 1, 14),
    (-1, -1, 14),
];
const NO_CELL: u16 = u16::MAX;

/// The next cell on a shortest way from any walkable cell to any other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Paths {
    /// Number of each cell among the walkable ones.
    number: Vec<u16>,
    /// Number of walkable cells.
    count: usize,
    /// Next cell, index `number of destination * count + number of start`.
    next: Vec<u16>,
}

impl Paths {
    /// All ways over the walkable cells. Diagonal steps need both cells beside them, so that nobody cuts a corner.
    pub(super) fn new(walkable: &[bool]) -> Self {
        let mut number = vec![NO_CELL; walkable.len()];
        let cells: Vec<usize> = (0..walkable.len()).filter(|cell| walkable[*cell]).collect();
        for (position, cell) in cells.iter().enumerate() {
            number[*cell] = u16::try_from(position).expect("a map has 1024 cells");
        }
        let mut paths = Self {
            number,
            count: cells.len(),
            next: vec![NO_CELL; cells.len() * cells.len()],
        };
        for cell in &cells {
            paths.find_ways_to(*cell, walkable);
        }
        paths
    }

    /// The cell after `from` on a shortest way to `to`; `None` at the destination and where there is no way.
    pub(super) fn next(&self, from: usize, to: usize) -> Option<usize> {
        let (from, to) = (self.number[from], self.number[to]);
        if from == NO_CELL || to == NO_CELL || from == to {
            return None;
        }
        let next = self.next[usize::from(to) * self.count + usize::from(from)];
        (next != NO_CELL).then_some(usize::from(next))
    }

    /// Dijkstra's algorithm, backwards from the destination.
    fn find_ways_to(&mut self, destination: usize, walkable: &[bool]) {
        let row = usize::from(self.number[destination]) * self.count;
        let mut distance = vec![u32::MAX; walkable.len()];
        distance[destination] = 0;
        let mut frontier = BinaryHeap::from([Reverse((0, destination))]);
        while let Some(Reverse((length, cell))) = frontier.pop() {
            if length > distance[cell] {
                continue;
            }
            for (dx, dy, step) in STEPS {
                let Some(other) = neighbour(cell, dx, dy, walkable) else {
                    continue;
                };
                if length + step < distance[other] {
                    distance[other] = length + step;
                    self.next[row + usize::from(self.number[other])] =
                        u16::try_from(cell).expect("a map has 1024 cells");
                    frontier.push(Reverse((length + step, other)));
                }
            }
        }
    }
}

fn neighbour(cell: usize, dx: isize, dy: isize, walkable: &[bool]) -> Option<usize> {
    let (x, y) = (cell % MAP_SIZE, cell / MAP_SIZE);
    let other_x = x.checked_add_signed(dx).filter(|x| *x < MAP_SIZE)?;
    let other_y = y.checked_add_signed(dy).filter(|y| *y < MAP_SIZE)?;
    let other = other_y * MAP_SIZE + other_x;
    let is_open =
        walkable[other] && walkable[y * MAP_SIZE + other_x] && walkable[other_y * MAP_SIZE + x];
    is_open.then_some(other)
}
