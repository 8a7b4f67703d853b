//! Values of Python as values of programs, and back.
//!
//! In: booleans, whole numbers, reals, labels, lists, numpy arrays and scalars. Out: a [`Value`]. Invariant: a boolean is
//! `True` or `False`, never 1 or 0; `None` in evidence is not observed.

use crate::error::wrong;
use bp_core::compiler::answer::Slot;
use bp_core::compiler::model::{Domain, Model};
use bp_core::prelude::{Evidence, Value};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping, PyString, PyTuple};
use pyo3::{Borrowed, IntoPyObjectExt};

/// A likelihood for each value of a finite variable: virtual evidence, `{"Rain": bp.likelihood([0.8, 0.2])}`.
///
/// Finite numbers, none negative, in the order of the variable's values; only their ratios matter.
#[pyclass(frozen, module = "bayesian_programs", name = "likelihood")]
pub(crate) struct Likelihood {
    weights: Vec<f64>,
}

#[pymethods]
impl Likelihood {
    #[new]
    fn new(weights: &Bound<'_, PyAny>) -> PyResult<Self> {
        let weights = weights.try_iter()?.map(|weight| weight?.extract()).collect::<PyResult<_>>()?;
        Ok(Self { weights })
    }

    /// The numbers.
    #[getter]
    fn weights(&self) -> Vec<f64> {
        self.weights.clone()
    }

    fn __repr__(&self) -> String {
        format!("likelihood({:?})", self.weights)
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> (Py<PyAny>, (Vec<f64>,)) {
        (slf.get_type().into_any().unbind(), (slf.get().weights.clone(),))
    }
}

/// A value of Python.
///
/// # Errors
/// Something that is no value: a mapping, a whole number beyond 64 bits.
pub(crate) fn read(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(truth) = value.extract::<bool>() {
        return Ok(Value::Bool(truth));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::Label(text.to_str()?.to_owned()));
    }
    if let Ok(likelihood) = value.cast::<Likelihood>() {
        return Ok(Value::Likelihood(likelihood.get().weights.clone()));
    }
    if let Ok(number) = value.extract::<i64>() {
        return Ok(Value::Integer(number));
    }
    // Row by row, as a list of lists; strides are followed.
    if let Ok(reals) = value.extract::<PyReadonlyArrayDyn<'_, f64>>()
        && reals.ndim() > 0
    {
        return Ok(Value::List(reals.as_array().iter().map(|number| Value::Real(*number)).collect()));
    }
    let is_one = value.getattr("ndim").and_then(|axes| axes.extract::<usize>()).ok() == Some(0);
    if let Ok(number) = value.extract::<f64>()
        && (is_one || !value.hasattr("__len__")?)
    {
        return Ok(Value::Real(number));
    }
    let several = value.hasattr("__iter__")? && value.cast::<PyMapping>().is_err();
    if !several {
        let kind = value.get_type().name()?;
        return Err(wrong(format!(
            "{} of type `{kind}` is not a value: give a bool, an int, a float, a str, or a list of these",
            value.repr()?
        )));
    }
    let all = value.try_iter()?.map(|value| read(&value?)).collect::<PyResult<Vec<Value>>>()?;
    Ok(Value::List(all))
}

/// A value that is known; an element `None` of a list is missing.
fn known(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let is_list = value.cast::<PyList>().is_ok() || value.cast::<PyTuple>().is_ok();
    if !is_list || !value.try_iter()?.any(|value| value.is_ok_and(|value| value.is_none())) {
        return read(value);
    }
    let element = |value: Bound<'_, PyAny>| match value.is_none() {
        true => Ok(Value::Real(f64::NAN)),
        false => read(&value),
    };
    let all = value.try_iter()?.map(|value| element(value?)).collect::<PyResult<Vec<Value>>>()?;
    Ok(Value::List(all))
}

/// A mapping of names to values; `None` is left out.
///
/// # Errors
/// See [`read`].
pub(crate) fn evidence(values: Option<&Bound<'_, PyAny>>) -> PyResult<Evidence> {
    let mut evidence = Evidence::new();
    let Some(values) = values else { return Ok(evidence) };
    let pairs = values.cast::<PyMapping>().map_err(|_| {
        wrong("evidence is a mapping of names to values, such as {\"Rain\": True, \"Z[2]\": 0.5}")
    })?;
    for pair in pairs.items()?.iter() {
        let (name, value): (String, Bound<'_, PyAny>) = pair.extract()?;
        if !value.is_none() {
            evidence.set(name, known(&value)?);
        }
    }
    Ok(evidence)
}

/// A mapping of names to values, all of which are given.
///
/// # Errors
/// See [`read`]; a value that is `None`.
pub(crate) fn settings(values: Option<&Bound<'_, PyAny>>) -> PyResult<Evidence> {
    let pairs = values.and_then(|values| values.cast::<PyMapping>().ok());
    for pair in pairs.map(|pairs| pairs.items()).transpose()?.iter().flatten() {
        let (name, value): (String, Bound<'_, PyAny>) = pair.extract()?;
        if value.is_none() {
            return Err(wrong(format!("`{name}` is None: give a value")));
        }
        read(&value)?;
    }
    evidence(values)
}

/// A value for Python.
pub(crate) fn shown(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    match value {
        Value::Bool(truth) => truth.into_py_any(py),
        Value::Integer(number) => number.into_py_any(py),
        Value::Real(number) => number.into_py_any(py),
        Value::Label(text) => text.into_py_any(py),
        Value::List(values) => {
            values.iter().map(|value| shown(py, value)).collect::<PyResult<Vec<_>>>()?.into_py_any(py)
        }
        Value::Likelihood(weights) => Likelihood { weights: weights.clone() }.into_py_any(py),
    }
}

/// Names and values for Python, as a dictionary.
pub(crate) fn named<'py>(py: Python<'py>, evidence: &Evidence) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    for (name, value) in evidence.iter() {
        found.set_item(name, shown(py, value)?)?;
    }
    Ok(found)
}

/// The values of a finite slot, in order; for bins their centres.
pub(crate) fn values_of(model: &Model, slot: &Slot) -> Vec<Value> {
    let domain = &model.variables[slot.variable].domain;
    let value = |ordinal: usize| match domain {
        Domain::Boolean => Value::Bool(ordinal == 1),
        Domain::Finite { labels, .. } if ordinal < labels.len() => Value::Label(labels[ordinal].clone()),
        Domain::Bins(bins) => Value::Real(bins.centre(ordinal)),
        Domain::Set(_) => Value::Integer(ordinal as i64),
        _ => Value::Integer(domain.number(ordinal) as i64),
    };
    (0..slot.count).map(value).collect()
}

/// A list of names.
#[derive(Clone, Default)]
pub(crate) struct Names(pub(crate) Vec<String>);

impl<'a, 'py> FromPyObject<'a, 'py> for Names {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        match given.extract::<Vec<String>>() {
            Ok(names) => Ok(Self(names)),
            Err(_) => Err(PyTypeError::new_err(format!(
                "give a list of names, such as [\"Rain\"], not {}",
                given.repr()?
            ))),
        }
    }
}
