//! Families and first instants of linear-Gaussian programs over time.
//!
//! In: programs whose families are observed instant by instant. Out: filters and smoothers. Invariant: expected numbers are those of
//! the dense joint law of all instants, built here.

use super::kalman::{Dense, asked_of, near};
use crate::support::{model_of, question};
use bp_core::compiler::answer::{Figure, ask_over_time};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::sample::Sampling;
use nalgebra::DMatrix;

/// Two walkers, each seen by its own sensor; the second has another sensor.
const WALKERS: &str = "program Walkers over t in Time {
    parameters { keep[1..=2] : real = [0.9, 0.5]; r[1..=2] : real = [0.7, 0.4]; }
    variables { X[i in 1..=2], X[i in 1..=2]^-1, Z[i in 1..=2], U : real; }
    decomposition { prod(i in 1..=2) { P(X[i]^-1) P(X[i] | X[i]^-1) P(Z[i] | X[i]) } P(U | X[2]) }
    forms { P(X[i]^-1) = previous(X) else normal(i, 2);
            P(X[i] | X[i]^-1) = normal(keep[i] * X[i]^-1, 0.3 * i);
            P(Z[i] | X[i]) = normal(X[i] + i, r[i]); P(U | X[2]) = normal(2 * X[2] - 1, 0.5); } }";

/// Rows Z[1], Z[2], U.
const WALKED: [[f64; 3]; 4] =
    [[2.1, 4.5, 3.0], [f64::NAN, 3.6, 1.1], [1.4, f64::NAN, f64::NAN], [2.0, 3.0, 0.4]];

type Walk = (Dense, Vec<[usize; 2]>, Vec<Vec<(usize, f64)>>);

