//! The names of the strategies.
//!
//! In: a name as a user writes it. Out: a [`Strategy`]. Invariant: the order of [`Strategy::ALL`] is that in which they are tried.

use serde::{Deserialize, Serialize};

/// A strategy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// Linear and Gaussian: closed form; over time a Kalman filter and smoother.
    Gaussian,
    /// Unknown probabilities, rates and proportions whose priors are conjugate to what is observed: named distributions.
    Conjugate,
    /// Sums and products of finite variables over a join tree.
    JoinTree,
    /// Sums and products of finite variables as a kernel.
    Sums,
    /// Finite variables and reals that are linear and Gaussian given them: a mixture of normal distributions.
    Mixture,
    /// Over time, finite: forward and backward messages.
    Chain,
    /// Draws from the prior, weighted by the evidence.
    Weighting,
    /// Markov chains, in which each variable in turn is sampled given all the others.
    Gibbs,
    /// Over time: draws that follow the program and are weighted by the observations.
    Particles,
    /// Over time, reals: a normal law carried by linearised equations.
    ExtendedKalman,
}

impl Strategy {
    /// All, in the order in which they are tried.
    pub const ALL: [Strategy; 10] = [
        Strategy::Gaussian,
        Strategy::Conjugate,
        Strategy::JoinTree,
        Strategy::Sums,
        Strategy::Mixture,
        Strategy::Chain,
        Strategy::Weighting,
        Strategy::Gibbs,
        Strategy::Particles,
        Strategy::ExtendedKalman,
    ];

    /// Its name for `--by`.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::Gaussian => "gaussian",
            Strategy::Conjugate => "conjugate",
            Strategy::JoinTree => "join_tree",
            Strategy::Sums => "sums",
            Strategy::Mixture => "mixture",
            Strategy::Chain => "chain",
            Strategy::Weighting => "weighting",
            Strategy::Gibbs => "gibbs",
            Strategy::Particles => "particles",
            Strategy::ExtendedKalman => "extended_kalman",
        }
    }

    /// The strategy of a name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|strategy| strategy.name() == name)
    }

    /// Whether its answers are exact.
    pub fn is_exact(self) -> bool {
        let estimates = [Strategy::Weighting, Strategy::Gibbs, Strategy::Particles, Strategy::ExtendedKalman];
        !estimates.contains(&self)
    }

    /// Whether it answers questions over time.
    pub(crate) fn is_over_time(self) -> bool {
        self == Strategy::Gaussian || !self.is_of_one_instant()
    }

    /// Whether it answers questions of one instant.
    pub(crate) fn is_of_one_instant(self) -> bool {
        !matches!(self, Strategy::Chain | Strategy::Particles | Strategy::ExtendedKalman)
    }
}
