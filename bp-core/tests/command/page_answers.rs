//! The answers of pages: node reads the rows and ln P(evidence) that `bp ask` prints.
//!
//! In: the programs of `examples/`, and one with families. Out: pass or fail. Invariant: at the first values of the controls and
//! at others the numbers agree within 1e-12. Without node the test says that it was skipped.

use crate::javascript::{is_near, number, web};
use crate::node;
use bp_core::compiler::answer::{Observed, Row, ask_over_time, compile_sized, link};
use bp_core::compiler::interactive::{Control, Kind, Moving, given, interactive, opened};
use bp_core::compiler::plan::Options;
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// A question as a page asks it: how it is read, the values of its controls, and the rows and ln P(evidence) of `ask`.
struct Reading {
    moving: Value,
    values: BTreeMap<String, f64>,
    instants: Vec<BTreeMap<String, f64>>,
    rows: Vec<Vec<Value>>,
    ln_evidence: Vec<Option<f64>>,
}

/// The readings of a program's questions, at the first values of their controls and at others; and the code.
fn readings(path: &Path) -> (String, Vec<Reading>) {
    let source = Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap());
    let mut model = link(&compile(&source).unwrap()).unwrap().into_owned();
    let questions: Vec<_> = model.questions.values().cloned().collect();
    let questions: Vec<_> = questions.iter().map(|question| model.pose(question)).collect();
    let made = interactive(&model, &questions);
    let mut found = Vec::new();
    for (moving, question) in
        made.questions.iter().zip(&questions).filter(|(moving, _)| moving.refused.is_none())
    {
        let (open, _) = opened(&model, question);
        for round in 0..2 {
            let value = |control: &Control| match &control.kind {
                Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } if round > 0 => {
                    let at = numbers.iter().position(|number| *number == control.value).unwrap();
                    numbers[(at + 1) % numbers.len()]
                }
                Kind::Number { low, high, whole: false, .. } if round > 0 => low + 0.3 * (high - low),
                _ => control.value,
            };
            let values: BTreeMap<String, f64> =
                moving.controls.iter().map(|control| (control.name.clone(), value(control))).collect();
            let question = given(&model, &open, |name| values.get(name).copied()).unwrap();
            let settings = Settings::new(&model);
            let mut lists: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
            let mut inputs = settings.inputs();
            for control in &moving.controls {
                match &control.element {
                    Some(element) => lists.entry(&element.of).or_default().push(values[&control.name]),
                    None if control.is_parameter => {
                        inputs = inputs.number(&control.name, values[&control.name])
                    }
                    None => {}
                }
            }
            let inputs = lists.iter().fold(inputs, |inputs, (name, list)| inputs.array(name, list));
            // Different observations at each instant; in the second round the third instant has none.
            let columns = |at: usize| {
                let columns = moving.instants.iter().flat_map(|instants| &instants.columns);
                columns.filter_map(move |column| match &column.kind {
                    _ if round == 1 && at == 2 => None,
                    Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } => {
                        Some((column.name.clone(), numbers[(round + at) % numbers.len()]))
                    }
                    Kind::Number { .. } => Some((column.name.clone(), column.value)),
                })
            };
            let count = moving.instants.as_ref().map_or(0, |instants| instants.count);
            let instants: Vec<BTreeMap<String, f64>> = (0..count).map(|at| columns(at).collect()).collect();
            let answers = match moving.instants {
                None => {
                    compile_sized(&model, &question, Options::default()).and_then(|asked| asked.ask(&inputs))
                }
                Some(_) => {
                    let observed: Vec<Observed> =
                        instants.iter().map(|instant| instant.clone().into_iter().collect()).collect();
                    ask_over_time(&model, &question, &observed, &inputs, Sampling::default())
                }
            };
            // Evidence may be impossible at the other values.
            let Ok(answers) = answers else {
                assert!(round > 0, "{}: {}", path.display(), moving.text);
                continue;
            };
            let row = |row: &Row| json!({ "values": row.values, "figure": row.figure });
            let rows = answers.iter().map(|answer| answer.answer.iter().map(row).collect()).collect();
            let ln_evidence = answers.iter().map(|answer| answer.ln_evidence).collect();
            let moving = serde_json::to_value(moving).unwrap();
            found.push(Reading { moving, values, instants, rows, ln_evidence });
        }
    }
    (made.code.module(), found)
}

