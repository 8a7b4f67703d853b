//! Densities at values, tables beside reals, and numbers that differ by rounding.
//!
//! In: small programs. Out: answers of mixtures, conjugate priors, normal laws and sums, or refusals. Invariant: expected values are
//! integrals and sums in 40 digits (mpmath 1.3), or by hand, in the comments.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::prelude::Program;

fn tried(program: &str, text: &str) -> Result<Answer, Error> {
    let model = model_of(program);
    ask(&model, &question(&model, text), &Inputs::new()).map(|mut answers| answers.remove(0))
}

fn asked(program: &str, text: &str) -> Answer {
    tried(program, text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[track_caller]
fn near(answer: &Answer, expected: &[f64]) {
    let found: Vec<f64> = answer.answer.iter().map(|row| row.figure.number().unwrap()).collect();
    assert_eq!(found.len(), expected.len(), "{}: {found:?}", answer.question);
    let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= 1e-11 * q.abs().max(1e-3));
    assert!(all, "{}: {found:?}, expected {expected:?}", answer.question);
}

#[track_caller]
fn density(answer: &Answer, expected: f64) {
    assert!(matches!(answer.answer[0].figure, Figure::Density { .. }), "{:?}", answer.answer);
    near(answer, &[expected]);
}

const FINITE_AND_REAL: &str = "program Values { variables { X : 0..=2; Y, W : real; K : bool; }
    decomposition { P(X) P(K) P(W) P(Y | X W K) }
    forms { P(X) = categorical(0.2, 0.3, 0.5); P(K) = bernoulli(0.4); P(W) = normal(0, 1);
            P(Y | X W K) = normal(W + X + if K { 2 } else { 0 }, 1); } }";

#[test]
fn mixtures_have_densities_at_values() {
    // Σ P(x) P(k) N(w; 0, 1) N(y; w + x + 2k, 1) over the same sum without w fixed.
    density(&asked(FINITE_AND_REAL, "P(W = 0 | Y = 0)"), 0.382_193_792_858_955_6);
    density(&asked(FINITE_AND_REAL, "P(X = 0, W = 0 | Y = 0)"), 0.177_307_270_124_787_4);
    assert!(tried(FINITE_AND_REAL, "P(W = 0, K | Y = 0)").is_err());
}

#[test]
fn known_finite_variables_make_a_table_beside_reals() {
    // P(x | k, y) ∝ P(x) N(1; x + 2k, √2).
    let expected = [
        0.184_296_530_352_161_3,
        0.354_962_143_768_643_55,
        0.460_741_325_879_540_3,
        0.488_546_506_611_293_8,
        0.346_159_543_772_463_33,
        0.165_293_949_616_242_82,
    ];
    let found = asked(FINITE_AND_REAL, "P(X | K, Y = 1)");
    near(&found, &expected);
    assert_eq!(found.ln_evidence, None);
    let first = &found.answer[3].values;
    assert!(first.contains(&("K".to_owned(), "true".to_owned())), "{first:?}");
    near(&asked(FINITE_AND_REAL, "P(X = 1 | K, Y = 1)"), &[expected[1], expected[4]]);
}

#[test]
fn conjugate_posteriors_have_densities_at_values() {
    let counts = "program C { variables { R, N, T : real; B[0..=3] : bool; K : bool; M : real; }
        decomposition { P(R) P(T) P(N | R) prod(i in 0..=3) { P(B[i] | T) } P(K) P(M | R K) }
        forms { P(R) = gamma(2, 3); P(T) = beta(2, 3); P(N | R) = poisson(R); P(B[i] | T) = bernoulli(T);
                P(K) = bernoulli(0.5); P(M | R K) = poisson(if K { 2 * R } else { R }); } }";
    // gamma(5, 4) at 2: 4⁵ 2⁴ e⁻⁸ / 4!.
    density(&asked(counts, "P(R = 2 | N = 3)"), 4f64.powi(5) * 16.0 * (-8f64).exp() / 24.0);
    // beta(5, 4) at 0.3: 280 · 0.3⁴ 0.7³.
    density(&asked(counts, "P(T = 0.3 | B = [true, false, true, true])"), 280.0 * 0.0081 * 0.343);
    density(
        &asked(counts, "P(R = 2, T = 0.3 | N = 3, B = [true, false, true, true])"),
        4f64.powi(5) * 16.0 * (-8f64).exp() / 24.0 * 280.0 * 0.0081 * 0.343,
    );
    // Both values of K summed out: gamma(2, 3) times a Poisson probability, over its integral.
    density(&asked(counts, "P(R = 1 | M = 4)"), 0.828_790_779_637_850_1);
}

