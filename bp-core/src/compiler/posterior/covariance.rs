//! The covariances of an answer: of reals that are asked together.
//!
//! In: the rows of an answer and its parts. Out: a [`Covariance`] for each part of several reals. Invariant: a matrix
//! is in the order of the rows beside which it stands; it is symmetric.

use super::{Answer, Figure, PartLaw, Row};

/// The covariances of the reals of some consecutive rows.
#[derive(Clone, PartialEq, Debug)]
pub struct Covariance {
    /// The first of the rows.
    pub first: usize,
    /// The names of the reals.
    pub names: Vec<String>,
    /// Row by row; the diagonal holds the variances.
    pub matrix: Vec<Vec<f64>>,
}

/// Above this many reals, an answer does not write their covariances: they are more than all its other numbers.
const MOST: usize = 100;

impl Answer {
    /// The covariances of the reals that it answers together with their means and deviations: a matrix for each
    /// instant. None beside other statistics, of a single real, and of more than 100.
    pub fn covariances(&self) -> Vec<Covariance> {
        let mut first = 0;
        let mut found = Vec::new();
        for part in &self.parts {
            let size = part.of.len();
            let Some(rows) = self.answer.get(first..first + size) else { return Vec::new() };
            let Some(names) = rows.iter().map(named).collect::<Option<Vec<String>>>() else {
                return Vec::new();
            };
            let covariance = |one: usize, other: usize| match &part.law {
                PartLaw::Normal { covariance, .. } => Some(covariance[one * size + other]),
                PartLaw::Mixture(mixture) => Some(mixture.covariance(one, other)),
                PartLaw::Finite(_) | PartLaw::Draws(..) => None,
            };
            if (2..=MOST).contains(&size) {
                let row = |one: usize| (0..size).map(|other| covariance(one, other)).collect();
                let matrix: Option<Vec<Vec<f64>>> = (0..size).map(row).collect();
                found.extend(matrix.map(|matrix| Covariance { first, names, matrix }));
            }
            first += size;
        }
        found
    }
}

/// The real of a row with its mean and deviation.
fn named(row: &Row) -> Option<String> {
    let (name, value) = row.values.last()?;
    let moments = matches!(row.figure, Figure::Normal { .. } | Figure::Mixture { .. });
    (moments && value.is_empty()).then(|| name.clone())
}
