//! Layer normalisation (Ba and others, 2016) without gain and bias: the affine layer that follows has both.
//!
//! Sums over a row have 16 parts whatever the machine's width, so a row's result depends on that row alone.

use crate::{
    Real,
    nn::{
        lanes::{BLOCK, Element, Kernel, Lanes},
        softmax::{row_sum, tree},
    },
};

/// Added to the variance.
const EPSILON: f64 = 1e-5;
/// Numbers kept of each row for the backward pass: what a zero became, and 1 / standard deviation.
pub(crate) const KEPT: usize = 2;

/// Normalises rows of observations, which need no way back.
pub(crate) fn normalise_rows<E: Element>(columns: usize, values: &mut [E]) {
    E::dispatch(NormaliseRows { columns, values });
}

struct NormaliseRows<'a, R> {
    columns: usize,
    values: &'a mut [R],
}

impl<E: Element> Kernel<E> for NormaliseRows<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        for row in self.values.chunks_exact_mut(self.columns) {
            normalise(lanes, row);
        }
    }
}

/// Normalises rows in place and keeps what the way back needs; where it rectifies, max(x, 0) instead of x.
///
/// # Equation
/// `y = (x − μ) / √(σ² + 1e-5)`, with the mean μ and the variance σ² of the row.
#[derive(Debug)]
pub(crate) struct Normalise<'a, R> {
    /// Length of a row.
    pub(crate) columns: usize,
    /// Whether max(x, 0) is normalised, or x.
    pub(crate) rectifies: bool,
    /// [rows, columns]
    pub(crate) values: &'a mut [R],
    /// [rows, 2], written.
    pub(crate) kept: &'a mut [R],
}

impl<E: Element> Kernel<E> for Normalise<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let rows = self.values.chunks_exact_mut(self.columns);
        for (row, kept) in rows.zip(self.kept.chunks_exact_mut(KEPT)) {
            if self.rectifies {
                for part in row.chunks_mut(L::LANES) {
                    let value = lanes.load(part);
                    lanes.store(part, lanes.where_positive(value, value));
                }
            }
            kept.copy_from_slice(&normalise(lanes, row));
        }
    }
}

/// From the gradient of what [`Normalise`] gave to that of its argument, in place.
///
/// # Equation
/// `∂x_j = (∂y_j − mean(∂y) − y_j mean(∂y · y)) / √(σ² + 1e-5)`; 0 where it rectifies and x was not positive.
#[derive(Debug)]
pub(crate) struct NormaliseGradient<'a, R> {
    /// Length of a row.
    pub(crate) columns: usize,
    /// As in [`Normalise`].
    pub(crate) rectifies: bool,
    /// [rows, columns]
    pub(crate) normalised: &'a [R],
    /// [rows, 2]
    pub(crate) kept: &'a [R],
    /// [rows, columns]
    pub(crate) gradient: &'a mut [R],
}

impl<E: Element> Kernel<E> for NormaliseGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let count = E::from_f64(self.columns as f64);
        let rows = self.normalised.chunks_exact(self.columns);
        let gradients = self.gradient.chunks_exact_mut(self.columns);
        for ((y, dy), kept) in rows.zip(gradients).zip(self.kept.chunks_exact(KEPT)) {
            let mean = row_sum(dy) / count;
            let along = sum_of_products(dy, y) / count;
            let [zero, scale] = [kept[0], kept[1]].map(|number| lanes.splat(number));
            let (mean, along) = (lanes.splat(mean), lanes.splat(-along));
            for (dy, y) in dy.chunks_mut(L::LANES).zip(y.chunks(L::LANES)) {
                let value = lanes.load(y);
                let centred = lanes.sub(lanes.load(dy), mean);
                let dx = lanes.mul(lanes.mul_add(value, along, centred), scale);
                lanes.store(
                    dy,
                    if self.rectifies {
                        lanes.where_positive(lanes.sub(value, zero), dx)
                    } else {
                        dx
                    },
                );
            }
        }
    }
}

