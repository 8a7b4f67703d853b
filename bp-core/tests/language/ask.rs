//! The `bp ask` command in scripts: whole tables, tables of cases, values by name, JSON.
//!
//! In: the built binary, the programs of `tests/programs`, files made here. Out: stdout and stderr. Invariant: expected
//! numbers are computed by hand, and errors name file, row, column and value.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn program(name: &str) -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    path.to_str().unwrap().to_owned()
}

fn bp(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).arg("ask").args(arguments).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!message.contains("panicked"), "{message}");
    output
}

fn well(arguments: &[&str]) -> String {
    let output = bp(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).unwrap()
}

fn ill(arguments: &[&str]) -> String {
    let output = bp(arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    assert!(output.stdout.is_empty(), "half an answer");
    String::from_utf8(output.stderr).unwrap()
}

fn json_of(arguments: &[&str]) -> Value {
    serde_json::from_str(&well(&[arguments, &["--json"]].concat())).unwrap()
}

#[test]
fn the_whole_table_of_the_water_unit_is_one_call() {
    let file = program("examples/water_unit.bp");
    let text = well(&[&file, "output", "--table"]);
    let numbers: Vec<f64> = text.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(numbers.len(), 161_051);
    let row = |i0: usize, i1: usize, s: usize, c: usize| {
        let at = (((i0 * 11 + i1) * 11 + s) * 11 + c) * 11;
        &numbers[at..at + 4]
    };
    let close = |found: &[f64], expected: [f64; 4]| {
        assert!(
            found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12),
            "{found:?}"
        );
    };
    // S = 5 leaves F = 9 or 10 where I0 = 1, and 10 alone where I0 = 0; alpha is 5 or more, the optimum 3, and what
    // would be negative is dropped.
    close(row(1, 0, 5, 10), [2.0 / 7.0, 2.0 / 7.0, 2.0 / 7.0, 1.0 / 7.0]);
    close(row(0, 1, 5, 10), [0.3, 0.3, 0.3, 0.1]);
    let impossible = numbers.chunks(11).filter(|row| row.iter().all(|p| *p == 0.0)).count();
    assert_eq!(impossible, 6655);
}

#[test]
fn a_table_names_its_sides_in_json() {
    let file = program("tests/programs/wet_grass.bp");
    let table = json_of(&[&file, "P(Rain | Wet Sprinkler)", "--table"]);
    let values = json!(["false", "true"]);
    assert_eq!(table["question"], "P(Rain | Wet Sprinkler)");
    assert_eq!(
        table["right"],
        json!([{ "name": "Wet", "values": values }, { "name": "Sprinkler", "values": values }])
    );
    assert_eq!(table["left"], json!([{ "name": "Rain", "values": values }]));
    // Dry grass under a sprinkler is impossible.
    assert_eq!(
        table["table"].as_array().unwrap()[..6],
        json!([1.0, 0.0, 0.0, 0.0, 0.0, 1.0]).as_array().unwrap()[..]
    );
    let soft = json_of(&[&file, "P(Rain | Wet soft [0, 1])", "--table"]);
    assert!((soft["table"][1].as_f64().unwrap() - 10.0 / 31.0).abs() < 1e-12);
    for statistic in ["entropy", "expectation", "argmax"] {
        let question = format!("{statistic} P(Rain)");
        assert!(ill(&[&file, &question, "--table"]).contains("there is no table of it"), "{question}");
    }
}

#[test]
fn each_row_of_a_table_is_a_case() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lawns.csv");
    let data = path.to_str().unwrap();
    let file = program("tests/programs/wet_grass.bp");
    let with = |text: &str, more: &[&'static str]| {
        std::fs::write(&path, text).unwrap();
        [&[file.as_str(), "P(Rain | Wet Sprinkler)", "--data", data], more].concat()
    };
    let run = |text: &str, more: &[&'static str]| json_of(&with(text, more));
    let wrong = |text: &str| ill(&with(text, &[]));
    let answers = run("lawn,Wet,Sprinkler\n1,true,NA\n2,false,\n3,?,true\n4,true,false\n", &[]);
    let rain = |case: usize| answers["cases"][case]["answer"][1]["p"].as_f64().unwrap();
    // P(Rain | Sprinkler) = 0.03 / 0.66; dry grass excludes rain, wet grass without a sprinkler demands it.
    for (case, expected) in [0.3 / 0.93, 0.0, 0.03 / 0.66, 1.0].into_iter().enumerate() {
        assert!((rain(case) - expected).abs() < 1e-12, "case {case}: {}", rain(case));
    }
    assert_eq!(answers["cases"][0]["question"], "P(Rain | Wet = true)");
    assert_eq!(answers["cases"][3]["question"], "P(Rain | Wet = true, Sprinkler = false)");
    let value = wrong("Wet,Sprinkler\ntrue,true\nflase,true\n");
    assert!(
        value.contains("lawns.csv`, row 3, column `Wet`: `flase` is not a value of `Wet`, which is `bool`"),
        "{value}"
    );
    // A row that the program excludes has no answer; the others would have theirs.
    let output = bp(&with("Wet,Sprinkler\nfalse,true\n", &[]));
    let impossible = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        impossible.contains("row 2: the evidence of `P(Rain | Wet = false, Sprinkler = true)`"),
        "{impossible}"
    );
    let column = wrong("Wett,Sprinkler\ntrue,true\n");
    assert!(column.contains("lawns.csv`: there is no column `Wet`; did you mean `Wett`?"), "{column}");
    let set = run("Sprinkler\nfalse\n", &["--set", "Wet=true"]);
    assert_eq!(set["cases"][0]["answer"][1]["p"], 1.0);
    std::fs::remove_file(&path).unwrap();
    assert!(ill(&[&file, "rain", "--data", data]).contains("lawns.csv`: No such file"));
}

#[test]
fn open_variables_are_set_by_their_names() {
    let file = program("tests/programs/wet_grass.bp");
    for question in ["P(Rain | Wet)", "P(Rain | Wet = w)"] {
        let answer = json_of(&[&file, question, "--set", "Wet=true"]);
        assert_eq!(answer["question"], "P(Rain | Wet = true)");
        assert!((answer["answer"][1]["p"].as_f64().unwrap() - 10.0 / 31.0).abs() < 1e-12);
    }
    assert!(ill(&[&file, "P(Rain | Wet)", "--set", "Wet=treu"]).contains("`treu` is not a value of `Wet`"));
}

#[test]
fn every_figure_is_json() {
    let file = program("tests/programs/wet_grass.bp");
    let of = |question: &str| json_of(&[&file, question])["answer"].clone();
    assert_eq!(
        of("draw(2) P(Rain | Wet = false)"),
        json!([
            { "values": { "Rain": "false" }, "draw": 1 }, { "values": { "Rain": "false" }, "draw": 2 }
        ])
    );
    assert_eq!(of("expectation P(Rain)"), json!([{ "values": { "Rain": "" }, "expectation": 0.3 }]));
    assert_eq!(
        of("divergence P(Rain) from P(Rain | Wet = false)"),
        json!([{ "values": {}, "divergence": "infinite", "infinite": true }])
    );
    assert_eq!(of("information P(Rain Wet)").as_array().unwrap().len(), 1);
    assert_eq!(of("best(1) P(Rain | Wet = false)"), json!([{ "values": { "Rain": "false" }, "p": 1.0 }]));
    let seeded = |seed| well(&[&file, "draw(40) P(Rain)", "--seed", seed]);
    assert_eq!(seeded("7"), seeded("7"));
    assert_ne!(seeded("7"), seeded("8"));
}
