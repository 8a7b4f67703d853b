//! The Bayesian Volumetric Map: vision, hearing and balance fused into an egocentric map, with active exploration.
//!
//! Ferreira, Pinho and Dias, *Active exploration using Bayesian models for multimodal perception*, ICIAR 2008.
//! Every probability of the map is written in `models/*.bp`; this crate moves data between them.
//!
//! # Frame
//!
//! One right-handed frame holds everywhere, as in REP-103, ROS and SOFA: **x ahead, y to the left, z up**, in metres.
//! Azimuth and yaw are counter-clockwise seen from above, so **positive to the left**; elevation is positive upwards. A
//! source on the left has positive interaural differences; a gyroscope about z is positive for a turn to the left.
//! Cameras have X right, Y down, Z ahead: all conversions are in [`frame`]. Every file that the commands write
//! (pictures, JSON, PLY) is in the map's frame; in pictures the left of the scene is on the left.

pub mod audition;
pub mod error;
pub mod experiment;
pub mod exploration;
pub mod export;
pub mod frame;
pub mod grid;
pub mod head;
mod input;
pub mod map;
pub mod programs;
pub mod recording;
pub mod report;
pub mod vestibular;
pub mod vision;
pub mod world;
