//! Masked log-softmax with exploration mixed in, and its gradient.
//!
//! The same probabilities are sampled and differentiated (DESIGN.md 2.2), so exploration is part of the function and not a
//! second one on top. A marginal likelihood depends on few columns of a row (the joint action that was taken, and
//! *delegate*), so the gradient comes in as a short list of columns and goes out dense.

use crate::nn::lanes::{BLOCK, Element, Kernel, Lanes};

/// Log-probabilities of the available columns of each row, explored with probability ε.
///
/// # Equation
/// `log p_c = log((1 − ε) s_c + ε / n)`, s = softmax over the n available columns; `log p_c = −∞` where column c is masked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskedLogSoftmax<R> {
    /// Length of a row.
    pub columns: usize,
    /// ε in [0, 1], the share of exploration.
    pub epsilon: R,
}

impl<E: Element> MaskedLogSoftmax<E> {
    /// Computes `log_p`, and `softmax`, which the gradient needs; masked columns get exactly −∞ and 0.
    ///
    /// A row without any available column gets −∞ and 0 throughout.
    ///
    /// # Shapes
    /// All [rows, columns]; `mask` is true where a column is available.
    ///
    /// # Panics
    /// If the lengths differ or are not a whole number of rows.
    pub fn forward(&self, logits: &[E], mask: &[bool], log_p: &mut [E], softmax: &mut [E]) {
        for length in [mask.len(), log_p.len(), softmax.len()] {
            assert_eq!(
                length,
                logits.len(),
                "logits, mask, log_p and softmax of one shape"
            );
        }
        assert_eq!(
            logits.len() % self.columns,
            0,
            "whole rows of {} columns",
            self.columns
        );
        E::dispatch(Forward {
            law: *self,
            logits,
            mask,
            log_p,
            softmax,
        });
    }

    /// Gives the gradient of one row of logits from that of a few of its log-probabilities.
    ///
    /// `weights` lists columns c with `w_c = ∂J/∂ log p_c`; a column may come twice. A masked column has no gradient.
    ///
    /// # Equation
    /// `g_c = w_c (1 − ε) s_c / p_c`, `∂J/∂logit_j = g_j − s_j Σ_c g_c`
    ///
    /// # Shapes
    /// `log_p`, `softmax` and `gradient` `[columns]`: one row of what [`forward`](Self::forward) gave, and the result.
    ///
    /// # Panics
    /// If a column is out of range.
    pub fn row_gradient(
        &self,
        log_p: &[E],
        softmax: &[E],
        weights: &[(usize, E)],
        gradient: &mut [E],
    ) {
        E::dispatch(RowGradient {
            law: *self,
            log_p,
            softmax,
            weights,
            gradient,
        });
    }

    /// The entropy −Σ p log p of one row of log-probabilities, in nats.
    #[must_use]
    pub fn row_entropy(log_p: &[E]) -> f64 {
        let term = |&log_p: &E| {
            let log_p = log_p.to_f64();
            if log_p == f64::NEG_INFINITY {
                0.0
            } else {
                -log_p.exp() * log_p
            }
        };
        log_p.iter().map(term).sum()
    }
}

struct Forward<'a, R> {
    law: MaskedLogSoftmax<R>,
    logits: &'a [R],
    mask: &'a [bool],
    log_p: &'a mut [R],
    softmax: &'a mut [R],
}

impl<E: Element> Kernel<E> for Forward<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let columns = self.law.columns;
        let sources = self
            .logits
            .chunks_exact(columns)
            .zip(self.mask.chunks_exact(columns));
        let results = self
            .log_p
            .chunks_exact_mut(columns)
            .zip(self.softmax.chunks_exact_mut(columns));
        for ((logits, mask), (log_p, softmax)) in sources.zip(results) {
            let highest = mask_row(lanes, logits, mask, log_p);
            if highest == E::NEG_INFINITY {
                softmax.fill(E::ZERO);
                continue;
            }
            let highest = lanes.splat(highest);
            for (log_p, s) in log_p.chunks_mut(L::LANES).zip(softmax.chunks_mut(L::LANES)) {
                let shifted = lanes.sub(lanes.load(log_p), highest);
                lanes.store(log_p, shifted);
                lanes.store(s, lanes.exp(shifted));
            }
            let total = row_sum(softmax);
            let scale = lanes.splat(E::ONE / total);
            for s in softmax.chunks_mut(L::LANES) {
                lanes.store(s, lanes.mul(lanes.load(s), scale));
            }
            if self.law.epsilon == E::ZERO {
                normalise(lanes, total, log_p);
            } else {
                explore(lanes, self.law.epsilon, mask, softmax, log_p);
            }
        }
    }
}