#[test]
fn precisions_have_densities_at_values() {
    let precision = "program Values { variables { Tau, M, Y : real; } decomposition { P(Tau) P(M | Tau) P(Y | M Tau) }
        forms { P(Tau) = gamma(2, 3); P(M | Tau) = normal(0, 2 / sqrt(Tau)); P(Y | M Tau) = normal(M, 1 / sqrt(Tau)); } }";
    // gamma(2.5, 3.4) at 1, and the integral of gamma(2.5, 3.4) N(1; 1.6, √(0.8 / τ)).
    density(&asked(precision, "P(Tau = 1 | Y = 2)"), 0.535_130_684_716_259_4);
    density(&asked(precision, "P(M = 1 | Y = 2)"), 0.300_283_955_600_130_6);
}

#[test]
fn vectors_of_a_linear_program_have_densities_at_values() {
    let vector =
        "program V { variables { M, Y : real; V : real[2]; } decomposition { P(M) P(Y | M) P(V | M) }
        forms { P(M) = normal(0, 1); P(Y | M) = normal(M, sqrt(2)); P(V | M) = normal([M, M], 1); } }";
    // ∫ N(m; 1/3, √(2/3)) N(1; m, 1) N(2; m, 1) dm.
    density(&asked(vector, "P(V = [1, 2] | Y = 1)"), 0.045_281_381_747_116_066);
}

