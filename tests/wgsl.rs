//! Every exact answer as WGSL: the shader is one that WebGPU takes.
//!
//! In: the programs of `examples/` and `bvm/models/`. Out: nothing where all is well. Invariant: naga parses and validates
//! the shader of each question that has an exact kernel, and finds in it the entry points that are promised.

use bp_core::answer::link;
use bp_core::emit::wgsl::emit_wgsl;
use bp_core::kernel::{Kernel, Role};
use bp_core::lower::lower;
use bp_core::plan::{Options, Route, plan};
use bp_core::source::Source;
use bp_core::syntax::compile;
use std::path::Path;

/// The kernels of the exact answers of a program, with the questions' names.
fn kernels(path: &Path) -> Vec<(String, Kernel)> {
    let text = std::fs::read_to_string(path).unwrap();
    // Some of the programs of the tests are wrong on purpose.
    let Ok(model) = compile(&Source::new(path.display().to_string(), &text)) else { return Vec::new() };
    let Ok(model) = link(&model) else { return Vec::new() };
    let mut kernels = Vec::new();
    for question in model.questions.values() {
        let Ok(plan) = plan(&model, question, Options::default()) else { continue };
        for route in &plan.routes {
            if let Route::Exact(exact) = route
                && let Ok(lowered) = lower(&model, exact, &question.name)
            {
                kernels.push((format!("{}: {}", path.display(), question.name), lowered.kernel));
            }
        }
    }
    kernels
}

/// Whether naga takes the shader of a kernel, and finds its entry points.
fn is_valid(name: &str, kernel: &Kernel) {
    let shader = emit_wgsl(kernel);
    let module = naga::front::wgsl::parse_str(&shader.text)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&shader.text)));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{name}: {}", error.emit_to_string(&shader.text));
    }
    let found: Vec<&str> = module.entry_points.iter().map(|entry| entry.name.as_str()).collect();
    let promised: Vec<&str> = shader.passes.iter().map(|pass| pass.entry.as_str()).collect();
    assert_eq!(found, promised, "{name}");
}

#[test]
fn every_exact_kernel_is_a_valid_shader() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = ["examples", "bvm/models", "tests/programs"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "bp"))
        .collect();
    paths.sort();
    let mut count = 0;
    for (name, kernel) in paths.iter().flat_map(|path| kernels(path)) {
        is_valid(&name, &kernel);
        is_valid(&format!("{name}, sizes known"), &kernel.with_sizes(|_| Some(5)).unwrap());
        count += 1;
    }
    assert!(count >= 60, "only {count} kernels were found");
}

#[test]
fn the_map_step_is_one_pass_over_the_grid() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let kernels = kernels(&root.join("bvm/models/cell.bp"));
    let (_, kernel) = kernels.iter().find(|(name, _)| name.ends_with(": step")).unwrap();
    let shader = emit_wgsl(kernel);
    let over_grid: Vec<_> = shader.passes.iter().filter(|pass| pass.axes.len() == 3).collect();
    assert_eq!(over_grid.len(), 1, "{}", shader.text);
}

#[test]
fn what_only_its_invocation_reads_is_kept_by_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let kernels = kernels(&root.join("bvm/models/cell.bp"));
    let (_, kernel) = kernels.iter().find(|(name, _)| name.ends_with(": step")).unwrap();
    // Known sizes: of what is made, the host's answers and four numbers that are the same for all cells.
    let sizes = [("Grid.depth", 10), ("Grid.rows", 90), ("Grid.lanes", 360), ("Velocity", 7), ("Sensors", 1)];
    let kernel = kernel.with_sizes(|name| sizes.iter().find(|(known, _)| *known == name).map(|(_, n)| *n));
    let kernel = kernel.unwrap();
    let shader = emit_wgsl(&kernel);
    let (mut cells, mut answers) = (0, 0);
    for (id, buffer) in kernel.buffers.iter().filter(|(id, _)| shader.layout.is_stored(*id)) {
        let count: usize =
            kernel.buffers[id].axes.iter().map(|a| kernel.axes[*a].extent.known().unwrap()).product();
        match buffer.role {
            Role::Scratch => cells += count,
            Role::Output => answers += count,
            _ => {}
        }
    }
    assert_eq!((cells, answers), (4, 9 * 324_000), "{}", shader.text);
    assert!(!shader.text.contains("shape["), "every place is known: {}", shader.text);
    assert!(!shader.text.contains("for ("), "short loops are written out: {}", shader.text);
}
