//! Questions about predicates, functions, elements and slices.
//!
//! In: programs and questions. Out: probabilities and moments. Invariant: expected values are counted or computed by
//! hand; values of Φ are those of mpmath at 50 digits.

use crate::support::agrees;
use bp_core::Error;
use bp_core::prelude::*;

const DICE: &str = "program Dice { variables { First, Second : 1..=6; } decomposition { P(First) P(Second) }
    forms { P(First) = uniform; P(Second) = uniform; }
    question sevens { P(First + Second = 7) }
    question tens { P(First | First + Second >= 10); expectation P(First * Second) } }";

/// The one number of an answer.
fn number(program: &Program, question: &str) -> f64 {
    let answer = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
    number_of(&answer)
}

fn number_of(answer: &Posterior) -> f64 {
    answer.number().unwrap_or_else(|error| panic!("{answer}: {error}"))
}

/// Counted among 36 outcomes.
#[test]
fn predicates_and_functions_of_dice() {
    for by in [None, Some("sums"), Some("join_tree")] {
        let dice = Program::parse(DICE).unwrap();
        let dice = by.map_or(dice.clone(), |by| dice.by(by).unwrap());
        for (question, expected) in [
            ("P(First + Second > 9)", 6.0 / 36.0),
            ("P(First + Second = 7)", 6.0 / 36.0),
            ("sevens", 6.0 / 36.0),
            ("P(First = 3 or Second > 4)", 16.0 / 36.0),
            ("P((First = 3 or Second > 4) and not (Second = 6))", 10.0 / 36.0),
            ("P(Second > First | First + Second > 9)", 2.0 / 6.0),
            ("P(First = 6 | max(First, Second) = 6)", 6.0 / 11.0),
            ("P(First * 2 = Second)", 3.0 / 36.0),
            // (7/2)², and E[X²]² − E[X]⁴ with E[X²] = 91/6.
            ("expectation P(First * Second)", 12.25),
            ("variance P(First * Second)", (91.0f64 / 6.0).powi(2) - 12.25f64.powi(2)),
            ("expectation P(First > 2)", 4.0 / 6.0),
            ("P(First - Second = -5)", 1.0 / 36.0),
            ("P(abs(First - Second) <= 1)", 16.0 / 36.0),
        ] {
            agrees(number(&dice, question), expected, question);
        }
        let sum = dice.ask("P(First + Second)").unwrap();
        agrees(sum.p(7).unwrap(), 6.0 / 36.0, "sum");
        agrees(sum.p(12).unwrap(), 1.0 / 36.0, "sum");
        let first = dice.ask("P(First | First + Second = 4)").unwrap();
        agrees(first.p(2).unwrap(), 1.0 / 3.0, "first");
        assert_eq!(first.p(4).unwrap(), 0.0);
        let all = dice.ask_all("tens").unwrap();
        agrees(all[0].p(6).unwrap(), 0.5, "tens");
        agrees(number_of(&all[1]), 12.25, "tens");
    }
}

#[test]
fn draws_answer_predicates_too() {
    let dice = Program::parse(DICE).unwrap().by("weighting").unwrap().draws(40_000).seed(7);
    for (question, expected) in [("P(First + Second > 9)", 1.0 / 6.0), ("P(Second > First)", 15.0 / 36.0)] {
        let found = number(&dice, question);
        // Three standard errors.
        assert!((found - expected).abs() < 3.0 * (expected * (1.0 - expected) / 4e4).sqrt(), "{found}");
    }
}

/// The notation of the user is the one that is printed.
#[test]
fn the_words_of_the_user_stay() {
    let dice = Program::parse(DICE).unwrap();
    for question in [
        "P(First = 3 or Second > 4)",
        "P(Second > First | First + Second > 9)",
        "expectation P(First * Second | First > 2)",
        "divergence P(First > 2 | Second = 3) from P(First > 2)",
    ] {
        assert_eq!(dice.ask(question).unwrap().question(), question);
    }
}

const REALS: &str = "program Reals { parameters { limit : real = 21; } variables { T, A, B, C : real; }
    decomposition { P(T) P(A | T) P(B) P(C | B) }
    forms { P(T) = normal(20, 5); P(A | T) = normal(T, 1); P(B) = normal(0, 1); P(C | B) = dirac(2 * B); } }";

