//! Stereo vision, on synthetic and on recorded pairs.
//!
//! In: picture pairs with their truth. Out: disparities and probabilities. Recordings are optional: a test reports
//! that it was skipped.

mod recordings;
mod stereo;
