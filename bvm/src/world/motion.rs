//! How bodies move.
//!
//! In: a time in seconds. Out: where a body is, and how fast. Invariant: positions are continuous in time, so that
//! velocities are finite.

use super::shape::Shape;
use super::surface::Surface;
use std::f64::consts::TAU;

/// The placement of a body: displacement on the floor in metres, and rotation about the vertical in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// `[x, y]`, m.
    pub at: [f64; 2],
    /// Counter-clockwise, rad.
    pub yaw: f64,
}

/// A motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Back and forth between two points, slower at both ends.
    Walk {
        /// The two ends `[x, y]` in metres.
        ends: [[f64; 2]; 2],
        /// Time to go and come back, in seconds.
        period_s: f64,
        /// Fraction of the period at time 0.
        phase: f64,
    },
    /// Evenly from point to point, each `[time, x, y]` in seconds and metres; at rest before the first and after the last.
    Path {
        /// The points, in order of time.
        points: Vec<[f64; 3]>,
    },
    /// About a vertical hinge, once.
    Swing {
        /// The hinge `[x, y]`, m.
        hinge: [f64; 2],
        /// Yaw before and after, rad.
        yaw: [f64; 2],
        /// When it begins, and how long it takes, s.
        time_s: [f64; 2],
    },
}

impl Motion {
    /// The placement at a time in seconds.
    pub fn place(&self, time_s: f64) -> Placement {
        match self {
            Motion::Walk { ends: [from, to], period_s, phase } => {
                let share = 0.5 - 0.5 * (TAU * (time_s / period_s + phase)).cos();
                let at = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
                Placement { at, yaw: 0.0 }
            }
            Motion::Path { points } => Placement { at: along(points, time_s), yaw: 0.0 },
            Motion::Swing { hinge, yaw: [from, to], time_s: [start, takes] } => {
                let share = ((time_s - start) / takes).clamp(0.0, 1.0);
                // At rest at both ends.
                let eased = share * share * (3.0 - 2.0 * share);
                Placement { at: *hinge, yaw: from + eased * (to - from) }
            }
        }
    }

    /// The time after which nothing moves; `None` if it goes on.
    pub fn ends_s(&self) -> Option<f64> {
        match self {
            Motion::Walk { .. } => None,
            Motion::Path { points } => points.last().map(|last| last[0]),
            Motion::Swing { time_s: [start, takes], .. } => Some(start + takes),
        }
    }
}

/// The position between points of a path.
fn along(points: &[[f64; 3]], time_s: f64) -> [f64; 2] {
    let after = points.partition_point(|point| point[0] <= time_s);
    let [from, to] = [after.saturating_sub(1), after.min(points.len() - 1)].map(|at| points[at]);
    let share = if to[0] > from[0] { ((time_s - from[0]) / (to[0] - from[0])).clamp(0.0, 1.0) } else { 0.0 };
    [1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}

/// A body that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// Its shape in its own axes: the origin moves along the path.
    pub shape: Shape,
    /// How it moves.
    pub motion: Motion,
    /// What it looks like.
    pub surface: Surface,
}

/// Half the interval of a difference quotient, s.
const HALF_S: f64 = 1e-3;

impl Body {
    /// The shape at a time, in the axes of the world.
    pub fn shape(&self, time_s: f64) -> Shape {
        let Placement { at: [x, y], yaw } = self.motion.place(time_s);
        let turned = if yaw == 0.0 { self.shape } else { self.shape.turned(yaw) };
        turned.moved(x, y)
    }

    /// The velocity of the point of the body that is at a place at a time, `[x, y, z]` in m/s.
    pub fn velocity(&self, [px, py, _]: [f64; 3], time_s: f64) -> [f64; 3] {
        let [before, after] = [-HALF_S, HALF_S].map(|dt| self.motion.place(time_s + dt));
        let rate = |one: f64, other: f64| (other - one) / (2.0 * HALF_S);
        let [x, y] = self.motion.place(time_s).at;
        let spin = rate(before.yaw, after.yaw);
        [
            rate(before.at[0], after.at[0]) - spin * (py - y),
            rate(before.at[1], after.at[1]) + spin * (px - x),
            0.0,
        ]
    }
}