/// T given A = 22 has the precision 1/25 + 1 and the mean (20/25 + 22)/1.04. B is standard normal.
#[test]
fn predicates_of_linear_gaussian_programs_are_exact() {
    let program = Program::parse(REALS).unwrap().by("gaussian").unwrap();
    for (question, expected) in [
        ("P(T > 21 | A = 22)", 0.826_739_144_146_946_4),
        ("P(T > limit | A = 22)", 0.826_739_144_146_946_4),
        ("P(21 < T and T < 22 | A = 22)", 0.358_002_682_965_708_84),
        ("P(-T < -21 | A = 22)", 0.826_739_144_146_946_4),
        // T − A given A is T − 22: the same normal law, moved.
        ("P(T - A > -1 | A = 22)", 0.826_739_144_146_946_4),
        ("P(B > 8)", 6.220_960_574_271_784e-16),
        ("P(not (B <= 8))", 6.220_960_574_271_784e-16),
        ("P(B > 1 and B < 2)", 0.135_905_121_983_277_84),
        ("P(B < 1 or B > 2)", 0.864_094_878_016_722_2),
        ("P(C > 2 and C < 4)", 0.135_905_121_983_277_84),
        ("P(C > 1 | B = 1)", 1.0),
        ("P(C > 2 | B = 1)", 0.0),
        ("P(C >= 2 | B = 1)", 1.0),
        // −Φ(1) ln Φ(1) − Φ(−1) ln Φ(−1)
        ("entropy P(B > 1)", 0.437_433_240_927_119_1),
    ] {
        agrees(number(&program, question), expected, question);
    }
    // T − A given nothing has the law of minus the noise of A.
    agrees(number(&program, "expectation P(T - A)") + 1.0, 1.0, "mean");
    agrees(number(&program, "variance P(T - A)"), 1.0, "variance");
}

/// The level is N(0, 1) before the first instant and moves by N(0, 1): a prior of variance 2, K = 2/3, mean 2, variance 2/3.
#[test]
fn predicates_over_time() {
    let program = Program::parse(
        "program Level { variables { L, L^-1, Z : real; } decomposition { P(L^-1) P(L | L^-1) P(Z | L) }
         forms { P(L^-1) = previous(L) else normal(0, 1); P(L | L^-1) = normal(L^-1, 1); P(Z | L) = normal(L, 1); } }",
    )
    .unwrap();
    let asked = program.question("filter P(L > 3 | Z)").unwrap();
    let answer = asked.over(&[evidence! { Z: 3.0 }]).unwrap();
    agrees(number_of(&answer), 0.110_335_680_959_923_4, "filter");
    agrees(answer.p(true).unwrap(), 0.110_335_680_959_923_4, "filter");
    // Three values, each of which stays with probability 0.5 or changes to one of the others with 0.25; observed with 0.8, else 0.1.
    // First instant: X = 2 with 8/10. Second: 0.8 · 0.5 + 0.2 · 0.25 = 0.45 before, 0.36 / (0.36 + 0.055) after seeing 2.
    let steps = Program::parse(
        "program Steps { variables { X, X^-1, Z : 0..=2; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else uniform;
            P(X | X^-1) = table { 0: .5, .25, .25; 1: .25, .5, .25; 2: .25, .25, .5; };
            P(Z | X) = table { 0: .8, .1, .1; 1: .1, .8, .1; 2: .1, .1, .8; }; } }"
            .replace(" .", " 0.")
            .as_str(),
    )
    .unwrap();
    let asked = steps.question("filter P(X > 1 | Z)").unwrap();
    let answer = asked.over(&[evidence! { Z: 2 }, evidence! { Z: 2 }]).unwrap();
    agrees(number_of(&answer), 0.36 / 0.415, "steps");
}

const SENSORS: &str = "program Sensors { variables { S : bool; Y[1..=3] : bool; }
    decomposition { P(S) prod(i) { P(Y[i] | S) } }
    forms { P(S) = bernoulli(0.3); P(Y[i] | S) = bernoulli(if S { 0.9 } else { 0.2 }); } }";

