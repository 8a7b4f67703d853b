//! The frames of the head (Fig. 1 of the paper), and the transforms between them.
//!
//! | frame | origin | axes |
//! |---|---|---|
//! | E, the map | the axis of the neck | x ahead at the start, y left, z up: fixed in the world |
//! | H, the head | the same point | x ahead, y left, z up of the head |
//! | C, a camera | the left camera's centre | X right, Y down, Z ahead |
//! | M, the ears | the middle between the ears | as H |
//! | I, the inertial sensor | the sensor | as H |
//!
//! In: vectors in metres. Out: the same in another frame. Invariant: transforms are rotations and displacements; the head
//! turns about the origin of E and H and does not move.

use crate::frame::{Spherical, from_camera};
use crate::map::Heading;
use crate::vestibular::rotation::{self, Matrix, Vector};
use serde::{Deserialize, Serialize};

/// The attitude of the head in the map: H in E. First the yaw about z, then the pitch, then the roll, each about the axes
/// that the ones before have turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// Radians to the left, not wrapped.
    pub yaw: f64,
    /// Radians upwards.
    pub pitch: f64,
    /// Radians, the right side down.
    pub roll: f64,
    /// Deviation of the yaw, rad.
    pub sd_yaw: f64,
}

impl Attitude {
    /// The rotation from the head to the map.
    pub fn matrix(&self) -> Matrix {
        let about = |axis: Vector, angle: f64| rotation::from_vector(axis.map(|part| part * angle));
        let yaw = about([0.0, 0.0, 1.0], self.yaw);
        // About y, a positive angle turns the nose down.
        let pitch = about([0.0, -1.0, 0.0], self.pitch);
        let roll = about([1.0, 0.0, 0.0], self.roll);
        rotation::matrix(rotation::product(rotation::product(yaw, pitch), roll))
    }

    /// The attitude of a rotation from the head to the map, with the yaw nearest to `near`.
    pub fn of(matrix: &Matrix, near: f64) -> Self {
        let ahead = [matrix[0][0], matrix[1][0], matrix[2][0]];
        let yaw = ahead[1].atan2(ahead[0]);
        Self {
            yaw: near + crate::frame::wrap_angle(yaw - near),
            pitch: ahead[2].clamp(-1.0, 1.0).asin(),
            roll: matrix[2][1].atan2(matrix[2][2]),
            sd_yaw: 0.0,
        }
    }

    /// The heading.
    pub fn heading(&self) -> Heading {
        Heading { yaw: self.yaw }
    }
}

/// A rotation, then a displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// The rotation.
    pub rotation: Matrix,
    /// The displacement, m.
    pub translation: Vector,
}

impl Transform {
    /// A point, m.
    pub fn point(&self, point: Vector) -> Vector {
        let turned = rotation::apply(&self.rotation, point);
        std::array::from_fn(|axis| turned[axis] + self.translation[axis])
    }

    /// This transform after another.
    pub fn after(&self, other: &Transform) -> Transform {
        let column = |axis: usize| {
            rotation::apply(&self.rotation, [0, 1, 2].map(|row: usize| other.rotation[row][axis]))
        };
        let columns = [0, 1, 2].map(column);
        Transform {
            rotation: std::array::from_fn(|row| std::array::from_fn(|axis| columns[axis][row])),
            translation: self.point(other.translation),
        }
    }

    /// The other way.
    pub fn inverse(&self) -> Transform {
        let rotation = rotation::transposed(&self.rotation);
        let back = rotation::apply(&rotation, self.translation);
        Transform { rotation, translation: back.map(|part| -part) }
    }
}

/// Where the parts of the head are: each from its own frame to H.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrinsics {
    /// C of the left and of the right camera.
    pub cameras: [Transform; 2],
    /// M.
    pub ears: Transform,
    /// I.
    pub imu: Transform,
}

const UNTURNED: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Extrinsics {
    /// Two parallel cameras `ahead_m` in front of the axis of the neck and `baseline_m` apart, ears on the axis, and the
    /// inertial sensor above it.
    pub fn of(baseline_m: f64, ahead_m: f64) -> Self {
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(from_camera);
        let axes = std::array::from_fn(|row| std::array::from_fn(|axis| columns[axis][row]));
        let camera =
            |side: f64| Transform { rotation: axes, translation: [ahead_m, side * 0.5 * baseline_m, 0.0] };
        Self {
            cameras: [camera(1.0), camera(-1.0)],
            ears: Transform { rotation: UNTURNED, translation: [0.0; 3] },
            imu: Transform { rotation: UNTURNED, translation: [0.0, 0.0, 0.05] },
        }
    }

    /// From a camera to the map.
    pub fn camera_to_map(&self, side: usize, attitude: &Attitude) -> Transform {
        let head = Transform { rotation: attitude.matrix(), translation: [0.0; 3] };
        head.after(&self.cameras[side])
    }

    /// A place seen from the ears, in the map.
    pub fn ears_to_map(&self, attitude: &Attitude, place: Spherical) -> Spherical {
        let head = Transform { rotation: attitude.matrix(), translation: [0.0; 3] };
        Spherical::from_cartesian(head.after(&self.ears).point(place.to_cartesian()))
    }
}
