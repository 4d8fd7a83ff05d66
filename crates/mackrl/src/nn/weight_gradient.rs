//! Gradients of weights and biases: the only sums over rows, so the only results for which the rows' order matters.
//!
//! As in [`product`](crate::nn::product), a register tile holds its sums through the whole sum, here over rows. Many steps
//! are therefore given at once: a tile is then loaded and stored once for all of them.

use crate::nn::{
    aligned::Aligned,
    lanes::{BLOCK, Element, Kernel, Lanes},
    product::{Rows, TILE, load_row, store_row},
};

/// `gradient[k, j] += Σ_r a[r, k] d[r, j]`, for r in 0..`rows`: the gradient of a weight, from its layer's inputs `a`
/// [rows, inner] and the gradient `d` [rows, columns] of its outputs.
#[derive(Debug)]
pub(crate) struct WeightGradient<'a, R> {
    pub(crate) rows: usize,
    pub(crate) inner: usize,
    pub(crate) columns: usize,
    pub(crate) a: Rows<'a, R>,
    pub(crate) d: Rows<'a, R>,
    pub(crate) gradient: &'a mut [R],
    pub(crate) gradient_stride: usize,
    /// Room for 16 numbers a row.
    pub(crate) scratch: &'a mut Aligned<R>,
}

impl<E: Element> WeightGradient<'_, E> {
    /// Computes it.
    pub(crate) fn compute(self) {
        E::dispatch(self);
    }

    #[inline(always)]
    fn strips<L: Lanes<Element = E>, const VECTORS: usize>(mut self, lanes: L) {
        let whole = self.columns - self.columns % BLOCK;
        let d = self.d;
        let mut column = 0;
        while column < whole {
            if whole - column >= VECTORS * L::LANES {
                self.strip::<L, VECTORS>(lanes, d, column, column);
                column += VECTORS * L::LANES;
            } else if whole - column >= 2 * L::LANES {
                self.strip::<L, 2>(lanes, d, column, column);
                column += 2 * L::LANES;
            } else {
                self.strip::<L, 1>(lanes, d, column, column);
                column += L::LANES;
            }
        }
        if whole < self.columns {
            self.copied::<L, 1>(lanes, whole);
        }
    }

    #[inline(always)]
    fn copies<L: Lanes<Element = E>, const VECTORS: usize>(mut self, lanes: L) {
        for column in (0..self.columns).step_by(BLOCK) {
            self.copied::<L, VECTORS>(lanes, column);
        }
    }

    /// At most 16 columns, copied side by side first.
    #[inline(always)]
    fn copied<L: Lanes<Element = E>, const VECTORS: usize>(&mut self, lanes: L, column: usize) {
        let length = (self.columns - column).min(BLOCK);
        let mut scratch = std::mem::take(self.scratch);
        scratch.grow(self.rows * BLOCK);
        let (places, _) = scratch.as_mut_slice().as_chunks_mut::<BLOCK>();
        let rows = self.d.values.chunks(self.d.stride).take(self.rows);
        for (place, d) in places.iter_mut().zip(rows) {
            match d[column..].first_chunk() {
                Some(whole) => *place = *whole,
                None => {
                    place[..length].copy_from_slice(&d[column..][..length]);
                    place[length..].fill(E::ZERO);
                }
            }
        }
        let d = Rows {
            values: scratch.as_slice(),
            stride: BLOCK,
        };
        for first in (0..length).step_by(VECTORS * L::LANES) {
            self.strip::<L, VECTORS>(lanes, d, first, column + first);
        }
        *self.scratch = scratch;
    }

    /// All rows of the gradient, for the `VECTORS` vectors of columns that start at `from` in `d` and at `to` in the gradient.
    #[inline(always)]
    fn strip<L: Lanes<Element = E>, const VECTORS: usize>(
        &mut self,
        lanes: L,
        d: Rows<'_, E>,
        from: usize,
        to: usize,
    ) {
        let mut k = 0;
        while k < self.inner {
            let left = self.inner - k;
            if left >= TILE {
                self.tile::<L, TILE, VECTORS>(lanes, d, from, to, k);
                k += TILE;
            } else if left >= 4 {
                self.tile::<L, 4, VECTORS>(lanes, d, from, to, k);
                k += 4;
            } else {
                self.tile::<L, 1, VECTORS>(lanes, d, from, to, k);
                k += 1;
            }
        }
    }

    #[inline(always)]
    fn tile<L: Lanes<Element = E>, const ROWS: usize, const VECTORS: usize>(
        &mut self,
        lanes: L,
        d: Rows<'_, E>,
        from: usize,
        to: usize,
        first: usize,
    ) {
        let length = (self.columns - to).min(VECTORS * L::LANES);
        let mut sums = [[lanes.splat(E::ZERO); VECTORS]; ROWS];
        for (i, sum) in sums.iter_mut().enumerate() {
            let place = (first + i) * self.gradient_stride + to;
            load_row(lanes, &self.gradient[place..][..length], sum);
        }
        let mut held = sums;
        let a = self.a.values.chunks(self.a.stride);
        for (a, d) in a.zip(d.values.chunks(d.stride)).take(self.rows) {
            let a = &a[first..][..ROWS];
            let d = L::vectors(&d[from..][..VECTORS * L::LANES]);
            for (sum, &a) in held.iter_mut().zip(a) {
                let a = lanes.splat(a);
                for (sum, &d) in sum.iter_mut().zip(d) {
                    *sum = lanes.mul_add(a, d, *sum);
                }
            }
        }
        let sums = held;
        for (i, sum) in sums.iter().enumerate() {
            let place = (first + i) * self.gradient_stride + to;
            store_row(lanes, &mut self.gradient[place..][..length], sum);
        }
    }
}

impl<E: Element> Kernel<E> for WeightGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        if L::LANES == BLOCK {
            self.strips::<L, 4>(lanes);
        } else if 2 * L::LANES == BLOCK {
            self.copies::<L, 2>(lanes);
        } else if 4 * L::LANES == BLOCK {
            self.copies::<L, 4>(lanes);
        } else {
            self.strips::<L, 2>(lanes);
        }
    }
}

/// `sums[j] += Σ_r d[r, j]`, for r in 0..`rows`: the gradient of a bias.
#[derive(Debug)]
pub(crate) struct ColumnSums<'a, R> {
    pub(crate) rows: usize,
    pub(crate) d: Rows<'a, R>,
    pub(crate) sums: &'a mut [R],
}

impl<E: Element> ColumnSums<'_, E> {
    /// Computes it.
    pub(crate) fn compute(self) {
        E::dispatch(self);
    }
}

impl<E: Element> Kernel<E> for ColumnSums<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let columns = self.sums.len();
        for d in self.d.values.chunks(self.d.stride).take(self.rows) {
            for (sums, d) in self
                .sums
                .chunks_mut(L::LANES)
                .zip(d[..columns].chunks(L::LANES))
            {
                let sum = lanes.add(lanes.load(sums), lanes.load(d));
                lanes.store(sums, sum);
            }
        }
    }
}