/// By Bayes' rule over the two values of S.
#[test]
fn elements_of_families() {
    for by in [None, Some("sums"), Some("join_tree")] {
        let sensors = Program::parse(SENSORS).unwrap();
        let sensors = by.map_or(sensors.clone(), |by| sensors.by(by).unwrap());
        let two = 0.2243 / 0.271;
        for (question, expected) in [
            ("P(Y[3] = true | Y[1] = true, Y[2] = true)", two),
            ("P(Y[3] | Y[1] and Y[2])", two),
            ("P(S = true | Y[1] = true, Y[2] = true)", 0.243 / 0.271),
            // 0.5 · 0.27/0.41 + 0.5 · 0.03/0.59
            ("P(S = true | Y[1] soft [0.5, 0.5])", 0.354_692_021_496_486_15),
            // 0.3 (0.1 · 0.2 + 0.9 · 0.8) = 0.222 for S, 0.7 (0.8 · 0.2 + 0.2 · 0.8) = 0.224 against.
            ("P(S = true | Y[2] virtual [0.2, 0.8])", 0.222 / 0.446),
            ("P(first(Y) = 2 | S = false)", 0.8 * 0.2),
        ] {
            let answer = sensors.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
            let found = answer.p(true).unwrap_or_else(|_| number_of(&answer));
            agrees(found, expected, question);
        }
        let asked = sensors.question("P(Y[3] | Y[1..=2] = y)").unwrap();
        let answer = asked.given("y", vec![true, true]).unwrap().ask().unwrap();
        agrees(answer.p(true).unwrap(), two, "slice");
    }
}

/// The elements of a set count from 0.
#[test]
fn elements_of_a_set() {
    let program = Program::parse(
        "program Sensors { variables { Hot : bool; Alarm[i in Rooms] : bool; }
         decomposition { P(Hot) prod(i in Rooms) { P(Alarm[i] | Hot) } }
         forms { P(Hot) = bernoulli(0.3); P(Alarm[i] | Hot) = bernoulli(if Hot { 0.9 } else { 0.2 }); } }",
    )
    .unwrap();
    let program = program.with("Rooms", 3).unwrap();
    agrees(program.ask("P(Hot | Alarm[2] = true)").unwrap().p(true).unwrap(), 0.27 / 0.41, "set");
    let Err(error) = program.ask("P(Hot | Alarm[3] = true)") else { panic!("an element that is not there") };
    assert!(error.to_string().contains("`Alarm` has 3 elements, counted from 0"), "{error}");
}

#[test]
fn questions_that_cannot_be_asked() {
    let refused = |program: &str, question: &str| -> String {
        let Err(error) = Program::parse(program).unwrap().ask(question) else { panic!("{question}") };
        match error {
            Error::Program { .. } => error.to_string(),
            other => panic!("{question}: {other}"),
        }
    };
    for (program, question, message) in [
        (SENSORS, "P(Y[4])", "`Y` has the elements 1..=3: there is no `Y[4]`"),
        (SENSORS, "P(S | Y[0..=2] = y)", "`Y` has the elements 1..=3: there is no `Y[0]`"),
        (SENSORS, "P(Y > 2)", "`Y` is a family: one value has to be picked from it"),
        (SENSORS, "P(S[1])", "`S` is one variable, not a family: it takes no index"),
        (SENSORS, "P(S + 1)", "`+` cannot take a truth value and a number"),
        (DICE, "P(2 > 1)", "`2 > 1` contains no variable"),
        (DICE, "P(First > limit)", "unknown name `limit`"),
        (DICE, "P(First > mu[First])", "`mu` is neither a variable nor a parameter of the program"),
        (DICE, "P(First > 2 | First > 2)", "this question asks what it knows: `First > 2` is on both sides"),
    ] {
        let found = refused(program, question);
        assert!(found.contains(message), "{question}: {found}");
    }
}

/// A line through three points: the precision of (A, B) is [[57, 24], [24, 13]], its inverse [[13, −24], [−24, 57]] / 165.
const LINE: &str =
    "program Line { parameters { x[1..=4] : real; } variables { A, B : real; Y[1..=4] : real; }
    decomposition { P(A) P(B) prod(i) { P(Y[i] | A B) } }
    forms { P(A) = normal(0, 1); P(B) = normal(0, 1); P(Y[i] | A B) = normal(A * x[i] + B, 0.5); } }";

