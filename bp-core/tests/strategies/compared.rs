//! Predicates that compare a real with what a mixture fixes, and predicates of counts.
//!
//! In: programs as texts. Out: probabilities. Invariant: expected values are sums of tails of the normal distribution, and of
//! probabilities of counts, worked out in the comments.

use bp_core::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn all(program: &Program, expected: &[(&str, f64)]) {
    for (question, expected) in expected {
        let found = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
        assert!(found.strategy().is_exact(), "{question}");
        let found = found.p(true).unwrap();
        assert!((found - expected).abs() < 1e-9, "{question}: {found}, expected {expected}");
    }
}

/// Φ, to about 1e−10.
fn phi(x: f64) -> f64 {
    Normal::new(0.0, 1.0).unwrap().cdf(x)
}

#[test]
fn a_real_is_compared_with_finite_variables() {
    let one = program(
        "program One {
            variables { D : 1..=2; T : real; }
            decomposition { P(D) P(T | D) }
            forms { P(D) = uniform; P(T | D) = normal(3, 1); }
        }",
    );
    let half = |a: f64, b: f64| 0.5 * (phi(a) + phi(b));
    all(
        &one,
        &[
            ("P(T > D)", half(2.0, 1.0)),
            ("P(T > 2 * D)", half(1.0, -1.0)),
            ("P(T - 2 * D > 0)", half(1.0, -1.0)),
            ("P(T + D > 4)", half(0.0, 1.0)),
            ("P(T < D)", half(-2.0, -1.0)),
            ("P(T > D + 1)", half(1.0, 0.0)),
            ("P(T > 2 * D | D = 2)", phi(-1.0)),
        ],
    );
    let follows = program(
        "program Follows {
            variables { D : bins(0, 4, 2); T : real; }
            decomposition { P(D) P(T | D) }
            forms { P(D) = uniform; P(T | D) = normal(D, 1); }
        }",
    );
    all(&follows, &[("P(T > D)", 0.5), ("P(T > D + 1)", phi(-1.0))]);
}

#[test]
fn a_real_is_compared_with_a_known_real() {
    let text = "program Two {
        variables { R, T : real; }
        decomposition { P(R) P(T) }
        forms { P(R) = gamma(2, 1); P(T) = normal(3, 1); }
    }";
    all(&program(text), &[("P(T > R | R = 2.5)", phi(0.5)), ("P(2 * R < T | R = 2.5)", phi(-2.0))]);
}

/// A predicate of a real together with a finite variable, and soft evidence on that variable: 0.4 P(U > 5 | B = 0) + 0.6 P(U > 5 | B = 1),
/// with U of mean 6 and variance 8, or of mean 3 and variance 5.
#[test]
fn a_predicate_is_asked_together_with_finite_variables() {
    let text = "program Soft {
        variables { T, U : real; B : bool; }
        decomposition { P(T) P(B) P(U | T B) }
        forms { P(T) = normal(3, 1); P(B) = bernoulli(0.3); P(U | T B) = normal(if B { T } else { 2 * T }, 2); }
    }";
    let soft = program(text).ask("P(U > 5 | B soft [0.4, 0.6])").unwrap();
    assert!(soft.strategy().is_exact());
    let [off, on] = [phi(1.0 / 8f64.sqrt()), phi(-2.0 / 5f64.sqrt())];
    let found = soft.p(true).unwrap();
    assert!((found - (0.4 * off + 0.6 * on)).abs() < 1e-9, "{found}");
    let joint = program(text).ask("P(U > 5, B = true)").unwrap().number().unwrap();
    assert!((joint - 0.3 * on).abs() < 1e-9, "{joint}");
    let error = program(text).by("weighting").unwrap().ask("P(U > 5 | B soft [0.4, 0.6])").unwrap_err();
    assert!(!error.to_string().contains("it has an exact answer"), "{error}");
}

