//! A normal law of some slots, which grows by one at a time and is conditioned by one at a time.
//!
//! In: a linear form and a variance, or an observation. Out: the law. Invariant: the covariance is symmetric.
//!
//! y = c·x + b + noise: E y = c·m + b, Cov(x, y) = Σ c, Var y = cᵀ Σ c + q; given y = z with variance S:
//! m ← m + Σ_y (z − m_y) / S, Σ ← Σ − Σ_y Σ_yᵀ / S.

use nalgebra::{DMatrix, DVector};

/// A normal law.
#[derive(Clone, Debug, Default)]
pub(super) struct Normal {
    slots: Vec<usize>,
    mean: Vec<f64>,
    covariance: DMatrix<f64>,
}

impl Normal {
    /// Adds a slot; terms of slots that the law does not have are left out.
    pub(super) fn extend(&mut self, slot: usize, terms: &[(usize, f64)], constant: f64, variance: f64) {
        let size = self.slots.len();
        let mut weights = DVector::zeros(size);
        for (parent, weight) in terms {
            if let Some(row) = self.row(*parent) {
                weights[row] += weight;
            }
        }
        let mean = (0..size).map(|row| weights[row] * self.mean[row]).sum::<f64>() + constant;
        let cross = &self.covariance * &weights;
        let own = weights.dot(&cross) + variance;
        self.covariance.resize_mut(size + 1, size + 1, 0.0);
        for row in 0..size {
            self.covariance[(row, size)] = cross[row];
            self.covariance[(size, row)] = cross[row];
        }
        self.covariance[(size, size)] = own;
        self.mean.push(mean);
        self.slots.push(slot);
    }

    /// Conditions on the value of a slot; gives the ln density that it had. `None` where it had no variance.
    pub(super) fn observe(&mut self, slot: usize, value: f64) -> Option<f64> {
        let row = self.row(slot)?;
        let variance = self.covariance[(row, row)];
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let surprise = value - self.mean[row];
        let cross = self.covariance.column(row).into_owned();
        self.mean.iter_mut().zip(cross.iter()).for_each(|(mean, cross)| *mean += cross * surprise / variance);
        self.covariance -= &cross * cross.transpose() / variance;
        Some(-0.5 * (surprise * surprise / variance + variance.ln() + std::f64::consts::TAU.ln()))
    }

    /// The slots that have a new name, under that name; the others are summed out.
    pub(super) fn renamed(&self, slots: impl Iterator<Item = (usize, usize)>) -> Self {
        let (rows, slots): (Vec<usize>, Vec<usize>) =
            slots.filter_map(|(from, to)| Some((self.row(from)?, to))).unzip();
        Self {
            mean: rows.iter().map(|row| self.mean[*row]).collect(),
            covariance: self.covariance.select_rows(&rows).select_columns(&rows),
            slots,
        }
    }

    /// Mean and standard deviation of a slot.
    pub(super) fn of(&self, slot: usize) -> Option<[f64; 2]> {
        let row = self.row(slot)?;
        Some([self.mean[row], self.covariance[(row, row)].max(0.0).sqrt()])
    }

    fn row(&self, slot: usize) -> Option<usize> {
        self.slots.iter().rposition(|own| *own == slot)
    }
}
