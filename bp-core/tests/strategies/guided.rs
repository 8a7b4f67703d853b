//! Guided particles: their estimates lie within their standard errors as often as these state.
//!
//! In: programs whose hidden reals have normal forms, many seeds. Out: estimates with their errors. Invariant: expected values are
//! Kalman filters by hand, and integrals over a grid.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask_over_time_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;
use std::f64::consts::{PI, TAU};

pub(super) fn by_particles(
    model: &Model,
    text: &str,
    rows: &[Vec<(String, f64)>],
    sampling: Sampling,
) -> Answer {
    let by = Some(Strategy::Particles);
    let answers = ask_over_time_by(model, &question(model, text), rows, &Inputs::new(), sampling, by);
    answers.unwrap_or_else(|error| panic!("{text}: {error}")).remove(0)
}

pub(super) fn column(name: &str, values: &[f64]) -> Vec<Vec<(String, f64)>> {
    values.iter().map(|value| vec![(name.to_owned(), *value)]).collect()
}

pub(super) fn mean(answer: &Answer, row: usize) -> [f64; 2] {
    match answer.answer[row].figure {
        Figure::Real { mean, .. } => mean,
        figure => panic!("{figure:?}"),
    }
}

/// The estimates of many seeds, in standard errors from the right value: their mean square is near 1, and few are beyond 2.
#[track_caller]
pub(super) fn covers(of: impl Fn(u64) -> [f64; 2], expected: f64, seeds: u64) {
    let off: Vec<f64> = (0..seeds).map(of).map(|[found, error]| (found - expected) / error).collect();
    let square = off.iter().map(|z| z * z).sum::<f64>() / seeds as f64;
    let beyond = off.iter().filter(|z| z.abs() > 2.0).count() as f64 / seeds as f64;
    assert!(
        square > 0.4 && square < 2.0 && beyond < 0.16,
        "mean square {square}, beyond two {beyond}: {off:?}"
    );
}

/// |X| in a form that does not matter keeps X from being carried as a normal law.
const DRAWN: &str = "program Drawn { variables { X, X^-1, Z, Q : real; }
    decomposition { P(X^-1) P(X | X^-1) P(Z | X) P(Q | X) }
    forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(0.9 * X^-1 + 0.2, 0.4);
            P(Z | X) = normal(2 * X, 0.5); P(Q | X) = normal(abs(X), 1); } }";

const SEEN: [f64; 10] = [0.3, 1.9, 2.4, 1.0, -0.6, -2.0, -1.1, 3.0, 5.5, 6.1];

#[test]
fn of_a_linear_program_the_kalman_filter() {
    let (mut m, mut v, mut ln) = (0.0, 1.0, 0.0);
    for z in SEEN {
        (m, v) = (0.9 * m + 0.2, 0.81 * v + 0.16);
        let spread = 4.0 * v + 0.25;
        ln -= 0.5 * ((z - 2.0 * m) * (z - 2.0 * m) / spread + (TAU * spread).ln());
        (m, v) = (m + 2.0 * v / spread * (z - 2.0 * m), v - 4.0 * v * v / spread);
    }
    let model = model_of(DRAWN);
    let asked = |seed: u64| {
        let answer =
            by_particles(&model, "filter P(X | Z)", &column("Z", &SEEN), Sampling { particles: 100, seed });
        // All weights are equal: ln P is exact, and each particle is an independent draw.
        assert!((answer.ln_evidence.unwrap() - ln).abs() < 1e-9, "{:?} {ln}", answer.ln_evidence);
        assert!((answer.estimate.as_ref().unwrap().effective - 100.0).abs() < 1e-6);
        mean(&answer, 0)
    };
    covers(asked, m, 40);
}

/// The filtered mean and ln P by sums over a grid.
fn on_grid(
    z: &[f64],
    moved: fn(f64) -> f64,
    [start, noise]: [f64; 2],
    ln_seen: impl Fn(f64, f64) -> f64,
) -> [f64; 2] {
    let step = 0.02;
    let grid: Vec<f64> = (-350..=350).map(|point| f64::from(point) * step).collect();
    let bell = |x: f64, m: f64, s: f64| (-0.5 * ((x - m) / s).powi(2)).exp() / (s * TAU.sqrt());
    let mut belief: Vec<f64> = grid.iter().map(|x| bell(*x, 0.5, start)).collect();
    for z in z {
        let centres: Vec<f64> = grid.iter().map(|x| moved(*x)).collect();
        let at = |x: &f64| {
            let sum: f64 = centres.iter().zip(&belief).map(|(m, p)| p * bell(*x, *m, noise)).sum();
            sum * step * ln_seen(*z, *x).exp()
        };
        belief = grid.iter().map(at).collect();
    }
    let total: f64 = belief.iter().sum();
    [grid.iter().zip(&belief).map(|(x, p)| x * p).sum::<f64>() / total, (total * step).ln()]
}

