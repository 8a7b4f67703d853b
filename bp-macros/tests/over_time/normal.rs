//! Normal laws over time.
//!
//! In: matrices of a linear program, or functions and differences of another. Out: mean and covariance by the equations of
//! Kalman with whole matrices.

use super::near;
use bp_macros::bayesian_program;

bayesian_program! {
    program Cart {
        parameters { dt : real = 0.5; q : real; }
        variables { X, X^-1, W, W^-1, Z, U : real; }
        decomposition { P(X^-1) P(W^-1) P(U) P(W | W^-1 U) P(X | X^-1 W^-1) P(Z | X) }
        forms {
            P(X^-1) = normal(1, 2);
            P(W^-1) = normal(0, 0.5);
            P(U) = normal(0, 1);
            P(W | W^-1 U) = normal(W^-1 + dt * U, q);
            P(X | X^-1 W^-1) = dirac(X^-1 + dt * W^-1);
            P(Z | X) = normal(2 * X - 1, 0.4);
        }
        question place { filter P(X | Z U) }
        question law { filter P(W X | Z) }
        question soon { predict(2) P(X | Z U) }
    }
}

bayesian_program! {
    program Plane {
        parameters { stay : real = 0.9; }
        variables { X, X^-1 : real[2]; Z : real[2]; Y[i in 1..=2] : real; }
        decomposition { P(initial(X)) P(X | X^-1) P(Z | X) prod(i in 1..=2) { P(Y[i] | X) } }
        forms {
            P(initial(X)) = normal([1, -1], 2);
            P(X | X^-1) = normal([stay * X^-1[0] + 0.2 * X^-1[1], X^-1[1]], 0.3);
            P(Z | X) = normal(X, [[1, 0.4], [0.4, 0.5]]);
            P(Y[i] | X) = normal(i * X[0] - X[1], 0.6);
        }
        question plane { filter P(X | Z Y) }
    }
}

bayesian_program! {
    program Turn {
        parameters { dt : real = 0.01; }
        variables { W, W^-1, G, G^-1, V, F : real[3]; }
        decomposition { P(W^-1) P(W | W^-1) P(V | W) P(G^-1) P(G | G^-1 W) P(F | G) }
        forms {
            P(W^-1) = normal(0, 1);
            P(W | W^-1) = normal(W^-1, 0.2);
            P(V | W) = normal(W, 0.05);
            P(G^-1) = normal([0, 0, 9.81], 0.5);
            P(G | G^-1 W) = dirac(rotate(G^-1, -W * dt));
            P(F | G) = normal(G, 0.3);
        }
        question gravity { filter P(G W | V F) }
    }
}

bayesian_program! {
    program Radar over target in Targets {
        parameters { dt : real = 1; }
        variables { X, X^-1, Y, Y^-1, R, B : real; }
        decomposition { P(X^-1) P(Y^-1) P(X | X^-1) P(Y | Y^-1) P(R | X Y) P(B | X Y) }
        forms {
            P(X^-1) = normal(10, 3);
            P(Y^-1) = normal(5, 3);
            P(X | X^-1) = normal(X^-1 + dt, 0.5);
            P(Y | Y^-1) = normal(Y^-1, 0.5);
            P(R | X Y) = normal(sqrt(X * X + Y * Y), 0.2);
            P(B | X Y) = normal(atan2(Y, X), 0.02);
        }
        question place { filter P(X Y | R B) }
    }
}

/// Mean and covariance.
#[derive(Clone)]
struct Normal {
    mean: Vec<f64>,
    covariance: Vec<Vec<f64>>,
    ln_evidence: f64,
}

impl Normal {
    fn new(mean: &[f64], deviations: &[f64]) -> Self {
        let size = mean.len();
        let entry = |i: usize, j: usize| if i == j { deviations[i] * deviations[i] } else { 0.0 };
        let covariance = (0..size).map(|i| (0..size).map(|j| entry(i, j)).collect()).collect();
        Self { mean: mean.to_vec(), covariance, ln_evidence: 0.0 }
    }

    /// m ← mean, Σ ← F Σ Fᵀ + Q, Q diagonal.
    fn predict(&mut self, mean: Vec<f64>, f: &[Vec<f64>], q: &[f64]) {
        let size = self.mean.len();
        let product = |i: usize, j: usize| {
            let mut sum = if i == j { q[i] } else { 0.0 };
            for k in 0..size {
                for l in 0..size {
                    sum += f[i][k] * self.covariance[k][l] * f[j][l];
                }
            }
            sum
        };
        let rows = f.len();
        self.covariance = (0..rows).map(|i| (0..rows).map(|j| product(i, j)).collect()).collect();
        self.mean = mean;
    }

