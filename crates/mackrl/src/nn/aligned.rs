//! A growing buffer whose first element lies at the start of a cache line.
//!
//! A vector of 64 bytes that straddles two cache lines is loaded twice. The offset is found with safe code and kept, so a
//! copy of the buffer is right even where it is no longer aligned.

use crate::Real;

const CACHE_LINE_BYTES: usize = 64;

/// A buffer that grows at most and whose contents start at a cache line.
#[derive(Debug, Clone, Default)]
pub(crate) struct Aligned<R> {
    values: Vec<R>,
    start: usize,
}

impl<R: Real> Aligned<R> {
    /// Makes room for `length` elements, keeping what is there; new elements are zero.
    pub(crate) fn grow(&mut self, length: usize) {
        if self.start + length <= self.values.len() {
            return;
        }
        let length = length.max(2 * self.as_slice().len());
        let slack = CACHE_LINE_BYTES / size_of::<R>();
        let mut values = vec![R::ZERO; length + slack];
        let offset = values.as_ptr().align_offset(CACHE_LINE_BYTES);
        let start = if offset <= slack { offset } else { 0 };
        let old = self.as_slice();
        values[start..start + old.len()].copy_from_slice(old);
        *self = Self { values, start };
    }

    /// Everything there is room for.
    #[inline]
    pub(crate) fn as_slice(&self) -> &[R] {
        &self.values[self.start..]
    }

    /// Everything there is room for.
    #[inline]
    pub(crate) fn as_mut_slice(&mut self) -> &mut [R] {
        &mut self.values[self.start..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growing_keeps_what_is_there_and_zeroes_the_rest() {
        let mut buffer = Aligned::<f32>::default();
        buffer.grow(7);
        buffer.as_mut_slice()[..7].copy_from_slice(&[1., 2., 3., 4., 5., 6., 7.]);
        buffer.grow(1009);
        assert_eq!(
            buffer.as_slice()[..7],
            [1., 2., 3., 4., 5., 6., 7.],
            "lost elements"
        );
        assert!(
            buffer.as_slice()[7 + 16..1009].iter().all(|&x| x == 0.0),
            "new elements"
        );
        assert_eq!(
            buffer.as_slice().as_ptr().align_offset(CACHE_LINE_BYTES),
            0,
            "not at a cache line"
        );
    }
}
