//! A filter over time: one instant after the other.
//!
//! In: a program with variables `X^-1`, and the observations at each instant. Out: the posterior after each. Invariant:
//! steps of several threads come one after the other; an instant that is refused or interrupted leaves the filter
//! unchanged.
//!
//! A filter of `bp_core` borrows its program, and an object of Python owns what it has: the thread of the filter holds both.

use crate::error::{raised, wrong};
use crate::posterior::Posterior;
use crate::value::evidence;
use crate::work::received;
use bp_core::compiler::progress::{self, Unwanted};
use bp_core::prelude::{self, Error, Evidence};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

/// What a filter is asked for.
enum Request {
    /// The observations of an instant, which is taken in once the one who asks says so: not after an interrupt.
    Step(Evidence, Receiver<()>),
    Predict(usize),
}

/// A request, where its answer goes, and whether it is wanted.
type Asked = (Request, Sender<Found>, Unwanted);

/// A posterior, ln P(all observations), and the number of instants.
type Found = Result<(prelude::Posterior, f64, usize), Error>;

/// A filter: the posterior of the searched variables, given all observations so far.
///
/// Made by `Program.filter`. `step` takes the observations of the next instant.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Filter {
    question: String,
    requests: Mutex<Sender<Asked>>,
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
        let first = received(py, begun, &Unwanted::default())?;
        first.ok_or_else(|| wrong("internal: the filter ended before it began"))?.map_err(raised)?;
        let state = State { ln_evidence: 0.0, instants: 0, keep, kept: VecDeque::new() };
        Ok(Self { question: question.to_owned(), requests: Mutex::new(requests), state: Mutex::new(state) })
    }

    /// The answer to a request; after an interrupt it is an error, and the request has no effect.
    fn asked(&self, py: Python<'_>, request: Request) -> PyResult<(prelude::Posterior, f64, usize)> {
        let ended = || wrong("the filter has ended after an internal error");
        let (send, found) = channel();
        let unwanted = Unwanted::default();
        let sent = {
            let requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
            requests.send((request, send, Unwanted::clone(&unwanted)))
        };
        sent.map_err(|_| ended())?;
        received(py, found, &unwanted)?.ok_or_else(ended)?.map_err(raised)
    }

    fn state<T: Send>(&self, py: Python<'_>, with: impl FnOnce(&mut State) -> T + Send) -> T {
        py.detach(|| with(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

/// Answers requests until there are no more.
fn serve(
    program: &prelude::Program,
    question: &str,
    ready: &Sender<Result<(), Error>>,
    requests: &Receiver<Asked>,
) {
    let mut filter = match program.filter(question) {
        Ok(filter) => filter,
        Err(error) => return drop(ready.send(Err(error))),
    };
    drop(ready.send(Ok(())));
    while let Ok((request, answer, unwanted)) = requests.recv() {
        let (before, instants) = (filter.ln_evidence(), filter.instants());
        progress::abandonable(Some(unwanted), || match request {
            Request::Step(observed, accepted) => {
                let taken = filter.step_if(observed, |posterior| {
                    let ln_evidence = posterior.ln_evidence().unwrap_or(before);
                    drop(answer.send(Ok((posterior, ln_evidence, instants + 1))));
                    // The one who asks has gone after an interrupt.
                    ((), accepted.recv().is_ok())
                });
                if let Err(error) = taken {
                    drop(answer.send(Err(error)));
                }
            }
            Request::Predict(steps) => {
                drop(answer.send(filter.predict(steps).map(|posterior| (posterior, before, instants))));
            }
        });
    }
}

#[pymethods]
impl Filter {
    /// One instant: its observations, which may be partial or empty; returns the posterior. The value of a family is the list
    /// of its elements, or each element is given separately: `step({"Z[2]": 0.5})`. Raises `InputError` or
    /// `ImpossibleEvidence`; an instant that is refused or interrupted changes nothing.
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
        let (accept, accepted) = channel();
        let (posterior, ln_evidence, instants) = self.asked(py, Request::Step(all, accepted))?;
        self.state(py, |state| {
            (state.ln_evidence, state.instants) = (ln_evidence, instants);
            state.kept.push_back(posterior.clone());
            while state.kept.len() > state.keep {
                state.kept.pop_front();
            }
        });
        // Only now the next request is served.
        accept.send(()).ok();
        Ok(Posterior::from(posterior))
    }

    /// The posterior `steps` instants later, without further observations. The filter does not advance.
    #[pyo3(signature = (steps = 1))]
    fn predict(&self, py: Python<'_>, steps: usize) -> PyResult<Posterior> {
        self.asked(py, Request::Predict(steps)).map(|(posterior, ..)| Posterior::from(posterior))
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

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err(
            "a filter is not pickled: pickle its program, and follow the observations again",
        ))
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
