//! Particle filters, compared with the exact sum over all sequences of switches.
//!
//! In: a switching linear program, and one that is not linear. Out: estimates. Invariant: expected values are sums over
//! every sequence of switches of Kalman filters in closed form, or integrals over a grid.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask_over_time, ask_over_time_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::plan::{Notation, Options, Route, plan};
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::strategies::over_time::By;

fn asked(model: &Model, text: &str, z: &[f64], particles: usize, seed: u64) -> Answer {
    let rows: Vec<_> = z.iter().map(|z| vec![("Z".to_owned(), *z)]).collect();
    let sampling = Sampling { particles, seed };
    ask_over_time(model, &question(model, text), &rows, &Inputs::new(), sampling).unwrap().remove(0)
}

/// A target that drifts, or turns back and is seen badly. `drawn` keeps X from being carried as a normal law.
fn switching(drawn: bool) -> Model {
    // Observed through |X|, which is itself never observed, X is no longer linear in all forms that use it.
    let (variable, factor, form) = match drawn {
        true => (", Q", " P(Q | X)", " P(Q | X) = normal(abs(X), 1);"),
        false => ("", "", ""),
    };
    model_of(&format!(
        "program Target {{ variables {{ S, S^-1 : bool; X, X^-1, Z{variable} : real; }}
         decomposition {{ P(S^-1) P(X^-1) P(S | S^-1) P(X | X^-1 S) P(Z | X S){factor} }}
         forms {{ P(S^-1) = previous(S) else bernoulli(0.5); P(X^-1) = previous(X) else normal(0, 1);
                  P(S | S^-1) = bernoulli(if S^-1 {{ 0.8 }} else {{ 0.1 }});
                  P(X | X^-1 S) = if S {{ normal(-0.9 * X^-1, 0.2) }} else {{ normal(X^-1 + 0.5, 0.5) }};
                  P(Z | X S) = normal(X, if S {{ 1.5 }} else {{ 0.4 }});{form} }} }}"
    ))
}

const SEEN: [f64; 6] = [0.4, 1.5, -1.0, 0.9, 1.4, 2.2];

/// P(S at the end), E X and ln P(z), by the sum over 2⁷ sequences of switches.
fn exact() -> [f64; 3] {
    let (mut total, mut on, mut first) = (0.0, 0.0, 0.0);
    for sequence in 0..128usize {
        let state = |instant: usize| sequence >> instant & 1;
        let (mut p, mut mean, mut variance) = (0.5, 0.0, 1.0);
        for (instant, z) in SEEN.iter().enumerate() {
            let (before, now) = (state(instant), state(instant + 1));
            let turns = [0.1, 0.8][before];
            p *= if now == 1 { turns } else { 1.0 - turns };
            (mean, variance) = match now {
                1 => (-0.9 * mean, 0.81 * variance + 0.04),
                _ => (mean + 0.5, variance + 0.25),
            };
            let spread = variance + [0.16, 2.25][now];
            p *= (-0.5 * (z - mean).powi(2) / spread).exp() / (std::f64::consts::TAU * spread).sqrt();
            mean += variance / spread * (z - mean);
            variance -= variance * variance / spread;
        }
        total += p;
        on += p * state(6) as f64;
        first += p * mean;
    }
    [on / total, first / total, total.ln()]
}

fn figures(answer: &Answer) -> [[f64; 2]; 2] {
    let Figure::Estimated { p, error } = answer.answer[1].figure else { panic!("{answer:?}") };
    let Figure::Real { mean, .. } = answer.answer[2].figure else { panic!("{answer:?}") };
    [[p, error], mean]
}

fn linear(model: &Model) -> Vec<String> {
    let made = plan(model, &question(model, "filter P(S X | Z)"), Options::default()).unwrap();
    let Route::OverTime(route) = &made.routes[0] else { panic!("over time") };
    let By::Particles { linear, .. } = &route.by else { panic!("by particles") };
    linear.iter().map(|id| model.variable_name(*id)).collect()
}

