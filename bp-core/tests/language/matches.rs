//! What a `match` may be on, and what `--set` and `with` read: values as a reader of the reference writes them.
//!
//! In: programs and settings. Out: probabilities. Invariant: an expected value is worked out by hand.

use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|wrong| panic!("{wrong}"))
}

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12, "{found} ≠ {expected}");
}

const BINS: &str =
    "program Bins { variables { B : bins(0, 10, 5); X : bool; } decomposition { P(B) P(X | B) }
    forms { P(B) = uniform; P(X | B) = bernoulli(match B { ARMS }); } }";

/// The centres are 1, 3, 5, 7 and 9; a value means its bin, and a range the bins whose centres it has.
#[test]
fn a_match_on_bins_has_values_and_ranges_in_the_unit_of_the_bins() {
    let given = |arms: &str, b: f64| {
        let question = format!("P(X = true | B = {b})");
        program(&BINS.replace("ARMS", arms)).ask(question.as_str()).unwrap().number().unwrap()
    };
    for (b, expected) in [(1.0, 0.5), (2.1, 0.25), (3.7, 0.25), (4.0, 0.5)] {
        close(given("3.7 => 0.25, _ => 0.5", b), expected);
    }
    for (b, expected) in [(1.0, 0.25), (5.0, 0.25), (7.0, 0.75), (10.0, 0.75)] {
        close(given("0..=5 => 0.25, 5..=10 => 0.75", b), expected);
    }
    for (arms, message) in [
        ("0..=4 => 0.25", "does not cover `5`"),
        ("0..=10 => 0.25, _ => 0.5", "never reached"),
        ("12 => 0.25, _ => 0.5", "`12` is not a value"),
    ] {
        let wrong = Program::parse(&BINS.replace("ARMS", arms)).unwrap_err().to_string();
        assert!(wrong.contains(message), "{wrong}");
    }
}

#[test]
fn a_match_on_the_index_of_a_product_knows_its_range() {
    let text = "program Lamps { variables { X[1..=3] : bool; } decomposition { prod(i) { P(X[i]) } }
        forms { P(X[i]) = match i { 1 => bernoulli(0.25), 2..=3 => bernoulli(0.5) }; } }";
    close(program(text).ask("P(X[1] = true, X[3] = true)").unwrap().number().unwrap(), 0.125);
    for (from, to, message) in [("2..=3", "2", "does not cover `3`"), ("2..=3", "4", "`4` is not a value")] {
        let wrong = Program::parse(&text.replace(from, to)).unwrap_err().to_string();
        assert!(wrong.contains(message), "{wrong}");
    }
}

/// Element 1 has 0.25, the others 0.5: of three elements (0.25 + 2 · 0.5) / 3.
#[test]
fn a_whole_number_denotes_an_element_of_a_set() {
    for choice in [
        "match S { 1 => 0.25, _ => 0.5 }",
        "if S == 1 { 0.25 } else { 0.5 }",
        "if 1 != S { 0.5 } else { 0.25 }",
    ] {
        let text = format!(
            "program Schools {{ variables {{ S : Schools; X : bool; }} decomposition {{ P(S) P(X | S) }}
             forms {{ P(S) = uniform; P(X | S) = bernoulli({choice}); }} }}"
        );
        let schools = program(&text).with("Schools", 3).unwrap();
        close(schools.ask("P(X = true)").unwrap().number().unwrap(), 1.25 / 3.0);
        close(schools.ask("P(X = true | S = 1)").unwrap().number().unwrap(), 0.25);
        let plate = "program Cells over C in Cells { variables { O : bool; } decomposition { P(O) }
             forms { P(O) = bernoulli(CHOICE); } }";
        let plate = program(&plate.replace("CHOICE", &choice.replace('S', "C"))).with("Cells", 3).unwrap();
        let found: Vec<f64> =
            plate.ask("P(O = true)").unwrap().answer().answer.iter().map(|row| row.p().unwrap()).collect();
        assert_eq!(found, [0.5, 0.25, 0.5]);
    }
    let half = "program Half { variables { S : Schools; X : bool; } decomposition { P(S) P(X | S) }
        forms { P(S) = uniform; P(X | S) = bernoulli(if S == 0.5 { 0.25 } else { 0.5 }); } }";
    assert!(Program::parse(half).unwrap_err().to_string().contains("an element of `Schools`"));
}

/// 0.9 · 0.1 · 0.9 = 0.081 against 0.2 · 0.8 · 0.2 = 0.032.
#[test]
fn the_values_of_a_family_are_a_list_with_or_without_brackets() {
    let text = "program Votes { variables { S : bool; W[1..=3] : bool; } decomposition { P(S) prod(i) { P(W[i] | S) } }
        forms { P(S) = bernoulli(0.5); P(W[i] | S) = bernoulli(if S { 0.9 } else { 0.2 }); } }";
    let votes = program(text);
    for list in ["1,0,1", "[1, 0, 1]", "true, false, true", "[true,false,true]"] {
        let question = votes.question("P(S = true | W = w)").unwrap().given("w", list).unwrap();
        close(question.ask().unwrap().number().unwrap(), 0.081 / 0.113);
    }
    for (list, message) in [("[true, yes, true]", "`yes` is not a value"), ("[1, 0", "`[1` is not a value")] {
        let Err(error) = votes.question("P(S = true | W = w)").unwrap().given("w", list) else {
            panic!("{list}")
        };
        assert!(error.to_string().contains(message), "{error}");
    }
}
