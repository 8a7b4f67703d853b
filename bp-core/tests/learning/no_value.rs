//! Learning where a variable may have no value, or a point beside a density.
//!
//! In: small tables. Out: learned programs, or refusals. Invariant: expected numbers are shares of the cases, counted by hand.

use crate::support::learning::{answer, near, program, seen};

/// Where K is false no value of X is possible: a missing X says that K is true, and a case with K false is impossible.
#[test]
fn a_variable_without_a_value_is_evidence_about_its_parents() {
    let text = program(
        "K : bool; X : 0..=2;",
        "P(K) P(X | K)",
        "P(K) = unknown(histogram); P(X | K) = weights(if K { 1 } else { 0 });",
    );
    let learned = seen(&text, "K,X\n1,\n,\n1,2\n").learned().unwrap();
    near(&answer(learned.model(), "P(K)"), &[0.0, 1.0], 1e-12);
    let refused = seen(&text, "K,X\n1,\n0,\n1,2\n").learned().map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("probability zero") || refused.contains("impossible"), "{refused}");
}

/// The share of K cannot be weighed between the probability of a point and a density.
#[test]
fn points_are_not_weighed_against_densities() {
    let text = program(
        "K : bool; Y : real;",
        "P(K) P(Y | K)",
        "P(K) = unknown(histogram); P(Y | K) = if K { dirac(1) } else { normal(0, 1) };",
    );
    let learned = seen(&text, "K,Y\n1,1\n0,2\n").learned().unwrap();
    near(&answer(learned.model(), "P(K)"), &[0.5, 0.5], 1e-12);
    let refused = seen(&text, "K,Y\n,1\n,2\n1,1\n,0\n").learned().map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("has a point for some of its values and a density for others"), "{refused}");
}
