//! Mistakes in a recording that its own numbers show: units, axes, senses of rotation.
//!
//! In: rates and forces, as they were read. Out: the mistakes, each with its factor and the option that mends it. Invariant: a
//! constant amount of memory; what the data cannot decide (the sign of gravity, a sensor that did not tilt) is said to be undecided.
//!
//! The direction of gravity turns against the sensor: da/dt = −k ω × a with k = 1, whatever the unit of a. With ω in degrees k is
//! 0.01745, with a mirrored axis or a gyroscope that counts clockwise −1. In general da/dt = −(M ω) × a; M is found by least squares
//! over short stretches, and compared with scaled permutations of the axes. (−a obeys the same equation: the sign of gravity is not
//! seen.)

use super::mistakes::{axes_of, clockwise, of_period, of_rate, of_scale, of_size};
use super::rotation::{self, Vector, cross, dot};
use nalgebra::{SMatrix, SVector};

/// Length of a stretch, s.
const STRETCH_S: f64 = 0.03;

/// A stretch that turned less, rad, says nothing.
const LEAST_TURN: f64 = 1e-3;

/// The least stretches that tilted, the least part of the changes of a that rotation explains, and by how many times the variance of
/// what is left, for a decision.
const ENOUGH: (u32, f64, f64) = (8, 0.1, 400.0);

/// A simpler matrix is taken if it explains less by no more than this part, and these times the variance of what is left.
const SIMPLER: (f64, f64) = (0.02, 100.0);

/// Sums over a recording.
#[derive(Clone, Debug)]
pub(super) struct Consistency {
    /// Of the stretch: its time, readings, Σ ω dt, Σ a.
    now: (f64, f64, Vector, Vector),
    /// Half the rotation and the mean acceleration of the stretch before.
    before: Option<(Vector, Vector)>,
    normal: SMatrix<f64, 9, 9>,
    right: SVector<f64, 9>,
    changes: f64,
    /// Stretches that tilted, and all that turned.
    stretches: u32,
    compared: u32,
    sizes: Sizes,
    /// The largest rate, rad/s, and its row.
    fastest: (f64, u64),
    periods: Sizes,
    stuck: Stuck,
}

/// A gyroscope that always gives the same numbers.
#[derive(Clone, Debug, Default)]
struct Stuck {
    /// The numbers, the row from which on they are the same, and for how long, s.
    rate: Vector,
    row: u64,
    time: f64,
    /// The first direction of gravity since then, and the time until then.
    force: Option<(Vector, f64)>,
    /// The row, and the angle between gravity and what the rate predicts, rad.
    found: Option<(u64, f64)>,
    /// The rate then.
    stood: Vector,
}

impl Default for Consistency {
    fn default() -> Self {
        Self {
            now: (0.0, 0.0, [0.0; 3], [0.0; 3]),
            before: None,
            normal: SMatrix::zeros(),
            right: SVector::zeros(),
            changes: 0.0,
            stretches: 0,
            compared: 0,
            sizes: Sizes::default(),
            fastest: (0.0, 0),
            periods: Sizes::default(),
            stuck: Stuck::default(),
        }
    }
}

impl Stuck {
    /// Compares the direction of gravity with that which the constant rate predicts from the first stretch on.
    fn look(&mut self, force: Vector) {
        let Some((first, since)) = self.force else {
            self.force = Some((force, self.time));
            return;
        };
        let time = self.time - since;
        let back = rotation::matrix(rotation::from_vector(self.rate.map(|rate| -time * rate)));
        let expected = rotation::apply(&back, first);
        let about = cross(expected, force);
        let angle = dot(about, about).sqrt().atan2(dot(expected, force));
        if time > 0.5 && angle > 0.35 && self.found.is_none() {
            self.found = Some((self.row, angle));
            self.stood = self.rate;
        }
    }
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Mistakes, in words, each with its option.
    pub mistakes: Vec<String>,
    /// k of da/dt = −k ω × a, if the sensor tilted enough.
    pub k: Option<f64>,
}

impl Consistency {
    /// A reading of both sensors, in some row, that stands for `dt` seconds.
    pub(super) fn add(&mut self, row: u64, rate: Vector, force: Vector, dt: f64) {
        if rate == self.stuck.rate && self.stuck.row > 0 {
            self.stuck.time += dt;
        } else {
            let Stuck { found, stood, .. } = self.stuck;
            self.stuck = Stuck { rate, row, found, stood, ..Stuck::default() };
        }
        self.sizes.add(dot(force, force).sqrt());
        let fastest = rate.iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
        if fastest > self.fastest.0 {
            self.fastest = (fastest, row);
        }
        if dt <= 0.0 {
            return;
        }
        self.periods.add(dt);
        let (time, count, turn, sum) = &mut self.now;
        *time += dt;
        *count += 1.0;
        for axis in 0..3 {
            turn[axis] += dt * rate[axis];
            sum[axis] += force[axis];
        }
        if *time < STRETCH_S {
            return;
        }
        let (half, mean) = (turn.map(|turn| 0.5 * turn), sum.map(|sum| sum / *count));
        self.stuck.look(mean);
        if let Some((half_before, mean_before)) = self.before {
            let turn = std::array::from_fn(|axis| half[axis] + half_before[axis]);
            let middle = std::array::from_fn(|axis| 0.5 * (mean[axis] + mean_before[axis]));
            self.compare(turn, middle, std::array::from_fn(|axis| mean[axis] - mean_before[axis]));
        }
        self.before = Some((half, mean));
        self.now = (0.0, 0.0, [0.0; 3], [0.0; 3]);
    }

