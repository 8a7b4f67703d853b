//! Rotations: quaternions with w first, and their matrices.
//!
//! In: vectors and quaternions. Out: the same. Invariant: a quaternion turns a vector of the sensor into one of the world; the
//! product `a b` turns by b first.

/// A vector.
pub type Vector = [f64; 3];
/// w, x, y, z.
pub type Quaternion = [f64; 4];
/// Rows.
pub type Matrix = [Vector; 3];

/// The rotation by |v| about v.
pub fn from_vector(v: Vector) -> Quaternion {
    let half = 0.5 * v.iter().map(|cell| cell * cell).sum::<f64>().sqrt();
    // sin(x)/x by its series, where the quotient would lose digits or be 0/0.
    let scale = if half < 1e-4 { 0.5 * (1.0 - half * half / 6.0) } else { 0.5 * half.sin() / half };
    [half.cos(), scale * v[0], scale * v[1], scale * v[2]]
}

/// The product: turns by `b`, then by `a`.
pub fn product([aw, ax, ay, az]: Quaternion, [bw, bx, by, bz]: Quaternion) -> Quaternion {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// Of length 1.
pub fn normalised(q: Quaternion) -> Quaternion {
    let scale = 1.0 / q.iter().map(|cell| cell * cell).sum::<f64>().sqrt();
    q.map(|cell| cell * scale)
}

/// The matrix of a rotation.
pub fn matrix([w, x, y, z]: Quaternion) -> Matrix {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// The matrix of the inverse.
pub fn transposed(m: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| m[column][row]))
}

/// A vector turned.
pub fn apply(m: &Matrix, v: Vector) -> Vector {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The cross product.
pub fn cross([ax, ay, az]: Vector, [bx, by, bz]: Vector) -> Vector {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

/// The scalar product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

/// The smallest rotation from the direction of `a` to that of `b`.
pub fn between(a: Vector, b: Vector) -> Quaternion {
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    let real = lengths + dot(a, b);
    if real > 1e-12 * lengths {
        let [x, y, z] = cross(a, b);
        return normalised([real, x, y, z]);
    }
    // Opposite directions: half a turn about any axis that is perpendicular to both.
    let least =
        if a[0].abs() <= a[1].abs() && a[0].abs() <= a[2].abs() { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let [x, y, z] = cross(a, least);
    normalised([0.0, x, y, z])
}

/// The azimuth of the x axis; `None` if it is within 6° of the vertical.
pub fn heading(q: Quaternion) -> Option<f64> {
    let m = matrix(q);
    (m[0][0].hypot(m[1][0]) > 0.1).then(|| m[1][0].atan2(m[0][0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

    fn close(a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn quarter_turns_by_hand() {
        let roll = from_vector([FRAC_PI_2, 0.0, 0.0]);
        assert!(close(&roll, &[FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0]));
        assert!(close(&apply(&matrix(roll), [0.0, 1.0, 0.0]), &[0.0, 0.0, 1.0]), "left goes up");
        let yaw = from_vector([0.0, 0.0, FRAC_PI_2]);
        // Rolled first, then turned to the left: what was left is up, and stays there.
        let both = product(yaw, roll);
        assert!(close(&apply(&matrix(both), [0.0, 1.0, 0.0]), &[0.0, 0.0, 1.0]));
        assert!(close(&apply(&matrix(both), [1.0, 0.0, 0.0]), &[0.0, 1.0, 0.0]));
        assert_eq!(heading(both).map(|angle| (angle - FRAC_PI_2).abs() < 1e-12), Some(true));
        assert_eq!(heading(from_vector([0.0, FRAC_PI_2, 0.0])), None, "x is down");
    }

    #[test]
    fn the_smallest_rotation_between_directions() {
        assert!(close(&between([0.0, 3.0, 0.0], [0.0, 0.0, 2.0]), &from_vector([FRAC_PI_2, 0.0, 0.0])));
        let around = between([0.0, 0.0, -9.8], [0.0, 0.0, 1.0]);
        assert!(close(&apply(&matrix(around), [0.0, 0.0, -1.0]), &[0.0, 0.0, 1.0]), "half a turn");
        assert!(close(
            &apply(&transposed(&matrix(from_vector([0.0, 0.0, PI]))), [1.0, 0.0, 0.0]),
            &[-1.0, 0.0, 0.0]
        ));
    }
}
