//! Mixtures of normal distributions, compared with closed forms worked out by hand.
//!
//! In: programs of finite variables and of reals that are linear and Gaussian given them. Out: exact answers. Invariant:
//! expected values come from products of normal densities of one or two dimensions, by a script that shares no code
//! with the crate, or from hand arithmetic.

use crate::support::{model_of, near, question};
use bp_core::compiler::answer::{Answer, Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::prelude::Program;

fn answer_with(model: &Model, text: &str, inputs: &Inputs<'_, f64>) -> Result<Answer, Error> {
    Ok(ask(model, &question(model, text), inputs)?.remove(0))
}

fn answer(model: &Model, text: &str) -> Answer {
    let answer = answer_with(model, text, &Inputs::new()).unwrap();
    assert_eq!(answer.strategy, Strategy::Mixture, "{text}");
    answer
}

/// Körding et al., *Causal inference in multisensory perception*, PLoS ONE 2(9):e943, 2007.
const CAUSAL: &str = "program Causal {
    variables { Common : bool; SA, T, SV, XA, XV : real; }
    decomposition { P(Common) P(SA) P(T) P(SV | Common SA T) P(XA | SA) P(XV | SV) }
    forms { P(Common) = bernoulli(0.28); P(SA) = normal(0, 12); P(T) = normal(0, 12);
            P(SV | Common SA T) = dirac(if Common { SA } else { T });
            P(XA | SA) = normal(SA, 9); P(XV | SV) = normal(SV, 2); } }";

#[test]
fn one_cause_or_two() {
    let model = model_of(CAUSAL);
    let cause = answer(&model, "P(Common | XA = 10, XV = 0)");
    near(cause.answer[1].p().unwrap(), 0.304_944_293_731_071_2, 1e-12);
    near(cause.ln_evidence.unwrap(), -7.231_496_409_863_388, 1e-12);
    let source = answer(&model, "P(SA | XA = 10, XV = 0)");
    let Figure::Mixture { mean, deviation, quantiles } = source.answer[0].figure else {
        panic!("{source:?}")
    };
    near(mean, 4.588_159_061_659_745, 1e-12);
    near(deviation, 6.681_800_611_276_015_5, 1e-12);
    let expected = [-4.284_954_424_509_877, 3.038_029_215_007_900_2, 16.922_929_054_687_156];
    quantiles.iter().zip(expected).for_each(|(found, expected)| near(*found, expected, 1e-9));
    let beyond = answer(&model, "P(SA > 5 | XA = 10, XV = 0)");
    near(beyond.answer[0].p().unwrap(), 0.403_917_856_376_738_27, 1e-12);
}

#[test]
fn unknown_means_of_two_groups() {
    let model = model_of(
        "program Means { variables { M[1..=2] : real; K[1..=8] : bool; X[i in 1..=8] : real; }
         decomposition { prod(j) { P(M[j]) } prod(i) { P(K[i]) } prod(i) { P(X[i] | K M) } }
         forms { P(M[j]) = normal(0, 10); P(K[i]) = bernoulli(0.5);
                 P(X[i] | K M) = normal(if K[i] { M[2] } else { M[1] }, 1); } }",
    );
    let inputs = Inputs::new().array("x", &[1.0, 2.0, 3.0, 4.0, 10.0, 11.0, 12.0, 13.0]);
    let means = answer_with(&model, "P(M | X = x)", &inputs).unwrap();
    assert_eq!(means.strategy, Strategy::Mixture);
    // Both labellings are as probable: 256 groupings, each two conjugate normals.
    for row in &means.answer {
        let Figure::Mixture { mean, deviation, .. } = row.figure else { panic!("{row:?}") };
        near(mean, 6.982_543_640_670_951, 1e-9);
        near(deviation, 4.516_470_411_631_706, 1e-9);
    }
    near(means.ln_evidence.unwrap(), -23.888_273_022_560_945, 1e-9);
}

