//! Runs of the experiment of `bvm`, without files.
//!
//! In: names of scenes and policies, seeds. Out: the runs, as JSON. Invariant: a run depends on its scene, policy and seed
//! only, so rows may be computed anywhere and in any order.

use crate::error::{raised_by_map, wrong};
use crate::work::patiently_until;
use bvm::experiment::{Contender, Plan};
use bvm::exploration::PolicyKind;
use bvm::world::scene::Scene;
use pyo3::prelude::*;
use std::sync::atomic::Ordering::Relaxed;

/// The runs of each scene with each policy and seed, in this order, as a JSON array.
///
/// # Errors
/// A scene or policy that does not exist; a number of steps outside 1 to 100 000; an error of a run.
#[pyfunction]
#[pyo3(name = "_experiment")]
pub(crate) fn experiment(
    py: Python<'_>,
    scenes: Vec<String>,
    policies: Vec<String>,
    seeds: Vec<u64>,
    steps: usize,
) -> PyResult<String> {
    if !(1..=100_000).contains(&steps) {
        return Err(wrong(format!("steps is {steps}, but it must be from 1 to 100000")));
    }
    let scenes = scenes.iter().map(|name| Scene::find(name));
    let scenes = scenes.collect::<Result<Vec<_>, _>>().map_err(raised_by_map)?;
    let contenders = policies.iter().map(|name| contender(name)).collect::<PyResult<Vec<_>>>()?;
    let plan = Plan { scenes, contenders, seeds, steps, senses: None };
    let runs = patiently_until(py, move |unwanted| plan.measure(|| !unwanted.load(Relaxed)))?;
    let runs = runs.map_err(raised_by_map)?;
    serde_json::to_string(&runs).map_err(|error| wrong(error.to_string()))
}

fn contender(name: &str) -> PyResult<Contender> {
    Contender::of_name(name).ok_or_else(|| {
        let names = PolicyKind::ALL.map(PolicyKind::name).join(", ");
        wrong(format!("there is no policy `{name}`: expected {names}, oracle or floor"))
    })
}
