//! The gallery: every program of `examples/` compiles, prints to itself, and gives the answers of the literature.
//!
//! In: `examples/*.bp`. Out: pass or fail. Invariant: an expected number is published, counted by hand, or enumerated
//! here by loops that share no code with the library; none is our own output. Bessière, Mazer, Ahuactzin and Mekhnacha
//! (2013), *Bayesian Programming*; Lebeltel, Bessière, Diard and Mazer (2004), *Bayesian Robot Programming*.

mod boat;
mod known;
mod laws;
mod learned_robots;
mod learning;
mod networks;
mod robots;
mod rows;
mod water;

use bp_core::compiler::answer::{Answer, ask, link};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse, parse_question};
use known::{ANSWERS, Known, LEARNED};
use std::path::{Path, PathBuf};

pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

/// A program of the gallery, with its subroutines answered.
pub(crate) fn program(name: &str) -> Model {
    let path = folder().join(format!("{name}.bp"));
    let source = Source::new(name, std::fs::read_to_string(path).unwrap());
    let model = compile(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
    link(&model).unwrap().into_owned()
}

fn question(model: &Model, text: &str) -> Question {
    let source = Source::new("question", text);
    parse_question(&source, model).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)))
}

/// The answers to a typed or declared question.
pub(crate) fn answers(model: &Model, text: &str, given: &[(&str, &[f64])]) -> Result<Vec<Answer>, Error> {
    let inputs = given.iter().fold(Inputs::new(), |inputs, (name, values)| inputs.array(name, values));
    ask(model, &question(model, text), &inputs)
}

/// The probabilities of the single answer, row by row.
pub(crate) fn probabilities(model: &Model, text: &str, given: &[(&str, &[f64])]) -> Vec<f64> {
    let answers = answers(model, text, given).unwrap_or_else(|error| panic!("{}: {error}", model.name));
    assert_eq!(answers.len(), 1, "{text}");
    answers[0].answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

/// Compares two lists of numbers to a share of each number, at least `1e-12`.
#[track_caller]
pub(crate) fn near(found: &[f64], expected: &[f64], share: f64) {
    assert_eq!(found.len(), expected.len());
    for (row, (p, q)) in found.iter().zip(expected).enumerate() {
        assert!((p - q).abs() <= share * q.abs().max(1e-12), "row {row}: {p}, expected {q}");
    }
}

/// The files of the gallery without their extension.
fn names() -> Vec<String> {
    let paths = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let programs = paths.filter(|path| path.extension().is_some_and(|found| found == "bp"));
    let mut names: Vec<String> =
        programs.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn every_program_compiles_and_prints_to_itself() {
    let names = names();
    assert!(names.len() >= 30, "only {} programs in the gallery", names.len());
    let page = std::fs::read_to_string(folder().join("../docs/gallery.md")).unwrap();
    for name in names {
        let text = std::fs::read_to_string(folder().join(format!("{name}.bp"))).unwrap();
        let source = Source::new(name.as_str(), text.as_str());
        let tree = parse(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
        assert_eq!(tree.to_string(), text, "`bp fmt examples/{name}.bp` changes it");
        assert!(text.starts_with("/// "), "{name} has no documentation");
        assert!(!program(&name).questions.is_empty(), "{name} asks nothing");
        assert!(page.contains(&format!("../examples/{name}.bp")), "docs/gallery.md does not list {name}");
        let known = ANSWERS.iter().any(|known| known.file == name);
        let enumerated = known::ENUMERATED.contains(&name.as_str());
        let learned = LEARNED.contains(&name.as_str());
        assert!(known || enumerated || learned, "no answer of {name} is known to the tests");
    }
}

#[test]
fn declared_questions_are_answered() {
    for name in names() {
        let model = program(&name);
        for question in model.questions.values() {
            // Programs with inputs or `unknown` forms are tested in their own tests.
            if known::GIVEN_WHEN_ASKED.contains(&name.as_str()) || LEARNED.contains(&name.as_str()) {
                continue;
            }
            let found = ask(&model, question, &Inputs::new());
            let found = found.unwrap_or_else(|error| panic!("{name}, {}: {error}", question.name));
            assert_eq!(found.len(), question.asks.len());
            let numbers = found.iter().flat_map(|answer| &answer.answer).filter_map(|row| row.p());
            assert!(numbers.clone().all(|p| p.is_finite() && p >= 0.0), "{name}, {}", question.name);
        }
    }
}

#[test]
fn known_answers() {
    for Known { file, asked, given, rows, share } in ANSWERS {
        let found = answers(&program(file), asked, given).unwrap_or_else(|error| panic!("{file}: {error}"));
        let all: Vec<_> = found.iter().flat_map(|answer| &answer.answer).collect();
        for (values, p) in *rows {
            let row = all.iter().find(|row| {
                let named: Vec<&str> = row.values.iter().map(|(_, value)| value.as_str()).collect();
                named.join(" ") == *values
            });
            let row = row.unwrap_or_else(|| panic!("{file}, {asked}: there is no row `{values}` in {all:?}"));
            let found = row.p().unwrap();
            assert!((found - p).abs() <= share * p, "{file}, {asked}: {values} has {found}, expected {p}");
        }
    }
}