#[test]
fn switching_laws_are_the_sum_over_all_sequences() {
    let [on, first, ln] = exact();
    for drawn in [false, true] {
        let model = switching(drawn);
        let answer = asked(&model, "filter P(S X | Z)", &SEEN, 40_000, 1);
        let [switch, mean] = figures(&answer);
        assert!((switch[0] - on).abs() < 0.015, "{switch:?}, expected {on}");
        assert!((mean[0] - first).abs() < 0.03, "{mean:?}, expected {first}");
        assert!((answer.ln_evidence.unwrap() - ln).abs() < 0.05, "{:?}, expected {ln}", answer.ln_evidence);
    }
    assert_eq!(linear(&switching(false)), ["X", "X^-1", "Z"]);
    assert_eq!(linear(&switching(true)), ["Z", "Q"], "X is drawn, and Z is normal around it");
}

#[test]
fn linear_variables_that_are_not_drawn_scatter_less() {
    let [on, first, ln] = exact();
    let scatter = |model: &Model| {
        let (mut mean, mut evidence, mut switch) = (0.0, 0.0, 0.0);
        for seed in 0..40 {
            let answer = asked(model, "filter P(S X | Z)", &SEEN, 200, seed);
            let [s, x] = figures(&answer);
            switch += (s[0] - on).powi(2);
            mean += (x[0] - first).powi(2);
            evidence += (answer.ln_evidence.unwrap() - ln).powi(2);
        }
        [mean, evidence, switch]
    };
    let (carried, drawn) = (scatter(&switching(false)), scatter(&switching(true)));
    assert!(
        carried.iter().zip(drawn).all(|(carried, drawn)| *carried < 0.7 * drawn),
        "{carried:?} {drawn:?}"
    );
}

