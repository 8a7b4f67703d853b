//! A form to be learned.
//!
//! In: an estimator, and the indices for whose values it is fitted separately. Out: [`Unlearned`]. Invariant: an index that is
//! not named shares the distribution: all elements of a product or of the plate are its cases.

use super::Fit;
use serde::{Deserialize, Serialize};

/// `unknown(…) by n`
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Unlearned {
    /// The estimator.
    pub fit: Fit,
    /// The indices that have a distribution for each of their values.
    pub by: Vec<Apart>,
}

/// An index that is not shared.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Apart {
    /// The index of the `depth`-th enclosing `prod` of the factor, outermost first.
    Product(usize),
    /// The index of the plate.
    Plate,
}

impl From<Fit> for Unlearned {
    fn from(fit: Fit) -> Self {
        Self { fit, by: Vec::new() }
    }
}
