//! The choice of the next gaze.
//!
//! In: the map and the heading. Out: a [`Gaze`]. Invariant: a policy knows nothing of the world.

use super::Coverage;
use crate::error::Error;
use crate::map::{Heading, Likelihood, Map};
use serde::{Deserialize, Serialize};

/// A direction to look at.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Gaze {
    /// Azimuth in the map's frame, rad to the left.
    pub azimuth: f64,
    /// Elevation, rad upwards.
    pub elevation: f64,
    /// The score, in the units of the policy; 0 if there was no choice.
    pub score: f64,
    /// Distance of the chosen frontier cell, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_m: Option<f64>,
}

impl Gaze {
    /// A direction without a score.
    pub fn at(azimuth: f64, elevation: f64) -> Self {
        Self { azimuth, elevation, score: 0.0, range_m: None }
    }
}

/// A rule that chooses gazes; it is asked once for each look, so that it may count looks.
pub trait Policy {
    /// The next gaze.
    ///
    /// # Errors
    /// Those of its program.
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error>;

    /// The likelihood of a sense, before the choice of the same look.
    fn sensed(&mut self, _sense: &str, _likelihood: &Likelihood) {}

    /// How often each direction was in view, and gave a reading, before the choice of the same look.
    fn covered(&mut self, _coverage: &Coverage) {}

    /// The gaze that the neck reached after the choice: the one that was chosen, within the limits of the neck.
    fn turned(&mut self, _gaze: &Gaze) {}
}

impl<F: FnMut(&Map, &Heading) -> Result<Gaze, Error>> Policy for F {
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        self(map, heading)
    }
}
