//! Angles of many points: the arc tangent without branches or calls, so that loops over pixels become SIMD.
//!
//! In: points. Out: azimuths and elevations. Invariant: within 4·10⁻¹⁶ of the exact angle, relative to it (tested against the
//! standard library, which rounds to the nearest but one).
//!
//! The arc tangent is reduced to [−0.21, 0.66] and approximated by a rational function with the coefficients of S. Moshier's
//! Cephes library.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// π/2 less its nearest f64.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

#[inline(always)]
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    coefficients.into_iter().reduce(|sum, coefficient| sum * x + coefficient).unwrap_or(0.0)
}

/// The angle of the point (x, y), as [`f64::atan2`]; 0 at the origin.
#[inline(always)]
pub(super) fn arc_tangent(y: f64, x: f64) -> f64 {
    let (a, b) = (y.abs(), x.abs());
    let is_steep = a > b;
    let (less, more) = if is_steep { (b, a) } else { (a, b) };
    // tan(u − π/4) = (tan u − 1)/(tan u + 1).
    let is_large = less > 0.66 * more;
    let (over, under) = if is_large { (less - more, less + more) } else { (less, more) };
    let t = if more > 0.0 { over / under } else { 0.0 };
    let square = t * t;
    let above = polynomial(
        square,
        [
            -8.750_608_600_031_904e-1,
            -1.615_753_718_733_365_2e1,
            -7.500_855_792_314_705e1,
            -1.228_866_684_490_136_1e2,
            -6.485_021_904_942_025e1,
        ],
    );
    let below = polynomial(
        square,
        [
            1.0,
            2.485_846_490_142_306_4e1,
            1.650_270_098_316_988_7e2,
            4.328_810_604_912_903e2,
            4.853_903_996_359_137e2,
            1.945_506_571_482_614e2,
        ],
    );
    let angle = t * (square * above / below) + t;
    let angle = if is_large { FRAC_PI_4 + (angle + 0.5 * FRAC_PI_2_REST) } else { angle };
    let angle = if is_steep { FRAC_PI_2 - (angle - FRAC_PI_2_REST) } else { angle };
    let angle = if x.is_sign_negative() { PI - (angle - 2.0 * FRAC_PI_2_REST) } else { angle };
    if more > 0.0 { angle.copysign(y) } else { 0.0 }
}

/// Azimuth and elevation of `[x, y, z]`, as [`super::Spherical::from_cartesian`] gives them, for points whose squares are in
/// the range of f64.
#[inline(always)]
pub fn angles([x, y, z]: [f64; 3]) -> (f64, f64) {
    let ground = (x * x + y * y).sqrt();
    let azimuth = if ground > 0.0 { arc_tangent(y, x) } else { 0.0 };
    (if azimuth > -PI { azimuth } else { PI }, arc_tangent(z, ground))
}

#[cfg(test)]
mod tests {
    use super::super::Spherical;
    use super::*;

    #[test]
    fn the_arc_tangent_is_that_of_the_standard_library() {
        let mut worst = 0.0f64;
        for step in 0..400_000 {
            let angle = (f64::from(step) + 0.37) * std::f64::consts::TAU / 400_000.0 - PI;
            for length in [1e-9, 0.7, 1.0, 3e5] {
                let (y, x) = (length * angle.sin(), length * angle.cos());
                worst = worst.max((arc_tangent(y, x) / y.atan2(x) - 1.0).abs());
            }
        }
        assert!(worst < 4e-16, "{worst:e}");
        for (y, x) in [
            (0.0, 1.0),
            (-0.0, 1.0),
            (0.0, -1.0),
            (-0.0, -1.0),
            (1.0, 0.0),
            (-1.0, 0.0),
            (1.0, 1.0),
            (1.0, -1.0),
            (-2.0, -2.0),
        ] {
            assert_eq!(arc_tangent(y, x), f64::atan2(y, x), "({x}, {y})");
        }
        assert_eq!(arc_tangent(0.0, -0.0), 0.0);
    }

    #[test]
    fn angles_are_those_of_the_frame() {
        for point in [
            [2.0, 0.0, 0.0],
            [0.0, -2.0, 0.5],
            [-1.0, -0.0, 0.0],
            [-0.0, -0.0, -3.0],
            [0.0; 3],
            [1.0, 2.0, -3.0],
        ] {
            let (azimuth, elevation) = angles(point);
            let exact = Spherical::from_cartesian(point);
            assert!((azimuth - exact.azimuth).abs() < 1e-15, "{point:?}");
            assert!((elevation - exact.elevation).abs() < 1e-15, "{point:?}");
        }
    }
}