/// The mean square of the error of ln P in stated errors is 1, up to the scatter of 60 runs.
#[test]
fn ln_p_has_its_standard_error() {
    let ln = exact()[2];
    for drawn in [false, true] {
        let model = switching(drawn);
        for text in ["filter P(S | Z)", "smooth P(S | Z)", "sequence P(S X | Z)"] {
            let square = |seed: u64| {
                let answer = asked(&model, text, &SEEN, 300, seed);
                let error = answer.estimate.expect("an estimate").ln_evidence_error.expect("its error");
                assert!(error > 0.0 && error < 0.5, "{error}");
                ((answer.ln_evidence.unwrap() - ln) / error).powi(2)
            };
            let mean = (0..60).map(square).sum::<f64>() / 60.0;
            assert!((0.3..3.0).contains(&mean), "{text}: {mean}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let model = switching(false);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| asked(&model, "filter P(S X | Z)", &SEEN, 500, 5))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(8));
}

#[test]
fn a_program_that_is_not_linear_is_the_integral_over_a_grid() {
    let model = model_of(
        "program Bent { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(2 * sin(X^-1), 0.5); P(Z | X) = normal(X * X / 2, 0.3); } }",
    );
    let z = [1.0, 0.4, 1.6];
    let answer = asked(&model, "filter P(X | Z)", &z, 40_000, 2);
    let (step, grid) = (0.02, (-300..=300).map(|point| f64::from(point) * 0.02).collect::<Vec<_>>());
    let bell =
        |x: f64, m: f64, s: f64| (-0.5 * ((x - m) / s).powi(2)).exp() / (s * std::f64::consts::TAU.sqrt());
    let mut belief: Vec<f64> = grid.iter().map(|x| bell(*x, 0.0, 1.0)).collect();
    for z in z {
        let at = |x: &f64| {
            let moved: f64 =
                grid.iter().zip(&belief).map(|(before, p)| p * bell(*x, 2.0 * before.sin(), 0.5)).sum();
            moved * step * bell(z, x * x / 2.0, 0.3)
        };
        belief = grid.iter().map(at).collect();
    }
    let total: f64 = belief.iter().sum();
    let mean = grid.iter().zip(&belief).map(|(x, p)| x * p).sum::<f64>() / total;
    let Figure::Real { mean: found, .. } = answer.answer[0].figure else { panic!("{answer:?}") };
    assert!((found[0] - mean).abs() < 0.06, "{found:?}, expected {mean}");
    assert!((answer.ln_evidence.unwrap() - (total * step).ln()).abs() < 0.05);
    // Draws and the mode are read from particles too; by symmetry there is a mode on either side of 0.
    let size = |text: &str| {
        let answer = asked(&model, text, &z, 40_000, 2);
        let values = answer.answer.iter().map(|row| row.values[0].1.parse::<f64>().unwrap().abs());
        values.sum::<f64>() / answer.answer.len() as f64
    };
    let expected = grid.iter().zip(&belief).map(|(x, p)| x.abs() * p).sum::<f64>() / total;
    let (drawn, mode) = (size("draw(20000) filter P(X | Z)"), size("argmax filter P(X | Z)"));
    assert!((drawn - expected).abs() < 0.02, "{drawn}, expected {expected}");
    let (top, _) = grid.iter().zip(&belief).max_by(|one, other| one.1.total_cmp(other.1)).unwrap();
    assert!((mode - top.abs()).abs() < 0.15, "{mode}, expected {top}");
    let estimate = answer.estimate.unwrap();
    assert!(estimate.effective > 1000.0 && estimate.warning.is_none());
    // No particle can lead to this observation.
    let rows = vec![vec![("Z".to_owned(), -1e6)]];
    let error = ask_over_time(
        &model,
        &question(&model, "filter P(X | Z)"),
        &rows,
        &Inputs::new(),
        Sampling::default(),
    );
    assert!(error.is_err() || error.unwrap()[0].estimate.as_ref().unwrap().warning.is_some());
    // Chains do not use particles.
    let rows = vec![vec![("Z".to_owned(), 1.0)]];
    let asked = question(&model, "filter P(X | Z)");
    let by = Some(Strategy::Gibbs);
    let error = ask_over_time_by(&model, &asked, &rows, &Inputs::new(), Sampling::default(), by).unwrap_err();
    assert!(error.to_string().contains("`gibbs` does not answer questions over time"), "{error}");
}

#[test]
fn the_head_in_three_dimensions_turns_in_its_particles() {
    // Laurens and Droulez (2007): once the velocity is drawn, gravity and the canals are linear.
    let program = crate::support::program("vestibular");
    let model = model_of(&program);
    let made = plan(&model, &question(&model, "filter P(G | V F)"), Options::default()).unwrap();
    let Route::OverTime(route) = &made.routes[0] else { panic!("over time") };
    let By::Particles { linear, .. } = &route.by else { panic!("by particles") };
    let names: Vec<String> = linear.iter().map(|id| model.variable_name(*id)).collect();
    assert!(
        ["G", "G^-1", "C", "C^-1", "A"].iter().all(|name| names.iter().any(|own| own == name)),
        "{names:?}"
    );
    assert!(!names.iter().any(|name| name == "Omega"), "{names:?}");
    let text = format!("{:?}", made.derivation(&model, Notation::Unicode));
    assert!(text.contains("Rao-Blackwell") && text.contains("particle filter"), "{text}");
}

#[test]
fn particles_that_cannot_be_are_followed_no_further() {
    // True stays true and is never observed; the start is false with certainty, and false was observed at each instant.
    // |X| rules out the closed form for X in the second program.
    for drawn in ["", " Q : real;"] {
        let (factor, form) =
            if drawn.is_empty() { ("", "") } else { (" P(Q | X)", " P(Q | X) = normal(abs(X), 1);") };
        let model = model_of(&format!(
            "program Dead {{ variables {{ S, S^-1, C : bool; X, X^-1, Z : real;{drawn} }}
             decomposition {{ P(S^-1) P(X^-1) P(S | S^-1) P(C | S) P(X | X^-1 S) P(Z | X){factor} }}
             forms {{ P(S^-1) = previous(S) else bernoulli(0); P(X^-1) = previous(X) else normal(0, 1);
                      P(S | S^-1) = bernoulli(if S^-1 {{ 1 }} else {{ 0.3 }}); P(C | S) = bernoulli(if S {{ 0 }} else {{ 0.5 }});
                      P(X | X^-1 S) = normal(X^-1, if S {{ 9 }} else {{ 0.5 }}); P(Z | X) = normal(X, 2);{form} }} }}"
        ));
        let seen = [0.5, 1.0, -0.5];
        let rows: Vec<_> = seen.map(|z| vec![("C".to_owned(), 1.0), ("Z".to_owned(), z)]).to_vec();
        let sampling = Sampling { particles: 20_000, ..Sampling::default() };
        let asked = question(&model, "filter P(S X | C Z)");
        let answer = ask_over_time(&model, &asked, &rows, &Inputs::new(), sampling).unwrap().remove(0);
        // A Kalman filter by hand, and (0.7 · 0.5)³.
        let (mut mean, mut variance, mut ln) = (0.0, 1.0, 3.0 * 0.35f64.ln());
        for z in seen {
            variance += 0.25;
            let spread = variance + 4.0;
            ln -= 0.5 * ((z - mean) * (z - mean) / spread + (std::f64::consts::TAU * spread).ln());
            mean += variance / spread * (z - mean);
            variance -= variance * variance / spread;
        }
        let [switch, found] = figures(&answer);
        assert_eq!(switch[0], 0.0);
        assert!((found[0] - mean).abs() < 0.05, "{found:?}, expected {mean}");
        assert!((answer.ln_evidence.unwrap() - ln).abs() < 0.05, "{:?}, expected {ln}", answer.ln_evidence);
    }
}

#[test]
fn a_real_has_a_form_of_its_own_at_the_first_instant() {
    let model = model_of(
        "program Walk { variables { X, X^-1, Z : real; } decomposition { P(initial(X)) P(X | X^-1) P(Z | X) }
         forms { P(initial(X)) = normal(3, 2); P(X | X^-1) = normal(0.5 * X^-1, 1); P(Z | X) = normal(X, 1); } }",
    );
    // By hand: N(3, 4) and z = 5 give N(4.6, 0.8); a step gives N(2.3, 1.2), and z = 1 gives mean 2.3 − 1.3 · 1.2 / 2.2.
    let of = |z: &[f64]| match asked(&model, "filter P(X | Z)", z, 4, 1).answer[0].figure {
        Figure::Real { mean, deviation, .. } => [mean[0], deviation[0]],
        Figure::Normal { mean, deviation } => [mean, deviation],
        figure => panic!("{figure:?}"),
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-9);
        assert!(all, "{found:?}, expected {expected:?}");
    };
    near(of(&[5.0]), [4.6, 0.8f64.sqrt()]);
    near(of(&[5.0, 1.0]), [2.3 - 1.3 * 1.2 / 2.2, (1.2 / 2.2f64).sqrt()]);
}

/// A constant of which few draws are left has no standard error; with its posterior as broad as its prior it has one.
#[test]
fn a_constant_over_time_is_refused_where_its_draws_run_out() {
    let program = |deviation: f64| {
        model_of(&format!(
            "program Constant over t in Time {{ variables {{ M, Y : real; }} decomposition {{ P(M^-1) P(M | M^-1) P(Y | M) }}
             forms {{ P(M^-1) = uniform(-1, 1); P(M | M^-1) = dirac(M^-1); P(Y | M) = student_t(5, M, {deviation}); }} }}"
        ))
    };
    let ask = |model: &Model, count: usize| {
        let rows: Vec<Vec<(String, f64)>> =
            (0..count).map(|t| vec![("Y".to_owned(), 0.2 + if t % 2 == 0 { 0.01 } else { -0.01 })]).collect();
        ask_over_time(
            model,
            &question(model, "filter P(M | Y)"),
            &rows,
            &Inputs::new(),
            Sampling { particles: 1000, seed: 1 },
        )
    };
    let error = ask(&program(0.02), 200).unwrap_err().to_string();
    assert!(error.contains("`M` is constant over time") && error.contains("(`rows`)"), "{error}");
    assert!(ask(&program(50.0), 20).is_ok());
}
