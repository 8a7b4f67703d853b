//! Points beside densities, densities at values, and precisions at the ends of their range.
//!
//! In: small programs. Out: their answers. Invariant: expected values are closed forms, computed by hand.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::law::Law;

fn asked(program: &str, text: &str) -> Result<Answer, Error> {
    let model = model_of(program);
    ask(&model, &question(&model, text), &Inputs::new()).map(|mut answers| answers.remove(0))
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{found}, expected {expected}");
}

/// X = 1 has the probability ½ of the point; beside it the density of the other case is nothing, in any unit of X.
#[test]
fn a_point_excludes_a_density_at_its_value() {
    for deviation in ["0.000001", "1", "1000"] {
        let program = format!(
            "program E {{ variables {{ K : bool; X : real; }} decomposition {{ P(K) P(X | K) }}
             forms {{ P(K) = bernoulli(0.5); P(X | K) = if K {{ dirac(1) }} else {{ normal(1, {deviation}) }}; }} }}"
        );
        let found = asked(&program, "P(K | X = 1)").unwrap();
        near(found.answer[1].p().unwrap(), 1.0);
        near(found.ln_evidence.unwrap(), 0.5f64.ln());
        // Elsewhere there is the density alone.
        near(asked(&program, "P(K | X = 2)").unwrap().answer[0].p().unwrap(), 1.0);
    }
    // Y = 1 is the point 2 X where K holds.
    let program =
        "program E { variables { K : bool; X, Y : real; } decomposition { P(K) P(X | K) P(Y | X K) }
        forms { P(K) = bernoulli(0.5); P(X | K) = normal(if K { 0 } else { 1 }, 1);
                P(Y | X K) = if K { dirac(2 * X) } else { normal(X, 1) }; } }";
    near(asked(program, "P(K | X = 0.5, Y = 1)").unwrap().answer[1].p().unwrap(), 1.0);
    let program = "program E { variables { K : bool; X : real; } decomposition { P(K) P(X | K) }
        forms { P(K) = bernoulli(0.5); P(X | K) = if K { dirac(1) } else { gamma(2, 2) }; } }";
    let refused = asked(program, "P(K | X = 1)").unwrap_err().to_string();
    assert!(refused.contains("dirac") || refused.contains("point"), "{refused}");
}

/// A number above 1 is no probability: ½ φ(0)/0.001 + ½ φ(0).
#[test]
fn a_value_of_a_real_has_a_density() {
    let program = "program E { variables { K : bool; X : real; } decomposition { P(K) P(X | K) }
        forms { P(K) = bernoulli(0.5); P(X | K) = normal(0, if K { 1e-3 } else { 1 }); } }";
    let found = asked(program, "P(X = 0)").unwrap();
    let Figure::Density { density } = found.answer[0].figure else { panic!("{:?}", found.answer[0].figure) };
    near(density, 0.5 * (1000.0 + 1.0) / std::f64::consts::TAU.sqrt());
}

const PRECISION: &str = "program E { variables { T, Y : real; } decomposition { P(T) P(Y | T) }
    forms { P(T) = gamma(2, 3); P(Y | T) = normal(0, 1 / sqrt(T)); } }";

#[track_caller]
fn gamma(found: &Answer, [shape, rate]: [f64; 2]) {
    let Figure::Law { law, .. } = found.answer[0].figure else { panic!("{:?}", found.answer[0].figure) };
    assert_eq!(law.law, Law::Gamma);
    near(law.parameters[0], shape);
    near(law.parameters[1], rate);
}

/// An observation at its mean says that τ is larger: gamma(a + ½, b). P(y = 0) = b^a Γ(a + ½) / (Γ(a) b^(a + ½) √(2π)).
#[test]
fn observations_at_their_means_are_evidence_about_a_precision() {
    let found = asked(PRECISION, "P(T | Y = 0)").unwrap();
    gamma(&found, [2.5, 3.0]);
    // Γ(2.5) = 1.5 · 0.5 · √π
    let expected = 0.75 * std::f64::consts::PI.sqrt() / (3.0 * std::f64::consts::TAU).sqrt();
    near(found.ln_evidence.unwrap(), expected.ln());
    let program = "program E { variables { T, M : real; Y[i in 1..=3] : real; } decomposition { P(T) P(M) prod(i) { P(Y[i] | M T) } }
        forms { P(T) = gamma(2, 3); P(M) = flat; P(Y[i] | M T) = normal(M, 1 / sqrt(T)); } }";
    // Three equal numbers: one goes to the mean, two are left.
    gamma(&asked(program, "P(T | Y = [1, 1, 1])").unwrap(), [3.0, 3.0]);
    let found = asked(program, "P(M | Y = [0, 0, 0])").unwrap();
    // M | y ~ student_t(2 a′, 0, √(b′ / (3 a′))), a′ = b′ = 3.
    let Figure::Law { law, .. } = found.answer[0].figure else { panic!("{:?}", found.answer[0].figure) };
    near(law.parameters[0], 6.0);
    near(law.parameters[2], (1.0f64 / 3.0).sqrt());
    // 10¹⁵⁵ has a square outside the range of numbers: evidence is never dropped.
    for far in ["1e154", "1e155"] {
        let refused = asked(PRECISION, &format!("P(T | Y = {far})")).unwrap_err().to_string();
        assert!(refused.contains("range of numbers"), "{refused}");
    }
    // b′ = 3 + 10²⁰⁰ / 2
    gamma(&asked(PRECISION, "P(T | Y = 1e100)").unwrap(), [2.5, 5e199]);
}

/// student_t(2, 3, 1) has a mean and no finite deviation, student_t(1, 3, 1) neither.
#[test]
fn moments_that_do_not_exist_are_named() {
    for (prior, mean, deviation) in
        [("gamma(1, 1)", "3.0", "\"infinite\""), ("gamma(0.5, 0.5)", "\"undefined\"", "\"undefined\"")]
    {
        let program = PRECISION.replace("gamma(2, 3)", prior).replace("normal(0,", "normal(3,");
        let found = asked(&program, "P(Y)").unwrap();
        let Figure::Law { law, quantiles, .. } = found.answer[0].figure else {
            panic!("{:?}", found.answer[0].figure)
        };
        assert_eq!(law.law, Law::StudentT);
        near(quantiles[1], 3.0);
        let json = serde_json::to_string(&found.answer[0]).unwrap();
        assert!(json.contains(&format!("\"mean\":{mean},\"deviation\":{deviation}")), "{json}");
    }
}