#[test]
fn linear_gaussian_families_are_exact_in_part_and_whole() {
    let line =
        Program::parse(LINE).unwrap().with("x", vec![1.0, 2.0, 3.0, 4.0]).unwrap().by("gaussian").unwrap();
    let given = |question: &str, y: &[f64]| {
        let asked = line.question(question).unwrap().given("y", y.to_vec()).unwrap();
        number_of(&asked.ask().unwrap_or_else(|error| panic!("{question}: {error}")))
    };
    let y = [1.0, 2.0, 3.0];
    agrees(given("expectation P(A | Y[1..=3] = y)", &y), 152.0 / 165.0, "slope");
    agrees(given("variance P(A | Y[1..=3] = y)", &y), 13.0 / 165.0, "slope");
    agrees(given("expectation P(Y[4] | Y[1..=3] = y)", &y), 632.0 / 165.0, "next");
    agrees(given("variance P(Y[4] | Y[1..=3] = y)", &y), 0.25 + 73.0 / 165.0, "next");
    // The fourth point adds x xᵀ / 0.25 with x = (4, 1), y = 4: precision [[121, 40], [40, 17]], Xᵀy / 0.25 = (120, 40).
    let whole = given("expectation P(A | Y = y)", &[1.0, 2.0, 3.0, 4.0]);
    agrees(whole, (17.0 * 120.0 - 40.0 * 40.0) / (121.0 * 17.0 - 1600.0), "whole");
    // One element alone: Y[1] = A + B + noise has the variance 2.25, and the covariance 1 with A.
    agrees(number(&line, "expectation P(A | Y[1] = 9)"), 4.0, "alone");
    // Φ((632/165 − 4) / √(1/4 + 73/165)), by mpmath.
    agrees(given("P(Y[4] > 4 | Y[1..=3] = y)", &y), 0.419_202_846_355_952_4, "above");
}

/// The mean of the schools has the precision 1/25 + 1/(4 + 15²) + 1/(4 + 10²) after two of them.
#[test]
fn a_school_is_predicted_from_others() {
    let text = |spread: &str| {
        format!(
            "program Schools {{ parameters {{ sigma[1..=3] : real; }} variables {{ Mu, Tau : real; Theta[1..=3], Y[1..=3] : real; }}
             decomposition {{ P(Mu) P(Tau) prod(j) {{ P(Theta[j] | Mu Tau) P(Y[j] | Theta[j]) }} }}
             forms {{ P(Mu) = normal(0, 5); P(Tau) = uniform(0, 4); P(Theta[j] | Mu Tau) = normal(Mu, {spread});
                P(Y[j] | Theta[j]) = normal(Theta[j], sigma[j]); }} }}"
        )
    };
    let program =
        |spread: &str| Program::parse(&text(spread)).unwrap().with("sigma", vec![15.0, 10.0, 16.0]).unwrap();
    let precision = 1.0 / 25.0 + 1.0 / 229.0 + 1.0 / 104.0;
    let mean = (28.0 / 229.0 + 8.0 / 104.0) / precision;
    let question = "expectation P(Y[3] | Y[1] = 28, Y[2] = 8)";
    let found = program("2").by("weighting").unwrap().seed(3).draws(200_000).ask(question).unwrap();
    // Y[3] given the others has the variance 1/precision + 4 + 16²; of 200 000 draws most count.
    let error = ((1.0 / precision + 260.0) / 1e5f64).sqrt();
    assert!((found.number().unwrap() - mean).abs() < 3.0 * error, "{found} ≠ {mean}");
    // Where the spread is drawn, too: an answer, and no refusal.
    let drawn = program("Tau + 0.1").seed(3).ask("P(Theta[1] > Theta[2] | Y[1] = 28, Y[2] = 8)").unwrap();
    assert!((0.5..1.0).contains(&drawn.p(true).unwrap()), "{drawn}");
}

/// An index that is a variable: 1/3 (0.2 · 0.4 + 0.4 + 0.6 · 0.4) of 1/3 (0.2 + 0.4 + 0.6).
#[test]
fn an_index_may_be_a_variable() {
    let program = Program::parse(
        "program Pick { variables { K : 1..=3; Y[1..=3], X : bool; } decomposition { P(K) prod(i) { P(Y[i]) } P(X | K Y) }
         forms { P(K) = uniform; P(Y[i]) = bernoulli(0.2 * i); P(X | K Y) = dirac(Y[K]); } }",
    )
    .unwrap();
    agrees(program.ask("P(Y[2] | X = true)").unwrap().p(true).unwrap(), 0.6, "pick");
    agrees(
        program.ask("P(X | Y[1] = true, Y[3] = false)").unwrap().p(true).unwrap(),
        (1.0 + 0.4) / 3.0,
        "pick",
    );
}

