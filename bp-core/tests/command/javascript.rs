//! Pages that compute their answers: node shows the rows of `bp ask`.
//!
//! In: the programs of `examples/`, with values of their controls. Out: pass or fail. Invariant: the numbers of a page are those of
//! the library within 1e-12. Without node the tests say that they were skipped.

use crate::node;
use bp_core::compiler::answer::{Row, compile_sized, link};
use bp_core::compiler::interactive::{Control, Kind, given, interactive, opened};
use bp_core::compiler::plan::Options;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

fn number(value: &Value) -> f64 {
    match value {
        Value::String(word) => word.replace("Infinity", "inf").parse().unwrap(),
        value => value.as_f64().unwrap_or(f64::NEG_INFINITY),
    }
}

fn is_near(found: f64, expected: f64) -> bool {
    found == expected
        || found.is_nan() && expected.is_nan()
        || (found - expected).abs() <= 1e-12 * expected.abs().max(1e-3)
}

/// A question as a page asks it: how it is read, the values of its controls, and the rows and ln P(evidence) of `ask`.
struct Reading {
    moving: Value,
    values: BTreeMap<String, f64>,
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
                _ => control.value,
            };
            let values: BTreeMap<String, f64> =
                moving.controls.iter().map(|control| (control.name.clone(), value(control))).collect();
            let question = given(&model, &open, |name| values.get(name).copied()).unwrap();
            // Evidence may be impossible at the other values.
            let Ok(answers) = compile_sized(&model, &question, Options::default())
                .and_then(|asked| asked.ask(&Settings::new(&model).inputs()))
            else {
                assert!(round > 0, "{}: {}", path.display(), moving.text);
                continue;
            };
            let row = |row: &Row| json!({ "values": row.values, "figure": row.figure });
            let rows = answers.iter().map(|answer| answer.answer.iter().map(row).collect()).collect();
            let ln_evidence = answers.iter().map(|answer| answer.ln_evidence).collect();
            found.push(Reading { moving: serde_json::to_value(moving).unwrap(), values, rows, ln_evidence });
        }
    }
    (made.code.module(), found)
}

/// Reads rows as a page does.
const READER: &str = r#"
Promise.all([module(text), module(`${answer}; export { rows, lnEvidence };`)]).then(([functions, { rows, lnEvidence }]) => {
    const found = cases.map(({ moving, values }) => {
        const results = moving.functions.map((name) => functions[name](values));
        return moving.asks.map((ask) => ({ rows: rows(ask, results), ln: lnEvidence(ask, results) }));
    });
    console.log(JSON.stringify(found));
});
"#;

/// The text of a file of the page.
pub(crate) fn web(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("web").join(name)).unwrap()
}

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

#[test]
fn pages_show_the_rows_of_ask() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bp"));
    paths.sort();
    let answer = web("functions.js") + &web("answer.js");
    let (mut count, mut evidence) = (0, 0);
    for path in paths {
        let (text, readings) = readings(&path);
        let cases: Vec<Value> = (readings.iter())
            .map(|reading| json!({ "moving": reading.moving, "values": reading.values }))
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
        }
    }
    println!("{count} readings");
    assert!(count >= 80, "only {count} readings");
    assert!(evidence >= 40, "only {evidence} probabilities of evidence");
}

#[test]
fn special_functions_have_the_stated_accuracy() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    // Of mpmath 1.3, with 50 digits at the f64 given here; more of them are in `tests/laws/special_functions`.
    let cases: [(&str, f64, f64, f64); 18] = [
        ("normalCumulative", -38.0, 2.885_428_35e-316, 2e-8),
        ("normalCumulative", -20.0, 2.753_624_118_606_233_7e-89, 2e-15),
        ("normalCumulative", -5.0, 2.866_515_718_791_939e-7, 2e-15),
        ("normalCumulative", -1.401_398_031_134_661_4, 0.080_547_540_358_298_7, 2e-15),
        ("normalCumulative", -0.5, 0.308_537_538_725_986_9, 2e-15),
        ("normalCumulative", 1.5, 0.933_192_798_731_141_9, 2e-15),
        ("normalCumulative", 8.0, 0.999_999_999_999_999_4, 2e-15),
        ("lnGamma", 1e-8, 18.420_680_738_180_21, 5e-16),
        ("lnGamma", 0.5, 0.572_364_942_924_700_1, 5e-16),
        ("lnGamma", 1.000_001, -5.772_148_423_874_147e-7, 5e-16),
        ("lnGamma", 1.461_632_144_968_362_2, -0.121_486_290_535_849_61, 5e-16),
        ("lnGamma", 1.999_999, -4.227_840_125_965_854e-7, 5e-16),
        ("lnGamma", 5.5, 3.957_813_967_618_716_5, 5e-16),
        ("lnGamma", 12_345.6, 103_959.185_066_168_46, 5e-16),
        ("lnBessel", 1e-6, 2.499_999_999_999_843_4e-13, 5e-16),
        ("lnBessel", 3.0, 1.585_307_621_813_421, 5e-16),
        ("lnBessel", 30.0, 27.384_701_433_171_937, 5e-16),
        ("lnBessel", 10_000.0, 9_994.475_903_781_433, 5e-16),
    ];
    let reader = r#"
        const names = "{ normalCumulative, lnGamma, lnBessel }";
        const functions = new Function(`${text}; return ${names};`)();
        console.log(JSON.stringify(cases.map(([name, x]) => functions[name](x))));
    "#;
    let text = web("functions.js");
    let asked: Vec<Value> = cases.iter().map(|(name, x, ..)| json!([name, x])).collect();
    let found = node::run(reader, &json!({ "text": text, "cases": asked }));
    for ((name, x, exact, bound), found) in cases.iter().zip(&found) {
        let error = ((number(found) - exact) / exact).abs();
        assert!(error <= *bound, "{name}({x}) is {found}, not {exact}: {error:e}");
    }
}
