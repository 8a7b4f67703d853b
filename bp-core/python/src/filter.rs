//! A filter over time: one instant after the other.
//!
//! In: a program with variables `X^-1`, and the observations at each instant. Out: the posterior after each. Invariant:
//! steps of several threads come one after the other; a refused instant leaves the filter unchanged.
//!
//! A filter of `bp_core` borrows its program, and an object of Python owns what it has: the thread of the filter holds both.

use crate::error::{raised, wrong};
use crate::posterior::Posterior;
use crate::value::evidence;
use bp_core::prelude::{self, Error, Evidence};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

/// What a filter is asked for.
enum Request {
    Step(Evidence),
    Predict(usize),
}

/// A posterior, ln P(all observations), and the number of instants.
type Found = Result<(prelude::Posterior, f64, usize), Error>;

/// A filter: the posterior of the searched variables, given all observations so far.
///
/// Made by `Program.filter`. `step` takes the observations of the next instant.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Filter {
    question: String,
    requests: Sender<(Request, Sender<Found>)>,
    state: Mutex<State>,
}

/// The numbers after the last step, and the last answers.
struct State {
    ln_evidence: f64,
    instants: usize,
    keep: usize,
    kept: VecDeque<prelude::Posterior>,
}

impl Filter {
    pub(crate) fn new(
        py: Python<'_>,
        program: &prelude::Program,
        question: &str,
        keep: usize,
    ) -> PyResult<Self> {
        let (requests, receiver) = channel();
        let (ready, begun) = channel();
        let (own, text) = (program.clone(), question.to_owned());
        std::thread::spawn(move || serve(&own, &text, &ready, &receiver));
        let begun = Mutex::new(begun);
        let first = py.detach(|| begun.lock().unwrap_or_else(PoisonError::into_inner).recv());
        first.map_err(|_| wrong("internal: the filter ended before it began"))?.map_err(raised)?;
        let state = State { ln_evidence: 0.0, instants: 0, keep, kept: VecDeque::new() };
        Ok(Self { question: question.to_owned(), requests, state: Mutex::new(state) })
    }

    /// The answer to a request; the state is locked meanwhile, so that threads come one after the other.
    fn asked(&self, py: Python<'_>, request: Request, is_step: bool) -> PyResult<Posterior> {
        let found = py.detach(|| {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let (send, found) = channel();
            self.requests.send((request, send)).ok()?;
            let found = found.recv().ok()?;
            if let (Ok((posterior, ln_evidence, instants)), true) = (&found, is_step) {
                (state.ln_evidence, state.instants) = (*ln_evidence, *instants);
                if state.kept.len() >= state.keep {
                    state.kept.pop_front();
                }
                if state.keep > 0 {
                    state.kept.push_back(posterior.clone());
                }
            }
            Some(found)
        });
        let found = found.ok_or_else(|| wrong("the filter has ended after an internal error"))?;
        found.map(|(posterior, ..)| Posterior::from(posterior)).map_err(raised)
    }

    fn state<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&State) -> T + Send) -> T {
        py.detach(|| read(&self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

/// Answers requests until there are no more.
fn serve(
    program: &prelude::Program,
    question: &str,
    ready: &Sender<Result<(), Error>>,
    requests: &Receiver<(Request, Sender<Found>)>,
) {
    let mut filter = match program.filter(question) {
        Ok(filter) => filter,
        Err(error) => return drop(ready.send(Err(error))),
    };
    drop(ready.send(Ok(())));
    while let Ok((request, answer)) = requests.recv() {
        let found = match request {
            Request::Step(observed) => filter.step(observed),
            Request::Predict(steps) => filter.predict(steps),
        };
        drop(answer.send(found.map(|posterior| (posterior, filter.ln_evidence(), filter.instants()))));
    }
}

#[pymethods]
impl Filter {
    /// One instant: its observations, which may be partial or empty; returns the posterior. The value of a family is the list
    /// of its elements, or each element is given separately: `step({"Z[2]": 0.5})`. Raises `InputError` or
    /// `ImpossibleEvidence`; a refused instant changes nothing.
    #[pyo3(signature = (observed = None, /, **named))]
    fn step(
        &self,
        py: Python<'_>,
        observed: Option<&Bound<'_, PyAny>>,
        named: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Posterior> {
        let mut all = evidence(observed)?;
        for (name, value) in evidence(named.map(|named| named.as_any()))?.iter() {
            all.set(name, value.clone());
        }
        self.asked(py, Request::Step(all), true)
    }

    /// The posterior `steps` instants later, without further observations. The filter does not advance.
    #[pyo3(signature = (steps = 1))]
    fn predict(&self, py: Python<'_>, steps: usize) -> PyResult<Posterior> {
        self.asked(py, Request::Predict(steps), false)
    }

    /// ln P(all observations so far), nats; for reals the density.
    #[getter]
    fn ln_evidence(&self, py: Python<'_>) -> f64 {
        self.state(py, |state| state.ln_evidence)
    }

    /// The number of instants so far.
    #[getter]
    fn instants(&self, py: Python<'_>) -> usize {
        self.state(py, |state| state.instants)
    }

    /// The posteriors of the last instants, the oldest first.
    #[getter]
    fn history(&self, py: Python<'_>) -> Vec<Posterior> {
        self.state(py, |state| state.kept.iter().cloned().map(Posterior::from).collect())
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<Filter {}: {} instants>", self.question, self.instants(py))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("filter", (slf,))
    }

    fn _repr_latex_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("filter_latex", (slf,))
    }
}