    /// Given z = h(x) + noise: m ← m + K (z − h(m)), Σ ← (I − K H) Σ, for one number z.
    fn update(&mut self, z: f64, expected: f64, h: &[f64], variance: f64) {
        let size = self.mean.len();
        let with: Vec<f64> =
            (0..size).map(|i| (0..size).map(|j| self.covariance[i][j] * h[j]).sum()).collect();
        let s = variance + (0..size).map(|i| h[i] * with[i]).sum::<f64>();
        let rest = z - expected;
        self.ln_evidence -= 0.5 * ((std::f64::consts::TAU * s).ln() + rest * rest / s);
        for i in 0..size {
            self.mean[i] += with[i] / s * rest;
            for j in 0..size {
                self.covariance[i][j] -= with[i] * with[j] / s;
            }
        }
    }
}

/// The slopes of a function by differences.
fn slopes(at: &[f64], of: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let columns: Vec<Vec<f64>> = (0..at.len())
        .map(|k| {
            let step = 1e-5 * at[k].abs().max(1.0);
            let moved = |by: f64| {
                let mut moved = at.to_vec();
                moved[k] += by;
                of(&moved)
            };
            moved(step).iter().zip(moved(-step)).map(|(more, less)| (more - less) / (2.0 * step)).collect()
        })
        .collect();
    (0..columns[0].len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}

const Z: [Option<f64>; 6] = [Some(1.5), None, Some(4.0), Some(-2.5), None, Some(0.25)];
const U: [Option<f64>; 6] = [Some(0.5), Some(-1.0), None, None, Some(2.0), Some(0.0)];

fn cart(instants: usize, dt: f64, q: f64, controls: bool) -> Normal {
    let mut law = Normal::new(&[1.0, 0.0], &[2.0, 0.5]);
    for instant in 0..instants {
        let u = U[instant].filter(|_| controls);
        if let Some(u) = u {
            law.ln_evidence -= 0.5 * (std::f64::consts::TAU.ln() + u * u);
        }
        let mean = vec![law.mean[0] + dt * law.mean[1], law.mean[1] + dt * u.unwrap_or(0.0)];
        let noise = [0.0, q * q + if u.is_some() { 0.0 } else { dt * dt }];
        law.predict(mean, &[vec![1.0, dt], vec![0.0, 1.0]], &noise);
        if let Some(z) = Z[instant] {
            let expected = 2.0 * law.mean[0] - 1.0;
            law.update(z, expected, &[2.0, 0.0], 0.16);
        }
    }
    law
}

#[test]
fn a_cart_is_the_filter_of_kalman() {
    for (dt, q) in [(0.5, 0.3), (0.1, 2.0)] {
        let (mut place, mut law) = (cart::place::State::<f64>::new(), cart::law::State::<f64>::new());
        let mut narrow = cart::place::State::<f32>::new();
        for instant in 0..Z.len() {
            let (mut first, mut second) = (cart::place().dt(dt).q(q), cart::law().dt(dt).q(q));
            let mut single = cart::place::Question::<f32>::new().dt(dt).q(q);
            if let Some(z) = Z[instant] {
                (first, second, single) = (first.z(z), second.z(z), single.z(z));
            }
            if let Some(u) = U[instant] {
                (first, single) = (first.u(u), single.u(u));
            }
            first.step(&mut place).unwrap();
            second.step(&mut law).unwrap();
            single.step(&mut narrow).unwrap();
            let expected = cart(instant + 1, dt, q, true);
            near("mean", place.mean(), expected.mean[0], 1e-12);
            near("variance", place.variance(), expected.covariance[0][0], 1e-12);
            near("deviation", place.deviation(), expected.covariance[0][0].sqrt(), 1e-12);
            near("ln P", place.ln_evidence(), expected.ln_evidence, 1e-12);
            near("mean, f32", f64::from(narrow.mean()), expected.mean[0], 1e-5);
            near("deviation, f32", f64::from(narrow.deviation()), expected.covariance[0][0].sqrt(), 1e-5);
            let expected = cart(instant + 1, dt, q, false);
            near("mean of X", law.mean_x(), expected.mean[0], 1e-12);
            near("mean of W", law.mean_w(), expected.mean[1], 1e-12);
            near("variance of W", law.variance_w(), expected.covariance[1][1], 1e-12);
            near("covariance", law.covariance_w_x(), expected.covariance[0][1], 1e-12);
            near("ln P", law.ln_evidence(), expected.ln_evidence, 1e-12);
        }
    }
}

#[test]
fn a_cart_is_predicted() {
    let mut soon = cart::soon::State::<f64>::new();
    for instant in 0..3 {
        let mut question = cart::soon().q(0.3);
        if let Some(z) = Z[instant] {
            question = question.z(z);
        }
        if let Some(u) = U[instant] {
            question = question.u(u);
        }
        question.step(&mut soon).unwrap();
        let mut law = cart(instant + 1, 0.5, 0.3, true);
        for _ in 0..2 {
            let mean = vec![law.mean[0] + 0.5 * law.mean[1], law.mean[1]];
            law.predict(mean, &[vec![1.0, 0.5], vec![0.0, 1.0]], &[0.0, 0.09 + 0.25]);
        }
        near("mean", soon.mean(), law.mean[0], 1e-12);
        near("variance", soon.variance(), law.covariance[0][0], 1e-12);
    }
}

#[test]
fn vectors_and_families_are_observed_number_by_number() {
    let z = [[0.5, -1.5], [2.0, 1.0], [0.0, 0.25]];
    let y = [Some([1.0, 2.5]), None, Some([-0.5, 0.75])];
    let mut state = plane::plane::State::<f64>::new();
    let mut law = Normal::new(&[1.0, -1.0], &[2.0, 2.0]);
    for instant in 0..3 {
        let mut question = plane::plane().stay(0.8).z(&z[instant]);
        if let Some(y) = &y[instant] {
            question = question.y(y);
        }
        question.step(&mut state).unwrap();
        if instant > 0 {
            let mean = vec![0.8 * law.mean[0] + 0.2 * law.mean[1], law.mean[1]];
            law.predict(mean, &[vec![0.8, 0.2], vec![0.0, 1.0]], &[0.09, 0.09]);
        }
        // Z = X + noise of this covariance; the first component, then the second given the noise of the first: with
        // Z₁ − 0.4 Z₀ the noises are independent, of variances 1 and 0.5 − 0.16.
        let [z0, z1] = z[instant];
        let expected = law.mean[0];
        law.update(z0, expected, &[1.0, 0.0], 1.0);
        let expected = law.mean[1] - 0.4 * law.mean[0];
        law.update(z1 - 0.4 * z0, expected, &[-0.4, 1.0], 0.34);
        for (place, y) in y[instant].iter().flatten().enumerate() {
            let factor = place as f64 + 1.0;
            let expected = factor * law.mean[0] - law.mean[1];
            law.update(*y, expected, &[factor, -1.0], 0.36);
        }
        for i in 0..2 {
            near("mean", state.mean()[i], law.mean[i], 1e-12);
            (0..2).for_each(|j| near("covariance", state.covariance()[i][j], law.covariance[i][j], 1e-12));
        }
        near("ln P", state.ln_evidence(), law.ln_evidence, 1e-12);
    }
}

/// v turned by |w| around w, by the matrix I + sin a K + (1 − cos a) K².
fn rotate(v: [f64; 3], w: [f64; 3]) -> [f64; 3] {
    let a = w.iter().map(|w| w * w).sum::<f64>().sqrt();
    if a == 0.0 {
        return v;
    }
    let n = w.map(|w| w / a);
    let k = |v: [f64; 3]| [n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0]];
    let (once, twice) = (k(v), k(k(v)));
    [0, 1, 2].map(|i| v[i] + a.sin() * once[i] + (1.0 - a.cos()) * twice[i])
}