#[test]
fn a_value_with_a_probability_outweighs_densities() {
    let model = model_of(
        "program Stuck { variables { Stuck : bool; X, Z : real; } decomposition { P(Stuck) P(X) P(Z | Stuck X) }
         forms { P(Stuck) = bernoulli(0.001); P(X) = normal(0, 1);
                 P(Z | Stuck X) = if Stuck { dirac(3) } else { normal(X, 1) }; } }",
    );
    // Z = 3 has the probability 0.001 if the sensor is stuck, and only a density else.
    near(answer(&model, "P(Stuck | Z = 3)").answer[1].p().unwrap(), 1.0, 0.0);
    near(answer(&model, "P(Stuck | Z = 2)").answer[1].p().unwrap(), 0.0, 0.0);
}

#[test]
fn a_large_constant_costs_no_digits() {
    // K is certain, and Z − 10⁹ = 1 = 0.1 X + noise: the gain is 100 · 0.1 / (0.01 · 100 + 1) = 5.
    let model = model_of(
        "program Far { variables { K : bool; X, Z : real; } decomposition { P(K) P(X) P(Z | K X) }
         forms { P(K) = bernoulli(0.5); P(X) = normal(0, 10);
                 P(Z | K X) = normal(0.1 * X + (if K { 1000000000 } else { -1000000000 }), 1); } }",
    );
    let found = answer(&model, "expectation P(X | Z = 1000000001)").answer[0].figure.number().unwrap();
    near(found, 5.0, 1e-12);
}

#[test]
fn reasons_of_refusal() {
    let model = model_of(
        "program Many { variables { K[1..=20] : bool; X, Z : real; } decomposition { prod(i) { P(K[i]) } P(X | K) P(Z | X) }
         forms { P(K[i]) = bernoulli(0.5); P(X | K) = normal(if K[1] { 1 } else { 2 }, 1); P(Z | X) = normal(X, 1); } }",
    );
    let by = bp_core::compiler::plan::Options {
        by: Some(Strategy::Mixture),
        ..bp_core::compiler::plan::Options::default()
    };
    let error = bp_core::compiler::plan::plan(&model, &question(&model, "P(X | Z = 1)"), by).unwrap_err();
    assert!(error.to_string().contains("1048576 combinations"), "{error}");
    let error = bp_core::compiler::plan::plan(&model, &question(&model, "entropy P(X Z)"), by).unwrap_err();
    assert!(error.to_string().contains("several reals together"), "{error}");
}

/// 0.7 N(0, 1) + 0.3 N(3, ½): entropy, largest density and mode in 40 digits (mpmath 1.3: `quad`, `findroot`).
#[test]
fn entropy_mode_and_draws_of_a_mixture() {
    let model = model_of(
        "program Two { variables { K : bool; X : real; } decomposition { P(K) P(X | K) }
         forms { P(K) = bernoulli(0.3); P(X | K) = normal(if K { 3 } else { 0 }, if K { 0.5 } else { 1 }); } }",
    );
    near(answer(&model, "entropy P(X)").answer[0].figure.number().unwrap(), 1.759_103_017_897_968_5, 1e-13);
    let mode = answer(&model, "argmax P(X)");
    near(mode.answer[0].values[0].1.parse().unwrap(), 1.566_515_065_274_981e-7, 1e-15);
    near(answer(&model, "max P(X)").answer[0].figure.number().unwrap(), 0.279259599926536, 1e-14);
    let draws: Vec<f64> =
        answer(&model, "draw(4000) P(X)").answer.iter().map(|row| row.values[0].1.parse().unwrap()).collect();
    // Mean 0.9, variance 0.7 + 0.3 · ¼ + 0.21 · 9; P(X > 2) = 0.7 Φ(−2) + 0.3 Φ(2).
    let mean = draws.iter().sum::<f64>() / 4000.0;
    near(mean, 0.9, 4.0 * (2.665f64 / 4000.0).sqrt());
    let above = draws.iter().filter(|x| **x > 2.0).count() as f64 / 4000.0;
    near(above, 0.7 * 0.022_750_131_948 + 0.3 * 0.977_249_868_052, 4.0 * (0.31f64 * 0.69 / 4000.0).sqrt());
}

