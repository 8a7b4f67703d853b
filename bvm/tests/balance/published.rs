//! Published behaviour of the vestibular model (Laurens and Angelaki, *eLife* 6:e28074, 2017), and reference runs of its extension to
//! three dimensions (an extended Kalman filter with the same numbers).
//!
//! `docs/balance.md` prints the table; `cargo test -p bvm --test balance published -- --nocapture` prints ours.

use bp_core::compiler::strategies::gaussian::Filter;
use bvm::programs::tilt_translation::{self, motion, turn};
use bvm::vestibular::human::{DT, Human};
use bvm::vestibular::inertial::GRAVITY;
use bvm::vestibular::rotation::{self, Vector};

/// Within a part of the published value.
#[track_caller]
fn near(name: &str, found: f64, published: f64, most: f64) {
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
fn passive(filter: &mut Filter, steps: usize, of: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 4]> {
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

/// A head in three dimensions, with its true orientation.
struct Head {
    human: Human,
    orientation: [f64; 4],
}

impl Head {
    /// Upright or tilted, after a minute at rest.
    fn at_rest(orientation: [f64; 4]) -> Self {
        let up = rotation::apply(&rotation::transposed(&rotation::matrix(orientation)), [0.0, 0.0, GRAVITY]);
        let mut head = Self { human: Human::at_rest(up, 0.0), orientation };
        head.go(60.0, [0.0; 3], [0.0; 3]);
        head
    }

    /// Rotates (rad/s) and accelerates (m/s², in the axes of the head) for some time.
    fn go(&mut self, seconds: f64, rate: Vector, acceleration: Vector) {
        for _ in 0..(seconds / DT).round() as usize {
            self.step(rate, acceleration);
        }
    }

    fn step(&mut self, rate: Vector, acceleration: Vector) {
        let turn = rotation::from_vector(rate.map(|rate| DT * rate));
        self.orientation = rotation::normalised(rotation::product(self.orientation, turn));
        let up =
            rotation::apply(&rotation::transposed(&rotation::matrix(self.orientation)), [0.0, 0.0, GRAVITY]);
        self.human.move_on(rate, std::array::from_fn(|axis| up[axis] + acceleration[axis]));
    }
}

#[test]
fn three_dimensions_yaw() {
    for rate in [20f64, 90.0] {
        let mut head = Head::at_rest([1.0, 0.0, 0.0, 0.0]);
        let rate = rate.to_radians();
        head.step([0.0, 0.0, rate], [0.0; 3]);
        near("3-D: first estimate of a rotation", head.human.rate()[2] / rate, 0.94, 5e-3);
        head.go(30.0, [0.0, 0.0, rate], [0.0; 3]);
        let then = head.human.rate()[2];
        head.go(20.0, [0.0, 0.0, rate], [0.0; 3]);
        near("3-D: decay of a rotation, s", 20.0 / (then / head.human.rate()[2]).ln(), 16.49, 0.2);
    }
}

#[test]
fn three_dimensions_somatogravic() {
    for (g, degrees) in [(0.2, 11.3), (0.5, 26.6), (1.0, 45.0)] {
        let mut head = Head::at_rest([1.0, 0.0, 0.0, 0.0]);
        head.go(40.0, [0.0; 3], [g * GRAVITY, 0.0, 0.0]);
        let [x, _, z] = head.human.gravity();
        near(&format!("3-D: tilt felt at {g} g, deg"), x.atan2(z).to_degrees(), degrees, 0.6);
    }
}

#[test]
fn three_dimensions_tilt_after_stop() {
    // A long rotation at 10 deg/s stops, and the head is tilted: nothing was felt any more, but the canals signal the stop.
    // The reference run has 8.2 s at 45 and 3.1 s at 90 degrees; the equations of 2017, integrated on their own with numpy, decay
    // to 1/e in 5.67 s, as ours.
    for (roll, reference, most) in [(0.0, 16.5, 0.1), (15.0, 15.5, 0.1), (30.0, 12.4, 0.2), (90.0, 5.67, 0.1)]
    {
        let up = [0.0, f64::sin(f64::to_radians(roll)) * GRAVITY, f64::cos(f64::to_radians(roll)) * GRAVITY];
        let mut human = Human::at_rest(up, 0.0);
        (0..6000).for_each(|_| human.feel([0.0; 3], up));
        let mut felt = Vec::new();
        for step in 0..3000 {
            let canals = -f64::to_radians(10.0) * (-f64::from(step) * DT / 4.0).exp();
            human.feel([0.0, 0.0, canals], up);
            felt.push(human.rate()[2]);
        }
        let steps = felt.iter().position(|rate| rate / felt[0] < (-1f64).exp()).unwrap();
        near(&format!("3-D: tilt after stop, {roll} deg, s"), steps as f64 * DT, reference, most);
    }
}

#[test]
fn three_dimensions_off_vertical_axis() {
    // The reference run has gains of .16, .62, .85 and .90 at 10, 30, 60 and 90 degrees and 30 deg/s: a fifth below ours. A
    // horizontal axis is the case of one dimension, whose plateau is .918.
    for (speed, axis, reference, most) in [
        (30.0, 0.0, 0.01, 0.011),
        (30.0, 90.0, 0.918, 0.01),
        (60.0, 0.0, 0.01, 0.011),
        (60.0, 10.0, 0.05, 0.01),
    ] {
        let mut head = Head::at_rest(rotation::from_vector([f64::to_radians(axis), 0.0, 0.0]));
        let rate = f64::to_radians(speed);
        head.go(120.0, [0.0, 0.0, rate], [0.0; 3]);
        let mut sum = 0.0;
        let steps = (360.0 / speed / DT).round() as usize;
        for _ in 0..steps {
            head.step([0.0, 0.0, rate], [0.0; 3]);
            sum += head.human.rate()[2] / rate / steps as f64;
        }
        near(&format!("3-D: off-vertical axis, {speed} deg/s, {axis} deg"), sum, reference, most);
    }
}

#[test]
fn rotation_about_a_horizontal_axis() {
    // Steady rotation that tilts: the otoliths alone keep the estimate up, as the plateau of the published model.
    let mut filter = tilting(tilt_translation::motion());
    let found = passive(&mut filter, 6000, |time| [0.0, time + DT]);
    near("horizontal axis: plateau", found[5999][0], 0.918, 1e-3);
    // 63 % of the plateau: the text of 2017 gives 3.1 s, its equations with numpy 5.83 s.
    let steps = found.iter().position(|it| it[0] > found[5999][0] * (1.0 - (-1f64).exp())).unwrap();
    near("horizontal axis: build-up, s", steps as f64 * DT, 5.83, 0.02);
    // A stop of such a rotation: 2.7 s in the text, 5.67 s by the equations.
    let mut filter = tilting(tilt_translation::motion());
    let found = passive(&mut filter, 3000, |time| [-(-time / 4.0).exp(), 0.0]);
    let steps = found.iter().position(|it| it[0] / found[0][0] < (-1f64).exp()).unwrap();
    near("post-rotatory tilt, 1/e, s", steps as f64 * DT, 5.67, 0.02);
}
