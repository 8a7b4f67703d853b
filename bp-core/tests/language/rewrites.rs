//! Each rule of the planner, switched on and off; and the rows of answers.
//!
//! In: small programs. Out: answers with all rules and without one. Invariant: expected values are computed by hand, in
//! comments.

use crate::support::{all_close, interpreted, model_of, program, question, without};
use bp_core::compiler::answer::{Answer, Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Rewrites, Route, Strategy, plan};

fn asked(model: &Model, text: &str) -> Result<Vec<Answer>, Error> {
    ask(model, &question(model, text), &Inputs::new())
}

fn probabilities(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

fn one(model: &Model, text: &str) -> Vec<f64> {
    probabilities(&asked(model, text).unwrap_or_else(|error| panic!("{error}"))[0])
}

/// The value of a variable in each row.
fn values(answer: &Answer, variable: &str) -> Vec<String> {
    let of = |row: &bp_core::compiler::answer::Row| {
        row.values.iter().find(|(name, _)| name == variable).map(|(_, value)| value.clone()).unwrap()
    };
    answer.answer.iter().map(of).collect()
}

/// P(Rain) = .3; P(Sprinkler | ¬Rain) = .9: wet unless dry and not sprinkled: P(Wet) = .3 + .7 · .9 = .93.
const RAIN_IF_WET: f64 = 0.3 / 0.93;

#[test]
fn the_sprinkler_by_hand() {
    let model = model_of(&program("wet_grass"));
    all_close(&one(&model, "P(Rain | Wet = true)"), &[1.0 - RAIN_IF_WET, RAIN_IF_WET]);
    // Known without a value: a table, first context first. Rain is impossible where all is dry.
    all_close(&one(&model, "P(Rain | Wet)"), &[1.0, 0.0, 1.0 - RAIN_IF_WET, RAIN_IF_WET]);
    all_close(&one(&model, "P(Rain = true | Wet = true)"), &[RAIN_IF_WET]);
    all_close(&one(&model, "P(Rain = true, Sprinkler | Wet = true)"), &[0.27 / 0.93, 0.03 / 0.93]);
    let answer = &asked(&model, "P(Rain | Wet = true)").unwrap()[0];
    assert!((answer.ln_evidence.unwrap() - 0.93f64.ln()).abs() <= 1e-12);
    // Virtual evidence of 2 : 1 for wet: .07 + 2 · .93 = 1.93.
    all_close(&one(&model, "P(Rain = true | Wet virtual [1, 2])"), &[0.6 / 1.93]);
}

#[test]
fn impossible_contexts_are_zeros_and_impossible_evidence_is_an_error() {
    let model = model_of(
        "program Never { parameters { never : probability = 0; } variables { A, B : bool; C : 1..=2; }
         decomposition { P(A) P(B | A) P(C | A B) }
         forms { P(A) = bernoulli(never); P(B | A) = bernoulli(if A { 0.25 } else { 0.5 });
                 P(C | A B) = table { 0.5, 0.5; 0.2, 0.8; 1, 0; 0, 1; }; } }",
    );
    all_close(&one(&model, "P(B | A)"), &[0.5, 0.5, 0.0, 0.0]);
    all_close(&one(&model, "P(B | A C)"), &[0.5 / 0.7, 0.2 / 0.7, 0.5 / 1.3, 0.8 / 1.3, 0.0, 0.0, 0.0, 0.0]);
    for text in ["P(B | A = true)", "P(B | A virtual [0, 1])", "argmax P(B | A = true)"] {
        let error = asked(&model, text).unwrap_err();
        assert!(matches!(error, Error::Impossible(_)), "{text}: {error}");
    }
}

#[test]
fn a_value_outside_its_domain_has_probability_0_and_the_rest_is_renormalised() {
    // Two dice of which only sums up to 4 are allowed: (1,1) (1,2) (2,1) (1,3) (2,2) (3,1), 6 of 36.
    let model = model_of(
        "program Dice { variables { A, B : 1..=6; S : 2..=4; E : bool; }
         decomposition { P(A) P(B) P(S | A B) P(E | S) }
         forms { P(A) = uniform; P(B) = uniform; P(S | A B) = dirac(A + B); P(E | S) = bernoulli(1 / (5 - S)); } }",
    );
    all_close(&one(&model, "P(A)"), &[3.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0, 0.0, 0.0, 0.0]);
    all_close(&one(&model, "P(S)"), &[1.0 / 6.0, 2.0 / 6.0, 3.0 / 6.0]);
    all_close(&one(&model, "P(A | B = 3)"), &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // Σ over the six pairs of 1 / (5 − S) = 1/3 + 2 · 1/2 + 3 · 1 = 13/3, though S = 5 would divide by 0.
    all_close(&one(&model, "P(E = true)"), &[13.0 / 18.0]);
    for text in ["P(A | B = 6, S)", "P(A | B = 6)"] {
        let Err(Error::Impossible(why)) = asked(&model, text) else { panic!("{text}") };
        assert_eq!(why.reason.unwrap(), "`B = 6` is impossible", "{text}");
    }
}

