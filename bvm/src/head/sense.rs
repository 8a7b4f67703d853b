//! The senses of a head: sight, hearing and balance have one interface.
//!
//! In: the map before the look, and the attitude of the head. Out: a [`Sensed`]. Invariant: a sense without a reading gives
//! no evidence and says why; it never stops a run.

use super::frames::Attitude;
use crate::error::Error;
use crate::map::{Likelihood, Map};
use serde::{Deserialize, Serialize};

/// What a sense gives evidence about, and so the frame of its likelihood.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Evidence {
    /// Nothing was read.
    #[default]
    Nothing,
    /// The likelihood of each cell of the map (frame E), empty or occupied.
    Cells(Likelihood),
    /// The attitude of the head in the map (frame H in E), normal with its deviation.
    Attitude(Attitude),
}

/// Of each direction: whether it was in view, and whether it had a reading then. Empty for a sense without a view.
pub type View = Vec<Option<bool>>;

/// A direction from which something was sensed, with its probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bearing {
    /// Azimuth in the map, degrees to the left.
    pub azimuth_deg: f64,
    /// Elevation, degrees.
    pub elevation_deg: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Probability that a source is within 10 degrees.
    pub probability: f64,
}

/// The answer of a sense.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sensed {
    /// The evidence.
    pub evidence: Evidence,
    /// The number of readings: directions, bands, samples.
    pub readings: usize,
    /// What was wrong with the data, if something was.
    pub fault: Option<String>,
    /// The sources that were found.
    pub found: Vec<Bearing>,
    /// The view.
    pub view: View,
    /// How long its data took to simulate, ms; 0 where they were given.
    pub simulated_ms: f64,
}

/// A sense. Its data come from where it was made to take them: a world, files, devices.
pub trait Sense {
    /// Its name.
    fn name(&self) -> &'static str;

    /// The likelihood of what it reads now.
    ///
    /// # Errors
    /// Those of its program; not those of its data.
    fn likelihood(&mut self, prior: &Map, attitude: &Attitude) -> Result<Sensed, Error>;

    /// Passes over what it would read now, when a run is resumed; needed where reading changes it, as with a generator of
    /// noise.
    ///
    /// # Errors
    /// Those of its program.
    fn skip(&mut self, _attitude: &Attitude) -> Result<(), Error> {
        Ok(())
    }

    /// What it remembers of earlier looks, as numbers, for a run that is resumed.
    fn memory(&self) -> Vec<f32> {
        Vec::new()
    }

    /// Goes on with a [`Sense::memory`].
    fn remember(&mut self, _memory: &[f32]) {}
}
