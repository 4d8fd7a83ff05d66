//! Who is near whom: discs in rows of eight, so that one look compares a disc with eight others.
//!
//! Each loop fills its own rows, from positions alone: there is nothing to keep up to date, and nothing that is not in the state.

use crate::rules::{UnitIndex, battle::make_room};

/// Discs in a row.
pub(super) const LANES: usize = 8;
/// A coordinate far from everything, of places in a row that hold no disc.
const FAR: f32 = 1e9;

/// A number for each disc of a row.
pub(super) type Lane = [f32; LANES];

/// Some places of a row: all bits of theirs are set.
pub(super) type Mask = [u32; LANES];

/// All places.
pub(super) const ALL: Mask = [u32::MAX; LANES];
/// The places behind each.
pub(super) const BEHIND: [Mask; LANES] = {
    let mut masks = [[0; LANES]; LANES];
    let mut place = 0;
    while place < LANES {
        let mut behind = place + 1;
        while behind < LANES {
            masks[place][behind] = u32::MAX;
            behind += 1;
        }
        place += 1;
    }
    masks
};

/// Eight discs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) x: Lane,
    pub(super) y: Lane,
    pub(super) radius: Lane,
    pub(super) unit: [UnitIndex; LANES],
}

/// Discs of some units, in the order in which they were added.
#[derive(Debug, Clone, Default)]
pub(super) struct Discs {
    rows: Vec<Row>,
    count: usize,
}

/// Some places of a row, a bit each; iterates over them from the first on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places(u32);

impl Discs {
    pub(super) fn reserve(&mut self, discs: usize) {
        make_room(&mut self.rows, discs.div_ceil(LANES));
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.count = 0;
    }

    pub(super) fn push(&mut self, unit: UnitIndex, [x, y]: [f32; 2], radius: f32) {
        let place = self.count % LANES;
        if place == 0 {
            self.rows.push(Row::EMPTY);
        }
        if let Some(row) = self.rows.last_mut() {
            row.x[place] = x;
            row.y[place] = y;
            row.radius[place] = radius;
            row.unit[place] = unit;
        }
        self.count += 1;
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    pub(super) fn rows_mut(&mut self) -> &mut [Row] {
        &mut self.rows
    }

    /// How many places of row number `row` hold a disc.
    pub(super) fn held(&self, row: usize) -> usize {
        (self.count - row * LANES).min(LANES)
    }
}

impl Row {
    const EMPTY: Self = Self {
        x: [FAR; LANES],
        y: [FAR; LANES],
        radius: [0.0; LANES],
        unit: [0; LANES],
    };

    /// Squares of the distances from a point to the centres.
    #[inline(always)]
    pub(super) fn squares(&self, [x, y]: [f32; 2]) -> Lane {
        let mut dx = [0.0; LANES];
        for place in 0..LANES {
            dx[place] = self.x[place] - x;
        }
        let mut dy = [0.0; LANES];
        for place in 0..LANES {
            dy[place] = self.y[place] - y;
        }
        let mut squares = [0.0; LANES];
        for place in 0..LANES {
            squares[place] = dx[place] * dx[place] + dy[place] * dy[place];
        }
        squares
    }

    /// Squares of `radius` + the discs' radii + `gap`.
    #[inline(always)]
    pub(super) fn reaches_squared(&self, radius: f32, gap: f32) -> Lane {
        let mut squares = [0.0; LANES];
        for place in 0..LANES {
            let reach = radius + self.radius[place] + gap;
            squares[place] = reach * reach;
        }
        squares
    }
}

impl Places {
    /// Places at which `a` is less than `b`.
    #[inline(always)]
    pub(super) fn of_less(a: Lane, b: Lane) -> Self {
        Self::of_less_among(&ALL, a, b)
    }

    /// Places among those of a mask at which `a` is less than `b`. The sign of the difference tells exactly that, and all signs
    /// are found at once.
    #[inline(always)]
    pub(super) fn of_less_among(mask: &Mask, a: Lane, b: Lane) -> Self {
        let mut differences = [0; LANES];
        for place in 0..LANES {
            differences[place] = (a[place] - b[place]).to_bits() & mask[place];
        }
        Self::of_signs(differences)
    }

    /// Places at which `negative` is below 0 and `a` is less than `b`.
    #[inline(always)]
    pub(super) fn of_negative_and_less(negative: Lane, a: Lane, b: Lane) -> Self {
        let mut signs = [0; LANES];
        for place in 0..LANES {
            signs[place] = negative[place].to_bits() & (a[place] - b[place]).to_bits();
        }
        Self::of_signs(signs)
    }

    /// Places of numbers whose first bit is set.
    #[inline(always)]
    fn of_signs(numbers: Mask) -> Self {
        // Mostly there are none.
        if numbers.iter().fold(0, |all, bits| all | bits) >> 31 == 0 {
            return Self(0);
        }
        let mut places = 0;
        for (place, bits) in numbers.iter().enumerate() {
            places |= (bits >> 31) << place;
        }
        Self(places)
    }

    /// Places at which `a` is not less than `b`.
    #[inline(always)]
    pub(super) fn of_not_less(a: Lane, b: Lane) -> Self {
        let Self(less) = Self::of_less(a, b);
        Self(!less & ((1 << LANES) - 1))
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Those that are in both.
    pub(super) fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl Iterator for Places {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let place = self.0.trailing_zeros() as usize % LANES;
        if self.0 == 0 {
            return None;
        }
        self.0 &= self.0 - 1;
        Some(place)
    }
}
