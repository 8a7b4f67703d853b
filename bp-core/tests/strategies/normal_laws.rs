//! Statistics of a normal law: entropy, information, divergence, largest density, draws; with and without time.
//!
//! In: linear Gaussian programs of two or three reals. Out: numbers, compared with closed forms of their variances by
//! hand. Invariant: a law that determines a real has no density: its entropy is −∞, never NaN.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask, ask_over_time};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::sample::Sampling;
use std::f64::consts::{E, PI, TAU};

/// X has the variance 4, Y given X ¼, and D equals 2 Y.
const PAIR: &str = "program Pair { variables { X, Y, D : real; } decomposition { P(X) P(Y | X) P(D | Y) }
    forms { P(X) = normal(1, 2); P(Y | X) = normal(3 * X - 1, 0.5); P(D | Y) = dirac(2 * Y); } }";

/// The carried level moves with deviation 1, and is observed with deviation 1.
const LEVEL: &str = "program Level { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
    forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 1); } }";

fn asked(words: &str) -> Answer {
    let model = model_of(PAIR);
    ask(&model, &question(&model, words), &Inputs::new())
        .unwrap_or_else(|error| panic!("{words}: {error}"))
        .remove(0)
}

/// After z = 3 and 3.6.
fn over_time(words: &str) -> Answer {
    let model = model_of(LEVEL);
    let rows = [3.0, 3.6].map(|z| vec![("Z".to_owned(), z)]);
    ask_over_time(&model, &question(&model, words), &rows, &Inputs::new(), Sampling::default())
        .unwrap_or_else(|error| panic!("{words}: {error}"))
        .remove(0)
}

#[track_caller]
fn is(answer: &Answer, expected: &[f64]) {
    let found: Vec<f64> = answer.answer.iter().map(|row| row.figure.number().unwrap()).collect();
    assert_eq!(found.len(), expected.len(), "{answer:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-13, "{found}, expected {expected}");
    }
}

/// Values of a row, as numbers.
fn values(answer: &Answer, row: usize) -> Vec<f64> {
    answer.answer[row].values.iter().map(|(_, value)| value.parse().unwrap()).collect()
}

#[test]
fn closed_forms_of_a_normal_law() {
    // √|Σ| of X and Y is 2 · ½; Y alone has the variance 9 · 4 + ¼.
    is(&asked("entropy P(X Y)"), &[(TAU * E).ln()]);
    is(&asked("entropy P(Y)"), &[0.5 * (TAU * E * 36.25).ln()]);
    is(&asked("information P(X, Y)"), &[0.5 * 145f64.ln()]);
    // Given Y = 8: 1/v = 1/4 + 9 / ¼, m = v (1/4 + 12 · 9).
    let variance = 1.0 / 36.25;
    let mean = variance * 108.25;
    is(&asked("entropy P(X | Y = 8)"), &[0.5 * (TAU * E * variance).ln()]);
    let divergence = 0.5 * (variance / 4.0 + (mean - 1.0f64).powi(2) / 4.0 - 1.0 + (4.0 / variance).ln());
    is(&asked("divergence P(X | Y = 8) from P(X)"), &[divergence]);
    for word in ["argmax", "max"] {
        let largest = asked(&format!("{word} P(X Y)"));
        is(&largest, &[1.0 / TAU]);
        assert_eq!(values(&largest, 0), [1.0, 2.0]);
    }
    is(&asked("max P(X | Y = 8)"), &[1.0 / (TAU * variance).sqrt()]);
}

#[test]
fn draws_have_the_moments_of_the_law() {
    const COUNT: usize = 20_000;
    let drawn = asked(&format!("draw({COUNT}) P(X Y)"));
    let pairs: Vec<Vec<f64>> = (0..COUNT).map(|row| values(&drawn, row)).collect();
    assert_eq!(drawn.answer[COUNT - 1].figure, Figure::Draw { draw: COUNT });
    let mean = |of: &dyn Fn(&[f64]) -> f64| pairs.iter().map(|pair| of(pair)).sum::<f64>() / COUNT as f64;
    // Five standard errors: of a mean σ / √n, of a second moment √(σ₁² σ₂² + c²) / √n.
    let within = |found: f64, expected: f64, deviation: f64| {
        assert!((found - expected).abs() < 5.0 * deviation / (COUNT as f64).sqrt(), "{found} {expected}");
    };
    within(mean(&|pair| pair[0]), 1.0, 2.0);
    within(mean(&|pair| pair[1]), 2.0, 36.25f64.sqrt());
    within(mean(&|pair| (pair[0] - 1.0) * (pair[1] - 2.0)), 12.0, (4.0 * 36.25 + 144.0f64).sqrt());
    within(mean(&|pair| (pair[1] - 3.0 * pair[0] + 1.0).powi(2)), 0.25, 0.25 * 2f64.sqrt());
}

#[test]
fn determined_reals_have_no_density() {
    for (words, json, shown) in [
        ("entropy P(Y D)", r#""entropy":"-infinite""#, "-infinite"),
        ("max P(Y D)", r#""density":"infinite""#, "infinite"),
        ("information P(Y, D)", r#""information":"infinite""#, "infinite"),
        ("divergence P(Y | X = 1) from P(Y | D = 4)", r#""divergence":"infinite""#, "infinite"),
    ] {
        let found = asked(words);
        let written = serde_json::to_string(&found).unwrap();
        assert!(written.contains(json), "{written}");
        assert!(found.to_string().contains(shown), "{found}");
    }
    // D determines Y: the divergence is that of Y, of the variances ¼ and 36¼ and means 2.
    is(&asked("divergence P(Y D | X = 1) from P(Y D)"), &[0.5 * (0.25 / 36.25 - 1.0 + 145f64.ln())]);
}

#[test]
fn closed_forms_over_time() {
    // Variances before and after z: 2 and 2/3, 5/3 and 5/8. Means 2 and 3; smoothed 2.4 with ½ at the first instant.
    is(&over_time("entropy filter P(X | Z)"), &[0.5 * (TAU * E * 5.0 / 8.0).ln()]);
    is(&over_time("entropy predict(1) P(X | Z)"), &[0.5 * (TAU * E * 13.0 / 8.0).ln()]);
    let each = [0.5, 5.0 / 8.0];
    is(&over_time("entropy smooth P(X | Z)"), &each.map(|variance: f64| 0.5 * (TAU * E * variance).ln()));
    let largest = over_time("argmax filter P(X | Z)");
    is(&largest, &[1.0 / (PI * 10.0 / 8.0).sqrt()]);
    assert!((values(&largest, 0)[0] - 3.0).abs() < 1e-13);
    let first = 0.5 * (0.75 + 0.24 - 1.0 + (4.0 / 3.0f64).ln());
    is(&over_time("divergence smooth P(X | Z) from filter P(X | Z)"), &[first, 0.0]);
    // X^-1 is informative about X: variance 2/3, a noise of 1, observed with deviation 1.
    is(&over_time("information filter P(X, X^-1 | Z)"), &[0.5 * (5.0f64 / 8.0 / (1.0 / 2.0)).ln()]);
    assert_eq!(over_time("draw(3) smooth P(X | Z)").answer.len(), 6);
}
