//! The answers of pages: node reads the rows and ln P(evidence) that `bp ask` prints.
//!
//! In: the programs of `examples/`, `tests/programs` and `bvm/models`, and some of this folder. Out: pass or fail. Invariant: at the
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
use bp_core::compiler::syntax::{compile, parse_question};
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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

/// Different observations at each instant; in the second round the third instant has none, in the third each is missing at some
/// instants.
fn instants_of(instants: &Instants, round: usize) -> Vec<BTreeMap<String, f64>> {
    let column = |column: &Control, place: usize, at: usize| match &column.kind {
        _ if round == 1 && at == 2 || round == 2 && (place + at) % 3 == 1 => None,
        Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } => {
            Some((column.name.clone(), numbers[(round + at) % numbers.len()]))
        }
        Kind::Number { .. } => {
            Some((column.name.clone(), column.value + 0.7 * at as f64 - 0.4 * round as f64))
        }
    };
    let row = |at| {
        let columns = instants.columns.iter().enumerate();
        columns.filter_map(|(place, one)| column(one, place, at)).collect()
    };
    (0..instants.count).map(row).collect()
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

/// The rows of an answer as a page has them: covariances stand in the rows of their reals.
fn rows_of(answer: &Answer) -> Vec<Value> {
    let row = |row: &Row| json!({ "values": row.values, "figure": row.figure });
    let mut rows: Vec<Value> = answer.answer.iter().map(row).collect();
    for of in answer.covariances() {
        for (row, own) in rows[of.first..].iter_mut().zip(of.matrix) {
            row["covariances"] =
                of.names.iter().zip(own).map(|(name, number)| json!([name, number])).collect();
        }
    }
    rows
}

/// The questions of a program, and those that the gallery types.
fn questions_of(model: &Model, path: &Path) -> Vec<Question> {
    let page = std::fs::read_to_string(root().join("docs/gallery.md")).unwrap();
    let name = path.file_name().unwrap().to_string_lossy();
    let own = format!("$ bp ask examples/{name} '");
    let typed = page.lines().filter_map(|line| line.strip_prefix(&own)?.split('\'').next());
    let typed = typed.filter_map(|text| parse_question(&Source::new("question", text), model).ok());
    model.questions.values().cloned().chain(typed).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A program's code, the readings of its questions, at the first values of their controls and at others, and the questions that its
/// page refuses though `bp ask` answers them exactly, each with the reason.
fn readings(path: &Path) -> (String, Vec<Reading>, Vec<String>) {
    let source = Source::new(path.display().to_string(), std::fs::read_to_string(path).unwrap());
    let Ok(model) = compile(&source) else { return Default::default() };
    let model = link(&model).unwrap().into_owned();
    let questions = questions_of(&model, path);
    let made = interactive(&model, &questions);
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for (moving, question) in made.questions.iter().zip(&questions) {
        let (model, question) = model.posed(question);
        let (model, question) = (model.as_ref(), question.as_ref());
        let is_exact = |plan: Plan| plan.routes.iter().all(|route| route.strategy().is_exact());
        if moving.refused.is_some() && !plan(model, question, Options::default()).is_ok_and(is_exact) {
            continue;
        }
        let rounds = if moving.instants.is_some() { 3 } else { 2 };
        for round in 0..rounds {
            let values = values_of(moving, round);
            let instants = moving.instants.as_ref().map_or_else(Vec::new, |all| instants_of(all, round));
            let answers = asked((model, question), moving, &values, &instants);
            if let Some(reason) = &moving.refused {
                let is_draw = |row: &Row| matches!(row.figure, Figure::Draw { .. });
                let is_drawn = |answer: &Answer| answer.answer.iter().any(is_draw);
                // Over a plate whose size the program leaves open, `bp ask` answers for one element.
                let is_open = reason.contains("is given at run time");
                // A page has no mixtures of normal laws.
                let is_open = is_open || reason.contains("by the strategy mixture");
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
            let rows = answers.iter().map(rows_of).collect();
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
    const read = ({ moving, values, instants }) => {
        const results = resultsOf(moving, functions, values, instants);
        return moving.asks.map((ask) => ({ rows: rows(ask, results), ln: lnEvidence(ask, results) }));
    };
    const tried = (one) => {
        try {
            return read(one);
        } catch (error) {
            return error.message;
        }
    };
    console.log(JSON.stringify(cases.map(tried)));
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
const FAMILY: &str = include_str!("programs/family.bp");

#[test]
fn families_have_a_control_for_each_element() {
    let model = compile(&Source::new("family.bp", FAMILY)).unwrap();
    let questions: Vec<_> = model.questions.values().cloned().collect();
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

/// The programs of the gallery that are learned first, or only estimated.
const NOT_EXACT: &[&str] = &[
    "coin_learning",
    "em_behaviour",
    "khepera_avoiding",
    "khepera_following",
    "khepera_pushing",
    "normal_learning",
    "pupils",
];

#[test]
fn pages_show_the_rows_of_ask() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    let folders = [
        "examples/course",
        "examples/course/solutions",
        "examples/door",
        "examples",
        "tests/programs",
        "bvm/models",
        "bp-core/tests/command/programs",
    ];
    let mut paths: Vec<_> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(root().join(folder)).unwrap())
        .map(|it| it.unwrap().path())
        .collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bp"));
    paths.sort();
    let answer = ["functions.js", "answer.js", "laws.js", "series.js"].map(web).concat();
    let (mut count, mut evidence, mut over_time, mut refused) = (0, 0, 0, Vec::new());
    let mut unread: Vec<String> = Vec::new();
    for path in paths {
        let (text, readings, own) = readings(&path);
        refused.extend(own);
        if readings.is_empty() {
            let is_of_gallery = path.parent().is_some_and(|folder| folder.ends_with("examples"));
            unread.extend(
                path.file_stem().filter(|_| is_of_gallery).map(|stem| stem.to_string_lossy().into_owned()),
            );
            continue;
        }
        let cases: Vec<Value> = (readings.iter())
            .map(|reading| json!({ "moving": reading.moving, "values": reading.values, "instants": reading.instants }))
            .collect();
        let found = node::run(READER, &json!({ "text": text, "answer": answer, "cases": cases }));
        for (reading, found) in readings.iter().zip(&found) {
            let place = format!("{}: {} {:?}", path.display(), reading.moving["text"], reading.values);
            let found = found.as_array().unwrap_or_else(|| panic!("{place} {:?}: {found}", reading.instants));
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
    assert_eq!(unread, NOT_EXACT, "programs of the gallery of which no question is computed");
    assert!(refused.is_empty(), "pages refuse what `bp ask` answers exactly:\n{}", refused.join("\n"));
    assert!(over_time >= 20, "only {over_time} questions over time");
    assert!(count >= 200, "only {count} readings");
    assert!(evidence >= 40, "only {evidence} probabilities of evidence");
}
