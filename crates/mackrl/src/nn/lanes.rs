//! Lanes: one kernel source for every width of vector, and for `f64`.
//!
//! A [`Kernel`] is written over [`Lanes`], a handful of lane-wise operations. [`Element::dispatch`] runs it with the
//! instructions that were [chosen](crate::nn::InstructionSet) (through the `pulp` crate, which keeps the code free of
//! `unsafe`), and for `f64` one number at a time. No operation here combines lanes, so a result never depends on how many there are.

use pulp::Simd;

use crate::{
    Real,
    nn::{elementary, instructions},
};

/// The number of columns to which reductions and packed matrices are padded; every width divides it.
pub(crate) const BLOCK: usize = 16;

/// Lane-wise arithmetic of one width.
pub trait Lanes: Copy {
    /// The kind of number in a lane.
    type Element: Element;
    /// A vector of numbers.
    type Vector: Copy;
    /// How many numbers a vector has; divides 16.
    const LANES: usize;

    /// Views a slice as whole vectors, dropping a rest.
    fn vectors(slice: &[Self::Element]) -> &[Self::Vector];
    /// Views a slice as whole vectors, dropping a rest.
    fn vectors_mut(slice: &mut [Self::Element]) -> &mut [Self::Vector];
    /// All lanes the same.
    fn splat(self, value: Self::Element) -> Self::Vector;
    /// a + b
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a − b
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a · b
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a · b + c with one rounding.
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// `value` where `condition` > 0, else 0.
    fn where_positive(self, condition: Self::Vector, value: Self::Vector) -> Self::Vector;
    /// `value` where `condition` > −∞, else −∞.
    fn where_possible(self, condition: Self::Vector, value: Self::Vector) -> Self::Vector;
    /// Copies the numbers that are available, and puts −∞ elsewhere.
    fn copy_where(
        self,
        available: &[bool; BLOCK],
        from: &[Self::Element; BLOCK],
        to: &mut [Self::Element; BLOCK],
    );
    /// eˣ
    fn exp(self, x: Self::Vector) -> Self::Vector;
    /// ln x
    fn ln(self, x: Self::Vector) -> Self::Vector;
    /// tanh x
    fn tanh(self, x: Self::Vector) -> Self::Vector;
    /// 1 / (1 + e⁻ˣ)
    fn sigmoid(self, x: Self::Vector) -> Self::Vector;

    /// The first numbers of a slice, and zeros where it is shorter than a vector.
    fn load(self, slice: &[Self::Element]) -> Self::Vector;
    /// Overwrites the first numbers of a slice, as many as it has.
    fn store(self, slice: &mut [Self::Element], vector: Self::Vector);
}

/// A computation that is written once for every width.
pub trait Kernel<E> {
    /// What it gives.
    type Output;
    /// Runs it with the given lanes.
    fn run<L: Lanes<Element = E>>(self, lanes: L) -> Self::Output;
}

/// A number that networks can be computed in: `f32`, or `f64` for tests.
pub trait Element: Real {
    /// Runs a kernel with the instructions of [`InstructionSet::chosen`](crate::nn::InstructionSet::chosen).
    ///
    /// # Panics
    /// If those cannot be had.
    fn dispatch<K: Kernel<Self>>(kernel: K) -> K::Output;
}

impl Element for f32 {
    #[inline]
    fn dispatch<K: Kernel<Self>>(kernel: K) -> K::Output {
        instructions::dispatch(kernel)
    }
}

impl Element for f64 {
    #[inline]
    fn dispatch<K: Kernel<Self>>(kernel: K) -> K::Output {
        kernel.run(OneByOne)
    }
}

/// Vectors of `f32`.
#[derive(Clone, Copy)]
pub(super) struct Vectors<S>(pub(super) S);

impl<S: Simd> Lanes for Vectors<S> {
    type Element = f32;
    type Vector = S::f32s;
    const LANES: usize = S::F32_LANES;