#[test]
fn a_rotation_is_linearised_at_the_mean() {
    for dt in [0.01, 0.4] {
        let mut state = turn::gravity::State::<f64>::new();
        // W, then G.
        let mut law = Normal::new(&[0.0, 0.0, 0.0, 0.0, 0.0, 9.81], &[1.0, 1.0, 1.0, 0.5, 0.5, 0.5]);
        for instant in 0..12 {
            let time = f64::from(instant) * dt;
            let v = [0.8 * time.cos(), -0.5, 0.3 + time];
            let f = [time.sin(), 0.4 * time, 9.7 - 0.1 * time];
            let forces = instant % 3 != 1;
            let mut question = turn::gravity().dt(dt).v(&v);
            if forces {
                question = question.f(&f);
            }
            question.step(&mut state).unwrap();
            let identity: Vec<Vec<f64>> =
                (0..6).map(|i| (0..6).map(|j| f64::from(u8::from(i == j))).collect()).collect();
            let mean = law.mean.clone();
            law.predict(mean, &identity, &[0.04, 0.04, 0.04, 0.0, 0.0, 0.0]);
            for i in 0..3 {
                let (expected, mut h) = (law.mean[i], [0.0; 6]);
                h[i] = 1.0;
                law.update(v[i], expected, &h, 0.0025);
            }
            let moved = |x: &[f64]| {
                let turned = rotate([x[3], x[4], x[5]], [0, 1, 2].map(|i| -dt * x[i]));
                [&x[..3], &turned[..]].concat()
            };
            let (mean, f_slopes) = (moved(&law.mean), slopes(&law.mean, &moved));
            law.predict(mean, &f_slopes, &[0.0; 6]);
            for i in (0..3).filter(|_| forces) {
                let (expected, mut h) = (law.mean[3 + i], [0.0; 6]);
                h[3 + i] = 1.0;
                law.update(f[i], expected, &h, 0.09);
            }
            for i in 0..3 {
                near("W", state.mean_w()[i], law.mean[i], 1e-7);
                near("G", state.mean_g()[i], law.mean[3 + i], 1e-7);
                for j in 0..3 {
                    near("covariance of G", state.covariance_g()[i][j], law.covariance[3 + i][3 + j], 1e-7);
                    near("G with W", state.covariance_g_w()[i][j], law.covariance[3 + i][j], 1e-7);
                }
            }
            near("ln P", state.ln_evidence(), law.ln_evidence, 1e-6);
        }
    }
}

