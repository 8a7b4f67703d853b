//! Smoothing and sequences by particles, compared with exact smoothers.
//!
//! In: programs that sums or a Kalman smoother answer, and the same by particles. Out: estimates at each instant. Invariant:
//! expected values are the exact ones.

use super::guided::{by_particles, column, covers, mean};
use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask_over_time, ask_over_time_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::sample::Sampling;

fn exactly(model: &Model, text: &str, rows: &[Vec<(String, f64)>]) -> Answer {
    ask_over_time(model, &question(model, text), rows, &Inputs::new(), Sampling::default()).unwrap().remove(0)
}

/// Three states that are seen through a real.
const MOODS: &str = "program Moods { variables { S, S^-1 : { low, middle, high }; Z : real; }
    decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
    forms { P(S^-1) = previous(S) else categorical(0.6, 0.3, 0.1);
            P(S | S^-1) = table { low: 0.8, 0.2, 0; middle: 0.1, 0.8, 0.1; high: 0, 0.3, 0.7; };
            P(Z | S) = normal(match S { low => -1, middle => 0, high => 2 }, 1); } }";

const HEARD: [f64; 12] = [-0.8, -0.3, 0.9, 1.7, 2.6, 0.4, -0.2, 0.1, -1.9, -0.7, 0.5, 1.2];

#[test]
fn finite_states_are_smoothed_as_by_sums() {
    let model = model_of(MOODS);
    let rows = column("Z", &HEARD);
    let exact = exactly(&model, "smooth P(S | Z)", &rows);
    let answer = by_particles(&model, "smooth P(S | Z)", &rows, Sampling { particles: 6000, seed: 4 });
    assert_eq!(answer.answer.len(), exact.answer.len());
    for (found, exact) in answer.answer.iter().zip(&exact.answer) {
        assert_eq!(found.values, exact.values);
        let Figure::Estimated { p, error } = found.figure else { panic!("{found:?}") };
        let expected = exact.p().unwrap();
        assert!(
            (p - expected).abs() < 4.0 * error + 1e-3,
            "{:?}: {p} ± {error}, expected {expected}",
            found.values
        );
    }
    assert!((answer.ln_evidence.unwrap() - exact.ln_evidence.unwrap()).abs() < 0.1);
    // The most probable of 6000 paths is the most probable sequence.
    let states = |answer: &Answer| -> Vec<String> {
        answer
            .answer
            .iter()
            .map(|row| row.values.iter().find(|(name, _)| name == "S").unwrap().1.clone())
            .collect()
    };
    let likely = exactly(&model, "sequence P(S | Z)", &rows);
    let path = by_particles(&model, "sequence P(S | Z)", &rows, Sampling { particles: 6000, seed: 4 });
    assert_eq!(states(&path), states(&likely));
    assert_eq!(path.answer[0].figure, Figure::Mode { by: "most probable of the drawn paths" });
}

const WALK: &str = "program Walk { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
    forms { P(X^-1) = previous(X) else normal(1, 1); P(X | X^-1) = normal(0.8 * X^-1, 0.5); P(Z | X) = normal(X, 0.7); } }";

const WALKED: [f64; 8] = [0.3, 1.4, 0.2, -1.0, 0.5, 2.2, 1.9, 0.4];

#[test]
fn reals_are_smoothed_as_by_the_kalman_smoother() {
    let model = model_of(WALK);
    let rows = column("Z", &WALKED);
    let exact = exactly(&model, "smooth P(X | Z)", &rows);
    let means: Vec<f64> = exact
        .answer
        .iter()
        .map(|row| match row.figure {
            Figure::Normal { mean, .. } => mean,
            figure => panic!("{figure:?}"),
        })
        .collect();
    for instant in [0, 5] {
        let of = |seed: u64| {
            mean(&by_particles(&model, "smooth P(X | Z)", &rows, Sampling { particles: 300, seed }), instant)
        };
        covers(of, means[instant], 30);
    }
    // The most probable path of a normal law is its mean: that of 10 000 drawn paths is near.
    let path = by_particles(&model, "sequence P(X | Z)", &rows, Sampling { particles: 10_000, seed: 1 });
    let off = path
        .answer
        .iter()
        .zip(&means)
        .map(|(row, mean)| (row.values[1].1.parse::<f64>().unwrap() - mean).powi(2));
    let off = (off.sum::<f64>() / means.len() as f64).sqrt();
    assert!(off < 0.5, "{off}");
}

/// The position has no noise of its own, so the transition has no density: paths are those of the ancestors.
#[test]
fn without_a_density_paths_are_those_of_the_ancestors() {
    let model = model_of(
        "program Cart { variables { X, X^-1, W, W^-1, Z : real; } decomposition { P(X^-1) P(W^-1) P(W | W^-1) P(X | X^-1 W) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1); P(W^-1) = previous(W) else normal(0, 1);
                 P(W | W^-1) = normal(0.9 * W^-1, 0.3); P(X | X^-1 W) = dirac(X^-1 + 0.5 * W); P(Z | X) = normal(X, 0.5); } }",
    );
    let rows = column("Z", &[0.2, 0.6, 0.5, 1.4, 1.2]);
    let exact = exactly(&model, "smooth P(X W | Z)", &rows);
    let answer = by_particles(&model, "smooth P(X W | Z)", &rows, Sampling { particles: 2000, seed: 2 });
    for (row, exact) in exact.answer.iter().enumerate() {
        let (Figure::Normal { mean: expected, .. }, [found, error]) = (exact.figure, mean(&answer, row))
        else {
            panic!("{exact:?}")
        };
        assert_eq!(answer.answer[row].values, exact.values);
        assert!(
            (found - expected).abs() < 4.0 * error,
            "{:?}: {found} ± {error}, expected {expected}",
            exact.values
        );
    }
}

