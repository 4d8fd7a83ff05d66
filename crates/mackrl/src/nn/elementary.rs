//! Exponential, logarithm, hyperbolic tangent and sigmoid of vectors of `f32`.
//!
//! Libraries give different last bits on different machines and for different widths; two agents must not. Each function is
//! one fixed sequence of correctly rounded operations, lane by lane, accurate to a few units in the last place, and none of
//! them ever returns a denormal for an argument that is not one. NaN goes in and out.
//!
//! Ranges are reduced with e^x = 2ⁿ e^r, |r| ≤ ½ ln 2, and ln(2ᵉ m) = e ln 2 + ln m; the rest are plain Taylor series, long
//! enough that what is left out is below a tenth of a unit in the last place.

use pulp::Simd;

use super::lanes::{BLOCK, Element, Kernel, Lanes};

/// 1.5 · 2²³: adding it rounds a number of at most 22 bits to an integer, which then stands in the low bits.
const ROUNDING: f32 = 12_582_912.0;
/// 2²³: its bits plus a small integer are the float 2²³ + that integer.
const TWO_TO_23: f32 = 8_388_608.0;
const MANTISSA_BITS: u32 = 23;
const EXPONENT_BIAS: u32 = 127;

const LN_2_HIGH: f32 = std::f32::consts::LN_2;
#[expect(
    clippy::cast_possible_truncation,
    reason = "the low part of ln 2 is meant to be rounded to f32"
)]
const LN_2_LOW: f32 = (std::f64::consts::LN_2 - LN_2_HIGH as f64) as f32;

/// Below this e^x counts as zero: the next smaller results would be denormal.
const EXP_LOWEST: f32 = -87.0;
/// Above this e^x stays at its value here, 1.65e38.
const EXP_HIGHEST: f32 = 88.0;
/// Above this argument tanh differs from 1 by less than half a unit in the last place.
const TANH_HIGHEST: f32 = 10.0;

/// 1/k! for k = 7, …, 2: the series of e^r − 1 − r, divided by r².
const EXPONENTIAL_SERIES: [f32; 6] = [
    1.0 / 5040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    1.0 / 2.0,
];
/// 2/(2k+1) for k = 5, …, 1: the series of ln((1+s)/(1−s)) − 2s, divided by s³, in s².
const LOGARITHM_SERIES: [f32; 5] = [2.0 / 11.0, 2.0 / 9.0, 2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0];

/// eˣ of one number, as [`exp`] computes it in a vector.
pub(crate) fn exp_one(x: f32) -> f32 {
    let mut result = [0.0];
    exponentials(&[x], &mut result);
    result[0]
}

/// ln x of one number, as [`ln`] computes it in a vector.
pub(crate) fn ln_one(x: f32) -> f32 {
    f32::dispatch(Logarithm(x))
}

/// eˣ of every number.
///
/// # Shapes
/// `x` and `result` have one length.
pub(crate) fn exponentials<E: Element>(x: &[E], result: &mut [E]) {
    debug_assert_eq!(x.len(), result.len(), "a result for every number");
    E::dispatch(Exponentials { x, result });
}

/// ln of every number in its place, all positive and normal.
pub(crate) fn logarithms<E: Element>(values: &mut [E]) {
    E::dispatch(Logarithms { values });
}

struct Logarithms<'a, E> {
    values: &'a mut [E],
}

impl<E: Element> Kernel<E> for Logarithms<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        for part in self.values.chunks_mut(L::LANES) {
            lanes.store(part, lanes.ln(lanes.load(part)));
        }
    }
}

struct Exponentials<'a, E> {
    x: &'a [E],
    result: &'a mut [E],
}

impl<E: Element> Kernel<E> for Exponentials<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let parts = self.x.chunks(L::LANES);
        for (x, result) in parts.zip(self.result.chunks_mut(L::LANES)) {
            lanes.store(result, lanes.exp(lanes.load(x)));
        }
    }
}

