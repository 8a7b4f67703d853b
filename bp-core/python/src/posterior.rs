//! Answers: distributions of named variables.
//!
//! In: an answer of `bp_core`. Out: [`Posterior`]: probabilities by value, moments, arrays. Invariant: names and values are
//! looked up as in Rust; a lookup of what does not exist is an error that lists what does.

use crate::error::{raised, wrong};
use crate::origin::function;
use crate::value::{named, read, shown, values_of};
use bp_core::compiler::answer::{Drawn, Part, PartLaw, Slot};
use bp_core::prelude::{self, Value};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

/// The answer to a question: a distribution of variables, or a statistic.
///
/// Read by variable and value: `p(True)`, `of("Rain")`, `mode()`. It prints as a table with bars. A lookup of what it does
/// not have raises `AnswerError`, which lists what it has.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Posterior(prelude::Posterior);

impl From<prelude::Posterior> for Posterior {
    fn from(posterior: prelude::Posterior) -> Self {
        Self(posterior)
    }
}

impl Posterior {
    fn parts(&self) -> &[Part] {
        &self.0.answer().parts
    }

    /// The slots of the axes of its arrays: contexts, then searched variables.
    fn slots(&self) -> Vec<&Slot> {
        self.parts().first().map(|part| part.given.iter().chain(&part.of).collect()).unwrap_or_default()
    }
}

/// The value that some arguments mean: one, or one for each variable.
fn one_or_several(arguments: &Bound<'_, PyTuple>) -> PyResult<Value> {
    match arguments.len() {
        1 => read(&arguments.get_item(0)?),
        _ => read(arguments.as_any()),
    }
}

/// A posterior as it was stored: how a pickled one comes back.
#[pyfunction]
#[pyo3(name = "_posterior")]
pub(crate) fn restored(stored: &[u8]) -> PyResult<Posterior> {
    let stored = ciborium::from_reader(stored).map_err(|error| wrong(error.to_string()))?;
    Ok(Posterior(prelude::Posterior::of_stored(stored)))
}

#[pymethods]
impl Posterior {
    /// The question, as a user types it.
    #[getter]
    fn question(&self) -> &str {
        self.0.question()
    }