#[test]
fn what_paths_do_not_answer_is_refused() {
    let model = model_of(&WALK.replace("normal(X, 0.7)", "laplace(X, 0.7)"));
    let refused = |text: &str| {
        let rows = column("Z", &WALKED);
        let answers = ask_over_time_by(
            &model,
            &question(&model, text),
            &rows,
            &Inputs::new(),
            Sampling::default(),
            None,
        );
        answers.unwrap_err().to_string()
    };
    assert!(refused("max sequence P(X | Z)").contains("`max` is not available for a sequence of reals"));
    assert!(refused("entropy smooth P(X | Z)").contains("`entropy` is not available"));
    let sharp = model_of(&WALK.replace("normal(X, 0.7)", "dirac(abs(X))"));
    let rows = column("Z", &WALKED);
    let asked = question(&sharp, "filter P(X | Z)");
    let error =
        ask_over_time(&sharp, &asked, &rows, &Inputs::new(), Sampling::default()).unwrap_err().to_string();
    assert!(error.contains("no draw would ever meet the value"), "{error}");
}

/// P(x_t > 0 | z) of x_t = 0.9 x + noise, z = x² + noise, by sums over a grid, forward and backward.
fn sign_by_grid(seen: &[Option<f64>]) -> Vec<f64> {
    let (step, half) = (0.02, 350i32);
    let grid: Vec<f64> = (-half..=half).map(|at| f64::from(at) * step).collect();
    let normal = |x: f64, deviation: f64| (-0.5 * (x / deviation).powi(2)).exp() / deviation;
    let likelihood = |z: Option<f64>, x: f64| z.map_or(1.0, |z| normal(z - x * x, 0.5));
    // The start is that of the instant before the first.
    let mut forward: Vec<Vec<f64>> = Vec::new();
    let mut before: Vec<f64> = grid.iter().map(|x| normal(x - 0.3, 1.0)).collect();
    for z in seen {
        let now = |x: &f64| {
            let sum: f64 = grid.iter().zip(&before).map(|(from, p)| p * normal(x - 0.9 * from, 0.5)).sum();
            sum * likelihood(*z, *x)
        };
        before = grid.iter().map(now).collect();
        let total: f64 = before.iter().sum();
        before.iter_mut().for_each(|p| *p /= total);
        forward.push(before.clone());
    }
    let mut after = vec![1.0; grid.len()];
    let mut found = Vec::new();
    for (z, forward) in seen.iter().zip(&forward).rev() {
        let both: Vec<f64> = forward.iter().zip(&after).map(|(one, other)| one * other).collect();
        let total: f64 = both.iter().sum();
        let positive = grid.iter().zip(&both).filter(|(x, _)| **x > 1e-9).map(|(_, p)| p).sum::<f64>();
        found.push((positive + 0.5 * both[half as usize]) / total);
        let weighed: Vec<f64> = grid.iter().zip(&after).map(|(x, p)| p * likelihood(*z, *x)).collect();
        after = grid
            .iter()
            .map(|from| grid.iter().zip(&weighed).map(|(x, p)| p * normal(x - 0.9 * from, 0.5)).sum())
            .collect();
    }
    found.reverse();
    found
}

/// The sign of X is decided by few particles of the last instants: the errors of all instants say so.
#[test]
fn errors_of_early_instants_cover_what_later_instants_leave() {
    let model = model_of(
        "program Square { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0.3, 1); P(X | X^-1) = normal(0.9 * X^-1, 0.5);
                 P(Z | X) = normal(X * X, 0.5); } }",
    );
    let seen = [Some(1.0), None, Some(4.0), Some(0.2), Some(5.0)];
    let rows: Vec<Vec<(String, f64)>> =
        seen.iter().map(|z| z.map(|z| ("Z".to_owned(), z)).into_iter().collect()).collect();
    let expected = sign_by_grid(&seen);
    // Another computation, on a finer grid, gave 0.6213 and 0.6205.
    assert!((expected[0] - 0.6213).abs() < 2e-4 && (expected[4] - 0.6205).abs() < 2e-4, "{expected:?}");
    let mut squares = [0.0; 5];
    let seeds = 10;
    for seed in 1..=seeds {
        let sampling = Sampling { particles: 4000, seed };
        let found = by_particles(&model, "smooth P(X > 0 | Z)", &rows, sampling);
        let positive = found.answer.iter().filter(|row| row.values.last().unwrap().1 == "true");
        for ((row, expected), square) in positive.zip(&expected).zip(&mut squares) {
            let Figure::Estimated { p, error } = row.figure else { panic!("{row:?}") };
            *square += ((p - expected) / error).powi(2) / seeds as f64;
        }
        let effective = found.estimate.unwrap().effective;
        assert!(effective < 1000.0, "{effective} of 4000 paths are not independent");
    }
    // Mean squares of ten standard scores lie below 2.9 but for one in a thousand.
    assert!(squares.iter().all(|square| *square < 2.9), "{squares:?}");
}

