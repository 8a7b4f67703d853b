//! Flat priors in linear Gaussian programs.
//!
//! In: programs with a `flat` form. Out: posteriors, or the reason of a refusal. Invariant: expected values are computed by hand.

use crate::support::{model_of, near, question};
use bp_core::compiler::answer::{Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::prelude::Program;
use statrs::distribution::{Continuous, Normal};

/// Mean and deviation of each searched variable, and ln of the density of the observations.
fn posterior(text: &str, asked: &str) -> Result<(Vec<[f64; 2]>, f64), Error> {
    let model = model_of(text);
    let answer = ask(&model, &question(&model, asked), &Inputs::new())?.remove(0);
    let figure = |figure: &Figure| match figure {
        Figure::Normal { mean, deviation } => [*mean, *deviation],
        other => panic!("{other:?}"),
    };
    Ok((answer.answer.iter().map(|row| figure(&row.figure)).collect(), answer.ln_evidence.unwrap()))
}

#[test]
fn a_flat_variable_is_determined_by_the_observations() {
    let text = "program Scale { variables { X, A, B : real; } decomposition { P(X) P(A | X) P(B | X) }
        forms { P(X) = flat; P(A | X) = normal(X, 1); P(B | X) = normal(2 * X, 4); } }";
    // By hand: precisions 1 and 4/16, means 1 and 6/2; ∫ dx is N(6 − 2; 0, √20).
    let (found, ln) = posterior(text, "P(X | A = 1, B = 6)").unwrap();
    near(found[0][0], (1.0 + 0.25 * 3.0) / 1.25, 1e-14);
    near(found[0][1], 0.8f64.sqrt(), 1e-14);
    near(ln, Normal::new(0.0, 20f64.sqrt()).unwrap().ln_pdf(4.0), 1e-13);
    let (found, ln) = posterior(text, "P(X | B = 6)").unwrap();
    near(found[0][0], 3.0, 1e-14);
    near(found[0][1], 2.0, 1e-14);
    near(ln, -2f64.ln(), 1e-14);
    // Variables that it only predicts follow.
    let (found, _) = posterior(text, "P(B | A = 1)").unwrap();
    near(found[0][0], 2.0, 1e-14);
    near(found[0][1], 20f64.sqrt(), 1e-13);
}

const LINE: &str =
    "program Line { parameters { x[1..=3] : real = [0, 1, 2]; } variables { A, B : real; Y[1..=3] : real; }
    decomposition { P(A) P(B) prod(i) { P(Y[i] | A B) } }
    forms { P(A) = flat; P(B) = flat; P(Y[i] | A B) = normal(A + B * x[i], 1); } }";

#[test]
fn flat_coefficients_are_those_of_least_squares() {
    // x = 0, 1, 2 and y = 1, 2, 4: slope 1.5 with variance 1/2, intercept 5/6 with variance 1/3 + 1/2.
    let (found, _) = posterior(LINE, "P(A B | Y[1] = 1, Y[2] = 2, Y[3] = 4)").unwrap();
    near(found[0][0], 5.0 / 6.0, 1e-13);
    near(found[0][1], (5.0 / 6.0f64).sqrt(), 1e-13);
    near(found[1][0], 1.5, 1e-13);
    near(found[1][1], 0.5f64.sqrt(), 1e-13);
}