/// The same asked together with its label: the entropy is that of the label and the mean of those of the components; the largest
/// product of probability and density is 0.7/√(2π), at 0.
#[test]
fn entropy_and_mode_of_a_label_and_a_real() {
    let model = model_of(
        "program Two { variables { K : bool; X, Y : real; } decomposition { P(K) P(X | K) P(Y | X) }
         forms { P(K) = bernoulli(0.3); P(X | K) = normal(if K { 3 } else { 0 }, if K { 0.5 } else { 1 });
                 P(Y | X) = normal(X, 2); } }",
    );
    let normal = |variance: f64| 0.5 * (std::f64::consts::TAU * variance).ln() + 0.5;
    let label = -0.7 * 0.7f64.ln() - 0.3 * 0.3f64.ln();
    let number = |text: &str| answer(&model, text).answer[0].figure.number().unwrap();
    near(number("entropy P(K, X)"), label + 0.7 * normal(1.0) + 0.3 * normal(0.25), 1e-13);
    // Of X and Y given K the determinant of the covariance is s² · 4.
    let both = label + 0.7 * (normal(1.0) + normal(4.0)) + 0.3 * (normal(0.25) + normal(4.0));
    near(number("entropy P(X, K, Y)"), both, 1e-13);
    let mode = answer(&model, "argmax P(X, K)");
    let named: Vec<(&str, &str)> =
        mode.answer[0].values.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
    assert_eq!(named, [("X", "0"), ("K", "false")]);
    near(number("max P(X, K)"), 0.7 / std::f64::consts::TAU.sqrt(), 1e-14);
    let draws = answer(&model, "draw(4000) P(K, X)");
    let far = |row: &&bp_core::compiler::answer::Row| row.values[0].1 == "true";
    let labelled: Vec<f64> =
        draws.answer.iter().filter(far).map(|row| row.values[1].1.parse().unwrap()).collect();
    near(labelled.len() as f64 / 4000.0, 0.3, 4.0 * (0.21f64 / 4000.0).sqrt());
    let mean = labelled.iter().sum::<f64>() / labelled.len() as f64;
    near(mean, 3.0, 4.0 * 0.5 / (labelled.len() as f64).sqrt());
}

#[test]
fn weights_sum_to_one_however_large_the_logarithm_of_the_evidence() {
    // X is observed: K decides nothing of Y = X + A + noise beyond it. A is uniform on 0..=3, so Y has the mean X + 1.5 and
    // the variance 1 + 15/12.
    let model = model_of(
        "program Far { variables { K : bool; A : 0..=3; X, Y : real; } decomposition { P(K) P(A) P(X | K) P(Y | X A) }
         forms { P(K) = bernoulli(0.35); P(A) = uniform; P(X | K) = normal(if K { 2 } else { -1 }, 1);
                 P(Y | X A) = normal(X + A, 1); } }",
    );
    for x in [1e3, 1e8, 1e9] {
        let found = answer(&model, &format!("P(Y | X = {x})"));
        let Figure::Mixture { mean, deviation, .. } = found.answer[0].figure else { panic!("{found:?}") };
        near(mean, x + 1.5, 1e-15 * x);
        near(deviation, 1.5, 1e-6);
        near(answer(&model, &format!("P(Y > 0 | X = {x})")).answer[0].p().unwrap(), 1.0, 1e-12);
    }
}

#[test]
fn a_quantile_at_a_value_of_positive_probability_is_that_value() {
    let model = model_of(
        "program Atom { variables { K : bool; X, Y : real; } decomposition { P(K) P(X) P(Y | K X) }
         forms { P(K) = bernoulli(0.5); P(X) = normal(0, 1); P(Y | K X) = if K { dirac(0) } else { dirac(X) }; } }",
    );
    // P(Y < 0) = 1/4 and P(Y ≤ 0) = 3/4.
    let found = answer(&model, "P(Y)");
    let Figure::Mixture { quantiles, .. } = found.answer[0].figure else { panic!("{found:?}") };
    assert_eq!(quantiles[1], 0.0);
}

