//! The search for numbers that are infinite or NaN.

use crate::{
    Real,
    nn::lanes::{Element, Kernel, Lanes},
};

/// Numbers that are looked at together; the result of each block is looked at before the next.
const BLOCK: usize = 1024;

/// The index of the first number that is infinite or NaN.
///
/// Which tensor that is, [`ParameterLayout::tensor_at`](crate::nn::ParameterLayout::tensor_at) tells.
#[must_use]
pub fn first_not_finite<E: Element>(values: &[E]) -> Option<usize> {
    let block = E::dispatch(FirstBlock { values })?;
    let first = block * BLOCK;
    let within = values[first..]
        .iter()
        .position(|value| !value.is_finite())?;
    Some(first + within)
}

/// Finds the first block that is not finite throughout.
///
/// Whether a number is finite is a comparison, and comparisons joined by "or" may be made in any order: unlike a sum of
/// `x · 0`, which is no quicker than a test of each number, because floating-point sums keep their order.
struct FirstBlock<'a, E> {
    values: &'a [E],
}

impl<E: Element> Kernel<E> for FirstBlock<'_, E> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, _: L) -> Option<usize> {
        self.values.chunks(BLOCK).position(holds_broken)
    }
}

/// Whether any number is infinite or NaN.
#[inline(always)]
pub(super) fn holds_broken<R: Real>(values: &[R]) -> bool {
    let mut broken = 0;
    for &value in values {
        broken |= u32::from(!value.is_finite());
    }
    broken != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::instructions::{InstructionSet, on};

    #[test]
    fn the_first_broken_number_is_found() {
        let mut numbers = vec![1.0_f32; 5003];
        assert_eq!(first_not_finite(&numbers), None, "all finite");
        numbers[4001] = f32::NAN;
        numbers[4007] = f32::INFINITY;
        assert_eq!(first_not_finite(&numbers), Some(4001), "first of two");
        numbers[13] = f32::NEG_INFINITY;
        assert_eq!(first_not_finite(&numbers), Some(13), "first of three");
        assert_eq!(first_not_finite::<f32>(&[]), None, "nothing");
    }

    #[test]
    fn one_broken_number_is_found_wherever_it_is_on_every_width() {
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for place in (0..1063).step_by(13) {
                let mut numbers = vec![f32::MAX; 1063];
                numbers[place] = broken;
                assert_eq!(first_not_finite(&numbers), Some(place), "{broken}");
                for set in InstructionSet::available() {
                    let found = on(set, || first_not_finite(&numbers));
                    assert_eq!(found, Some(place), "{broken} {set}");
                }
            }
        }
    }
}
