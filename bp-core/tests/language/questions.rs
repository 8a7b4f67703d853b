//! Statistics and soft evidence, compared with calculations by hand.
//!
//! In: small programs. Out: their answers. Invariant: no expected value is output of this crate; draws are seeded.

use crate::support::all_close;
use bp_core::compiler::answer::{Answer, Figure, OtherColumns, ask, ask_over_time, compile, read_sequences};
use bp_core::compiler::data::read_table;
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Notation, Options, plan};
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile as read, parse_question};
use std::path::Path;

/// The umbrella of a lecture: P(rain | umbrella) = 0.38 / 0.44.
const UMBRELLA: &str = "program Umbrella {
    variables { Rain, Umbrella : bool; }
    decomposition { P(Rain) P(Umbrella | Rain) }
    forms { P(Rain) = bernoulli(0.4); P(Umbrella | Rain) = bernoulli(if Rain { 0.95 } else { 0.1 }); }
}";

/// B copies A nine times in ten, C always does.
const COPIES: &str = "program Copies {
    variables { A, B, C : bool; }
    decomposition { P(A) P(B | A) P(C | A) }
    forms { P(A) = uniform; P(B | A) = bernoulli(if A { 0.9 } else { 0.1 }); P(C | A) = dirac(A); }
}";

/// P(k) = k² / 91.
const LOADED: &str = "program Loaded {
    variables { Face : 1..=6; High : bool; }
    decomposition { P(Face) P(High | Face) }
    forms { P(Face) = weights(Face * Face); P(High | Face) = dirac(Face > 4); }
}";

fn model(text: &str) -> Model {
    read(&Source::new("test", text)).unwrap_or_else(|wrong| panic!("{wrong}"))
}

fn try_answer(text: &str, question: &str) -> Result<Answer, Error> {
    let model = model(text);
    let question = parse_question(&Source::new("question", question), &model);
    let question = question.unwrap_or_else(|wrong| panic!("{wrong}"));
    Ok(ask(&model, &question, &Inputs::new())?.remove(0))
}

fn answer(text: &str, question: &str) -> Answer {
    try_answer(text, question).unwrap_or_else(|error| panic!("{question}: {error}"))
}

/// The probability of the only row in which a variable has a value.
fn p(answer: &Answer, variable: &str, value: &str) -> f64 {
    let row = answer.answer.iter().find(|row| row.values.iter().any(|(n, v)| n == variable && v == value));
    row.and_then(|row| row.p()).unwrap_or_else(|| panic!("{answer:?}"))
}

/// The one number of each row.
fn numbers(answer: &Answer) -> Vec<f64> {
    let number = |figure| match figure {
        Figure::Probability { p } => p,
        Figure::Entropy { entropy, .. } => entropy,
        Figure::Expectation { expectation, error: None } => expectation,
        Figure::Variance { variance, error: None } => variance,
        Figure::Information { information } => information,
        Figure::Divergence { divergence, .. } => divergence,
        other => panic!("{other:?}"),
    };
    answer.answer.iter().map(|row| number(row.figure)).collect()
}

#[test]
fn soft_evidence_replaces_and_virtual_evidence_multiplies() {
    let jeffrey = answer(UMBRELLA, "P(Rain | Umbrella soft [0.3, 0.7])");
    all_close(&[p(&jeffrey, "Rain", "true")], &[0.7 * 0.38 / 0.44 + 0.3 * 0.02 / 0.56]);
    assert_eq!(jeffrey.ln_evidence, None);
    // 0.4 (0.05 · 0.3 + 0.95 · 0.7) = 0.272 against 0.6 (0.9 · 0.3 + 0.1 · 0.7) = 0.204
    let pearl = answer(UMBRELLA, "P(Rain | Umbrella virtual [0.3, 0.7])");
    all_close(&[p(&pearl, "Rain", "true")], &[4.0 / 7.0]);
    // Soft evidence equal to the prior changes nothing; soft evidence of 0 and 1 is hard evidence.
    all_close(&[p(&answer(UMBRELLA, "P(Rain | Umbrella soft [0.56, 0.44])"), "Rain", "true")], &[0.4]);
    all_close(&[p(&answer(UMBRELLA, "P(Rain | Umbrella soft [0, 1])"), "Rain", "true")], &[0.38 / 0.44]);
    all_close(&numbers(&answer(UMBRELLA, "P(Rain = true | Umbrella soft [0, 1])")), &[0.38 / 0.44]);
    let entropy = |p: f64| -p * p.ln() - (1.0 - p) * (1.0 - p).ln();
    all_close(&numbers(&answer(UMBRELLA, "entropy P(Rain | Umbrella soft [0, 1])")), &[entropy(0.38 / 0.44)]);
}

