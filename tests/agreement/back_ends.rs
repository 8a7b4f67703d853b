//! The kernels of an answer, by every back end.
//!
//! In: a question to a random program. Out: pass or fail. Invariant: the kernel of emitted code, which is not run
//! again, gives by the interpreter and by the lanes the result of the guarded kernel of `ask`, which is compared with
//! enumeration; its shader is valid WebGPU.

use crate::enumerate::{Ask, Evidence};
use crate::question::near;
use bp_core::compiler::answer::link;
use bp_core::compiler::emit::wgsl::emit_wgsl;
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret, scalar::Scalar};
use bp_core::compiler::lower::{lower, lower_guarded};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Options, Route, plan};

/// Whether all back ends compute an ask's kernels equally; `given` are arrays by name.
pub(crate) fn verdict(
    model: &Model,
    (ask, question): (&Ask, &Question),
    given: &[(String, Vec<f64>)],
    shader: bool,
) -> Result<(), String> {
    // Likelihoods outside the range of f32 are tested in f64 only.
    let fits = |weight: &f64| *weight == 0.0 || (1e-30..1e30).contains(weight);
    let fits_single = (ask.known.iter().chain(&ask.from)).all(|(_, evidence)| match evidence {
        Evidence::Virtual(weights) => weights.iter().all(fits),
        _ => true,
    });
    let message = |error: Error| error.to_string();
    let model = link(model).map_err(message)?;
    let narrow: Vec<(&str, Vec<f32>)> = given
        .iter()
        .map(|(name, numbers)| (name.as_str(), numbers.iter().map(|one| *one as f32).collect()))
        .collect();
    let double = given.iter().fold(Inputs::new(), |inputs, (name, numbers)| inputs.array(name, numbers));
    let single = narrow.iter().fold(Inputs::new(), |inputs, (name, numbers)| inputs.array(name, numbers));
    for route in plan(&model, question, Options::default()).map_err(message)?.routes {
        let Route::Exact(exact) = route else { continue };
        let guarded = Lanes::new(lower_guarded(&model, &exact, &question.name).map_err(message)?.kernel);
        let truth = guarded.run_guarded(&double, true).map_err(message)?.outputs;
        let kernel = lower(&model, &exact, &question.name).map_err(message)?.kernel;
        let lanes = Lanes::new(kernel.clone());
        agree("interpreter", &truth, &interpret(&kernel, &double).map_err(message)?, near)?;
        agree("lanes in f64", &truth, &lanes.run(&double).map_err(message)?, near)?;
        if fits_single {
            // A logarithm in f32 has a relative error of 1e-7.
            let roughly =
                |found: f64, expected: f64| near(found, expected) || (found - expected).abs() < 1e-3;
            agree("lanes in f32", &truth, &lanes.run(&single).map_err(message)?, roughly)?;
        }
        if shader && !kernel.nodes.values().any(|node| node.integrated().is_some()) {
            is_valid(&emit_wgsl(&kernel).map_err(message)?.text)?;
        }
    }
    Ok(())
}

fn agree<T: Scalar>(
    by: &str,
    truth: &Outputs<f64>,
    found: &Outputs<T>,
    near: impl Fn(f64, f64) -> bool,
) -> Result<(), String> {
    for (name, cells) in &found.arrays {
        let truth = truth.arrays.iter().find(|(own, _)| own == name).map(|(_, cells)| cells);
        let truth = truth.ok_or_else(|| format!("{by}: an output {name:?} more"))?;
        for (cell, (found, expected)) in cells.iter().zip(truth).enumerate() {
            if !near(found.to_f64(), *expected) {
                return Err(format!("{by}: {name:?}[{cell}] = {}, expected {expected}", found.to_f64()));
            }
        }
    }
    Ok(())
}

fn is_valid(shader: &str) -> Result<(), String> {
    let module = naga::front::wgsl::parse_str(shader).map_err(|error| error.emit_to_string(shader))?;
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator.validate(&module).map(|_| ()).map_err(|error| error.emit_to_string(shader))
}