struct Logarithm(f32);

impl Kernel<f32> for Logarithm {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes<Element = f32>>(self, lanes: L) -> f32 {
        let mut result = [0.0; BLOCK];
        lanes.store(&mut result, lanes.ln(lanes.splat(self.0)));
        result[0]
    }
}

/// eˣ: exactly 0 below −87, constant above 88.
#[inline(always)]
pub(crate) fn exp<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let highest = simd.splat_f32s(EXP_HIGHEST);
    let clamped = simd.select_f32s(simd.greater_than_f32s(x, highest), highest, x);
    let (power, fraction) = split_exponential(simd, clamped);
    let value = simd.mul_add_f32s(power, fraction, power);
    let vanishes = simd.less_than_f32s(x, simd.splat_f32s(EXP_LOWEST));
    simd.select_f32s(vanishes, simd.splat_f32s(0.0), value)
}

/// tanh x: exactly ±1 beyond ±10.
///
/// # Equation
/// tanh |x| = −e / (2 + e) with e = exp(−2|x|) − 1, which is exact to the last places near zero too.
#[inline(always)]
pub(crate) fn tanh<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let highest = simd.splat_f32s(TANH_HIGHEST);
    let magnitude = simd.abs_f32s(x);
    let too_high = simd.greater_than_f32s(magnitude, highest);
    let magnitude = simd.select_f32s(too_high, highest, magnitude);
    let doubled = simd.mul_f32s(simd.splat_f32s(-2.0), magnitude);
    let (power, fraction) = split_exponential(simd, doubled);
    let below = simd.sub_f32s(power, simd.splat_f32s(1.0));
    let e = simd.mul_add_f32s(power, fraction, below);
    let positive = simd.div_f32s(
        simd.sub_f32s(simd.splat_f32s(0.0), e),
        simd.add_f32s(simd.splat_f32s(2.0), e),
    );
    let sign = simd.and_f32s(x, simd.splat_f32s(-0.0));
    simd.or_f32s(positive, sign)
}

/// 1 / (1 + e⁻ˣ): exactly 1 above 87, constant (1.6e-38) below −87.
#[inline(always)]
pub(crate) fn sigmoid<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let highest = simd.splat_f32s(-EXP_LOWEST);
    let negated = simd.sub_f32s(simd.splat_f32s(0.0), x);
    let too_high = simd.greater_than_f32s(negated, highest);
    let negated = simd.select_f32s(too_high, highest, negated);
    let one = simd.splat_f32s(1.0);
    simd.div_f32s(one, simd.add_f32s(one, exp(simd, negated)))
}

/// ln x for positive normal x.
///
/// # Equation
/// x = 2ᵉ m with √½ ≤ m < √2, s = (m−1)/(m+1): ln x = e ln 2 + 2 (s + s³/3 + s⁵/5 + …)
#[inline(always)]
pub(crate) fn ln<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let (exponent, m) = split_binary(simd, x);
    let one = simd.splat_f32s(1.0);
    let s = simd.div_f32s(simd.sub_f32s(m, one), simd.add_f32s(m, one));
    let square = simd.mul_f32s(s, s);
    let series = horner(simd, &LOGARITHM_SERIES, square);
    let cubic = simd.mul_f32s(simd.mul_f32s(s, square), series);
    let low = simd.mul_add_f32s(exponent, simd.splat_f32s(LN_2_LOW), cubic);
    let fraction = simd.mul_add_f32s(s, simd.splat_f32s(2.0), low);
    let value = simd.mul_add_f32s(exponent, simd.splat_f32s(LN_2_HIGH), fraction);
    let known = simd.greater_than_or_equal_f32s(x, simd.splat_f32s(0.0));
    simd.select_f32s(known, value, simd.splat_f32s(f32::NAN))
}

