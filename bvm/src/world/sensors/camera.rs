//! A depth camera with the error of a stereo pair.
//!
//! In: the world, the grid, the pose of the camera. Out: for every direction of the grid one reading or none, along the
//! ray through its centre for the estimated yaw. For rectified parallel cameras `Z = f B / delta`, so that a disparity
//! error `sigma_delta` gives `sigma_Z = Z^2 sigma_delta / (f B)`, and along the ray `sigma_rho = sigma_Z rho / Z`. The
//! confidence is `lambda = sigma_min / sigma_rho`, so that equation 3's `sigma_rho = sigma_min / lambda` gives the
//! error back. Invariant: a confidence is in `]0; 1]`.

use crate::frame::unit_vector;
use crate::grid::Grid;
use crate::map::Heading;
use crate::vision::RangeReading;
use crate::world::{World, clearness};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};

/// The optics and the errors of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthCamera {
    /// Field of view in degrees, `[horizontal, vertical]`.
    pub field_degrees: [f64; 2],
    /// Focal length in pixels.
    pub focal_px: f64,
    /// Distance between the two cameras in metres.
    pub baseline_m: f64,
    /// Standard deviation of the disparity in pixels.
    pub disparity_sigma_px: f64,
    /// Smallest error of a reading in metres, the paper's `sigma_min`.
    pub sigma_min_m: f64,
    /// Share of the readings that are lost.
    pub drop_out: f64,
}

impl Default for DepthCamera {
    /// 80 x 60 degrees, f = 500 px, B = 12 cm, a quarter of a pixel, 1 cm at best, 3 % lost: 1 cm at 1.5 m,
    /// 10 cm at 5 m.
    fn default() -> DepthCamera {
        DepthCamera {
            field_degrees: [80.0, 60.0],
            focal_px: 500.0,
            baseline_m: 0.12,
            disparity_sigma_px: 0.25,
            sigma_min_m: 0.01,
            drop_out: 0.03,
        }
    }
}

/// The pose of the head.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// True yaw, radians to the left.
    pub yaw: f64,
    /// Estimated yaw: it determines the rays through the centres of cells.
    pub heading: Heading,
    /// Tilt of the camera, radians upwards.
    pub pitch: f64,
}

impl DepthCamera {
    /// Standard deviation in metres of a reading of `range_m` metres on a ray whose angle to the optical axis
    /// has the cosine `cosine`; never less than `sigma_min_m`.
    pub fn sigma_m(&self, range_m: f64, cosine: f64) -> f64 {
        let depth = range_m * cosine;
        let sigma_depth = depth * depth * self.disparity_sigma_px / (self.focal_px * self.baseline_m);
        (sigma_depth / cosine).max(self.sigma_min_m)
    }

    /// Whether a camera pitched up by `pitch` radians sees the direction `(azimuth, elevation)` relative to
    /// the head's yaw, and if so the cosine of the angle to its optical axis. The field of view is a pyramid,
    /// as a sensor's is.
    pub fn sees(&self, direction: (f64, f64), pitch: f64) -> Option<f64> {
        let [x, y, z] = unit_vector(direction.0, direction.1);
        let (sine, cosine) = pitch.sin_cos();
        let (up, ahead) = (cosine * z - sine * x, sine * z + cosine * x);
        let reach =
            self.field_degrees.map(|degrees| (0.5 * degrees).to_radians().tan() * ahead * (1.0 + 1e-12));
        (ahead > 0.0 && y.abs() <= reach[0] && up.abs() <= reach[1]).then_some(ahead)
    }

    /// One look, at a time in seconds. Out: one entry for each direction of the grid,
    /// `[elevation_cells][azimuth_cells]`: the reading along the ray through its centre. The ray is exact to the
    /// fraction of a column, except for the error of `pose.heading`. `None` outside the field of view and where the
    /// reading was lost: by chance, in fog, or on a surface that gives none. A surface beyond the grid's reach is reported at its distance, not dropped.
    pub fn look(
        &self,
        world: &World,
        grid: &Grid,
        pose: Pose,
        time_s: f64,
        random: &mut impl Rng,
    ) -> Vec<Option<RangeReading>> {
        grid.all_directions()
            .map(|direction| {
                let (azimuth, elevation) = grid.direction_centre(direction);
                let azimuth = pose.heading.relative(azimuth);
                let cosine = self.sees((azimuth, elevation), pose.pitch)?;
                let lost: f64 = StandardUniform.sample(random);
                let noise: f64 = StandardNormal.sample(random);
                let seen = (azimuth + pose.yaw, elevation);
                let hit = world.hit(seen, time_s);
                let fog = world.fog_on([0.0; 3], unit_vector(seen.0, seen.1), hit.range_m);
                let drop_out =
                    if fog > 0.0 { 1.0 - (1.0 - self.drop_out) * clearness(fog) } else { self.drop_out };
                if lost < drop_out || !hit.surface.is_readable() {
                    return None;
                }
                let range = hit.range_m;
                let measured = (range + noise * self.sigma_m(range, cosine)).max(self.sigma_min_m);
                let confidence = (self.sigma_min_m / self.sigma_m(measured, cosine)).min(1.0);
                Some(RangeReading { range_m: measured as f32, confidence: confidence as f32 })
            })
            .collect()
    }
}