#[test]
fn soft_evidence_does_not_commute() {
    // After A: 0.18, 0.02, 0.08, 0.72 for (A, B); B is then false with 0.26 and is set to 0.5.
    let last_b = answer(COPIES, "P(C | A soft [0.2, 0.8], B soft [0.5, 0.5])");
    all_close(&[p(&last_b, "C", "false")], &[0.18 * 0.5 / 0.26 + 0.02 * 0.5 / 0.74]);
    let last_a = answer(COPIES, "P(C | B soft [0.5, 0.5], A soft [0.2, 0.8])");
    all_close(&[p(&last_a, "C", "false")], &[0.2]);
}

#[test]
fn soft_evidence_for_impossible_values_is_an_error() {
    let message = try_answer(COPIES, "P(B | A = true, C soft [0.3, 0.7])").unwrap_err().to_string();
    assert!(message.contains("input `C`: soft evidence gives `false` the probability 0.3"), "{message}");
    // In a table such a context is a row of zeros.
    let table = answer(COPIES, "P(B | A, C soft [0, 1])");
    all_close(&numbers(&table), &[0.0, 0.0, 0.1, 0.9]);
    let impossible = try_answer(COPIES, "best(2) P(B | A = true, C = false)").unwrap_err();
    assert!(matches!(impossible, Error::Impossible(_)), "{impossible}");
}

#[test]
fn the_best_come_first_and_nothing_impossible_does() {
    let best = answer(LOADED, "best(3) P(Face)");
    let names: Vec<&str> = best.answer.iter().map(|row| row.values[0].1.as_str()).collect();
    assert_eq!(names, ["6", "5", "4"]);
    all_close(&numbers(&best), &[36.0 / 91.0, 25.0 / 91.0, 16.0 / 91.0]);
    // 36 and 25 of the 61 that are high; each context is normalised by itself.
    all_close(
        &numbers(&answer(LOADED, "best(4) P(Face | High)")),
        &[16.0 / 30.0, 9.0 / 30.0, 4.0 / 30.0, 1.0 / 30.0, 36.0 / 61.0, 25.0 / 61.0],
    );
}

#[test]
fn moments_are_those_of_the_numbers() {
    // Σ k³ = 441, Σ k⁴ = 2275.
    all_close(&numbers(&answer(LOADED, "expectation P(Face)")), &[441.0 / 91.0]);
    all_close(&numbers(&answer(LOADED, "variance P(Face)")), &[25.0 - (441.0_f64 / 91.0).powi(2)]);
    let each = answer(LOADED, "expectation P(Face | High)");
    all_close(&numbers(&each), &[100.0 / 30.0, 341.0 / 61.0]);
    assert_eq!(each.answer[1].values[0], ("High".to_owned(), "true".to_owned()));
    all_close(&numbers(&answer(LOADED, "expectation P(Face High)")), &[441.0 / 91.0, 61.0 / 91.0]);
    // An impossible context has no expectation.
    assert_eq!(answer(COPIES, "expectation P(B | A C)").answer.len(), 2);
    let room = "program Room { variables { T, M : real; } decomposition { P(T) P(M | T) }
        forms { P(T) = normal(20, 3); P(M | T) = normal(T, 4); } }";
    // The precisions add: 1/9 + 1/16 = 25/144.
    all_close(&numbers(&answer(room, "expectation P(T | M = 25)")), &[20.0 + 5.0 * 9.0 / 25.0]);
    all_close(&numbers(&answer(room, "variance P(T | M = 25)")), &[144.0 / 25.0]);
}

#[test]
fn information_is_the_entropy_that_two_share() {
    let information = numbers(&answer(UMBRELLA, "information P(Rain, Umbrella)"))[0];
    let h = |masses: &[f64]| -masses.iter().map(|p| p * p.ln()).sum::<f64>();
    let shared = h(&[0.4, 0.6]) + h(&[0.44, 0.56]) - h(&[0.38, 0.02, 0.06, 0.54]);
    all_close(&[information], &[shared]);
    all_close(&numbers(&answer(COPIES, "information P(A C)")), &[2f64.ln()]);
    // Given A, B and C are independent.
    all_close(&numbers(&answer(COPIES, "information P(B C | A)")), &[0.0, 0.0]);
}

