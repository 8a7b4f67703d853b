//! The answers of pages: node reads the rows and ln P(evidence) that `bp ask` prints.
//!
//! In: the programs of `examples/`, `tests/programs` and `bvm/models`, and some of this page. Out: pass or fail. Invariant: at the
//! first values of the controls and at others the numbers agree within 1e-12; what a page refuses has no exact answer of `bp
//! ask` either. Without node the test says that it was skipped.

use crate::javascript::{is_near, number, web};
use crate::node;
use bp_core::compiler::answer::{Answer, Figure, Observed, Row, ask_over_time, compile_sized, link};
use bp_core::compiler::error::Error;
use bp_core::compiler::interactive::{Control, Instants, Kind, Moving, given, interactive, opened};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Options, Plan, plan};
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

/// The values of the controls of a question: the first ones, or others in a later round.
fn values_of(moving: &Moving, round: usize) -> BTreeMap<String, f64> {
    let value = |control: &Control| match &control.kind {
        Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } if round > 0 => {
            let at = numbers.iter().position(|number| *number == control.value).unwrap();
            numbers[(at + 1) % numbers.len()]
        }
        Kind::Number { low, high, whole: false, .. } if round > 0 => low + 0.3 * (high - low),
        _ => control.value,
    };
    moving.controls.iter().map(|control| (control.name.clone(), value(control))).collect()
}

/// Different observations at each instant; in the second round the third instant has none.
fn instants_of(instants: &Instants, round: usize) -> Vec<BTreeMap<String, f64>> {
    let column = |column: &Control, at: usize| match &column.kind {
        _ if round == 1 && at == 2 => None,
        Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } => {
            Some((column.name.clone(), numbers[(round + at) % numbers.len()]))
        }
        Kind::Number { .. } => {
            Some((column.name.clone(), column.value + 0.7 * at as f64 - 0.4 * round as f64))
        }
    };
    (0..instants.count)
        .map(|at| instants.columns.iter().filter_map(|one| column(one, at)).collect())
        .collect()
}

/// The answers of `bp ask` to a question with these values.
fn asked(
    (model, question): (&Model, &Question),
    moving: &Moving,
    values: &BTreeMap<String, f64>,
    instants: &[BTreeMap<String, f64>],
) -> Result<Vec<Answer>, Error> {
    let (open, _) = opened(model, question);
    let question = given(model, &open, |name| values.get(name).copied())?;
    let settings = Settings::new(model);
    let mut lists: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut inputs = settings.inputs();
    for control in &moving.controls {
        match &control.element {
            Some(element) => lists.entry(&element.of).or_default().push(values[&control.name]),
            None if control.is_parameter => inputs = inputs.number(&control.name, values[&control.name]),
            None => {}
        }
    }
    let inputs = lists.iter().fold(inputs, |inputs, (name, list)| inputs.array(name, list));
    match moving.instants {
        None => compile_sized(model, &question, Options::default())?.ask(&inputs),
        Some(_) => {
            let observed: Vec<Observed> =
                instants.iter().map(|instant| instant.clone().into_iter().collect()).collect();
            ask_over_time(model, &question, &observed, &inputs, Sampling::default())
        }
    }
}