/// Rows X[1], X[2] of each instant, and all observations.
fn walkers() -> Walk {
    let mut dense = Dense { mean: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    let mut last = [dense.add(&[], 1.0, 2.0), dense.add(&[], 2.0, 2.0)];
    let (mut states, mut seen) = (Vec::new(), Vec::new());
    for instant in 0..6 {
        let x1 = dense.add(&[(last[0], 0.9)], 0.0, 0.3);
        let x2 = dense.add(&[(last[1], 0.5)], 0.0, 0.6);
        last = [x1, x2];
        states.push(last);
        let z = [(x1, 1.0, 1.0, 0.7), (x2, 1.0, 2.0, 0.4), (x2, 2.0, -1.0, 0.5)];
        let rows = z.map(|(of, factor, shift, deviation)| dense.add(&[(of, factor)], shift, deviation));
        let values = WALKED.get(instant).map_or([f64::NAN; 3], |row| *row);
        seen.push(rows.into_iter().zip(values).filter(|(_, value)| !value.is_nan()).collect());
    }
    (dense, states, seen)
}

#[test]
fn families_over_time_are_filtered_element_by_element() {
    let model = model_of(WALKERS);
    let (dense, states, seen) = walkers();
    let rows: Vec<Vec<f64>> = WALKED.iter().map(|row| row.to_vec()).collect();
    let names = ["Z[1]", "Z[2]", "U"];
    for length in 1..=4 {
        let known: Vec<(usize, f64)> = seen[..length].concat();
        let (laws, ln) = asked_of(&model, "filter P(X | Z U)", &names, &rows[..length]);
        for element in 0..2 {
            let (expected, ln_expected) = dense.given(states[length - 1][element], &known);
            near(laws[element], expected);
            assert!((ln - ln_expected).abs() < 1e-9, "{ln} {ln_expected}");
        }
    }
    let known: Vec<(usize, f64)> = seen.concat();
    for word in ["smooth", "sequence"] {
        let (laws, _) = asked_of(&model, &format!("{word} P(X | Z U)"), &names, &rows);
        for (instant, state) in states[..4].iter().enumerate() {
            for element in 0..2 {
                near(laws[2 * instant + element], dense.given(state[element], &known).0);
            }
        }
    }
    let (laws, _) = asked_of(&model, "predict(2) P(X[2] | Z U)", &names, &rows);
    near(laws[0], dense.given(states[5][1], &known).0);
    let (laws, _) = asked_of(&model, "filter P(X[2] | Z[1..=2] U)", &names, &rows);
    near(laws[0], dense.given(states[3][1], &known).0);
    // An element known by a number at each instant, beside columns.
    let fixed: Vec<Vec<f64>> = rows.iter().map(|row| vec![row[0], row[2]]).collect();
    let (laws, ln) = asked_of(&model, "filter P(X | Z[1] Z[2] = 3.5 U)", &["Z[1]", "U"], &fixed);
    let mut known: Vec<(usize, f64)> =
        (seen.concat()).into_iter().filter(|(_, z)| ![4.5, 3.6, 3.0].contains(z)).collect();
    known.push((seen[0][2].0, 3.0));
    known.extend(states[..4].iter().map(|state| (state[1] + 2, 3.5)));
    let (expected, ln_expected) = dense.given(states[3][1], &known);
    near(laws[1], expected);
    assert!((ln - ln_expected).abs() < 1e-9, "{ln} {ln_expected}");
    // The entropy of both at the end: of independent walkers the sum.
    let entropy = ask_over_time(
        &model,
        &question(&model, "entropy filter P(X | Z U)"),
        &rows
            .iter()
            .map(|row| {
                let cells = names.iter().zip(row).filter(|(_, value)| !value.is_nan());
                cells.map(|(name, value)| ((*name).to_owned(), *value)).collect()
            })
            .collect::<Vec<_>>(),
        &Inputs::new(),
        Sampling::default(),
    );
    let known: Vec<(usize, f64)> = seen.concat();
    let expected: f64 = (0..2).map(|element| dense.given(states[3][element], &known).0[1].ln()).sum::<f64>()
        + (std::f64::consts::TAU * std::f64::consts::E).ln();
    let Figure::Entropy { entropy, .. } = entropy.unwrap()[0].answer[0].figure else { panic!("an entropy") };
    assert!((entropy - expected).abs() < 1e-9, "{entropy} {expected}");
}

/// One sensor of several elements makes them dependent.
#[test]
fn an_observation_of_several_elements_over_time() {
    let model = model_of(
        "program Row over t in Time { variables { X[i in 0..=3], X[i in 0..=3]^-1, Z : real; }
         decomposition { prod(i in 0..=3) { P(X[i]^-1) P(X[i] | X[i]^-1) } P(Z | X) }
         forms { P(X[i]^-1) = previous(X) else normal(0, 1); P(X[i] | X[i]^-1) = normal(X[i]^-1, 0.5);
                 P(Z | X) = normal(X[0] - X[1] + 2 * X[3], 0.1); } }",
    );
    let mut dense = Dense { mean: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    let mut last: Vec<usize> = (0..4).map(|_| dense.add(&[], 0.0, 1.0)).collect();
    let mut known = Vec::new();
    for z in [1.0, 0.2, -0.7] {
        last = last.iter().map(|before| dense.add(&[(*before, 1.0)], 0.0, 0.5)).collect();
        known.push((dense.add(&[(last[0], 1.0), (last[1], -1.0), (last[3], 2.0)], 0.0, 0.1), z));
    }
    let (laws, ln) = asked_of(&model, "filter P(X | Z)", &["Z"], &[vec![1.0], vec![0.2], vec![-0.7]]);
    for element in 0..4 {
        let (expected, ln_expected) = dense.given(last[element], &known);
        near(laws[element], expected);
        assert!((ln - ln_expected).abs() < 1e-9);
    }
}

/// The first instant has a form of its own, which depends on a shared offset.
#[test]
fn a_first_instant_of_its_own_is_filtered_and_smoothed() {
    let model = model_of(
        "program Walk over t in Time { variables { B, X, X^-1, Z : real; }
         decomposition { P(B) P(initial(X) | B) P(X | X^-1 B) P(Z | X) }
         forms { P(B) = normal(0.5, 0.2); P(initial(X) | B) = normal(3 + B, 2); P(X | X^-1 B) = normal(0.5 * X^-1 - B, 1);
                 P(Z | X) = normal(X, 0.8); } }",
    );
    let mut dense = Dense { mean: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    let (mut states, mut known): (Vec<usize>, Vec<(usize, f64)>) = (Vec::new(), Vec::new());
    let z = [5.0, 1.0, f64::NAN, 0.3];
    for (instant, z) in z.iter().enumerate() {
        let b = dense.add(&[], 0.5, 0.2);
        let x = match instant {
            0 => dense.add(&[(b, 1.0)], 3.0, 2.0),
            _ => dense.add(&[(states[instant - 1], 0.5), (b, -1.0)], 0.0, 1.0),
        };
        let seen = dense.add(&[(x, 1.0)], 0.0, 0.8);
        states.push(x);
        if !z.is_nan() {
            known.push((seen, *z));
        }
    }
    let rows: Vec<Vec<f64>> = z.iter().map(|z| vec![*z]).collect();
    let (filtered, ln) = asked_of(&model, "filter P(X | Z)", &["Z"], &rows);
    let (expected, ln_expected) = dense.given(states[3], &known);
    near(filtered[0], expected);
    assert!((ln - ln_expected).abs() < 1e-9, "{ln} {ln_expected}");
    for word in ["smooth", "sequence"] {
        let (laws, _) = asked_of(&model, &format!("{word} P(X | Z)"), &["Z"], &rows);
        laws.iter().zip(&states).for_each(|(law, state)| near(*law, dense.given(*state, &known).0));
    }
    let (first, _) = asked_of(&model, "filter P(X | Z)", &["Z"], &rows[..1]);
    near(first[0], dense.given(states[0], &known[..1]).0);
}
