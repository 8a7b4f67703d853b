//! Covariance matrices of normal vectors, and the law of one component given others.
//!
//! In: a matrix. Out: a [`Covariance`], or what is wrong with it; the [`Conditional`] law of a component. Invariant: a
//! matrix is symmetric and positive semi-definite; where the known components determine one, its deviation is 0.
//!
//! x_k given x_K = z has the mean m_k + b (z − m_K) and the variance S_kk − b S_Kk, with b = S_kK S_KK⁻¹. With S = L Lᵀ
//! of the components (K, k) in this order, the last row of L gives both: e = L_KK⁻¹ (z − m_K), mean m_k + L_kK e,
//! deviation L_kk.

use crate::spelling::number as written;
use nalgebra::DMatrix;

/// A covariance matrix.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Covariance(Vec<Vec<f64>>);

/// A component given others: normal, with a mean linear in them.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Conditional {
    /// For each of the others, what its distance from its mean adds to the mean.
    pub(crate) weights: Vec<f64>,
    /// Standard deviation; 0 where the others determine it.
    pub(crate) deviation: f64,
}

/// Tolerance of two entries that must be equal, and of an eigenvalue that must not be negative, as a share of the
/// largest entry: rounding.
const ROUNDING: f64 = 1e-12;

/// A part of a variance, given others, up to which it is rounding.
const NOTHING: f64 = 1e-14;

/// Matrices of more components are not written in messages.
const MOST_WRITTEN: usize = 4;

impl Covariance {
    /// A covariance matrix, row by row.
    ///
    /// # Errors
    /// What is wrong: a number that is not finite, a matrix that is not symmetric or not positive semi-definite.
    pub(crate) fn new(rows: Vec<Vec<f64>>) -> Result<Self, String> {
        let size = rows.len();
        let wrong = |why: String| Err(format!("the covariance matrix {} {why}", text(&rows)));
        let pairs = || (0..size).flat_map(|row| (0..size).map(move |column| (row, column)));
        if let Some((row, column)) = pairs().find(|(row, column)| !rows[*row][*column].is_finite()) {
            let found = written(rows[row][column]);
            return wrong(format!("must have finite entries, but [{row}, {column}] is {found}"));
        }
        let largest = rows.iter().flatten().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        let differs = |(row, column): &(usize, usize)| {
            (rows[*row][*column] - rows[*column][*row]).abs() > ROUNDING * largest
        };
        if let Some((row, column)) = pairs().find(differs) {
            let (one, other) = (written(rows[row][column]), written(rows[column][row]));
            return wrong(format!(
                "is not symmetric: [{row}, {column}] is {one}, but [{column}, {row}] is {other}"
            ));
        }
        let found = Self(rows.clone());
        // The factorisation is faster than the eigenvalues, and suffices where it succeeds.
        if found.root(&(0..size).collect::<Vec<usize>>()).is_none() {
            let matrix = DMatrix::from_fn(size, size, |row, column| rows[row.max(column)][row.min(column)]);
            let least = matrix.symmetric_eigenvalues().min();
            if least < -ROUNDING * largest {
                let least = written((least * 1e6).round() / 1e6);
                return wrong(format!("is not positive semi-definite: it has the eigenvalue {least}"));
            }
        }
        Ok(found)
    }

    /// The law of a component given some others.
    pub(crate) fn conditional(&self, known: &[usize], component: usize) -> Conditional {
        let order: Vec<usize> = known.iter().copied().chain([component]).collect();
        let root = self.rows_of_root(&order);
        // b L_KK = L_kK, from the last to the first.
        let last = &root[known.len()];
        let mut weights = vec![0.0; known.len()];
        for place in (0..known.len()).rev() {
            let later: f64 = (place + 1..known.len()).map(|row| weights[row] * root[row][place]).sum();
            let pivot = root[place][place];
            weights[place] = if pivot > 0.0 { (last[place] - later) / pivot } else { 0.0 };
        }
        Conditional { weights, deviation: last[known.len()] }
    }

    /// The rows of L of some components, in this order; `None` where the matrix is not positive semi-definite.
    fn root(&self, order: &[usize]) -> Option<Vec<Vec<f64>>> {
        let root = self.rows_of_root(order);
        let exact = |(place, row): (usize, &usize)| {
            (0..=place).all(|other| {
                let found: f64 = root[place].iter().zip(&root[other]).map(|(a, b)| a * b).sum();
                let expected = self.entry(*row, order[other]);
                let scale = (self.entry(*row, *row) * self.entry(order[other], order[other])).abs().sqrt();
                (found - expected).abs() <= ROUNDING * scale
            })
        };
        order.iter().enumerate().all(exact).then_some(root)
    }

