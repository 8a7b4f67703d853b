//! The solids that furnish the room, seen from the head at the origin.
//!
//! In: a unit direction, or a point `[x, y, z]` in metres. Out: the distance at which a ray from the origin
//! enters the solid, or whether the point is inside. Invariant: a ray that enters at distance d finds the
//! points just beyond d inside and the points just before d outside.

/// A solid; upright, lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box between two opposite corners.
    Block {
        /// Corner with the smallest coordinates.
        min: [f64; 3],
        /// Corner with the largest coordinates.
        max: [f64; 3],
    },
    /// A ball.
    Ball {
        /// Its centre.
        centre: [f64; 3],
        /// Its radius.
        radius: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Where its axis crosses the ground, `[x, y]`.
        axis: [f64; 2],
        /// Its radius.
        radius: f64,
        /// Lowest and highest z.
        height: [f64; 2],
    },
    /// A box that is turned about the vertical, such as the leaf of a door.
    Board {
        /// Its centre.
        centre: [f64; 3],
        /// Half its sizes, in its own axes.
        half: [f64; 3],
        /// Yaw of its own axes, rad.
        yaw: f64,
    },
}

impl Shape {
    /// The solid displaced by `x` metres ahead and `y` metres to the left.
    pub fn moved(self, x: f64, y: f64) -> Shape {
        self.displaced([x, y, 0.0])
    }

    /// The solid displaced by a vector.
    pub fn displaced(self, [x, y, z]: [f64; 3]) -> Shape {
        let add = |point: [f64; 3]| [point[0] + x, point[1] + y, point[2] + z];
        match self {
            Shape::Block { min, max } => Shape::Block { min: add(min), max: add(max) },
            Shape::Ball { centre, radius } => Shape::Ball { centre: add(centre), radius },
            Shape::Cylinder { axis, radius, height } => Shape::Cylinder {
                axis: [axis[0] + x, axis[1] + y],
                radius,
                height: height.map(|end| end + z),
            },
            Shape::Board { centre, half, yaw } => Shape::Board { centre: add(centre), half, yaw },
        }
    }

    /// The solid turned about the vertical through the origin, counter-clockwise, rad.
    pub fn turned(self, angle: f64) -> Shape {
        match self {
            Shape::Block { min, max } => {
                let centre = [0, 1, 2].map(|axis| 0.5 * (min[axis] + max[axis]));
                let half = [0, 1, 2].map(|axis| 0.5 * (max[axis] - min[axis]));
                Shape::Board { centre: about_vertical(centre, angle), half, yaw: angle }
            }
            Shape::Ball { centre, radius } => Shape::Ball { centre: about_vertical(centre, angle), radius },
            Shape::Cylinder { axis: [x, y], radius, height } => {
                let [x, y, _] = about_vertical([x, y, 0.0], angle);
                Shape::Cylinder { axis: [x, y], radius, height }
            }
            Shape::Board { centre, half, yaw } => {
                Shape::Board { centre: about_vertical(centre, angle), half, yaw: yaw + angle }
            }
        }
    }

