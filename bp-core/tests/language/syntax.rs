//! Round trips: every program prints to text that parses to an equal tree.
//!
//! In: the programs of `tests/programs`, and trees and texts made at random. Out: pass or fail. Invariant: for any
//! text, parsing terminates without a panic.

use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{check, compile, parse};
use proptest::prelude::*;

fn programs() -> Vec<Source> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/programs");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 6, "programs are missing from {folder}");
    let read = |path: &std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Source::new(name, std::fs::read_to_string(path).unwrap())
    };
    paths.iter().map(read).collect()
}

fn round_trip(source: &Source) {
    let file = parse(source).unwrap_or_else(|wrong| panic!("{}", wrong.render(source, false)));
    let printed = Source::new(format!("{} printed", source.name), file.to_string());
    let again = parse(&printed).unwrap_or_else(|wrong| panic!("{}", wrong.render(&printed, false)));
    assert_eq!(file, again, "{}", printed.text);
    assert_eq!(printed.text, again.to_string());
}

#[test]
fn programs_print_to_text_that_parses_to_an_equal_tree() {
    programs().iter().for_each(round_trip);
}

#[test]
fn comments_survive_printing() {
    let text = "// head\n/// says\nprogram A { // open\n variables { A : bool; /* star */ // one\n // two\n B : bool;\n // thirteen\n }\n\
                decomposition { P(A) // three\n P(B /* four */ | A) }\n forms { P(A) = table { // five\n 0.5, 0.5; // six\n };\n\
                P(B | A) = uniform; } question q { P(A) // seven\n // eleven\n } // eight\n // twelve\n } // nine\n // ten";
    let source = Source::new("comments", text);
    round_trip(&source);
    let printed = parse(&source).unwrap().to_string();
    for word in "head says open star one two three four five six seven eight nine ten eleven twelve thirteen"
        .split(' ')
    {
        assert_eq!(printed.matches(word).count(), 1, "{word} in\n{printed}");
    }
    assert_eq!(parse(&source).unwrap().programs[0].comments.documentation(), "says");
}

#[test]
fn a_text_that_nests_deeply_is_refused() {
    let head = "program A { variables { A : bool; } decomposition { P(A) } forms { P(A) = ";
    let bodies = [
        format!("{}1{}", "bernoulli(".repeat(100_000), ")".repeat(100_000)),
        format!("bernoulli({}1)", "-".repeat(100_000)),
        format!("bernoulli({}true)", "not ".repeat(100_000)),
        format!("bernoulli(1{})", " + 1".repeat(100_000)),
        format!("bernoulli(a{})", "[1]".repeat(100_000)),
        format!("bernoulli(a{})", ".b".repeat(100_000)),
        format!("bernoulli(O{})", "^-1".repeat(100_000)),
        format!("{} uniform", "let a = 1 in ".repeat(100_000)),
        format!("{}uniform", "previous(A) else ".repeat(100_000)),
        format!("bernoulli({}1{})", "(1 + 1 + 1 + ".repeat(40_000), ")".repeat(40_000)),
        format!("bernoulli({}1{})", "if A { 1 } else { ".repeat(40_000), "}".repeat(40_000)),
    ];
    for body in bodies {
        let source = Source::new("deep", format!("{head}{body}; }} }}"));
        assert!(parse(&source).is_err(), "{}", &body[..20]);
    }
    for body in [format!("{}1{}", "(".repeat(44), ")".repeat(44)), format!("1{}", " + 1".repeat(500))] {
        let almost = Source::new("almost", format!("{head}bernoulli({body}); }} }}"));
        round_trip(&almost);
        if let Err(wrong) = compile(&almost) {
            wrong.render(&almost, false);
        }
    }
}

#[test]
fn nothing_takes_long_to_read() {
    let started = std::time::Instant::now();
    for opening in ["first(A[", "ask(A[", "A.P(B[", "f(A[", "(match A[", "(if A["] {
        let text = format!("program A {{ forms {{ P(A) = dirac({}", opening.repeat(23));
        assert!(parse(&Source::new("long", text)).is_err());
    }
    assert!(started.elapsed().as_secs() < 5);
}

/// The text that a macro reconstructs from its tokens has additional blanks.
#[test]
fn blanks_and_newlines_mean_nothing() {
    for source in programs() {
        let bare: String =
            source.text.lines().map(|line| line.split("//").next().unwrap_or("").to_owned() + " ").collect();
        let mut spaced = String::new();
        for character in bare.chars() {
            match character {
                '(' | ')' | '[' | ']' | '{' | '}' | ';' | ',' | '|' | '^' | '+' | '-' | '*' => {
                    spaced.push_str(&format!("\n{character} "));
                }
                _ => spaced.push(character),
            }
        }
        let tree = |text: String| parse(&Source::new("blanks", text)).unwrap();
        assert_eq!(tree(bare), tree(spaced));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn trees_print_to_text_that_parses_to_an_equal_tree(file in crate::trees::file()) {
        let printed = Source::new("tree", file.to_string());
        let again = parse(&printed).unwrap_or_else(|wrong| panic!("{}", wrong.render(&printed, false)));
        prop_assert_eq!(&file, &again, "{}", printed.text);
        prop_assert_eq!(&printed.text, &again.to_string());
        if let Err(wrong) = check(&again) {
            wrong.render(&printed, false);
        }
    }

    #[test]
    fn any_text_gets_an_answer(text in "\\PC{0,200}") {
        let source = Source::new("any", text);
        if let Err(wrong) = compile(&source) {
            wrong.render(&source, false);
        }
    }

    #[test]
    fn a_mutated_program_gets_an_answer(
        which in 0usize..6,
        cut in any::<prop::sample::Index>(),
        length in 0usize..30,
        piece in prop::sample::select(vec![
            "", ";", "{", "}", "(", ")", "[", "]", "|", "^-1", "P(", "=", "..=", "in", "if", "else", "'", "∝", "//", "/*",
            "0.5", "name", "-", "match", "table {", "let", "virtual [1]", "\u{0}", "é", "1e999", "18446744073709551616",
        ]),
    ) {
        let programs = programs();
        let text = &programs[which % programs.len()].text;
        let place = |mut position: usize| {
            while !text.is_char_boundary(position) {
                position -= 1;
            }
            position
        };
        let start = place(cut.index(text.len()));
        let end = place((start + length).min(text.len())).max(start);
        let source = Source::new("mutated", format!("{}{piece}{}", &text[..start], &text[end..]));
        if let Err(wrong) = compile(&source) {
            wrong.render(&source, false);
        }
    }
}
