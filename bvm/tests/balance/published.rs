//! Published behaviour of the vestibular model (Laurens and Angelaki, *eLife* 6:e28074, 2017), in one dimension.
//!
//! `docs/balance.md` prints the table; `cargo test -p bvm --test balance published -- --nocapture` prints ours.

use bp_core::compiler::strategies::gaussian::Filter;
use bvm::programs::tilt_translation::{self, motion, turn};
use bvm::vestibular::human::DT;

/// Within a part of the published value.
#[track_caller]
pub(crate) fn near(name: &str, found: f64, published: f64, most: f64) {
    println!("{name}: {found:.4}, published {published}");
    assert!((found - published).abs() <= most, "{name}: {found}, published {published}");
}

fn tilting(question: motion::Question) -> Filter {
    let mut filter = question.filter().unwrap();
    filter.settle().unwrap();
    filter
}

fn vertical(question: turn::Question) -> Filter {
    let mut filter = question.filter().unwrap();
    filter.settle().unwrap();
    filter
}

/// The true state of the canals' fluid, at rest at first; gives their signal.
#[derive(Default)]
struct Canal(f64);

impl Canal {
    fn signal(&mut self, rate: f64) -> f64 {
        self.0 = (4.0 * self.0 + DT * rate) / (4.0 + DT);
        rate - self.0
    }
}

/// Means of Omega, C, G, A at each instant of a passive motion, of the signals of canals and otoliths.
fn passive(filter: &mut Filter, steps: usize, mut of: impl FnMut(f64) -> [f64; 2]) -> Vec<[f64; 4]> {
    let one = |step: usize| {
        let [v, f] = of(step as f64 * DT);
        let belief = filter.step(&[("V", v), ("F", f), ("Turning", 0.0), ("Moving", 0.0)]).unwrap();
        ["Omega", "C", "G", "A"].map(|name| belief.mean_of(name).unwrap())
    };
    (0..steps).map(one).collect()
}

/// Means of Omega and C about a vertical axis, of the signal of the canals and the command.
fn turned(filter: &mut Filter, steps: usize, of: impl Fn(usize) -> [f64; 2]) -> Vec<[f64; 2]> {
    let one = |step: usize| {
        let [v, command] = of(step);
        let belief = filter.step(&[("V", v), ("Turning", command)]).unwrap();
        ["Omega", "C"].map(|name| belief.mean_of(name).unwrap())
    };
    (0..steps).map(one).collect()
}

#[test]
fn converged_gains() {
    let upright = vertical(tilt_translation::turn());
    let gain = |filter: &Filter, of: &str, by: &str| filter.gain_of(of, by).unwrap();
    near("yaw: Omega by V", gain(&upright, "Omega", "V"), 0.9428, 0.5e-4);
    near("yaw: C by V, /dt", gain(&upright, "C", "V") / DT, 0.1892, 0.5e-4);
    let tilted = tilting(tilt_translation::motion());
    for (of, by, scale, published) in [
        ("Omega", "V", 1.0, 0.9432),
        ("C", "V", DT, 0.2289),
        ("G", "V", DT, 0.9124),
        ("A", "V", DT, -0.9124),
        ("C", "F", DT, 0.1370),
        ("G", "F", DT, 0.7553),
        ("A", "F", 1.0, 0.9924),
    ] {
        near(&format!("tilt: {of} by {by}"), gain(&tilted, of, by) / scale, published, 0.5e-4);
    }
}

#[test]
fn perceived_rotation_decays_by_the_formula() {
    // τ = τ_c √(1 + (σ_Ω/σ_V)²), the closed-loop pole in the limit of small steps.
    for (tau_c, omega_deg, v_deg) in [
        (4.0, 40.0, 10.0),
        (4.0, 40.0, 5.0),
        (4.0, 40.0, 20.0),
        (6.0, 40.0, 10.0),
        (5.7, 40.0, 10.0),
        (4.0, 20.0, 10.0),
        (4.0, 80.0, 10.0),
        (3.0, 30.0, 15.0),
        (8.0, 10.0, 10.0),
        (4.0, 60.0, 6.0),
    ] {
        let (omega, v) = (f64::to_radians(omega_deg), f64::to_radians(v_deg));
        let question = tilt_translation::turn().first_c(1.0);
        let mut filter = vertical(question.tau_c(tau_c).sigma_omega(omega).sigma_v(v));
        let found = turned(&mut filter, 2001, |_| [0.0; 2]);
        let fall = 10.0 / (found[1000][0] / found[2000][0]).ln();
        let formula = tau_c * (1.0 + (omega / v).powi(2)).sqrt();
        near(&format!("decay, {tau_c} s, {omega_deg}, {v_deg} deg/s"), fall, formula, 2e-3 * formula);
    }
}

