//! Products of matrices, in which a row's result never depends on its neighbours.
//!
//! One register tile of a few rows by a few vectors of columns holds its sums through the whole inner dimension; each lane
//! runs `acc = fma(a[r][k], b[k][j], acc)` for k ascending. How rows and columns fall into tiles therefore decides how fast a
//! number comes, never which number. Weights are copied ([`Packed`]) once per update into panels of at most 64 columns, so
//! that a panel lies in the first cache while all rows pass over it.

use crate::{
    Real,
    nn::{
        aligned::Aligned,
        lanes::{BLOCK, Element, Kernel, Lanes},
    },
};

/// Columns of a panel: 64 numbers are four AVX-512 vectors.
const PANEL: usize = 64;
/// Rows of the largest register tile.
pub(super) const TILE: usize = 6;

/// A matrix of rows that may lie apart: row `r` starts at `values[r * stride]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a, R> {
    pub(crate) values: &'a [R],
    pub(crate) stride: usize,
}

/// A matrix [inner, columns] cut into panels of columns, each [inner, at most 64] and padded with zeros to 16 columns.
#[derive(Debug, Clone, Default)]
pub(crate) struct Packed<R> {
    values: Aligned<R>,
    inner: usize,
    columns: usize,
}

impl<R: Real> Packed<R> {
    /// Sets the shape; what was packed before is lost.
    pub(crate) fn resize(&mut self, inner: usize, columns: usize) {
        (self.inner, self.columns) = (inner, columns);
        self.values.grow(inner * columns.next_multiple_of(BLOCK));
    }

    /// Copies `source[k * stride..][..length]` to row k of the columns from `column` on.
    pub(crate) fn pack(&mut self, source: Rows<'_, R>, column: usize, length: usize) {
        for k in 0..self.inner {
            let row = &source.values[k * source.stride..][..length];
            let mut done = 0;
            while done < length {
                let at = column + done;
                let take = (length - done).min(PANEL - at % PANEL);
                let place = self.place(k, at);
                let target = &mut self.values.as_mut_slice()[place..][..take];
                target.copy_from_slice(&row[done..][..take]);
                done += take;
            }
        }
    }

    /// Copies the transpose of `count` columns of `source` to the rows from `inner` on: row `inner + c`, column k gets
    /// `source[k * stride + c]`.
    pub(crate) fn pack_transposed(&mut self, source: Rows<'_, R>, inner: usize, count: usize) {
        for k in 0..self.columns {
            let row = &source.values[k * source.stride..][..count];
            let (start, width) = (self.place(0, k), self.width_at(k));
            let target = &mut self.values.as_mut_slice()[start..];
            for (c, &value) in row.iter().enumerate() {
                target[(inner + c) * width] = value;
            }
        }
    }

    /// Width of the panel that holds a column.
    fn width_at(&self, column: usize) -> usize {
        let first = column - column % PANEL;
        (self.columns - first).next_multiple_of(BLOCK).min(PANEL)
    }

    fn place(&self, k: usize, column: usize) -> usize {
        let within = column % PANEL;
        (column - within) * self.inner + k * self.width_at(column) + within
    }
}

/// What the sums of a [`Product`] start from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Start<'a, R> {
    /// The same row for every row.
    Bias(&'a [R]),
    /// What the result's place holds.
    Kept,
    /// Zero.
    Zero,
}

/// `c[r, j] = start[r, j] + Σ_k a[r, k] b[k, j]`, for r in 0..`rows`.
#[derive(Debug)]
pub(crate) struct Product<'a, R> {
    pub(crate) rows: usize,
    pub(crate) a: Rows<'a, R>,
    pub(crate) b: &'a Packed<R>,
    pub(crate) start: Start<'a, R>,
    pub(crate) c: &'a mut [R],
    pub(crate) c_stride: usize,
}

