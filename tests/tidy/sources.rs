//! Tidiness: headers, lengths, the direction of imports, dependencies, and where probabilities are written.
//!
//! In: the text of every Rust file and `Cargo.toml` of the workspace. Out: a list of violations. Invariant: every
//! exception is listed here, with its reason.

use std::fs::{read, read_dir};
use std::path::{Path, PathBuf};

/// Upper limit on the lines of a file.
const MOST_LINES: usize = 400;

/// Packages that the workspace may depend on.
const PACKAGES: [&str; 55] = [
    "ahrs",
    "allocation-counter",
    "ariadne",
    "arrow-array",
    "arrow-schema",
    "atomic-write-file",
    "base64",
    "bp-core",
    "bp-macros",
    "bvm",
    "ciborium",
    "clap",
    "clap_complete",
    "criterion",
    "csv",
    "ctrlc",
    "dejavu",
    "flate2",
    "httparse",
    "indicatif",
    "libm",
    "lsp-server",
    "lsp-types",
    "mcap",
    "memmap2",
    "naga",
    "nalgebra",
    "numpy",
    "pest",
    "pest_derive",
    "plotters",
    "png",
    "pollster",
    "proc-macro2",
    "proptest",
    "pulp",
    "pxfm",
    "pyo3",
    "pyo3-arrow",
    "quote",
    "rand",
    "rand_distr",
    "rayon",
    "roxmltree",
    "serde",
    "serde_json",
    "sofar",
    "statrs",
    "tempfile",
    "thiserror",
    "toml",
    "trybuild",
    "unicode-normalization",
    "vqf-rs",
    "wgpu",
];

/// Packages that must be in use, and the code that shows it.
const PRESCRIBED: [(&str, &str); 7] = [
    ("nalgebra", "nalgebra::"),
    ("pest", "pest::"),
    ("serde", "serde::"),
    ("rayon", "rayon::"),
    ("thiserror", "thiserror::Error"),
    ("proptest", "proptest::prelude"),
    ("statrs", "statrs::"),
];

/// Parts of bp-core that exchange inputs, sizes and results by keys.
const TYPED: [&str; 7] = ["kernel", "loops", "lower", "exec", "emit", "posterior", "answer"];

/// Calls that parse text.
const PHRASES: [&str; 7] = [
    ".strip_prefix(",
    ".strip_suffix(",
    ".starts_with(",
    ".split_once(",
    ".ends_with('",
    ".ends_with(\"",
    ".replace(\"",
];

/// Their files that format text, and why.
const SPELLERS: [(&str, &str); 2] = [
    ("emit/names.rs", "it makes identifiers of the names of a program"),
    ("kernel/words.rs", "it makes sentences"),
];

/// Words of densities. Those of the map are in `bvm/models/*.bp`, and evaluated by bp-core.
const PROBABILITY: [&str; 8] =
    [".exp()", ".exp2()", "exp_m1", "erf", "statrs", "FRAC_2_SQRT_PI", "SQRT_TAU", "normal_cumulative"];

/// Where such a word occurs in bvm, and why it is not a probability of the map.
const NOT_OF_THE_MAP: [(&str, &str); 4] = [
    ("bvm/src/audition/binaural.rs", "the decay of a window"),
    ("bvm/src/audition/cochlea.rs", "poles and centre frequencies of filters"),
    ("bvm/src/audition/sphere.rs", "complex phases of sound"),
    (
        "bvm/src/vision/stereo/scanline/law.rs",
        "`models/scanline.bp` as numbers, tested against its own answer",
    ),
];

struct File {
    /// From the root, with `/`.
    path: String,
    text: String,
}

fn collect(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    let mut paths: Vec<PathBuf> = read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !name.starts_with('.') && !name.starts_with("target") {
                collect(&path, extension, found);
            }
        } else if path.extension().is_some_and(|known| known == extension) {
            found.push(path);
        }
    }
}

/// Every file of the workspace with this extension.
fn files(extension: &str) -> Vec<File> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    collect(root, extension, &mut paths);
    let file = |path: PathBuf| {
        // One of the wrong programs is not text.
        let text = String::from_utf8_lossy(&read(&path).unwrap()).into_owned();
        let path = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
        File { path, text }
    };
    paths.into_iter().map(file).collect()
}

#[track_caller]
fn nothing(wrong: &[String]) {
    assert!(wrong.is_empty(), "not tidy:\n{}", wrong.join("\n"));
}

