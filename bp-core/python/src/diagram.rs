//! Networks as pictures, with posteriors inside the nodes.
//!
//! In: a program, and a question or evidence. Out: [`Diagram`], an SVG with its legend. Invariant: observed nodes are shaded;
//! the probabilities in a node are those of `marginals` with the same evidence.

use crate::derivation::questions;
use crate::error::{raised, wrong};
use crate::origin::function;
use crate::work::patiently;
use bp_core::compiler::answer::{Figure, Row};
use bp_core::compiler::draw::{Graph, Marginal, Mark, graph};
use bp_core::compiler::model::Question;
use bp_core::prelude::{Error, Evidence, Program};
use pyo3::prelude::*;
use std::path::PathBuf;

/// The most variables of a picture.
const MOST_NODES: usize = 2000;
/// The most bars in a node.
const MOST_BARS: usize = 12;

/// A picture of a network, as SVG. It shows in a notebook; `save` writes it.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Diagram {
    /// The picture: an `svg` element.
    #[pyo3(get)]
    svg: String,
    /// The meaning of its signs, one sentence.
    #[pyo3(get)]
    legend: String,
}

impl Diagram {
    /// The network, with a question or with evidence.
    ///
    /// # Errors
    /// As [`Diagram::of`] and [`Diagram::with_posteriors`]; both.
    pub(crate) fn asked(
        py: Python<'_>,
        program: &Program,
        question: Option<&str>,
        evidence: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let Some(evidence) = evidence else { return Self::of(program, question).map_err(raised) };
        if question.is_some() {
            return Err(wrong("a diagram shows either a question or evidence, not both"));
        }
        let known = crate::value::evidence(Some(evidence))?;
        let program = program.clone();
        patiently(py, move || Self::with_posteriors(&program, &known))?.map_err(raised)
    }

    /// The network, with the variables of a question marked.
    ///
    /// # Errors
    /// A wrong question; a network that is too large for a picture.
    pub(crate) fn of(program: &Program, question: Option<&str>) -> Result<Self, Error> {
        let question = question.map(|text| questions(program, Some(text))).transpose()?;
        let question = question.and_then(|mut all| all.pop());
        let graph = drawn(program, question.as_ref())?;
        let about = question.map(|_| "a double outline is searched, shaded is known");
        Ok(Self::made(&graph, about))
    }

    /// The network, with the posterior of each variable in its node, given some evidence.
    ///
    /// # Errors
    /// As [`Program::marginals`]; a network that is too large for a picture.
    pub(crate) fn with_posteriors(program: &Program, evidence: &Evidence) -> Result<Self, Error> {
        let mut graph = drawn(program, None)?;
        let found = program.marginals(evidence)?;
        for node in graph.nodes.iter_mut().filter(|node| node.index.is_none()) {
            let name = if node.previous { format!("{}^-1", node.name) } else { node.name.clone() };
            let rows = found.answer().answer.iter();
            let own: Vec<&Row> =
                rows.filter(|row| row.values.len() == 1 && row.values[0].0 == name).collect();
            node.marginal = marginal(&own);
            if let Some(value) = evidence.get(&name) {
                node.mark = Mark::Known;
                if own.is_empty() {
                    node.marginal = Some(Marginal::Line(format!("= {value}")));
                }
            }
        }
        Ok(Self::made(&graph, Some("bars are posterior probabilities, shaded is observed")))
    }

    fn made(graph: &Graph, about: Option<&str>) -> Self {
        let mut signs: Vec<&str> = about.into_iter().collect();
        let plain = |of: fn(&bp_core::compiler::draw::Node) -> bool| graph.nodes.iter().any(of);
        if plain(|node| node.deterministic && node.marginal.is_none()) {
            signs.push("a diamond has a Dirac form");
        }
        if plain(|node| node.previous) {
            signs.push("dashed is the previous instant");
        }
        if graph.over.is_some() || !graph.plates.is_empty() {
            signs.push("a box is repeated for each value of its index");
        }
        let legend = match signs.is_empty() {
            true => format!("The network of {}.", graph.name),
            false => format!("The network of {}: {}.", graph.name, signs.join("; ")),
        };
        Self { svg: graph.svg(), legend }
    }
}

fn drawn(program: &Program, question: Option<&Question>) -> Result<Graph, Error> {
    let model = program.model();
    match model.variables.len() {
        count if count > MOST_NODES => Err(Error::input(
            "diagram",
            format!("{count} variables are too many for a picture; at most {MOST_NODES}"),
        )),
        _ => Ok(graph(model, question)),
    }
}

/// The rows of one variable as bars, or as a line if it is real.
fn marginal(rows: &[&Row]) -> Option<Marginal> {
    if let [row] = rows
        && let Figure::Normal { mean, deviation }
        | Figure::Law { mean, deviation, .. }
        | Figure::Mixture { mean, deviation, .. }
        | Figure::Real { mean: [mean, _], deviation: [deviation, _], .. } = row.figure
    {
        return Some(Marginal::Line(format!("{mean:.4} ± {deviation:.4}")));
    }
    let bars: Vec<(String, f64)> =
        rows.iter().filter_map(|row| Some((row.values[0].1.clone(), row.p()?))).collect();
    match bars.len() {
        0 => None,
        count if count <= MOST_BARS => Some(Marginal::Bars(bars)),
        count => {
            let (value, p) = bars.into_iter().max_by(|one, other| one.1.total_cmp(&other.1))?;
            Some(Marginal::Line(format!("{count} values; {value}: {:.1}%", 100.0 * p)))
        }
    }
}

/// A picture of its forms: how a pickled one comes back.
#[pyfunction]
#[pyo3(name = "_diagram")]
pub(crate) fn restored(svg: String, legend: String) -> Diagram {
    Diagram { svg, legend }
}

#[pymethods]
impl Diagram {
    /// Writes the picture to a file (`.svg`).
    fn save(&self, path: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, &self.svg)?)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, String))> {
        Ok((function(py, "_diagram")?, (self.svg.clone(), self.legend.clone())))
    }

    fn _repr_svg_(&self) -> &str {
        &self.svg
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("diagram", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<Diagram: {}>", self.legend)
    }
}
