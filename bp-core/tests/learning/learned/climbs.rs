//! Steps of EM: the likelihood never decreases, and the estimates are valid.
//!
//! In: random tables of hidden mixtures over reals, integers, bins and circles. Out: the course of the iteration.
//! Invariant: seeded.

use crate::support::learning::{learned, program, seen, written};
use crate::support::model_of;
use bp_core::compiler::learn::Settings;
use proptest::prelude::*;

/// Domains, and the laws that are learned over them.
const LAWS: [(&str, &str, &str); 17] = [
    ("real", "normal", "reals"),
    ("real", "normal, unbiased", "reals"),
    ("real", "lognormal", "positive"),
    ("real", "gamma", "positive"),
    ("real", "weibull", "positive"),
    ("real", "exponential", "positive"),
    ("real", "laplace", "reals"),
    ("real", "student_t", "reals"),
    ("real", "half_cauchy", "positive"),
    ("0..=9", "negative_binomial", "counts"),
    ("0..=9", "geometric", "counts"),
    ("bins(0, 10, 5)", "student_t", "positive"),
    ("0..=9", "normal", "counts"),
    ("0..=9", "poisson", "counts"),
    ("0..=9", "poisson, gamma(2, 1)", "counts"),
    ("bins(0, 10, 5)", "gamma", "positive"),
    ("circle(0, 10, 20)", "von_mises", "positive"),
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(15), ..ProptestConfig::default() })]

    #[test]
    fn no_step_loses_likelihood_for_any_law(
        law in proptest::sample::select(LAWS.to_vec()),
        numbers in proptest::collection::vec((0u32..10, 0.0..1.0_f64), 8..30),
        seed in 0u64..1000,
        shown in 0usize..4,
    ) {
        let (domain, way, kind) = law;
        let text = program(
            &format!("K : {{ a, b, c }}; X : {domain}; Y : bool;"),
            "P(K) P(X | K) P(Y | K)",
            &format!("P(K) = unknown(histogram); P(X | K) = unknown({way}); P(Y | K) = unknown(dirichlet(0.5));"),
        );
        let mut table = "K,X,Y\n".to_owned();
        for (row, (whole, part)) in numbers.iter().enumerate() {
            // Many ties, so that components close in on them.
            let part = if *part < 0.5 { 0.25 } else { *part };
            let x = match kind {
                "counts" => whole.to_string(),
                "positive" => (f64::from(whole % 4) * 2.0 + part).to_string(),
                _ => (f64::from(whole % 3) * 5.0 - part).to_string(),
            };
            let k = if row % 9 < shown { ["a", "b", "c"][row % 3] } else { "" };
            table.push_str(&format!("{k},{x},{}\n", whole % 2));
        }
        let settings = Settings { seed, iterations: 400, ..Settings::default() };
        let found = seen(&text, &table).learned_with(&settings, &mut |_, _| {});
        // A law cannot be fitted to values that are all equal.
        let Ok(found) = found else { return Ok(()) };
        for pair in found.report.expectation.iter().flat_map(|course| course.trail.windows(2)) {
            prop_assert!(pair[1] >= pair[0] - 1e-12 * pair[0].abs().max(1.0), "{} {}: {:?}", domain, way, pair);
        }
        prop_assert!(found.report.ln_likelihood.is_finite());
        model_of(&written(&text, &found));
    }
}

#[test]
fn a_number_that_the_form_cannot_have_is_reported_with_its_context() {
    let text = program(
        "K : { a, b }; X : real;",
        "P(K) P(X | K)",
        "P(K) = uniform; P(X | K) = unknown(normal, unbiased);",
    );
    // The variance divided by one case less: twice the square of 1.7e308.
    let message = seen(&text, "K,X\na,1\na,2\nb,1.7e308\nb,-1.7e308\n").learned().unwrap_err().to_string();
    assert_eq!(
        message,
        "input `P(X | K), K = b`: the standard deviation of `normal` is learned as inf, but it must be greater than 0"
    );
    learned(&text, "K,X\na,1\na,2\nb,1e200\nb,-1e200\n");
}
