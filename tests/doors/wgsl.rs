//! Shaders: names of several questions, refusals, and the shader of the map.
//!
//! In: programs. Out: pass or fail. Invariant: naga parses and validates the shaders. That each kernel of the repository is a valid
//! shader is tested in bp-core with the other back ends.

use bp_core::compiler::answer::link;
use bp_core::compiler::emit::wgsl::{emit_wgsl, emit_wgsl_module};
use bp_core::compiler::kernel::{Kernel, Role};
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use std::path::Path;

/// The kernel of a step of the map.
fn step() -> Kernel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("bvm/models/cell.bp");
    let source = Source::new("cell", std::fs::read_to_string(path).unwrap());
    let model = link(&compile(&source).unwrap()).unwrap().into_owned();
    let plan = plan(&model, model.question("step").unwrap(), Options::default()).unwrap();
    let Route::Exact(exact) = &plan.routes[0] else { panic!("no sum") };
    lower(&model, exact, "step").unwrap().kernel
}

/// The entry points of a text that naga accepts.
fn entry_points(name: &str, text: &str) -> Vec<String> {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{name}: {}", error.emit_to_string(text));
    }
    module.entry_points.into_iter().map(|entry| entry.name).collect()
}

#[test]
fn several_questions_are_one_module_for_all_names() {
    let text = "program Names { variables { \"a\u{2028}b\" : bool; X : 3..=5; B : bins[0, 1, 10]; }
        decomposition { P(\"a\u{2028}b\") P(X | \"a\u{2028}b\") P(B | X) }
        forms { P(\"a\u{2028}b\") = bernoulli(0.25); P(X | \"a\u{2028}b\") = weights(X); P(B | X) = normal(X, 2); }
        question fn { P(X | \"a\u{2028}b\" = true) }
        question Fn { P(X | \"a\u{2028}b\") }
        question \"__\" { P(X | B = b) }
        question \"_\" { P(B | X = x) }
        question \"numbers\" { P(B) }
    }";
    let model = compile(&Source::new("names", text)).unwrap();
    let mut kernels = Vec::new();
    for question in model.questions.values() {
        for route in &plan(&model, question, Options::default()).unwrap().routes {
            let Route::Exact(exact) = route else { panic!("{} is no sum", question.name) };
            kernels.push(lower(&model, exact, &question.name).unwrap().kernel);
        }
    }
    let text = emit_wgsl_module(&kernels).unwrap();
    let found = entry_points("names", &text);
    for entry in ["fn_pass_0", "fn_2_pass_0", "_pass_0", "_2_pass_0", "numbers_pass_0"] {
        assert!(found.iter().any(|found| found == entry), "{found:?}");
    }
    assert!(text.contains("less 3, where a value is `3..=5`"), "{text}");
}

#[test]
fn intervals_without_a_function_are_refused() {
    let text = "program Bins { parameters { R : real = 2.5; } variables { X : bins(0, 10, 10); } decomposition { P(X) }
        forms { P(X) = gamma(R, 1); } question mass { P(X) } }";
    let model = compile(&Source::new("bins", text)).unwrap();
    let question = model.questions.values().next().unwrap();
    let plan = plan(&model, question, Options::default()).unwrap();
    let Route::Exact(exact) = &plan.routes[0] else { panic!("no sum") };
    let kernel = lower(&model, exact, "mass").unwrap().kernel;
    let error = emit_wgsl(&kernel).unwrap_err().to_string();
    assert!(error.contains("an interval under `gamma`"), "{error}");
}

#[test]
fn the_map_step_is_one_pass_over_the_grid() {
    let shader = emit_wgsl(&step()).unwrap();
    let over_grid: Vec<_> = shader.passes.iter().filter(|pass| pass.axes.len() == 3).collect();
    assert_eq!(over_grid.len(), 1, "{}", shader.text);
}

#[test]
fn values_read_by_one_invocation_are_kept_by_it() {
    // Known sizes: of the results, those of the host and five numbers that are the same for all cells.
    let sizes = [("Grid.depth", 10), ("Grid.rows", 90), ("Grid.lanes", 360), ("Velocity", 7), ("Sensors", 1)];
    let kernel = step().with_sizes(|name| sizes.iter().find(|(known, _)| *known == name).map(|(_, n)| *n));
    let kernel = kernel.unwrap();
    let shader = emit_wgsl(&kernel).unwrap();
    let (mut cells, mut answers) = (0, 0);
    for (id, buffer) in kernel.buffers.iter().filter(|(id, _)| shader.layout.is_stored(*id)) {
        let count: usize =
            kernel.buffers[id].axes.iter().map(|a| kernel.axes[*a].extent.known().unwrap()).product();
        match buffer.role {
            Role::Scratch => cells += count,
            Role::Output(_) => answers += count,
            _ => {}
        }
    }
    assert_eq!((cells, answers), (5, 9 * 324_000), "{}", shader.text);
    // Infinity alone is read from there.
    let read: Vec<&str> = shader.text.lines().filter(|line| line.contains("shape[")).collect();
    let is_infinity = |line: &&str| line.contains("shape[0]") && !line.contains("how many");
    assert!(read.iter().all(is_infinity), "every place is known: {}", shader.text);
    // Except for the total of the weights of velocities, which one invocation computes.
    let (_, parallel) = shader.text.split_once("fn pass_1").unwrap();
    assert!(!parallel.contains("for ("), "short loops are written out: {}", shader.text);
}
