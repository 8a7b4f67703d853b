//! Linear and Gaussian programs over time, compared with the joint distribution of all instants.
//!
//! In: programs, observations with gaps. Out: filtered, predicted and smoothed distributions. Invariant: expected
//! values are those of one normal distribution over every variable of every instant, built from its equations and
//! conditioned in one step by nalgebra.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Figure, ask, ask_over_time};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::sample::Sampling;
use nalgebra::{DMatrix, DVector};

/// A normal law: means and covariances of variables that are added one by one.
pub(crate) struct Dense {
    pub(crate) mean: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

impl Dense {
    /// Adds Σ cᵢ xᵢ + constant + noise.
    pub(crate) fn add(&mut self, terms: &[(usize, f64)], constant: f64, deviation: f64) -> usize {
        let size = self.mean.len();
        let mut weights = DVector::zeros(size);
        terms.iter().for_each(|(row, weight)| weights[*row] += weight);
        self.mean.push(terms.iter().map(|(row, weight)| weight * self.mean[*row]).sum::<f64>() + constant);
        let cross = &self.covariance * &weights;
        let variance = weights.dot(&cross) + deviation * deviation;
        self.covariance = DMatrix::from_fn(size + 1, size + 1, |i, j| match (i == size, j == size) {
            (false, false) => self.covariance[(i, j)],
            (true, false) => cross[j],
            (false, true) => cross[i],
            (true, true) => variance,
        });
        size
    }

    /// Mean and deviation of a row, given others; and ln of their density.
    pub(crate) fn given(&self, row: usize, known: &[(usize, f64)]) -> ([f64; 2], f64) {
        let rows: Vec<usize> = known.iter().map(|(row, _)| *row).collect();
        let own = self.covariance.select_rows(&rows).select_columns(&rows);
        let surprise =
            DVector::from_iterator(rows.len(), known.iter().map(|(row, value)| value - self.mean[*row]));
        let solved = own.clone().cholesky().unwrap();
        let cross = self.covariance.select_rows(&rows).column(row).into_owned();
        let mean = self.mean[row] + cross.dot(&solved.solve(&surprise));
        let variance = self.covariance[(row, row)] - cross.dot(&solved.solve(&cross));
        let determinant = own.determinant();
        let count = rows.len() as f64;
        let ln = -0.5
            * (surprise.dot(&solved.solve(&surprise))
                + determinant.ln()
                + count * std::f64::consts::TAU.ln());
        ([mean, variance.max(0.0).sqrt()], ln)
    }
}

/// A position driven by a velocity (without noise: the carried law is singular), observed with noise, with gaps.
const CART: &str = "program Cart over t in Time { parameters { dt : real = 0.5; }
    variables { X, X^-1, W, W^-1, Z, U : real; }
    decomposition { P(X^-1) P(W^-1 | X^-1) P(W | W^-1) P(X | X^-1 W) P(Z | X) P(U | W) }
    forms { P(X^-1) = previous(X) else normal(1, 2); P(W^-1 | X^-1) = previous(W) else normal(0.5 * X^-1, 1);
            P(W | W^-1) = normal(0.9 * W^-1, 0.3); P(X | X^-1 W) = dirac(X^-1 + dt * W);
            P(Z | X) = normal(2 * X - 1, 0.7); P(U | W) = normal(W, 0.4); } }";

const SEEN: [[f64; 2]; 6] =
    [[1.0, 0.4], [f64::NAN, 0.8], [3.5, f64::NAN], [f64::NAN, f64::NAN], [4.0, 0.2], [4.4, 0.1]];

/// A joint law, the variables of each instant, and the observations at each.
type Cart = (Dense, Vec<[usize; 2]>, Vec<Vec<(usize, f64)>>);

/// Rows X, W of each instant (0 is before the first), and all observations, instant by instant.
fn cart() -> Cart {
    let mut dense = Dense { mean: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    let x = dense.add(&[], 1.0, 2.0);
    let w = dense.add(&[(x, 0.5)], 0.0, 1.0);
    let (mut states, mut seen) = (vec![[x, w]], Vec::new());
    for instant in 0..9 {
        let [x0, w0] = states[instant];
        let w = dense.add(&[(w0, 0.9)], 0.0, 0.3);
        let x = dense.add(&[(x0, 1.0), (w, 0.5)], 0.0, 0.0);
        let (z, u) = (dense.add(&[(x, 2.0)], -1.0, 0.7), dense.add(&[(w, 1.0)], 0.0, 0.4));
        states.push([x, w]);
        let of = SEEN.get(instant).map_or(Vec::new(), |row| vec![(z, row[0]), (u, row[1])]);
        seen.push(of.into_iter().filter(|(_, value)| !value.is_nan()).collect());
    }
    (dense, states, seen)
}

fn asked(model: &Model, text: &str, rows: &[[f64; 2]]) -> (Vec<[f64; 2]>, f64) {
    let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.to_vec()).collect();
    asked_of(model, text, &["Z", "U"], &rows)
}

