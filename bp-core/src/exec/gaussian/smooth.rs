//! Looking back, and ahead: what later observations say of earlier instants, and what follows without any.
//!
//! In: a filter, and the observations of each instant. Out: a [`Belief`] for each. Invariant: carried laws may be
//! singular (a Dirac carries no noise of its own): the pseudo-inverse stands where there is no inverse.
//!
//! With J the law of all of an instant, c the rows that are carried on, and (mˢ, Pˢ) the smoothed law of these:
//! G = Cov(J, c) P_c⁺,  m_J ← m_J + G (mˢ − m_c),  Σ_J ← Σ_J + G (Pˢ − P_c) Gᵀ   (Rauch, Tung and Striebel 1965).

use super::{Belief, Filter, Joint};
use crate::error::Error;
use nalgebra::{DMatrix, DVector};

/// An eigenvalue of the correlations below this is none.
const SINGULAR: f64 = 1e-12;

impl Filter {
    /// The belief of each instant, given the observations up to it; what is not named was not observed.
    ///
    /// # Errors
    /// An observation that is not finite, or that follows from the others.
    pub fn filtered(&mut self, instants: &[Vec<(&str, f64)>]) -> Result<Vec<Belief>, Error> {
        instants.iter().map(|observed| self.advance(observed).map(|joint| self.belief(&joint))).collect()
    }

    /// The belief some instants from now, of which nothing is observed. The filter itself stays.
    pub fn predicted(&self, steps: usize) -> Result<Belief, Error> {
        let mut ahead = self.clone();
        let mut joint = ahead.advance(&[])?;
        for _ in 1..steps {
            joint = ahead.advance(&[])?;
        }
        Ok(ahead.belief(&joint))
    }

    /// The belief of each instant, given the observations of all.
    ///
    /// # Errors
    /// As [`Filter::filtered`].
    pub fn smoothed(&mut self, instants: &[Vec<(&str, f64)>]) -> Result<Vec<Belief>, Error> {
        let mut joints: Vec<Joint> =
            instants.iter().map(|observed| self.advance(observed)).collect::<Result<_, _>>()?;
        let start = self.carried.len();
        for instant in (1..joints.len()).rev() {
            let (mean, covariance) = {
                let after = &joints[instant];
                (
                    after.mean.rows(0, start).into_owned(),
                    after.covariance.view((0, 0), (start, start)).into_owned(),
                )
            };
            joints[instant - 1].learn(&self.carried, &mean, &covariance);
        }
        Ok(joints.iter().map(|joint| self.belief(joint)).collect())
    }
}

impl Joint {
    /// Takes in what later instants say of the rows that were carried on.
    fn learn(&mut self, carried: &[usize], mean: &DVector<f64>, covariance: &DMatrix<f64>) {
        let cross = self.covariance.select_columns(carried);
        let own = cross.select_rows(carried);
        let gain = cross * pseudo_inverse(&own);
        self.mean += &gain * (mean - self.mean.select_rows(carried));
        let smoothed = &self.covariance + &gain * (covariance - own) * gain.transpose();
        self.covariance = (&smoothed + smoothed.transpose()) * 0.5;
    }
}

/// Of the matrix of correlations, so that variances of different sizes are judged alike.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = matrix.diagonal().map(|variance| if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 });
    let scale = DMatrix::from_diagonal(&scale);
    let eigen = (&scale * matrix * &scale).symmetric_eigen();
    let inverse = eigen.eigenvalues.map(|value| if value > SINGULAR { 1.0 / value } else { 0.0 });
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    &scale * inverse * &scale
}