/// T is K with probability ½, else it is normal: P(T ≥ K) = ½ + ½ Σ Φ(−k) / 10.
#[test]
fn determined_reals_are_compared_with_finite_variables() {
    let text = "program Points {
        variables { K : 0..=9; B : bool; Y, T : real; }
        decomposition { P(K) P(B) P(Y | K) P(T | K B) }
        forms {
            P(K) = uniform;
            P(B) = bernoulli(0.5);
            P(Y | K) = dirac(0.1 * K);
            P(T | K B) = if B { dirac(K) } else { normal(0, 1) };
        }
    }";
    let above = (0..10).map(|k| phi(-f64::from(k))).sum::<f64>() / 10.0;
    all(
        &program(text),
        &[
            ("P(Y == 0.1 * K)", 1.0),
            ("P(Y > 0.1 * K)", 0.0),
            ("P(T == K)", 0.5),
            ("P(T >= K)", 0.5 + 0.5 * above),
        ],
    );
}

#[test]
fn the_values_of_a_count_have_probabilities() {
    let of = |form: &str| {
        program(&format!(
            "program Count {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
        ))
    };
    // e⁻² 2ˣ / x!
    let poisson = [1.0, 2.0, 2.0, 4.0 / 3.0].map(|p| p * (-2.0f64).exp());
    let below = poisson[0] + poisson[1] + poisson[2];
    all(
        &of("poisson(2)"),
        &[
            ("P(X == 3)", poisson[3]),
            ("P(X != 3)", 1.0 - poisson[3]),
            ("P(X < 3)", below),
            ("P(X <= 2.5)", below),
            ("P(X >= 3)", 1.0 - below),
            ("P(X > 3)", 1.0 - below - poisson[3]),
            ("P(X == 3 or X == 1)", poisson[3] + poisson[1]),
            ("P(0.1 * X == 0.3)", poisson[3]),
            ("P(1 - X == -2)", poisson[3]),
            ("P(-X <= -3)", 1.0 - below),
            ("P(X == 2.5)", 0.0),
            ("P(X < 0)", 0.0),
        ],
    );
    all(&of("geometric(1)"), &[("P(X == 0)", 1.0), ("P(X > 0)", 0.0)]);
    all(&of("geometric(0.25)"), &[("P(X == 2)", 0.140625), ("P(X >= 2)", 0.5625)]);
    all(&of("binomial(4, 0.5)"), &[("P(X >= 0)", 1.0), ("P(X < 1)", 0.0625), ("P(X == 4)", 0.0625)]);
    all(&of("negative_binomial(2, 0.5)"), &[("P(X == 1)", 0.25), ("P(X <= 1)", 0.5)]);
}

/// Of the component K = true the mass from 2 to 3 is 10/16: its density at 2 is 16/10 that of the other.
#[test]
fn a_truncated_count_has_the_probability_of_its_lower_bound() {
    let text = "program Truncated {
        variables { K : bool; Y : real; }
        decomposition { P(K) P(Y | K) }
        forms {
            P(K) = bernoulli(0.5);
            P(Y | K) = if K { truncated(binomial(4, 0.5), 2, 3) } else { binomial(4, 0.5) };
        }
    }";
    let found = program(text).by("weighting").unwrap().ask("P(K = true | Y = 2)").unwrap();
    let (p, error) = (found.number().unwrap(), 0.01);
    assert!((p - 16.0 / 26.0).abs() < error, "{p}");
}

/// Counts without zeros: the mean rate is 1.99057, by quadrature of l e⁻ˡ Π lʸ e⁻ˡ / (1 − e⁻ˡ) (mpmath, 30 digits).
#[test]
fn zero_truncated_counts_have_their_density() {
    let text = "program Nonzero {
        variables { L : real; Y[1..=3] : real; }
        decomposition { P(L) prod(i) { P(Y[i] | L) } }
        forms { P(L) = gamma(2, 1); P(Y[i] | L) = truncated(poisson(L), 1, 1000); }
    }";
    let found = program(text).ask("P(L | Y = [2, 1, 4])").unwrap().mean().unwrap();
    assert!((found - MEAN).abs() < 0.03, "{found}");
}

const MEAN: f64 = 1.990_57;
