//! Digits that large counts, small probabilities and narrow ends must not cost.
//!
//! In: programs as texts. Out: probabilities and ln P(evidence). Invariant: expected values are closed forms, or have 50 digits
//! (mpmath 1.3).

use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, expected {expected}");
}

/// With n trials and c = n/2: 1/(n + 1) under beta(1, 1), 2 (c + 1)/((n + 1)(n + 2)) under beta(2, 1), which is the same.
#[test]
fn counts_of_a_thousand_million_trials() {
    let text = "program Trials {
        variables { T, U : real; K : bool; C : real; }
        decomposition { P(T) P(U) P(K) P(C | T U K) }
        forms {
            P(K) = bernoulli(0.5);
            P(T) = beta(1, 1);
            P(U) = beta(2, 1);
            P(C | T U K) = if K { binomial(1000000000, T) } else { binomial(1000000000, U) };
        }
    }";
    let found = program(text).ask("P(K = true | C = 500000000)").unwrap();
    near(found.number().unwrap(), 0.5, 1e-14);
    near(found.ln_evidence().unwrap(), -(1e9f64 + 1.0).ln(), 1e-14);
}

#[test]
fn ln_evidence_of_large_counts() {
    let rate = "program Rate {
        variables { L, C : real; }
        decomposition { P(L) P(C | L) }
        forms { P(L) = gamma(500000000, 1); P(C | L) = poisson(L); }
    }";
    let found = program(rate).ask("P(L | C = 500001000)").unwrap();
    near(found.ln_evidence().unwrap(), -11.281_072_951_426_629, 1e-14);
    let three = "program Three {
        variables { T, A, B, C : real; }
        decomposition { P(T) P(A | T) P(B | T) P(C | T) }
        forms {
            P(T) = beta(2, 3);
            P(A | T) = binomial(1000000, T);
            P(B | T) = binomial(2000000, T);
            P(C | T) = binomial(500000, T);
        }
    }";
    let found = program(three).ask("P(T | A = 300000, B = 600900, C = 149000)").unwrap();
    near(found.ln_evidence().unwrap(), -33.690_786_411_630_86, 1e-13);
    let shares = "program Shares {
        variables { S, V : real[3]; }
        decomposition { P(S) P(V | S) }
        forms { P(S) = dirichlet(1, 2, 3); P(V | S) = multinomial(600010000, S); }
    }";
    let found = program(shares).ask("P(S | V = [100000000, 200000000, 300010000])").unwrap();
    near(found.ln_evidence().unwrap(), -38.815_459_191_009_97, 1e-13);
}

/// P(E | A, not B) = p, and P(A | E) = (p + p + q − pq) / (2 (p + q) − pq).
#[test]
fn a_noisy_or_of_small_probabilities() {
    let of = |p: &str, q: &str| {
        program(&format!(
            "program Causes {{ variables {{ A, B, E : bool; }} decomposition {{ P(A) P(B) P(E | A B) }}
             forms {{ P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(E | A B) = noisy_or({p}, {q}); }} }}"
        ))
    };
    let both = of("1e-12", "3e-12");
    near(both.ask("P(E = true | A = true, B = false)").unwrap().number().unwrap(), 1e-12, 1e-15);
    near(both.ask("P(A = true | E = true)").unwrap().number().unwrap(), 0.625, 1e-12);
    let one = of("1e-17", "0");
    near(one.ask("P(A = true | E = true)").unwrap().number().unwrap(), 1.0, 1e-15);
    let leak = "program Leak { variables { A, E : bool; } decomposition { P(A) P(E | A) }
        forms { P(A) = bernoulli(0.5); P(E | A) = noisy_or(0.5, 1e-10); } }";
    near(program(leak).ask("P(E = true | A = false)").unwrap().number().unwrap(), 1e-10, 1e-15);
}

/// Masses by symmetry, or by mpmath's `betainc`.
#[test]
fn masses_of_a_beta_distribution_whose_ends_are_high() {
    let of = |domain: &str, form: &str| {
        program(&format!(
            "program One {{ variables {{ X : {domain}; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
        ))
    };
    for form in ["beta(0.01, 0.01)", "beta(0.5, 0.5)", "beta(3, 3)", "beta(1e-5, 1e-5)", "beta(1e4, 1e4)"] {
        let halves = of("bins(0, 1, 2)", form).ask("P(X)").unwrap();
        let found: Vec<f64> = halves.answer().answer.iter().map(|row| row.p().unwrap()).collect();
        near(found[0], 0.5, 1e-13);
        near(found[1], 0.5, 1e-13);
    }
    let parts = of("bins[0, 0.6, 1]", "beta(0.3, 0.2)").ask("P(X)").unwrap();
    let first = parts.answer().answer.iter().next().and_then(|row| row.p()).unwrap();
    near(first, 0.431_422_263_574_565_13, 1e-13);
    let density = of("real", "truncated(beta(0.01, 0.01), 0.5, 1)").ask("P(X = 0.75)").unwrap();
    near(density.number().unwrap(), 0.052_456_480_805_037_1, 1e-12);
}

