//! Questions, compiled once for repeated use.
//!
//! In: a program and the text of a question. Out: [`Question`], which takes values and is asked. Invariant: a question is
//! immutable and shares its compiled code; where its answers are quick, they are computed on the thread that asks.

use crate::error::raised;
use crate::origin::{Rebuilt, function};
use crate::posterior::Posterior;
use crate::program::Program;
use crate::table;
use crate::value::{evidence, named};
use crate::work::patiently;
use bp_core::prelude::{self, Error, Evidence};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The program, the text and the known values of a question that is pickled.
type Known = (Py<Program>, String, Py<PyDict>);

/// The time within which an answer is quick: Ctrl-C need not interrupt it.
const QUICK: Duration = Duration::from_millis(20);

/// A compiled question, and whether its last answer was quick.
pub(crate) struct Asked {
    question: prelude::Question,
    quick: AtomicBool,
}

impl Asked {
    pub(crate) fn new(question: prelude::Question) -> Self {
        Self { question, quick: AtomicBool::new(false) }
    }

    pub(crate) fn ask(&self, py: Python<'_>) -> PyResult<Posterior> {
        self.answer(py, prelude::Question::ask).map(Posterior::from)
    }

    pub(crate) fn ask_all(&self, py: Python<'_>) -> PyResult<Vec<Posterior>> {
        let all = self.answer(py, prelude::Question::ask_all)?;
        Ok(all.into_iter().map(Posterior::from).collect())
    }

    fn answer<T: Send + 'static>(
        &self,
        py: Python<'_>,
        answer: fn(&prelude::Question) -> Result<T, Error>,
    ) -> PyResult<T> {
        let timed = move |question: &prelude::Question| {
            let begun = Instant::now();
            (answer(question), begun.elapsed() < QUICK)
        };
        let (found, quick) = match self.quick.load(Relaxed) {
            true => py.detach(|| timed(&self.question)),
            false => {
                let question = self.question.clone();
                patiently(py, move || timed(&question))?
            }
        };
        self.quick.store(quick, Relaxed);
        found.map_err(raised)
    }
}

/// The most questions that a program keeps compiled.
const MOST_KEPT: usize = 128;

/// The questions of a program, each compiled once for all who ask it.
#[derive(Default)]
pub(crate) struct Kept(Mutex<HashMap<String, Arc<Asked>>>);

impl Kept {
    /// A question by its text.
    ///
    /// # Errors
    /// A wrong question, under its words; one that has no answer.
    pub(crate) fn of(&self, py: Python<'_>, program: &prelude::Program, text: &str) -> PyResult<Arc<Asked>> {
        // The lock is never held while the interpreter lock is waited for.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().get(text).cloned();
        if let Some(asked) = known {
            return Ok(asked);
        }
        let (program, question) = (program.clone(), text.to_owned());
        let asked = patiently(py, move || program.question(&question))?.map_err(raised)?;
        let asked = Arc::new(Asked::new(asked));
        let mut all = lock();
        if all.len() >= MOST_KEPT {
            all.clear();
        }
        all.insert(text.to_owned(), Arc::clone(&asked));
        Ok(asked)
    }
}

/// A prepared question to a program.
///
/// Made by `Program.question`. `given` returns a question with a value; `ask` answers it.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Question {
    asked: Arc<Asked>,
    program: Py<Program>,
    text: String,
    /// The values that it was given, in this order.
    given: Evidence,
}

impl Question {
    pub(crate) fn new(asked: Arc<Asked>, program: Py<Program>, text: &str) -> Self {
        Self { asked, program, text: text.to_owned(), given: Evidence::new() }
    }
}

/// A question to a program, with values: how a pickled question comes back.
#[pyfunction]
#[pyo3(name = "_questioned")]
pub(crate) fn questioned<'py>(
    program: &Bound<'py, Program>,
    text: &str,
    given: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    program.call_method1("question", (text,))?.call_method1("given", (given,))
}

#[pymethods]
impl Question {
    /// The question with values: of names in it (`wet` of `Wet = wet`), of variables that it leaves open, of parameters,
    /// sizes and inputs. Several values are a list or an array. Raises `InputError`.
    #[pyo3(signature = (values = None, /, **named))]
    fn given(
        &self,
        py: Python<'_>,
        values: Option<&Bound<'_, PyAny>>,
        named: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let all = evidence(values)?;
        let more = evidence(named.map(|named| named.as_any()))?;
        let (mut question, mut given) = (self.asked.question.clone(), self.given.clone());
        for (name, value) in all.iter().chain(more.iter()) {
            question = question.given(name, value.clone()).map_err(raised)?;
            given.set(name, value.clone());
        }
        let quick = AtomicBool::new(self.asked.quick.load(Relaxed));
        let (program, text) = (self.program.clone_ref(py), self.text.clone());
        Ok(Self { asked: Arc::new(Asked { question, quick }), program, text, given })
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<Rebuilt<Known>> {
        let given = named(py, &self.given)?.unbind();
        Ok((function(py, "_questioned")?, (self.program.clone_ref(py), self.text.clone(), given)))
    }

    /// Answers it. Raises `InputError` (a value is missing or does not fit), `ImpossibleEvidence`, `NoAnswer`.
    fn ask(&self, py: Python<'_>) -> PyResult<Posterior> {
        self.asked.ask(py)
    }

    /// Answers it; returns an answer for each ask.
    fn ask_all(&self, py: Python<'_>) -> PyResult<Vec<Posterior>> {
        self.asked.ask_all(py)
    }

    /// Answers it over time (`filter`, `predict`, `smooth`, `sequence`), given the observations: a list of mappings, one for
    /// each instant, or a table (a path, a frame, a mapping of columns) with a row for each; what is missing is not observed.
    /// The answer has the axis `instant` first. Raises `InputError`, `DataError` with row and column, `ImpossibleEvidence`.
    fn over(&self, py: Python<'_>, instants: &Bound<'_, PyAny>) -> PyResult<Posterior> {
        let question = self.asked.question.clone();
        if let Ok(path) = instants.extract::<PathBuf>() {
            return patiently(py, move || question.over_table(path))?.map(Posterior::from).map_err(raised);
        }
        if let Ok(each) = instants.cast::<pyo3::types::PyList>() {
            let each: Vec<Evidence> = each.iter().map(|one| evidence(Some(&one))).collect::<PyResult<_>>()?;
            return patiently(py, move || question.over(&each))?.map(Posterior::from).map_err(raised);
        }
        let records = table::Table::of(py, None, instants, &[])?.records().map_err(raised)?;
        patiently(py, move || question.over_records(&records))?.map(Posterior::from).map_err(raised)
    }

    fn __repr__(&self) -> String {
        format!("<Question {}>", self.text)
    }
}
