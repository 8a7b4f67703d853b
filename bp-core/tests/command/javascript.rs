//! Every exact answer as JavaScript: node computes what the interpreter computes.
//!
//! In: the programs of `examples/`, `bvm/models/` and `tests/programs/`, at their default sizes. Out: pass or fail.
//! Invariant: each function of the emitted module gives the numbers of its kernel within 1e-12, at several inputs, also
//! when it is called again after only one of them has changed. Without node the test says that it was skipped.

use bp_core::compiler::answer::{Row, compile_sized, link};
use bp_core::compiler::emit::javascript::emit_javascript;
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret};
use bp_core::compiler::interactive::{Control, Kind, given, interactive, opened};
use bp_core::compiler::kernel::{Kernel, Numbers, OutputKey, Reduce, Role};
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// Reads the texts of modules and cases from stdin; `module` imports a text.
const IMPORTS: &str = r#"
const fs = require("fs");
const { text, answer, cases } = JSON.parse(fs.readFileSync(0, "utf8"));
const module = async (text) => {
    const folder = fs.mkdtempSync(require("path").join(require("os").tmpdir(), "bp-"));
    fs.writeFileSync(`${folder}/module.mjs`, text);
    try {
        return await import(`${folder}/module.mjs`);
    } finally {
        fs.rmSync(folder, { recursive: true });
    }
};
"#;

/// Prints the outputs of each case; numbers that JSON lacks are words.
const RUNNER: &str = r#"
const word = (number) => (Number.isFinite(number) ? number : String(number));
module(text).then((functions) => {
    const found = cases.map(({ name, inputs }) => {
        const { answers, lnEvidence } = functions[name](inputs);
        return { answers: answers.map((array) => Array.from(array, word)), lnEvidence };
    });
    console.log(JSON.stringify(found));
});
"#;

/// Iterations of a kernel above which the lanes stand for the interpreter, which they are tested against elsewhere.
const MANY: usize = 200_000;

/// A case: a kernel, the name of its function, and its inputs.
struct Case<'k> {
    kernel: &'k Kernel,
    name: String,
    inputs: BTreeMap<String, Vec<f64>>,
}

/// Values of the inputs of a kernel, different for each round; those with a default keep it in the first round.
fn inputs(kernel: &Kernel, round: usize) -> BTreeMap<String, Vec<f64>> {
    let mut given = BTreeMap::new();
    for (_, buffer) in kernel.buffers.iter() {
        let Role::Input { default, .. } = &buffer.role else { continue };
        let count = buffer.axes.iter().map(|axis| kernel.axes[*axis].extent.known().unwrap()).product();
        let number = |cell: usize| match (buffer.values.as_ref().map(|values| &values.numbers), default) {
            (Some(Numbers::Whole { first, count }), _) => {
                let count: usize = count.iter().map(|extent| extent.known().unwrap()).product();
                (first + ((7 * round + cell + count / 3) % count) as i64) as f64
            }
            (Some(Numbers::Bins(bins)), _) => bins.centre((7 * round + cell + 1) % bins.count()),
            (Some(Numbers::Real), _) => 0.5 + 0.75 * (round + cell) as f64,
            (None, Some(default)) => default * (1.0 - 0.03 * round as f64),
            (None, None) => 0.2 + 0.01 * ((3 * round + cell) % 7) as f64,
        };
        given.insert(buffer.name.clone(), (0..count).map(number).collect());
    }
    given
}

/// The kernels of the exact answers of a program, with the questions' names.
fn kernels(path: &Path) -> Vec<(String, Kernel)> {
    let source = Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap());
    // Some of the programs are wrong alone: they are parts of tests.
    let Ok(model) = compile(&source) else { return Vec::new() };
    let Ok(model) = link(&model) else { return Vec::new() };
    let mut kernels = Vec::new();
    for question in model.questions.values() {
        let Ok(plan) = plan(&model, question, Options::default()) else { continue };
        for route in &plan.routes {
            // A form that is still to be learned has no kernel.
            if let Route::Exact(exact) = route
                && let Ok(lowered) = lower(&model, exact, &question.name)
            {
                kernels.push((format!("{}: {}", path.display(), question.name), lowered.kernel));
            }
        }
    }
    kernels
}

