//! Conjugate priors given finite variables that are summed out, and reals that are linear and Gaussian given known ones.
//!
//! In: programs with a change-point, a hidden class, a known precision. Out: exact posteriors. Invariant: expected values are sums
//! over all values, of closed forms that are written here.

use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{found}, expected {expected}");
}

/// ln n!
fn ln_factorial(n: usize) -> f64 {
    (1..=n).map(|k| (k as f64).ln()).sum()
}

/// A rate with the prior exponential(1): of n counts with the sum s, P = s! / ((1 + n)^(1 + s) Π yᵢ!), and the posterior is
/// gamma(1 + s, 1 + n).
fn ln_segment(counts: &[usize]) -> f64 {
    let sum: usize = counts.iter().sum();
    ln_factorial(sum) - (1 + sum) as f64 * (1.0 + counts.len() as f64).ln()
}

const COUNTS: [usize; 6] = [4, 5, 4, 1, 0, 1];

fn change(form: &str) -> Program {
    program(&format!(
        "program Change {{
            variables {{ Change : 1..=6; Early, Late : real; Count[year in 1..=6] : real; }}
            decomposition {{ P(Change) P(Early) P(Late) prod(year) {{ P(Count[year] | Change Early Late) }} }}
            forms {{ P(Change) = uniform; P(Early) = exponential(1); P(Late) = exponential(1);
                     P(Count[year] | Change Early Late) = {form}; }}
        }}"
    ))
}

/// The position of a change-point is summed out, the rates are integrated in closed form.
#[test]
fn the_position_of_a_change_is_exact() {
    let ln: Vec<f64> = (0..6).map(|c| ln_segment(&COUNTS[..c]) + ln_segment(&COUNTS[c..])).collect();
    let total: f64 = ln.iter().map(|ln| ln.exp()).sum();
    let weights: Vec<f64> = ln.iter().map(|ln| ln.exp() / total).collect();
    let before = |c: usize| COUNTS[..c].iter().sum::<usize>();
    let mean: f64 =
        weights.iter().enumerate().map(|(c, w)| w * (1.0 + before(c) as f64) / (1.0 + c as f64)).sum();
    // P(gamma(k, r) > x) = Σ_{j < k} e^{−r x} (r x)ʲ / j! of a whole k.
    let above = |shape: usize, rate: f64| -> f64 {
        (0..shape).map(|j| (j as f64 * (2.0 * rate).ln() - 2.0 * rate - ln_factorial(j)).exp()).sum()
    };
    let beyond: f64 = weights.iter().enumerate().map(|(c, w)| w * above(1 + before(c), 1.0 + c as f64)).sum();
    let factorials: f64 = COUNTS.iter().map(|count| ln_factorial(*count)).sum();
    let known = "Count = [4, 5, 4, 1, 0, 1]";
    for form in [
        "poisson(if year < Change { Early } else { Late })",
        "if year < Change { poisson(Early) } else { poisson(Late) }",
        "poisson(if Change > year { 1 * Early } else { Late / 1 })",
    ] {
        let program = change(form);
        let position = program.ask(&format!("P(Change | {known})")).unwrap();
        assert_eq!((position.strategy().name(), position.warning()), ("conjugate", None), "{form}");
        weights.iter().enumerate().for_each(|(c, w)| near(position.p(c as i64 + 1).unwrap(), *w));
        near(position.ln_evidence().unwrap(), (total / 6.0).ln() - factorials);
        let late = program.ask(&format!("P(Change > 2 | {known})")).unwrap();
        near(late.p(true).unwrap(), weights[2..].iter().sum());
        let early = program.ask(&format!("P(Early | {known})")).unwrap();
        assert_eq!(early.strategy().name(), "conjugate");
        near(early.mean().unwrap(), mean);
        let level = early.quantile(0.3).unwrap();
        let below = program.ask(&format!("P(Early > {level} | {known})")).unwrap();
        assert!((below.p(true).unwrap() - 0.7).abs() < 1e-9, "{level}");
        near(program.ask(&format!("P(Early > 2 | {known})")).unwrap().p(true).unwrap(), beyond);
        near(program.ask(&format!("expectation P(Early | {known})")).unwrap().number().unwrap(), mean);
    }
}

