//! The heading of the head in the map.
//!
//! In: the estimated yaw of the head, in radians. Out: azimuths converted from the map's frame to the head's, and back.
//! Invariant: the map is fixed in the world, and each ray and each cue is placed at its exact angle. The paper (section
//! 2.3) shifts sensor data by whole columns; gazes bisect cells, so that the remainder would be half a cell.

use crate::frame::wrap_angle;

/// The yaw of the head in the map.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Heading {
    /// Radians, positive to the left, not wrapped.
    pub yaw: f64,
}

impl Heading {
    /// The azimuth in the head's frame of an azimuth in the map's.
    pub fn relative(&self, azimuth: f64) -> f64 {
        wrap_angle(azimuth - self.yaw)
    }

    /// The azimuth in the map's frame of an azimuth in the head's.
    pub fn absolute(&self, azimuth: f64) -> f64 {
        wrap_angle(azimuth + self.yaw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn objects_ahead_of_a_head_turned_left_are_on_the_left_of_the_map() {
        let heading = Heading { yaw: FRAC_PI_2 };
        assert_eq!(heading.absolute(0.0), FRAC_PI_2);
        assert_eq!(heading.relative(0.0), -FRAC_PI_2, "the former direction ahead is now on the right");
        assert_eq!(heading.absolute(FRAC_PI_2), PI);
        assert!((heading.relative(heading.absolute(-2.5)) + 2.5).abs() < 1e-15);
    }
}
