//! Laws over integers whose probabilities f64 does not hold.
//!
//! In: observations tens of deviations away from every value. Out: the answers of sums and of chains over time, beside
//! mpmath at 50 digits; a refusal where a join tree's tables do not hold what counts. Invariant: nothing is called
//! impossible that the program gives a probability.

use super::{answer, model_of, near, numbers, question};
use bp_core::answer::{Figure, ask_over_time, compile_by};
use bp_core::exec::Inputs;
use bp_core::plan::Strategy;
use bp_core::sample::Sampling;

const SENSORS: &str = "program Sensors { variables { X, Z1, Z2 : 0..=100; }
    decomposition { P(X) P(Z1 | X) P(Z2 | X) }
    forms { P(X) = uniform; P(Z1 | X) = normal(X, 1); P(Z2 | X) = normal(X, 1); } }";

#[test]
fn two_sensors_that_disagree_meet_in_the_middle() {
    // P(x | 0, 75) ∝ n(0; x) n(75; x), n(z; x) = exp(−(z − x)²/2) / Σ_k exp(−(k − x)²/2).
    let asked = "P(X | Z1 = 0, Z2 = 75)";
    let by_sums = answer(SENSORS, asked, &Inputs::new());
    near(
        &numbers(&by_sums)[36..40],
        &[0.059_471_296_701_721, 0.439_436_747_605_165, 0.439_436_747_605_165, 0.059_471_296_701_721],
        1e-9,
    );
    assert!((by_sums.ln_evidence.unwrap() + 1_412.130_736_102_75).abs() < 1e-6);
    let model = model_of(SENSORS);
    let by_tree = compile_by(&model, &question(&model, asked), Some(Strategy::JoinTree)).unwrap();
    let error = by_tree.ask(&Inputs::new()).unwrap_err().to_string();
    assert!(error.contains("does not hold them"), "{error}");
    // Where what is lost does not count, the tree answers.
    let asked = "P(X | Z1 = 50, Z2 = 52)";
    let by_tree = compile_by(&model, &question(&model, asked), Some(Strategy::JoinTree)).unwrap();
    let by_tree = by_tree.ask(&Inputs::new()).unwrap().remove(0);
    near(&numbers(&by_tree)[50..53], &numbers(&answer(SENSORS, asked, &Inputs::new()))[50..53], 1e-12);
}

#[test]
fn chains_over_time_hold_what_is_far() {
    let model = model_of(
        "program Drift { variables { X, X^-1, Z1, Z2 : 0..=100; }
         decomposition { P(X^-1) P(X | X^-1) P(Z1 | X) P(Z2 | X) }
         forms { P(X^-1) = previous(X) else uniform; P(X | X^-1) = normal(X^-1, 0.05);
                 P(Z1 | X) = normal(X, 1); P(Z2 | X) = normal(X, 1); } }",
    );
    let row = |one: f64, other: f64| vec![("Z1".to_owned(), one), ("Z2".to_owned(), other)];
    let rows = [row(0.0, 100.0), row(5.0, 95.0), row(40.0, 80.0)];
    let asked = question(&model, "expectation smooth P(X | Z1 Z2)");
    let found = ask_over_time(&model, &asked, &rows, &Inputs::new(), Sampling::default()).unwrap().remove(0);
    assert!((found.ln_evidence.unwrap() + 5_001.810_332_225_573).abs() < 5e-6, "{found:?}");
    for row in &found.answer {
        let Figure::Expectation { expectation, .. } = row.figure else { panic!("{row:?}") };
        assert!((expectation - 53.263_145_144_657_03).abs() < 1e-7, "{expectation}");
    }
}
