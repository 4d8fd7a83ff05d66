//! Who is near whom: discs in rows of eight, so that one look compares a disc with eight others.
//!
//! Each loop fills its own rows, from positions alone: there is nothing to keep up to date, and nothing that is not in the state.

use crate::rules::UnitIndex;

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

/// Discs of some units, in the order in which they were added. Rows behind the last disc are left as they were.
#[derive(Debug, Clone, Default)]
pub(super) struct Discs {
    rows: Vec<Row>,
    count: usize,
}

/// Some places of a row, a bit each; iterates over them from the first on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places(u32);

/// A number for each place of a row. Each step of a computation is best done for all places before the next: then the compiler
/// does it for several at once.
#[inline(always)]
pub(super) fn lanes<T: Copy + Default>(number: impl Fn(usize) -> T) -> [T; LANES] {
    let mut lanes = [T::default(); LANES];
    for (place, lane) in lanes.iter_mut().enumerate() {
        *lane = number(place);
    }
    lanes
}

impl Discs {
    pub(super) fn reserve(&mut self, discs: usize) {
        let rows = discs.div_ceil(LANES).max(self.rows.len());
        self.rows.resize(rows, Row::EMPTY);
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a disc; there is room for as many as were reserved.
    #[inline]
    pub(super) fn push(&mut self, unit: UnitIndex, [x, y]: [f32; 2], radius: f32) {
        let place = self.count % LANES;
        let row = &mut self.rows[self.count / LANES];
        if place == 0 {
            row.x = [FAR; LANES];
        }
        row.x[place] = x;
        row.y[place] = y;
        row.radius[place] = radius;
        row.unit[place] = unit;
        self.count += 1;
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.rows[..self.count.div_ceil(LANES)]
    }

    pub(super) fn rows_mut(&mut self) -> &mut [Row] {
        &mut self.rows[..self.count.div_ceil(LANES)]
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
        let dx = lanes(|place| self.x[place] - x);
        let dy = lanes(|place| self.y[place] - y);
        lanes(|place| dx[place] * dx[place] + dy[place] * dy[place])
    }

    /// Squares of `radius` + the discs' radii + `gap`.
    #[inline(always)]
    pub(super) fn reaches_squared(&self, radius: f32, gap: f32) -> Lane {
        lanes(|place| {
            let reach = radius + self.radius[place] + gap;
            reach * reach
        })
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
        Self::of_signs(lanes(|place| (a[place] - b[place]).to_bits() & mask[place]))
    }

    /// Places at which `negative` is below 0 and `a` is less than `b`.
    #[inline(always)]
    pub(super) fn of_negative_and_less(negative: Lane, a: Lane, b: Lane) -> Self {
        let signs = lanes(|place| negative[place].to_bits() & (a[place] - b[place]).to_bits());
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