pub(crate) fn asked_of(model: &Model, text: &str, names: &[&str], rows: &[Vec<f64>]) -> (Vec<[f64; 2]>, f64) {
    let observed = |row: &Vec<f64>| {
        let cells = names.iter().zip(row).filter(|(_, value)| !value.is_nan());
        cells.map(|(name, value)| ((*name).to_owned(), *value)).collect::<Vec<_>>()
    };
    let rows: Vec<_> = rows.iter().map(observed).collect();
    let answers = ask_over_time(model, &question(model, text), &rows, &Inputs::new(), Sampling::default());
    let answer = answers.unwrap().remove(0);
    let laws = answer.answer.iter().map(|row| match row.figure {
        Figure::Normal { mean, deviation } => [mean, deviation],
        figure => panic!("{figure:?}"),
    });
    (laws.collect(), answer.ln_evidence.unwrap())
}

#[track_caller]
pub(crate) fn near(found: [f64; 2], expected: [f64; 2]) {
    assert!(
        (found[0] - expected[0]).abs() < 1e-9 && (found[1] - expected[1]).abs() < 1e-9,
        "{found:?}, expected {expected:?}"
    );
}

#[test]
fn filter_predict_and_smooth_are_the_dense_law() {
    let model = model_of(CART);
    let (dense, states, seen) = cart();
    for length in 1..=6 {
        let known: Vec<(usize, f64)> = seen[..length].concat();
        let (laws, ln) = asked(&model, "filter P(X W | Z U)", &SEEN[..length]);
        let (x, ln_expected) = dense.given(states[length][0], &known);
        near(laws[0], x);
        near(laws[1], dense.given(states[length][1], &known).0);
        assert!((ln - ln_expected).abs() < 1e-9, "{ln} {ln_expected}");
    }
    let known: Vec<(usize, f64)> = seen.concat();
    let (smooth, _) = asked(&model, "smooth P(X W | Z U)", &SEEN);
    for instant in 0..6 {
        for variable in 0..2 {
            near(smooth[instant * 2 + variable], dense.given(states[instant + 1][variable], &known).0);
        }
    }
    let (sequence, _) = asked(&model, "sequence P(X W | Z U)", &SEEN);
    assert_eq!(sequence, smooth, "the most likely sequence of a normal law is its mean");
    for ahead in 1..=3 {
        let (laws, _) = asked(&model, &format!("predict({ahead}) P(X | Z U)"), &SEEN);
        near(laws[0], dense.given(states[6 + ahead][0], &known).0);
    }
    // Future observations are predicted too.
    let (laws, _) = asked(&model, "predict(1) P(Z | U)", &SEEN.map(|row| [f64::NAN, row[1]]));
    let only_u: Vec<(usize, f64)> =
        (seen.concat()).into_iter().filter(|(row, _)| (row - 2) % 4 == 3).collect();
    near(laws[0], dense.given(2 + 6 * 4 + 2, &only_u).0);
}

#[test]
fn vectors_are_their_components() {
    let model = model_of(
        "program Space { parameters { s : real = 0.5; } variables { X, X^-1, Z : real[2]; }
         decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal([1, -1], 2); P(X | X^-1) = normal(0.8 * X^-1 + [0, 1], s);
                 P(Z | X) = normal(X / 2, 1); } }",
    );
    let scalar = |start: f64, shift: f64, z: f64| {
        // Prior after a step, then one measurement: precisions add.
        let (mean, variance) = (0.8 * start + shift, 0.64 * 4.0 + 0.25);
        let gain = 0.5 * variance / (0.25 * variance + 1.0);
        [mean + gain * (z - 0.5 * mean), ((1.0 - 0.5 * gain) * variance).sqrt()]
    };
    let rows = vec![vec![("Z[0]".to_owned(), 0.3), ("Z[1]".to_owned(), 2.0)]];
    let answers = ask_over_time(
        &model,
        &question(&model, "filter P(X | Z)"),
        &rows,
        &Inputs::new(),
        Sampling::default(),
    );
    let z = [0.3, 2.0];
    let at_once = ask(&model, &question(&model, "P(X | Z)"), &Inputs::new().array("Z", &z));
    for answer in [answers.unwrap().remove(0), at_once.unwrap().remove(0)] {
        for (row, (name, expected)) in
            answer.answer.iter().zip([("X[0]", scalar(1.0, 0.0, 0.3)), ("X[1]", scalar(-1.0, 1.0, 2.0))])
        {
            let Figure::Normal { mean, deviation } = row.figure else { panic!("{row:?}") };
            assert_eq!(row.values[0].0, name);
            near([mean, deviation], expected);
        }
    }
}

