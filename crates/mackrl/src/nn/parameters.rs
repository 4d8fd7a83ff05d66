//! The parameters of a model: named tensors in one flat vector.
//!
//! One vector is what an optimiser, a gradient norm and a checkpoint want; names are what people and checkpoints of other
//! libraries want. A matrix is stored as [inputs, outputs], because outputs are the lanes of our kernels; PyTorch and our
//! checkpoints store [outputs, inputs], and [`ParameterLayout::to_pytorch`] goes from one to the other.

use std::ops::Range;

use mackrl_env::{Draw, EpisodeKey};

use crate::Real;

/// One named tensor of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TensorSpec {
    /// Its name, such as `pair_controller.gru.weight_ih`.
    pub name: String,
    /// Its shape as PyTorch has it: [outputs, inputs] or `[outputs]`.
    pub shape: Vec<usize>,
    /// Where it lies in the flat vector.
    pub range: Range<usize>,
}

/// The tensors of a model and their places in its flat parameter vector.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ParameterLayout {
    tensors: Vec<TensorSpec>,
    len: usize,
}

impl ParameterLayout {
    /// A layout without tensors.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends a tensor of the given PyTorch shape and returns its place.
    pub fn add(&mut self, name: impl Into<String>, shape: &[usize]) -> Range<usize> {
        let range = self.len..self.len + shape.iter().product::<usize>();
        self.len = range.end;
        self.tensors.push(TensorSpec {
            name: name.into(),
            shape: shape.to_vec(),
            range: range.clone(),
        });
        range
    }

    /// The same places under names that begin with `prefix`, for what stands beside the parameters in a checkpoint.
    #[must_use]
    pub fn prefixed(&self, prefix: &str) -> Self {
        let mut layout = self.clone();
        for tensor in &mut layout.tensors {
            tensor.name.insert_str(0, prefix);
        }
        layout
    }

    /// All tensors, in the order of their places.
    #[must_use]
    pub fn tensors(&self) -> &[TensorSpec] {
        &self.tensors
    }

    /// Length of the flat vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no parameters.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The tensor that holds the parameter with this index.
    #[must_use]
    pub fn tensor_at(&self, index: usize) -> Option<&TensorSpec> {
        let after = self
            .tensors
            .partition_point(|tensor| tensor.range.end <= index);
        self.tensors.get(after)
    }

    /// The same parameters with every matrix as [outputs, inputs].
    ///
    /// # Panics
    /// If `parameters` is not [`len`](Self::len) long.
    #[must_use]
    pub fn to_pytorch<R: Real>(&self, parameters: &[R]) -> Vec<R> {
        self.convert(parameters, |[outputs, inputs]| [inputs, outputs])
    }

    /// The inverse of [`to_pytorch`](Self::to_pytorch).
    ///
    /// # Panics
    /// If `parameters` is not [`len`](Self::len) long.
    #[must_use]
    pub fn from_pytorch<R: Real>(&self, parameters: &[R]) -> Vec<R> {
        self.convert(parameters, |shape| shape)
    }

    /// Transposes every matrix; `source_shape` gives the shape in which it lies now from its PyTorch shape.
    fn convert<R: Real>(
        &self,
        parameters: &[R],
        source_shape: impl Fn([usize; 2]) -> [usize; 2],
    ) -> Vec<R> {
        assert_eq!(
            parameters.len(),
            self.len,
            "length of the flat parameter vector"
        );
        let mut converted = parameters.to_vec();
        for tensor in &self.tensors {
            if let [outputs, inputs] = tensor.shape[..] {
                let [rows, columns] = source_shape([outputs, inputs]);
                let source = &parameters[tensor.range.clone()];
                let target = &mut converted[tensor.range.clone()];
                for (place, &value) in source.iter().enumerate() {
                    target[place % columns * rows + place / columns] = value;
                }
            }
        }
        converted
    }
}