/// A coin is fair with probability 3/4, or its side is unknown: 9 of 10 have the probability 10/1024, or 1/11.
#[test]
fn a_hidden_class_mixes_named_distributions() {
    let text = "program Coin {
        variables { Fair : bool; Theta : real; Heads : 0..=10; }
        decomposition { P(Fair) P(Theta) P(Heads | Fair Theta) }
        forms { P(Fair) = bernoulli(0.75); P(Theta) = beta(1, 1);
                P(Heads | Fair Theta) = if Fair { binomial(10, 0.5) } else { binomial(10, Theta) }; }
    }";
    let (fair, other) = (0.75 * 10.0 / 1024.0, 0.25 / 11.0);
    let fair_share = fair / (fair + other);
    let posterior = program(text).ask("P(Fair | Heads = 9)").unwrap();
    near(posterior.p(true).unwrap(), fair_share);
    near(posterior.ln_evidence().unwrap(), (fair + other).ln());
    let theta = program(text).ask("P(Theta | Heads = 9)").unwrap();
    assert_eq!(theta.strategy().name(), "conjugate");
    // beta(1, 1) or beta(10, 2).
    near(theta.mean().unwrap(), fair_share * 0.5 + (1.0 - fair_share) * 10.0 / 12.0);
    let square = fair_share / 3.0 + (1.0 - fair_share) * 110.0 / 156.0;
    near(theta.variance().unwrap(), square - theta.mean().unwrap().powi(2));
    // The density at one half: 1, or 110 x⁹ (1 − x).
    near(theta.p(0.5).unwrap(), fair_share + (1.0 - fair_share) * 110.0 / 1024.0);
}

/// What a likelihood says of a rate is no conjugate prior: it is not left out. E A and P(A > 1) of gamma(2, 1), by hand:
/// P(A > 1) = 2/e, E[A; A > 1] = 5/e.
#[test]
fn a_likelihood_of_a_predicate_is_not_forgotten() {
    let text = "program Rate {
        variables { K : bool; A : real; N : 0..=9; }
        decomposition { P(K) P(A) P(N | K) }
        forms { P(K) = bernoulli(0.5); P(A) = gamma(2, 1); P(N | K) = binomial(9, if K { 0.2 } else { 0.5 }); }
    }";
    let asked = program(text).draws(20_000).ask("P(A | (A > 1) virtual [1, 3], N = 3)").unwrap();
    let above = 2.0 / std::f64::consts::E;
    let expected = (2.0 + 2.0 * 5.0 / std::f64::consts::E) / (1.0 + 2.0 * above);
    let [mean, error] = asked.mean_and_error().unwrap();
    assert!(error < 0.02 && (mean - expected).abs() < 4.0 * error, "{mean} ± {error}, expected {expected}");
}

/// A known precision is a number: the posterior precision of X is 1 + 4.
#[test]
fn a_known_precision_is_exact() {
    let text = "program Known {
        variables { Tau, X, Y : real; }
        decomposition { P(Tau) P(X) P(Y | X Tau) }
        forms { P(Tau) = gamma(2, 2); P(X) = normal(0, 1); P(Y | X Tau) = normal(X, 1 / sqrt(Tau)); }
    }";
    let posterior = program(text).ask("P(X | Tau = 4, Y = 1)").unwrap();
    assert_eq!((posterior.strategy().name(), posterior.warning()), ("mixture", None));
    near(posterior.mean().unwrap(), 0.8);
    near(posterior.variance().unwrap(), 0.2);
    // gamma(2, 2) at 4 is 16 e⁻⁸; Y has the variance 5/4.
    let normal = -0.5 * (1.0 / 1.25 + 1.25f64.ln() + std::f64::consts::TAU.ln());
    near(posterior.ln_evidence().unwrap(), 16f64.ln() - 8.0 + normal);
}

/// A known slope, which multiplies a hidden real: Z = 2 X + noise.
#[test]
fn a_known_slope_is_exact() {
    let text = "program Slope {
        variables { A, X, Z : real; }
        decomposition { P(A) P(X) P(Z | A X) }
        forms { P(A) = normal(1, 1); P(X) = normal(0, 1); P(Z | A X) = normal(A * X, 1); }
    }";
    let posterior = program(text).ask("P(X | A = 2, Z = 3)").unwrap();
    near(posterior.mean().unwrap(), 1.2);
    near(posterior.variance().unwrap(), 0.2);
    // A at 2 has z = 1, and Z the variance 5.
    let ln_a = -0.5 * (1.0 + std::f64::consts::TAU.ln());
    let ln_z = -0.5 * (9.0 / 5.0 + 5f64.ln() + std::f64::consts::TAU.ln());
    near(posterior.ln_evidence().unwrap(), ln_a + ln_z);
}

/// A finite variable that depends on a known real, and on which a hidden one depends.
#[test]
fn a_finite_child_of_a_known_real_is_exact() {
    let text = "program Child {
        variables { A, X : real; K : bool; }
        decomposition { P(A) P(K | A) P(X | K) }
        forms { P(A) = half_cauchy(1); P(K | A) = bernoulli(logistic(A)); P(X | K) = normal(if K { 1 } else { -1 }, 1); }
    }";
    let p = 1.0 / (1.0 + (-0.5f64).exp());
    let posterior = program(text).ask("P(X | A = 0.5)").unwrap();
    assert_eq!(posterior.strategy().name(), "mixture");
    near(posterior.mean().unwrap(), 2.0 * p - 1.0);
    near(posterior.variance().unwrap(), 1.0 + 4.0 * p * (1.0 - p));
    near(posterior.ln_evidence().unwrap(), (2.0 / (std::f64::consts::PI * 1.25)).ln());
}