#[test]
fn of_a_mildly_non_linear_program_the_integral() {
    let model = model_of(
        "program Bent { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0.5, 1); P(X | X^-1) = normal(X^-1 + 0.4 * sin(X^-1), 0.5);
                 P(Z | X) = normal(exp(0.3 * X), 0.3); } }",
    );
    let z = [1.2, 0.9, 1.6, 2.1, 1.3, 1.0, 0.7, 1.1];
    let ln_seen = |z: f64, x: f64| -0.5 * ((z - (0.3 * x).exp()) / 0.3).powi(2) - (0.3 * TAU.sqrt()).ln();
    let [expected, ln] = on_grid(&z, |x| x + 0.4 * x.sin(), [1.0, 0.5], ln_seen);
    let asked = |seed: u64| {
        let answer =
            by_particles(&model, "filter P(X | Z)", &column("Z", &z), Sampling { particles: 300, seed });
        assert!((answer.ln_evidence.unwrap() - ln).abs() < 0.4, "{:?} {ln}", answer.ln_evidence);
        mean(&answer, 0)
    };
    covers(asked, expected, 40);
}

/// The density of what is observed is not normal: draws follow the program, and are resampled.
#[test]
fn errors_count_particles_of_one_origin_once() {
    let model = model_of(
        "program Jumps { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0.5, 1); P(X | X^-1) = normal(X^-1, 0.2); P(Z | X) = laplace(X, 0.4); } }",
    );
    let z = [0.1, 0.9, 0.4, 0.6, 1.9, 1.0, 0.7, 1.1, 0.8, 0.2, 0.9, 1.4];
    let ln_seen = |z: f64, x: f64| -(z - x).abs() / 0.4 - 0.8f64.ln();
    let [expected, _] = on_grid(&z, |x| x, [1.0, 0.2], ln_seen);
    let asked = |seed: u64| {
        let sampling = Sampling { particles: 400, seed };
        mean(&by_particles(&model, "filter P(X | Z)", &column("Z", &z), sampling), 0)
    };
    covers(asked, expected, 40);
}

/// Both signs explain X² = 4: a guide along one path would see one of them.
#[test]
fn a_guide_that_misses_a_part_is_not_believed() {
    let model = model_of(
        "program Signs { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0.1, 1); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X * X, 0.5); } }",
    );
    let ln_seen = |z: f64, x: f64| -0.5 * ((z - x * x) / 0.5).powi(2) - (0.5 * TAU.sqrt()).ln();
    let z = [4.0, 5.0];
    let [_, ln] = on_grid(&z, |x| x, [1.0, 1.0], ln_seen);
    let answer =
        by_particles(&model, "filter P(X | Z)", &column("Z", &z), Sampling { particles: 20_000, seed: 3 });
    assert!((answer.ln_evidence.unwrap() - ln).abs() < 0.1, "{:?} {ln}", answer.ln_evidence);
    let [found, error] = mean(&answer, 0);
    assert!(found.abs() < 1.0 && error < 0.2, "{found} {error}");
}

/// Laurens and Droulez in three dimensions, rotated about the vertical: there the program is linear, and a Kalman filter of one
/// axis is exact. The prior pulls the canals out of the reach of unguided particles: they answer 0.53.
#[test]
fn the_head_turns_as_the_kalman_filter_says() {
    let model = model_of(
        "program Vestibular over t in Time {
         parameters { sigma_omega : real = 0.6981317; sigma_a : real = 2.943; sigma_v : real = 0.1745329; sigma_f : real = 0.02;
                      tau_c : real = 4; dt : real = 0.1; }
         variables { Omega, A, G, G^-1, C, C^-1, V, F : real[3]; }
         decomposition { P(G^-1) P(C^-1) P(Omega) P(A) P(C | C^-1 Omega) P(G | G^-1 Omega) P(V | Omega C) P(F | G A) }
         forms { P(G^-1) = previous(G) else normal([0, 0, 9.81], 0.05); P(C^-1) = previous(C) else normal(0, 0.0001);
                 P(Omega) = normal(0, sigma_omega); P(A) = normal(0, sigma_a);
                 P(C | C^-1 Omega) = dirac((tau_c * C^-1 + dt * Omega) / (tau_c + dt));
                 P(G | G^-1 Omega) = dirac(rotate(G^-1, -Omega * dt));
                 P(V | Omega C) = normal(Omega - C, sigma_v); P(F | G A) = normal(G + A, sigma_f); } }",
    );
    let (rate, keep, gain) = (PI / 3.0, 4.0 / 4.1, 0.1 / 4.1);
    let [mut canal, mut c, mut p, mut omega] = [0.0, 0.0, 1e-8, 0.0];
    let (prior, noise) = (0.6981317f64.powi(2), 0.1745329f64.powi(2));
    let mut rows = Vec::new();
    for _ in 0..200 {
        canal = keep * canal + gain * rate;
        let v = rate - canal;
        let names = ["V[0]", "V[1]", "V[2]", "F[0]", "F[1]", "F[2]"];
        rows.push(names.map(str::to_owned).into_iter().zip([0.0, 0.0, v, 0.0, 0.0, 9.81]).collect());
        // The joint of Omega and C before the observation, and its update.
        let (pc, both) = (keep * keep * p + gain * gain * prior, gain * prior);
        let spread = prior + pc - 2.0 * both + noise;
        let surprise = v + keep * c;
        omega = (prior - both) / spread * surprise;
        c = keep * c + (both - pc) / spread * surprise;
        p = pc - (both - pc).powi(2) / spread;
    }
    for particles in [60, 240] {
        let answer = by_particles(&model, "filter P(Omega | V F)", &rows, Sampling { particles, seed: 1 });
        let [found, error] = mean(&answer, 2);
        assert!(error < 0.1 && (found - omega).abs() < 4.0 * error, "{found} ± {error}, expected {omega}");
    }
}
