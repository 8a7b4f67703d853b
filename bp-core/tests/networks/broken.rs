//! Broken network files: each gives a line, a column and a reason, without a panic.
//!
//! In: wrong files, arbitrary texts, words of the formats, and right files with a few characters changed. Out:
//! messages. Invariant: no text causes a panic.

use crate::dialects::{ASIA_LIKE, MARKOV, NET, UAI, XML, read};
use bp_core::compiler::io::{self, Format, uai};
use bp_core::compiler::source::Source;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4000) })]

    #[test]
    fn any_text_gets_an_answer(text in "\\PC{0,120}") {
        answered(&text);
    }

    #[test]
    fn words_of_the_formats_get_an_answer(words in prop::collection::vec(prop::sample::select(WORDS.to_vec()), 0..60)) {
        answered(&words.join(" "));
    }

    #[test]
    fn a_mutated_file_gets_an_answer(
        which in 0..5usize, at in any::<prop::sample::Index>(), length in 0..9usize, with in "[\\PC\n]{0,4}",
    ) {
        let texts = [ASIA_LIKE, XML, NET, UAI, MARKOV];
        let mut letters: Vec<char> = texts[which].chars().collect();
        let start = at.index(letters.len());
        let end = (start + length).min(letters.len());
        letters.splice(start..end, with.chars());
        answered(&letters.into_iter().collect::<String>());
    }
}

const WORDS: [&str; 40] = [
    "network",
    "variable",
    "probability",
    "type",
    "discrete",
    "table",
    "default",
    "property",
    "net",
    "node",
    "potential",
    "states",
    "data",
    "=",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    ";",
    ",",
    "|",
    "\"",
    "a",
    "b",
    "0.5",
    "1",
    "2",
    "-1",
    "1e999",
    "BAYES",
    "MARKOV",
    "4294967296",
    "<BIF>",
    "<NETWORK>",
    "</NETWORK>",
    "//",
    "/*",
    "%",
];

/// Reads a text in every format, and shows the errors.
fn answered(text: &str) {
    let source = Source::new("any", text);
    for format in Format::ALL {
        match io::read(&source, format) {
            Ok(network) => {
                network.warnings.iter().for_each(|warning| assert!(!warning.line(&source).is_empty()))
            }
            Err(wrong) => assert!(!wrong.render(&source, false).is_empty()),
        }
    }
    if let Err(wrong) = uai::evidence(&source, &read(Format::Uai, UAI).model) {
        wrong.render(&source, false);
    }
}

/// A variable with two values and one with three, followed by `rest`.
fn bif(rest: &str) -> String {
    format!(
        "variable a {{ type discrete [2] {{ x, y }}; }}\nvariable b {{ type discrete [3] {{ x, y, z }}; }}\n{rest}"
    )
}

