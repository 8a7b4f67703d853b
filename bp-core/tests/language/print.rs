//! The brace layout: `bp print`.
//!
//! In: the programs of the gallery and of the map, and unfinished ones. Out: golden pages for one program, and what every
//! page must have. Invariant: XML is well-formed; what is missing is listed; lines fit a terminal.

use super::pages::{bp, count, golden, parsed, programs};
use std::io::Write;
use std::process::{Command, Stdio};

/// `bp print -` of a text: status, stdout, stderr.
fn printed(text: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_bp"))
        .args(["print", "-"])
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

const PARTS: [&str; 8] = [
    "Program",
    "Description",
    "Specification",
    "Relevant variables",
    "Decomposition",
    "Forms",
    "Identification",
    "Question",
];

#[test]
fn a_program_in_the_brace_layout() {
    let file = "tests/programs/wet_grass.bp";
    golden("wet_grass_print.txt", &bp(&["print", file]));
    golden("wet_grass_print.tex", &bp(&["print", file, "--latex"]));
    golden("wet_grass_print.svg", &bp(&["print", file, "--svg"]));
    golden("wet_grass_print.html", &bp(&["print", file, "--html"]));
    golden("cell_print.txt", &bp(&["print", "tests/programs/cell.bp"]));
}

#[test]
fn every_program_has_all_parts_in_every_output() {
    let mut seen = 0;
    for file in programs() {
        let text = bp(&["print", &file]);
        for part in PARTS {
            assert!(text.contains(part), "{file} has no {part}:\n{text}");
        }
        let wide: Vec<&str> = text.lines().filter(|line| line.chars().count() > 80).collect();
        assert!(wide.is_empty(), "{file}: {wide:#?}");
        // One of them misses a parameter, for a test of messages.
        let unfinished = text.contains("no question is declared") || file == "tests/programs/binaural.bp";
        assert!(!text.contains("\nMissing\n") || unfinished, "{file}:\n{text}");
        let svg = bp(&["print", &file, "--svg"]);
        assert!(count(&parsed(&svg), "svg") >= 1, "{file}");
        let html = bp(&["print", &file, "--html"]);
        assert!(count(&parsed(&html), "math") > 4, "{file}");
        seen += 1;
    }
    assert!(seen > 40, "only {seen} programs");
}

#[test]
fn an_unfinished_program_prints_what_there_is_and_lists_what_is_missing() {
    let (status, page, stderr) = printed(
        "program Draft { variables { Rain, Wet : bool; } decomposition { P(Rain) P(Wet | Rain) } forms { P(Rain) = bernoulli(0.3); } }",
        &[],
    );
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    assert!(
        page.contains("P(Rain) = bernoulli(0.3)") && page.contains("P(Wet | Rain) has no form yet"),
        "{page}"
    );
    let (_, missing) = page.split_once("\nMissing\n").expect("a list");
    assert!(missing.contains("P(Wet | Rain)") && missing.contains("no question is declared"), "{missing}");
    assert!(page.contains("Rain → Wet"), "{page}");
    // Nothing but a name; a variable without a factor; a factor of an unknown variable.
    let (status, page, _) = printed("program Empty { }", &[]);
    assert!(status == Some(0) && page.contains("none yet") && page.contains("\nMissing\n"), "{page}");
    let (_, page, _) = printed("program Half { variables { A, B : bool; } decomposition { P(A | C) } }", &[]);
    assert!(page.contains("variable `B` has no distribution") && page.contains("C → A"), "{page}");
    for output in ["--svg", "--html", "--latex"] {
        let (status, page, _) = printed("program Half { variables { A : bool; } }", &[output]);
        assert!(status == Some(0) && page.contains("Missing"), "{output}: {page}");
    }
    // What cannot be read is an error.
    let (status, page, stderr) = printed("program Broken { variables { A }", &[]);
    assert!(status == Some(1) && page.is_empty() && stderr.contains("expected"), "{stderr}");
}

#[test]
fn a_network_prints_as_its_program() {
    let page = bp(&["print", "examples/door/alarm.bif"]);
    assert!(PARTS.iter().all(|part| page.contains(part)), "{page}");
}