    /// Between stretches nothing is compared across a gap.
    pub(super) fn forget(&mut self) {
        self.now = (0.0, 0.0, [0.0; 3], [0.0; 3]);
        self.before = None;
    }

    fn compare(&mut self, turn: Vector, middle: Vector, change: Vector) {
        let size = dot(middle, middle).sqrt();
        if dot(turn, turn).sqrt() < LEAST_TURN || size == 0.0 {
            return;
        }
        // Each stretch counts by its angle, so that shocks do not outweigh the rest.
        let weight = 1.0 / size;
        let mut rows: [[f64; 9]; 3] = [[0.0; 9]; 3];
        for into in 0..3 {
            let mut axis = [0.0; 3];
            axis[into] = 1.0;
            let effect = cross(middle, axis);
            for from in 0..3 {
                for (row, effect) in rows.iter_mut().zip(effect) {
                    row[3 * into + from] = weight * effect * turn[from];
                }
            }
        }
        let tilted = dot(change, change).sqrt() * weight;
        self.compared += 1;
        self.stretches += u32::from(tilted > LEAST_TURN);
        for (row, change) in rows.iter().zip(change) {
            let row = SVector::<f64, 9>::from_row_slice(row);
            self.normal += row * row.transpose();
            self.right += row * (weight * change);
            self.changes += (weight * change).powi(2);
        }
    }

    /// How much of the changes a matrix explains at its best scale, and that scale.
    fn explained(&self, matrix: &[[f64; 3]; 3]) -> (f64, f64) {
        let m = SVector::<f64, 9>::from_fn(|at, _| matrix[at / 3][at % 3]);
        let (along, square) = (self.right.dot(&m), (m.transpose() * self.normal * m)[0]);
        if along <= 0.0 || square <= 0.0 { (0.0, 0.0) } else { (along * along / square, along / square) }
    }

    /// The mistakes.
    pub(super) fn verdict(&self, stated: [bool; 3]) -> Verdict {
        let mut verdict = self.units_and_axes(stated);
        // Wrong units, too, contradict gravity: they are the better reason.
        if let (Some((row, angle)), true) = (self.stuck.found, verdict.mistakes.is_empty()) {
            let [x, y, z] = self.stuck.stood;
            verdict.mistakes.push(format!(
                "from row {row} on the gyroscope always gives {x}, {y}, {z} rad/s, while gravity turns otherwise, by {:.0} deg: it is \
                 dead, or not connected",
                angle.to_degrees()
            ));
        }
        verdict
    }

    fn units_and_axes(&self, stated: [bool; 3]) -> Verdict {
        let mut verdict = Verdict::default();
        let period = self.periods.median();
        if let Some(period) = period.filter(|period| !(4e-5..=0.3).contains(period)) {
            verdict.mistakes.push(of_period(period));
            return verdict;
        }
        if let Some(size) = self.sizes.median() {
            verdict.mistakes.extend(of_size(size, stated[2]));
        }
        let mut candidates: Vec<(usize, [[f64; 3]; 3])> = signed_permutations();
        candidates.sort_by_key(|(cost, _)| *cost);
        let best = candidates.iter().map(|(_, matrix)| self.explained(matrix).0).fold(0.0, f64::max);
        let variance = (self.changes - best).max(0.0) / (3.0 * f64::from(self.compared.max(1)));
        let decided =
            self.stretches >= ENOUGH.0 && best > ENOUGH.1 * self.changes && best > ENOUGH.2 * variance;
        if !decided {
            verdict.mistakes.extend(of_rate(self.fastest));
            return verdict;
        }
        let least = best - SIMPLER.0 * best - SIMPLER.1 * variance;
        let good = |matrix: &[[f64; 3]; 3]| self.explained(matrix).0 >= least;
        let (_, matrix) =
            candidates.iter().find(|(_, matrix)| good(matrix)).expect("internal: the best is good");
        let scale = self.explained(matrix).1;
        let opposite = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
        if *matrix == IDENTITY {
            verdict.k = Some(scale);
        } else if good(&opposite) {
            let k = self.explained(&opposite).1;
            verdict.k = Some(-k);
            verdict.mistakes.push(clockwise(-k));
        } else {
            let axes = axes_of(matrix);
            verdict.mistakes.push(format!(
                "the direction of gravity turns as if the axes of the gyroscope were {axes}: axes are swapped or mirrored \
                 between gyroscope and accelerometer; --gyroscope-axes={axes}, or --accelerometer-axes"
            ));
        }
        verdict.mistakes.extend(of_scale(scale, period));
        verdict
    }
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Permutations of the axes with signs; the first number is how much each changes.
fn signed_permutations() -> Vec<(usize, [[f64; 3]; 3])> {
    let mut all = Vec::new();
    for order in [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]] {
        for signs in 0..8_usize {
            let mut matrix = [[0.0; 3]; 3];
            for (into, from) in order.into_iter().enumerate() {
                matrix[into][from] = if signs >> into & 1 == 1 { -1.0 } else { 1.0 };
            }
            let moved = order.iter().enumerate().filter(|(into, from)| into != *from).count();
            all.push((signs.count_ones() as usize + 4 * moved, matrix));
        }
    }
    all
}

