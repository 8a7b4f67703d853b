//! The map as a point cloud.
//!
//! In: occupied cells. Out: a binary PLY file: the centre of each cell (x ahead, y left, z up, m), a grey level that is
//! darker the more probable it is, P(O = 1), and the expected velocity (m/s).

use super::Point;
use crate::frame::DESCRIPTION;
use crate::report::{ReportError, write_atomically};
use std::path::Path;

/// Writes the cloud.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, points: &[Point]) -> Result<(), ReportError> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\ncomment frame of the map: {DESCRIPTION}\n\
         comment cells with P(O = 1) >= 0.55; velocity in m/s\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         property float occupancy\nproperty float velocity_x\nproperty float velocity_y\n\
         property float velocity_z\nend_header\n",
        points.len()
    )
    .into_bytes();
    for point in points {
        let grey = (255.0 * 1.6 * (1.0 - point.occupancy)).clamp(0.0, 255.0) as u8;
        bytes.extend(point.place.iter().flat_map(|part| part.to_le_bytes()));
        bytes.extend([grey; 3]);
        bytes.extend(point.occupancy.to_le_bytes());
        bytes.extend(point.velocity.iter().flat_map(|part| part.to_le_bytes()));
    }
    write_atomically(path, &bytes)
}