#[test]
fn answers_come_in_the_order_in_which_they_were_asked() {
    let model = model_of(&program("wet_grass"));
    let text = "question q { P(Rain | Wet = true); P(Wet); entropy P(Sprinkler | Wet = true); P(Wet | Rain = false) }";
    let model_text = program("wet_grass").replace("question rain { P(Rain | Wet) }", text);
    let several = model_of(&model_text);
    let answers = ask(&several, several.question("q").unwrap(), &Inputs::new()).unwrap();
    let asked: Vec<&str> = answers.iter().map(|answer| answer.question.as_str()).collect();
    let expected =
        ["P(Rain | Wet = true)", "P(Wet)", "entropy P(Sprinkler | Wet = true)", "P(Wet | Rain = false)"];
    assert_eq!(asked, expected);
    all_close(&probabilities(&answers[0]), &one(&model, "P(Rain | Wet = true)"));
    all_close(&probabilities(&answers[1]), &[0.07, 0.93]);
    all_close(&probabilities(&answers[3]), &[0.1, 0.9]);
    // P(Sprinkler | Wet) = (.03 + .63) / .93
    let p: f64 = 0.66 / 0.93;
    let Figure::Entropy { entropy, .. } = answers[2].answer[0].figure else { panic!() };
    assert!((entropy + p * p.ln() + (1.0 - p) * (1.0 - p).ln()).abs() <= 1e-12);
}

#[test]
fn reductions_are_of_each_context() {
    let model = model_of(
        "program Weather { variables { Sky : { clear, cloudy, dark }; Rain : bool; }
         decomposition { P(Sky) P(Rain | Sky) }
         forms { P(Sky) = categorical(0.5, 0.3, 0.2); P(Rain | Sky) = table { 0.9, 0.1; 0.5, 0.5; 0.2, 0.8; }; } }",
    );
    let answer = &asked(&model, "argmax P(Rain | Sky)").unwrap()[0];
    // One for the first context, both of the second (a tie), one for the third.
    assert_eq!(values(answer, "Sky"), ["clear", "cloudy", "cloudy", "dark"]);
    assert_eq!(values(answer, "Rain"), ["false", "false", "true", "true"]);
    all_close(&probabilities(answer), &[0.9, 0.5, 0.5, 0.8]);
    all_close(&one(&model, "max P(Rain | Sky)"), &[0.9, 0.5, 0.8]);
    all_close(&one(&model, "max P(Sky)"), &[0.5]);
    // P(Sky, Rain) is largest at clear and dry: .5 · .9.
    let answer = &asked(&model, "argmax P(Sky Rain)").unwrap()[0];
    assert_eq!((values(answer, "Sky"), values(answer, "Rain")), (vec!["clear".into()], vec!["false".into()]));
    all_close(&probabilities(answer), &[0.45]);
    let entropies = asked(&model, "entropy P(Rain | Sky)").unwrap();
    let entropy = |p: f64| -p * p.ln() - (1.0 - p) * (1.0 - p).ln();
    for (row, p) in entropies[0].answer.iter().zip([0.1, 0.5, 0.8]) {
        let Figure::Entropy { entropy: found, .. } = row.figure else { panic!() };
        assert!((found - entropy(p)).abs() <= 1e-12);
    }
}

#[test]
fn two_densities_of_one_real_are_two_answers() {
    let model = model_of(
        "program Reals { variables { S : bool; X, Y : real; } decomposition { P(S) P(X | S) P(Y | S) }
         forms { P(S) = bernoulli(0.25); P(X | S) = if S { uniform(0, 2) } else { uniform(0, 4) };
                 P(Y | S) = if S { uniform(0, 1) } else { uniform(0, 8) }; }
         question q { P(X = 1 | S); P(X = 3 | S); P(Y = 1 | S) } }",
    );
    let answers = ask(&model, model.question("q").unwrap(), &Inputs::new()).unwrap();
    let expected: [[f64; 2]; 3] = [[0.25, 0.5], [0.25, 0.0], [0.125, 1.0]];
    for (answer, expected) in answers.iter().zip(expected) {
        all_close(&probabilities(answer), &expected);
    }
    // .25 · ½ · 1 against .75 · ¼ · ⅛
    all_close(&one(&model, "P(S = true | X = 1, Y = 1)"), &[0.125 / (0.125 + 0.75 / 32.0)]);
}