fn truth(kernel: &Kernel, given: &BTreeMap<String, Vec<f64>>) -> Outputs<f64> {
    let inputs = given.iter().fold(Inputs::new(), |inputs, (name, numbers)| inputs.array(name, numbers));
    let work: usize = (kernel.nests.iter())
        .map(|nest| {
            let folded = match &nest.reduce {
                Reduce::Fold(_, axes) => axes.as_slice(),
                _ => &[],
            };
            let all = kernel.buffers[nest.out].axes.iter().chain(folded);
            all.map(|axis| kernel.axes[*axis].extent.known().unwrap()).product::<usize>()
        })
        .sum();
    let run = if work > MANY { Lanes::new(kernel.clone()).run(&inputs) } else { interpret(kernel, &inputs) };
    run.unwrap_or_else(|error| panic!("{}: {error}", kernel.name))
}

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

#[test]
fn every_exact_kernel_is_computed_by_node() {
    if Command::new("node").arg("--version").output().is_err() {
        return println!("skipped: there is no program `node`");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths: Vec<_> = ["examples", "bvm/models", "tests/programs"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "bp"))
        .collect();
    paths.sort();
    let (mut count, mut refused) = (0, Vec::new());
    for path in paths {
        let (mut sized, mut labels) = (Vec::new(), Vec::new());
        for (label, kernel) in kernels(&path) {
            let kernel = kernel.with_default_sizes().unwrap();
            match emit_javascript(std::slice::from_ref(&kernel)) {
                Ok(_) => {
                    sized.push(kernel);
                    labels.push(label);
                }
                Err(reason) => refused.push(format!("{label}: {reason}")),
            }
        }
        let emitted = emit_javascript(&sized).unwrap();
        let mut cases = Vec::new();
        for (kernel, name) in sized.iter().zip(&emitted.names) {
            let first = inputs(kernel, 0);
            cases.push(Case { kernel, name: name.clone(), inputs: first.clone() });
            // One input after the other changes.
            let mut given = first;
            for (round, (input, numbers)) in inputs(kernel, 1).into_iter().enumerate().take(2) {
                given.insert(input, numbers);
                if round == 0 || kernel.nests.len() < 20 {
                    cases.push(Case { kernel, name: name.clone(), inputs: given.clone() });
                }
            }
        }
        let asked: Vec<Value> =
            cases.iter().map(|case| json!({ "name": case.name, "inputs": case.inputs })).collect();
        let found = run(RUNNER, &json!({ "text": emitted.module(), "cases": asked }));
        for (case, found) in cases.iter().zip(&found) {
            let truth = truth(case.kernel, &case.inputs);
            let mut answers = found["answers"].as_array().unwrap().iter();
            for (key, cells) in &truth.arrays {
                match key {
                    OutputKey::Ask(_) => {
                        let numbers = answers.next().unwrap().as_array().unwrap();
                        assert_eq!(numbers.len(), cells.len(), "{}: {}", path.display(), case.name);
                        for (cell, (found, expected)) in numbers.iter().zip(cells).enumerate() {
                            let found = number(found);
                            let place = format!("{}: {}[{cell}]", path.display(), case.name);
                            assert!(is_near(found, *expected), "{place} is {found}, not {expected}");
                        }
                    }
                    _ => assert!(
                        is_near(number(&found["lnEvidence"]), cells[0]),
                        "{}: {}",
                        path.display(),
                        case.name
                    ),
                }
            }
            count += 1;
        }
    }
    assert!(count >= 60, "only {count} cases");
    // Those that are refused read a grid, a set without a size, or intervals without a function.
    for reason in &refused {
        let known = ["is given at run time", "displacements on a grid", "an interval under"];
        assert!(known.iter().any(|known| reason.contains(known)), "{reason}");
    }
    println!("{count} cases; refused:\n{}", refused.join("\n"));
}

/// What a program of node prints for an input.
pub(crate) fn run(program: &str, given: &Value) -> Vec<Value> {
    let mut node = Command::new("node")
        .args(["-e", &format!("{IMPORTS}{program}")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    node.stdin.take().unwrap().write_all(given.to_string().as_bytes()).unwrap();
    let output = node.wait_with_output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{messages}");
    serde_json::from_slice(&output.stdout).unwrap()
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
    if Command::new("node").arg("--version").output().is_err() {
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
        let found = run(READER, &json!({ "text": text, "answer": answer, "cases": cases }));
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
    if Command::new("node").arg("--version").output().is_err() {
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
    let found = run(reader, &json!({ "text": text, "cases": asked }));
    for ((name, x, exact, bound), found) in cases.iter().zip(&found) {
        let error = ((number(found) - exact) / exact).abs();
        assert!(error <= *bound, "{name}({x}) is {found}, not {exact}: {error:e}");
    }
}
