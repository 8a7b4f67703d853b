//! The `bp emit` command.
//!
//! In: the built binary, programs of `tests/programs`. Out: Rust and WGSL, exit statuses, messages. Invariant: code for
//! fixed sizes does not read them.

use std::path::Path;
use std::process::Command;

/// The output or the message of `bp emit` for a program.
fn emit(code: i32, program: &str, arguments: &[&str]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/programs").join(program);
    let command = Command::new(env!("CARGO_BIN_EXE_bp")).arg("emit").arg(path).args(arguments).output();
    let output = command.unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{program} {arguments:?}: {message}");
    if code == 0 { String::from_utf8(output.stdout).unwrap() } else { message }
}

#[test]
fn rust_and_shaders_are_written() {
    let shader = emit(0, "cell.bp", &["state", "--to", "wgsl"]);
    assert!(shader.contains("@compute @workgroup_size(64)"), "{shader}");
    let rust = emit(0, "wet_grass.bp", &["rain"]);
    assert!(rust.contains("pub mod rain {") && rust.contains("pub fn rain<'a>()"), "{rust}");
    let message = emit(1, "vestibular.bp", &["--to", "wgsl"]);
    assert!(message.contains("is not answered by loops"), "{message}");
}

#[test]
fn a_shader_for_known_sizes_does_not_read_them() {
    let read = "how many values `V` has";
    assert!(emit(0, "cell.bp", &["state", "--to", "wgsl"]).contains(read));
    assert!(!emit(0, "cell.bp", &["state", "--to", "wgsl", "--size", "Velocity=7"]).contains(read));
    let message = emit(1, "cell.bp", &["state", "--to", "wgsl", "--size", "Speed=7"]);
    assert!(message.contains("no size `Speed`; there are `") && message.contains("`Velocity`"), "{message}");
    let message = emit(1, "cell.bp", &["state", "--size", "Velocity=7"]);
    assert!(message.contains("`--to wgsl`"), "{message}");
    let twice = ["state", "--to", "wgsl", "--size", "Velocity=7", "--size", "Velocity=8"];
    assert!(emit(1, "cell.bp", &twice).contains("`Velocity` is given twice"));
    for size in ["Velocity=0", "Velocity", "=7", "Velocity=2000000000"] {
        let message = emit(2, "cell.bp", &["state", "--to", "wgsl", "--size", size]);
        assert!(message.contains("N from 1 to"), "{size}: {message}");
    }
}

#[test]
fn values_that_several_nests_need_are_computed_once() {
    // The standard deviation of a ray: the bounds of the bins, their masses and the last state of a scan depend on it.
    let rust = emit(0, "line_of_sight.bp", &[]);
    assert_eq!(rust.matches("is_below_infinity").count(), 1, "{rust}");
}

#[test]
fn a_size_that_leaves_no_values_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("few.bp");
    let text = "program Few { parameters { N : size; } variables { X : 1..=N - 3; } decomposition { P(X) }
        forms { P(X) = uniform; } question x { P(X) } }";
    std::fs::write(&path, text).unwrap();
    let few = path.to_str().unwrap();
    assert!(emit(0, few, &["--to", "wgsl", "--size", "N=5"]).contains("cell % 2"));
    let message = emit(1, few, &["--to", "wgsl", "--size", "N=3"]);
    assert!(
        message.contains("`X`") && message.contains("it would have 0 values; at least 1 is needed"),
        "{message}"
    );
}