/// Reads rows as a page does.
const READER: &str = r#"
Promise.all([module(text), module(`${answer}; export { resultsOf, rows, lnEvidence };`)]).then(([functions, answer]) => {
    const { resultsOf, rows, lnEvidence } = answer;
    const found = cases.map(({ moving, values, instants }) => {
        const results = resultsOf(moving, functions, values, instants);
        return moving.asks.map((ask) => ({ rows: rows(ask, results), ln: lnEvidence(ask, results) }));
    });
    console.log(JSON.stringify(found));
});
"#;

/// The first place where two values differ by more than 1e-12.
fn difference(found: &Value, expected: &Value) -> Option<String> {
    match (found, expected) {
        (Value::Number(_), Value::Number(_)) if is_near(number(found), number(expected)) => None,
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            one.iter().zip(other).find_map(|(one, other)| difference(one, other))
        }
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => {
            one.iter().find_map(|(key, one)| difference(one, &other[key]))
        }
        _ if found == expected => None,
        _ => Some(format!("{found}, not {expected}")),
    }
}

/// Families that are known: of truth values, under a name, and of bins.
const FAMILY: &str = "program Family {
    parameters { hit : probability = 0.9; N : size = 4; }
    variables { S : 0..=2; W[1..=3] : bool; L[0..=N] : bins(0, 10, 5); }
    decomposition { P(S) prod(i) { P(W[i] | S) } prod(i) { P(L[i] | S) } }
    forms {
        P(S) = categorical(0.2, 0.3, 0.5);
        P(W[i] | S) = bernoulli(if S == 1 { hit } else { 0.1 * i });
        P(L[i] | S) = normal(3 * S, 2 + i);
    }
    question each { P(S | W) }
    question named { P(S | W = w, L) }
    question two { divergence P(S | W) from P(S | L) }
}";

#[test]
fn families_have_a_control_for_each_element() {
    let mut model = compile(&Source::new("family.bp", FAMILY)).unwrap();
    let questions: Vec<_> = model.questions.values().cloned().collect();
    let questions: Vec<_> = questions.iter().map(|question| model.pose(question)).collect();
    let made = interactive(&model, &questions);
    let names = |place: usize| -> Vec<String> {
        let question: &Moving = &made.questions[place];
        assert_eq!(question.refused, None);
        question.controls.iter().map(|control| format!("{} {}", control.name, control.label)).collect()
    };
    assert_eq!(names(0), ["W[1] W[1]", "W[2] W[2]", "W[3] W[3]", "hit hit"]);
    let lengths = ["L[0] L[0]", "L[1] L[1]", "L[2] L[2]", "L[3] L[3]", "L[4] L[4]"];
    assert_eq!(names(1)[..3], ["w[1] W[1]", "w[2] W[2]", "w[3] W[3]"]);
    assert_eq!(names(1)[3..8], lengths);
    assert_eq!(names(2)[3..8], lengths);
}

#[test]
fn pages_show_the_rows_of_ask() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let folders = [examples.join("course"), examples];
    let mut paths: Vec<_> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).unwrap())
        .map(|it| it.unwrap().path())
        .collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bp"));
    let family = tempfile::tempdir().unwrap();
    paths.push(family.path().join("family.bp"));
    std::fs::write(&paths[paths.len() - 1], FAMILY).unwrap();
    paths.sort();
    let answer = web("functions.js") + &web("answer.js");
    let (mut count, mut evidence, mut over_time) = (0, 0, 0);
    for path in paths {
        let (text, readings) = readings(&path);
        let cases: Vec<Value> = (readings.iter())
            .map(|reading| json!({ "moving": reading.moving, "values": reading.values, "instants": reading.instants }))
            .collect();
        let found = node::run(READER, &json!({ "text": text, "answer": answer, "cases": cases }));
        for (reading, found) in readings.iter().zip(&found) {
            let place = format!("{}: {} {:?}", path.display(), reading.moving["text"], reading.values);
            let found = found.as_array().unwrap();
            let rows: Value = found.iter().map(|one| one["rows"].clone()).collect();
            if let Some(difference) = difference(&rows, &json!(reading.rows)) {
                panic!("{place}: {difference}");
            }
            for (found, expected) in found.iter().zip(&reading.ln_evidence) {
                if let (Some(ln), Some(expected)) = (found["ln"].as_f64(), expected) {
                    assert!((ln - expected).abs() <= 1e-9, "{place}: ln P(evidence) is {ln}, not {expected}");
                    evidence += 1;
                }
            }
            count += 1;
            over_time += usize::from(!reading.instants.is_empty());
        }
    }
    println!("{count} readings");
    assert!(over_time >= 4, "only {over_time} questions over time");
    assert!(count >= 80, "only {count} readings");
    assert!(evidence >= 40, "only {evidence} probabilities of evidence");
}
