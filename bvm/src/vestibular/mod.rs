//! Balance: how the head moves.
//!
//! In: the reading of the canal or of a gyroscope at each instant ([`Vestibular`], yaw alone: `models/vestibular.bp`, as the
//! compiler's closed-form filter), or the rows of an inertial sensor ([`Stream`], orientation: `models/inertial.bp` and
//! `models/rest.bp`). Out: the estimated motion, with deviations. Invariant: the probabilities are those of the programs; units,
//! clocks and faults of sensors are measurement.

// Rows and columns of small matrices are numbered as in the equations.
#![allow(clippy::needless_range_loop)]

mod clock;
pub mod columns;
mod consistency;
mod error;
mod faults;
pub mod human;
pub mod inertial;
mod mistakes;
mod noise;
pub mod reader;
mod rest;
pub mod rotation;
mod stream;
mod table;

pub use consistency::Verdict;
pub use error::BalanceError;
pub use noise::Noise;
pub use stream::{Events, Fault, Instant, Profile, Settings, Stream};
pub use table::Table;

use crate::error::Error;
use crate::programs::vestibular::{self, heading};
use bp_core::compiler::strategies::gaussian::Filter;

/// The kind of sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Balance {
    /// Human semicircular canals: a time constant of 4 s, and noise of 10 °/s (Laurens and Angelaki 2017).
    Human,
    /// A gyroscope: no high-pass filter, noise of 0.01 rad/s.
    Gyroscope,
}

impl Balance {
    fn question(self) -> heading::Question {
        match self {
            Balance::Human => vestibular::heading(),
            Balance::Gyroscope => vestibular::heading().sigma_omega(2.0).sigma_v(0.01).tau_c(1e6),
        }
    }
}

/// The estimate of the head's yaw over time.
#[derive(Clone, Debug)]
pub struct Vestibular {
    filter: Filter,
    yaw: f64,
}

impl Vestibular {
    /// Seconds between two instants.
    pub const DT: f64 = 0.01;

    /// At rest, looking ahead.
    ///
    /// # Errors
    /// Only the program's own checks, which valid data pass.
    pub fn at_rest(balance: Balance) -> Result<Self, Error> {
        Ok(Self { filter: balance.question().filter()?, yaw: 0.0 })
    }

    /// One instant: the measured yaw rate in rad/s, counter-clockwise about the upward z axis (positive to the left).
    /// Returns the estimated yaw in rad.
    ///
    /// # Errors
    /// A rate that is not finite.
    pub fn feel(&mut self, rate: f64) -> Result<f64, Error> {
        let belief = self.filter.step(&[("V", rate)])?;
        self.yaw = belief.mean_of("Theta").unwrap_or(self.yaw);
        Ok(self.yaw)
    }

    /// The estimated yaw in rad to the left.
    pub fn yaw(&self) -> f64 {
        self.yaw
    }
}
