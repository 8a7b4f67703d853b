//! Tidiness: headers, lengths, the direction of imports, dependencies, and where probabilities are written.
//!
//! In: the text of every Rust file and `Cargo.toml` of the workspace. Out: a list of what is not as it must be.
//! Invariant: nothing is excepted but what is listed here, with its reason.

use std::fs::{read, read_dir};
use std::path::{Path, PathBuf};

/// Lines of a file, at most.
const MOST_LINES: usize = 400;

/// Packages that the workspace may depend on.
const PACKAGES: [&str; 41] = [
    "allocation-counter",
    "ariadne",
    "atomic-write-file",
    "bp-core",
    "bp-macros",
    "bvm",
    "clap",
    "clap_complete",
    "criterion",
    "csv",
    "ctrlc",
    "dejavu",
    "flate2",
    "indicatif",
    "libm",
    "memmap2",
    "naga",
    "nalgebra",
    "pest",
    "pest_derive",
    "plotters",
    "png",
    "pollster",
    "proc-macro2",
    "proptest",
    "pulp",
    "pxfm",
    "quote",
    "rand",
    "rand_distr",
    "rayon",
    "roxmltree",
    "serde",
    "serde_json",
    "statrs",
    "tempfile",
    "thiserror",
    "toml",
    "trybuild",
    "unicode-normalization",
    "wgpu",
];

/// Packages that must do real work, and what of them is looked for in the code.
const PRESCRIBED: [(&str, &str); 7] = [
    ("nalgebra", "nalgebra::"),
    ("pest", "pest::"),
    ("serde", "serde::"),
    ("rayon", "rayon::"),
    ("thiserror", "thiserror::Error"),
    ("proptest", "proptest::prelude"),
    ("statrs", "statrs::"),
];

/// Which parts of bp-core a part must not name.
const DIRECTIONS: [(&str, &[&str]); 20] = [
    (
        "forms",
        &[
            "syntax",
            "equation",
            "kernel",
            "lower",
            "distribution",
            "emit",
            "exec",
            "posterior",
            "strategies",
            "plan",
            "learn",
            "answer",
            "io",
        ],
    ),
    ("model", &["syntax", "equation", "plan", "kernel", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("kernel", &["model", "syntax", "equation", "plan", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("loops", &["model", "syntax", "equation", "plan", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("syntax", &["equation", "plan", "kernel", "lower", "emit", "exec", "learn", "answer", "io"]),
    (
        "equation",
        &[
            "syntax",
            "kernel",
            "lower",
            "emit",
            "exec",
            "posterior",
            "strategies",
            "plan",
            "learn",
            "answer",
            "io",
        ],
    ),
    ("lower", &["syntax", "emit", "exec", "posterior", "strategies", "plan", "learn", "answer", "io"]),
    (
        "exec",
        &["syntax", "equation", "lower", "emit", "strategies", "learn", "answer", "io", "model", "plan"],
    ),
    ("posterior", &["syntax", "kernel", "lower", "emit", "strategies", "plan", "learn", "answer", "io"]),
    ("strategies", &["syntax", "emit", "plan", "learn", "answer", "io"]),
    ("plan", &["syntax", "kernel", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("draw", &["syntax", "equation", "plan", "kernel", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("gpu", &["model", "syntax", "equation", "plan", "lower", "learn", "answer", "io"]),
    ("emit", &["syntax", "learn", "answer", "io"]),
    ("distribution", &["syntax", "equation", "plan", "kernel", "lower", "emit", "learn", "answer", "io"]),
    (
        "sample",
        &["syntax", "equation", "kernel", "lower", "emit", "strategies", "plan", "learn", "answer", "io"],
    ),
    ("data", &["syntax", "equation", "plan", "kernel", "lower", "emit", "exec", "learn", "answer", "io"]),
    ("answer", &["syntax", "emit", "learn", "io"]),
    ("learn", &["syntax", "emit"]),
    ("io", &["plan", "kernel", "lower", "emit", "learn"]),
];

/// Parts of bp-core between which inputs, sizes and results are known by keys.
const TYPED: [&str; 7] = ["kernel", "loops", "lower", "exec", "emit", "posterior", "answer"];

/// Calls by which text is taken apart again.
const PHRASES: [&str; 7] = [
    ".strip_prefix(",
    ".strip_suffix(",
    ".starts_with(",
    ".split_once(",
    ".ends_with('",
    ".ends_with(\"",
    ".replace(\"",
];

/// Which of their files spell, and why.
const SPELLERS: [(&str, &str); 2] = [
    ("emit/names.rs", "it makes identifiers of the names of a program"),
    ("kernel/words.rs", "it makes sentences"),
];

/// Words of densities. The map's are in `bvm/models/*.bp`, and worked out by bp-core.
const PROBABILITY: [&str; 8] =
    [".exp()", ".exp2()", "exp_m1", "erf", "statrs", "FRAC_2_SQRT_PI", "SQRT_TAU", "normal_cumulative"];

/// Where such a word stands in bvm, and why it is no probability of the map.
const NOT_OF_THE_MAP: [(&str, &str); 1] = [(
    "bvm/src/vision/stereo/scanline/law.rs",
    "`models/scanline.bp` as numbers, tested against its own answer",
)];

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

/// The text without its comments; good enough where no string holds `//`.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// Whether a word stands in a text, not as a part of a longer one.
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
fn every_file_says_what_it_is_and_is_short() {
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
    // Put together here, so that this file does not hold them.
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

#[test]
fn imports_point_in_one_direction() {
    let mut wrong = Vec::new();
    for file in files("rs") {
        let Some(inside) = file.path.strip_prefix("bp-core/src/") else { continue };
        let part = inside.split(['/', '.']).next().unwrap_or("");
        let Some((_, forbidden)) = DIRECTIONS.iter().find(|(known, _)| *known == part) else { continue };
        let text = code(&file.text);
        for other in *forbidden {
            if has_word(&text, &format!("crate::{other}")) {
                wrong.push(format!("{}: {part} must not know {other}", file.path));
            }
        }
        if text.contains("crate::{") {
            wrong.push(format!("{}: imports of several parts in one line hide where they point", file.path));
        }
    }
    nothing(&wrong);
}

#[test]
fn stages_of_the_compiler_share_keys_and_no_phrases() {
    let mut wrong = Vec::new();
    for file in files("rs") {
        let Some(inside) = file.path.strip_prefix("bp-core/src/") else { continue };
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
