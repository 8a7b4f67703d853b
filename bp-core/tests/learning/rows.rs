//! Rows of probabilities with zeros, and numbers that several rows share.
//!
//! In: programs whose tables read a parameter and what it leaves, and small tables of data. Out: learned programs, or refusals.
//! Invariant: expected numbers are shares of the cases that decide them, counted by hand.

use crate::support::learning::{answer, near, program, seen};
use crate::support::model_of;
use bp_core::compiler::learn::Learner;

fn stays(forms: &str) -> String {
    program("K : bool; X : 0..=2; Y : bool;", "P(K) P(X | K) P(Y)", forms)
        .replace("variables", "parameters { stay : probability = 0.5; } variables")
        .replace("forms {", "identification { stay from d; } forms {")
}

/// `stay` decides X in both rows, and Y: 5 of the 8 choices are for it.
#[test]
fn rows_with_zeros_share_a_probability() {
    let text = stays(
        "P(K) = bernoulli(0.5); P(Y) = bernoulli(1 - stay);
         P(X | K) = table { false: stay, 1 - stay, 0; true: 0, stay, 1 - stay; };",
    );
    // X stays in the rows 1, 2, 4; Y is false, for stay, in the rows 1 and 3.
    let learned = seen(&text, "K,X,Y\n0,0,0\n0,0,1\n0,1,0\n1,1,1\n").learned().unwrap();
    near(&answer(learned.model(), "P(Y)"), &[5.0 / 8.0, 3.0 / 8.0], 1e-12);
    near(&answer(learned.model(), "P(X | K = true)"), &[0.0, 5.0 / 8.0, 3.0 / 8.0], 1e-12);
}

/// A missing X with K false stays with the probability that is learned: EM ends at the share of what is seen, 1 of 3.
#[test]
fn rows_with_zeros_are_learned_from_missing_values() {
    let text = stays(
        "P(K) = bernoulli(0.5); P(Y) = bernoulli(0.5);
         P(X | K) = if K { categorical(0, 1 - stay, stay) } else { categorical(stay, 0, 1 - stay) };",
    );
    let learned = seen(&text, "K,X,Y\n0,,0\n0,0,1\n0,2,0\n1,1,1\n").learned().unwrap();
    near(&answer(learned.model(), "P(X | K = false)"), &[1.0 / 3.0, 0.0, 2.0 / 3.0], 1e-6);
}

#[test]
fn what_is_no_complement_is_refused() {
    // 2 · stay² is ½ at first, as one minus stay is.
    for row in ["categorical(stay, 2 * stay * stay, 0)", "categorical(stay, 0.9 - stay, 0.1)"] {
        let text = stays(&format!("P(K) = bernoulli(0.5); P(Y) = bernoulli(0.5); P(X | K) = {row};"));
        assert!(Learner::new(&model_of(&text)).is_err(), "{row}");
    }
}