    /// An entry of the lower triangle.
    fn entry(&self, row: usize, column: usize) -> f64 {
        self.0[row.max(column)][row.min(column)]
    }

    /// The factorisation of Cholesky; a pivot that is rounding is 0, and so is what it would divide.
    fn rows_of_root(&self, order: &[usize]) -> Vec<Vec<f64>> {
        let mut root: Vec<Vec<f64>> = Vec::with_capacity(order.len());
        for (place, row) in order.iter().enumerate() {
            let mut own = vec![0.0; place + 1];
            for (column, other) in order[..place].iter().enumerate() {
                let done: f64 = own[..column].iter().zip(&root[column]).map(|(a, b)| a * b).sum();
                let pivot = root[column][column];
                own[column] = if pivot > 0.0 { (self.entry(*row, *other) - done) / pivot } else { 0.0 };
            }
            let variance = self.entry(*row, *row);
            let rest = variance - own.iter().map(|cell| cell * cell).sum::<f64>();
            own[place] = if rest > NOTHING * (place + 1) as f64 * variance { rest.sqrt() } else { 0.0 };
            root.push(own);
        }
        root
    }
}

/// A matrix as the language writes it.
fn text(rows: &[Vec<f64>]) -> String {
    if rows.len() > MOST_WRITTEN {
        return format!("of {} components", rows.len());
    }
    let row = |row: &Vec<f64>| {
        let entries: Vec<String> = row.iter().map(|entry| written(*entry)).collect();
        format!("[{}]", entries.join(", "))
    };
    format!("[{}]", rows.iter().map(row).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::{Conditional, Covariance};

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-14 * expected.abs().max(1.0), "{found}, expected {expected}");
    }

    fn refusal(rows: &[&[f64]]) -> String {
        Covariance::new(rows.iter().map(|row| row.to_vec()).collect()).unwrap_err()
    }

    #[test]
    fn a_component_given_others() {
        let covariance = Covariance::new(vec![vec![1.0, 0.5], vec![0.5, 2.0]]).unwrap();
        // Weight S₁₀/S₀₀ = ½, variance 2 − ¼; the other way ¼, 1 − 1/8.
        let Conditional { weights, deviation } = covariance.conditional(&[0], 1);
        near(weights[0], 0.5);
        near(deviation, 1.75f64.sqrt());
        let Conditional { weights, deviation } = covariance.conditional(&[1], 0);
        near(weights[0], 0.25);
        near(deviation, 0.875f64.sqrt());
        assert_eq!(covariance.conditional(&[], 1).deviation, 2f64.sqrt());
        // x₂ = x₀ + x₁ of independent variances 1 and 4: both determine it, and one alone leaves the other's variance.
        let sum =
            Covariance::new(vec![vec![1.0, 0.0, 1.0], vec![0.0, 4.0, 4.0], vec![1.0, 4.0, 5.0]]).unwrap();
        let Conditional { weights, deviation } = sum.conditional(&[0, 1], 2);
        assert_eq!((weights[0], weights[1], deviation), (1.0, 1.0, 0.0));
        assert_eq!(sum.conditional(&[0], 2).deviation, 2.0);
        // x₁ given x₂: weight 4/5, variance 4 − 16/5.
        let Conditional { weights, deviation } = sum.conditional(&[2], 1);
        near(weights[0], 0.8);
        near(deviation, 0.8f64.sqrt());
    }

    #[test]
    fn what_is_no_covariance_is_named() {
        let asymmetric = refusal(&[&[1.0, 0.5], &[0.7, 2.0]]);
        assert!(asymmetric.contains("is not symmetric: [0, 1] is 0.5, but [1, 0] is 0.7"), "{asymmetric}");
        // Eigenvalues 1 ± 2.
        let indefinite = refusal(&[&[1.0, 2.0], &[2.0, 1.0]]);
        assert!(indefinite.contains("[[1, 2], [2, 1]] is not positive semi-definite"), "{indefinite}");
        assert!(indefinite.contains("eigenvalue -1"), "{indefinite}");
        assert!(refusal(&[&[-1.0]]).contains("eigenvalue -1"));
        // A component of variance 0 has no covariance with others.
        assert!(refusal(&[&[0.0, 1.0], &[1.0, 5.0]]).contains("not positive semi-definite"));
        assert!(refusal(&[&[f64::NAN]]).contains("finite"));
        // Rank one, with entries that are rounded.
        let (a, b) = (0.1f64, 0.7f64);
        assert!(Covariance::new(vec![vec![a * a, a * b], vec![a * b, b * b]]).is_ok());
        assert!(Covariance::new(vec![vec![0.0, 0.0], vec![0.0, 0.0]]).is_ok());
    }
}
