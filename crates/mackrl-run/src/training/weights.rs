//! Weights as safetensors, readable from PyTorch: [outputs, inputs] and the gate order r, z, n.

use mackrl::{
    Error,
    algorithms::StoredState,
    nn::{ParameterLayout, TensorSpec},
};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};

/// A safetensors file of parameters.
#[derive(Debug, Clone, Copy)]
pub struct StoredWeights<'a>(pub &'a [u8]);

impl StoredState for StoredWeights<'_> {
    fn tensors(&self, layout: &ParameterLayout) -> Result<Vec<f32>, Error> {
        read_weights(layout, self.0)
    }

    fn counter(&self, name: &str) -> Result<u64, Error> {
        Err(Error::Data(format!("weights have no count `{name}`")))
    }
}

/// Serialises the tensors of several models side by side.
///
/// # Shapes
/// Each model's parameters are as its layout says.
///
/// # Panics
/// If a model's parameters are not as many as its layout says.
#[must_use]
pub fn write_weights(models: &[(&ParameterLayout, &[f32])]) -> Vec<u8> {
    let mut bytes: Vec<(String, Vec<usize>, Vec<u8>)> = Vec::new();
    for (layout, parameters) in models {
        let parameters = layout.to_pytorch(parameters);
        for tensor in layout.tensors() {
            let values = parameters[tensor.range.clone()].iter();
            let little_endian = values.flat_map(|value| value.to_le_bytes()).collect();
            bytes.push((tensor.name.clone(), tensor.shape.clone(), little_endian));
        }
    }
    let views = bytes.iter().map(|(name, shape, bytes)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes);
        (name, view.expect("the bytes are those of the shape"))
    });
    safetensors::serialize(views, None).expect("names and shapes can be written as JSON")
}

/// Reads one model's parameters out of a file; other tensors are ignored.
///
/// # Errors
/// [`Error::Data`] if the file is damaged, or a tensor is missing, has another shape, or holds a number that is not finite.
pub fn read_weights(layout: &ParameterLayout, file: &[u8]) -> Result<Vec<f32>, Error> {
    let tensors = SafeTensors::deserialize(file)
        .map_err(|error| Error::Data(format!("weights are no safetensors file: {error}")))?;
    // Nothing is allocated for a model before it is known that the file holds one of its size.
    let views = layout
        .tensors()
        .iter()
        .map(|tensor| Ok((tensor, view(&tensors, tensor)?)))
        .collect::<Result<Vec<_>, Error>>()?;
    let mut parameters = vec![0.0; layout.len()];
    for (tensor, view) in views {
        let values = view.data().as_chunks::<4>().0;
        for (parameter, bytes) in parameters[tensor.range.clone()].iter_mut().zip(values) {
            *parameter = f32::from_le_bytes(*bytes);
            if !parameter.is_finite() {
                return Err(Error::Data(format!(
                    "tensor `{}` holds {parameter}, expected finite numbers",
                    tensor.name
                )));
            }
        }
    }
    Ok(layout.from_pytorch(&parameters))
}

/// The tensor in the file that has this name, type and shape.
fn view<'a>(tensors: &SafeTensors<'a>, tensor: &TensorSpec) -> Result<TensorView<'a>, Error> {
    let name = &tensor.name;
    let view = tensors
        .tensor(name)
        .map_err(|_| Error::Data(format!("weights have no tensor `{name}`")))?;
    if view.dtype() != Dtype::F32 || view.shape() != tensor.shape {
        return Err(Error::Data(format!(
            "tensor `{name}` is {:?} of shape {:?}, expected F32 of shape {:?}",
            view.dtype(),
            view.shape(),
            tensor.shape
        )));
    }
    Ok(view)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> ParameterLayout {
        let mut layout = ParameterLayout::new();
        layout.add("critic.input.weight", &[2, 3]);
        layout.add("critic.input.bias", &[2]);
        layout
    }

    #[test]
    fn weights_come_back_as_they_were_written() {
        let layout = layout();
        let parameters: Vec<f32> = (0..8_u8).map(|i| f32::from(i) / 7.0).collect();
        let file = write_weights(&[(&layout, &parameters)]);
        assert_eq!(read_weights(&layout, &file).unwrap(), parameters);
    }

    #[test]
    fn a_damaged_file_is_refused_by_name() {
        let layout = layout();
        let file = write_weights(&[(&layout, &[0.5; 8])]);
        for end in 0..file.len() {
            assert!(
                read_weights(&layout, &file[..end]).is_err(),
                "cut at {end} bytes"
            );
        }
        let message = |file: &[u8]| read_weights(&layout, file).unwrap_err().to_string();
        let broken = write_weights(&[(&layout, &[f32::NAN; 8])]);
        assert!(
            message(&broken).contains("`critic.input.weight` holds NaN"),
            "{}",
            message(&broken)
        );
        let mut other = ParameterLayout::new();
        other.add("critic.input.weight", &[3, 2]);
        let file = write_weights(&[(&other, &[0.0; 6])]);
        assert!(
            message(&file).contains("expected F32 of shape [2, 3]"),
            "{}",
            message(&file)
        );
    }
}
