//! The questions that every program declares, by every strategy, and by the command.
//!
//! In: a program and a question, with values for all that it leaves open. Out: pass or fail. Invariant: exact answers of any two
//! strategies agree within 1e-9, estimates within six of their standard errors and a hundredth; a compiled question answers as
//! the planner does; the command prints the numbers of the library.

use super::{is_near, paths};
use bp_core::compiler::answer::{Answer, Figure, Row};
use bp_core::compiler::model::{Finding, Model};
use bp_core::compiler::plan::{Offer, Options, Strategy, plan};
use bp_core::prelude::*;
use std::collections::HashMap;
use std::process::Command;

/// Draws of estimates.
const DRAWS: usize = 2000;

/// The most products that a strategy may sum to take part, and that the accepted one may sum where draws are compared with it:
/// a large table would have few draws in each row, and take minutes.
const MOST_PRODUCTS: [f64; 2] = [2e5, 1e3];

/// A declared question, ready to be asked.
struct Asked {
    name: String,
    /// The values that it needs.
    given: Vec<(String, Value)>,
    /// Over time: the observations.
    instants: Vec<Evidence>,
    answers: Vec<Answer>,
}

/// A value of a name that a question leaves open, the candidates in order.
fn candidates(model: &Model, name: &str) -> Vec<Value> {
    let of_variable = model.variable(name).and_then(|id| {
        let count = model.variables[id].domain.count()?;
        Some(Value::from(model.value_name(id, 1 % count)))
    });
    let numbers = [1.0, 0.5, 3.0, 0.0];
    let lists = (2..=12).map(|count| Value::from(vec![1.0; count]));
    of_variable.into_iter().chain([Value::from(true)]).chain(numbers.map(Value::from)).chain(lists).collect()
}

/// Four instants with values of all that is observed at each.
fn instants(program: &Program, name: &str) -> Vec<Evidence> {
    let model = program.model();
    let question = model.question(name).expect("it is declared");
    let known = question.asks.iter().flat_map(|ask| &ask.known);
    let observed: Vec<_> = known.filter(|known| matches!(known.evidence, Finding::Each)).collect();
    let value = |id, instant: usize| match model.variables[id].domain.count() {
        Some(count) => Value::from(model.value_name(id, (instant * instant) % count)),
        None => Value::from(0.25 * instant as f64),
    };
    let at = |instant: usize| {
        observed.iter().fold(Evidence::new(), |evidence, known| {
            evidence.with(model.variable_name(known.variable), value(known.variable, instant))
        })
    };
    (0..4).map(at).collect()
}

fn answers(question: &Question, instants: &[Evidence]) -> Result<Vec<Answer>, Error> {
    let found = match instants {
        [] => question.ask_all()?,
        instants => vec![question.over(instants)?],
    };
    Ok(found.iter().map(|posterior| posterior.answer().clone()).collect())
}

/// The question with values.
fn with(program: &Program, name: &str, given: &[(String, Value)]) -> Result<Question, Error> {
    given
        .iter()
        .try_fold(program.question(name)?, |question, (name, value)| question.given(name, value.clone()))
}

/// A declared question with values for what it leaves open, and its answers; the reason why it has none.
fn asked(program: &Program, name: &str) -> Result<Asked, String> {
    let model = program.model();
    let over_time =
        model.question(name).is_some_and(|question| question.asks.iter().any(|ask| ask.when.is_over_time()));
    let instants = if over_time { instants(program, name) } else { Vec::new() };
    let mut given: Vec<(String, Value)> = Vec::new();
    loop {
        let question = with(program, name, &given).map_err(|error| error.to_string())?;
        let error = match answers(&question, &instants) {
            Ok(answers) => return Ok(Asked { name: name.to_owned(), given, instants, answers }),
            Err(error) => error,
        };
        let Error::Input { name: open, message } = &error else { return Err(error.to_string()) };
        let open = open.split('.').next().unwrap_or(open);
        let is_new = message.contains("not given") && given.iter().all(|(known, _)| known != open);
        let fits = |value: &Value| question.given(open, value.clone()).is_ok();
        match candidates(model, open).into_iter().find(fits).filter(|_| is_new) {
            Some(value) => given.push((open.to_owned(), value)),
            None => return Err(error.to_string()),
        }
    }
}

