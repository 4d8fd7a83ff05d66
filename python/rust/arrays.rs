//! NumPy arrays that belong to the caller, as slices that worlds write into.
//!
//! Nothing is copied and nothing is converted: an array of another type or shape is refused in words, because a copy would be
//! written into and thrown away.

use numpy::{Element, IxDyn, PyArrayDyn, PyArrayMethods, PyReadonlyArray, PyReadwriteArray, dtype};
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
};

/// An array of the caller's, borrowed to be written.
pub(crate) type Written<'py, T> = PyReadwriteArray<'py, T, IxDyn>;
/// An array of the caller's, borrowed to be read.
pub(crate) type Read<'py, T> = PyReadonlyArray<'py, T, IxDyn>;

/// Borrows `object`, called `name`, to be written: a contiguous array of this type and `shape`.
pub(crate) fn written<'py, T: Element>(
    name: &str,
    object: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<Written<'py, T>> {
    let array = checked::<T>(name, object, shape)?;
    array.try_readwrite().map_err(|error| {
        let problem = format!("{name} cannot be written: {error}");
        PyValueError::new_err(problem)
    })
}

/// Borrows `object`, called `name`, to be read: a contiguous array of this type and `shape`.
pub(crate) fn read<'py, T: Element>(
    name: &str,
    object: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<Read<'py, T>> {
    let array = checked::<T>(name, object, shape)?;
    array.try_readonly().map_err(|error| {
        let problem = format!("{name} cannot be read: {error}");
        PyValueError::new_err(problem)
    })
}

fn checked<'py, T: Element>(
    name: &str,
    object: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let expected = || format!("{} of shape {}", dtype::<T>(object.py()), tuple(shape));
    let found = || match (object.getattr("dtype"), object.getattr("shape")) {
        (Ok(dtype), Ok(shape)) => format!("{dtype} of shape {shape}"),
        _ => format!("a {}", object.get_type()),
    };
    let problem = || format!("{name} is {}, expected {}", found(), expected());
    let array = object
        .cast::<PyArrayDyn<T>>()
        .map_err(|_| PyTypeError::new_err(problem()))?;
    use numpy::PyUntypedArrayMethods as _;
    if array.shape() != shape {
        return Err(PyValueError::new_err(problem()));
    }
    if !array.is_c_contiguous() {
        let problem = format!(
            "{name} is not contiguous, expected {} in C order",
            expected()
        );
        return Err(PyValueError::new_err(problem));
    }
    Ok(array.clone())
}

/// (3, 5) or (3,)
fn tuple(shape: &[usize]) -> String {
    let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
    match sizes.as_slice() {
        [one] => format!("({one},)"),
        _ => format!("({})", sizes.join(", ")),
    }
}

/// Cuts `slice` into `count` parts of `size`, which may be 0.
pub(crate) fn parts_mut<T>(
    mut slice: &mut [T],
    size: usize,
    count: usize,
) -> impl Iterator<Item = &mut [T]> {
    (0..count).map(move |_| {
        let (part, rest) = std::mem::take(&mut slice).split_at_mut(size);
        slice = rest;
        part
    })
}
