//! Every program of the repository, by every strategy, every back end and every way to ask.
//!
//! In: the programs of `examples/`, `tests/programs/` and `bvm/models/`, found by their extension. Out: pass or fail. Invariant: a
//! program that is added is tested without being named here; what is left out is counted, and a lower limit of what is
//! tested is asserted.

mod back_ends;
mod questions;

use std::path::{Path, PathBuf};

/// The programs.
fn paths() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths: Vec<PathBuf> = ["examples", "bvm/models", "tests/programs"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "bp"))
        .collect();
    paths.sort();
    paths
}

/// Whether two numbers agree: relative to the second, or to a thousandth where it is smaller.
fn is_near(found: f64, expected: f64, tolerance: f64) -> bool {
    found == expected
        || found.is_nan() && expected.is_nan()
        || (found - expected).abs() <= tolerance * expected.abs().max(1e-3)
}
