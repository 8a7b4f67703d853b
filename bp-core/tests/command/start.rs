//! `bp new` and `bp reference`: what a beginner types first.
//!
//! In: names, legal and not. Out: what was written, run at once. Invariant: nothing that exists is changed.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn bp(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).current_dir(folder).output().unwrap()
}

fn well(folder: &Path, arguments: &[&str]) -> String {
    let output = bp(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The newest library beside this test, to compile against.
fn library() -> (PathBuf, PathBuf) {
    let deps = std::env::current_exe().unwrap().parent().unwrap().to_path_buf();
    let mut found: Vec<_> = std::fs::read_dir(&deps)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            name.starts_with("libbp_core-") && name.ends_with(".rlib")
        })
        .collect();
    found.sort_by_key(|path| std::fs::metadata(path).unwrap().modified().unwrap());
    (found.pop().expect("the library is built"), deps)
}

#[test]
fn what_is_written_runs_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let said = well(folder.path(), &["new", "wet_lawn"]);
    assert!(said.contains("wet_lawn.bp") && said.contains("bp ask wet_lawn/wet_lawn.bp rain"), "{said}");
    let own = folder.path().join("wet_lawn");
    // 0.3 (0.9 · 0.9 + 0.1 · 0.99) = 0.2727 and 0.7 (0.6 · 0.01 + 0.4 · 0.9) = 0.2562.
    let answer = well(&own, &["ask", "wet_lawn.bp", "rain"]);
    assert!(answer.contains("0.515598"), "{answer}");
    well(&own, &["check", "wet_lawn.bp"]);
    well(&own, &["fmt", "--check", "wet_lawn.bp"]);
    well(&own, &["print", "wet_lawn.bp"]);
    // 3 of 8 days have rain; Laplace's succession or the frequency, as the report says.
    let report = well(&own, &["learn", "wet_lawn.bp", "--data", "wet_lawn.csv", "--out", "learned.bp"]);
    assert!(report.contains("8 cases"), "{report}");
    assert!(std::fs::read_to_string(own.join("learned.bp")).unwrap().contains("0.375"));

    let (library, deps) = library();
    let program = own.join("program");
    let compiled = Command::new("rustc")
        .args(["--edition", "2024", "src/main.rs", "-o"])
        .arg(&program)
        .arg("--extern")
        .arg(format!("bp_core={}", library.display()))
        .arg("-L")
        .arg(format!("dependency={}", deps.display()))
        .current_dir(&own)
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let run = Command::new(&program).current_dir(&own).output().unwrap();
    let printed = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success() && printed.contains("0.5156"), "{printed}");
    let package = std::fs::read_to_string(own.join("Cargo.toml")).unwrap();
    assert!(package.contains("name = \"wet_lawn\"") && package.contains("bp-core"), "{package}");
}

#[test]
fn names_that_exist_or_are_illegal_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("there")).unwrap();
    std::fs::write(folder.path().join("file"), "mine").unwrap();
    for (name, why) in [
        ("there", "exists"),
        ("file", "exists"),
        ("", "empty"),
        ("1st", "begin with a letter"),
        ("a-b", "`-`"),
        ("../up", "`.`"),
        ("test", "a word of Cargo"),
    ] {
        let output = bp(folder.path(), &["new", "--", name]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(why), "{name}: {said}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("file")).unwrap(), "mine");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else was written");
}

#[test]
fn the_reference_prints_entries_and_lists() {
    let folder = tempfile::tempdir().unwrap();
    let all = well(folder.path(), &["reference"]);
    for name in ["forms: ", "functions: ", "questions: ", "domains: ", "poisson", "von_mises", "smooth"] {
        assert!(all.contains(name), "{all}");
    }
    let entry = well(folder.path(), &["reference", "poisson"]);
    assert!(entry.contains("rˣ exp(−r) / x!") && entry.contains("program Poisson {"), "{entry}");
    assert!(!entry.contains("**") && !entry.contains("```"), "{entry}");
    let both = well(folder.path(), &["reference", "max"]);
    assert!(both.contains("max (functions)") && both.contains("max (questions)"), "{both}");
    let wide = well(folder.path(), &["reference", "forms"]);
    assert!(wide.lines().all(|line| line.chars().count() <= 80) && wide.lines().count() >= 40, "{wide}");
    let output = bp(folder.path(), &["reference", "poison"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && said.contains("poisson"), "{said}");
    // An error names the entry that explains it.
    let path = folder.path().join("wrong.bp");
    std::fs::write(
        &path,
        "program W { variables { X : real; } decomposition { P(X) } forms { P(X) = normal(1); } }",
    )
    .unwrap();
    let output = bp(folder.path(), &["check", "wrong.bp"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("see: bp reference normal"), "{said}");
}