/// Fills a tensor with numbers uniform in ±`bound`, one draw per index of the flat vector.
pub(crate) fn fill_uniform<R: Real>(
    key: &EpisodeKey,
    range: Range<usize>,
    bound: f64,
    parameters: &mut [R],
) {
    for index in range {
        let uniform = key.uniform(0, Draw::Setup(index));
        parameters[index] = R::from_f64(bound * (2.0 * uniform - 1.0));
    }
}

/// Fills a matrix [rows, columns] with `gain` times a random orthogonal one (Saxe and others, 2014): its rows, or its columns
/// where there are fewer, are orthonormal.
///
/// Normal vectors, orthogonalised one after the other in double precision: the directions are uniform.
pub(crate) fn fill_orthogonal<R: Real>(
    key: &EpisodeKey,
    range: Range<usize>,
    [rows, columns]: [usize; 2],
    gain: f64,
    parameters: &mut [R],
) {
    assert_eq!(range.len(), rows * columns, "the matrix fills its place");
    let (count, length) = (rows.min(columns), rows.max(columns));
    let mut vectors: Vec<Vec<f64>> = Vec::with_capacity(count);
    for i in 0..count {
        let number = |j| key.normal(0, Draw::Setup(range.start + i * length + j));
        let mut vector: Vec<f64> = (0..length).map(number).collect();
        // Twice, because what rounding leaves of other directions is large where little is left of the vector.
        for _ in 0..2 {
            for other in &vectors {
                let along = dot(&vector, other);
                let parts = vector.iter_mut().zip(other);
                parts.for_each(|(x, y)| *x -= along * y);
            }
        }
        let norm = dot(&vector, &vector).sqrt();
        vector.iter_mut().for_each(|x| *x /= norm);
        vectors.push(vector);
    }
    for (place, value) in parameters[range].iter_mut().enumerate() {
        let (row, column) = (place / columns, place % columns);
        let entry = if rows <= columns {
            vectors[row][column]
        } else {
            vectors[column][row]
        };
        *value = R::from_f64(gain * entry);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> ParameterLayout {
        let mut layout = ParameterLayout::new();
        layout.add("a.weight", &[2, 3]);
        layout.add("a.bias", &[2]);
        layout
    }

    #[test]
    fn an_orthogonal_matrix_has_orthonormal_rows_or_columns() {
        let key = EpisodeKey::new(3, mackrl_env::Stream::Other, 0);
        for [rows, columns] in [[3, 7], [7, 3], [5, 5]] {
            let mut matrix = vec![0.0_f64; rows * columns];
            fill_orthogonal(&key, 0..rows * columns, [rows, columns], 2.0, &mut matrix);
            let (count, length) = (rows.min(columns), rows.max(columns));
            let vector = |i: usize| -> Vec<f64> {
                let at = |j| {
                    if rows <= columns {
                        i * columns + j
                    } else {
                        j * columns + i
                    }
                };
                (0..length).map(|j| matrix[at(j)]).collect()
            };
            for i in 0..count {
                for j in 0..count {
                    let expected = if i == j { 4.0 } else { 0.0 };
                    assert!((dot(&vector(i), &vector(j)) - expected).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn tensors_lie_one_after_the_other() {
        let layout = layout();
        assert_eq!(layout.len(), 8, "length");
        assert_eq!(layout.tensors()[1].range, 6..8, "range of the bias");
        assert_eq!(
            layout.tensor_at(5).unwrap().name,
            "a.weight",
            "tensor of the last weight"
        );
        assert_eq!(
            layout.tensor_at(6).unwrap().name,
            "a.bias",
            "tensor of the first bias"
        );
        assert_eq!(layout.tensor_at(8), None, "beyond the end");
    }

    #[test]
    fn pytorch_order_has_outputs_first_and_comes_back() {
        let layout = layout();
        // weight[input][output] = 10 * output + input
        let ours = [0., 10., 1., 11., 2., 12., 7., 8.];
        let theirs = layout.to_pytorch(&ours);
        assert_eq!(
            theirs,
            [0., 1., 2., 10., 11., 12., 7., 8.],
            "[outputs, inputs]"
        );
        assert_eq!(layout.from_pytorch(&theirs), ours, "and back");
    }
}
