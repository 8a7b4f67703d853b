//! Hand-written loops, compared with compiled kernels of the same programs.
//!
//! In: planes of numbers, laid out as for the kernels. Out: the same answers. Invariant: safe Rust, one thread, no
//! allocation inside a row; compiled for each instruction set, as emitted code is; each is checked against the kernel
//! before it is timed.

use bp_core::compiler::exec::scalar::Scalar;
use bp_core::compiler::space::Moves;

/// Lanes that stay in the first-level cache.
const BLOCK: usize = 64;

/// The cell program's inputs.
pub(crate) struct Cells<'a> {
    /// Depth, rows, lanes.
    pub(crate) extents: [usize; 3],
    /// Antecedents.
    pub(crate) moves: &'a Moves,
    /// The probability that occupancy changes.
    pub(crate) epsilon: f32,
    /// P(V) of content that enters.
    pub(crate) motion: &'a [f32],
    /// P(O) before, two planes.
    pub(crate) occupancy: &'a [f32],
    /// P(V) before, a plane for each velocity.
    pub(crate) velocity: &'a [f32],
    /// The likelihood of the sensor's reading, two planes.
    pub(crate) likelihood: &'a [f32],
}

/// The question to the cell program.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Question {
    /// P(O) and P(V).
    Step,
    /// The same, by a loop with seven velocities built in.
    StepOfSeven,
    /// The same, and the entropies.
    Observe,
}

/// Rows of the cell program, compiled for each instruction set.
pub(crate) struct Rows<'a, 'm, 'p> {
    /// The question.
    pub(crate) question: Question,
    /// The inputs.
    pub(crate) cells: &'a Cells<'a>,
    /// The first row.
    pub(crate) first: usize,
    /// The planes' parts for these rows.
    pub(crate) made: &'m mut [&'p mut [f32]],
}

impl pulp::NullaryFnOnce for Rows<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        match self.question {
            Question::Step => step(self.cells, self.first, self.made),
            Question::StepOfSeven => crate::hand_rows::step(self.cells, self.first, self.made),
            Question::Observe => observe(self.cells, self.first, self.made),
        }
    }
}

/// A row read from lane `turn` on, wrapped, as at most two ranges `(to, from, length)`.
fn stretches(turn: i32, lanes: usize) -> [(usize, usize, usize); 2] {
    let from = turn.rem_euclid(lanes as i32) as usize;
    [(0, from, lanes - from), (lanes - from, 0, from)]
}

/// Adds one velocity to one range of a row. A separate function, so that the compiler knows that the written range does
/// not overlap with any that is read.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // for the same reason
fn add_velocity(
    empty: &[f32],
    full: &[f32],
    velocity: &[f32],
    likelihood_empty: &[f32],
    likelihood_full: &[f32],
    sum_empty: &mut [f32],
    sum_full: &mut [f32],
    marginal: &mut [f32],
    epsilon: f32,
) {
    let length = marginal.len();
    let (empty, full, velocity) = (&empty[..length], &full[..length], &velocity[..length]);
    let (likelihood_empty, likelihood_full) = (&likelihood_empty[..length], &likelihood_full[..length]);
    let (sum_empty, sum_full) = (&mut sum_empty[..length], &mut sum_full[..length]);
    let stays = 1.0 - epsilon;
    for lane in 0..length {
        let joint_empty =
            likelihood_empty[lane] * velocity[lane] * (stays * empty[lane] + epsilon * full[lane]);
        let joint_full =
            likelihood_full[lane] * velocity[lane] * (epsilon * empty[lane] + stays * full[lane]);
        sum_empty[lane] += joint_empty;
        sum_full[lane] += joint_full;
        marginal[lane] = joint_empty + joint_full;
    }
}

/// Predict and estimate: P(O) and P(V) of rows `first..` of the plate; `made` are the planes' parts for them.
#[inline(always)]
pub(crate) fn step(cells: &Cells<'_>, first: usize, made: &mut [&mut [f32]]) {
    let [depths, rows, lanes] = cells.extents;
    let plane = depths * rows * lanes;
    let velocities = cells.moves.displacements;
    let mut sums = vec![0.0f32; 2 * lanes];
    let constant = vec![0.5f32; lanes];
    let mut entering = vec![0.0f32; lanes];
    let (sum_empty, sum_full) = sums.split_at_mut(lanes);
    let (occupied, marginals) = made.split_at_mut(2);
    for row in 0..marginals[0].len() / lanes {
        let here = (first + row) * lanes;
        let mine = row * lanes..(row + 1) * lanes;
        let likelihood =
            [&cells.likelihood[here..here + lanes], &cells.likelihood[plane + here..plane + here + lanes]];
        sum_empty.fill(0.0);
        sum_full.fill(0.0);
        for (velocity, marginals) in marginals.iter_mut().enumerate().take(velocities) {
            let table = velocity * depths * rows + first + row;
            let (depth, from) = (cells.moves.depth[table], cells.moves.row[table]);
            let marginal = &mut marginals[mine.clone()];
            if depth < 0 || from < 0 {
                entering.fill(cells.motion[velocity]);
                add_velocity(
                    &constant,
                    &constant,
                    &entering,
                    likelihood[0],
                    likelihood[1],
                    sum_empty,
                    sum_full,
                    marginal,
                    cells.epsilon,
                );
                continue;
            }
            let base = (depth as usize * rows + from as usize) * lanes;
            for (to, at, length) in stretches(cells.moves.turn[table], lanes) {
                let read = |values: &'_ [f32], offset: usize| offset + base + at..values.len();
                let empty = &cells.occupancy[read(cells.occupancy, 0)];
                let full = &cells.occupancy[read(cells.occupancy, plane)];
                let before = &cells.velocity[read(cells.velocity, velocity * plane)];
                add_velocity(
                    empty,
                    full,
                    before,
                    &likelihood[0][to..],
                    &likelihood[1][to..],
                    &mut sum_empty[to..],
                    &mut sum_full[to..],
                    &mut marginal[to..to + length],
                    cells.epsilon,
                );
            }
        }
        for start in (0..lanes).step_by(BLOCK) {
            let width = BLOCK.min(lanes - start);
            let mut scale = [0.0f32; BLOCK];
            let totals = sum_empty[start..start + width].iter().zip(&sum_full[start..start + width]);
            for (scale, (empty, full)) in scale.iter_mut().zip(totals) {
                *scale = 1.0 / (empty + full);
            }
            let part = row * lanes + start..row * lanes + start + width;
            for (plane, sum) in occupied.iter_mut().zip([&*sum_empty, &*sum_full]) {
                let sums = sum[start..start + width].iter().zip(&scale);
                for (cell, (sum, scale)) in plane[part.clone()].iter_mut().zip(sums) {
                    *cell = sum * scale;
                }
            }
            for plane in marginals.iter_mut() {
                for (cell, scale) in plane[part.clone()].iter_mut().zip(&scale) {
                    *cell *= scale;
                }
            }
        }
    }
}

