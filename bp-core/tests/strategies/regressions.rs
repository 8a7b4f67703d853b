//! Regressions and groups by Markov chains, whose densities are compiled.
//!
//! In: programs with few rows. Out: means within four standard errors, and deviations. Invariant: expected values are sums over a fine
//! grid of the parameters, by a script in NumPy that shares no code with the crate.

use bp_core::prelude::*;

#[track_caller]
fn agrees(posterior: &Posterior, name: &str, expected: [f64; 2]) {
    let own = posterior.of(name).unwrap();
    let [mean, error] = own.mean_and_error().unwrap();
    assert!(error < 0.05 * expected[1], "{name}: {mean} ± {error}");
    assert!((mean - expected[0]).abs() < 4.0 * error, "{name}: {mean} ± {error}, expected {}", expected[0]);
    let deviation = own.deviation().unwrap() / expected[1];
    assert!((deviation - 1.0).abs() < 0.06, "{name}: {deviation} of the expected deviation");
}

fn chains(text: &str, rows: Rows) -> Posterior {
    let program = Program::parse(text).unwrap_or_else(|error| panic!("{error}")).rows(rows).unwrap();
    let posterior = program.draws(10_000).ask("posterior").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((posterior.strategy().name(), posterior.warning()), ("gibbs", None));
    posterior
}

const X: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

#[test]
fn a_poisson_regression() {
    let text = "program Poisson {
        variables { A, B : real; Y[row in Rows] : real; }
        decomposition { P(A) P(B) prod(row in Rows) { P(Y[row] | A B) } }
        forms { P(A) = normal(0, 10); P(B) = normal(0, 10); P(Y[row] | A B) = poisson(exp(A + B * x[row])); }
        question posterior { P(A, B) }
    }";
    let posterior = chains(text, Rows::new().column("x", X).column("Y", [2.0, 3.0, 6.0, 7.0, 12.0]));
    agrees(&posterior, "A", [1.570_039, 0.220_937]);
    agrees(&posterior, "B", [0.441_954, 0.146_756]);
}

/// The priors are so vague that hardly any draw of theirs agrees with the counts.
#[test]
fn a_binomial_regression_with_vague_priors() {
    let text = "program Binomial {
        variables { A, B : real; Y[row in Rows] : 0..=10; }
        decomposition { P(A) P(B) prod(row in Rows) { P(Y[row] | A B) } }
        forms { P(A) = normal(0, 1000); P(B) = normal(0, 1000);
                P(Y[row] | A B) = binomial(10, logistic(A + B * x[row])); }
        question posterior { P(A, B) }
    }";
    let posterior = chains(text, Rows::new().column("x", X).column("Y", [1, 3, 5, 8, 9]));
    agrees(&posterior, "A", [0.133_655, 0.366_505]);
    agrees(&posterior, "B", [1.187_391, 0.320_879]);
}

/// Effects of groups around a mean, with a deviation.
#[test]
fn groups_of_counts() {
    let text = "program Groups {
        variables { Mean, Spread : real; Effect[g in Groups] : real; Won[g in Groups] : 0..=12; }
        decomposition { P(Mean) P(Spread) prod(g in Groups) { P(Effect[g] | Mean Spread) P(Won[g] | Effect[g]) } }
        forms { P(Mean) = normal(0, 2); P(Spread) = half_normal(1);
                P(Effect[g] | Mean Spread) = normal(Mean, Spread);
                P(Won[g] | Effect[g]) = binomial(12, logistic(Effect[g])); }
        question posterior { P(Mean, Spread) }
    }";
    let posterior = chains(text, Rows::new().column("Won", [2, 7, 9, 5]));
    agrees(&posterior, "Mean", [-0.094_776, 0.558_935]);
    agrees(&posterior, "Spread", [0.889_224, 0.486_117]);
}

/// Each animal is seen 0 to 2 times; whether it exists is summed out.
#[test]
fn rows_with_labels_and_counts() {
    // P(Y = 0) = 1 − w + w/4, P(1) = w/2, P(2) = w/4 with w uniform: fourteen of 0, four of 1, two of 2. The posterior is ∝
    // (1 − ¾ w)¹⁴ w⁶: its moments are sums of polynomials.
    let text = "program Seen {
        variables { Share : real; There[i in Animals] : bool; Y[i in Animals] : 0..=2; }
        decomposition { P(Share) prod(i in Animals) { P(There[i] | Share) P(Y[i] | There[i]) } }
        forms { P(Share) = uniform(0, 1); P(There[i] | Share) = bernoulli(Share);
                P(Y[i] | There[i]) = if There[i] { binomial(2, 0.5) } else { dirac(0) }; }
        question posterior { P(Share) }
    }";
    let counts = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2];
    let moment = |power: i32| -> f64 {
        let points = 200_000;
        let f = |w: f64| (1.0 - 0.75 * w).powi(14) * w.powi(6 + power);
        (0..points).map(|at| f((f64::from(at) + 0.5) / f64::from(points))).sum()
    };
    let mean = moment(1) / moment(0);
    let deviation = (moment(2) / moment(0) - mean * mean).sqrt();
    let program = Program::parse(text).unwrap().rows(Rows::new().column("Y", counts)).unwrap();
    let posterior = program.draws(10_000).ask("posterior").unwrap();
    agrees(&posterior, "Share", [mean, deviation]);
}
