//! The extended Kalman filter, which is approximate and answers where it is named.
//!
//! In: a linear program, and one that is not. Out: normal laws. Invariant: of the linear program they are exact; of the other they
//! are those of Newton's method by hand.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask_over_time, ask_over_time_by};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Strategy, plan};
use bp_core::compiler::sample::Sampling;

fn linearised(model: &Model, text: &str, z: &[f64]) -> Result<Answer, Error> {
    let rows: Vec<_> = z.iter().map(|z| vec![("Z".to_owned(), *z)]).collect();
    let by = Some(Strategy::ExtendedKalman);
    let answers =
        ask_over_time_by(model, &question(model, text), &rows, &Inputs::new(), Sampling::default(), by);
    answers.map(|mut answers| answers.remove(0))
}

fn laws(answer: &Answer) -> Vec<[f64; 2]> {
    let law = |figure| match figure {
        Figure::Normal { mean, deviation } => [mean, deviation],
        figure => panic!("{figure:?}"),
    };
    answer.answer.iter().map(|row| law(row.figure)).collect()
}

#[test]
fn a_linear_program_is_exact() {
    let model = model_of(
        "program Walk { variables { X, X^-1, Z : real; } decomposition { P(initial(X)) P(X | X^-1) P(Z | X) }
         forms { P(initial(X)) = normal(3, 2); P(X | X^-1) = normal(0.5 * X^-1 + 1, 1); P(Z | X) = normal(2 * X, 1); } }",
    );
    let z = [5.0, 1.0, 2.5];
    for text in ["filter P(X | Z)", "smooth P(X | Z)", "predict(2) P(X | Z)"] {
        let rows: Vec<_> = z.iter().map(|z| vec![("Z".to_owned(), *z)]).collect();
        let exact =
            ask_over_time(&model, &question(&model, text), &rows, &Inputs::new(), Sampling::default());
        let (exact, found) = (exact.unwrap().remove(0), linearised(&model, text, &z).unwrap());
        for (one, other) in laws(&found).iter().zip(laws(&exact)) {
            assert!(
                (one[0] - other[0]).abs() < 1e-9 && (one[1] - other[1]).abs() < 1e-9,
                "{one:?} {other:?}"
            );
        }
        assert!((found.ln_evidence.unwrap() - exact.ln_evidence.unwrap()).abs() < 1e-9);
    }
}

#[test]
fn the_tangent_is_taken_at_the_estimate() {
    let model = model_of(
        "program Square { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(1, 0.2); P(X | X^-1) = dirac(X^-1 * X^-1); P(Z | X) = normal(X, 0.1); } }",
    );
    let found = linearised(&model, "filter P(X | Z)", &[1.5]).unwrap();
    // The largest of −(u − 1)² / 2 · 25 − (1.5 − u²)² / 2 · 100: its slope is 0 between 1 and √1.5.
    let (mut low, mut high) = (1.0f64, 1.5f64.sqrt());
    for _ in 0..100 {
        let u = 0.5 * (low + high);
        let slope = -25.0 * (u - 1.0) + 100.0 * (1.5 - u * u) * 2.0 * u;
        if slope > 0.0 { low = u } else { high = u }
    }
    // There u has precision 25 + 100 (2u)², and X = u² deviates 2u times as much.
    let deviation = 2.0 * low / (25.0 + 400.0 * low * low).sqrt();
    let [mean, spread] = laws(&found)[0];
    assert!(
        (mean - low * low).abs() < 1e-8 && (spread - deviation).abs() < 1e-8,
        "{mean} {spread}, expected {} {deviation}",
        low * low
    );
    assert!(found.to_string().contains("approximate: linearised"), "{found}");
    let json = serde_json::to_value(&found).unwrap();
    assert_eq!(json["approximate"], "linearised");
}

#[test]
fn it_is_chosen_by_name_only() {
    let model = model_of(
        "program Bent { variables { S : bool; X, X^-1, Z : real; } decomposition { P(S) P(X^-1) P(X | X^-1) P(Z | X S) }
         forms { P(S) = bernoulli(0.5); P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(sin(X^-1), 0.5);
                 P(Z | X S) = normal(if S { X } else { -X }, 0.5); } }",
    );
    let asked = question(&model, "filter P(X | Z)");
    let made = plan(&model, &asked, Options::default()).unwrap();
    assert_eq!(made.routes[0].strategy(), Strategy::Particles);
    let error = linearised(&model, "filter P(X | Z)", &[1.0]).unwrap_err().to_string();
    assert!(error.contains("`S` is finite"), "{error}");
}