/// −p ln p, 0 at 0.
#[inline(always)]
fn minus_p_ln_p(p: f32) -> f32 {
    -p * (if p > 0.0 { p } else { 1.0 }).natural_logarithm()
}

/// [`step`], and the entropies of (O, V) and O: the last two of `made`.
///
/// With j the joint and s its total, H = ln s − Σ j ln j / s: so the joint need not be stored until s is known.
#[inline(always)]
pub(crate) fn observe(cells: &Cells<'_>, first: usize, made: &mut [&mut [f32]]) {
    let [depths, rows, lanes] = cells.extents;
    let plane = depths * rows * lanes;
    let (planes, entropies) = made.split_at_mut(2 + cells.moves.displacements);
    let (joint, occupancy) = entropies.split_at_mut(1);
    step(cells, first, planes);
    let constant = vec![0.5f32; lanes];
    let mut entering = vec![0.0f32; lanes];
    let (mut sum, mut total) = (vec![0.0f32; lanes], vec![0.0f32; lanes]);
    for row in 0..joint[0].len() / lanes {
        let here = (first + row) * lanes;
        sum.fill(0.0);
        total.fill(0.0);
        for velocity in 0..cells.moves.displacements {
            let table = velocity * depths * rows + first + row;
            let (depth, from) = (cells.moves.depth[table], cells.moves.row[table]);
            let inside = depth >= 0 && from >= 0;
            entering.fill(cells.motion[velocity]);
            let base = if inside { (depth as usize * rows + from as usize) * lanes } else { 0 };
            for (to, at, length) in stretches(cells.moves.turn[table], lanes) {
                let source = |values: &'_ [f32], offset: usize| offset + base + at..values.len();
                let (empty, full, before) = match inside {
                    false => (&constant[..], &constant[..], &entering[..]),
                    true => (
                        &cells.occupancy[source(cells.occupancy, 0)],
                        &cells.occupancy[source(cells.occupancy, plane)],
                        &cells.velocity[source(cells.velocity, velocity * plane)],
                    ),
                };
                add_entropy(
                    empty,
                    full,
                    before,
                    &cells.likelihood[here + to..],
                    &cells.likelihood[plane + here + to..],
                    &mut total[to..],
                    &mut sum[to..to + length],
                    cells.epsilon,
                );
            }
        }
        let mine = row * lanes..(row + 1) * lanes;
        for (cell, (sum, total)) in joint[0][mine.clone()].iter_mut().zip(sum.iter().zip(&total)) {
            *cell = sum / total + total.natural_logarithm();
        }
        let (empty, full) = (&planes[0][mine.clone()], &planes[1][mine.clone()]);
        for (cell, (empty, full)) in occupancy[0][mine].iter_mut().zip(empty.iter().zip(full)) {
            *cell = minus_p_ln_p(*empty) + minus_p_ln_p(*full);
        }
    }
}

/// Adds one velocity to one range of Σ −j ln j and of the total.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // as for `add_velocity`
fn add_entropy(
    empty: &[f32],
    full: &[f32],
    velocity: &[f32],
    likelihood_empty: &[f32],
    likelihood_full: &[f32],
    total: &mut [f32],
    sum: &mut [f32],
    epsilon: f32,
) {
    let length = sum.len();
    let (empty, full, velocity) = (&empty[..length], &full[..length], &velocity[..length]);
    let (likelihood_empty, likelihood_full) = (&likelihood_empty[..length], &likelihood_full[..length]);
    let (total, stays) = (&mut total[..length], 1.0 - epsilon);
    for lane in 0..length {
        let joint_empty =
            likelihood_empty[lane] * velocity[lane] * (stays * empty[lane] + epsilon * full[lane]);
        let joint_full =
            likelihood_full[lane] * velocity[lane] * (epsilon * empty[lane] + stays * full[lane]);
        sum[lane] += minus_p_ln_p(joint_empty) + minus_p_ln_p(joint_full);
        total[lane] += joint_empty + joint_full;
    }
}
