//! Covariances: of reals that are asked together, and as the parameter of a normal vector.
//!
//! In: programs whose covariances follow by hand. Out: answers, as values, as JSON and as tables. Invariant: expected
//! numbers come from the algebra written beside them, which shares no code with the crate.

use crate::support::close;
use bp_core::prelude::*;
use serde_json::Value as Json;

#[track_caller]
fn matrix(found: &Json, expected: &[&[f64]]) {
    let rows = found.as_array().unwrap_or_else(|| panic!("no matrix: {found}"));
    assert_eq!(rows.len(), expected.len(), "{found}");
    for (row, expected) in rows.iter().zip(expected) {
        let row = row.as_array().unwrap();
        assert_eq!(row.len(), expected.len(), "{found}");
        row.iter().zip(*expected).for_each(|(found, expected)| close(found.as_f64().unwrap(), *expected));
    }
}

fn json(answer: &Posterior) -> Json {
    serde_json::to_value(answer).unwrap()
}

#[test]
fn reals_asked_together_report_their_covariance() {
    let line = Program::parse(
        "program Line { variables { X, Y, Z : real; } decomposition { P(X) P(Y | X) P(Z | Y) }
         forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); P(Z | Y) = normal(Y, 1); } }",
    )
    .unwrap();
    let both = line.ask("P(X, Y | Z = 3)").unwrap();
    // Var Z = 3: Cov(X, Y | Z) = 1 − 1·2/3, Var(X | Z) = 1 − 1/3, Var(Y | Z) = 2 − 4/3.
    close(both.covariance("X", "Y").unwrap(), 1.0 / 3.0);
    let (third, two) = (1.0 / 3.0, 2.0 / 3.0);
    matrix(&json(&both)["covariance"], &[&[two, third], &[third, two]]);
    let text = both.to_string();
    assert!(text.contains("covariance with X  with Y"), "{text}");
    assert!(text.contains("0.666667           0.333333"), "{text}");
    // One real has no covariance, nor have reals that are asked one by one, or for another statistic.
    assert!(json(&line.ask("P(X | Z = 3)").unwrap()).get("covariance").is_none());
    assert!(json(&line.ask("variance P(X, Y | Z = 3)").unwrap()).get("covariance").is_none());
    assert!(json(&line.marginals(&evidence! { Z: 3.0 }).unwrap()).get("covariance").is_none());
    // More than a line is wide: they follow in lines of their own.
    let many = Program::parse(
        "program Many { variables { X : real[9]; Y : real; } decomposition { P(X) P(Y) }
         forms { P(X) = normal(1, 2); P(Y) = normal(0, 1); } }",
    )
    .unwrap();
    let all = many.ask("P(X, Y)").unwrap();
    let text = all.to_string();
    assert!(text.contains("with Y") && text.lines().all(|line| line.chars().count() <= 80), "{all}");
    close(json(&all)["covariance"][8][8].as_f64().unwrap(), 4.0);
    close(json(&all)["covariance"][9][8].as_f64().unwrap(), 0.0);
}

#[test]
fn a_mixture_reports_the_covariance_of_all_its_components() {
    let pair = Program::parse(
        "program Pair { variables { K : bool; A, B : real; } decomposition { P(K) P(A | K) P(B | A) }
         forms { P(K) = bernoulli(0.5); P(A | K) = normal(if K { 2 } else { -2 }, 1); P(B | A) = normal(A, 1); } }",
    )
    .unwrap();
    let both = pair.ask("P(A, B)").unwrap();
    // Var A = 1 + 2², Cov(A, B) = Var A, Var B = Var A + 1.
    matrix(&json(&both)["covariance"], &[&[5.0, 5.0], &[5.0, 6.0]]);
    close(both.covariance("B", "A").unwrap(), 5.0);
    assert!(both.to_string().contains("covariance with A  with B"), "{both}");
    // The median of a symmetric distribution is not a rounding error.
    assert_eq!(pair.ask("quantile(0.5) P(A)").unwrap().number().unwrap().to_bits(), 0.0f64.to_bits());
    assert!(!both.to_string().contains("e-"), "{both}");
}

#[test]
fn over_time_each_instant_has_a_covariance() {
    let walk = Program::parse(
        "program Walk over t in Time { variables { X, Z, V : real; } decomposition { P(X | X^-1) P(Z | X) P(V | X) }
         forms { P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 1); P(V | X) = normal(X, 1); } }",
    )
    .unwrap();
    let seen = [evidence! { Z: 1.0 }, evidence! { Z: 2.0 }];
    let smooth = walk.question("smooth P(X, V | Z)").unwrap().over(&seen).unwrap();
    // The precision of (X₁, X₂) is [3 −1; −1 2]: prior, transition and reading; its inverse has the diagonal 2/5, 3/5.
    // V = X + noise of variance 1.
    let found = json(&smooth);
    matrix(&found["covariance"][0], &[&[0.4, 0.4], &[0.4, 1.4]]);
    matrix(&found["covariance"][1], &[&[0.6, 0.6], &[0.6, 1.6]]);
    let filter = walk.question("filter P(X, V | Z)").unwrap().over(&seen).unwrap();
    matrix(&json(&filter)["covariance"], &[&[0.6, 0.6], &[0.6, 1.6]]);
}
