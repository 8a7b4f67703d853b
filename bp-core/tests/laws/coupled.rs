//! Forms that distribute the components of a vector together: `multinomial` and `ordered`.
//!
//! In: programs with a vector. Out: probabilities of the observations, and estimates. Invariant: expected values are
//! those of mpmath, 50 digits, or of the literature.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask_with, compile_by};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;

const URN: &str = "program Urn { parameters { n : real = 4; } variables { Share, Counts : real[3]; Next : { Red, Green, Blue }; }
    decomposition { P(Share) P(Counts | Share) P(Next | Share) }
    forms { P(Share) = dirichlet(2, 1, 0.5); P(Counts | Share) = multinomial(n, Share);
            P(Next | Share) = categorical(Share); } }";

fn answered(model: &Model, text: &str, by: Option<Strategy>) -> Result<Answer, Error> {
    given(model, text, &[], by)
}

/// The answer where `x` is given.
fn given(model: &Model, text: &str, x: &[f64], by: Option<Strategy>) -> Result<Answer, Error> {
    let compiled = compile_by(model, &question(model, text), by)?;
    let inputs = if x.is_empty() { Inputs::new() } else { Inputs::new().array("x", x) };
    let answers = compiled.ask_with(&inputs, Sampling { particles: 40_000, seed: 1 })?;
    Ok(answers.into_iter().next().unwrap())
}

/// The mean of each searched real, with its error; the probability of each value of a finite one.
fn means(answers: &Answer) -> Vec<[f64; 2]> {
    let figure = |figure: &Figure| match figure {
        Figure::Real { mean, .. } => *mean,
        Figure::Estimated { p, error } => [*p, *error],
        other => panic!("{other:?}"),
    };
    answers.answer.iter().map(|row| figure(&row.figure)).collect()
}

fn probability(answer: &Answer, row: usize) -> f64 {
    match answer.answer[row].figure {
        Figure::Estimated { p, .. } => p,
        _ => answer.answer[row].p().unwrap(),
    }
}

#[track_caller]
fn near(found: &[[f64; 2]], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ([found, error], expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 4.0 * error, "{found} ± {error}, expected {expected}");
    }
}

#[test]
fn counts_of_a_multinomial_are_added_to_the_parameters_of_their_dirichlet() {
    let model = model_of(URN);
    // dirichlet(5, 1, 1.5), of which the next is drawn too.
    for by in [Strategy::Weighting, Strategy::Gibbs] {
        let found = given(&model, "P(Share | Counts = x)", &[3.0, 0.0, 1.0], Some(by)).unwrap();
        near(&means(&found), &[5.0 / 7.5, 1.0 / 7.5, 1.5 / 7.5]);
        let found = given(&model, "P(Next | Counts = x)", &[3.0, 0.0, 1.0], Some(by)).unwrap();
        near(&means(&found), &[5.0 / 7.5, 1.0 / 7.5, 1.5 / 7.5]);
    }
}

#[test]
fn a_multinomial_is_the_product_of_its_binomials() {
    // mpmath: 10! / (1! 4! 5!) 0.2 0.3⁴ 0.5⁵ = 0.0637875.
    let model = model_of(
        "program Urn { variables { K : bool; X : real[3]; } decomposition { P(K) P(X | K) }
         forms { P(K) = bernoulli(0.5);
                 P(X | K) = if K { multinomial(10, 0.2, 0.3, 0.5) } else { multinomial(10, 0.5, 0.5, 0) }; } }",
    );
    let found = given(&model, "P(K | X = x)", &[1.0, 4.0, 5.0], None).unwrap();
    assert!((probability(&found, 1) - 1.0).abs() < 1e-12, "the third of the other has probability 0");
    for impossible in [[1.0, 4.0, 6.0], [1.0, 4.5, 4.5], [-1.0, 6.0, 5.0], [11.0, 0.0, -1.0]] {
        let found = given(&model, "P(K | X = x)", &impossible, None);
        assert!(found.is_err(), "{impossible:?}");
    }
    // Drawn, each count is binomial: E = n p.
    let drawn = answered(&model, "P(X | K = true)", Some(Strategy::Weighting)).unwrap();
    near(&means(&drawn), &[2.0, 3.0, 5.0]);
}