/// p (1 − p)ˣ with p = 1 is 0 at every value above 0.
#[test]
fn certain_success_leaves_no_failures() {
    let text = "program Failures {
        variables { X : 290..=305; } decomposition { P(X) } forms { P(X) = geometric(1); }
    }";
    let error = program(text).ask("P(X)").unwrap_err().to_string();
    assert!(error.contains("is 0 for every value"), "{error}");
}

/// 1 − p of the numbers that f64 holds, to 50 digits; Φ(−9) and 1e-20.
#[test]
fn small_probabilities_of_false() {
    let of = |form: &str| {
        program(&format!(
            "program Causes {{ parameters {{ p : probability = 0.999999999999; q : probability = 0.9999999999; }}
             variables {{ A, B, X, Z : bool; }} decomposition {{ P(A) P(B) P(X | A B) P(Z) }}
             forms {{ P(A) = bernoulli(0.5); P(B) = bernoulli(0.5); P(X | A B) = {form}; P(Z) = bernoulli(0.5); }} }}"
        ))
    };
    let is_false = |form: &str, given: &str, expected: f64| {
        for strategy in ["sums", "join_tree"] {
            let found = of(form).by(strategy).unwrap().ask(&format!("P(X = false | {given})")).unwrap();
            near(found.number().unwrap(), expected, 1e-14);
        }
        let drawn = of(form).by("weighting").unwrap().ask(&format!("P(Z | X = false, {given})")).unwrap();
        near(drawn.ln_evidence().unwrap(), (expected / 4.0).ln(), 1e-13);
    };
    is_false("noisy_and(1e-12, 2e-12)", "A = false, B = false", 2.999_999_999_998e-12);
    is_false("noisy_or(p, q)", "A = true, B = true", 9.999_779_610_184_191e-23);
    is_false("noisy_or(1 - 1e-20, 0.5)", "A = true, B = false", 1e-20);
    is_false("bernoulli(p * q)", "A = true, B = true", 1.009_999_861_522_169_8e-10);
    let branches = "bernoulli(if A { probit(9) } else { 1 - 1e-20 })";
    is_false(branches, "A = true, B = true", 1.128_588_405_953_840_6e-19);
    is_false(branches, "A = false, B = true", 1e-20);
    let after = of(branches).ask("P(A = true | X = false)").unwrap();
    near(after.number().unwrap(), 0.918_605_775_933_264_8, 1e-14);
    let scores = "bernoulli(if A { logistic(40) } else { logistic(if B { -1 } else { 0 }) })";
    is_false(scores, "A = true, B = true", (-40f64).exp() / (1.0 + (-40f64).exp()));
}

/// 1 − (1 − 10⁻¹³/2)²⁰ to 50 digits: the form of many conditions is split.
#[test]
fn many_conditions_that_rarely_fail() {
    let names: Vec<String> = (0..20).map(|at| format!("C{at}")).collect();
    let all = |one: &dyn Fn(&String) -> String| names.iter().map(one).collect::<Vec<_>>().join(" ");
    let text = format!(
        "program Conditions {{ variables {{ {} : bool; X : bool; }} decomposition {{ {} P(X | {}) }}
         forms {{ {} P(X | {}) = noisy_and({}); }} }}",
        names.join(", "),
        all(&|name| format!("P({name})")),
        names.join(" "),
        all(&|name| format!("P({name}) = bernoulli(0.5);")),
        names.join(" "),
        vec!["1e-13"; 20].join(", "),
    );
    let found = program(&text).ask("P(X = false)").unwrap();
    near(found.number().unwrap(), 9.999_999_999_995_25e-13, 1e-14);
}

#[test]
fn counts_whose_total_is_beyond_the_range_of_numbers() {
    for form in ["histogram(1e308, 5e307, 1e308)", "laplace_succession(1e308, 5e307, 1e308)"] {
        let text = format!(
            "program Counts {{ variables {{ X : 0..=2; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
        );
        let found = program(&text).ask("P(X)").unwrap();
        let p: Vec<f64> = found.answer().answer.iter().map(|row| row.p().unwrap()).collect();
        p.iter().zip([0.4, 0.2, 0.4]).for_each(|(p, expected)| near(*p, expected, 1e-15));
    }
}
