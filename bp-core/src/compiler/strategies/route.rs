//! Routes: the offers of all strategies as one type.
//!
//! In: an offer. Out: a [`Route`], which plans keep and tests inspect. Invariant: work on a route is done by its
//! strategy; there is no other `match` over all routes.

use super::conjugate::{Conjugate, Precision, Summed};
use super::gaussian::Gaussian;
use super::join_tree::JoinTree;
use super::mixture::Mixture;
use super::over_time::OverTime;
use super::weighting::Sampled;
use super::{Offered, Strategy};
use crate::equation::Exact;

/// How some asks are answered.
#[derive(Clone, PartialEq, Debug)]
pub enum Route {
    /// Sums and products.
    Exact(Exact),
    /// Sums and products over a join tree.
    Tree(JoinTree),
    /// Closed form: all variables are linear and Gaussian.
    Gaussian(Gaussian),
    /// Named posteriors of conjugate priors.
    Conjugate(Conjugate),
    /// A precision with a conjugate prior, and what is linear and Gaussian given it.
    Precision(Precision),
    /// Named posteriors of conjugate priors, given finite variables that are summed out.
    Summed(Summed),
    /// A mixture of normal distributions.
    Mixture(Mixture),
    /// Estimates from draws, where there is no exact route.
    Sampled(Sampled),
    /// Over time, from instant to instant.
    OverTime(OverTime),
}

impl Route {
    /// The offer.
    pub(crate) fn offered(&self) -> &dyn Offered {
        match self {
            Route::Exact(exact) => exact,
            Route::Tree(tree) => tree,
            Route::Gaussian(gaussian) => gaussian,
            Route::Conjugate(conjugate) => conjugate,
            Route::Precision(precision) => precision,
            Route::Summed(summed) => summed,
            Route::Mixture(mixture) => mixture,
            Route::Sampled(sampled) => sampled,
            Route::OverTime(over_time) => over_time,
        }
    }

    /// How the answer is found, and why that is possible.
    pub fn reason(&self) -> &'static str {
        self.offered().reason()
    }

    /// The strategy.
    pub fn strategy(&self) -> Strategy {
        self.offered().strategy()
    }

    /// The sum of products that a kernel computes, where there is one.
    pub fn exact(&self) -> Option<&Exact> {
        match self {
            Route::Exact(exact) => Some(exact),
            _ => None,
        }
    }

    /// The equation of sums and products, also where a join tree computes it.
    pub(crate) fn equation(&self) -> Option<&Exact> {
        match self {
            Route::Exact(exact) => Some(exact),
            Route::Tree(tree) => Some(&tree.exact),
            _ => None,
        }
    }
}
