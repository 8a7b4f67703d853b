//! The kernels of every program, by every back end that runs them.
//!
//! In: the kernel of each exact answer at known sizes, with values for its inputs. Out: pass or fail. Invariant: lanes and
//! JavaScript give the numbers of the interpreter within 1e-12, lanes in f32 within 1e-4 where products are not of
//! densities; the shader is valid WebGPU. Without node the test says that JavaScript was skipped.

use super::{is_near, paths};
use crate::support::node;
use bp_core::compiler::answer::link;
use bp_core::compiler::emit::javascript::emit_javascript;
use bp_core::compiler::emit::wgsl::{emit_wgsl, emit_wgsl_module};
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret, scalar::Scalar};
use bp_core::compiler::kernel::{InputKey, Kernel, Numbers, OutputKey, Reduce, Role};
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Mark, Options, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Iterations of a kernel above which the lanes are compared with each other, and not with the interpreter.
const MANY: usize = 200_000;

/// Prints the outputs of each case; numbers that JSON lacks are words.
const RUNNER: &str = r#"
const word = (number) => (Number.isFinite(number) ? number : String(number));
module(text).then((functions) => {
    const found = cases.map(({ name, inputs }) => {
        const { answers, lnEvidence } = functions[name](inputs);
        return { answers: answers.map((array) => Array.from(array, word)), lnEvidence };
    });
    console.log(JSON.stringify(found));
});
"#;

/// The kernel of an exact answer.
struct Own {
    label: String,
    kernel: Kernel,
    /// Whether it computes logarithms of densities, which need not be in the range of f32.
    is_log: bool,
}

/// The kernels of the exact answers of a program, as the program has them, and at known sizes.
fn kernels(path: &Path) -> (Vec<Kernel>, Vec<Own>) {
    let source = Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap());
    // Some of the programs are wrong alone: they are parts of tests.
    let Ok(model) = compile(&source) else { return Default::default() };
    let Ok(model) = link(&model) else { return Default::default() };
    let (mut written, mut sized) = (Vec::new(), Vec::new());
    for question in model.questions.values() {
        let Ok(plan) = plan(&model, question, Options::default()) else { continue };
        for route in &plan.routes {
            // A form that is still to be learned has no kernel.
            if let Route::Exact(exact) = route
                && let Ok(lowered) = lower(&model, exact, &question.name)
            {
                let kernel = lowered.kernel.with_default_sizes().unwrap().with_sizes(|_| Some(3)).unwrap();
                let label = format!("{}: {}", path.display(), question.name);
                sized.push(Own { label, kernel, is_log: exact.mark(&model) == Mark::Log });
                written.push(lowered.kernel);
            }
        }
    }
    (written, sized)
}

/// Values of the inputs of a kernel, different for each round; those with a default keep it in the first round.
fn inputs(kernel: &Kernel, round: usize) -> BTreeMap<String, Vec<f64>> {
    let mut given = BTreeMap::new();
    for (_, buffer) in kernel.buffers.iter() {
        let Role::Input { default, .. } = &buffer.role else { continue };
        let count = buffer.axes.iter().map(|axis| kernel.axes[*axis].extent.known().unwrap()).product();
        let number = |cell: usize| match (buffer.values.as_ref().map(|values| &values.numbers), default) {
            (Some(Numbers::Whole { first, count }), _) => {
                let count: usize = count.iter().map(|extent| extent.known().unwrap()).product();
                (first + ((7 * round + cell + count / 3) % count) as i64) as f64
            }
            (Some(Numbers::Bins(bins)), _) => bins.centre((7 * round + cell + 1) % bins.count()),
            (Some(Numbers::Real), _) => 0.5 + 0.75 * (round + cell) as f64,
            (None, Some(default)) => default * (1.0 - 0.03 * round as f64),
            (None, None) => 0.2 + 0.01 * ((3 * round + cell) % 7) as f64,
        };
        given.insert(buffer.name.clone(), (0..count).map(number).collect());
    }
    given
}

/// The inputs of each case: at the defaults, and after one input and then another has changed.
fn rounds(kernel: &Kernel) -> Vec<BTreeMap<String, Vec<f64>>> {
    let mut all = vec![inputs(kernel, 0)];
    for (round, (input, numbers)) in inputs(kernel, 1).into_iter().enumerate().take(2) {
        if round == 0 || kernel.nests.len() < 20 {
            let mut given = all[all.len() - 1].clone();
            given.insert(input, numbers);
            all.push(given);
        }
    }
    all
}

/// Whether a kernel reads what the host makes of a grid.
fn has_grid(kernel: &Kernel) -> bool {
    let of_grid =
        |role: &Role| matches!(role, Role::Positions(..) | Role::Input { key: InputKey::Wraps(_), .. });
    kernel.buffers.iter().any(|(_, buffer)| of_grid(&buffer.role))
}

fn work(kernel: &Kernel) -> usize {
    let extent = |axis: &_| kernel.axes[*axis].extent.known().unwrap();
    let of_nest = |nest: &bp_core::compiler::kernel::Nest| {
        let folded = match &nest.reduce {
            Reduce::Fold(_, axes) => axes.as_slice(),
            _ => &[],
        };
        kernel.buffers[nest.out].axes.iter().chain(folded).map(extent).product::<usize>()
    };
    kernel.nests.iter().map(of_nest).sum()
}

fn given<T: Scalar>(values: &BTreeMap<String, Vec<T>>) -> Inputs<'_, T> {
    values.iter().fold(Inputs::new(), |inputs, (name, numbers)| inputs.array(name, numbers))
}