#[test]
fn canal_state_of_a_turn_and_active_turns() {
    for (seconds, published) in [(0.5, 21.0), (9.0, 9.0)] {
        let rate = |time: f64| if time < seconds - 1e-9 { 90.0 / seconds } else { 0.0 };
        let mut canal = Canal::default();
        let (mut signals, mut states) = (Vec::new(), Vec::new());
        for step in 0..2000 {
            signals.push(canal.signal(rate(f64::from(step) * DT)));
            states.push(canal.0);
        }
        let mut filter = vertical(tilt_translation::turn());
        let found = turned(&mut filter, 2000, |step| [signals[step], rate(step as f64 * DT)]);
        let peak = found.iter().map(|it| it[1]).fold(0.0, f64::max);
        near(&format!("canal state of 90 deg in {seconds} s"), peak, published, 0.2);
        // Active turns: the command explains everything.
        let error = found.iter().enumerate().map(|(step, it)| (it[0] - rate(step as f64 * DT)).abs());
        assert!(error.fold(0.0, f64::max) < 1e-9 * 180.0, "an active turn is felt exactly");
        let of_canal = found.iter().zip(&states).map(|(it, state)| (it[1] - state).abs()).fold(0.0, f64::max);
        assert!(of_canal < 1e-7, "and so is the state of the canals: {of_canal}");
    }
}

#[test]
fn optokinetic_jump_plateau_and_after_effect() {
    let mut filter = tilt_translation::seen().filter().unwrap();
    filter.settle().unwrap();
    let mut state = [0.0; 2];
    let mut found = Vec::new();
    for _ in 0..6000 {
        let belief = filter.step(&[("V", 0.0), ("Vision", 1.0), ("Turning", 0.0)]).unwrap();
        state = ["Omega", "C"].map(|name| belief.mean_of(name).unwrap());
        found.push(state[0]);
    }
    // The text says 70 % and 96 %; the released code gives 65.9 % and 97.0 %.
    near("optokinetic jump", found[0], 0.659, 0.5e-3);
    near("optokinetic plateau", found[5999], 0.970, 0.5e-3);
    // In the dark the store decays as any rotation: it starts from its state.
    let mut dark = vertical(tilt_translation::turn().first_c(state[1]));
    let after = turned(&mut dark, 3001, |_| [0.0; 2]);
    near("after-nystagmus, s", 20.0 / (after[1000][0] / after[3000][0]).ln(), 16.49, 0.05);
}

#[test]
fn somatogravic_tilt() {
    let mut filter = tilting(tilt_translation::motion());
    let found = passive(&mut filter, 2000, |_| [0.0, 1.0]);
    let time = found.iter().position(|it| it[3] < (-1f64).exp()).unwrap() as f64 * DT;
    near("somatogravic, 1/e of A, s", time, 1.16, 0.011);
    near("somatogravic, largest G", found.iter().map(|it| it[2]).fold(0.0, f64::max), 1.114, 2e-3);
    for (time, published) in
        [(0.5, 0.668), (1.0, 0.428), (1.3, 0.320), (2.0, 0.127), (3.0, -0.024), (5.0, -0.113)]
    {
        near(&format!("A after {time} s"), found[(time / DT) as usize][3], published, 6e-3);
    }
}

