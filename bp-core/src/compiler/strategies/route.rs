//! Routes: the offers of all strategies as one value.
//!
//! In: an offer. Out: a [`Route`], which plans keep and tests look into. Invariant: what is done with a route is done by its
//! strategy; there is no other `match` over all of them.

use super::gaussian::Gaussian;
use super::join_tree::JoinTree;
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
    /// All is linear and Gaussian: closed form.
    Gaussian(Gaussian),
    /// No exact route: estimated by draws.
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
            Route::Sampled(sampled) => sampled,
            Route::OverTime(over_time) => over_time,
        }
    }

    /// Which way the answer is found, and why it can be.
    pub fn reason(&self) -> &'static str {
        self.offered().reason()
    }

    /// By which strategy.
    pub fn strategy(&self) -> Strategy {
        self.offered().strategy()
    }

    /// The sum of products that a kernel computes, where one does.
    pub fn exact(&self) -> Option<&Exact> {
        match self {
            Route::Exact(exact) => Some(exact),
            _ => None,
        }
    }
}
