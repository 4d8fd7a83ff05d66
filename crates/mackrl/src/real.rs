//! The two kinds of real number: `f32` in networks, `f64` in oracles and tests.
//!
//! Exponentials and logarithms are never those of the platform's library, whose last bits differ from machine to machine: a
//! choice is drawn from them, and two agents on different machines must draw the same one.

use std::{
    convert::identity,
    fmt::Debug,
    iter::Sum,
    ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign},
};

use crate::nn::elementary;

/// A floating-point number.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Sum
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// log 0
    const NEG_INFINITY: Self;

    /// The nearest number of this kind.
    fn from_f64(value: f64) -> Self;
    /// The same number with 64 bits.
    fn to_f64(self) -> f64;
    /// eˣ
    #[must_use]
    fn exp(self) -> Self;
    /// ln x
    #[must_use]
    fn ln(self) -> Self;
    /// √x
    #[must_use]
    fn sqrt(self) -> Self;
    /// The larger of two numbers.
    #[must_use]
    fn max(self, other: Self) -> Self;
    /// |x|
    #[must_use]
    fn abs(self) -> Self;
    /// `self * factor + term` with one rounding.
    #[must_use]
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

macro_rules! real {
    ($float:ty, $from:expr, $exp:expr, $ln:expr) => {
        impl Real for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const NEG_INFINITY: Self = Self::NEG_INFINITY;

            fn from_f64(value: f64) -> Self {
                $from(value)
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn exp(self) -> Self {
                $exp(self)
            }
            fn ln(self) -> Self {
                $ln(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            fn abs(self) -> Self {
                self.abs()
            }
            fn mul_add(self, factor: Self, term: Self) -> Self {
                self.mul_add(factor, term)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
        }
    };
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the nearest f32 is what is asked for"
)]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

real!(f32, to_f32, elementary::exp_one, elementary::ln_one);
real!(f64, identity, libm::exp, libm::log);
