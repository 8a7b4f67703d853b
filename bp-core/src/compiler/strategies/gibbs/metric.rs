//! The metric of Hamiltonian Monte Carlo: coordinates in which a density varies alike in all directions.
//!
//! In: the draws of all chains. Out: a [`Metric`]. Invariant: it never has a direction without extent.

use super::hamiltonian::Hamiltonian;
use nalgebra::{Cholesky, DMatrix};

/// Blocks of more sites than these have a diagonal metric.
const MOST_CORRELATED: usize = 200;

/// The draws of each chain from which it is learned at least.
const FEWEST_DRAWS: usize = 3;

/// So many draws count for uncorrelated coordinates.
const PRIOR_DRAWS: f64 = 5.0;

/// Deviations, or a lower triangle.
#[derive(Clone, Debug)]
pub(super) enum Metric {
    Deviations(Vec<f64>),
    Triangle(DMatrix<f64>),
}

impl Metric {
    pub(super) fn unit(dimensions: usize) -> Self {
        Metric::Deviations(vec![1.0; dimensions])
    }

    /// L w
    pub(super) fn along(&self, w: &[f64]) -> Vec<f64> {
        match self {
            Metric::Deviations(deviations) => deviations.iter().zip(w).map(|(by, w)| by * w).collect(),
            Metric::Triangle(lower) => {
                let mut along = vec![0.0; w.len()];
                for (column, w) in w.iter().enumerate() {
                    let own = lower.column(column);
                    let below = &own.as_slice()[column..];
                    along[column..].iter_mut().zip(below).for_each(|(sum, by)| *sum += by * w);
                }
                along
            }
        }
    }

    /// Lᵀ g
    pub(super) fn across(&self, slopes: &[f64]) -> Vec<f64> {
        match self {
            Metric::Deviations(_) => self.along(slopes),
            Metric::Triangle(lower) => {
                let product = |column: usize| {
                    let own = lower.column(column);
                    let below = &own.as_slice()[column..];
                    below.iter().zip(&slopes[column..]).map(|(by, slope)| by * slope).sum()
                };
                (0..slopes.len()).map(product).collect()
            }
        }
    }

    /// The metric of the later half of what all chains remember; each chain varies about its own mean.
    pub(super) fn learn(chains: &[&Hamiltonian], dimensions: usize) -> Option<Self> {
        let draws = chains.iter().map(|chain| chain.history.len() / dimensions).min()?;
        let later = draws - draws / 2;
        if later < FEWEST_DRAWS {
            return None;
        }
        let count = (chains.len() * (later - 1)) as f64;
        let is_dense = dimensions <= MOST_CORRELATED;
        let mut variances = vec![0.0; dimensions];
        let mut covariance = DMatrix::<f64>::zeros(dimensions, if is_dense { dimensions } else { 0 });
        for chain in chains {
            let cells = &chain.history[(draws - later) * dimensions..draws * dimensions];
            let mut away = DMatrix::from_column_slice(dimensions, later, cells);
            let mean = away.column_mean();
            away.column_iter_mut().for_each(|mut column| column -= &mean);
            if is_dense {
                covariance += &away * away.transpose() / count;
            }
            for (place, variance) in variances.iter_mut().enumerate() {
                *variance += away.row(place).norm_squared() / count;
            }
        }
        if !variances.iter().all(|variance| *variance > 0.0 && variance.is_finite()) {
            return None;
        }
        let diagonal = || Metric::Deviations(variances.iter().map(|variance| variance.sqrt()).collect());
        if !is_dense {
            return Some(diagonal());
        }
        let share = count / (count + PRIOR_DRAWS + dimensions as f64);
        for (place, variance) in variances.iter().enumerate() {
            covariance.column_mut(place).scale_mut(share);
            covariance[(place, place)] = *variance;
        }
        Some(Cholesky::new(covariance).map_or_else(diagonal, |cholesky| Metric::Triangle(cholesky.l())))
    }
}
