//! Markov chains that integrate and sum out what they can.
//!
//! In: programs whose posteriors have closed forms or are sums over few labels. Out: estimates. Invariant: each lies within four of
//! its own standard errors of a value from another source: normal equations in fractions, or sums and quadrature by SciPy.

use bp_core::prelude::*;

#[track_caller]
fn within(posterior: &Posterior, name: &str, expected: f64) {
    let [mean, error] = posterior.of(name).unwrap().mean_and_error().unwrap();
    assert!(
        error > 0.0 && (mean - expected).abs() < 4.0 * error,
        "{name}: {mean} ± {error}, expected {expected}"
    );
}

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

const LINE: &str = "program Line {
    variables { Beta[0..=1], Sigma : real; Y[row in Rows] : real; }
    decomposition { prod(k) { P(Beta[k]) } P(Sigma) prod(row in Rows) { P(Y[row] | Beta Sigma) } }
    forms { P(Beta[k]) = flat; P(Sigma) = half_flat; P(Y[row] | Beta Sigma) = normal(Beta[0] + Beta[1] * x[row], Sigma); }
}";

const Y: [f64; 12] = [1.0, 2.0, 4.0, 3.0, 6.0, 5.0, 8.0, 7.0, 8.0, 10.0, 9.0, 12.0];

fn line(count: usize, missing: usize) -> Result<Program, bp_core::Error> {
    let y = Y[..count - missing].iter().copied().chain(std::iter::repeat_n(f64::NAN, missing));
    program(LINE).rows(Rows::new().column("x", (0..count).map(|x| x as f64)).column("Y", y))
}

/// Least squares at x = 0 … 11: 17/13 and 257/286, and 2511/286 is left of the squares. Under flat priors of the coefficients and of
/// σ > 0, σ² is 2511/286 divided by a χ² of 9 degrees of freedom: E σ² = 2511/2002.
#[test]
fn of_a_regression_only_the_deviation_is_drawn() {
    let line = line(12, 0).unwrap().draws(20_000);
    let posterior = line.ask("P(Beta, Sigma)").unwrap();
    assert_eq!((posterior.strategy().name(), posterior.warning()), ("gibbs", None));
    // Nearly independent draws of the coefficients.
    assert!(posterior.of("Beta[1]").unwrap().estimate().unwrap().effective > 1000.0);
    within(&posterior, "Beta[0]", 17.0 / 13.0);
    within(&posterior, "Beta[1]", 257.0 / 286.0);
    // √(2511/572) Γ(4) / Γ(9/2)
    within(&posterior, "Sigma", (2511.0f64 / 572.0).sqrt() * 6.0 / 11.631_728_396_567_448);
    let slope = posterior.of("Beta[1]").unwrap().deviation().unwrap();
    assert!((slope / (2511.0f64 / 2002.0 / 143.0).sqrt() - 1.0).abs() < 0.05, "{slope}");
}

/// The mean of a row without a value is that of the line at it.
#[test]
fn what_is_not_observed_is_predicted() {
    let line = line(13, 1).unwrap().draws(20_000);
    within(&line.ask("P(Y)").unwrap(), "Y[12]", 17.0 / 13.0 + 12.0 * 257.0 / 286.0);
    let positive = line.ask("P(Beta[1] > 0)").unwrap();
    let p = positive.p(true).unwrap();
    assert!(p > 0.99, "{p}");
}

#[test]
fn improper_posteriors_are_refused() {
    // Three rows and three flat variables leave 1/σ of σ: no total.
    let error = line(3, 0).unwrap().ask("P(Sigma)").unwrap_err().to_string();
    assert!(error.contains("the posterior is improper: the observations do not bound `Sigma`"), "{error}");
    let error = line(1, 0).unwrap().ask("P(Sigma)").unwrap_err().to_string();
    assert!(error.contains("the posterior is improper"), "{error}");
    let line = line(12, 0).unwrap().by("weighting").unwrap();
    let error = line.ask("P(Sigma)").unwrap_err().to_string();
    assert!(error.contains("is improper: `flat` is answered"), "{error}");
}

