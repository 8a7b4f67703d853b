//! The simulated world: a furnished room around a head that turns but does not move.
//!
//! In: a random seed, or a [`scene`]. Out: for any direction and time, the distance of the nearest surface; for any point
//! and time, whether it is inside a solid; the positions and the sounds of sources. The world does not depend on the map;
//! [`truth`](World::truth_state) only labels a grid's cells so that a map can be compared.
//!
//! Axes and angles are those of [`crate::frame`], with the head at the origin and yaw 0 looking along x;
//! lengths are in metres, times in seconds. Invariant: the head is inside the room and outside every thing at
//! all times, and the same seed gives the same world.

mod motion;
pub mod render;
pub mod scene;
pub mod sensors;
mod shape;
mod source;
mod surface;
#[cfg(test)]
mod tests;
mod truth;

pub use bp_core::compiler::random::{Random, seeded};
pub use motion::{Body, Motion, Placement};
pub use shape::Shape;
pub use source::{Place, Sound, Source};
pub use surface::Surface;
pub use truth::{CellTruth, WALL_M};

use crate::frame::{Spherical, unit_vector};
use rand_distr::{Distribution, Uniform};

/// One piece of furniture.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Its name.
    pub name: String,
    /// Its shape and position.
    pub shape: Shape,
    /// What it looks like.
    pub surface: Surface,
}

/// Fog in a part of the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fog {
    /// Two opposite corners, m.
    pub between: [[f64; 3]; 2],
    /// The distance at which the contrast of what is behind it has fallen to 2 % (meteorological visibility), m.
    pub visibility_m: f64,
}

/// A room, its furniture, what moves in it and what sounds.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Two opposite corners of the room, `[min, max]`, each `[x, y, z]` in metres.
    pub room: [[f64; 3]; 2],
    /// What its walls, floor and ceiling look like.
    pub walls: Surface,
    /// The furniture.
    pub things: Vec<Thing>,
    /// What moves.
    pub bodies: Vec<Body>,
    /// What sounds. The source of the built-in room is just inside the face of the loudspeaker that is visible from the
    /// head.
    pub sources: Vec<Source>,
    /// Fog.
    pub fog: Vec<Fog>,
}

/// What a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance, m.
    pub range_m: f64,
    /// The surface.
    pub surface: Surface,
    /// The number of the body, if it moves.
    pub body: Option<usize>,
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
        let mut place = |name: &str, shape: Shape, to_the_right: f64, ahead: f64| {
            let shape = shape.moved(ahead, -to_the_right);
            things.push(Thing { name: String::from(name), shape, surface: Surface::default() });
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
        let body = Shape::Cylinder { axis: [0.0, 0.0], radius: 0.24, height: [floor, 0.4] };
        let motion =
            Motion::Walk { ends: [[1.8, 1.2], [3.3, -1.7]], period_s: 16.0, phase: 0.5 + jitter(0.5) };
        let walker = Body { name: String::from("walker"), shape: body, motion, surface: Surface::default() };
        let source = Source {
            name: String::from("loudspeaker"),
            place: Place::Fixed(sound_source),
            sound: Sound::Speech,
            level_db: -20.0,
            plays_s: [0.0, f64::INFINITY],
        };
        let (walls, bodies, sources) = (Surface::default(), vec![walker], vec![source]);
        World { room, walls, things, bodies, sources, fog: Vec::new() }
    }

    /// Distance in metres from the head to the first surface along `(azimuth, elevation)` in radians, at a
    /// time in seconds: pure ray casting, no noise.
    pub fn range(&self, direction: (f64, f64), time_s: f64) -> f64 {
        self.hit(direction, time_s).range_m
    }

    /// What the ray from the head along `(azimuth, elevation)` in radians meets first.
    pub fn hit(&self, direction: (f64, f64), time_s: f64) -> Hit {
        self.hit_along(unit_vector(direction.0, direction.1), time_s)
    }

    /// What the ray from the head along a unit vector meets first.
    fn hit_along(&self, ray: [f64; 3], time_s: f64) -> Hit {
        let mut first = Hit { range_m: wall(&self.room, ray), surface: self.walls, body: None };
        let mut meet = |shape: Shape, surface: Surface, body: Option<usize>| {
            if let Some(range_m) = shape.first_hit(ray).filter(|range| *range < first.range_m) {
                first = Hit { range_m, surface, body };
            }
        };
        self.things.iter().for_each(|thing| meet(thing.shape, thing.surface, None));
        for (number, body) in self.bodies.iter().enumerate() {
            meet(body.shape(time_s), body.surface, Some(number));
        }
        first
    }

    /// How much fog, in visibilities, is on the way to a distance along a unit vector from a place.
    pub fn fog_on(&self, from: [f64; 3], ray: [f64; 3], range_m: f64) -> f64 {
        let within = |fog: &Fog| {
            let [min, max] = fog.between.map(|corner| [0, 1, 2].map(|axis| corner[axis] - from[axis]));
            let passed = Shape::Block { min, max }
                .passed(ray)
                .map_or(0.0, |[enters, leaves]| (leaves.min(range_m) - enters.max(0.0)).max(0.0));
            passed / fog.visibility_m
        };
        self.fog.iter().map(within).sum()
    }

    /// Whether the point `[x, y, z]` (metres) is inside a solid, or outside the room, at a time in seconds.
    pub fn occupied(&self, point: [f64; 3], time_s: f64) -> bool {
        let inside = (0..3).all(|axis| (self.room[0][axis]..self.room[1][axis]).contains(&point[axis]));
        !inside
            || self.bodies.iter().any(|body| body.shape(time_s).contains(point))
            || self.things.iter().any(|thing| thing.shape.contains(point))
    }

    /// The position of a source at a time, from a head turned by `yaw` radians (to the left).
    pub fn source_from(&self, source: &Source, yaw: f64, time_s: f64) -> Spherical {
        let place = Spherical::from_cartesian(self.source_at(source, time_s));
        Spherical { azimuth: crate::frame::wrap_angle(place.azimuth - yaw), ..place }
    }
}

/// The share of contrast that is left after some fog, counted in visibilities.
pub fn clearness(visibilities: f64) -> f64 {
    0.02f64.powf(visibilities)
}

/// Distance from the origin, which is inside, to the walls of a room.
pub(crate) fn wall(room: &[[f64; 3]; 2], ray: [f64; 3]) -> f64 {
    (0..3)
        .filter(|&axis| ray[axis] != 0.0)
        .map(|axis| room[usize::from(ray[axis] > 0.0)][axis] / ray[axis])
        .fold(f64::INFINITY, f64::min)
}
