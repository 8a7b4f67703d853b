//! Programs: opened, configured, asked.
//!
//! In: a path or a text. Out: [`Program`]. Invariant: a program is immutable, may be used from several threads, and is
//! pickled as its text and its settings, so that each process compiles it once.

use crate::batch;
use crate::derivation::Derivation;
use crate::diagram::Diagram;
use crate::error::raised;
use crate::filter::Filter;
use crate::learning;
use crate::origin::{Origin, Reduced, Setting, of_text};
use crate::posterior::Posterior;
use crate::question::{Kept, Question};
use crate::sheet::Sheet;
use crate::value::{Names, settings};
use crate::work::patiently;
use bp_core::compiler::io::Format;
use bp_core::compiler::learn::Settings;
use bp_core::prelude::{self, Cases, Error, Learned};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;

/// A Bayesian Program, or a network of another tool, with its settings, from `open`, `program` or `read`.
///
/// Immutable: each method returns a new program, so one program may be used by several threads at once. Pickled as its
/// text and settings. Methods that answer raise `ProgramError` (a wrong question, under its words), `InputError` (a
/// wrong name or value), `ImpossibleEvidence` and `NoAnswer`.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Program {
    program: prelude::Program,
    origin: Origin,
    /// The report of learning, as JSON.
    pub(crate) report: Option<String>,
    asked: Kept,
}

impl Program {
    pub(crate) fn new(program: prelude::Program, origin: Origin) -> Self {
        Self { program, origin, report: None, asked: Kept::default() }
    }

    /// The program with one more setting.
    pub(crate) fn set(&self, setting: Setting) -> Result<Self, Error> {
        let program = setting.applied(self.program.clone())?;
        let mut origin = self.origin.clone();
        origin.settings.push(setting);
        Ok(Self::new(program, origin))
    }

    /// A learned program, with its report.
    fn learned(&self, learned: &Learned) -> Self {
        let mut origin = self.origin.clone();
        // Parameters are in the text of the learned program.
        origin.settings.retain(|setting| !matches!(setting, Setting::With(..)));
        origin.text = learned.text().map(|text| (text.to_owned(), Format::Program.endings()[0]));
        Self {
            report: serde_json::to_string(learned.report()).ok(),
            ..Self::new(learned.program().clone(), origin)
        }
    }
}

