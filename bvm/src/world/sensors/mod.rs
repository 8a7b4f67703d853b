//! The senses of the simulated head: vision (a stereo-like depth camera), hearing (two ears on a sphere) and balance (a
//! gyroscope).
//!
//! In: the world, the pose of the head, a time and a seeded random generator. Out: noisy readings. Invariant: the same
//! random seed and the same calls give the same readings.
//!
//! Frame: that of [`crate::frame`]. Azimuth relative to the head is world azimuth minus yaw, wrapped; yaw leaves
//! elevation alone. The camera's pitch moves what the camera sees, not the frame of what it reports.

mod camera;
mod ears;
mod gyroscope;

pub use camera::{DepthCamera, Pose};
pub use ears::{CHANNEL_HZ, CHANNELS, Cues, Ears, HEAD_RADIUS_M, SOUND_SPEED_M_S, cues_of};
pub use gyroscope::{Gyroscope, turn_profile};