#[test]
fn what_rounding_decides_is_refused_and_what_is_shared_is_not() {
    let far = "program F { variables { M : real; Y[0..=2] : real; U, Z : real; K : 0..=3; }
        decomposition { P(M) P(K) prod(i in 0..=2) { P(Y[i] | M K) } P(U) P(Z | U K) }
        forms { P(M) = normal(0, 1); P(K) = uniform; P(Y[i] | M K) = normal(M + K, 1);
                P(U) = normal(0, 1); P(Z | U K) = normal(U + K, 1); } }";
    let refused = tried(far, "P(K | Y = [1e7, -1e7, 0.3])").unwrap_err().to_string();
    assert!(refused.contains("rounding") && refused.contains("decides"), "{refused}");
    // ln P is below −f64::MAX, and no factor is 0.
    let refused = tried(far, "P(M | Y = [1e200, 0, 0])").unwrap_err().to_string();
    assert!(refused.contains("beyond the range of numbers"), "{refused}");
    // All on one side: K = 3 for sure.
    near(&asked(far, "P(K | Y = [1e7, 1e7, 1e7])"), &[0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn bounds_and_comparisons_of_a_question_allow_for_rounding() {
    let tenths = "program T { variables { J, K : 0..=9; X : 0..=9; B : bins(0, 1, 10); }
        decomposition { P(J) P(K) P(X | J) P(B) }
        forms { P(J) = uniform; P(K) = uniform; P(X | J) = truncated(uniform(0, 9), J * 0.1 * 10, 20); P(B) = uniform; } }";
    // 3 · 0.1 · 10 is 3: P(X = 3 | J) is 1 / (10 − J), for J up to 3.
    let weights: Vec<f64> = (0..10).map(|j| if j <= 3 { 1.0 / f64::from(10 - j) } else { 0.0 }).collect();
    let total: f64 = weights.iter().sum();
    near(&asked(tenths, "P(J | X = 3)"), &weights.iter().map(|weight| weight / total).collect::<Vec<f64>>());
    near(&asked(tenths, "P(K * 0.1 == 0.3)"), &[0.1]);
    near(&asked(tenths, "P(K * 0.1 > 0.3)"), &[0.6]);
    near(&asked(tenths, "P(K * 0.1 < 0.3)"), &[0.3]);
    near(&asked(tenths, "P(B == 0.35)"), &[0.1]);
}

#[test]
fn masses_of_bins_at_decimal_edges() {
    let edges = "program E { variables { X : bins(0, 1, 10); Y : bins(0, 10, 5); K : bool; Z : real; }
        decomposition { P(K) P(X | K) P(Y) P(Z | X) }
        forms { P(K) = bernoulli(0.5); P(X | K) = if K { normal(0.3, 1e-20) } else { truncated(normal(0.35, 0.2), 0.3, 0.6) };
                P(Y) = lognormal(1e17, 1); P(Z | X) = normal(X, 1); } }";
    // Half of a narrow normal law lies on each side of its mean.
    let half = [0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    near(&asked(edges, "P(X | K = true)"), &half);
    // Φ between the edges; nothing outside the bounds.
    let inside = [0.400_385_413_313_428_3, 0.354_252_106_023_156_1, 0.245_362_480_663_415_55];
    let all = [&[0.0; 3][..], &inside, &[0.0; 4]].concat();
    let found = asked(edges, "P(X | K = false)");
    near(&found, &all);
    assert_eq!(found.answer[2].figure.number(), Some(0.0));
    // ln Y is far above ln 10: the density of Y rises as Y to the power of 10¹⁷.
    near(&asked(edges, "P(Y)"), &[0.0, 0.0, 0.0, 0.0, 1.0]);
}

/// 3 · 0.1 · 10 − 5 is −2 up to rounding: of the truncated normal laws that begin at −4, −3 and −2, with masses Φ(5) − Φ(low), the
/// density at −2 is φ(2) over the mass.
#[test]
fn bounds_are_rounded_by_draws_too() {
    let text = "program Bounds { variables { J : 1..=3; Y : real; } decomposition { P(J) P(Y | J) }
        forms { P(J) = uniform; P(Y | J) = truncated(normal(0, 1), J * 0.1 * 10 - 5, 5); } }";
    let program = Program::parse(text).unwrap().by("weighting").unwrap().draws(20_000);
    let found = program.ask("P(J | Y = -2)").unwrap();
    // Φ(4), Φ(3) and Φ(2) (tables), less 1 − Φ(5) = 2.9e-7.
    let masses = [0.9999683287581669, 0.9986501019683699, 0.9772498680518208].map(|p: f64| p - 2.867e-7);
    let total: f64 = masses.iter().map(|mass| 1.0 / mass).sum();
    for (j, mass) in masses.iter().enumerate() {
        let [p, error] = found.p_and_error(j as i64 + 1).unwrap();
        let expected = 1.0 / mass / total;
        assert!((p - expected).abs() < 5.0 * error, "{j}: {p} ± {error}, expected {expected}");
    }
}

/// W is 1 or 5: no density of W and T together is stated where Y is known.
#[test]
fn a_determined_real_at_a_value_beside_others_is_refused() {
    let text = "program Determined { variables { K : bool; W, T, Y : real; }
        decomposition { P(K) P(W | K) P(T | W) P(Y | T) }
        forms { P(K) = bernoulli(0.3); P(W | K) = dirac(if K { 5 } else { 1 }); P(T | W) = normal(W, 0.5);
                P(Y | T) = normal(T, 1); } }";
    let error = Program::parse(text).unwrap().ask("P(T = 4, W = 5 | Y = 1)").unwrap_err().to_string();
    assert!(error.contains("has no exact answer"), "{error}");
}