/// A walk with a vague start. Expected: the joint normal law of all instants, conditioned in 50 digits (mpmath), for
/// the numbers as f64 represents them; so are all values of the tests below.
#[test]
fn a_vague_start_is_smoothed() {
    let model = model_of(
        "program Walk over t in Time { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1e8); P(X | X^-1) = normal(X^-1, 0.1);
                 P(Z | X) = normal(X, 0.1); } }",
    );
    let (laws, ln) = asked_of(&model, "smooth P(X | Z)", &["Z"], &[vec![1.0], vec![1.1]]);
    near(laws[0], [1.0333333333333333, 0.081_649_658_092_772_6]);
    near(laws[1], [1.0666666666666667, 0.081_649_658_092_772_6]);
    assert!((ln + 18.671945528368387).abs() < 1e-12, "{ln}");
    let (laws, _) = asked_of(&model, "filter P(X | Z)", &["Z"], &[vec![1.0], vec![1.1]]);
    near(laws[0], [1.0666666666666667, 0.081_649_658_092_772_6]);
}

/// As above; the position has no noise of its own, and the start of both is unknown.
#[test]
fn a_vague_start_of_two_that_are_carried() {
    let model = model_of(
        "program Cart over t in Time { variables { X, X^-1, W, W^-1, Z : real; }
         decomposition { P(X^-1) P(W^-1) P(W | W^-1) P(X | X^-1 W^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1e8); P(W^-1) = previous(W) else normal(0, 1e8);
                 P(W | W^-1) = normal(W^-1, 0.01); P(X | X^-1 W^-1) = dirac(X^-1 + 0.5 * W^-1);
                 P(Z | X) = normal(X, 0.1); } }",
    );
    let seen = [vec![1.0], vec![f64::NAN], vec![2.25], vec![2.5]];
    let (laws, ln) = asked_of(&model, "smooth P(X W | Z)", &["Z"], &seen);
    let expected = [
        [1.0535236396074933, 0.096_365_717_306_000_95],
        [1.0360392506690455, 0.092_848_759_069_037_24],
        [1.571_543_264_942_016, 0.065_531_553_301_783_67],
        [1.035771632471008, 0.092_694_908_811_304_9],
        [2.08942908117752, 0.059_809_390_960_791_46],
        [1.0352363960749331, 0.092_925_492_681_012_57],
        [2.607047279214987, 0.084_530_502_705_238_64],
        [1.0352363960749331, 0.093_462_009_340_741_88],
    ];
    laws.iter().zip(expected).for_each(|(found, expected)| near(*found, expected));
    assert!((ln + 39.929_556_193_448_9).abs() < 1e-9, "{ln}");
    let (filtered, _) = asked_of(&model, "filter P(X W | Z)", &["Z"], &seen);
    filtered.iter().zip(&expected[6..]).for_each(|(found, expected)| near(*found, *expected));
}