#[test]
fn deviations_without_a_square_are_refused() {
    let model = model_of(
        "program Scale { parameters { s : real = 1; } variables { A : bool; X, Y : real; } decomposition { P(A) P(X | A) P(Y | X) }
         forms { P(A) = bernoulli(0.5); P(X | A) = normal(if A { 0 * s } else { 0 }, s); P(Y | X) = normal(X, s); } }",
    );
    for s in [1e160, 1e-160, 1e-170, 1e-200] {
        for text in ["P(X)", "quantile(0.975) P(X)", "P(X | Y = 1)", "P(A | Y = 0)"] {
            let error = answer_with(&model, text, &Inputs::new().number("s", s)).unwrap_err().to_string();
            assert!(error.contains("whose square is beyond the range of numbers"), "{s}, {text}: {error}");
        }
    }
    // By hand: Y is normal with the deviation s √2, and half of Y is the mean of X.
    for s in [1e-140, 1e140] {
        let inputs = Inputs::new().number("s", s);
        let found = answer_with(&model, "P(A | Y = 0)", &inputs).unwrap();
        near(found.ln_evidence.unwrap(), -s.ln() - 0.5 * (4.0 * std::f64::consts::PI).ln(), 1e-10);
        let found = answer_with(&model, "P(X)", &inputs).unwrap();
        let Figure::Mixture { mean, deviation, quantiles } = found.answer[0].figure else {
            panic!("{found:?}")
        };
        near(mean, 0.0, 0.0);
        near(deviation / s, 1.0, 1e-14);
        // Φ⁻¹(0.95), mpmath.
        near(quantiles[2] / s, 1.644_853_626_951_472_7, 1e-13);
    }
}

#[test]
fn densities_of_known_vectors_are_numbers() {
    // P(N | S) is S itself, and S does not depend on K.
    let shares = "program Shares {
        variables { S : real[3]; N : { Red, Green, Blue }; K : bool; }
        decomposition { P(K) P(S | K) P(N | S) }
        forms { P(K) = bernoulli(0.3); P(S | K) = dirichlet(0.5, 2, 3); P(N | S) = categorical(S); }
    }";
    let program = Program::parse(shares).unwrap();
    let found = program.ask("P(N | S = [0.2, 0.3, 0.5])").unwrap();
    assert!(found.estimate().is_none());
    for (value, expected) in [("Red", 0.2), ("Green", 0.3), ("Blue", 0.5)] {
        assert!((found.p(value).unwrap() - expected).abs() < 1e-14);
    }
    assert!((program.ask("P(K | S = [0.2, 0.3, 0.5])").unwrap().p(true).unwrap() - 0.3).abs() < 1e-14);
    for impossible in ["P(N | S = [0.2, 0.3, 0.4])", "P(K | S = [0.4, -0.1, 0.7])"] {
        let error = program.ask(impossible).unwrap_err().to_string();
        assert!(error.contains("probability zero"), "{error}");
    }
    // Sorted draws have the density 3! Π N(mᵢ; μ, 2): ln odds of K are ln (0.3 / 0.7) + Σ (mᵢ² − (mᵢ − 1)²) / 8 = ln (3 / 7) − 1/8.
    let sorted = "program Sorted {
        variables { M : real[3]; K : bool; }
        decomposition { P(K) P(M | K) }
        forms { P(K) = bernoulli(0.3); P(M | K) = ordered(normal(if K { 1 } else { 0 }, 2)); }
    }";
    let program = Program::parse(sorted).unwrap();
    let found = program.ask("P(K | M = [-1, 0, 2])").unwrap();
    let odds = (3.0f64 / 7.0).ln() - 1.0 / 8.0;
    assert!(found.estimate().is_none());
    assert!((found.p(true).unwrap() - 1.0 / (1.0 + (-odds).exp())).abs() < 1e-13);
    assert!(program.ask("P(K | M = [0, -1, 2])").unwrap_err().to_string().contains("probability zero"));
}
