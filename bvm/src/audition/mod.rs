//! Hearing: from sound to directions, and from cues to evidence for the map.
//!
//! In: two channels of sound and a calibrated head ([`Listening`]), which may turn ([`Attitudes`]), or the cues of one moment ([`Hearing`]). Out: the
//! posterior of the place of a sound (`models/listening.bp`), and the likelihood of the map's cells
//! (`models/binaural.bp`). Invariant: differences are positive when the left ear leads or is louder; filters and
//! correlations are measurement, probabilities are in the programs.

mod attitudes;
mod binaural;
mod calibration;
mod channels;
mod cochlea;
mod directions;
mod error;
mod expected;
mod head;
mod hearing;
mod listening;
mod parts;
mod played;
mod region;
pub mod sofa;
pub mod sphere;
pub mod synthesis;
mod turns;
mod voices;
pub mod wave;

pub use attitudes::Attitudes;
pub use binaural::{BandCue, BinauralUnit, Cues, independent};
pub use calibration::{Calibration, CueRow, DirectionCues, DistanceLaw, Origin, checksum};
pub use channels::Channels;
pub use cochlea::{BANDS, Cochlea, Cochleagram, bands_at, centres_hz, erb_hz};
pub use error::AuditionError;
pub use head::{Head, Measured, Responses, resampled};
pub use hearing::Hearing;
pub use listening::{Directions, Listening};
pub use parts::{PART_S, Parts};
pub use region::{Found, RegionBox, Source};
pub use turns::{Turn, Turns};