/// Labels of three rows: sums over their eight combinations.
#[test]
fn labels_are_summed_row_by_row() {
    let text = "program Groups {
        variables { M : real; K[row in Rows] : bool; Y[row in Rows] : real; }
        decomposition { P(M) prod(row in Rows) { P(K[row]) P(Y[row] | K[row] M) } }
        forms { P(M) = normal(0, 2); P(K[row]) = bernoulli(0.3); P(Y[row] | K[row] M) = normal(if K[row] { M } else { 0 }, 1); }
    }";
    let groups = program(text).rows(Rows::new().column("Y", [3.0, 2.5, -0.5])).unwrap().by("gibbs").unwrap();
    let posterior = groups.draws(20_000).ask("P(M, K)").unwrap();
    within(&posterior, "M", 2.350_842_553_127_062_5);
    for (row, expected) in [0.941_184_02, 0.865_171_68, 0.025_914_12].into_iter().enumerate() {
        within(&posterior, &format!("K[{row}]"), expected);
    }
}

/// A chain of hidden states beside an unknown deviation: sums over sixteen combinations, integrated over the deviation.
#[test]
fn hidden_states_are_summed_one_after_the_other() {
    let text = "program Chain {
        variables { S : real; A, B, C, D : bool; W, X, Y, Z : real; }
        decomposition { P(S) P(A) P(B | A) P(C | B) P(D | C) P(W | A S) P(X | B S) P(Y | C S) P(Z | D S) }
        forms {
            P(S) = gamma(2, 1);
            P(A) = bernoulli(0.5);
            P(B | A) = bernoulli(if A { 0.8 } else { 0.2 });
            P(C | B) = bernoulli(if B { 0.8 } else { 0.2 });
            P(D | C) = bernoulli(if C { 0.8 } else { 0.2 });
            P(W | A S) = normal(if A { 3 } else { 0 }, S); P(X | B S) = normal(if B { 3 } else { 0 }, S);
            P(Y | C S) = normal(if C { 3 } else { 0 }, S); P(Z | D S) = normal(if D { 3 } else { 0 }, S);
        }
    }";
    let chain = program(text).by("gibbs").unwrap().draws(20_000);
    let posterior = chain.ask("P(S, A, B, C, D | W = 0.2, X = 2.5, Y = 3.5, Z = 0.1)").unwrap();
    within(&posterior, "S", 0.940_846_188_222_631);
    let expected =
        [0.106_663_786_255_339, 0.920_200_493_502_924, 0.941_156_827_865_136, 0.107_273_195_021_674];
    for (name, expected) in ["A", "B", "C", "D"].into_iter().zip(expected) {
        within(&posterior, name, expected);
    }
}

/// A change between two means beside an unknown deviation: the means are integrated out. Sums over its eight positions, by
/// quadrature over the deviation (SciPy).
#[test]
fn a_change_is_found_with_its_means_integrated_out() {
    let text = "program Change {
        variables { T : 1..=8; A, B, S : real; Y[i in 1..=8] : real; }
        decomposition { P(T) P(A) P(B) P(S) prod(i) { P(Y[i] | T A B S) } }
        forms {
            P(T) = uniform; P(A) = normal(0, 3); P(B) = normal(0, 3); P(S) = gamma(2, 1);
            P(Y[i] | T A B S) = normal(if i < T { A } else { B }, S);
        }
    }";
    let y = vec![0.3, -0.2, 0.5, 0.1, 2.2, 1.7, 2.4, 2.0];
    let change = program(text).draws(20_000).question("P(T, B, S | Y = y)").unwrap();
    let posterior = change.given("y", y).unwrap().ask().unwrap();
    assert_eq!(posterior.strategy().name(), "gibbs");
    let [p, error] = posterior.of("T").unwrap().p_and_error(5).unwrap();
    assert!((p - 0.952_662_292_314_851).abs() < 4.0 * error, "{p} ± {error}");
    within(&posterior, "S", 0.448_747_907_705_622);
    within(&posterior, "B", 2.042_993_861_112_369_5);
}