#[test]
fn divergence_is_infinite_where_the_second_excludes() {
    let (p, q) = (0.38 / 0.44, 0.4);
    let expected = p * f64::ln(p / q) + (1.0 - p) * f64::ln((1.0 - p) / (1.0 - q));
    all_close(&numbers(&answer(UMBRELLA, "divergence P(Rain | Umbrella = true) from P(Rain)")), &[expected]);
    all_close(&numbers(&answer(UMBRELLA, "divergence P(Rain) from P(Rain)")), &[0.0]);
    // A row for each value that the first distribution knows; the second has no context.
    let each = answer(UMBRELLA, "divergence P(Rain | Umbrella) from P(Rain)");
    let dry = 0.02 / 0.56;
    let dry = dry * f64::ln(dry / q) + (1.0 - dry) * f64::ln((1.0 - dry) / (1.0 - q));
    all_close(&numbers(&each), &[dry, expected]);
    all_close(&numbers(&answer(COPIES, "divergence P(A | C = true) from P(A)")), &[2f64.ln()]);
    let infinite = answer(COPIES, "divergence P(A) from P(A | C = true)");
    assert_eq!(infinite.answer[0].figure, Figure::Divergence { divergence: f64::INFINITY, infinite: true });
    let soft = answer(UMBRELLA, "divergence P(Rain | Umbrella soft [0, 1]) from P(Rain)");
    all_close(&numbers(&soft), &[expected]);
}

#[test]
fn draws_come_as_often_as_they_are_probable() {
    const COUNT: usize = 20_000;
    let drawn = answer(LOADED, &format!("draw({COUNT}) P(Face)"));
    assert_eq!(drawn.answer.len(), COUNT);
    assert_eq!(drawn.answer[COUNT - 1].figure, Figure::Draw { draw: COUNT });
    for face in 1..=6 {
        let p = f64::from(face * face) / 91.0;
        let found = drawn.answer.iter().filter(|row| row.values[0].1 == face.to_string()).count() as f64;
        let sigma = (COUNT as f64 * p * (1.0 - p)).sqrt();
        assert!((found - COUNT as f64 * p).abs() < 4.0 * sigma, "{face}: {found}");
    }
    // Equal seeds give equal draws, other seeds other draws; impossible values are never drawn.
    assert_eq!(answer(LOADED, "draw(50) P(Face)"), answer(LOADED, "draw(50) P(Face)"));
    let model = model(LOADED);
    let question = parse_question(&Source::new("question", "draw(50) P(Face)"), &model).unwrap();
    let other = Sampling { seed: 2, ..Sampling::default() };
    let other = compile(&model, &question).unwrap().ask_with(&Inputs::new(), other).unwrap();
    assert_ne!(other[0].answer, answer(LOADED, "draw(50) P(Face)").answer);
    let high = answer(LOADED, "draw(200) P(Face | High = true)");
    assert!(high.answer.iter().all(|row| ["5", "6"].contains(&row.values[0].1.as_str())));
    let many = try_answer(LOADED, "draw(100_000_000) P(Face)").unwrap_err();
    assert!(matches!(many, Error::TooLarge { .. }), "{many}");
}

