//! What surfaces look like: brightness, texture, and whether light passes.
//!
//! In: a point on a surface, in metres and the axes of its solid, so that the texture moves with it. Out: a brightness.
//! Invariant: brightness is in [0, 1], and has no detail finer than the footprint of a pixel, so that pictures are not
//! aliased.

/// A surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The mean share of the light that it returns, in [0, 1].
    pub albedo: f64,
    /// Deviation of the texture as a share of the albedo, in [0, 1].
    pub contrast: f64,
    /// Whether light passes, as through glass: cameras see what is behind it.
    pub transparent: bool,
}

impl Default for Surface {
    /// Grey, with the texture of wallpaper or wood.
    fn default() -> Surface {
        Surface { albedo: 0.5, contrast: 0.5, transparent: false }
    }
}

/// Below this brightness and this contrast a surface gives no range.
const LEAST_ALBEDO: f64 = 0.05;
const LEAST_CONTRAST: f64 = 0.05;

impl Surface {
    /// Whether a camera can measure the distance of the surface: not of glass, nor of what is black or has no texture.
    pub fn is_readable(&self) -> bool {
        !self.transparent && self.albedo >= LEAST_ALBEDO && self.contrast >= LEAST_CONTRAST
    }

    /// The brightness at a point, seen by a pixel of this width on the surface, m; `seed` distinguishes solids.
    pub fn brightness(&self, point: [f64; 3], footprint_m: f64, seed: u32) -> f64 {
        if self.contrast == 0.0 {
            return self.albedo;
        }
        // Octaves whose waves are from 3 pixels on; the finest one fades in as it becomes visible.
        let finest = (3.0 * footprint_m).max(1e-4).log2();
        let (first, share) = (finest.ceil(), finest.ceil() - finest);
        let octave = |number: f64| {
            noise(point.map(|axis| axis / 2f64.powi(number as i32)), seed ^ (number as i32 as u32))
        };
        let sum = share * octave(first)
            + octave(first + 1.0)
            + octave(first + 2.0)
            + (1.0 - share) * octave(first + 3.0);
        (self.albedo * (1.0 + 1.2 * self.contrast * sum)).clamp(0.0, 1.0)
    }
}

/// Value noise: random numbers in [-1, 1] at the points of the unit lattice, blended between them.
fn noise(point: [f64; 3], seed: u32) -> f64 {
    let floor = point.map(f64::floor);
    let corner = floor.map(|axis| axis as i32);
    let [u, v, w] = [0, 1, 2].map(|axis| {
        let at = point[axis] - floor[axis];
        at * at * (3.0 - 2.0 * at)
    });
    let at = |x: i32, y: i32, z: i32| hashed([corner[0] + x, corner[1] + y, corner[2] + z], seed);
    let mix = |a: f64, b: f64, share: f64| a + share * (b - a);
    let plane = |z: i32| mix(mix(at(0, 0, z), at(1, 0, z), u), mix(at(0, 1, z), at(1, 1, z), u), v);
    mix(plane(0), plane(1), w)
}

/// A number in [-1, 1] that depends on every bit of its arguments.
fn hashed([x, y, z]: [i32; 3], seed: u32) -> f64 {
    let mut bits = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d)
        ^ seed.wrapping_mul(0x27d4_eb2f);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
    bits = (bits ^ (bits >> 12)).wrapping_mul(0x297a_2d39);
    bits ^= bits >> 15;
    f64::from(bits) / f64::from(u32::MAX) * 2.0 - 1.0
}