/// Gives 2ⁿ and e^r − 1 with x = n ln 2 + r, for −88 ≤ x ≤ 88.
#[inline(always)]
fn split_exponential<S: Simd>(simd: S, x: S::f32s) -> (S::f32s, S::f32s) {
    let rounding = simd.splat_f32s(ROUNDING);
    let shifted = simd.mul_add_f32s(x, simd.splat_f32s(std::f32::consts::LOG2_E), rounding);
    let n = simd.sub_f32s(shifted, rounding);
    let r = simd.mul_add_f32s(n, simd.splat_f32s(-LN_2_HIGH), x);
    let r = simd.mul_add_f32s(n, simd.splat_f32s(-LN_2_LOW), r);
    let series = horner(simd, &EXPONENTIAL_SERIES, r);
    let fraction = simd.mul_add_f32s(simd.mul_f32s(r, r), series, r);
    let exponent = simd.wrapping_dyn_shl_u32s(
        simd.transmute_u32s_f32s(shifted),
        simd.splat_u32s(MANTISSA_BITS),
    );
    let bits = simd.add_u32s(exponent, simd.splat_u32s(EXPONENT_BIAS << MANTISSA_BITS));
    (simd.transmute_f32s_u32s(bits), fraction)
}

/// Gives e and m with x = 2ᵉ m and √½ ≤ m < √2.
#[inline(always)]
fn split_binary<S: Simd>(simd: S, x: S::f32s) -> (S::f32s, S::f32s) {
    let lowest = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let bits = simd.transmute_u32s_f32s(x);
    // Biased so that the difference is positive: the shift is then an exact division by 2²³, rounded down.
    let offset = simd.splat_u32s((EXPONENT_BIAS << MANTISSA_BITS).wrapping_sub(lowest));
    let shifted = simd.add_u32s(bits, offset);
    let biased = simd.wrapping_dyn_shr_u32s(shifted, simd.splat_u32s(MANTISSA_BITS));
    let e = simd.sub_u32s(biased, simd.splat_u32s(EXPONENT_BIAS));
    let e_in_place = simd.wrapping_dyn_shl_u32s(e, simd.splat_u32s(MANTISSA_BITS));
    let m = simd.transmute_f32s_u32s(simd.sub_u32s(bits, e_in_place));
    let counted = simd.add_u32s(biased, simd.splat_u32s(TWO_TO_23.to_bits()));
    let start = simd.splat_f32s(TWO_TO_23 + 127.0);
    (simd.sub_f32s(simd.transmute_f32s_u32s(counted), start), m)
}

/// A polynomial, highest coefficient first.
#[inline(always)]
fn horner<S: Simd>(simd: S, coefficients: &[f32], x: S::f32s) -> S::f32s {
    let mut sum = simd.splat_f32s(coefficients[0]);
    for &coefficient in &coefficients[1..] {
        sum = simd.mul_add_f32s(sum, x, simd.splat_f32s(coefficient));
    }
    sum
}

#[cfg(test)]
mod tests {
    use crate::nn::{
        instructions::{InstructionSet, on},
        lanes::{BLOCK, Element, Kernel, Lanes},
    };

    #[derive(Debug, Clone, Copy)]
    enum Function {
        Exp,
        Ln,
        Tanh,
        Sigmoid,
    }

    impl Function {
        /// The function of each number, through the kernels.
        fn of(self, numbers: &[f32]) -> Vec<f32> {
            let mut results = numbers.to_vec();
            f32::dispatch(Apply {
                function: self,
                values: &mut results,
            });
            results
        }

        fn exact(self, x: f64) -> f64 {
            match self {
                Self::Exp => x.exp(),
                Self::Ln => x.ln(),
                Self::Tanh => x.tanh(),
                Self::Sigmoid => 1.0 / (1.0 + (-x).exp()),
            }
        }
    }