/// Normalises a row and gives what a zero became, and 1 / standard deviation.
#[inline(always)]
fn normalise<L: Lanes>(lanes: L, row: &mut [L::Element]) -> [L::Element; KEPT] {
    let number = <L::Element as Real>::from_f64;
    let count = number(row.len() as f64);
    let mean = lanes.splat(row_sum(row) / count);
    for part in row.chunks_mut(L::LANES) {
        lanes.store(part, lanes.sub(lanes.load(part), mean));
    }
    let variance = sum_of_products(row, row) / count;
    let scale = <L::Element as Real>::ONE / (variance + number(EPSILON)).sqrt();
    let factor = lanes.splat(scale);
    for part in row.chunks_mut(L::LANES) {
        lanes.store(part, lanes.mul(lanes.load(part), factor));
    }
    let mut zero = [<L::Element as Real>::ZERO; BLOCK];
    let centred = lanes.sub(lanes.splat(<L::Element as Real>::ZERO), mean);
    lanes.store(&mut zero, lanes.mul(centred, factor));
    [zero[0], scale]
}

/// Σ a b in 16 parts.
#[inline(always)]
fn sum_of_products<E: Element>(a: &[E], b: &[E]) -> E {
    let mut sums = [E::ZERO; BLOCK];
    for (a, b) in a.chunks(BLOCK).zip(b.chunks(BLOCK)) {
        for ((sum, &a), &b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    tree(sums, |a, b| a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_mean_0_and_variance_1_and_a_constant_row_is_0() {
        let mut values = [1.0_f64, 2.0, 6.0, 4.0, 4.0, 4.0];
        normalise_rows(3, &mut values);
        let [a, b, c, rest @ ..] = values;
        let deviation = (14.0_f64 / 3.0 + 1e-5).sqrt();
        for (found, expected) in [(a, -2.0), (b, -1.0), (c, 3.0)] {
            assert!((found - expected / deviation).abs() < 1e-12, "{found}");
        }
        assert_eq!(rest, [0.0; 3]);
    }

    #[test]
    fn the_gradient_is_that_of_the_function() {
        let x = [0.3_f64, -0.7, 1.9, 0.2, 0.8, -0.1, 0.4, 2.5, 0.6, -1.3];
        let coefficients = [0.5, -1.0, 2.0, 0.25, 0.7, -0.3, 1.1, -0.9, 0.4, 0.8];
        let run = |x: &[f64]| {
            let (mut y, mut kept) = (x.to_vec(), vec![0.0; 2 * KEPT]);
            f64::dispatch(Normalise {
                columns: 5,
                rectifies: true,
                values: &mut y,
                kept: &mut kept,
            });
            (y, kept)
        };
        let loss = |x: &[f64]| -> f64 {
            let (y, _) = run(x);
            y.iter().zip(coefficients).map(|(y, c)| y * c).sum()
        };
        let (y, kept) = run(&x);
        let mut gradient = coefficients;
        f64::dispatch(NormaliseGradient {
            columns: 5,
            rectifies: true,
            normalised: &y,
            kept: &kept,
            gradient: &mut gradient,
        });
        for i in 0..x.len() {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut moved = x;
                moved[i] += step;
                loss(&moved)
            });
            let slope = (above - below) / 2e-6;
            assert!((gradient[i] - slope).abs() < 1e-6, "{i}: {slope}");
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        use crate::nn::instructions::{InstructionSet, on};
        let numbers: Vec<f32> = (0..6 * 37)
            .map(|i| (i * i % 41) as f32 * 0.3 - 5.0)
            .collect();
        let run = || {
            let (mut values, mut kept) = (numbers.clone(), vec![0.0; 6 * KEPT]);
            f32::dispatch(Normalise {
                columns: 37,
                rectifies: true,
                values: &mut values,
                kept: &mut kept,
            });
            let mut gradient = numbers.clone();
            f32::dispatch(NormaliseGradient {
                columns: 37,
                rectifies: true,
                normalised: &values,
                kept: &kept,
                gradient: &mut gradient,
            });
            (values, kept, gradient)
        };
        let chosen = run();
        for set in InstructionSet::available() {
            assert_eq!(on(set, run), chosen, "{set}");
        }
    }
}