#[test]
fn tilt_and_translation_over_frequency() {
    for (hz, translation, illusion, tilt) in [
        (0.05, 0.40, 1.12, 0.98),
        (0.1, 0.71, 0.90, 0.95),
        (0.2, 0.90, 0.55, 0.93),
        (0.5, 0.98, 0.24, 0.92),
        (1.0, 0.99, 0.12, 0.91),
    ] {
        let turn = std::f64::consts::TAU * hz;
        let steps = (40.0 / DT) as usize;
        // The amplitude over the last 20 s, whole periods.
        let amplitude = |found: &[[f64; 4]], of: usize| {
            let late = found.iter().enumerate().skip(steps / 2);
            let [a, b] = late.fold([0.0; 2], |[a, b], (step, it)| {
                let angle = turn * step as f64 * DT;
                [a + it[of] * angle.cos(), b + it[of] * angle.sin()]
            });
            2.0 * a.hypot(b) / (steps / 2) as f64
        };
        let mut filter = tilting(tilt_translation::motion());
        let moved = passive(&mut filter, steps, |time| [0.0, (turn * time).sin()]);
        near(&format!("translation, {hz} Hz: A"), amplitude(&moved, 3), translation, 0.0101);
        near(&format!("translation, {hz} Hz: G"), amplitude(&moved, 2), illusion, 0.0101);
        let mut canal = Canal::default();
        let signals: Vec<f64> = (0..steps)
            .map(|step| {
                let angle = |step: f64| (turn * step * DT).sin();
                canal.signal((angle(step as f64) - angle(step as f64 - 1.0)) / DT)
            })
            .collect();
        let mut filter = tilting(tilt_translation::motion());
        let tilted =
            passive(&mut filter, steps, |time| [signals[(time / DT).round() as usize], (turn * time).sin()]);
        near(&format!("tilt, {hz} Hz: G"), amplitude(&tilted, 2), tilt, 0.0101);
    }
}

/// A minute of rotation at a rate of 1 about a vertical axis, felt passively; then the axis is horizontal. The filter of tilts begins
/// with what is known of the canals then, mean and deviation, and its gains change from there: those of the published simulation,
/// which are not those of a head that was always tilted. Signals of the canals go on.
fn tilted_after_a_minute() -> (Filter, Canal) {
    let (mut filter, mut canal) = (vertical(tilt_translation::turn()), Canal::default());
    let mut known = [0.0; 2];
    for _ in 0..6000 {
        let belief = filter.step(&[("V", canal.signal(1.0)), ("Turning", 0.0)]).unwrap();
        let row = belief.variables.iter().position(|name| name == "C").unwrap();
        known = [belief.mean[row], belief.covariance[(row, row)].sqrt()];
    }
    (tilt_translation::motion().first_c(known[0]).sigma_c(known[1]).filter().unwrap(), canal)
}

/// The time constant of the exponential that fits best, by least squares, s.
fn fitted(values: &[f64]) -> f64 {
    let left = |tau: f64| {
        let shape = |step: usize| (-(step as f64) * DT / tau).exp();
        let sum = |of: &dyn Fn(usize) -> f64| (0..values.len()).map(of).sum::<f64>();
        let size = sum(&|step| shape(step) * values[step]) / sum(&|step| shape(step).powi(2));
        sum(&|step| (values[step] - size * shape(step)).powi(2))
    };
    let all = (50..1000).map(|hundredth| f64::from(hundredth) * 0.01);
    all.min_by(|a, b| left(*a).total_cmp(&left(*b))).unwrap()
}

#[test]
fn rotation_about_an_axis_that_becomes_horizontal() {
    // It goes on: the otoliths build the estimate up again.
    let (mut filter, mut canal) = tilted_after_a_minute();
    let found = passive(&mut filter, 4000, |time| [canal.signal(1.0), time + DT]);
    let plateau = found[3999][0];
    near("horizontal axis: plateau", plateau, 0.918, 1e-3);
    let steps = found.iter().position(|it| it[0] > plateau * (1.0 - (-1f64).exp())).unwrap();
    near("horizontal axis: build-up to 63 %, s", steps as f64 * DT, 3.1, 0.05);
    // It stops: the response is short. The text does not say how it fits; over 10 s and 20 s it is the same here.
    let (mut filter, mut canal) = tilted_after_a_minute();
    let found: Vec<f64> =
        passive(&mut filter, 2000, |_| [canal.signal(0.0), 0.0]).iter().map(|it| it[0]).collect();
    near("post-rotatory tilt, 10 s, s", fitted(&found[..1000]), 2.7, 0.15);
    near("post-rotatory tilt, 20 s, s", fitted(&found), 2.7, 0.15);
}
