//! Arguments of the map: arrays of numpy and numbers.
//!
//! In: an argument. Out: a view of its float32 numbers, of any stride, without a copy, or a finite number. Invariant: what
//! does not fit is an exception that says what to give.

use crate::error::wrong;
use numpy::ndarray::Dimension;
use numpy::{PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// An array of float32 with these axes, such as "(row, column)".
///
/// # Errors
/// `TypeError` for another object, another type of numbers, or another number of axes.
pub(crate) fn float32<'py, D: Dimension>(
    name: &str,
    axes: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArray<'py, f32, D>> {
    if let Ok(array) = value.cast::<PyArray<f32, D>>() {
        return Ok(array.try_readonly()?);
    }
    let given = match value.cast::<PyUntypedArray>() {
        Ok(array) => format!("an array of {} with the shape {:?}", array.dtype(), array.shape()),
        Err(_) => format!("a `{}`", value.get_type().name()?),
    };
    Err(PyTypeError::new_err(format!("`{name}` is {given}: give an array of float32 with the axes {axes}")))
}

/// Refuses numbers that are not finite.
///
/// # Errors
/// `InputError` for the first of them.
pub(crate) fn finite(numbers: &[(&str, f64)]) -> PyResult<()> {
    match numbers.iter().find(|(_, number)| !number.is_finite()) {
        Some((name, number)) => Err(wrong(format!("`{name}` is {number}, but it must be a finite number"))),
        None => Ok(()),
    }
}
