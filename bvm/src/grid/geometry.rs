//! Angles and spherical coordinates of the head.
//!
//! In and out: radians and metres. Axes: x to the right, y up, z ahead; azimuth `theta = atan2(x, z)` grows
//! to the right, elevation `phi = atan2(y, sqrt(x^2 + z^2))` grows upwards. Invariant: an azimuth that leaves
//! this file is in `]-pi; pi]`.

use std::f64::consts::{PI, TAU};

/// A point seen from the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spherical {
    /// Distance in metres.
    pub rho_m: f64,
    /// Azimuth theta in radians, positive to the right.
    pub azimuth: f64,
    /// Elevation phi in radians, positive upwards.
    pub elevation: f64,
}

impl Spherical {
    /// From `[x, y, z]` in metres. The origin gets angles 0; straight up and down get azimuth 0.
    pub fn from_cartesian([x, y, z]: [f64; 3]) -> Spherical {
        let ground = x.hypot(z);
        Spherical {
            rho_m: ground.hypot(y),
            azimuth: wrap_angle(x.atan2(z)),
            elevation: if ground == 0.0 && y == 0.0 { 0.0 } else { y.atan2(ground) },
        }
    }

    /// To `[x, y, z]` in metres.
    pub fn to_cartesian(self) -> [f64; 3] {
        unit_vector(self.azimuth, self.elevation).map(|component| component * self.rho_m)
    }
}

/// The unit vector `[x, y, z]` of a direction given by azimuth and elevation in radians.
pub fn unit_vector(azimuth: f64, elevation: f64) -> [f64; 3] {
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    let (sin_elevation, cos_elevation) = elevation.sin_cos();
    [cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth]
}

/// The same angle in `]-pi; pi]`: -pi goes onto pi.
pub fn wrap_angle(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// Great-circle angle in `[0; pi]` between two directions `(azimuth, elevation)` in radians; exact for small
/// and for nearly opposite directions alike (`atan2` of the sine and the cosine).
pub fn great_circle(from: (f64, f64), to: (f64, f64)) -> f64 {
    let [ax, ay, az] = unit_vector(from.0, from.1);
    let [bx, by, bz] = unit_vector(to.0, to.1);
    let cross = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    let sine = cross.iter().map(|component| component * component).sum::<f64>().sqrt();
    sine.atan2(ax * bx + ay * by + az * bz)
}
