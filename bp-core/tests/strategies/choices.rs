//! Long and shared choices, and the order of values that are equally probable.
//!
//! In: programs made here. Out: answers. Invariant: expected numbers are sums over the contexts, by hand; work grows with the
//! length of a program, not with its square or its number of paths.

use bp_core::compiler::answer::Figure;
use bp_core::prelude::*;

fn close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < 1e-12, "{what}: {found}, expected {expected}");
}

/// K takes `count` values, and Y is true with the probability of its arm.
fn matched(count: usize, probability: impl Fn(usize) -> String) -> Program {
    let arms: Vec<String> = (0..count).map(|value| format!("{value} => {}", probability(value))).collect();
    let text = format!(
        "program Matched {{ parameters {{ b : real = 1.5; }} variables {{ K : 0..={}; Y : bool; }} decomposition {{ P(K) P(Y | K) }}
         forms {{ P(K) = uniform; P(Y | K) = bernoulli(match K {{ {} }}); }} }}",
        count - 1,
        arms.join(", ")
    );
    Program::parse(&text).unwrap()
}

#[test]
fn a_match_of_many_arms_is_looked_up() {
    // Each value has an arm of its own: to try the arms one after the other takes 1.8 · 10⁹ steps.
    let count = 60_000;
    let program = matched(count, |value| format!("{}", (value % 97) as f64 / 100.0));
    let expected = (0..count).map(|value| (value % 97) as f64 / 100.0).sum::<f64>() / count as f64;
    close(program.ask("P(Y)").unwrap().p(true).unwrap(), expected, "by sums");
    let marginals = program.marginals(&evidence! { K: 59_999 }).unwrap();
    // 59 999 = 618 · 97 + 53
    close(marginals.of("Y").unwrap().p(true).unwrap(), 0.53, "by a join tree");
}

#[test]
fn an_arm_outside_0_and_1_is_named() {
    let program = matched(80, |value| if value == 70 { "b".to_owned() } else { "0.25".to_owned() });
    for by in ["sums", "join_tree"] {
        let program = program.clone().by(by).unwrap();
        let error = program.ask("P(Y)").unwrap_err().to_string();
        assert!(error.contains("K = 70") && error.contains("1.5"), "{by}: {error}");
        // Before that arm, and behind it.
        for question in ["P(Y | K = 3)", "P(Y | K = 75)"] {
            close(program.ask(question).unwrap().p(true).unwrap(), 0.25, by);
        }
        close(program.with("b", 0.5).unwrap().ask("P(Y)").unwrap().p(true).unwrap(), 20.25 / 80.0, by);
    }
}

#[test]
fn branches_that_choices_share_are_lowered_once() {
    // 2⁶⁰ paths. With A and B true q stays 0.2, with A alone too; with B alone q and r change places an even number of times;
    // with neither q is r, 0.6.
    let mut lets = "let q0 = 0.2 in let r0 = 0.6 in ".to_owned();
    for step in 1..=60 {
        let before = step - 1;
        lets += &format!("let q{step} = if A {{ q{before} }} else {{ r{before} }} in ");
        lets += &format!("let r{step} = if B {{ q{before} }} else {{ r{before} }} in ");
    }
    let text = format!(
        "program Shared {{ variables {{ A, B, Y : bool; }} decomposition {{ P(A) P(B) P(Y | A B) }}
         forms {{ P(A) = uniform; P(B) = uniform; P(Y | A B) = {lets} bernoulli(q60); }} }}"
    );
    for by in ["sums", "join_tree"] {
        let program = Program::parse(&text).unwrap().by(by).unwrap();
        close(program.ask("P(Y)").unwrap().p(true).unwrap(), 0.3, by);
    }
}

/// The values of a variable in the order of an answer, with their probabilities.
fn ordered(program: &Program, question: &str) -> Vec<(String, f64)> {
    let asked = program.ask(question).unwrap();
    let rows = asked.answer().answer.iter().map(|row| match row.figure {
        Figure::Probability { p } => (row.values.last().unwrap().1.clone(), p),
        _ => panic!("{question}: no probability"),
    });
    rows.collect()
}

#[test]
fn equally_probable_values_are_in_the_order_of_the_table() {
    let dice = Program::parse(
        "program Dice { variables { A, B, C : 1..=6; Sum : 3..=18; } decomposition { P(A) P(B) P(C) P(Sum | A B C) }
         forms { P(A) = uniform; P(B) = uniform; P(C) = uniform; P(Sum | A B C) = dirac(A + B + C); } }",
    )
    .unwrap();
    for by in ["sums", "join_tree"] {
        let dice = dice.clone().by(by).unwrap();
        // 27 ways each to 10 and to 11, 25 to 9 and to 12, of 216.
        let found = ordered(&dice, "best(4) P(Sum)");
        for ((value, p), (expected, ways)) in
            found.iter().zip([("10", 27.0), ("11", 27.0), ("9", 25.0), ("12", 25.0)])
        {
            assert_eq!(value, expected, "{by}: {found:?}");
            close(*p, ways / 216.0, by);
        }
        let values =
            |found: Vec<(String, f64)>| found.into_iter().map(|(value, _)| value).collect::<Vec<_>>();
        assert_eq!(values(ordered(&dice, "argmax P(Sum)")), ["10", "11"], "{by}");
        assert_eq!(values(ordered(&dice, "best(3) P(A | Sum = 10, B = 3)")), ["1", "2", "3"], "{by}");
    }
}

#[test]
fn a_dirac_of_known_reals_agrees_up_to_rounding() {
    // 0.1 + 2 · 0.1 is 0.30000000000000004 in f64; N = false would make D 0.2.
    let program = Program::parse(
        "program Sum { variables { X, Y, D : real; N : bool; }
         decomposition { P(X) P(Y) P(N) P(D | X Y N) }
         forms { P(X) = normal(0, 1); P(Y) = normal(0, 1); P(N) = bernoulli(0.25);
                 P(D | X Y N) = if N { dirac(X + 2 * Y) } else { dirac(X + Y) }; } }",
    )
    .unwrap();
    let p = |d: &str| program.ask(&format!("P(N | X = 0.1, Y = 0.1, D = {d})"))?.p(true);
    assert_eq!(p("0.3").unwrap(), 1.0);
    assert_eq!(p("0.2").unwrap(), 0.0);
    let message = p("0.30000001").unwrap_err().to_string();
    assert!(message.contains("probability zero"), "{message}");
}