    /// The strategy that computed it.
    #[getter]
    fn strategy(&self) -> &'static str {
        self.0.strategy().name()
    }

    /// ln P(evidence), nats, if the evidence is one event; for reals the density.
    #[getter]
    fn ln_evidence(&self) -> Option<f64> {
        self.0.ln_evidence()
    }

    /// Of an estimate: `particles`, `effective`, `seed`, `ln_evidence_error`; `None` if it is exact.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(estimate) = self.0.estimate() else { return Ok(None) };
        let found = PyDict::new(py);
        found.set_item("particles", estimate.particles)?;
        found.set_item("effective", estimate.effective)?;
        found.set_item("seed", estimate.seed)?;
        found.set_item("ln_evidence_error", estimate.ln_evidence_error)?;
        Ok(Some(found))
    }

    /// A warning about the estimate, if there is one.
    #[getter]
    fn warning(&self) -> Option<&str> {
        self.0.warning()
    }

    /// The names of its variables.
    #[getter]
    fn variables(&self) -> Vec<String> {
        let model = self.0.model();
        let mut all: Vec<String> = Vec::new();
        for slot in self.parts().iter().flat_map(|part| &part.of) {
            let name = slot.name(model);
            if !all.contains(&name) {
                all.push(name);
            }
        }
        all
    }

    /// The number of instants: 1 except for `smooth` and `sequence`.
    #[getter]
    fn instants(&self) -> usize {
        self.0.instants()
    }

    /// The probability of a value; of several variables a tuple of values in the order of the question, of a family a list.
    /// For reals with a known distribution the density.
    #[pyo3(signature = (*value))]
    fn p(&self, value: &Bound<'_, PyTuple>) -> PyResult<f64> {
        self.0.p(one_or_several(value)?).map_err(raised)
    }

    /// The probability of a value, and its standard error: 0 if the answer is exact.
    #[pyo3(signature = (*value))]
    fn p_and_error(&self, value: &Bound<'_, PyTuple>) -> PyResult<(f64, f64)> {
        self.0.p_and_error(one_or_several(value)?).map(|[p, error]| (p, error)).map_err(raised)
    }

    /// The most probable values of its variables together, by name; of a normal distribution its mean.
    fn mode<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        named(py, &self.0.mode().map_err(raised)?)
    }

    /// All values with their probabilities, in the order of the table: a list of (values by name, p).
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Vec<(Bound<'py, PyDict>, f64)>> {
        let all = self.0.values().map_err(raised)?;
        all.iter().map(|(values, p)| Ok((named(py, values)?, *p))).collect()
    }

    /// The values of each row of a question for `draw(n)`, `best(n)` or `argmax`, in its order: a list of dicts.
    fn listed<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all = self.0.listed().map_err(raised)?;
        all.iter().map(|values| named(py, values)).collect()
    }

    /// The mean of its variable; `True` counts as 1.
    fn mean(&self) -> PyResult<f64> {
        self.0.mean().map_err(raised)
    }

    /// The mean, and its standard error: 0 if the answer is exact.
    fn mean_and_error(&self) -> PyResult<(f64, f64)> {
        self.0.mean_and_error().map(|[mean, error]| (mean, error)).map_err(raised)
    }

    /// The variance of its variable.
    fn variance(&self) -> PyResult<f64> {
        self.0.variance().map_err(raised)
    }

    /// The standard deviation of its variable.
    fn deviation(&self) -> PyResult<f64> {
        self.0.deviation().map_err(raised)
    }

    /// The covariance of two of its variables.
    fn covariance(&self, one: &str, other: &str) -> PyResult<f64> {
        self.0.covariance(one, other).map_err(raised)
    }

    /// The central interval that contains its variable with this probability.
    #[pyo3(signature = (level = 0.95))]
    fn interval(&self, level: f64) -> PyResult<(f64, f64)> {
        self.0.interval(level).map(|[low, high]| (low, high)).map_err(raised)
    }

    /// The smallest value whose cumulative probability reaches this level, between 0 and 1.
    fn quantile(&self, level: f64) -> PyResult<f64> {
        self.0.quantile(level).map_err(raised)
    }

    /// The entropy, nats; of a normal distribution the differential entropy.
    fn entropy(&self) -> PyResult<f64> {
        self.0.entropy().map_err(raised)
    }

    /// The value of a question for one number: `entropy`, `information`, `expectation`, the probability of one value, …
    fn number(&self) -> PyResult<f64> {
        self.0.number().map_err(raised)
    }

    /// The distribution of one of its variables, of one element (`Z[2]`), or of a family; the others are summed out.
    fn of(&self, name: &str) -> PyResult<Self> {
        self.0.of(name).map(Self).map_err(raised)
    }

    /// The distribution in one context of a table: `given(Wet=True)`, `given({"Z[2]": 3})`.
    #[pyo3(signature = (values = None, /, **named))]
    fn given(&self, values: Option<&Bound<'_, PyAny>>, named: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let all = crate::value::evidence(values)?;
        let more = crate::value::evidence(named.map(|named| named.as_any()))?;
        let mut found = self.0.clone();
        for (name, value) in all.iter().chain(more.iter()) {
            found = found.given(name, value.clone()).map_err(raised)?;
        }
        Ok(Self(found))
    }

    /// The distribution at an instant, from 1, of an answer for each (`smooth`, `sequence`).
    fn at(&self, instant: usize) -> PyResult<Self> {
        self.0.at(instant).map(Self).map_err(raised)
    }

    /// The axes of `to_numpy`: a list of (name, values). Contexts come first; over time the first axis is `instant`, from 1.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyList>)>> {
        let model = self.0.model();
        let mut axes = Vec::new();
        if self.0.instants() > 1 {
            axes.push(("instant".to_owned(), PyList::new(py, 1..=self.0.instants())?));
        }
        for slot in self.slots() {
            let values: Vec<Py<PyAny>> =
                values_of(model, slot).iter().map(|value| shown(py, value)).collect::<PyResult<_>>()?;
            axes.push((slot.name(model), PyList::new(py, values)?));
        }
        Ok(axes)
    }

    /// The probabilities as a new array (float64) with an axis for each variable, in the order of `axes`; a bool has the
    /// order False, True. A real has no such array: use `mean`, `interval`, `density` or `draws`.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let parts = self.parts();
        let model = self.0.model();
        let several = parts.len() > 1 && parts.iter().any(|part| part.instant.is_none());
        if parts.is_empty() || several {
            // The message of a lookup says what to choose.
            self.0.values().map_err(raised)?;
        }
        let mut numbers = Vec::new();
        for part in parts {
            if let Some(real) = part.of.iter().find(|slot| slot.count == 0) {
                let name = real.name(model);
                return Err(wrong(format!(
                    "`{name}` is a real, which has no table: use `mean`, `interval`, `density` or `draws`"
                )));
            }
            numbers.extend(part.probabilities().iter().flatten());
        }
        let counts = self.slots().into_iter().map(|slot| slot.count);
        let instants = (parts.len() > 1).then_some(parts.len());
        let shape: Vec<usize> = instants.into_iter().chain(counts).collect();
        PyArray1::from_vec(py, numbers).reshape(shape)
    }

    /// The density of its variable, a real with a known distribution, at each of some points: an array (float64).
    fn density<'py>(&self, py: Python<'py>, points: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let all: Vec<f64> = points.iter().map(|x| self.0.p(*x)).collect::<Result<_, _>>().map_err(raised)?;
        Ok(PyArray1::from_vec(py, all))
    }

    /// The draws of its variable, and their weights, which sum to 1: two arrays (float64), if it was estimated by draws.
    #[allow(clippy::type_complexity)]
    fn draws<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
        let (values, weights) = self.0.draws().map_err(raised)?.into_iter().unzip();
        Ok((PyArray1::from_vec(py, values), PyArray1::from_vec(py, weights)))
    }

    /// The draws of all its variables by name, their weights, and the length of each chain; `None` if there are no draws.
    fn _all_draws<'py>(&self, py: Python<'py>) -> PyResult<Option<Py<PyAny>>> {
        let model = self.0.model();
        let found = PyDict::new(py);
        let mut about = None;
        for part in self.parts().iter().filter(|part| part.given.is_empty()) {
            let PartLaw::Draws(draws, drawn) = &part.law else { continue };
            for (slot, drawn) in part.of.iter().zip(drawn) {
                let Drawn::At(position) = drawn else { continue };
                let domain = &model.variables[slot.variable].domain;
                let number = |value: f64| match slot.count {
                    0 => value,
                    _ => domain.number(value as usize),
                };
                let values: Vec<f64> =
                    (0..draws.count()).map(|draw| number(draws.value(draw, *position))).collect();
                found.set_item(slot.name(model), PyArray1::from_vec(py, values))?;
            }
            let weights: Vec<f64> = (0..draws.count()).map(|draw| draws.weight(draw)).collect();
            about.get_or_insert((PyArray1::from_vec(py, weights), draws.chain()));
        }
        let Some((weights, chain)) = about else { return Ok(None) };
        Ok(Some((found, weights, chain).into_py_any(py)?))
    }

    /// Its draws as groups of ArviZ, `{"posterior": …, "sample_stats": …}`, each array (chain, draw): `az.from_dict(**groups)`.
    /// Weighted draws are resampled to equal weights (systematic, with the seed of the estimate), unless `resample=False`.
    #[pyo3(signature = (*, resample = true))]
    fn to_arviz<'py>(slf: &Bound<'py, Self>, resample: bool) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.frames")?.call_method1("to_arviz", (slf, resample))
    }

    /// As a dict, the document of `bp ask --json`.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.to_json()?,))
    }

    /// As JSON, the document of `bp ask --json`.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|error| wrong(error.to_string()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Py<PyAny>, (Bound<'py, PyBytes>,))> {
        let mut stored = Vec::new();
        ciborium::into_writer(&self.0.to_stored(), &mut stored).map_err(|error| wrong(error.to_string()))?;
        Ok((function(py, "_posterior")?, (PyBytes::new(py, &stored),)))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memory: &Bound<'_, PyAny>) -> Py<Self> {
        // It is immutable.
        slf
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        self.0.to_string()
    }

    fn __float__(&self) -> PyResult<f64> {
        self.number()
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("posterior", (slf,))
    }

    fn _repr_latex_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("posterior_latex", (slf,))
    }
}
