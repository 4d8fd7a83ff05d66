//! The exponential linear unit and the absolute value of every number, with their ways back.

use crate::nn::lanes::{Element, Kernel, Lanes};

/// x where x > 0, else eˣ − 1, in place (Clevert and others, 2016).
pub(crate) fn elu<E: Element>(values: &mut [E]) {
    E::dispatch(Elu { values });
}

/// Turns the gradient of what [`elu`] gave, `values`, into that of what it was given.
pub(crate) fn elu_gradient<E: Element>(values: &[E], gradient: &mut [E]) {
    E::dispatch(EluGradient { values, gradient });
}

/// |x|, into `result`.
pub(crate) fn absolute<E: Element>(values: &[E], result: &mut [E]) {
    E::dispatch(Absolute { values, result });
}

/// Turns the gradient of |`values`| into that of `values`: 0 where they are 0, as PyTorch does.
pub(crate) fn absolute_gradient<E: Element>(values: &[E], gradient: &mut [E]) {
    E::dispatch(AbsoluteGradient { values, gradient });
}

struct Elu<'a, R> {
    values: &'a mut [R],
}

impl<E: Element> Kernel<E> for Elu<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let one = lanes.splat(E::ONE);
        for part in self.values.chunks_mut(L::LANES) {
            let x = lanes.load(part);
            let positive = lanes.where_positive(x, x);
            let below = lanes.sub(lanes.exp(lanes.sub(x, positive)), one);
            lanes.store(part, lanes.add(positive, below));
        }
    }
}

struct EluGradient<'a, R> {
    values: &'a [R],
    gradient: &'a mut [R],
}

impl<E: Element> Kernel<E> for EluGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let one = lanes.splat(E::ONE);
        let values = self.values.chunks(L::LANES);
        for (gradient, value) in self.gradient.chunks_mut(L::LANES).zip(values) {
            let y = lanes.load(value);
            let slope = lanes.add(one, lanes.sub(y, lanes.where_positive(y, y)));
            lanes.store(gradient, lanes.mul(lanes.load(gradient), slope));
        }
    }
}

struct Absolute<'a, R> {
    values: &'a [R],
    result: &'a mut [R],
}

impl<E: Element> Kernel<E> for Absolute<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let zero = lanes.splat(E::ZERO);
        let values = self.values.chunks(L::LANES);
        for (result, value) in self.result.chunks_mut(L::LANES).zip(values) {
            let x = lanes.load(value);
            let negated = lanes.sub(zero, x);
            let [above, below] = [x, negated].map(|x| lanes.where_positive(x, x));
            lanes.store(result, lanes.add(above, below));
        }
    }
}

struct AbsoluteGradient<'a, R> {
    values: &'a [R],
    gradient: &'a mut [R],
}

impl<E: Element> Kernel<E> for AbsoluteGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let zero = lanes.splat(E::ZERO);
        let values = self.values.chunks(L::LANES);
        for (gradient, value) in self.gradient.chunks_mut(L::LANES).zip(values) {
            let (x, g) = (lanes.load(value), lanes.load(gradient));
            let above = lanes.where_positive(x, g);
            let below = lanes.where_positive(lanes.sub(zero, x), g);
            lanes.store(gradient, lanes.sub(above, below));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 7] = [-30.0, -1.25, -1e-3, 0.5, 1e-3, 2.0, 40.0];

    fn elu_of(x: f64) -> f64 {
        let mut values = [x];
        elu(&mut values);
        values[0]
    }

    fn absolute_of(x: f64) -> f64 {
        let mut result = [0.0];
        absolute(&[x], &mut result);
        result[0]
    }

    fn check(x: f64, slope: f64, function: impl Fn(f64) -> f64) {
        let numeric = (function(x + 1e-6) - function(x - 1e-6)) / 2e-6;
        assert!((slope - numeric).abs() < 1e-6, "{x}: {slope}, {numeric}");
    }

    #[test]
    fn slopes_are_those_of_the_functions() {
        for x in X {
            let mut gradient = [1.0];
            elu_gradient(&[elu_of(x)], &mut gradient);
            check(x, gradient[0], elu_of);
            let mut gradient = [1.0];
            absolute_gradient(&[x], &mut gradient);
            check(x, gradient[0], absolute_of);
        }
        let mut gradient = [1.0];
        absolute_gradient(&[0.0], &mut gradient);
        assert_eq!(gradient, [0.0]);
    }

    #[test]
    fn values_are_those_of_their_definitions() {
        let x: Vec<f32> = (-50..50_i16).map(|i| f32::from(i) / 7.0).collect();
        let (mut elus, mut absolutes) = (x.clone(), vec![0.0; x.len()]);
        elu(&mut elus);
        absolute(&x, &mut absolutes);
        for ((&x, &elu), &absolute) in x.iter().zip(&elus).zip(&absolutes) {
            let wide = f64::from(x);
            let expected = if wide > 0.0 { wide } else { wide.exp() - 1.0 };
            assert!((f64::from(elu) - expected).abs() < 2e-7, "{x}: {elu}");
            assert_eq!(absolute, x.abs());
        }
    }
}
