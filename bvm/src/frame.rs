//! The frame of the map, and the only conversions to and from the frames of cameras.
//!
//! ```text
//!            the map, the head, the world (REP-103, SOFA)          a camera (its rows run downwards)
//! axes       x ahead, y left, z up: right-handed                   X right, Y down, Z ahead: right-handed
//! azimuth    θ = atan2(y, x): counter-clockwise seen from above, so positive to the left
//! elevation  φ = atan2(z, √(x² + y²)): positive upwards
//! yaw        as azimuth: positive to the left
//! ```
//!
//! In and out: metres and radians. Invariant: an azimuth that leaves this file is in `]-pi; pi]`, and no other file of
//! this crate converts between the two frames.

mod angles;

pub use angles::angles;

use std::f64::consts::{PI, TAU};

/// The frame in one line, for the headers of files that hold points or directions.
pub const DESCRIPTION: &str =
    "x ahead, y left, z up (m); azimuth counter-clockwise, left positive; elevation up";

/// A point seen from the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spherical {
    /// Distance in metres.
    pub rho_m: f64,
    /// Azimuth theta in radians, positive to the left.
    pub azimuth: f64,
    /// Elevation phi in radians, positive upwards.
    pub elevation: f64,
}

impl Spherical {
    /// From `[x, y, z]` in metres. The origin gets angles 0; straight up and down get azimuth 0.
    pub fn from_cartesian([x, y, z]: [f64; 3]) -> Spherical {
        let ground = x.hypot(y);
        Spherical {
            rho_m: ground.hypot(z),
            azimuth: if ground == 0.0 { 0.0 } else { wrap_angle(y.atan2(x)) },
            elevation: if ground == 0.0 && z == 0.0 { 0.0 } else { z.atan2(ground) },
        }
    }

    /// To `[x, y, z]` in metres.
    pub fn to_cartesian(self) -> [f64; 3] {
        unit_vector(self.azimuth, self.elevation).map(|component| component * self.rho_m)
    }
}

/// A point or a vector of a camera's frame, `[right, down, ahead]`, in the map's: `[ahead, left, up]`.
pub fn from_camera([right, down, ahead]: [f64; 3]) -> [f64; 3] {
    [ahead, -right, -down]
}

/// The inverse of [`from_camera`].
pub fn to_camera([ahead, left, up]: [f64; 3]) -> [f64; 3] {
    [-left, -up, ahead]
}

/// The unit vector `[x, y, z]` of a direction given by azimuth and elevation in radians.
pub fn unit_vector(azimuth: f64, elevation: f64) -> [f64; 3] {
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    let (sin_elevation, cos_elevation) = elevation.sin_cos();
    [cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation]
}

/// The angle in `]-pi; pi]`: -pi becomes pi.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    /// The cross product, by its definition.
    fn cross([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
        [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
    }

    #[test]
    fn axes_are_ahead_left_up() {
        let at = |point| {
            let Spherical { rho_m, azimuth, elevation } = Spherical::from_cartesian(point);
            (rho_m, azimuth, elevation)
        };
        assert_eq!(at([2.0, 0.0, 0.0]), (2.0, 0.0, 0.0), "ahead");
        assert_eq!(at([0.0, 2.0, 0.0]), (2.0, FRAC_PI_2, 0.0), "left");
        assert_eq!(at([0.0, -2.0, 0.0]), (2.0, -FRAC_PI_2, 0.0), "right");
        assert_eq!(at([0.0, 0.0, 3.0]), (3.0, 0.0, FRAC_PI_2), "up");
        assert_eq!(at([-0.0, -0.0, -3.0]), (3.0, 0.0, -FRAC_PI_2), "down");
        assert_eq!(at([-1.0, -0.0, 0.0]), (1.0, PI, 0.0), "behind");
        assert_eq!(at([0.0; 3]), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_frame_is_right_handed_and_so_is_the_camera_s() {
        let [ahead, left, up] =
            [(0.0, 0.0), (FRAC_PI_2, 0.0), (0.0, FRAC_PI_2)].map(|(azimuth, elevation)| {
                unit_vector(azimuth, elevation).map(|component| (component * 1e9).round() / 1e9)
            });
        assert_eq!(cross(ahead, left), up);
        // Right × down is ahead, in both frames: no reflection lies between them.
        let [right, down, ahead] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(from_camera);
        assert_eq!(
            cross(right, down).map(|component| component + 0.0),
            ahead.map(|component| component + 0.0)
        );
    }

    #[test]
    fn an_asymmetric_scene_by_hand() {
        // A lamp to the left, above and near; a box to the right, below and far: in the camera's frame and in the
        // map's.
        for (camera, map, azimuth, is_above) in [
            ([-1.0, -0.5, 1.0], [1.0, 1.0, 0.5], FRAC_PI_4, true),
            ([4.0, 1.5, 4.0], [4.0, -4.0, -1.5], -FRAC_PI_4, false),
        ] {
            assert_eq!(from_camera(camera), map);
            assert_eq!(to_camera(map), camera);
            let seen = Spherical::from_cartesian(map);
            assert!((seen.azimuth - azimuth).abs() < 1e-15 && (seen.elevation > 0.0) == is_above);
        }
    }

    #[test]
    fn great_circle_angles() {
        let degrees = |a: (f64, f64), b: (f64, f64)| {
            great_circle((a.0.to_radians(), a.1.to_radians()), (b.0.to_radians(), b.1.to_radians()))
                .to_degrees()
        };
        assert!((degrees((170.0, 0.0), (-170.0, 0.0)) - 20.0).abs() < 1e-12);
        assert!((degrees((0.0, 80.0), (180.0, 80.0)) - 20.0).abs() < 1e-12);
        assert!((degrees((0.0, 0.0), (180.0, 0.0)) - 180.0).abs() < 1e-12);
        assert!((degrees((0.0, 0.0), (1e-9, 0.0)) - 1e-9).abs() < 1e-20);
        assert!((degrees((0.0, 0.0), (60.0, 60.0)) - 0.25_f64.acos().to_degrees()).abs() < 1e-12);
    }
}
