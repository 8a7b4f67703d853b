//! Pictures of the world.
//!
//! In: a world, a camera, a time. Out: a grey picture: texture, fog, exposure, noise. Invariant: the picture does not depend
//! on the number of threads; each pixel is the ray through its middle, by the same geometry as [`World::range`].

use super::shape::{Shape, about_vertical};
use super::{Placement, Surface, World, clearness, wall};
use crate::vestibular::rotation::{self, Matrix};
use crate::vision::{GreyImage, VisionError};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// The mean grey level to which exposure brings a picture, and the brightness of fog.
const MEAN: f64 = 110.0;
const FOG: f64 = 0.7;
/// Exposure is at most this, in grey levels for brightness 1: a dark room stays dark.
const MOST_EXPOSURE: f64 = 2000.0;
/// The share of light that passes a pane of glass.
const PASSES: f64 = 0.92;

/// A pinhole camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Its centre, m.
    pub place: [f64; 3],
    /// From its axes (right, down, ahead) to those of the world.
    pub rotation: Matrix,
    /// Width and height, pixels.
    pub size_px: [usize; 2],
    /// Focal length, pixels.
    pub focal_px: f64,
}

/// A solid as the camera sees it.
struct Seen {
    /// Relative to the camera.
    shape: Shape,
    surface: Surface,
    /// The axes of its texture.
    placement: Placement,
    seed: u32,
}

impl Pinhole {
    /// The pixel of the optical axis.
    pub fn centre_px(&self) -> [f64; 2] {
        self.size_px.map(|size| 0.5 * (size as f64 - 1.0))
    }

    /// The brightness of each pixel, row by row, in [0, 1].
    pub fn brightness(&self, world: &World, time_s: f64) -> Vec<f64> {
        let back = self.place.map(|part| -part);
        let still = world.things.iter().map(|thing| (thing.shape, thing.surface, Placement::default()));
        let moving =
            world.bodies.iter().map(|body| (body.shape(time_s), body.surface, body.motion.place(time_s)));
        let solids: Vec<Seen> = (still.chain(moving).zip(1..))
            .map(|((shape, surface, placement), seed)| Seen {
                shape: shape.displaced(back),
                surface,
                placement,
                seed,
            })
            .collect();
        let room = world.room.map(|corner| [0, 1, 2].map(|axis| corner[axis] - self.place[axis]));
        let [width, height] = self.size_px;
        let [cx, cy] = self.centre_px();
        let row = |y: usize| {
            let (room, solids) = (&room, &solids);
            (0..width).map(move |x| {
                let slopes = [(x as f64 - cx) / self.focal_px, (y as f64 - cy) / self.focal_px, 1.0];
                let length = slopes[0].hypot(slopes[1]).hypot(1.0);
                let ray = rotation::apply(&self.rotation, slopes.map(|slope| slope / length));
                self.pixel(world, room, solids, ray)
            })
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }

    fn pixel(&self, world: &World, room: &[[f64; 3]; 2], solids: &[Seen], ray: [f64; 3]) -> f64 {
        let (mut range, mut first) = (wall(room, ray), None);
        let mut glass = f64::INFINITY;
        for solid in solids {
            let Some(hit) = solid.shape.first_hit(ray).filter(|hit| *hit < range) else { continue };
            if solid.surface.transparent {
                glass = glass.min(hit);
            } else {
                (range, first) = (hit, Some(solid));
            }
        }
        let point = [0, 1, 2].map(|axis| self.place[axis] + range * ray[axis]);
        let footprint = range / self.focal_px;
        let own = match first {
            None => world.walls.brightness(point, footprint, 0),
            Some(Seen { surface, placement: Placement { at: [x, y], yaw }, seed, .. }) => {
                let local = about_vertical([point[0] - x, point[1] - y, point[2]], -yaw);
                surface.brightness(local, footprint, *seed)
            }
        };
        let clear = if world.fog.is_empty() { 1.0 } else { clearness(world.fog_on(self.place, ray, range)) };
        let seen = own * clear + FOG * (1.0 - clear);
        if glass < range { PASSES * seen } else { seen }
    }
}

/// The exposure of a picture: grey levels for brightness 1.
pub fn exposure(brightness: &[f64]) -> f64 {
    let mean = brightness.iter().sum::<f64>() / brightness.len().max(1) as f64;
    (MEAN / mean.max(1e-9)).min(MOST_EXPOSURE)
}

/// The picture of some brightnesses: exposed, with noise of a deviation in grey levels, whole levels from 0 to 255.
///
/// # Errors
/// A size without pixels.
pub fn exposed(
    size_px: [usize; 2],
    brightness: &[f64],
    exposure: f64,
    noise: f64,
    random: &mut impl Rng,
) -> Result<GreyImage, VisionError> {
    let level = |value: &f64| {
        let own: f64 = StandardNormal.sample(random);
        (exposure * value + noise * own).round().clamp(0.0, 255.0) as f32
    };
    GreyImage::new(size_px[0], size_px[1], brightness.iter().map(level).collect())
}