#[test]
fn families_are_named_element_by_element() {
    let model = model_of(
        "program Row { variables { G[1..=3] : bool; A : bool; } decomposition { P(A) prod(j) { P(G[j] | A) } }
         forms { P(A) = bernoulli(0.5); P(G[j] | A) = bernoulli(if A { 0.5 } else { 0.25 * j }); } }",
    );
    let answer = &asked(&model, "P(G | A = false)").unwrap()[0];
    assert_eq!(answer.answer.len(), 8);
    let row = &answer.answer[0b101];
    let expected = [("G[1]", "true"), ("G[2]", "false"), ("G[3]", "true")];
    assert_eq!(row.values, expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
    // ¼ · (1 − ½) · ¾
    all_close(&[row.p().unwrap()], &[0.25 * 0.5 * 0.75]);
}

#[test]
fn every_rule_is_used_somewhere_and_changes_nothing() {
    let chain = "program Chain { variables { A, B, C, D, E : bool; S : 0..=2; } decomposition { P(A) P(B | A) P(C | B) P(D | C) P(E | D) P(S | A B) }
        forms { P(A) = uniform; P(B | A) = table { 0.9, 0.1; 0.3, 0.7; }; P(C | B) = bernoulli(if B { 0.6 } else { 0.2 });
        P(D | C) = dirac(not C); P(E | D) = bernoulli(if D { 0.9 } else { 0.2 }); P(S | A B) = dirac((if A { 1 } else { 0 }) + (if B { 1 } else { 0 })); } }";
    let model = model_of(chain);
    let rules = |text: &str, rewrites: Rewrites| {
        let plan = plan(&model, &question(&model, text), Options { rewrites, ..Options::default() }).unwrap();
        let Route::Exact(exact) = &plan.routes[0] else { panic!() };
        exact.derivation.iter().map(|step| step.rule).collect::<Vec<_>>()
    };
    let all = Rewrites::default();
    assert!(rules("P(A)", all).contains(&"barren variables"));
    assert!(!rules("P(A)", Rewrites { barren: false, ..all }).contains(&"barren variables"));
    assert!(rules("P(A | E = true)", all).contains(&"Dirac substitution"));
    assert!(rules("P(B | A)", all).contains(&"cancellation"));
    assert!(rules("P(A | D = true)", all).contains(&"order of sums"));
    // P(B) = .4, P(C) = .4 · .6 + .6 · .2 = .36 = P(¬D); P(A B | ¬D): A: .5 · (.7 · .6 + .3 · .2) = .24.
    for (rule, rewrites) in without() {
        let options = Options { rewrites, ln_evidence: true, ..Options::default() };
        let answers = interpreted(&model, &question(&model, "P(A = true | D = false)"), options);
        let (found, ln) = (answers[0].1[0].1, answers[0].2.unwrap());
        assert!(
            (found - 0.24 / 0.36).abs() <= 1e-12 && (ln - 0.36f64.ln()).abs() <= 1e-12,
            "without {rule}: {found}"
        );
    }
}

#[test]
fn a_scan_whose_factor_is_searched_is_made_for_each_of_its_values() {
    let model = model_of(
        "program First { variables { G[1..=3] : bool; T : 0..=6; }
         decomposition { prod(i in 1..=3) { P(G[i]) } P(T | G) }
         forms { P(G[i]) = bernoulli(0.3); P(T | G) = weights(first(G) + T); } }",
    );
    // The first true is 1, 2, 3 with 0.3, 0.21, 0.147, none (4) with 0.343; Σ_t (f + t) = 7 f + 21.
    let first = [(1.0, 0.3), (2.0, 0.21), (3.0, 0.147), (4.0, 0.343)];
    let of = |t: usize| first.iter().map(|(f, p)| p * (f + t as f64) / (7.0 * f + 21.0)).sum::<f64>();
    all_close(&one(&model, "P(T)"), &(0..7).map(of).collect::<Vec<_>>());
}