/// One component of a vector is observed: the number is that of a Kalman smoother, which is exact.
#[test]
fn a_component_of_a_vector_is_observed_by_paths() {
    let model = model_of(
        "program Seen { variables { X, X^-1 : real; V : real[2]; } decomposition { P(X^-1) P(X | X^-1) P(V | X) }
         forms { P(X^-1) = previous(X) else normal(1, 1); P(X | X^-1) = normal(0.8 * X^-1, 0.5); P(V | X) = normal([X, 2 * X], 0.9); } }",
    );
    let rows = column("V[0]", &[1.0, 2.0, 0.0]);
    let exact = exactly(&model, "smooth P(X | V[0])", &rows);
    let found = by_particles(&model, "smooth P(X | V[0])", &rows, Sampling { particles: 4000, seed: 3 });
    for (instant, exact) in exact.answer.iter().enumerate() {
        let (Figure::Normal { mean: expected, .. }, [mean, error]) = (exact.figure, mean(&found, instant))
        else {
            panic!("{exact:?}")
        };
        assert!((mean - expected).abs() < 5.0 * error, "{instant}: {mean} ± {error}, expected {expected}");
    }
}

/// E[x_t | z] of x_t = x + noise of deviation 0.05, z = x + Laplacian noise, by sums over a grid, forward and backward.
fn mean_by_grid(seen: &[f64]) -> Vec<f64> {
    let (step, half, reach) = (0.015, 250i32, 20usize);
    let grid: Vec<f64> = (-half..=half).map(|at| f64::from(at) * step).collect();
    let bell: Vec<f64> = (0..=reach).map(|at| (-0.5 * (at as f64 * step / 0.05).powi(2)).exp()).collect();
    let moved = |from: &[f64]| -> Vec<f64> {
        let sum = |at: usize| {
            let near = at.saturating_sub(reach)..=(at + reach).min(from.len() - 1);
            near.map(|other| from[other] * bell[at.abs_diff(other)]).sum::<f64>()
        };
        let all: Vec<f64> = (0..from.len()).map(sum).collect();
        let most = all.iter().copied().fold(0.0, f64::max);
        all.into_iter().map(|p| p / most).collect()
    };
    let weighed = |p: &[f64], z: f64| -> Vec<f64> {
        p.iter().zip(&grid).map(|(p, x)| p * (-(z - x).abs()).exp()).collect()
    };
    let mut forward: Vec<Vec<f64>> = Vec::new();
    let mut before: Vec<f64> = grid.iter().map(|x| (-0.5 * x * x).exp()).collect();
    for z in seen {
        before = weighed(&moved(&before), *z);
        forward.push(before.clone());
    }
    let mut after = vec![1.0; grid.len()];
    let mut found = Vec::new();
    for (z, forward) in seen.iter().zip(&forward).rev() {
        let both: Vec<f64> = forward.iter().zip(&after).map(|(one, other)| one * other).collect();
        let sum: f64 = both.iter().zip(&grid).map(|(p, x)| p * x).sum();
        found.push(sum / both.iter().sum::<f64>());
        after = moved(&weighed(&after, *z));
    }
    found.reverse();
    found
}

/// Few particles follow what moves faster than the program says: the paths of one run agree with each other, but not with those of
/// another. Errors between the paths of one run were a fifth of the distance from the right values.
#[test]
fn errors_cover_what_another_run_would_answer() {
    let model = model_of(
        "program Slow { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(X^-1, 0.05); P(Z | X) = laplace(X, 1); } }",
    );
    let seen = (0..50).map(|t| {
        let jump = if t % 20 == 15 { 3.0 } else { 0.0 };
        1.5 * (0.15 * f64::from(t)).sin() + 0.4 * f64::from((7 * t) % 5 - 2) + jump
    });
    let seen: Vec<f64> = seen.collect();
    let expected = mean_by_grid(&seen);
    // Another computation, on a wider grid, gave 0.40047 and 0.08392 of data that were rounded to three digits.
    assert!((expected[0] - 0.40047).abs() < 1e-3 && (expected[49] - 0.08392).abs() < 1e-3, "{expected:?}");
    let rows = column("Z", &seen);
    let (seeds, mut square) = (10, 0.0);
    for seed in 1..=seeds {
        let found = by_particles(&model, "smooth P(X | Z)", &rows, Sampling { particles: 300, seed });
        for (instant, right) in expected.iter().enumerate() {
            let [mean, error] = mean(&found, instant);
            square += ((mean - right) / error).powi(2) / (seeds as f64 * seen.len() as f64);
        }
    }
    assert!(square < 4.0, "{square}");
}
