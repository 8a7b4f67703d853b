//! The Python package `bayesian_programs`: programs, questions and answers of `bp_core`, and the map of `bvm`.
//!
//! In: Python values, numpy arrays, tables by Arrow's C data interface. Out: classes of Python, under the names that
//! `bp_core::prelude` gives them. Invariant: long work runs without the interpreter lock; every error of a program, of data
//! or of a question is a Python exception with its place.

mod array;
mod batch;
mod derivation;
mod diagram;
mod error;
mod experiment;
mod filter;
mod head;
mod learning;
mod origin;
mod posterior;
mod program;
mod question;
mod sheet;
mod table;
mod value;
mod volumetric;
mod work;

use bp_core::compiler::door::{self, Door};
use pyo3::prelude::*;

/// The compiled part of `bayesian_programs`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    door::enter(Door::Python);
    module.add_class::<program::Program>()?;
    module.add_class::<question::Question>()?;
    module.add_class::<filter::Filter>()?;
    module.add_class::<posterior::Posterior>()?;
    module.add_class::<derivation::Derivation>()?;
    module.add_class::<diagram::Diagram>()?;
    module.add_class::<sheet::Sheet>()?;
    module.add_class::<value::Likelihood>()?;
    module.add_class::<volumetric::Map>()?;
    module.add_class::<volumetric::Gaze>()?;
    module.add_class::<head::Head>()?;
    module.add_function(wrap_pyfunction!(origin::restored, module)?)?;
    module.add_function(wrap_pyfunction!(question::questioned, module)?)?;
    module.add_function(wrap_pyfunction!(posterior::restored, module)?)?;
    module.add_function(wrap_pyfunction!(derivation::restored, module)?)?;
    module.add_function(wrap_pyfunction!(diagram::restored, module)?)?;
    module.add_function(wrap_pyfunction!(sheet::restored, module)?)?;
    module.add_function(wrap_pyfunction!(batch::stream, module)?)?;
    module.add_function(wrap_pyfunction!(experiment::experiment, module)?)?;
    module.add_function(wrap_pyfunction!(volumetric::disparities, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