#[test]
fn a_flat_variable_that_the_data_leave_open_is_refused() {
    let refused = |text: &str, asked: &str, part: &str| {
        let error = posterior(text, asked).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    let open = "the posterior is improper: with 1 observed number, 1 direction of its `flat` variables is not determined";
    refused(LINE, "P(A B | Y[1] = 1)", open);
    // Three values at one x do not determine a line, however many there are.
    let same = LINE.replace("[0, 1, 2]", "[0.1, 0.1, 0.1]");
    refused(&same, "P(A B | Y[1] = 1, Y[2] = 2, Y[3] = 4)", "with 3 observed numbers, 1 direction");
    let alone = "program One { variables { X : real; } decomposition { P(X) } forms { P(X) = flat; } }";
    refused(alone, "P(X)", "with 0 observed numbers, 1 direction");
    // An outcome that no rate makes likelier than another does not bound it.
    let other = "program Cured { variables { X : real; T : bool; } decomposition { P(X) P(T | X) }
        forms { P(X) = flat; P(T | X) = bernoulli(logistic(X)); } }";
    refused(
        other,
        "P(X | T = true)",
        "the posterior is improper: the observations do not bound `X`, which is flat",
    );
    // Five points on a line leave no residual: the density of the deviation rises as S⁻³ towards 0.
    let line = LINE.replace("A, B : real", "A, B, S : real").replace("P(A) P(B)", "P(A) P(B) P(S)");
    let line = line.replace("| A B)", "| A B S)").replace("x[i], 1)", "x[i], S); P(S) = half_flat");
    let line = line.replace("1..=3", "1..=5").replace("[0, 1, 2]", "[1, 2, 3, 4, 5]");
    let points = "P(A B S | Y[1] = 3, Y[2] = 5, Y[3] = 7, Y[4] = 9, Y[5] = 11)";
    refused(&line, points, "the observations do not bound `S`");
}

#[test]
fn a_covariate_far_from_zero_determines_its_line() {
    // Least squares at o, o + 1, o + 2: the slope of 2, 3, 5 is 1.5 with the deviation √½, wherever the origin is.
    for origin in [0, 1_000_000, 100_000_000] {
        let (one, two) = (origin + 1, origin + 2);
        let text = format!(
            "program Line {{ parameters {{ x[1..=3] : real = [{origin}, {one}, {two}]; }} variables {{ A, B : real; Y[1..=3] : real; }}
             decomposition {{ P(A) P(B) prod(i) {{ P(Y[i] | A B) }} }}
             forms {{ P(A) = flat; P(B) = flat; P(Y[i] | A B) = normal(A + B * x[i], 1); }} }}"
        );
        let (found, _) = posterior(&text, "P(B | Y[1] = 2, Y[2] = 3, Y[3] = 5)").unwrap();
        near(found[0][0], 1.5, 1e-6);
        near(found[0][1], 0.5f64.sqrt(), 1e-6);
    }
}

/// P(3 | λ) = λ³/3! / Σ λᵏ/k! over 0..=9 falls as λ³ towards 0 and as λ⁻⁶ towards ∞: a proper posterior of ln λ, by quadrature.
#[test]
fn a_flat_variable_of_a_program_that_is_not_gaussian_is_sampled() {
    let rate = Program::parse(
        "program Rate { variables { X : real; N : 0..=9; } decomposition { P(X) P(N | X) }
         forms { P(X) = flat; P(N | X) = poisson(exp(X)); } }",
    );
    let found = rate.unwrap().draws(8000).ask("P(X | N = 3)").unwrap();
    assert_eq!((found.strategy().name(), found.warning()), ("gibbs", None));
    let [mean, error] = found.mean_and_error().unwrap();
    assert!((mean - 0.956_486_554_856_907).abs() < 4.0 * error, "{mean} ± {error}");
}

/// A flat variable that is observed keeps its value: Y[2] is N(50, 1) + the noise of its own scale, S is 1.
#[test]
fn an_observed_flat_variable_keeps_its_value_in_chains() {
    let program = Program::parse(
        "program Level {
            variables { A, S : real; Y[1..=3] : real; }
            decomposition { P(A) P(S) prod(i) { P(Y[i] | A S) } }
            forms { P(A) = flat; P(S) = half_normal(2); P(Y[i] | A S) = normal(A, S); }
        }",
    )
    .unwrap()
    .by("gibbs")
    .unwrap()
    .draws(4000);
    let found = program.ask("P(Y[1] | A = 50, S = 1)").unwrap();
    let mean = found.mean().unwrap();
    assert!((mean - 50.0).abs() < 0.1, "{mean}");
    // The density of S given |Y - A| = 1 is that of half_normal(2) times exp(-1/(2 S²)) / S, whose mean is 1.6447 by quadrature.
    let scale = program.ask("P(S | A = 1, Y[1] = 2)").unwrap().mean().unwrap();
    assert!((scale - 1.6447).abs() < 0.1, "{scale}");
}