/// The text without its comments; sufficient if no string contains `//`.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// Whether a text contains a word, not as a part of a longer one.
fn has_word(text: &str, word: &str) -> bool {
    let is_part = |character: char| character.is_alphanumeric() || character == '_';
    text.match_indices(word).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + word.len()..]);
        let starts = !word.starts_with(is_part) || !before.ends_with(is_part);
        let ends = !word.ends_with(is_part) || !after.starts_with(is_part);
        starts && ends
    })
}

#[test]
fn every_file_begins_with_its_documentation_and_is_short() {
    let mut wrong = Vec::new();
    let all = files("rs");
    assert!(all.len() > 100, "the workspace was not found");
    for file in &all {
        let first = file.text.lines().find(|line| !line.starts_with("#!["));
        if !first.is_some_and(|line| line.starts_with("//! ")) {
            wrong.push(format!("{}: does not open with `//!`", file.path));
        }
        let lines = file.text.lines().count();
        if lines > MOST_LINES {
            wrong.push(format!("{}: {lines} lines, more than {MOST_LINES}", file.path));
        }
    }
    nothing(&wrong);
}

#[test]
fn nothing_is_left_for_later() {
    // Concatenated here, so that this file does not contain them.
    let words: Vec<String> = [
        ("todo", "!("),
        ("unimplemented", "!("),
        ("dbg", "!("),
        ("#[igno", "re"),
        ("TO", "DO"),
        ("FIX", "ME"),
        ("XX", "X"),
    ]
    .iter()
    .map(|(start, end)| format!("{start}{end}"))
    .collect();
    let mut wrong = Vec::new();
    for file in files("rs").into_iter().chain(files("bp")).chain(files("toml")) {
        for word in words.iter().filter(|word| has_word(&file.text, word)) {
            wrong.push(format!("{}: has `{word}`", file.path));
        }
    }
    nothing(&wrong);
}

/// The parts of bp-core in the order of the table in docs/architecture.md, and the allowed imports of each.
fn import_table() -> Vec<(String, Vec<String>)> {
    let page = files("md").into_iter().find(|file| file.path == "docs/architecture.md").expect("the page");
    let (_, rest) = page.text.split_once("## Who imports whom").expect("the heading of the table");
    let section = rest.split("\n## ").next().unwrap_or(rest);
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let names = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<String>>();
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').collect();
        (names(cells[1]).remove(0), names(cells[2]))
    })
    .collect()
}

/// The path of a file of bp-core within its interface (`program/…`) or its compiler (`model/…`).
fn inside_of_core(file: &File) -> Option<&str> {
    let inside = file.path.strip_prefix("bp-core/src/")?;
    Some(inside.strip_prefix("compiler/").unwrap_or(inside))
}

/// The parts of bp-core that a part's code imports.
fn imports(part: &str, parts: &[String], all: &[File]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for file in all {
        let Some(inside) = inside_of_core(file) else { continue };
        if inside.split(['/', '.']).next() != Some(part) {
            continue;
        }
        // Imports of tests are not restricted.
        let text = code(file.text.split("#[cfg(test)]").next().unwrap_or(""));
        for other in parts.iter().filter(|other| *other != part) {
            if has_word(&text, &format!("crate::{other}")) {
                found.push((other.clone(), file.path.clone()));
            }
        }
    }
    found
}

#[test]
fn imports_follow_the_table_of_the_architecture() {
    let mut wrong = Vec::new();
    let (table, all) = (import_table(), files("rs"));
    let mut parts: Vec<String> = all
        .iter()
        .filter_map(inside_of_core)
        .filter_map(|inside| inside.split(['/', '.']).next())
        .filter(|part| !["lib", "bin", "mod"].contains(part))
        .map(str::to_owned)
        .collect();
    parts.dedup();
    parts.sort();
    parts.dedup();
    for (row, (part, allowed)) in table.iter().enumerate() {
        for other in allowed {
            if !table[..row].iter().any(|(earlier, _)| earlier == other) {
                wrong.push(format!(
                    "docs/architecture.md: `{part}` imports `{other}`, which does not stand above it"
                ));
            }
        }
        let found = imports(part, &parts, &all);
        for (other, path) in found.iter().filter(|(other, _)| !allowed.contains(other)) {
            wrong.push(format!("{path}: `{part}` imports `{other}`, which the table does not list"));
        }
        for other in allowed.iter().filter(|other| !found.iter().any(|(one, _)| one == *other)) {
            wrong.push(format!("docs/architecture.md: `{part}` does not import `{other}`; strike it"));
        }
    }
    for part in parts.iter().filter(|part| !table.iter().any(|(row, _)| row == *part)) {
        wrong.push(format!("docs/architecture.md: the table has no row for `{part}`"));
    }
    let of_library = |file: &&File| {
        file.path.starts_with("bp-core/src/")
            && !["/bin/", "/lib.rs"].iter().any(|one| file.path.contains(one))
    };
    for file in all.iter().filter(of_library) {
        if code(&file.text).contains("crate::{") {
            wrong.push(format!("{}: import each part in a line of its own", file.path));
        }
    }
    nothing(&wrong);
}