/// 200 elements: as a table they would have 2²⁰⁰ cells.
#[test]
fn long_families_are_answered_element_by_element() {
    let sensors = Program::parse(&SENSORS.replace("1..=3", "1..=200")).unwrap();
    let asked = sensors.question("P(Y[200] | Y[1..=199] = y)").unwrap();
    let mut seen = vec![false; 199];
    let answer = asked.given("y", seen.clone()).unwrap().ask().unwrap();
    let odds = 3.0 / 7.0 * 0.125f64.powi(199);
    agrees(answer.p(true).unwrap(), (0.2 + 0.9 * odds) / (1.0 + odds), "all false");
    // 51 of 199 are true: the odds of S are 3/7 · 4.5⁵¹ · 0.125¹⁴⁸.
    seen[..51].fill(true);
    let answer = asked.given("y", seen).unwrap().ask().unwrap();
    let odds = (3.0f64 / 7.0).ln() + 51.0 * 4.5f64.ln() + 148.0 * 0.125f64.ln();
    agrees(answer.p(true).unwrap(), (0.2 + 0.9 * odds.exp()) / (1.0 + odds.exp()), "some true");
}

#[test]
fn one_element_is_not_known_twice() {
    let sensors = Program::parse(SENSORS).unwrap();
    let error = sensors.ask("P(S | Y[1] = true, Y[1] and Y[2])");
    assert!(error.is_ok(), "a predicate of an element is another variable");
    let asked = sensors.question("P(Y[2] | Y[1..=2] = y)").unwrap().given("y", vec![true, true]).unwrap();
    let error = asked.ask().unwrap_err().to_string();
    assert!(error.contains("this question asks what it knows: `Y[2]` is on both sides"), "{error}");
}

/// Sizes that are given with the question bound the elements that it may name.
#[test]
fn values_and_families_of_sizes_given_when_asked() {
    let text = "program Sized { parameters { N : size; } variables { K : 1..=N; G[1..=N] : bool; T : bool; }
        decomposition { P(K) prod(i) { P(G[i] | K) } P(T | K) }
        forms { P(K) = uniform; P(G[i] | K) = bernoulli(if i = K { 0.75 } else { 0.25 }); P(T | K) = bernoulli(1 / K); } }"
        .replace("if i = K", "if i == K");
    let program = Program::parse(&text).unwrap().with("N", 3).unwrap();
    agrees(number(&program, "P(T = true | K = 3)"), 1.0 / 3.0, "inside");
    for by in ["sums", "join_tree", "weighting"] {
        let program = program.clone().by(by).unwrap();
        for question in ["P(T = true | K = 4)", "P(K = 9)"] {
            let error = program.ask(question).unwrap_err().to_string();
            assert!(
                error.contains("is not a value of it: its domain, `1..=N`, has 3"),
                "{by}, {question}: {error}"
            );
        }
    }
    // The whole family, whose length is known when it is asked: G[1] is true with probability 0.75, the others with 0.25.
    let whole = program.clone().by("join_tree").unwrap().ask("P(G | K = 1)").unwrap();
    agrees(whole.p([true, false, false]).unwrap(), 0.75f64.powi(3), "the whole family");
}

/// An element over time is read from its own column, beside columns of other elements.
#[test]
fn an_element_over_time_is_read_from_its_column() {
    let program = Program::parse(
        "program Steps { variables { X, X^-1, Z, G[1..=2] : bool; }
         decomposition { P(X^-1) P(X | X^-1) P(Z | X) prod(i) { P(G[i] | X) } }
         forms { P(X^-1) = previous(X) else bernoulli(0.5); P(X | X^-1) = dirac(X^-1);
            P(Z | X) = bernoulli(0.5); P(G[i] | X) = bernoulli(if X { 0.75 } else { 0.25 }); } }",
    )
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("steps.csv");
    std::fs::write(&table, "Z,G[1],G[2]\ntrue,true,false\nfalse,true,false\ntrue,NA,false\n").unwrap();
    // X does not change. Twice G[1]: (3/4)² : (1/4)²; G[2] three times false as well: 9 · 1 : 1 · 27.
    for (known, expected) in [
        ("G[1]", 0.9),
        ("Z, G[1]", 0.9),
        ("G[1..=1]", 0.9),
        ("G[1..=1], G[2]", 0.25),
        ("G[1], G[2..=2]", 0.25),
    ] {
        let question = program.question(&format!("filter P(X | {known})")).unwrap();
        let found = question.over_table(&table).unwrap();
        agrees(found.p(true).unwrap(), expected, known);
    }
    let error =
        program.question("filter P(X | G[1] = true)").unwrap().over_table(&table).unwrap_err().to_string();
    assert!(error.contains("the question gives `G[1]` a value, and so does a column"), "{error}");
}
