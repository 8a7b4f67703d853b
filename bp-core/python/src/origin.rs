//! How a program was made: its text and its settings, which is how it is pickled.
//!
//! In: a text, settings one after the other. Out: the program, in another process too. Invariant: the same settings in the
//! same order give the same program.

use crate::error::{raised, wrong};
use crate::program::Program;
use crate::value::{read, shown};
use bp_core::compiler::io::{self, Format};
use bp_core::compiler::plan::{Options, Strategy};
use bp_core::compiler::source::Source;
use bp_core::prelude::{self, Error, Value};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// A setting, as it was made.
#[derive(Clone)]
pub(crate) enum Setting {
    With(String, Value),
    Draws(usize),
    Seed(u64),
    By(String),
    Budget(u64),
}

/// How a program was made; `None` in place of the text if a text does not tell all of it.
#[derive(Clone)]
pub(crate) struct Origin {
    pub(crate) text: Option<(String, &'static str)>,
    pub(crate) settings: Vec<Setting>,
}

/// What pickle needs: the function that makes the program again, and its arguments.
pub(crate) type Reduced = (Py<PyAny>, (String, String, Py<PyAny>, Option<String>));

/// What Python makes a pickled value of: a function, and its arguments.
pub(crate) type Rebuilt<A> = (Py<PyAny>, A);

/// A function of this module, by which pickle makes an object again.
pub(crate) fn function(py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
    Ok(py.import("bayesian_programs._native")?.getattr(name)?.unbind())
}

impl Setting {
    /// The program with this setting.
    ///
    /// # Errors
    /// An unknown name, a value outside its range.
    pub(crate) fn applied(&self, program: prelude::Program) -> Result<prelude::Program, Error> {
        Ok(match self {
            Setting::With(name, value) => program.with(name, value.clone())?,
            Setting::Draws(0) => return Err(Error::input("draws", "0 was given, but at least 1 is needed")),
            Setting::Draws(count) => program.draws(*count),
            Setting::Seed(seed) => program.seed(*seed),
            Setting::By(strategy) => program.by(strategy)?,
            Setting::Budget(products) => program.budget(*products),
        })
    }
}

impl Origin {
    /// The options of its planner.
    pub(crate) fn options(&self) -> Options {
        let mut options = Options { all_offers: true, ..Options::default() };
        for setting in &self.settings {
            match setting {
                Setting::By(strategy) => options.by = Strategy::of_name(strategy),
                Setting::Budget(products) => options.budget = Some(*products),
                _ => {}
            }
        }
        options
    }

    /// Whether its text is a program, not a network of another format.
    pub(crate) fn is_program(&self) -> bool {
        let own = Format::Program.endings()[0];
        self.text.as_ref().is_none_or(|(_, format)| *format == own)
    }

    /// The function that makes the program again, and its arguments.
    ///
    /// # Errors
    /// A program whose text does not tell all of it.
    pub(crate) fn reduced(&self, py: Python<'_>, report: Option<String>) -> PyResult<Reduced> {
        let Some((text, format)) = &self.text else {
            return Err(PyTypeError::new_err(
                "a program with rows of data is not pickled: pickle the program before `rows`",
            ));
        };
        let setting = |setting: &Setting| match setting {
            Setting::With(name, value) => ("with", (name, shown(py, value)?)).into_pyobject(py),
            Setting::Draws(count) => ("draws", (count,)).into_pyobject(py),
            Setting::Seed(seed) => ("seed", (seed,)).into_pyobject(py),
            Setting::By(strategy) => ("by", (strategy,)).into_pyobject(py),
            Setting::Budget(products) => ("budget", (products,)).into_pyobject(py),
        };
        let settings: Vec<_> = self.settings.iter().map(setting).collect::<PyResult<_>>()?;
        let settings = settings.into_pyobject(py)?.into_any().unbind();
        Ok((function(py, "_restored")?, (text.clone(), (*format).to_owned(), settings, report)))
    }
}

/// A program from its text, of a file with this ending, its settings, and its report of learning: how a pickled program comes
/// back.
#[pyfunction]
#[pyo3(name = "_restored", signature = (text, format, settings, report = None))]
pub(crate) fn restored(
    text: &str,
    format: &str,
    settings: Vec<(String, Bound<'_, PyTuple>)>,
    report: Option<String>,
) -> PyResult<Program> {
    let mut program = of_text(text, format)?;
    for (kind, of) in settings {
        let setting = match kind.as_str() {
            "with" => Setting::With(of.get_item(0)?.extract()?, read(&of.get_item(1)?)?),
            "draws" => Setting::Draws(of.get_item(0)?.extract()?),
            "seed" => Setting::Seed(of.get_item(0)?.extract()?),
            "by" => Setting::By(of.get_item(0)?.extract()?),
            "budget" => Setting::Budget(of.get_item(0)?.extract()?),
            other => return Err(wrong(format!("there is no setting `{other}`"))),
        };
        program = program.set(setting).map_err(raised)?;
    }
    program.report = report;
    Ok(program)
}

/// A program, or a network of another format, from its text.
///
/// # Errors
/// Every mistake of the text; a format that does not exist.
pub(crate) fn of_text(text: &str, format: &str) -> PyResult<Program> {
    let named = Format::named(format);
    let format = named
        .ok_or_else(|| wrong(format!("there is no format `{format}`: give bp, bif, xmlbif, uai or net")))?;
    let program = match format {
        Format::Program => prelude::Program::parse(text),
        _ => {
            let source = Source::new("network", text);
            io::read(&source, format)
                .map_err(|wrong| Error::program(&source, wrong))
                .and_then(prelude::Program::of_network)
        }
    };
    let origin = Origin { text: Some((text.to_owned(), format.endings()[0])), settings: Vec::new() };
    Ok(Program::new(program.map_err(raised)?, origin))
}