    struct Apply<'a> {
        function: Function,
        values: &'a mut [f32],
    }

    impl Kernel<f32> for Apply<'_> {
        type Output = ();

        fn run<L: Lanes<Element = f32>>(self, lanes: L) {
            for part in self.values.chunks_mut(L::LANES) {
                let x = lanes.load(part);
                let y = match self.function {
                    Function::Exp => lanes.exp(x),
                    Function::Ln => lanes.ln(x),
                    Function::Tanh => lanes.tanh(x),
                    Function::Sigmoid => lanes.sigmoid(x),
                };
                lanes.store(part, y);
            }
        }
    }

    /// Largest error in units of the last place over evenly spaced numbers.
    fn largest_error(function: Function, from: f64, to: f64) -> f64 {
        const COUNT: i32 = 100_003;
        let numbers: Vec<f32> = (0..COUNT)
            .map(|i| crate::Real::from_f64(from + (to - from) * f64::from(i) / f64::from(COUNT)))
            .collect();
        let results = function.of(&numbers);
        let errors = numbers.iter().zip(results).map(|(&x, y)| {
            let exact = function.exact(f64::from(x));
            let unit = f64::from(y.abs().next_up()) - f64::from(y.abs());
            (f64::from(y) - exact).abs() / unit
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn results_are_accurate_to_a_few_units_in_the_last_place() {
        for (function, from, to) in [
            (Function::Exp, -87.0, 88.0),
            (Function::Exp, -1.0, 1.0),
            (Function::Ln, 1e-6, 1e-3),
            (Function::Ln, 0.01, 3.0),
            (Function::Ln, 3.0, 1e4),
            (Function::Tanh, -12.0, 12.0),
            (Function::Tanh, -0.3, 0.3),
            (Function::Sigmoid, -86.0, 90.0),
            (Function::Sigmoid, -3.0, 3.0),
        ] {
            let error = largest_error(function, from, to);
            assert!(error < 4.0, "{function:?} in [{from}, {to}]: {error} units");
        }
    }

    #[test]
    fn results_saturate_and_are_never_denormal() {
        let far = [
            -f32::INFINITY,
            -1e30,
            -200.0,
            -90.0,
            90.0,
            200.0,
            1e30,
            f32::INFINITY,
        ];
        assert_eq!(
            Function::Exp.of(&far)[..4],
            [0.0; 4],
            "vanishing exponentials"
        );
        assert!(
            Function::Exp.of(&far).iter().all(|x| x.is_finite()),
            "large exponentials"
        );
        assert_eq!(
            Function::Tanh.of(&far),
            [-1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0],
            "tanh"
        );
        assert_eq!(Function::Sigmoid.of(&far)[4..], [1.0; 4], "sigmoid");
        let low = &Function::Sigmoid.of(&far)[..4];
        assert!(
            low.iter().all(|&x| x < 1e-37 && x.is_normal()),
            "sigmoid: {low:?}"
        );
        assert_eq!(Function::Ln.of(&[1.0]), [0.0], "ln 1");
        assert_eq!(Function::Exp.of(&[0.0]), [1.0], "exp 0");
    }

    #[test]
    fn nan_stays_nan() {
        for function in [
            Function::Exp,
            Function::Ln,
            Function::Tanh,
            Function::Sigmoid,
        ] {
            assert!(function.of(&[f32::NAN])[0].is_nan(), "{function:?}");
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let numbers: Vec<f32> = (0..4 * BLOCK + 5).map(|i| i as f32 * 0.37 - 9.0).collect();
        let positive: Vec<f32> = numbers.iter().map(|x| x.abs() * 0.1 + 1e-4).collect();
        for (function, numbers) in [
            (Function::Exp, &numbers),
            (Function::Ln, &positive),
            (Function::Tanh, &numbers),
            (Function::Sigmoid, &numbers),
        ] {
            let chosen = function.of(numbers);
            for set in InstructionSet::available() {
                let results = on(set, || function.of(numbers));
                assert_eq!(results, chosen, "{function:?} with {set}");
            }
        }
    }
}