/// X never changes: n readings of 2 X − 1 are equivalent to one of their mean, with deviation 0.1 / 2 √n. Each particle
/// carries the same law, and a coin that is drawn.
#[test]
fn a_constant_with_a_vague_prior() {
    let forms = "P(X^-1) = previous(X) else normal(0, 1e8); P(X | X^-1) = dirac(X^-1);";
    let exact = model_of(&format!(
        "program Constant over t in Time {{ variables {{ X, X^-1, Z : real; }}
         decomposition {{ P(X^-1) P(X | X^-1) P(Z | X) }} forms {{ {forms} P(Z | X) = normal(2 * X - 1, 0.1); }} }}"
    ));
    let drawn = model_of(&format!(
        "program Drawn over t in Time {{ variables {{ X, X^-1, Z : real; C : bool; }}
         decomposition {{ P(X^-1) P(C) P(X | X^-1) P(Z | X C) }}
         forms {{ {forms} P(C) = bernoulli(0.5); P(Z | X C) = normal(2 * X - (if C {{ 1 }} else {{ 1 }}), 0.1); }} }}"
    ));
    let seen: Vec<Vec<f64>> = (0..5).map(|k| vec![1.0 + 0.5 * f64::from(k)]).collect();
    let expected = [1.5, 0.022_360_679_774_997_9];
    let (smooth, ln) = asked_of(&exact, "smooth P(X | Z)", &["Z"], &seen);
    smooth.iter().for_each(|law| near(*law, expected));
    assert!((ln + 140.302_899_174_776_53).abs() < 1e-9, "{ln}");
    let question = question(&drawn, "filter P(X | Z)");
    let rows: Vec<_> = seen.iter().map(|row| vec![("Z".to_owned(), row[0])]).collect();
    let answers = ask_over_time(&drawn, &question, &rows, &Inputs::new(), Sampling::default()).unwrap();
    assert!((answers[0].ln_evidence.unwrap() + 140.302_899_174_776_53).abs() < 1e-9);
    let text = format!("{:?}", answers[0].answer);
    let Figure::Real { mean, deviation, .. } = answers[0].answer[0].figure else { panic!("{text}") };
    near([mean[0], deviation[0]], expected);
}

/// Y equals X: the first observation determines it, later ones agree or are impossible.
#[test]
fn observations_of_determined_reals_over_time_agree_or_are_impossible() {
    let model = model_of(
        "program Determined over t in Time { variables { X, X^-1, W, W^-1, Y, Z : real; }
         decomposition { P(X^-1) P(W^-1) P(X | X^-1) P(W | W^-1) P(Y | X W) P(Z | W) }
         forms { P(X^-1) = previous(X) else normal(0, 1e4); P(W^-1) = previous(W) else normal(0, 1e8);
                 P(X | X^-1) = dirac(X^-1); P(W | W^-1) = dirac(0.5 * W^-1);
                 P(Y | X W) = dirac(X + W); P(Z | W) = dirac(W); } }",
    );
    let rows = [vec![3.0, 2.0], vec![2.0, f64::NAN], vec![1.5, 0.5]];
    let (laws, ln) = asked_of(&model, "smooth P(X W | Y Z)", &["Y", "Z"], &rows);
    let expected = [[1.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.5, 0.0]];
    laws.iter().zip(expected).for_each(|(found, expected)| near(*found, expected));
    // N(1; 0, 1e8) N(2; 0, (0.5e8)²), once.
    let expected = -0.5e-8 - (0.5f64).ln() - 12.0 * (10f64).ln() - std::f64::consts::TAU.ln();
    assert!((ln - expected).abs() < 1e-12, "{ln}, expected {expected}");
    let wrong = vec![vec![("Y".to_owned(), 3.0), ("Z".to_owned(), 2.0)], vec![("Y".to_owned(), 2.001)]];
    let asked = question(&model, "filter P(X | Y Z)");
    let error = ask_over_time(&model, &asked, &wrong, &Inputs::new(), Sampling::default()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("instant 2") && message.contains("`Y = 2.001` is impossible"), "{message}");
}

/// Two states whose means differ by one deviation, observed z deviations away: ln odds are z − ½, ln P = −(z − 1)² / 2 + ….
#[test]
fn far_observations_keep_their_odds_over_time() {
    let model = model_of(
        "program Odds over t in Time { variables { S, S^-1 : bool; Z : real; } decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
         forms { P(S^-1) = previous(S) else bernoulli(0.5); P(S | S^-1) = bernoulli(if S^-1 { 0.9 } else { 0.1 });
                 P(Z | S) = normal(if S { 1 } else { 0 }, 1); } }",
    );
    for z in [3.0, 1e8, 4e9, 1e17, 1e154, 1.5e154] {
        let question = question(&model, "filter P(S | Z)");
        let rows = [vec![("Z".to_owned(), z)]];
        let answers = ask_over_time(&model, &question, &rows, &Inputs::new(), Sampling::default()).unwrap();
        let row = answers[0].answer.iter().find(|row| row.values[0].1 == "true").unwrap();
        assert!((row.p().unwrap() - 1.0 / (1.0 + (0.5 - z).exp())).abs() < 1e-14, "{z}: {row:?}");
        let far = z - 1.0;
        let expected = -0.5 * far * far - (2.0 * std::f64::consts::TAU.sqrt()).ln() + (0.5 - z).exp().ln_1p();
        assert!((answers[0].ln_evidence.unwrap() / expected - 1.0).abs() < 1e-14, "{z}: {answers:?}");
    }
}