/// Whether a strategy has little work with a declared question, by its own offer; draws, by that of the accepted one.
fn is_small(model: &Model, name: &str, strategy: Strategy) -> bool {
    let question = model.question(name).expect("it is declared");
    let options = Options { all_offers: true, ..Options::default() };
    let Ok(plan) = plan(model, question, options) else { return true };
    let counts = |offer: &&Offer| if strategy.is_exact() { offer.strategy == strategy } else { offer.taken };
    let offers = plan.offers.iter().flatten().filter(counts);
    let products: f64 = offers.filter_map(|offer| offer.products).sum();
    products <= MOST_PRODUCTS[usize::from(!strategy.is_exact())]
}

/// The numbers of a row, each with its standard error; empty where they are not compared: draws, and the mode of a real.
fn numbers(figure: &Figure) -> Vec<(f64, f64)> {
    match figure {
        Figure::Estimated { p, error } => vec![(*p, *error)],
        Figure::Real { mean, deviation, .. } => vec![(mean[0], mean[1]), (deviation[0], deviation[1])],
        Figure::Normal { mean, deviation }
        | Figure::Mixture { mean, deviation, .. }
        | Figure::Law { mean, deviation, .. } => vec![(*mean, 0.0), (*deviation, 0.0)],
        Figure::Entropy { entropy: number, error }
        | Figure::Expectation { expectation: number, error }
        | Figure::Variance { variance: number, error }
        | Figure::Quantile { quantile: number, error, .. } => vec![(*number, error.unwrap_or(0.0))],
        other => other.number().map(|number| (number, 0.0)).into_iter().collect(),
    }
}

/// The difference of an answer from another, if there is one. Rows that an estimate lacks had no draws.
fn difference(found: &Answer, expected: &Answer) -> Option<String> {
    let is_estimate = found.estimate.is_some() || expected.estimate.is_some();
    if !is_estimate && found.answer.len() != expected.answer.len() {
        return Some(format!("{} rows, not {}", found.answer.len(), expected.answer.len()));
    }
    let mut by_values: HashMap<&[(String, String)], &Row> = HashMap::new();
    for row in &found.answer {
        by_values.entry(&row.values).or_insert(row);
    }
    for (at, row) in expected.answer.iter().enumerate() {
        let same = by_values.get(row.values.as_slice()).copied();
        // A sequence and an argmax are several rows or one; of equal ones any may be chosen.
        let Some(other) = same.or_else(|| found.answer.get(at).filter(|_| !is_estimate)) else { continue };
        for ((one, error), (two, other_error)) in numbers(&other.figure).into_iter().zip(numbers(&row.figure))
        {
            let near = match is_estimate {
                true => (one - two).abs() <= 6.0 * (error + other_error) + 0.01 * two.abs().max(1.0),
                false => is_near(one, two, 1e-9),
            };
            if !near {
                return Some(format!("{:?}: {one}, not {two}", row.values));
            }
        }
    }
    let evidence = (found.ln_evidence, expected.ln_evidence);
    match evidence {
        (Some(one), Some(two)) if !is_estimate && !is_near(one, two, 1e-9) => {
            Some(format!("ln P(evidence) is {one}, not {two}"))
        }
        _ => None,
    }
}