/// A program of n dice and their sum, and the question.
fn dice(count: usize) -> Model {
    let list = |separator: &str| (1..=count).map(|k| format!("D{k}")).collect::<Vec<_>>().join(separator);
    let each = |text: fn(usize) -> String| (1..=count).map(text).collect::<Vec<_>>().join(" ");
    model_of(&format!(
        "program Dice {{ variables {{ {} : 1..=6; S : {count}..={}; }} decomposition {{ {} P(S | {}) }}
         forms {{ {} P(S | {}) = dirac({}); }} }}",
        list(", "),
        6 * count,
        each(|k| format!("P(D{k})")),
        list(" "),
        each(|k| format!("P(D{k}) = uniform;")),
        list(" "),
        list(" + "),
    ))
}

#[test]
fn a_sum_of_a_hundred_dice_is_a_convolution() {
    let model = dice(100);
    let exact = |text: &str, rewrites: Rewrites| {
        let options = Options { rewrites, by: Some(Strategy::Sums), ..Options::default() };
        let plan = plan(&model, &question(&model, text), options).unwrap();
        let Route::Exact(exact) = &plan.routes[0] else { panic!("{text}: not a route of sums") };
        exact.clone()
    };
    let all = Rewrites::default();
    let (solved, summed) = (exact("P(S)", all), exact("P(S)", Rewrites { solve: false, ..all }));
    assert!(solved.derivation.iter().any(|step| step.rule == "Dirac solved"));
    assert!(solved.cost < 0.02 * summed.cost, "{} of {}", solved.cost, summed.cost);
    // The numbers of ways, as whole numbers: the coefficients of (x + … + x⁶)¹⁰⁰.
    let all = &asked(&model, "P(S)").unwrap()[0];
    let of = |sum: usize| all.answer[sum - 100].p().unwrap();
    assert!((of(350) / 0.023_322_606_015_345_36 - 1.0).abs() < 1e-12);
    assert!((of(600) / 1.530_646_707_486_506_3e-78 - 1.0).abs() < 1e-12);
    let expected = [
        0.161_464_364_055_010_08,
        0.164_266_970_407_705_6,
        0.166_543_888_992_861_3,
        0.168_272_176_557_557_5,
        0.169_434_278_000_428_2,
        0.170_018_321_986_437_3,
    ];
    all_close(&one(&model, "P(D1 | S = 353)"), &expected);
}

#[test]
fn a_solved_sum_keeps_its_domains_signs_and_other_factors() {
    // D is outside its domain for most (A, E); A is also a parent of B, and its own law has a zero.
    let model = model_of(
        "program Signs { variables { A : -1..=2; E : 0..=2; D : -3..=0; B : bool; T : 0..=9; }
         decomposition { P(A) P(E) P(B | A) P(D | A E) P(T | D B) }
         forms { P(A) = categorical(0.4, 0, 0.5, 0.1); P(E) = categorical(0.2, 0.3, 0.5);
                 P(B | A) = bernoulli(0.2 + 0.2 * A * A); P(D | A E) = dirac(1 - A - (E - 1));
                 P(T | D B) = dirac(if B { 1 - D } else { 4 - 2 * D }); } }",
    );
    // By hand, over all (A, E): weights with D = 2 − A − E in −3..=0.
    let mut joint = [[0.0; 4]; 2];
    let mut times = [0.0; 10];
    for (a, p) in [(-1i32, 0.4), (0, 0.0), (1, 0.5), (2, 0.1)] {
        for (e, q) in [(0i32, 0.2), (1, 0.3), (2, 0.5)] {
            let d = 2 - a - e;
            if (-3..=0).contains(&d) {
                let b = 0.2 + 0.2 * f64::from(a * a);
                for (value, r) in [(0, 1.0 - b), (1, b)] {
                    joint[value][(d + 3) as usize] += p * q * r;
                    times[if value == 1 { 1 - d } else { 4 - 2 * d } as usize] += p * q * r;
                }
            }
        }
    }
    let total: f64 = joint.iter().flatten().sum();
    let expected: Vec<f64> = joint.iter().flatten().map(|p| p / total).collect();
    let expected_times: Vec<f64> = times.iter().map(|p| p / total).collect();
    for (rule, rewrites) in without() {
        let options = Options { rewrites, ln_evidence: true, ..Options::default() };
        for (text, expected) in [("P(B D)", &expected), ("P(T)", &expected_times)] {
            let answers = interpreted(&model, &question(&model, text), options);
            for ((_, p), q) in answers[0].1.iter().zip(expected) {
                assert!((p - q).abs() <= 1e-14, "{text} without {rule}: {p}, not {q}");
            }
            assert!((answers[0].2.unwrap() - total.ln()).abs() <= 1e-13, "{text} without {rule}");
        }
    }
}
