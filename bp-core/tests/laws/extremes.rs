//! Distributions at the ends of the range of f64, and without moments.
//!
//! In: programs of one real. Out: probabilities and moments. Invariant: expected values are computed by hand; estimates
//! are within five standard errors.

use bp_core::compiler::law::Law;
use bp_core::prelude::*;

fn program(form: &str) -> Program {
    let text = format!(
        "program One {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
    );
    Program::parse(&text).unwrap_or_else(|error| panic!("{form}: {error}"))
}

/// The deviation is 1e10, and the median differs from the rate by less than 1.
#[test]
fn a_huge_rate_is_drawn() {
    let poisson = program("poisson(1e20)");
    let half = poisson.ask("P(X > 1e20)").unwrap().p(true).unwrap();
    assert!((half - 0.5).abs() < 5.0 * 0.5 / 1e5f64.sqrt(), "{half}");
    let all = poisson.ask("P(X)").unwrap();
    assert!((all.mean().unwrap() / 1e20 - 1.0).abs() < 1e-11);
    assert!((all.deviation().unwrap() / 1e10 - 1.0).abs() < 0.02);
    let mode = poisson.ask("argmax P(X)").unwrap().to_string();
    assert!(!mode.contains("NaN"), "{mode}");
}

#[test]
fn a_uniform_distribution_may_be_wider_than_the_largest_number() {
    let bounds = [-1e308, 1e308];
    assert_eq!(Law::Uniform.tails(0.0, &bounds), (0.5, 0.5));
    assert_eq!(Law::Uniform.tails(1e308, &bounds), (1.0, 0.0));
    assert_eq!(Law::Uniform.between(-5e307, 5e307, &bounds), 0.5);
    // 2e308 / √12
    let deviation = 1e308 / 3f64.sqrt();
    assert!((Law::Uniform.deviation(&bounds) / deviation - 1.0).abs() < 1e-12);
    // ln 2e308
    let entropy = 2f64.ln() + 308.0 * 10f64.ln();
    assert!((Law::Uniform.entropy(&bounds) / entropy - 1.0).abs() < 1e-12);
    let half = program("uniform(-1e308, 1e308)").ask("P(X > 1)").unwrap().p(true).unwrap();
    assert!((half - 0.5).abs() < 5.0 * 0.5 / 1e5f64.sqrt(), "{half}");
    let mode = program("uniform(-1e308, 1e308)").ask("argmax P(X)").unwrap().to_string();
    assert!(!mode.contains("NaN") && !mode.contains("inf"), "{mode}");
}

/// √2.5 / 5e199, whose square is below the smallest number.
#[test]
fn a_deviation_whose_square_is_0_has_a_value() {
    let gamma = program("gamma(2.5, 5e199)").ask("P(X)").unwrap();
    let expected = 2.5f64.sqrt() / 5e199;
    assert!((gamma.deviation().unwrap() / expected - 1.0).abs() < 1e-12, "{gamma}");
    assert!(gamma.to_string().contains("3.16228e-200"), "{gamma}");
}

#[test]
fn an_infinite_variance_is_refused() {
    for form in ["student_t(1.5, 0, 1)", "student_t(1, 0, 1)", "cauchy(0, 1)", "half_cauchy(1)"] {
        let message = program(form).ask("variance P(X)").unwrap_err().to_string();
        assert!(message.contains("no finite variance") && message.contains(form), "{message}");
    }
    let known = program("student_t(5, 0, 1)").ask("variance P(X)").unwrap();
    // ν/(ν − 2)
    assert!((known.variance().unwrap() - 5.0 / 3.0).abs() < 0.2, "{known}");
}