    /// A box around the solid: corners with the smallest and the largest coordinates.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let around = |centre: [f64; 3], half: [f64; 3]| {
            [[0, 1, 2].map(|axis| centre[axis] - half[axis]), [0, 1, 2].map(|axis| centre[axis] + half[axis])]
        };
        match *self {
            Shape::Block { min, max } => [min, max],
            Shape::Ball { centre, radius } => around(centre, [radius; 3]),
            Shape::Cylinder { axis: [x, y], radius, height: [low, high] } => {
                [[x - radius, y - radius, low], [x + radius, y + radius, high]]
            }
            Shape::Board { centre, half: [x, y, z], yaw } => {
                let (sine, cosine) = (yaw.sin().abs(), yaw.cos().abs());
                around(centre, [cosine * x + sine * y, sine * x + cosine * y, z])
            }
        }
    }

    /// Whether the point is inside or on the surface.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        match *self {
            Shape::Block { min, max } => (0..3).all(|i| (min[i]..=max[i]).contains(&point[i])),
            Shape::Ball { centre, radius } => {
                (0..3).map(|i| (point[i] - centre[i]).powi(2)).sum::<f64>() <= radius * radius
            }
            Shape::Cylinder { axis, radius, height } => {
                (height[0]..=height[1]).contains(&point[2])
                    && (point[0] - axis[0]).powi(2) + (point[1] - axis[1]).powi(2) <= radius * radius
            }
            Shape::Board { centre, half, yaw } => {
                let away = [0, 1, 2].map(|i| point[i] - centre[i]);
                let own = about_vertical(away, -yaw);
                (0..3).all(|i| own[i].abs() <= half[i])
            }
        }
    }

    /// Distance in metres at which a ray from the origin along the unit vector `ray` enters the solid; `None`
    /// when it misses. The origin is expected outside.
    pub fn first_hit(&self, ray: [f64; 3]) -> Option<f64> {
        let [enters, leaves] = self.passed(ray)?;
        (leaves > 0.0 && enters > 0.0).then_some(enters)
    }

    /// The distances at which the line through the origin along the unit vector `ray` enters and leaves the solid; `None`
    /// when it misses.
    pub fn passed(&self, ray: [f64; 3]) -> Option<[f64; 2]> {
        let (enters, leaves) = match *self {
            Shape::Block { min, max } => overlap((0..3).map(|i| slab(min[i], max[i], ray[i])))?,
            Shape::Ball { centre, radius } => {
                let along = (0..3).map(|i| ray[i] * centre[i]).sum::<f64>();
                let square = centre.iter().map(|c| c * c).sum::<f64>() - radius * radius;
                roots(1.0, along, square)?
            }
            Shape::Cylinder { axis, radius, height } => {
                let [x, y, z] = ray;
                let square = axis[0] * axis[0] + axis[1] * axis[1] - radius * radius;
                let side = roots(x * x + y * y, x * axis[0] + y * axis[1], square);
                overlap([side, slab(height[0], height[1], z)].into_iter())?
            }
            Shape::Board { centre, half, yaw } => {
                let (own, ray) = (about_vertical(centre, -yaw), about_vertical(ray, -yaw));
                overlap((0..3).map(|i| slab(own[i] - half[i], own[i] + half[i], ray[i])))?
            }
        };
        Some([enters, leaves])
    }

    /// A point of the solid 1 cm behind the middle of its visible part: on the ray towards its centre.
    pub fn sounding_point(&self) -> [f64; 3] {
        let centre = match *self {
            Shape::Block { min, max } => [0, 1, 2].map(|i| 0.5 * (min[i] + max[i])),
            Shape::Ball { centre, .. } | Shape::Board { centre, .. } => centre,
            Shape::Cylinder { axis, height, .. } => [axis[0], axis[1], 0.5 * (height[0] + height[1])],
        };
        let distance = centre.iter().map(|c| c * c).sum::<f64>().sqrt();
        let ray = centre.map(|c| c / distance);
        let range = self.first_hit(ray).map_or(distance, |hit| hit + 0.01);
        ray.map(|component| component * range)
    }
}

/// A vector turned about the vertical, counter-clockwise.
pub(super) fn about_vertical([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sine, cosine) = angle.sin_cos();
    [cosine * x - sine * y, sine * x + cosine * y, z]
}

/// The distances between which a ray from the origin with slope `ray` along one axis is between two planes.
fn slab(low: f64, high: f64, ray: f64) -> Option<(f64, f64)> {
    if ray == 0.0 {
        return (low <= 0.0 && high >= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (a, b) = (low / ray, high / ray);
    Some((a.min(b), a.max(b)))
}

/// The part common to several intervals of distance, or `None` where one is missing or they do not meet.
fn overlap(intervals: impl Iterator<Item = Option<(f64, f64)>>) -> Option<(f64, f64)> {
    let mut common = (f64::NEG_INFINITY, f64::INFINITY);
    for interval in intervals {
        let (enters, leaves) = interval?;
        common = (common.0.max(enters), common.1.min(leaves));
    }
    (common.0 <= common.1).then_some(common)
}

/// The two solutions of `a t^2 - 2 b t + c = 0`; with `a = 0` (a vertical ray), all distances or none, by the
/// sign of c.
fn roots(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    if a < 1e-24 {
        return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let discriminant = b * b - a * c;
    (discriminant >= 0.0).then(|| ((b - discriminant.sqrt()) / a, (b + discriminant.sqrt()) / a))
}