/// A program's code, the readings of its questions, at the first values of their controls and at others, and the questions that its
/// page refuses though `bp ask` answers them exactly, each with the reason.
fn readings(path: &Path) -> (String, Vec<Reading>, Vec<String>) {
    let source = Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap());
    let Ok(model) = compile(&source) else { return Default::default() };
    let mut model = link(&model).unwrap().into_owned();
    let questions: Vec<_> = model.questions.values().cloned().collect();
    let questions: Vec<_> = questions.iter().map(|question| model.pose(question)).collect();
    let made = interactive(&model, &questions);
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for (moving, question) in made.questions.iter().zip(&questions) {
        let is_exact = |plan: Plan| plan.routes.iter().all(|route| route.strategy().is_exact());
        if moving.refused.is_some() && !plan(&model, question, Options::default()).is_ok_and(is_exact) {
            continue;
        }
        for round in 0..2 {
            let values = values_of(moving, round);
            let instants = moving.instants.as_ref().map_or_else(Vec::new, |all| instants_of(all, round));
            let answers = asked((&model, question), moving, &values, &instants);
            if let Some(reason) = &moving.refused {
                let is_draw = |row: &Row| matches!(row.figure, Figure::Draw { .. });
                let is_drawn = |answer: &Answer| answer.answer.iter().any(is_draw);
                // Over a plate whose size the program leaves open, `bp ask` answers for one element.
                let is_open = reason.contains("is given at run time");
                if !is_open && answers.is_ok_and(|answers| !answers.iter().any(is_drawn)) {
                    refused.push(format!("{}: {}: {reason}", path.display(), moving.text));
                }
                continue;
            }
            // Evidence may be impossible at the other values.
            let answers = match answers {
                Ok(answers) => answers,
                Err(error) => {
                    assert!(round > 0, "{}: {}: {error}", path.display(), moving.text);
                    continue;
                }
            };
            let row = |row: &Row| json!({ "values": row.values, "figure": row.figure });
            let rows = answers.iter().map(|answer| answer.answer.iter().map(row).collect()).collect();
            let ln_evidence = answers.iter().map(|answer| answer.ln_evidence).collect();
            let moving = serde_json::to_value(moving).unwrap();
            found.push(Reading { moving, values, instants, rows, ln_evidence });
        }
    }
    (made.code.module(), found, refused)
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
        // The values of reals are words.
        (Value::String(one), Value::String(other))
            if one.parse::<f64>().is_ok_and(|one| other.parse().is_ok_and(|other| is_near(one, other))) =>
        {
            None
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

/// Normal laws: vectors, statistics, determined variables, over time.
const LAWS: &str = "program Laws {
    parameters { spread : real = 2; noise : real = 0.5; }
    variables { X, Y, Z, D, M, M^-1, W, W^-1, O : real; A, B : real[2]; K, K^-1 : bool; L : 0..=2; }
    decomposition {
        P(X) P(Y | X) P(Z | X Y) P(D | X) P(A) P(B | A)
        P(W^-1) P(W | W^-1) P(M^-1) P(M | M^-1 W) P(O | M)
        P(K^-1) P(K | K^-1) P(L | K)
    }
    forms {
        P(X) = normal(1, spread);
        P(Y | X) = normal(X, 1);
        P(Z | X Y) = normal(2 * X - Y, if noise > 1 { noise } else { 1 });
        P(D | X) = dirac(2 * X);
        P(A) = normal([1, -1], [[2, 0.5], [0.5, 1]]);
        P(B | A) = normal(A, noise);
        P(W^-1) = previous(W) else normal(0, 1);
        P(W | W^-1) = normal(0.9 * W^-1, 0.3);
        P(M^-1) = previous(M) else dirac(0);
        P(M | M^-1 W) = normal(M^-1 + W, 0.2);
        P(O | M) = normal(M, noise);
        P(K^-1) = previous(K) else bernoulli(0.4);
        P(K | K^-1) = bernoulli(if K^-1 { 0.8 } else { 0.3 });
        P(L | K) = categorical(if K { 0.1 } else { 0.5 }, 0.3, if K { 0.6 } else { 0.2 });
    }
    question law { P(X Y | Z = 1) }
    question determined { P(D X | Y = 2) }
    question density { P(X = 0.5, Y = 2 | Z = 1) }
    question two { P(X | Z = 1); P(Y | Z = 1); P(X | Y = 3) }
    question best { argmax P(X Y | Z = 1) }
    question largest { max P(X | Z = 1) }
    question bits { entropy P(X Y | Z = 1); entropy P(D X | Z = 1) }
    question shared { information P(X Z | Y = 1); information P(D X) }
    question moments { expectation P(X Y | Z = 1); variance P(X Y | Z = 1) }
    question parts { quantile(0.2) P(X | Z = 1); interval(0.9) P(X Y | Z = 1) }
    question far { divergence P(X Y | Z = 1) from P(X Y) }
    question vector { P(A | B) }
    question seen { P(A | B = [0.5, 2]) }
    question filtered { filter P(M W | O) }
    question spread { entropy filter P(M | O); expectation filter P(M W | O); quantile(0.1) filter P(M | O) }
    question soon { predict(3) P(M W | O) }
    question all { smooth P(M W | O) }
    question path { sequence P(M W | O) }
    question each { variance smooth P(W | O) }
    question states { entropy filter P(K | L); argmax filter P(K | L); expectation predict(2) P(K | L) }
    question history { smooth P(K | L); argmax smooth P(K | L); entropy smooth P(K | L); sequence P(K | L) }
    question seldom { max filter P(K | L); filter P(K = true | L) }
    question before { P(K^-1) }
    question apart { divergence filter P(K | L) from predict(1) P(K | L) }
}";

#[test]
fn pages_show_the_rows_of_ask() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths: Vec<_> = ["examples/course", "examples", "tests/programs", "bvm/models"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|it| it.unwrap().path())
        .collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bp"));
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("family.bp", FAMILY), ("laws.bp", LAWS)] {
        paths.push(folder.path().join(name));
        std::fs::write(&paths[paths.len() - 1], text).unwrap();
    }
    paths.sort();
    let answer = ["functions.js", "answer.js", "laws.js", "series.js"].map(web).concat();
    let (mut count, mut evidence, mut over_time, mut refused) = (0, 0, 0, Vec::new());
    for path in paths {
        let (text, readings, own) = readings(&path);
        refused.extend(own);
        if readings.is_empty() {
            continue;
        }
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
    assert!(refused.is_empty(), "pages refuse what `bp ask` answers exactly:\n{}", refused.join("\n"));
    assert!(over_time >= 20, "only {over_time} questions over time");
    assert!(count >= 200, "only {count} readings");
    assert!(evidence >= 40, "only {evidence} probabilities of evidence");
}
