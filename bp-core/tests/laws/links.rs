//! Links of regressions, and counts with too many zeros.
//!
//! In: `bernoulli(logistic(x))`, `bernoulli(probit(x))`, `zero_inflated(p, f)`. Out: probabilities. Invariant: expected values are
//! those of mpmath, 50 digits.

use crate::support::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;

fn probabilities(domain: &str, form: &str, text: &str) -> Vec<f64> {
    let model = model_of(&format!(
        "program Link {{ variables {{ X : -40..=40; Y : {domain}; }} decomposition {{ P(X) P(Y | X) }}
         forms {{ P(X) = uniform; P(Y | X) = {form}; }} }}"
    ));
    let answers = ask(&model, &question(&model, text), &Inputs::new())
        .unwrap_or_else(|error| panic!("{form}: {error}"));
    answers[0].answer.iter().map(|row| row.p().unwrap()).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (p, q) in found.iter().zip(expected) {
        assert!((p - q).abs() <= 1e-14 * q, "{found:?}, expected {expected:?}");
    }
}

#[test]
fn both_probabilities_of_a_link_keep_their_digits() {
    // 1/(1 + e⁻ˣ) and Φ(x), each with that of −x.
    near(
        &probabilities("bool", "bernoulli(logistic(X / 2))", "P(Y | X = 5)"),
        &[0.07585818002124355, 0.9241418199787564],
    );
    near(&probabilities("bool", "bernoulli(logistic(X))", "P(Y | X = 40)"), &[4.248354255291589e-18, 1.0]);
    near(&probabilities("bool", "bernoulli(logistic(X))", "P(Y | X = -40)"), &[1.0, 4.248354255291589e-18]);
    near(
        &probabilities("bool", "bernoulli(probit(X / 2))", "P(Y | X = 5)"),
        &[0.006209665325776135, 0.9937903346742238],
    );
    near(&probabilities("bool", "bernoulli(probit(X))", "P(Y | X = 30)"), &[4.906713927148187e-198, 1.0]);
    // In an expression they are numbers.
    near(
        &probabilities("bool", "bernoulli(0.5 * logistic(X / 2))", "P(Y = true | X = 5)"),
        &[0.4620709099893782],
    );
    near(&probabilities("-9..=9", "dirac(floor(4 * probit(X)))", "P(Y = 2 | X = 0)"), &[1.0]);
}

#[test]
fn zero_is_more_frequent_where_it_is_inflated() {
    // 0.25 + 0.75 of the Poisson probabilities, which are normalised over 0..=6.
    let expected = [
        0.33372708548441654,
        0.18419958806571637,
        0.20261954687228803,
        0.14858766770634455,
        0.0817232172384895,
        0.03595821558493538,
        0.01318467904780964,
    ];
    near(&probabilities("0..=6", "zero_inflated(0.25, poisson(2.2))", "P(Y | X = 1)"), &expected);
}