#[test]
fn broken_files_get_a_line_a_column_and_a_reason() {
    let whole = "probability (a) { table 0.5, 0.5; }\n";
    let cases: [(Format, String, (usize, usize), &str); 30] = [
        (Format::Bif, String::new(), (1, 1), "this file declares no variable"),
        (
            Format::Bif,
            "graph {".into(),
            (1, 1),
            "expected `network`, `variable` or `probability`, found `graph`",
        ),
        (
            Format::Bif,
            "variable a {\n type discrete [3] { x, y };\n}".into(),
            (2, 2),
            "variable `a` is declared with 3 values, but 2 are named",
        ),
        (
            Format::Bif,
            "variable a { type discrete [2] { x, x }; }".into(),
            (1, 10),
            "two values of `a` are called `x`",
        ),
        (
            Format::Bif,
            "variable a { type real; }".into(),
            (1, 19),
            "expected `discrete`: a network has finite variables, found `real`",
        ),
        (
            Format::Bif,
            "variable a {\n type discrete [2] { x, ".into(),
            (2, 25),
            "expected the name of a value, `,` or `}`, found the end of the file",
        ),
        (
            Format::Bif,
            bif("variable a { type discrete [1] { x }; }"),
            (3, 10),
            "variable `a` is declared twice",
        ),
        (Format::Bif, bif(whole), (2, 10), "variable `b` has no distribution"),
        (Format::Bif, bif("probability (c | a) { }"), (3, 14), "unknown variable `c`"),
        (Format::Bif, bif("probability (a | a) { }"), (3, 13), "`a` occurs twice here"),
        (
            Format::Bif,
            bif("probability (a) { table 0.5; }"),
            (3, 19),
            "expected 2 probabilities here, found 1",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, -0.5; }"),
            (3, 30),
            "a probability lies between 0 and 1, but this is -0.5",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, nan; }"),
            (3, 30),
            "expected a probability, found `nan`",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, 0.6; }"),
            (3, 19),
            "the probabilities of `a` sum to 1.1, more than 1 % away from 1",
        ),
        (Format::Bif, bif("probability (b | a) { (x) 0.1, 0.2, 0.7; }"), (3, 13), "`b` has no row for a = y"),
        (
            Format::Bif,
            bif("probability (b | a) { (w) 0.1, 0.2, 0.7; }"),
            (3, 24),
            "`w` is not a value of `a`",
        ),
        (
            Format::Bif,
            bif("probability (b | a) { (x, y) 0.1, 0.2, 0.7; }"),
            (3, 23),
            "this row names 2 values: expected 1, one for each parent",
        ),
        (
            Format::Bif,
            bif("probability (b | a) { (x) 0.1, 0.2, 0.7;\n(x) 1, 0, 0; }"),
            (4, 1),
            "the row of a = x is written twice",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, 0.5; }\nprobability (a) { table 0.5, 0.5; }"),
            (4, 13),
            "variable `a` has two distributions",
        ),
        (
            Format::Bif,
            bif("probability (a | b) { default 0.5, 0.5; }\nprobability (b | a) { default 0, 0, 1; }"),
            (3, 13),
            "the decomposition has a cycle: a ← b ← a",
        ),
        (Format::Bif, bif("/* open"), (3, 1), "this `/*` is never closed"),
        (
            Format::Xmlbif,
            "<BIF><NETWORK></BIF>".into(),
            (1, 15),
            "this is not XML: expected 'NETWORK' tag, not 'BIF'",
        ),
        (Format::Xmlbif, "<html></html>".into(), (1, 1), "expected `<BIF>` with a `<NETWORK>` in it"),
        (Format::Xmlbif, XML.replace("0.1 0.9", "0.1 x"), (6, 52), "expected a probability, found `x`"),
        (
            Format::Xmlbif,
            XML.replace("<GIVEN>a</GIVEN>", ""),
            (6, 25),
            "expected 2 probabilities (1 rows of 2), found 4",
        ),
        (
            Format::Hugin,
            NET.replace("(b | a)", "(b a)"),
            (5, 11),
            "expected one node before the `|`: a potential of several nodes is not a conditional distribution",
        ),
        (Format::Hugin, NET.replace("potential (a)", "potential (c)"), (7, 12), "unknown node `c`"),
        (Format::Uai, "GRAPH".into(), (1, 1), "expected `BAYES` or `MARKOV`, found `GRAPH`"),
        (Format::Uai, UAI.replace("2 0 1", "2 0 7"), (6, 5), "unknown variable 7: they are 0 to 1"),
        (
            Format::Uai,
            UAI[..UAI.len() - 5].into(),
            (13, 5),
            "expected a probability, found the end of the file",
        ),
    ];
    let mut different = Vec::new();
    for (format, text, place, message) in &cases {
        let source = Source::new("broken", text);
        let wrong = io::read(&source, *format).expect_err(text);
        let first = wrong.iter().next().unwrap();
        let found = source.line_and_column(first.span.start);
        if (&found, first.message.as_str()) != (place, *message) {
            different.push(format!("{found:?} {}\n   expected {place:?} {message}", first.message));
        }
        assert!(wrong.render(&source, false).contains("broken:"), "{}", wrong.render(&source, false));
    }
    assert!(different.is_empty(), "{}", different.join("\n"));
}

#[test]
fn a_mistake_on_an_endless_line_is_shown_with_its_surroundings() {
    let text = format!("{}0.5 -3 {}", bif("probability (a) { table "), "0.1 ".repeat(1000));
    let source = Source::new("long.bif", text);
    let page = io::read(&source, Format::Bif).unwrap_err().render(&source, false);
    assert!(page.contains("long.bif:3:29") && page.contains("-3 0.1 0.1"), "{page}");
    assert!(page.lines().all(|line| line.chars().count() < 120), "{page}");
}
