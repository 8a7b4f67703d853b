//! The simulated world: a furnished room around a head that turns but does not move.
//!
//! In: a random seed. Out: for any direction and time, the distance of the nearest surface; for any point and time,
//! whether it is inside a solid; the position of the sound source. The world does not depend on the map;
//! [`truth`](World::truth_state) only labels a grid's cells so that a map can be compared.
//!
//! Axes and angles are those of [`crate::frame`], with the head at the origin and yaw 0 looking along x;
//! lengths are in metres, times in seconds. Invariant: the head is inside the room and outside every thing at
//! all times, and the same seed gives the same world.

pub mod sensors;
mod shape;
#[cfg(test)]
mod tests;
mod truth;

pub use bp_core::compiler::random::{Random, seeded};
pub use shape::Shape;
pub use truth::{CellTruth, WALL_M};

use crate::frame::{Spherical, unit_vector};
use rand_distr::{Distribution, Uniform};
use std::f64::consts::TAU;

/// One piece of furniture.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Its name.
    pub name: &'static str,
    /// Its shape and position.
    pub shape: Shape,
}

/// A person who walks back and forth between two points, and slows down at both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// The two ends `[x, y]` in metres.
    pub ends: [[f64; 2]; 2],
    /// Time to go and come back, in seconds.
    pub period_s: f64,
    /// Fraction of the period at time 0.
    pub phase: f64,
    /// Radius of the body in metres.
    pub radius_m: f64,
    /// Height of the feet and of the head above the observer's eyes, `[low, high]` in metres.
    pub height_m: [f64; 2],
}

impl Walker {
    /// The position `[x, y]` in metres at a time in seconds.
    pub fn place(&self, time_s: f64) -> [f64; 2] {
        let share = 0.5 - 0.5 * (TAU * (time_s / self.period_s + self.phase)).cos();
        let [from, to] = self.ends;
        [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
    }

    fn shape(&self, time_s: f64) -> Shape {
        Shape::Cylinder { axis: self.place(time_s), radius: self.radius_m, height: self.height_m }
    }
}

/// A room, its furniture, a walking person, and a loudspeaker.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Two opposite corners of the room, `[min, max]`, each `[x, y, z]` in metres.
    pub room: [[f64; 3]; 2],
    /// The furniture.
    pub things: Vec<Thing>,
    /// The walking person.
    pub walker: Walker,
    /// The position of the sound source, `[x, y, z]` in metres: just inside the face of the loudspeaker that is visible
    /// from the head.
    pub sound_source: [f64; 3],
}

impl World {
    /// The room of the built-in experiment. The seed moves the walls by up to 20 cm, the furniture by up to
    /// 25 cm, and chooses where the walker starts.
    pub fn embedded(seed: u64) -> World {
        let mut random = seeded(seed, "world");
        let mut jitter = |reach: f64| match Uniform::new_inclusive(-reach, reach) {
            Ok(uniform) => uniform.sample(&mut random),
            Err(_) => 0.0,
        };
        let (floor, ceiling) = (-1.25, 1.45);
        let [left, behind] = [2.7 - jitter(0.2), -2.3 + jitter(0.2)];
        let [right, ahead] = [-3.5 - jitter(0.2), 4.9 + jitter(0.2)];
        let room = [[behind, right, floor], [ahead, left, ceiling]];
        let mut things = Vec::new();
        let mut place = |name, shape: Shape, to_the_right: f64, ahead: f64| {
            things.push(Thing { name, shape: shape.moved(ahead, -to_the_right) });
        };
        let block = |x: [f64; 2], y: [f64; 2], top: f64| Shape::Block {
            min: [x[0], y[0], floor],
            max: [x[1], y[1], top],
        };
        place("table", block([0.9, 1.9], [-2.3, -1.2], -0.35), jitter(0.2), jitter(0.2));
        place("cupboard", block([-0.1, 1.4], [2.0, left], 0.75), 0.0, jitter(0.25));
        place("shelf", block([behind, -1.75], [-1.7, -0.2], 0.45), jitter(0.25), 0.0);
        place("armchair", block([-1.7, -0.9], [0.9, 1.8], -0.2), jitter(0.15), jitter(0.15));
        let pillar = Shape::Cylinder { axis: [3.4, 1.1], radius: 0.24, height: [floor, ceiling] };
        place("pillar", pillar, jitter(0.25), jitter(0.25));
        let lamp = Shape::Ball { centre: [2.3, -0.3, 0.85], radius: 0.22 };
        place("lamp", lamp, jitter(0.25), jitter(0.25));
        let speaker_moves = [jitter(0.2), jitter(0.2)];
        let speaker = Shape::Block { min: [-0.75, -2.5, -0.3], max: [-0.35, -2.1, 0.3] };
        let stand = Shape::Cylinder { axis: [-0.55, -2.3], radius: 0.08, height: [floor, -0.3] };
        place("stand", stand, speaker_moves[0], speaker_moves[1]);
        place("loudspeaker", speaker, speaker_moves[0], speaker_moves[1]);
        let face = speaker.moved(speaker_moves[1], -speaker_moves[0]);
        let sound_source = face.sounding_point();
        let walker = Walker {
            ends: [[1.8, 1.2], [3.3, -1.7]],
            period_s: 16.0,
            phase: 0.5 + jitter(0.5),
            radius_m: 0.24,
            height_m: [floor, 0.4],
        };
        World { room, things, walker, sound_source }
    }

    /// Distance in metres from the head to the first surface along `(azimuth, elevation)` in radians, at a
    /// time in seconds: pure ray casting, no noise.
    pub fn range(&self, direction: (f64, f64), time_s: f64) -> f64 {
        let ray = unit_vector(direction.0, direction.1);
        let wall = (0..3)
            .filter(|&axis| ray[axis] != 0.0)
            .map(|axis| self.room[usize::from(ray[axis] > 0.0)][axis] / ray[axis])
            .fold(f64::INFINITY, f64::min);
        self.things
            .iter()
            .filter_map(|thing| thing.shape.first_hit(ray))
            .chain(self.walker.shape(time_s).first_hit(ray))
            .fold(wall, f64::min)
    }

    /// Whether the point `[x, y, z]` (metres) is inside a solid, or outside the room, at a time in seconds.
    pub fn occupied(&self, point: [f64; 3], time_s: f64) -> bool {
        let inside = (0..3).all(|axis| (self.room[0][axis]..self.room[1][axis]).contains(&point[axis]));
        !inside
            || self.walker.shape(time_s).contains(point)
            || self.things.iter().any(|thing| thing.shape.contains(point))
    }

    /// The position of the sound source, from a head turned by `yaw` radians (to the left).
    pub fn source_from(&self, yaw: f64) -> Spherical {
        let source = Spherical::from_cartesian(self.sound_source);
        Spherical { azimuth: crate::frame::wrap_angle(source.azimuth - yaw), ..source }
    }
}
