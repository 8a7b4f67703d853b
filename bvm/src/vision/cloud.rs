//! Point clouds of a pair.
//!
//! In: disparities, their picture and its calibration. Out: a binary PLY file: x ahead, y to the left, z up from the
//! left camera (metres; the map's frame, as stated in the header), the grey level, and λ. Invariant: a file is written
//! completely or not at all; only pixels with an estimate have points.

use super::Pair;
use super::stereo::DisparityMap;
use crate::error::Error;
use crate::frame::DESCRIPTION;
use crate::report::write_atomically;
use std::path::Path;

/// Writes the cloud; returns the number of its points.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, pair: &Pair, map: &DisparityMap) -> Result<usize, Error> {
    let mut points = Vec::new();
    let mut count = 0;
    for (at, (&disparity, &confidence)) in map.disparity.iter().zip(&map.confidence).enumerate() {
        let (x, y) = ((at % map.width) as f64, (at / map.width) as f64);
        let Some(point) = pair.calibration.point_m(x, y, f64::from(disparity)) else { continue };
        points.extend(point.iter().flat_map(|metres| (*metres as f32).to_le_bytes()));
        points.extend([pair.left.pixels()[at] as u8; 3]);
        points.extend(confidence.to_le_bytes());
        count += 1;
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment frame of the map: {DESCRIPTION}\n\
         comment origin: the left camera\nelement vertex {count}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         property float confidence\nend_header\n"
    );
    write_atomically(path, &[header.into_bytes(), points].concat())?;
    Ok(count)
}