#[test]
fn every_file_of_the_tests_is_a_module() {
    let all = files("rs");
    let mut wrong = Vec::new();
    for file in &all {
        let Some((folder, name)) = file.path.rsplit_once('/') else { continue };
        let tests =
            ["tests/", "bp-core/tests/", "bvm/tests/"].iter().any(|start| file.path.starts_with(start));
        // The wrong programs of `tests/macros` are compiled one by one; benches and files in the folder itself are targets.
        if !tests
            || name == "main.rs"
            || folder.ends_with("tests")
            || ["tests/macros", "tests/benches", "tests/support"].contains(&folder)
        {
            continue;
        }
        let module = match name {
            "mod.rs" => folder.rsplit('/').next().unwrap_or(""),
            _ => name.trim_end_matches(".rs"),
        };
        let above =
            if name == "mod.rs" { folder.rsplit_once('/').map_or("", |(above, _)| above) } else { folder };
        let declares = |other: &&File| {
            let near = other.path.starts_with(&format!("{above}/")) || other.path.contains("/main.rs");
            near && (has_word(&other.text, &format!("mod {module};")))
        };
        if !all.iter().any(|other| declares(&other)) {
            wrong.push(format!("{}: no file has `mod {module};`, so its tests do not run", file.path));
        }
    }
    nothing(&wrong);
}

#[test]
fn stages_of_the_compiler_share_keys_and_no_phrases() {
    let mut wrong = Vec::new();
    for file in files("rs") {
        let Some(inside) = inside_of_core(&file) else { continue };
        let part = inside.split(['/', '.']).next().unwrap_or("");
        if !TYPED.contains(&part) || SPELLERS.iter().any(|(path, _)| *path == inside) {
            continue;
        }
        let (text, _) = file.text.split_once("#[cfg(test)]").unwrap_or((&file.text, ""));
        for call in PHRASES.iter().filter(|call| code(text).contains(**call)) {
            wrong.push(format!("{}: has `{call}`: match on a key, not on text", file.path));
        }
    }
    nothing(&wrong);
}

#[test]
fn the_map_s_probabilities_are_in_its_programs() {
    let mut wrong = Vec::new();
    for file in files("rs").iter().filter(|file| file.path.starts_with("bvm/src/")) {
        if NOT_OF_THE_MAP.iter().any(|(path, _)| *path == file.path) {
            continue;
        }
        let text = code(&file.text);
        for word in PROBABILITY.iter().filter(|word| has_word(&text, word)) {
            wrong.push(format!("{}: has `{word}`; probabilities belong in bvm/models", file.path));
        }
    }
    let programs = files("bp").iter().filter(|file| file.path.starts_with("bvm/models/")).count();
    assert!(programs >= 5, "{programs} programs");
    nothing(&wrong);
}

#[test]
fn dependencies_are_the_listed_ones_and_the_prescribed_are_used() {
    let mut wrong = Vec::new();
    for file in files("toml").iter().filter(|file| file.path.ends_with("Cargo.toml")) {
        let mut section = "";
        for line in file.text.lines() {
            if let Some(header) = line.strip_prefix('[') {
                section = header.trim_end_matches(']');
            } else if section.ends_with("dependencies") {
                let name = line.split(['.', ' ', '=']).next().unwrap_or("");
                if !name.is_empty() && !name.starts_with('#') && !PACKAGES.contains(&name) {
                    wrong.push(format!("{}: `{name}` is not a listed package", file.path));
                }
            }
        }
    }
    let all = files("rs");
    for (package, use_) in PRESCRIBED {
        let used = |file: &&File| file.path != "tests/tidy/sources.rs" && code(&file.text).contains(use_);
        if !all.iter().any(|file| used(&file)) {
            wrong.push(format!("`{package}` is prescribed, but no code uses `{use_}`"));
        }
    }
    nothing(&wrong);
}