/// Copies the available logits, puts −∞ elsewhere and gives the highest.
#[inline(always)]
fn mask_row<L: Lanes>(
    lanes: L,
    logits: &[L::Element],
    mask: &[bool],
    masked: &mut [L::Element],
) -> L::Element {
    let impossible = <L::Element as crate::Real>::NEG_INFINITY;
    let mut highest = [impossible; BLOCK];
    let (logits, last_logits) = logits.as_chunks();
    let (mask, last_mask) = mask.as_chunks();
    let (masked, last_masked) = masked.as_chunks_mut();
    for ((logits, mask), masked) in logits.iter().zip(mask).zip(masked) {
        lanes.copy_where(mask, logits, masked);
        raise(&mut highest, masked);
    }
    let length = last_logits.len();
    if length > 0 {
        let (mut logits, mut mask) = ([impossible; BLOCK], [false; BLOCK]);
        logits[..length].copy_from_slice(last_logits);
        mask[..length].copy_from_slice(last_mask);
        let mut masked = [impossible; BLOCK];
        lanes.copy_where(&mask, &logits, &mut masked);
        raise(&mut highest, &masked);
        last_masked.copy_from_slice(&masked[..length]);
    }
    tree(highest, |a, b| if b > a { b } else { a })
}

/// The higher of two numbers in each place.
#[inline(always)]
fn raise<E: Element>(highest: &mut [E; BLOCK], numbers: &[E; BLOCK]) {
    for (highest, &number) in highest.iter_mut().zip(numbers) {
        *highest = if number > *highest { number } else { *highest };
    }
}

/// The sum of a row in 16 parts, whatever the machine's width.
#[inline(always)]
pub(super) fn row_sum<E: Element>(row: &[E]) -> E {
    let mut sums = [E::ZERO; BLOCK];
    let (whole, last) = row.as_chunks::<BLOCK>();
    for part in whole {
        for (sum, &term) in sums.iter_mut().zip(part) {
            *sum += term;
        }
    }
    for (sum, &term) in sums.iter_mut().zip(last) {
        *sum += term;
    }
    tree(sums, |a, b| a + b)
}

/// Combines 16 numbers as a binary tree.
#[inline(always)]
pub(super) fn tree<E: Element>(mut parts: [E; BLOCK], combine: impl Fn(E, E) -> E) -> E {
    let mut half = BLOCK / 2;
    while half > 0 {
        for i in 0..half {
            parts[i] = combine(parts[i], parts[i + half]);
        }
        half /= 2;
    }
    parts[0]
}

/// log p = shifted logit − ln Σ exp(shifted logit)
#[inline(always)]
fn normalise<L: Lanes>(lanes: L, total: L::Element, log_p: &mut [L::Element]) {
    let log_total = lanes.ln(lanes.splat(total));
    for log_p in log_p.chunks_mut(L::LANES) {
        lanes.store(log_p, lanes.sub(lanes.load(log_p), log_total));
    }
}

/// log p = ln((1 − ε) s + ε / n) where the column is available.
#[inline(always)]
fn explore<L: Lanes>(
    lanes: L,
    epsilon: L::Element,
    mask: &[bool],
    softmax: &[L::Element],
    log_p: &mut [L::Element],
) {
    type ElementOf<L> = <L as Lanes>::Element;
    let available = mask.iter().filter(|&&available| available).count();
    let one = <ElementOf<L> as crate::Real>::ONE;
    let count = <ElementOf<L> as crate::Real>::from_f64(available as f64);
    let uniform = lanes.splat(epsilon / count);
    let greedy = lanes.splat(one - epsilon);
    for (log_p, s) in log_p.chunks_mut(L::LANES).zip(softmax.chunks(L::LANES)) {
        let value = lanes.ln(lanes.mul_add(greedy, lanes.load(s), uniform));
        lanes.store(log_p, lanes.where_possible(lanes.load(log_p), value));
    }
}

struct RowGradient<'a, R> {
    law: MaskedLogSoftmax<R>,
    log_p: &'a [R],
    softmax: &'a [R],
    weights: &'a [(usize, R)],
    gradient: &'a mut [R],
}

impl<E: Element> RowGradient<'_, E> {
    /// `g_c` for an entry of `weights`.
    #[inline(always)]
    fn direct<L: Lanes<Element = E>>(&self, lanes: L, &(column, weight): &(usize, E)) -> E {
        let Self { law, log_p, .. } = self;
        if log_p[column] == E::NEG_INFINITY {
            E::ZERO
        } else if law.epsilon == E::ZERO {
            weight
        } else {
            let mut inverse = [E::ZERO];
            lanes.store(&mut inverse, lanes.exp(lanes.splat(-log_p[column])));
            weight * (E::ONE - law.epsilon) * self.softmax[column] * inverse[0]
        }
    }
}

impl<E: Element> Kernel<E> for RowGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        // Sums of floating-point numbers begin with −0.
        let mut total = -E::ZERO;
        for entry in self.weights {
            total += self.direct(lanes, entry);
        }
        for (gradient, &s) in self.gradient.iter_mut().zip(self.softmax) {
            *gradient = -(s * total);
        }
        for entry in self.weights {
            let direct = self.direct(lanes, entry);
            self.gradient[entry.0] += direct;
        }
    }
}