    #[inline(always)]
    fn vectors(slice: &[f32]) -> &[S::f32s] {
        S::as_simd_f32s(slice).0
    }
    #[inline(always)]
    fn vectors_mut(slice: &mut [f32]) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(slice).0
    }
    #[inline(always)]
    fn load(self, slice: &[f32]) -> S::f32s {
        match S::as_simd_f32s(slice).0.first() {
            Some(vector) => *vector,
            None => self.0.partial_load_f32s(slice),
        }
    }
    #[inline(always)]
    fn store(self, slice: &mut [f32], vector: S::f32s) {
        match S::as_mut_simd_f32s(slice).0.first_mut() {
            Some(place) => *place = vector,
            None => self.0.partial_store_f32s(slice, vector),
        }
    }
    #[inline(always)]
    fn splat(self, value: f32) -> S::f32s {
        self.0.splat_f32s(value)
    }
    #[inline(always)]
    fn add(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.add_f32s(a, b)
    }
    #[inline(always)]
    fn sub(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.sub_f32s(a, b)
    }
    #[inline(always)]
    fn mul(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.mul_f32s(a, b)
    }
    #[inline(always)]
    fn mul_add(self, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        self.0.mul_add_f32s(a, b, c)
    }
    #[inline(always)]
    fn where_positive(self, condition: S::f32s, value: S::f32s) -> S::f32s {
        let zero = self.0.splat_f32s(0.0);
        let mask = self.0.less_than_or_equal_f32s(condition, zero);
        self.0.select_f32s(mask, zero, value)
    }
    #[inline(always)]
    fn where_possible(self, condition: S::f32s, value: S::f32s) -> S::f32s {
        let impossible = self.0.splat_f32s(f32::NEG_INFINITY);
        let mask = self.0.equal_f32s(condition, impossible);
        self.0.select_f32s(mask, impossible, value)
    }
    #[inline(always)]
    fn copy_where(self, available: &[bool; BLOCK], from: &[f32; BLOCK], to: &mut [f32; BLOCK]) {
        // Not a choice for each number, which becomes a jump that cannot be predicted.
        let flags = available.map(u32::from);
        let zero = self.0.splat_u32s(0);
        let impossible = self.0.splat_f32s(f32::NEG_INFINITY);
        let sources = S::as_simd_u32s(&flags).0.iter().zip(Self::vectors(from));
        for (to, (&flags, &from)) in Self::vectors_mut(to).iter_mut().zip(sources) {
            let mask = self.0.greater_than_u32s(flags, zero);
            *to = self.0.select_f32s(mask, from, impossible);
        }
    }
    #[inline(always)]
    fn exp(self, x: S::f32s) -> S::f32s {
        elementary::exp(self.0, x)
    }
    #[inline(always)]
    fn ln(self, x: S::f32s) -> S::f32s {
        elementary::ln(self.0, x)
    }
    #[inline(always)]
    fn tanh(self, x: S::f32s) -> S::f32s {
        elementary::tanh(self.0, x)
    }
    #[inline(always)]
    fn sigmoid(self, x: S::f32s) -> S::f32s {
        elementary::sigmoid(self.0, x)
    }
}

/// "Vectors" of one `f64`.
#[derive(Clone, Copy)]
struct OneByOne;

impl Lanes for OneByOne {
    type Element = f64;
    type Vector = f64;
    const LANES: usize = 1;

    fn vectors(slice: &[f64]) -> &[f64] {
        slice
    }
    fn vectors_mut(slice: &mut [f64]) -> &mut [f64] {
        slice
    }
    fn load(self, slice: &[f64]) -> f64 {
        slice.first().copied().unwrap_or_default()
    }
    fn store(self, slice: &mut [f64], vector: f64) {
        if let Some(place) = slice.first_mut() {
            *place = vector;
        }
    }
    fn splat(self, value: f64) -> f64 {
        value
    }
    fn add(self, a: f64, b: f64) -> f64 {
        a + b
    }
    fn sub(self, a: f64, b: f64) -> f64 {
        a - b
    }
    fn mul(self, a: f64, b: f64) -> f64 {
        a * b
    }
    fn mul_add(self, a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
    fn where_positive(self, condition: f64, value: f64) -> f64 {
        if condition <= 0.0 { 0.0 } else { value }
    }
    fn where_possible(self, condition: f64, value: f64) -> f64 {
        if condition == f64::NEG_INFINITY {
            f64::NEG_INFINITY
        } else {
            value
        }
    }
    fn copy_where(self, available: &[bool; BLOCK], from: &[f64; BLOCK], to: &mut [f64; BLOCK]) {
        for ((to, &from), &available) in to.iter_mut().zip(from).zip(available) {
            *to = if available { from } else { f64::NEG_INFINITY };
        }
    }
    fn exp(self, x: f64) -> f64 {
        Real::exp(x)
    }
    fn ln(self, x: f64) -> f64 {
        Real::ln(x)
    }
    fn tanh(self, x: f64) -> f64 {
        x.tanh()
    }
    fn sigmoid(self, x: f64) -> f64 {
        1.0 / (1.0 + (-x).exp())
    }
}
