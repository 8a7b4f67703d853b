//! Missing cells of families and missing components of vectors: what they say nothing of is answered as before.
//!
//! In: programs, rows and lists with missing values. Out: posteriors. Invariant: expected values are closed forms, or
//! one-dimensional integrals of 30 digits (mpmath 1.3).

use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn near(found: f64, expected: f64, by: f64) {
    assert!((found - expected).abs() <= by, "{found}, expected {expected}");
}

/// ∫ 2 r · 3 r (1 − r)² · Poisson(2; 5 r) dr: a row whose number of trials is missing has a Poisson count of successes.
#[test]
fn a_missing_number_of_trials() {
    let trials = program(
        "program Trials {
            variables { Rate, Z : real; K : bool; N[r in Rows] : real; M[r in Rows] : real; }
            decomposition { P(Rate) P(Z) P(K) prod(r in Rows) { P(N[r]) P(M[r] | Rate N[r]) } }
            forms {
                P(Rate) = beta(2, 1); P(Z) = normal(0, 1); P(K) = bernoulli(0.3);
                P(N[r]) = poisson(5); P(M[r] | Rate N[r]) = binomial(N[r], Rate);
            }
        }",
    );
    let rows = Rows::new().column("N", [3.0, f64::NAN, 4.0]).column("M", [1.0, 2.0, f64::NAN]);
    let trials = trials.rows(rows).unwrap();
    let rate = trials.ask("P(Rate | N M)").unwrap();
    near(rate.mean().unwrap(), 0.486_201_078_217_247, 0.01);
    near(rate.ln_evidence().unwrap(), -6.821_843_713_528_63, 0.05);
    // What does not depend on the missing cell is answered too.
    near(trials.ask("P(Z | N M)").unwrap().variance().unwrap(), 1.0, 0.05);
    near(trials.ask("P(K | N M)").unwrap().p(true).unwrap(), 0.3, 0.01);
}

/// Rows 1 and 3 give P(K | N) ∝ Poisson(3; r) Poisson(4; r) with r = 2 or 4; the missing cell says nothing.
#[test]
fn a_missing_count_beside_reals() {
    let counts = program(
        "program Counts {
            variables { K : bool; X : real; N[r in Rows] : real; }
            decomposition { P(K) P(X | K) prod(r in Rows) { P(N[r] | K) } }
            forms {
                P(K) = bernoulli(0.5); P(X | K) = normal(if K { 1 } else { 0 }, 1);
                P(N[r] | K) = poisson(if K { 4 } else { 2 });
            }
        }",
    );
    let counts = counts.rows(Rows::new().column("N", [3.0, f64::NAN, 4.0])).unwrap();
    let odds = 2f64.powi(7) * (-4f64).exp();
    near(counts.ask("P(X | N)").unwrap().mean().unwrap(), odds / (1.0 + odds), 1e-12);
    near(counts.ask("P(K | N)").unwrap().p(true).unwrap(), odds / (1.0 + odds), 1e-12);
}

const CLASSES: &str = "program Classes {
    variables { K : bool; V : real[2]; W : real[2]; }
    decomposition { P(K) P(V | K) P(W | V) }
    forms {
        P(K) = bernoulli(0.3);
        P(V | K) = normal(if K { 1 } else { -1 }, 2);
        P(W | V) = normal(V, 1);
    }
}";

/// Bayes' rule with densities N(±1, 2) of each component.
#[test]
fn components_of_a_known_vector() {
    let classes = program(CLASSES);
    let both = [0.657_619_125_055_800_7, -4.134_014_879_306_152];
    let one = [0.414_037_835_902_632_4, -1.934_260_599_826_982_4];
    for (second, [p, ln]) in [(2.0, both), (f64::NAN, one)] {
        let asked = classes.question("P(K | V)").unwrap().given("V", vec![1.0, second]).unwrap().ask();
        let seen = Evidence::new().with("V", vec![1.0, second]);
        let all = classes.marginals(&seen).unwrap();
        let joint = classes.joint(&["K".to_owned()], &seen).unwrap();
        for found in [asked.unwrap(), all.of("K").unwrap(), joint] {
            near(found.p(true).unwrap(), p, 1e-13);
        }
        near(all.ln_evidence().unwrap(), ln, 1e-13);
        near(classes.joint(&["K".to_owned()], &seen).unwrap().ln_evidence().unwrap(), ln, 1e-13);
        // A component that is not known has a marginal, and a value in the most probable assignment.
        assert_eq!(all.of("V[1]").is_ok(), second.is_nan());
        assert!(all.of("V[0]").is_err());
        let best = classes.most_probable(&seen).unwrap();
        let named = best.answer().answer[0].values.iter().any(|(name, _)| name == "V[1]");
        assert_eq!(named, second.is_nan(), "{best}");
    }
    // An equation between a component and a number, known in either form.
    for text in ["P(K | V[0] == 1)", "P(K | V[0] = 1)"] {
        let found = classes.ask(text).unwrap();
        near(found.p(true).unwrap(), one[0], 1e-13);
        near(found.ln_evidence().unwrap(), one[1], 1e-13);
    }
    let written = classes.ask("P(K | V = [1, 2])").unwrap();
    near(written.p(true).unwrap(), both[0], 1e-13);
    near(written.ln_evidence().unwrap(), both[1], 1e-13);
}

/// The Dirichlet posterior of all counts; of one count alone that of its beta-binomial distribution.
#[test]
fn counts_of_which_some_are_missing() {
    let shares = program(
        "program Shares {
            variables { S : real[3]; V : real[3]; }
            decomposition { P(S) P(V | S) }
            forms { P(S) = dirichlet(1, 2, 3); P(V | S) = multinomial(6, S); }
            question shares { P(S | V) }
        }",
    );
    let of = |counts: [f64; 3]| shares.question("shares").unwrap().given("V", counts.to_vec()).unwrap().ask();
    let nan = f64::NAN;
    for counts in [[1.0, 2.0, 3.0], [nan, 2.0, 3.0], [1.0, nan, 3.0], [1.0, 2.0, nan]] {
        let found = of(counts).unwrap();
        near(found.ln_evidence().unwrap(), -2.734_367_509_419_583_5, 1e-13);
        near(found.of("S[0]").unwrap().mean().unwrap(), 1.0 / 6.0, 1e-14);
        near(found.of("S[1]").unwrap().mean().unwrap(), 1.0 / 3.0, 1e-14);
    }
    let first = of([1.0, nan, nan]).unwrap();
    near(first.ln_evidence().unwrap(), -1.299_282_984_130_260_9, 0.02);
    near(first.of("S[0]").unwrap().mean().unwrap(), 1.0 / 6.0, 0.005);
}