#[test]
fn components_are_ordered() {
    let model = model_of(
        "program Two { variables { Mu : real[2]; K : bool; Y : real; } decomposition { P(Mu) P(K) P(Y | Mu K) }
         forms { P(Mu) = ordered(normal(0, 2)); P(K) = bernoulli(0.5);
                 P(Y | Mu K) = normal(if K { Mu[1] } else { Mu[0] }, 1); } }",
    );
    // The smaller and the larger of two normal draws: ∓ s / √π.
    let end = 2.0 / std::f64::consts::PI.sqrt();
    near(&means(&answered(&model, "P(Mu)", Some(Strategy::Weighting)).unwrap()), &[-end, end]);
    // mpmath, quadrature over both means.
    for by in [Strategy::Weighting, Strategy::Gibbs] {
        let found = answered(&model, "P(Mu | Y = 3)", Some(by)).unwrap();
        near(&means(&found), &[-0.151696032811, 2.55169650933]);
    }
    let three = model_of(
        "program Three { variables { X : real[3]; } decomposition { P(X) } forms { P(X) = ordered(uniform(0, 1)); } }",
    );
    // The i-th of n uniform draws: i / (n + 1).
    near(&means(&answered(&three, "P(X)", None).unwrap()), &[0.25, 0.5, 0.75]);
}

#[test]
fn their_numbers_are_checked() {
    let refused = |text: &str, asked: &str, parts: [&str; 2]| {
        let model = model_of(text);
        let inputs = Inputs::new().array("x", &[1.0, 1.0, 1.0]);
        let found = ask_with(&model, &question(&model, asked), &inputs, Sampling::default());
        let error = found.unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    let trials = [
        "`P(Counts | Share) = multinomial(n, ",
        "the number of trials is 2.5, but it must be a whole number",
    ];
    refused(&URN.replace("= 4;", "= 2.5;"), "P(Share | Counts = x)", trials);
    refused(
        "program Two { variables { S : 0..=2; Mu : real[2]; } decomposition { P(S) P(Mu | S) }
         forms { P(S) = uniform; P(Mu | S) = ordered(normal(0, S)); } }",
        "P(Mu)",
        [
            "`P(Mu | S) = … normal(0, S)`, where S = 0",
            "the standard deviation is 0, but it must be greater than 0",
        ],
    );
    refused(
        "program Urn { parameters { p : real = 0.5; } variables { X : real[2]; } decomposition { P(X) }
         forms { P(X) = multinomial(3, p, p + 0.25); } }",
        "P(X)",
        ["`P(X) = multinomial(3, p, p + 0.25)`", "the sum of the probabilities is 1.25, but it must be 1"],
    );
    let model = model_of(URN);
    // Given Next = Red the shares are dirichlet(3, 1, 0.5), with the means 2/3, 2/9 and 1/9.
    let gibbs = answered(&model, "P(Counts | Next = Red)", Some(Strategy::Gibbs)).unwrap();
    for (row, share) in gibbs.answer.iter().zip([6.0, 2.0, 1.0]) {
        let Figure::Real { mean: [mean, error], .. } = &row.figure else { panic!("{row:?}") };
        assert!((mean - 4.0 * share / 9.0).abs() < 5.0 * error, "{row:?}");
    }
}

#[test]
fn a_vector_that_does_not_matter_refuses_nothing() {
    let model = model_of(
        "program Apart { variables { K : bool; Theta : real[2]; } decomposition { P(K) P(Theta) }
         forms { P(K) = bernoulli(0.3); P(Theta) = dirichlet(1, 1); } }",
    );
    assert!((probability(&answered(&model, "P(K)", None).unwrap(), 1) - 0.3).abs() < 1e-15);
}
