//! Acceleration of a fixed-point iteration.
//!
//! In: points θ, and their images G(θ) under a plain step. Out: a point nearer to the fixed point θ = G(θ). Invariant:
//! it is an affine combination of earlier points, so that sums of one are preserved.
//!
//! With r = G(θ) − θ and the differences Δθ and Δr of the last points, θ⁺ = θ + r − (ΔΘ + ΔR) γ, where γ minimises
//! |r − ΔR γ|² (Anderson, *Journal of the ACM* 12:547-560, 1965; for EM Henderson and Varadhan, *Journal of Computational
//! and Graphical Statistics* 28:834-846, 2019). Numbers are compared in their own scales.

use std::collections::VecDeque;

/// Number of differences used.
const MOST: usize = 8;

/// Relative residual of a difference, given the newer ones, below which it is rounding.
const DEPENDENT: f64 = 1e-7;

/// The last points of an iteration.
#[derive(Default)]
pub(super) struct History {
    /// θ and r of the last point.
    last: Option<(Vec<f64>, Vec<f64>)>,
    /// Δθ and Δr, the newest first.
    differences: VecDeque<(Vec<f64>, Vec<f64>)>,
}

impl History {
    /// Removes all but the last point.
    pub(super) fn forget(&mut self) {
        self.differences.clear();
    }

    /// The accelerated point, after a plain step from one point to another.
    pub(super) fn further(&mut self, from: &[f64], to: &[f64], scales: &[f64]) -> Option<Vec<f64>> {
        let minus = |one: &[f64], other: &[f64]| -> Vec<f64> {
            one.iter().zip(other).map(|(one, other)| one - other).collect()
        };
        let step = minus(to, from);
        if let Some((last, before)) = self.last.replace((from.to_vec(), step.clone())) {
            self.differences.push_front((minus(from, &last), minus(&step, &before)));
            self.differences.truncate(MOST);
        }
        let scaled = |numbers: &[f64]| -> Vec<f64> {
            let scales = scales.iter().map(|scale| scale.max(f64::MIN_POSITIVE));
            numbers.iter().zip(scales).map(|(number, scale)| number / scale).collect()
        };
        let columns: Vec<Vec<f64>> = self.differences.iter().map(|(_, bend)| scaled(bend)).collect();
        let weights = least_squares(&columns, scaled(&step));
        let mut further = to.to_vec();
        for ((moved, bend), weight) in self.differences.iter().zip(&weights) {
            let both = moved.iter().zip(bend);
            further
                .iter_mut()
                .zip(both)
                .for_each(|(number, (moved, bend))| *number -= weight * (moved + bend));
        }
        let useful = weights.iter().any(|weight| *weight != 0.0);
        (useful && further.iter().all(|number| number.is_finite())).then_some(further)
    }
}

/// The weights of columns whose sum is the least-squares approximation of a vector; 0 for those that depend on the
/// earlier ones.
fn least_squares(columns: &[Vec<f64>], vector: Vec<f64>) -> Vec<f64> {
    let product = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    // Gram and Schmidt: each column is a combination of orthonormal ones.
    let mut basis: Vec<(usize, Vec<f64>, Vec<f64>)> = Vec::new();
    for (number, column) in columns.iter().enumerate() {
        let (mut rest, mut parts) = (column.clone(), Vec::new());
        for (_, unit, _) in &basis {
            let part = product(unit, &rest);
            rest.iter_mut().zip(unit).for_each(|(rest, unit)| *rest -= part * unit);
            parts.push(part);
        }
        let (whole, length) = (product(column, column).sqrt(), product(&rest, &rest).sqrt());
        if length.is_finite() && length > DEPENDENT * whole {
            rest.iter_mut().for_each(|rest| *rest /= length);
            parts.push(length);
            basis.push((number, rest, parts));
        }
    }
    let mut weights = vec![0.0; columns.len()];
    for (position, (number, unit, parts)) in basis.iter().enumerate().rev() {
        let known: f64 =
            (basis[position + 1..].iter()).map(|(later, _, parts)| parts[position] * weights[*later]).sum();
        weights[*number] = (product(unit, &vector) - known) / parts[position];
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::{History, least_squares};

    #[test]
    fn least_squares_are_those_of_the_normal_equations() {
        // Columns (1, 1, 1) and (0, 1, 2), the line through (0, 1), (1, 2), (2, 4): 5/6 + 3/2 x. The third depends on them.
        let columns = [vec![1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0], vec![2.0, 3.0, 4.0]];
        let weights = least_squares(&columns, vec![1.0, 2.0, 4.0]);
        for (found, expected) in weights.iter().zip([5.0 / 6.0, 1.5, 0.0]) {
            assert!((found - expected).abs() < 1e-14, "{weights:?}");
        }
    }

    #[test]
    fn a_linear_iteration_is_solved_in_as_many_steps_as_it_has_numbers() {
        // x ← 0.999 x + 0.001, y ← −0.5 y + 0.1 x: the fixed point is x = 1, y = 1/15.
        let map = |at: &[f64]| vec![0.999 * at[0] + 0.001, 0.1 * at[0] - 0.5 * at[1]];
        let (mut history, mut at) = (History::default(), vec![0.0, 3.0]);
        for _ in 0..4 {
            let to = map(&at);
            at = history.further(&at, &to, &[1.0, 1.0]).unwrap_or(to);
        }
        assert!((at[0] - 1.0).abs() < 1e-9 && (at[1] - 1.0 / 15.0).abs() < 1e-9, "{at:?}");
    }
}
