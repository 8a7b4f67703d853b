//! Plots, in a command that was built without them.
//!
//! In: a wish for a plot. Out: an error that says how to build them. Invariant: nothing is drawn.

use crate::failure::Failure;
use bp_core::compiler::answer::Answer;
use bp_core::compiler::data::Records;
use bp_core::compiler::learn::Learned;
use bp_core::compiler::model::Model;
use bp_core::compiler::source::Source;
use std::io::Write;
use std::path::Path;

pub(crate) fn answers(_: &Model, _: &[Answer], _: &Path, _: &mut impl Write) -> Result<(), Failure> {
    Err(Failure::Words("this `bp` was built without plots; build it with the feature `plot`".to_owned()))
}

pub(crate) fn check_path(path: &Path) -> Result<(), Failure> {
    answers(&Model::default(), &[], path, &mut std::io::sink())
}

pub(crate) fn learned(
    _: &Source,
    _: &Learned,
    _: Option<&Records>,
    path: &Path,
    out: &mut impl Write,
) -> Result<(), Failure> {
    answers(&Model::default(), &[], path, out)
}