/// A median in constant memory: counts by size, 0.1 % wide.
#[derive(Clone, Debug, Default)]
struct Sizes {
    counts: std::collections::BTreeMap<i32, u64>,
}

impl Sizes {
    fn add(&mut self, value: f64) {
        if value > 0.0 && value.is_finite() {
            *self.counts.entry((value.ln() * 1000.0).round() as i32).or_default() += 1;
        }
    }

    fn median(&self) -> Option<f64> {
        let total: u64 = self.counts.values().sum();
        let mut seen = 0;
        let bin = self.counts.iter().find(|(_, count)| {
            seen += **count;
            2 * seen >= total
        });
        bin.map(|(bin, _)| std::f64::consts::E.powf(f64::from(*bin) / 1000.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns about all axes, at 100 Hz: what a sensor measures, changed by `mistake`.
    fn verdict(mistake: impl Fn(Vector, Vector) -> (Vector, Vector), dt: f64) -> Verdict {
        let mut consistency = Consistency::default();
        let mut orientation = [1.0, 0.0, 0.0, 0.0];
        for step in 0..400_u32 {
            let time = f64::from(step) * 0.01;
            let rate = [(1.3 * time).sin(), 0.8 * (0.9 * time + 1.0).sin(), 0.7 * (1.7 * time + 2.0).sin()];
            orientation = rotation::product(orientation, rotation::from_vector(rate.map(|rate| 0.01 * rate)));
            let force =
                rotation::apply(&rotation::transposed(&rotation::matrix(orientation)), [0.0, 0.0, 9.8]);
            let (rate, force) = mistake(rate, force);
            consistency.add(u64::from(step) + 2, rate, force, dt);
        }
        consistency.verdict([false; 3])
    }

    #[test]
    fn good_data_have_k_1() {
        let found = verdict(|rate, force| (rate, force), 0.01);
        assert!(found.mistakes.is_empty() && (found.k.unwrap() - 1.0).abs() < 0.01, "{found:?}");
        let down = verdict(|rate, force| (rate, force.map(|cell| -cell)), 0.01);
        assert!(down.mistakes.is_empty(), "the sign of gravity is not seen: {down:?}");
        let dead = verdict(|_, force| ([0.0; 3], force), 0.01).mistakes.join("; ");
        assert!(dead.contains("from row 2 on the gyroscope always gives 0, 0, 0"), "{dead}");
        let resting = verdict(|_, _| ([0.0; 3], [0.0, 0.0, 9.8]), 0.01);
        assert_eq!(resting, Verdict::default(), "undecided");
    }

    #[test]
    fn mistakes_name_factor_and_option() {
        type Mistake = fn(Vector, Vector) -> (Vector, Vector);
        let cases: [(Mistake, f64, &[&str]); 10] = [
            (|w, a| (w.map(f64::to_degrees), a), 0.01, &["0.01745", "k = 0.017", "--rate-unit deg/s"]),
            (|w, a| (w.map(|w| 1e3 * w.to_degrees()), a), 0.01, &["--rate-unit mdps"]),
            (|w, a| (w, a.map(|a| a / 9.80665)), 0.01, &["factor of 9.80665", "--acceleration-unit g"]),
            (|w, a| (w, a.map(|a| 1e3 * a / 9.80665)), 0.01, &["--acceleration-unit mg"]),
            (|w, a| (w, a), 10.0, &["--time-unit ms", "100.0 Hz"]),
            (|w, a| (w, a), 1e7, &["--time-unit ns"]),
            (|w, a| (w.map(|w| -w), a), 0.01, &["k = -1.00", "clockwise", "--gyroscope-axes=-x,-y,-z"]),
            (|w, [x, y, z]| (w, [x, -y, z]), 0.01, &["swapped or mirrored", "--gyroscope-axes=-x,y,-z"]),
            (|[x, y, z], a| ([y, x, z], a), 0.01, &["swapped or mirrored", "--gyroscope-axes=y,x,z"]),
            (|[x, y, z], a| ([z, x, y], a), 0.01, &["--gyroscope-axes=y,z,x"]),
        ];
        for (number, (mistake, dt, words)) in cases.into_iter().enumerate() {
            let found = verdict(mistake, dt).mistakes.join("; ");
            assert!(words.iter().all(|word| found.contains(word)), "{number}: {found}");
        }
    }
}
