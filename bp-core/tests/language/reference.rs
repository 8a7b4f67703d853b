//! The reference against the language.
//!
//! In: the grammar, the lists that messages print, and `docs/reference/*.md`. Out: pass if each word of the language has
//! an entry, each entry a word, and each example the answer that it states. Invariant: stated answers are computed by
//! hand.

use crate::pages::bp;
use bp_core::compiler::law::Law;
use bp_core::compiler::plan::{Options, plan};
use bp_core::compiler::reference::{Entry, entries};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse};
use bp_core::evidence;
use bp_core::prelude::{Evidence, Program};
use std::collections::BTreeSet;

const GRAMMAR: &str = include_str!("../../src/compiler/syntax/grammar.pest");

/// Domains that are written by signs, and the question without a word.
const WITHOUT_WORD: [&str; 6] = ["labels", "range", "labels or range", "set", "vector", "P"];

/// The names that a message lists after these words.
fn listed(text: &str, words: &str) -> Vec<String> {
    let source = Source::new("one.bp".to_owned(), text);
    let page = compile(&source).unwrap_err().render(&source, false);
    let list = page.split_once(words).unwrap_or_else(|| panic!("{page}")).1.lines().next().unwrap();
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn of_form(form: &str) -> String {
    format!("program One {{ variables {{ X : bool; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}")
}

/// The words of the language, by kind: from the grammar and from the lists of forms, functions, questions and domains.
fn words() -> Vec<(&'static str, Vec<String>)> {
    let keywords = GRAMMAR.lines().filter(|line| line.starts_with("kw_"));
    let keywords = keywords.map(|line| line.split('"').nth(1).unwrap().to_owned());
    let forms = listed(&of_form("nothing_of_the_kind(1)"), "known forms are");
    let functions = listed(&of_form("bernoulli(nothing_of_the_kind(1))"), "the functions are");
    let question =
        "program One { variables { X : bool; } decomposition { P(X) } forms { P(X) = bernoulli(0.5); }
                    question q { nothing_of_the_kind P(X) } }";
    let questions = listed(question, "neither a statistic (");
    assert!(forms.len() > 30 && functions.len() > 20 && questions.len() > 9);
    vec![
        ("keyword", keywords.collect()),
        ("form", forms),
        ("function", functions),
        ("question", questions),
        ("domain", ["bool", "real", "bins", "circle"].map(str::to_owned).to_vec()),
        ("parameter", ["probability", "real", "size", "integer"].map(str::to_owned).to_vec()),
        ("operator", ["and", "or", "not"].map(str::to_owned).to_vec()),
        ("time", ["filter", "predict", "smooth", "sequence"].map(str::to_owned).to_vec()),
    ]
}

#[test]
fn every_word_has_an_entry_and_every_entry_is_a_word() {
    let of_language = entries().into_iter().filter(|entry| entry.kind != "options");
    let names: BTreeSet<&str> = of_language.flat_map(|entry| entry.names.clone()).collect();
    let words = words();
    let missing: Vec<String> = (words.iter())
        .flat_map(|(kind, words)| words.iter().map(move |word| format!("{kind} {word}")))
        .filter(|word| !names.contains(word.split_once(' ').unwrap().1))
        .collect();
    assert!(missing.is_empty(), "without an entry: {missing:?}");
    let known: BTreeSet<&str> =
        words.iter().flat_map(|(_, words)| words.iter().map(String::as_str)).collect();
    let unknown: Vec<_> =
        names.iter().filter(|name| !known.contains(*name) && !WITHOUT_WORD.contains(name)).collect();
    assert!(unknown.is_empty(), "not in the language: {unknown:?}");
}

