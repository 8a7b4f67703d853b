//! Vision: from the image files of a rectified stereo pair to one range reading per direction.
//!
//! ```text
//! two images ─┐
//!             read, rectify ─▶ Pair ─ matched ─▶ DisparityMap ─ readings, codes ─▶ one per direction, or none
//! calibration ┘                  └ Calibration ──────────────────┘
//! ```
//!
//! This folder measures; it contains no probability of the map. The likelihood of a reading for the cells of its line
//! of sight is computed by `models/line_of_sight.bp`. Invariant: a pixel or a direction without an estimate is marked
//! so (`None`, infinity with confidence 0); a surface is never invented.

pub mod calibration;
pub mod cloud;
pub mod error;
pub mod evaluation;
pub mod image;
mod missing;
mod netpbm;
mod pair;
pub mod pfm;
pub mod population;
pub mod readings;
mod sight;
pub mod stereo;

pub use calibration::Calibration;
pub use error::VisionError;
pub use image::GreyImage;
pub use missing::Missing;
pub use pair::Pair;
pub use population::{Codes, Population};
pub use readings::{RangeReading, readings};
pub use sight::{EvidenceKind, FrameEvidence, HiddenCells, Sight, ViewReadings};
pub use stereo::{DisparityMap, Matcher, match_pair};
