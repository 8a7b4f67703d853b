//! The senses of the simulated head: sight (a stereo-like depth camera), hearing (two ears on a sphere) and
//! balance (a gyroscope).
//!
//! In: the world, where the head points, a time and a seeded generator. Out: readings with noise, as the real
//! organs would give them and never the truth. Invariant: the same seed and the same calls give the same
//! readings.
//!
//! Frame: that of [`crate::frame`]. Azimuth relative to the head is world azimuth minus yaw, wrapped; yaw leaves
//! elevation alone. The camera's pitch moves what the camera sees, not the frame of what it reports.

mod camera;
mod ears;
mod gyroscope;

pub use camera::{DepthCamera, Pose};
pub use ears::{CHANNEL_HZ, CHANNELS, Cues, Ears, HEAD_RADIUS_M, SOUND_SPEED_M_S, cues_of};
pub use gyroscope::{Gyroscope, turn_profile};