#[test]
fn tables_have_the_left_fastest_and_the_last_on_the_right_next() {
    let text = "program Three { variables { A : 0..=1; B : 0..=2; S : 0..=3; }
        decomposition { P(A) P(B) P(S | A B) }
        forms { P(A) = uniform; P(B) = uniform; P(S | A B) = dirac(A + B); } }";
    let model = model(text);
    let table = |question: &str| {
        let question = parse_question(&Source::new("question", question), &model).unwrap();
        compile(&model, &question).unwrap().tables(&Inputs::new()).unwrap().remove(0)
    };
    let ba = table("P(S | B A)");
    let names = |columns: &[bp_core::compiler::answer::Column]| {
        columns.iter().map(|column| column.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!((names(&ba.right), names(&ba.left)), (vec!["B".into(), "A".into()], vec!["S".into()]));
    let mut expected = Vec::new();
    for b in 0..3 {
        for a in 0..2 {
            expected.extend((0..4).map(|s| f64::from(u8::from(s == a + b))));
        }
    }
    assert_eq!(ba.numbers, expected);
    // Impossible contexts are zeros: S = 3 with A = 0 is impossible.
    let b = table("P(B | A S)");
    assert_eq!(b.numbers[9..12], [0.0, 0.0, 0.0]);
    let joint = table("P(B A)");
    assert_eq!(joint.left[1].values, ["0", "1"]);
    all_close(&joint.numbers, &[1.0 / 6.0; 6]);
}

#[test]
fn a_compiled_question_is_asked_again() {
    let model = model(UMBRELLA);
    let question = parse_question(&Source::new("question", "P(Rain | Umbrella = u)"), &model).unwrap();
    let compiled = compile(&model, &question).unwrap();
    for (umbrella, expected) in [(1.0, 0.38 / 0.44), (0.0, 0.02 / 0.56), (1.0, 0.38 / 0.44)] {
        let answers = compiled.ask(&Inputs::new().number("u", umbrella)).unwrap();
        all_close(&[p(&answers[0], "Rain", "true")], &[expected]);
    }
    assert!(compiled.ask(&Inputs::new()).is_err());
    assert!(compiled.ask(&Inputs::new().number("u", 2.0)).is_err());
}

#[test]
fn a_value_given_later_may_have_the_name_of_its_variable() {
    // `fails` is near `false`, but it is the variable's own name.
    let model = model(
        "program Machine { variables { Old, Fails : bool; } decomposition { P(Old) P(Fails | Old) }
            forms { P(Old) = bernoulli(0.2); P(Fails | Old) = bernoulli(if Old { 0.5 } else { 0.1 }); } }",
    );
    let question = parse_question(&Source::new("question", "P(Old | Fails = fails)"), &model).unwrap();
    let answers = ask(&model, &question, &Inputs::new().number("fails", 1.0)).unwrap();
    all_close(&[p(&answers[0], "Old", "true")], &[0.2 * 0.5 / (0.2 * 0.5 + 0.8 * 0.1)]);
    // Any other name similar to a value is an error.
    assert!(parse_question(&Source::new("question", "P(Old | Fails = flase)"), &model).is_err());
}

#[test]
fn derivations_show_the_statistics() {
    let computed = |question: &str| {
        let model = model(UMBRELLA);
        let question = parse_question(&Source::new("question", question), &model).unwrap();
        let plan = plan(&model, &question, Options::default()).unwrap();
        let latex = plan.computed(&model, Notation::Latex).join("\n");
        assert!(latex.is_ascii(), "{latex}");
        assert!(!plan.computed(&model, Notation::MathMl).is_empty());
        plan.computed(&model, Notation::Unicode).pop().unwrap()
    };
    let soft = computed("P(Rain | Umbrella soft [0.3, 0.7])");
    assert_eq!(soft, "P′(Rain) = Σ_Umbrella q(Umbrella) P(Rain | Umbrella)");
    let divergence = computed("divergence P(Rain | Umbrella = true) from P(Rain)");
    assert_eq!(divergence, "D = Σ_Rain p ln (p / q), p = P(Rain | Umbrella), q = P(Rain)");
    assert_eq!(computed("variance P(Rain)"), "Var = Σ_Rain (Rain − E)² P(Rain)");
    assert_eq!(computed("draw(3) P(Rain)"), "Rain ~ P(Rain), 3 times");
}

#[test]
fn a_value_that_the_question_gives_holds_at_every_instant() {
    let model = model(
        "program Door { variables { Open, Open^-1, Seen : bool; }
         decomposition { P(Open^-1) P(Open | Open^-1) P(Seen | Open) }
         forms { P(Open^-1) = previous(Open) else bernoulli(0.5); P(Open | Open^-1) = dirac(Open^-1);
                 P(Seen | Open) = bernoulli(if Open { 0.75 } else { 0.25 }); } }",
    );
    let asked = |question_text: &str, table: &str| {
        let question = parse_question(&Source::new("question", question_text), &model).unwrap();
        let table = read_table(Path::new("seen.csv"), table.as_bytes())?;
        let others = OtherColumns { ignore: vec!["Day".to_owned()], ..OtherColumns::default() };
        let others = if table.column("Day").is_some() { others } else { OtherColumns::default() };
        let rows = read_sequences(&model, &question, &table, &others, &Inputs::new())?.remove(0).1;
        ask_over_time(&model, &question, &rows, &Inputs::new(), Sampling::default())
    };
    // Seen at two instants: 9 to 1.
    let answers = asked("filter P(Open | Seen = true)", "Day\nMonday\nTuesday\n").unwrap();
    all_close(&numbers(&answers[0]), &[0.1, 0.9]);
    let twice = asked("filter P(Open | Seen = true)", "Seen\nfalse\n").unwrap_err().to_string();
    assert!(twice.contains("remove one of the two"), "{twice}");
    let far = asked("predict(1000000000) P(Open | Seen)", "Seen\nfalse\n").unwrap_err();
    assert!(matches!(far, Error::TooLarge { .. }), "{far}");
}
