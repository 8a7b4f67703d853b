//! The program in the brace layout of the formalism.
//!
//! In: the text of a program. Out: [`Sheet`], as text, SVG and LaTeX. Invariant: it is what `bp print` shows.

use crate::origin::function;
use bp_core::compiler::io;
use bp_core::compiler::plan::Notation;
use bp_core::compiler::print::{fragment, sheets};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse;
use bp_core::prelude::{Error, Program};
use pyo3::prelude::*;

/// A program in the brace layout of the formalism. It prints as text, and shows as a figure in a notebook.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Sheet {
    text: String,
    /// The layout with the network beside it: an `svg` element.
    #[pyo3(get)]
    svg: String,
    latex: String,
}

impl Sheet {
    /// The sheet of a program; a network is shown as a program.
    ///
    /// # Errors
    /// A network that cannot be written as a program.
    pub(crate) fn of(program: &Program, is_program: bool) -> Result<Self, Error> {
        let text = match program.text() {
            Some(text) if is_program => text.to_owned(),
            _ => io::shown(program.model())?,
        };
        let source = Source::new("program", text);
        let file = parse(&source).map_err(|wrong| Error::program(&source, wrong))?;
        let last = |notation| sheets(&file, notation).pop();
        let unicode = last(Notation::Unicode);
        Ok(Self {
            text: unicode.as_ref().map(|sheet| sheet.text()).unwrap_or_default(),
            svg: unicode.as_ref().map(|sheet| sheet.svg()).unwrap_or_default(),
            latex: last(Notation::Latex).as_ref().map(fragment).unwrap_or_default(),
        })
    }
}

/// A sheet of its three forms: how a pickled one comes back.
#[pyfunction]
#[pyo3(name = "_sheet")]
pub(crate) fn restored(text: String, svg: String, latex: String) -> Sheet {
    Sheet { text, svg, latex }
}

#[pymethods]
impl Sheet {
    /// As a figure for a paper.
    fn to_latex(&self) -> &str {
        &self.latex
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String, String, String))> {
        Ok((function(py, "_sheet")?, (self.text.clone(), self.svg.clone(), self.latex.clone())))
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> &str {
        &self.text
    }

    fn _repr_svg_(&self) -> &str {
        &self.svg
    }

    fn _repr_html_(&self) -> String {
        format!("<div>{}</div>", self.svg)
    }
}