#[test]
fn entries_of_laws_state_as_many_parameters_as_the_laws_have() {
    for law in Law::ALL {
        let entry = entry(law.name(), "forms");
        let calls = entry.summary().split('`').skip(1).step_by(2);
        let counts: Vec<usize> =
            calls.filter_map(|call| Some(call.split_once('(')?.1.split(',').count())).collect();
        assert!(counts.contains(&law.parameters().len()), "{}: {}", law.name(), entry.summary());
        for row in ["**Domain**", "**Parameters**", "**Equation**"] {
            assert!(entry.text.contains(row), "{} has no {row}", law.name());
        }
    }
}

fn entry(name: &str, kind: &str) -> Entry {
    let found = entries().into_iter().find(|entry| entry.kind == kind && entry.names.contains(&name));
    found.unwrap_or_else(|| panic!("no {kind} {name}"))
}

/// The programs of an entry, each with the lines after it.
fn examples(entry: &Entry) -> Vec<(String, Vec<String>)> {
    let parts = entry.text.split("```bp\n").skip(1);
    parts
        .map(|part| {
            let (program, after) = part.split_once("```").expect("the end of a program");
            (program.to_owned(), after.lines().map(str::to_owned).collect())
        })
        .collect()
}

#[test]
fn every_entry_has_an_example_that_compiles_prints_back_and_is_planned() {
    for entry in entries() {
        let name = entry.names.join(", ");
        let examples = examples(&entry);
        assert!(
            !examples.is_empty() || ["functions", "options"].contains(&entry.kind),
            "{name} has no example"
        );
        for (text, _) in examples {
            let source = Source::new(name.clone(), text);
            let model = compile(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
            let printed = Source::new("printed", parse(&source).unwrap().to_string());
            assert_eq!(compile(&printed).unwrap(), model, "{name}");
            for question in model.questions.values() {
                plan(&model, question, Options::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
            }
        }
    }
}

/// `NUMBER` or `NUMBER: how`, at the start of a text.
fn number(text: &str) -> f64 {
    let end = text.find([':', ',', ' ']).unwrap_or(text.len());
    let text = text[..end].trim_end_matches('.');
    text.parse().unwrap_or_else(|_| panic!("{text} is not a number"))
}

#[track_caller]
fn near(found: f64, stated: f64, place: &str) {
    // Stated with six digits.
    assert!((found - stated).abs() <= 6e-6 * stated.abs().max(1e-3), "{place}: {found}, stated {stated}");
}

#[test]
fn examples_have_the_answers_that_are_stated() {
    let (mut answered, mut over_time) = (0, 0);
    for entry in entries() {
        for (text, after) in examples(&entry) {
            for line in after {
                let place = format!("{}: {line}", entry.names.join(", "));
                if let Some((question, stated)) =
                    line.strip_prefix('`').and_then(|rest| rest.split_once("` is ")).filter(|(_, stated)| {
                        stated.starts_with(|first: char| first.is_ascii_digit() || first == '-')
                    })
                {
                    let program = Program::parse(&text).unwrap();
                    let answer = program.ask(question).unwrap_or_else(|error| panic!("{place}: {error}"));
                    let found = answer.number().or_else(|_| answer.mean());
                    near(found.unwrap_or_else(|error| panic!("{place}: {error}")), number(stated), &place);
                    answered += 1;
                }
                // Over `Wet = true, true`, the last `Rain = true` has 0.8.
                if let Some(rest) = line.strip_prefix("Over `")
                    && let Some((seen, rest)) = rest.split_once("`, the last `")
                {
                    let (variable, values) = seen.split_once(" = ").unwrap();
                    let (_, stated) = rest.split_once("` has ").unwrap();
                    let instants: Vec<Evidence> = values
                        .split(", ")
                        .map(|value| Evidence::new().with(variable, value == "true"))
                        .collect();
                    let program = Program::parse(&text).unwrap();
                    let name = program.questions()[0].to_owned();
                    let answer = program.question(&name).unwrap().over(&instants).unwrap();
                    // `filter` and `predict` answer the last instant alone.
                    let last = answer.at(answer.instants().max(1)).unwrap_or(answer);
                    near(last.p(true).unwrap(), number(stated), &place);
                    over_time += 1;
                }
            }
        }
    }
    assert!(answered >= 65 && over_time >= 4, "{answered} {over_time}");
}

#[test]
fn answers_that_are_not_one_number() {
    let program = |name: &str, kind: &str| Program::parse(&examples(&entry(name, kind))[0].0).unwrap();
    assert_eq!(program("argmax", "questions").ask("best").unwrap().mode().unwrap()["Rain"], false);
    near(program("quantile", "questions").ask("P(Face)").unwrap().quantile(0.3).unwrap(), 2.0, "quantile");
    let [low, high] = program("interval", "questions").ask("P(X)").unwrap().interval(0.9).unwrap();
    near(low, 170.0 - 16.4485, "interval");
    near(high, 170.0 + 16.4485, "interval");
    let turned = program("rotate", "functions").ask("P(T[1])").unwrap().mean().unwrap();
    // By draws: the standard error of 10 000 of them is 0.001.
    assert!((turned - 1.0).abs() < 0.01, "{turned}");
    let means = program("ordered", "forms").ask("P(Mu[0])").unwrap().mean().unwrap();
    assert!((means - 0.5).abs() < 0.03, "{means}");
    let ballots = program("multinomial", "forms");
    let red = ballots.question("red").unwrap().given("votes", vec![2.0, 1.0]).unwrap().ask().unwrap();
    near(red.p("Red").unwrap(), 0.6, "multinomial");
    let weather = program("sequence", "questions");
    let seen = [evidence! { Wet: true }, evidence! { Wet: false }];
    let path = weather.question("path").unwrap().over(&seen).unwrap();
    let values: Vec<bool> = (1..=2).map(|t| path.at(t).unwrap().mode().unwrap()["Rain"] == true).collect();
    assert_eq!(values, [true, false]);
}

#[test]
fn every_entry_is_printed_and_fits_a_terminal() {
    let mut names: Vec<&str> = entries().iter().flat_map(|entry| entry.names.clone()).collect();
    names.extend(["domains", "forms", "functions", "questions", "words", "options"]);
    let wide: Vec<String> = (names.iter())
        .flat_map(|name| {
            bp(&["reference", name]).lines().map(|line| format!("{name}: {line}")).collect::<Vec<_>>()
        })
        .filter(|line| line.split_once(": ").unwrap().1.chars().count() > 80)
        .collect();
    assert!(wide.is_empty(), "wider than 80 columns:\n{}", wide.join("\n"));
}

#[test]
fn functions_have_the_values_that_are_stated() {
    let mut count = 0;
    for entry in entries().into_iter().filter(|entry| entry.kind == "functions") {
        for line in entry.text.lines() {
            let Some((call, stated)) = line.strip_prefix('`').and_then(|rest| rest.split_once("` = ")) else {
                continue;
            };
            let text = format!(
                "program F {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = normal({call}, 1); }} }}"
            );
            let answer = Program::parse(&text).unwrap().ask("P(X)").unwrap();
            let found = answer.mean().unwrap();
            match answer.estimate() {
                // A vector is not folded: its length is estimated by draws, with a standard error of 0.01.
                Some(_) => assert!((found - number(stated)).abs() < 0.05, "{line}: {found}"),
                None => near(found, number(stated), line),
            }
            count += 1;
        }
    }
    assert!(count >= 18, "{count}");
}

#[test]
fn every_form_and_every_function_has_a_row_in_the_page_by_example() {
    let page = include_str!("../../../docs/language.md");
    // The cells of all first columns.
    let cells: Vec<&str> =
        page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next()).collect();
    let has_row = |name: &str| {
        let spelled = |cell: &&str| {
            cell.split('`').skip(1).step_by(2).any(|code| {
                code.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['(', ' ']))
            })
        };
        cells.iter().any(spelled)
    };
    let words = words();
    let missing: Vec<&String> = (words.iter().filter(|(kind, _)| ["form", "function"].contains(kind)))
        .flat_map(|(_, words)| words)
        .filter(|name| !has_row(name))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}
