//! Dirichlet posteriors, by weighting and by Gibbs sampling.
//!
//! In: a program with a vector of proportions. Out: estimates. Invariant: the prior dirichlet(a) and counts n give the
//! posterior dirichlet(a + n), with E = (a + n) / Σ and its deviation.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Figure, ask_with, compile_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;

#[track_caller]
fn within([found, error]: [f64; 2], expected: f64) {
    assert!(error > 0.0 && (found - expected).abs() < 4.0 * error, "{found} ± {error}, expected {expected}");
}

#[test]
fn counts_are_added_to_the_parameters() {
    let model = model_of(
        "program Urn { variables { Share : real[3]; A, B, C, D : { Red, Green, Blue }; Y : 0..=2; }
         decomposition { P(Share) P(A | Share) P(B | Share) P(C | Share) P(D | Share) P(Y | Share) }
         forms { P(Share) = dirichlet(2, 1, 0.5); P(A | Share) = categorical(Share[0], Share[1], Share[2]);
                 P(B | Share) = categorical(Share[0], Share[1], Share[2]);
                 P(C | Share) = categorical(Share[0], Share[1], Share[2]);
                 P(D | Share) = categorical(Share[0], Share[1], Share[2]); P(Y | Share) = weights(Share[Y]); } }",
    );
    // Three red, one blue: dirichlet(5, 1, 1.5).
    let asked = question(&model, "P(Share Y | A = Red, B = Red, C = Blue, D = Red)");
    for by in [Strategy::Weighting, Strategy::Gibbs] {
        let compiled = compile_by(&model, &asked, Some(by)).unwrap();
        let answers = compiled.ask_with(&Inputs::new(), Sampling { particles: 40_000, seed: 1 }).unwrap();
        for row in &answers[0].answer {
            let (name, value) = &row.values[0];
            match row.figure {
                Figure::Estimated { p, error } => {
                    let a = [5.0, 1.0, 1.5][["0", "1", "2"].iter().position(|it| it == value).unwrap()];
                    within([p, error], a / 7.5);
                }
                Figure::Real { mean, deviation, .. } => {
                    let a = [5.0, 1.0, 1.5]
                        [["Share[0]", "Share[1]", "Share[2]"].iter().position(|it| it == name).unwrap()];
                    within(mean, a / 7.5);
                    within(deviation, (a * (7.5 - a) / (7.5 * 7.5 * 8.5f64)).sqrt());
                }
                _ => panic!("{row:?}"),
            }
        }
        assert_eq!(answers[0].answer.len(), 6);
    }
}

#[test]
fn a_parameter_that_is_not_positive_is_an_error() {
    let model = model_of(
        "program Urn { parameters { a : real = -1; } variables { Share : real[2]; }
         decomposition { P(Share) } forms { P(Share) = dirichlet(1, a); } question share { P(Share) } }",
    );
    let asked = ask_with(&model, &question(&model, "P(Share)"), &Inputs::new(), Sampling::default());
    let error = asked.unwrap_err().to_string();
    assert!(
        error.contains("`P(Share) = dirichlet(1, a)`: parameter 2 is -1, but it must be greater than 0"),
        "{error}"
    );
}