impl<E: Element> Product<'_, E> {
    /// Computes it.
    pub(crate) fn compute(self) {
        E::dispatch(self);
    }

    #[inline(always)]
    fn panels<L: Lanes<Element = E>, const VECTORS: usize>(mut self, lanes: L) {
        let mut column = 0;
        while column < self.b.columns {
            let width = self.b.width_at(column);
            let panel = &self.b.values.as_slice()[column * self.b.inner..][..width * self.b.inner];
            let per_row = width / L::LANES;
            // Vectors that hold padding alone are left out.
            let used = width.min(self.b.columns - column).div_ceil(L::LANES);
            let mut first = 0;
            while first < used {
                let at = column + first * L::LANES;
                if used - first >= VECTORS {
                    self.strip::<L, VECTORS>(lanes, panel, per_row, first, at);
                    first += VECTORS;
                } else if used - first >= 2 {
                    self.strip::<L, 2>(lanes, panel, per_row, first, at);
                    first += 2;
                } else {
                    self.strip::<L, 1>(lanes, panel, per_row, first, at);
                    first += 1;
                }
            }
            column += width;
        }
    }

    /// All rows of `VECTORS` vectors of columns, of which the first is column `at`.
    #[inline(always)]
    fn strip<L: Lanes<Element = E>, const VECTORS: usize>(
        &mut self,
        lanes: L,
        panel: &[E],
        per_row: usize,
        first: usize,
        at: usize,
    ) {
        let panel = L::vectors(panel);
        let mut row = 0;
        while row < self.rows {
            let left = self.rows - row;
            if left >= TILE {
                self.tile::<L, TILE, VECTORS>(lanes, panel, per_row, first, [row, at]);
                row += TILE;
            } else if left >= 4 {
                self.tile::<L, 4, VECTORS>(lanes, panel, per_row, first, [row, at]);
                row += 4;
            } else if left >= 2 {
                self.tile::<L, 2, VECTORS>(lanes, panel, per_row, first, [row, at]);
                row += 2;
            } else {
                self.tile::<L, 1, VECTORS>(lanes, panel, per_row, first, [row, at]);
                row += 1;
            }
        }
    }

    #[inline(always)]
    fn tile<L: Lanes<Element = E>, const ROWS: usize, const VECTORS: usize>(
        &mut self,
        lanes: L,
        panel: &[L::Vector],
        per_row: usize,
        first: usize,
        [row, column]: [usize; 2],
    ) {
        let inner = self.b.inner;
        let length = (self.b.columns - column).min(VECTORS * L::LANES);
        let mut sums = [[lanes.splat(E::ZERO); VECTORS]; ROWS];
        match self.start {
            Start::Bias(bias) => {
                let mut first = sums[0];
                load_row(lanes, &bias[column..][..length], &mut first);
                sums = [first; ROWS];
            }
            Start::Kept => {
                for (i, sum) in sums.iter_mut().enumerate() {
                    let place = (row + i) * self.c_stride + column;
                    load_row(lanes, &self.c[place..][..length], sum);
                }
            }
            Start::Zero => {}
        }
        let mut a: [&[E]; ROWS] = [&[]; ROWS];
        for (i, a) in a.iter_mut().enumerate() {
            *a = &self.a.values[(row + i) * self.a.stride..][..inner];
        }
        let sums = {
            let mut held = sums;
            for (k, b) in panel.chunks_exact(per_row).enumerate() {
                multiply_add(lanes, &a, k, &b[first..], &mut held);
            }
            held
        };
        for (i, sum) in sums.iter().enumerate() {
            let place = (row + i) * self.c_stride + column;
            store_row(lanes, &mut self.c[place..][..length], sum);
        }
    }
}

impl<E: Element> Kernel<E> for Product<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        // 6 x 4 sums fit the 32 registers of AVX-512 and NEON has as many; 6 x 2 fit the 16 of AVX2.
        if L::LANES == BLOCK {
            self.panels::<L, 4>(lanes);
        } else {
            self.panels::<L, 2>(lanes);
        }
    }
}

/// sums[i][v] += a[i][k] · b[v]
#[inline(always)]
fn multiply_add<L: Lanes, const ROWS: usize, const VECTORS: usize>(
    lanes: L,
    a: &[&[L::Element]; ROWS],
    k: usize,
    b: &[L::Vector],
    sums: &mut [[L::Vector; VECTORS]; ROWS],
) {
    let b = &b[..VECTORS];
    for (sum, a) in sums.iter_mut().zip(a) {
        let a = lanes.splat(a[k]);
        for (sum, &b) in sum.iter_mut().zip(b) {
            *sum = lanes.mul_add(a, b, *sum);
        }
    }
}

/// Loads vectors from a slice that may be shorter than they are.
///
/// Here and in [`store_row`] the loop has a constant length, or else the compiler keeps the sums in memory.
#[inline(always)]
pub(super) fn load_row<L: Lanes, const VECTORS: usize>(
    lanes: L,
    slice: &[L::Element],
    vectors: &mut [L::Vector; VECTORS],
) {
    for (v, vector) in vectors.iter_mut().enumerate() {
        let [from, to] = [v, v + 1].map(|v| slice.len().min(v * L::LANES));
        *vector = lanes.load(&slice[from..to]);
    }
}

/// Stores as much of the vectors as the slice holds.
#[inline(always)]
pub(super) fn store_row<L: Lanes, const VECTORS: usize>(
    lanes: L,
    slice: &mut [L::Element],
    vectors: &[L::Vector; VECTORS],
) {
    for (v, &vector) in vectors.iter().enumerate() {
        let [from, to] = [v, v + 1].map(|v| slice.len().min(v * L::LANES));
        lanes.store(&mut slice[from..to], vector);
    }
}