#[test]
fn strategies_agree_on_every_declared_question() {
    let (mut compared, mut estimated, mut unanswered) = (0, 0, Vec::new());
    for path in paths() {
        let Ok(program) = Program::open(&path) else { continue };
        let program = program.draws(DRAWS);
        for name in program.questions() {
            let label = format!("{}: {name}", path.display());
            let asked = match asked(&program, name) {
                Ok(asked) => asked,
                Err(reason) => {
                    unanswered.push(format!("{label}: {reason}"));
                    continue;
                }
            };
            for strategy in Strategy::ALL.into_iter().filter(|one| is_small(program.model(), name, *one)) {
                let by = program.clone().by(strategy.name()).unwrap();
                // A strategy that does not answer the question says so when it is compiled.
                let Ok(question) = with(&by, name, &asked.given) else { continue };
                let found = match answers(&question, &asked.instants) {
                    Ok(found) => found,
                    // Few draws may all miss the evidence.
                    Err(Error::Unmet { .. }) if !strategy.is_exact() => continue,
                    Err(Error::Refused { .. } | Error::Unplanned { .. } | Error::TooLarge { .. }) => continue,
                    Err(error) => panic!("{label} by {}: {error}", strategy.name()),
                };
                assert_eq!(found.len(), asked.answers.len(), "{label} by {}", strategy.name());
                for (found, expected) in found.iter().zip(&asked.answers) {
                    assert_eq!(found.strategy, strategy, "{label}");
                    // An extended Kalman filter linearises: the size of its error is not known.
                    if strategy == Strategy::ExtendedKalman || expected.strategy == Strategy::ExtendedKalman {
                        continue;
                    }
                    let reliable = found.estimate.iter().all(|estimate| estimate.warning.is_none());
                    if let Some(why) = difference(found, expected).filter(|_| reliable) {
                        panic!("{label} by {}, {}: {why}", strategy.name(), expected.question);
                    }
                    compared += usize::from(strategy != expected.strategy);
                    estimated += usize::from(!strategy.is_exact());
                }
            }
        }
    }
    println!("{compared} comparisons, {estimated} of estimates; not answered:\n{}", unanswered.join("\n"));
    assert!(compared >= 40 && estimated >= 20, "{compared}, {estimated} of estimates");
    // What is not answered reads a grid or another program, is to be learned, or gets its rows from a table.
    assert!(unanswered.len() <= 60, "{unanswered:?}");
}

#[test]
fn the_command_prints_the_numbers_of_the_library() {
    let mut count = 0;
    for path in paths() {
        let Ok(program) = Program::open(&path) else { continue };
        for name in program.questions() {
            let Ok(asked) = asked(&program, name) else { continue };
            if !asked.instants.is_empty() {
                continue;
            }
            let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
            command.arg("ask").arg(&path).arg(&asked.name).arg("--json");
            for (name, value) in &asked.given {
                command.arg("--set").arg(format!("{name}={}", written(value)));
            }
            let output = command.output().unwrap();
            let label = format!("{}: {name}", path.display());
            assert!(output.status.success(), "{label}: {}", String::from_utf8_lossy(&output.stderr));
            let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            // A single answer is an object, several are a list; read back, as the output of the command is.
            let expected = match asked.answers.as_slice() {
                [one] => serde_json::to_string(one).unwrap(),
                all => serde_json::to_string(all).unwrap(),
            };
            let expected: serde_json::Value = serde_json::from_str(&expected).unwrap();
            // A value that is set is a part of the command's question; the rows are the same.
            let rows = |answer: &serde_json::Value| match answer.as_array() {
                Some(all) => all.iter().map(|one| one["answer"].clone()).collect(),
                None => vec![answer["answer"].clone()],
            };
            assert_eq!(rows(&found), rows(&expected), "{label}");
            count += 1;
        }
    }
    assert!(count >= 50, "only {count} questions");
}

/// A value as `--set` reads it.
fn written(value: &Value) -> String {
    match value {
        Value::List(all) => all.iter().map(Value::to_string).collect::<Vec<String>>().join(","),
        value => value.to_string(),
    }
}