#[test]
fn a_plate_has_an_extended_filter_for_each_element() {
    const TARGETS: usize = 67;
    let mut state = radar::place::State::<f64>::new();
    let start = Normal::new(&[10.0, 5.0], &[3.0, 3.0]);
    let mut laws = vec![start; TARGETS];
    for instant in 0..5 {
        let reading = |target: usize| {
            let (x, y) = (9.0 + 0.05 * target as f64 + f64::from(instant), 6.0 - 0.04 * target as f64);
            (x.hypot(y) + 0.1, y.atan2(x) - 0.01)
        };
        let (r, b): (Vec<f64>, Vec<f64>) = (0..TARGETS).map(reading).unzip();
        radar::place().targets(TARGETS).r(&r).b(&b).step(&mut state).unwrap();
        for (target, law) in laws.iter_mut().enumerate() {
            let mean = vec![law.mean[0] + 1.0, law.mean[1]];
            law.predict(mean, &[vec![1.0, 0.0], vec![0.0, 1.0]], &[0.25, 0.25]);
            let range = |x: &[f64]| vec![x[0].hypot(x[1])];
            let (expected, h) = (range(&law.mean)[0], slopes(&law.mean, &range));
            law.update(r[target], expected, &h[0], 0.04);
            let bearing = |x: &[f64]| vec![x[1].atan2(x[0])];
            let (expected, h) = (bearing(&law.mean)[0], slopes(&law.mean, &bearing));
            law.update(b[target], expected, &h[0], 0.0004);
            near("x", state.mean_x()[target], law.mean[0], 1e-7);
            near("y", state.mean_y()[target], law.mean[1], 1e-7);
            near("variance of x", state.variance_x()[target], law.covariance[0][0], 1e-7);
            near("covariance", state.covariance_x_y()[target], law.covariance[0][1], 1e-7);
            near("ln P", state.ln_evidence()[target], law.ln_evidence, 1e-6);
        }
    }
}

#[test]
fn refused_numbers_are_named() {
    let mut state = cart::place::State::<f64>::new();
    let error = cart::place().z(1.0).step(&mut state).unwrap_err().to_string();
    assert!(error.contains("`q`"), "{error}");
    let error = cart::place().q(-0.3).z(1.0).step(&mut state).unwrap_err().to_string();
    assert!(error.contains("-0.3") && error.contains("deviation"), "{error}");
    let error = cart::place().q(0.3).z(f64::NAN).step(&mut state).unwrap_err().to_string();
    assert!(error.contains("NaN"), "{error}");
    let error = plane::plane().z(&[1.0]).step(&mut plane::plane::State::new()).unwrap_err().to_string();
    assert!(error.contains('2'), "{error}");
    assert_eq!((state.instants(), state.mean()), (0, 0.0));
}

#[test]
fn a_step_allocates_nothing_after_the_first_ones() {
    let mut state = turn::gravity::State::<f64>::new();
    let mut steps = || {
        for k in 0..1000 {
            let turn = turn::gravity().v(&[0.1, 0.2, 0.3]);
            match k % 3 {
                0 => turn.step(&mut state).unwrap(),
                _ => turn.f(&[0.0, 0.5, 9.8]).step(&mut state).unwrap(),
            };
        }
    };
    steps();
    assert_eq!(allocation_counter::measure(steps).count_total, 0);
}