fn agree<T: Scalar>(what: &str, truth: &Outputs<f64>, found: &Outputs<T>, tolerance: f64) {
    assert_eq!(truth.arrays.len(), found.arrays.len(), "{what}");
    for ((key, truth), (other, found)) in truth.arrays.iter().zip(&found.arrays) {
        assert_eq!((key, truth.len()), (other, found.len()), "{what}");
        for (cell, (expected, found)) in truth.iter().zip(found).enumerate() {
            let found = found.to_f64();
            assert!(is_near(found, *expected, tolerance), "{what}, {key:?}[{cell}]: {found}, not {expected}");
        }
    }
}

/// The outputs of a kernel, by the interpreter; lanes with one thread and with several agree with it.
fn run(own: &Own, values: &BTreeMap<String, Vec<f64>>) -> Outputs<f64> {
    let lanes = Lanes::new(own.kernel.clone());
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lanes.run(&given(values))).unwrap_or_else(|error| panic!("{}: {error}", own.label))
    };
    let (first, second) = (on(1), on(3));
    assert!(first == second || first.arrays.iter().any(|(_, cells)| cells.iter().any(|cell| cell.is_nan())));
    let truth = match work(&own.kernel) > MANY {
        true => first.clone(),
        false => interpret(&own.kernel, &given(values)).unwrap(),
    };
    agree(&format!("{}, lanes", own.label), &truth, &first, 1e-12);
    if !own.is_log {
        let narrow: BTreeMap<String, Vec<f32>> = (values.iter())
            .map(|(name, numbers)| (name.clone(), numbers.iter().map(|one| *one as f32).collect()))
            .collect();
        let single = lanes.run(&given(&narrow)).unwrap();
        agree(&format!("{}, lanes in f32", own.label), &truth, &single, 1e-4);
    }
    truth
}

/// The entry points of a shader that naga accepts.
fn entry_points(label: &str, text: &str) -> Vec<String> {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{label}: {}", error.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{label}: {}", error.emit_to_string(text));
    }
    module.entry_points.into_iter().map(|entry| entry.name).collect()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::String(word) => word.replace("Infinity", "inf").parse().unwrap(),
        value => value.as_f64().unwrap_or(f64::NEG_INFINITY),
    }
}

#[test]
fn every_kernel_has_the_same_numbers_in_lanes_and_in_javascript() {
    let has_node = node::is_there();
    let (mut count, mut refused) = (0, Vec::new());
    for path in paths() {
        let (_, all) = kernels(&path);
        let all: Vec<Own> = all.into_iter().filter(|own| !has_grid(&own.kernel)).collect();
        let (mut sized, mut cases) = (Vec::new(), Vec::new());
        for own in &all {
            let answered: Vec<_> =
                rounds(&own.kernel).into_iter().map(|values| (run(own, &values), values)).collect();
            count += answered.len();
            match emit_javascript(std::slice::from_ref(&own.kernel)) {
                Ok(_) => {
                    cases.extend(
                        answered.into_iter().map(|(truth, values)| (sized.len(), own, truth, values)),
                    );
                    sized.push(own.kernel.clone());
                }
                Err(reason) => refused.push(format!("{}: {reason}", own.label)),
            }
        }
        if !has_node || sized.is_empty() {
            continue;
        }
        let emitted = emit_javascript(&sized).unwrap();
        let asked: Vec<Value> = (cases.iter())
            .map(|(at, _, _, values)| json!({ "name": emitted.names[*at], "inputs": values }))
            .collect();
        let found = node::run(RUNNER, &json!({ "text": emitted.module(), "cases": asked }));
        assert_eq!(found.len(), cases.len());
        for ((_, own, truth, _), found) in cases.iter().zip(&found) {
            let mut answers = found["answers"].as_array().unwrap().iter();
            for (key, cells) in &truth.arrays {
                let numbers: Vec<f64> = match key {
                    OutputKey::Ask(_) => {
                        answers.next().unwrap().as_array().unwrap().iter().map(number).collect()
                    }
                    _ => vec![number(&found["lnEvidence"])],
                };
                assert_eq!(numbers.len(), cells.len(), "{}", own.label);
                for (found, expected) in numbers.iter().zip(cells) {
                    let what = &own.label;
                    assert!(
                        is_near(*found, *expected, 1e-12),
                        "{what} in JavaScript: {found}, not {expected}"
                    );
                }
            }
        }
    }
    assert!(count >= 60, "only {count} cases");
    // Those that are refused read a set without a size, or intervals without a function.
    for reason in &refused {
        let known = ["is given at run time", "displacements on a grid", "an interval under"];
        assert!(known.iter().any(|known| reason.contains(known)), "{reason}");
    }
    let javascript =
        if has_node { "with JavaScript" } else { "JavaScript skipped: there is no program `node`" };
    println!("{count} cases, {javascript}; refused:\n{}", refused.join("\n"));
}

#[test]
fn every_kernel_is_a_valid_shader() {
    let mut count = 0;
    for path in paths() {
        let (written, sized) = kernels(&path);
        for (kernel, own) in written.iter().zip(&sized) {
            for (kernel, size) in [(kernel, "as it is"), (&own.kernel, "sizes known")] {
                let shader = emit_wgsl(kernel).unwrap();
                let promised: Vec<&str> = shader.passes.iter().map(|pass| pass.entry.as_str()).collect();
                assert_eq!(entry_points(&own.label, &shader.text), promised, "{}, {size}", own.label);
            }
            count += 1;
        }
        // All questions of a program in one module.
        if !written.is_empty() {
            let found = entry_points(&path.display().to_string(), &emit_wgsl_module(&written).unwrap());
            let alone: usize = written.iter().map(|kernel| emit_wgsl(kernel).unwrap().passes.len()).sum();
            assert_eq!(found.len(), alone, "{}", path.display());
        }
    }
    assert!(count >= 60, "only {count} kernels were found");
}