#[pymethods]
impl Program {
    /// Opens a program (`.bp`) or a network (BIF, XMLBIF, UAI, Hugin NET), by its extension. Raises `ProgramError`, `OSError`.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let from = path.clone();
        let program = patiently(py, move || prelude::Program::open(from))?.map_err(raised)?;
        let format = Format::of(&path).unwrap_or(Format::Program);
        let text = program.text().map(|text| (text.to_owned(), format.endings()[0]));
        Ok(Self::new(program, Origin { text, settings: Vec::new() }))
    }

    /// A program, or a network of another format (`bif`, `xmlbif`, `uai`, `net`), from its text. Raises `ProgramError`.
    #[staticmethod]
    #[pyo3(signature = (text, format = "bp"))]
    fn parse(text: &str, format: &str) -> PyResult<Self> {
        of_text(text, format)
    }

    /// The program with values for parameters (a number, a list, an array) or sizes of sets: `with_(rate=0.2, N=5)`. Other
    /// names are given as a mapping: `with_({"P(O | C)": field})`. Raises `InputError` for a name or value that does not fit.
    #[pyo3(signature = (values = None, /, **named))]
    fn with_(&self, values: Option<&Bound<'_, PyAny>>, named: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let (all, more) = (settings(values)?, settings(named.map(|named| named.as_any()))?);
        let mut settings = all.iter().chain(more.iter());
        let mut program = Self::new(self.program.clone(), self.origin.clone());
        settings
            .try_for_each(|(name, value)| {
                program = program.set(Setting::With(name.to_owned(), value.clone()))?;
                Ok(())
            })
            .map_err(raised)?;
        Ok(program)
    }

    /// The program with this number of draws for estimates.
    fn draws(&self, count: usize) -> PyResult<Self> {
        self.set(Setting::Draws(count)).map_err(raised)
    }

    /// The program with this random seed: the same seed gives the same answer.
    fn seed(&self, seed: u64) -> PyResult<Self> {
        self.set(Setting::Seed(seed)).map_err(raised)
    }

    /// The program with a strategy: `sums`, `join_tree`, `gaussian`, `chain`, `weighting`, `gibbs`, `particles`, or `InputError`.
    fn by(&self, strategy: String) -> PyResult<Self> {
        self.set(Setting::By(strategy)).map_err(raised)
    }

    /// The program with a budget of products: an exact answer that needs more is estimated instead, where it can be.
    fn budget(&self, products: u64) -> PyResult<Self> {
        self.set(Setting::Budget(products)).map_err(raised)
    }

    /// The name.
    #[getter]
    fn name(&self) -> &str {
        self.program.name()
    }

    /// The documentation: the lines after `///`.
    #[getter]
    fn documentation(&self) -> &str {
        self.program.model().documentation.trim()
    }

    /// The names of the variables.
    #[getter]
    fn variables(&self) -> Vec<String> {
        self.program.variables()
    }

    /// The names of the declared questions.
    #[getter]
    fn questions(&self) -> Vec<String> {
        self.program.questions().into_iter().map(str::to_owned).collect()
    }

    /// The corrections made when a network was read, one line each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.program.warnings().to_vec()
    }

    /// The text, as it was read or learned; `None` of a program without text.
    #[getter]
    fn text(&self) -> Option<&str> {
        self.program.text()
    }

    /// Of a learned program the report of learning, a dict: `cases`, `cells_missing`, `ln_likelihood` (nats), `forms`, …
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.report.as_ref().map(|report| py.import("json")?.call_method1("loads", (report,))).transpose()
    }

    /// The answer to a question, or to a declared one by its name. A question is compiled once and kept.
    fn ask(&self, py: Python<'_>, question: &str) -> PyResult<Posterior> {
        let asked = self.asked.of(py, &self.program, question)?;
        asked.ask(py)
    }

    /// The answers of a question with several, `P(Rain); entropy P(Rain)`.
    fn ask_all(&self, py: Python<'_>, question: &str) -> PyResult<Vec<Posterior>> {
        let asked = self.asked.of(py, &self.program, question)?;
        asked.ask_all(py)
    }

    /// A question, compiled for repeated use with other values.
    fn question(slf: &Bound<'_, Self>, question: &str) -> PyResult<Question> {
        let own = slf.get();
        let asked = own.asked.of(slf.py(), &own.program, question)?;
        Ok(Question::new(asked, slf.clone().unbind(), question))
    }

    /// A filter: the posterior at each instant, given the observations up to it, by `step`. The posteriors of the last `keep`
    /// instants are kept. Raises `ProgramError`, and `NoAnswer` if no filter answers the question.
    #[pyo3(signature = (question, *, keep = 500))]
    fn filter(&self, py: Python<'_>, question: &str, keep: usize) -> PyResult<Filter> {
        Filter::new(py, &self.program, question, keep)
    }

    /// The posterior of each variable, or of those in `only`, given evidence: a mapping of names to values; `of(name)` reads it.
    #[pyo3(signature = (evidence = None, *, only = None))]
    fn marginals(
        &self,
        py: Python<'_>,
        evidence: Option<&Bound<'_, PyAny>>,
        only: Option<Names>,
    ) -> PyResult<Posterior> {
        let (program, known) = (self.program.clone(), crate::value::evidence(evidence)?);
        let only = only.unwrap_or_default();
        patiently(py, move || program.marginals_of(&only.0, &known))?.map(Posterior::from).map_err(raised)
    }

    /// The joint posterior of some variables: a table with an axis for each, in the order of `names`.
    #[pyo3(signature = (names, evidence = None))]
    fn joint(
        &self,
        py: Python<'_>,
        names: Names,
        evidence: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Posterior> {
        let (program, known) = (self.program.clone(), crate::value::evidence(evidence)?);
        patiently(py, move || program.joint(&names.0, &known))?.map(Posterior::from).map_err(raised)
    }

    /// The most probable value of all variables together (MPE), by `mode()`; `number()` is ln of its probability, nats.
    #[pyo3(signature = (evidence = None))]
    fn most_probable(&self, py: Python<'_>, evidence: Option<&Bound<'_, PyAny>>) -> PyResult<Posterior> {
        let (program, known) = (self.program.clone(), crate::value::evidence(evidence)?);
        patiently(py, move || program.most_probable(&known))?.map(Posterior::from).map_err(raised)
    }

    /// The entropy of some variables together, nats, and a list of
    /// (variable, information in nats) of what observing each of some others would tell, the most first.
    #[pyo3(signature = (about, among = None, evidence = None))]
    fn observations(
        &self,
        py: Python<'_>,
        about: Names,
        among: Option<Names>,
        evidence: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(f64, Vec<(String, f64)>)> {
        let (program, known) = (self.program.clone(), crate::value::evidence(evidence)?);
        let among = among.unwrap_or_default();
        let found = patiently(py, move || program.observations(&about.0, &among.0, &known))?;
        let (entropy, all) = found.map_err(raised)?;
        Ok((entropy, all.into_iter().map(|one| (one.variable, one.information)).collect()))
    }

    /// The posteriors of many cases, the rows of a table with a column for each observed variable; null and NaN are not
    /// observed. `table` is a pandas, polars or Arrow frame, a mapping of names to arrays, or the path of a CSV file; `only`
    /// names some variables, and `ignore` columns to leave out. Rows run in parallel without the interpreter lock.
    ///
    /// Returns a frame of the same kind (else `Columns`) with a row for each case: `ln_p_evidence` (nats), `variable=value`
    /// for the probability of each value, `variable.mean` and `variable.deviation` for each real, float64, and `error`, text,
    /// the reason of a case without an answer, whose numbers are NaN. Raises `DataError` with row and column.
    #[pyo3(signature = (table, *, only = None, ignore = Names::default()))]
    fn batch<'py>(
        slf: &Bound<'py, Self>,
        table: &Bound<'py, PyAny>,
        only: Option<Names>,
        ignore: Names,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = (slf, table, only.unwrap_or_default().0, ignore.0);
        slf.py().import("bayesian_programs.frames")?.call_method1("batch", arguments)
    }

    /// The names of the columns of `batch`, `error` included: they are known before the first case. `observed` names columns of
    /// the table that tell sizes, such as `Z[3]`.
    #[pyo3(signature = (*, only = None, observed = Names::default()))]
    fn batch_columns(&self, only: Option<Names>, observed: Names) -> PyResult<Vec<String>> {
        let nothing: [&str; 0] = [];
        let cases = observed.0.iter().fold(Cases::new(), |cases, name| cases.column(name, nothing));
        let columns = self.program.batch_columns(cases.only(only.unwrap_or_default().0));
        let mut columns = columns.map_err(raised)?;
        columns.push("error".to_owned());
        Ok(columns)
    }

    /// The posteriors of many cases: column names, columns (numpy), and the reason of each row without an answer.
    fn _batch<'py>(
        &self,
        py: Python<'py>,
        table: &Bound<'py, PyAny>,
        only: Vec<String>,
        ignore: Vec<String>,
    ) -> PyResult<batch::Columns<'py>> {
        batch::batch(py, &self.program, table, &only, &ignore)
    }

    /// Learns the `unknown` forms, and the parameters that `identification` names, from a table with a row for each case:
    /// a frame, a mapping of names to columns, or the path of a CSV file; null and NaN are missing values, which are summed
    /// out. `hidden` names variables without a column, `ignore` columns without a variable, `weight` the column of weights,
    /// `sequence` over time the column that identifies the sequence of a row; `seed` and `iterations` are those of EM.
    /// Returns the learned program; `report` describes what was learned. Raises `DataError` with row and column.
    #[pyo3(signature = (
        table, *, hidden = Names::default(), ignore = Names::default(), weight = None, sequence = None, seed = None,
        iterations = None
    ))]
    #[allow(clippy::too_many_arguments)]
    fn learn(
        &self,
        py: Python<'_>,
        table: &Bound<'_, PyAny>,
        hidden: Names,
        ignore: Names,
        weight: Option<&str>,
        sequence: Option<&str>,
        seed: Option<u64>,
        iterations: Option<usize>,
    ) -> PyResult<Self> {
        let columns = learning::Columns { hidden, ignore, weight, sequence };
        let learning = learning::of(py, &self.program, table, columns, (seed, iterations))?;
        let program = self.program.clone();
        let learned = patiently(py, move || program.learn(learning))?.map_err(raised)?;
        Ok(self.learned(&learned))
    }

    /// The program whose sets have the rows of tables as their elements: a column named as a field fills it, a column named
    /// as a family is evidence where its cells have values. `of` names the sets of the first tables, by default those of their
    /// columns; `ignore` names columns to leave out. Raises `DataError` with row and column.
    #[pyo3(signature = (*tables, of = Vec::new(), ignore = Names::default()))]
    fn rows(
        &self,
        py: Python<'_>,
        tables: &Bound<'_, PyTuple>,
        of: Vec<Option<String>>,
        ignore: Names,
    ) -> PyResult<Self> {
        let rows = learning::rows(py, &self.program, tables, of, ignore)?;
        let program = self.program.clone().rows(rows).map_err(raised)?;
        Ok(Self::new(program, Origin { text: None, ..self.origin.clone() }))
    }

    /// Learns the `unknown` forms, and the parameters that `identification` names, from its rows: their elements are pooled.
    #[pyo3(signature = (*, seed = None, iterations = None))]
    fn learn_from_rows(
        &self,
        py: Python<'_>,
        seed: Option<u64>,
        iterations: Option<usize>,
    ) -> PyResult<Self> {
        let own = Settings::default();
        let (seed, iterations) = (seed.unwrap_or(own.seed), iterations.unwrap_or(own.iterations));
        let (program, settings) = (self.program.clone(), Settings { seed, iterations, ..own });
        let learned = patiently(py, move || program.learn_from_rows(&settings))?.map_err(raised)?;
        Ok(self.learned(&learned))
    }

    /// The posterior of each missing cell of the rows of `rows`, given the others.
    fn missing(&self, py: Python<'_>) -> PyResult<Vec<Posterior>> {
        let program = self.program.clone();
        let found = patiently(py, move || program.missing())?;
        Ok(found.map_err(raised)?.into_iter().map(Posterior::from).collect())
    }

    /// The derivation of the answer, step by step; of all declared questions if none is given. Raises `ProgramError`.
    #[pyo3(signature = (question = None))]
    fn explain(&self, question: Option<&str>) -> PyResult<Derivation> {
        Derivation::of(&self.program, question, self.origin.options()).map_err(raised)
    }

    /// The network. With a question its variables are marked; with evidence (`{}` for
    /// none) each node shows its posterior, and observed nodes are shaded.
    #[pyo3(signature = (question = None, *, evidence = None))]
    fn diagram(
        &self,
        py: Python<'_>,
        question: Option<&str>,
        evidence: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Diagram> {
        Diagram::asked(py, &self.program, question, evidence)
    }

    /// The program in the brace layout of the formalism, as `bp print` shows it.
    fn print(&self) -> PyResult<Sheet> {
        Sheet::of(&self.program, self.origin.is_program()).map_err(raised)
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<Reduced> {
        slf.get().origin.reduced(slf.py(), slf.get().report.clone())
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memory: &Bound<'_, PyAny>) -> Py<Self> {
        // It is immutable.
        slf
    }

    fn __repr__(&self) -> String {
        let variables = self.program.variables();
        let shown: Vec<&str> = variables.iter().take(8).map(String::as_str).collect();
        let more = if variables.len() > shown.len() { ", …" } else { "" };
        format!("<Program {}: {}{more}>", self.program.name(), shown.join(", "))
    }

    fn __str__(&self) -> String {
        self.program.text().map_or_else(|| self.__repr__(), str::to_owned)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("program", (slf,))
    }

    fn _repr_latex_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("program_latex", (slf,))
    }
}
