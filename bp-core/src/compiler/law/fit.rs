//! Common parts of the fits: Newton's method, and the derivative of the digamma function.
//!
//! In: a function with its derivative. Out: its root. Invariant: an iterate stays positive, and the number of steps is
//! bounded.

/// The reason why a law cannot be fitted to a sample.
pub type Refusal = &'static str;

pub(super) const TOO_EQUAL: Refusal = "needs values that differ";
pub(super) const NOT_POSITIVE: Refusal = "needs values greater than 0";
pub(super) const NOT_NEGATIVE: Refusal = "needs values that are not negative, and not all 0";
pub(crate) const NO_CONVERGENCE: Refusal = "finds no maximum of the likelihood for these values";

/// Limit of the shape, concentration, or sum of `a` and `b`, which bounds the width of the law from below. The density
/// keeps ten digits there.
pub(crate) const MOST_SHAPE: f64 = 1e6;

/// ln x − ψ(x) for x > 0 and its derivative: ψ(x + 1) = ψ(x) + 1/x, then the asymptotic series (Abramowitz and Stegun
/// 6.3.18), in which nothing cancels where both are large.
pub(super) fn ln_less_digamma(x: f64) -> (f64, f64) {
    let (mut far, mut sum, mut bend) = (x, 0.0, 0.0);
    while far < 20.0 {
        sum += 1.0 / far;
        bend -= 1.0 / (far * far);
        far += 1.0;
    }
    let inverse = 1.0 / far;
    let square = inverse * inverse;
    let tail = square
        * (1.0 / 12.0
            - square * (1.0 / 120.0 - square * (1.0 / 252.0 - square * (1.0 / 240.0 - square / 132.0))));
    let tail_bend = square
        * inverse
        * (1.0 / 6.0
            - square * (1.0 / 30.0 - square * (1.0 / 42.0 - square * (1.0 / 30.0 - square * 5.0 / 66.0))));
    let moved = if far > x { (x / far).ln() } else { 0.0 };
    let slope = if far > x { 1.0 / x - inverse } else { 0.0 };
    (0.5 * inverse + tail + sum + moved, slope + bend - 0.5 * square - tail_bend)
}

/// The positive root of a monotone function, given with its derivative: Newton's steps. Where one would leave the
/// bracketing interval, or there are many, the interval is halved: on a function with a plateau on both sides Newton's
/// steps would oscillate.
pub(super) fn positive_root(start: f64, function: impl Fn(f64) -> (f64, f64)) -> Result<f64, Refusal> {
    let (mut low, mut high, mut x) = (0.0_f64, f64::INFINITY, start);
    for step in 0..400 {
        let (value, slope) = function(x);
        let newton = (x - value / slope).max(0.5 * x).min(2.0 * x);
        if !newton.is_finite() || newton <= 0.0 {
            break;
        }
        if (newton - x).abs() <= 1e-14 * x || high - low <= 1e-14 * x {
            return Ok(newton);
        }
        (low, high) = if newton < x { (low, x) } else { (x, high) };
        let inside = newton > low && newton < high && step < 100;
        x = if inside || low == 0.0 || high == f64::INFINITY { newton } else { low.sqrt() * high.sqrt() };
    }
    // Rounding may make the last steps oscillate.
    let (value, slope) = function(x);
    if (value / slope).abs() <= 1e-9 * x || high - low <= 1e-9 * x { Ok(x) } else { Err(NO_CONVERGENCE) }
}

/// ψ′(x) for x > 0: the recurrence ψ′(x) = ψ′(x + 1) + 1/x², then the asymptotic series (Abramowitz and Stegun 6.4.12).
pub(super) fn trigamma(x: f64) -> f64 {
    let (mut x, mut sum) = (x, 0.0);
    while x < 10.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let inverse = 1.0 / x;
    let square = inverse * inverse;
    let tail = square * (1.0 / 30.0 - square * (1.0 / 42.0 - square * (1.0 / 30.0 - square * (5.0 / 66.0))));
    sum + inverse + 0.5 * square + inverse * square * (1.0 / 6.0 - tail)
}

#[cfg(test)]
mod tests {
    use super::{ln_less_digamma, positive_root, trigamma};

    #[test]
    fn a_root_between_two_plateaus_is_found() {
        // tanh(60 (ln x − 1)): the root is e; pure Newton steps from 20 would oscillate.
        let step = |x: f64| {
            let t = (60.0 * (x.ln() - 1.0)).tanh();
            (t, (60.0 * (1.0 - t * t) / x).max(1e-6))
        };
        let root = positive_root(20.0, step).unwrap();
        assert!((root - std::f64::consts::E).abs() < 1e-12, "{root}");
    }

    #[test]
    fn the_digamma_function_is_near_the_logarithm() {
        // mpmath, 50 digits: log(x) − psi(0, x), 1/x − psi(1, x).
        for (x, value, slope) in [
            (0.001, 9.936678166528282e+2, -9.990016425331959e+5),
            (0.75, 0.7981788073346913, -1.2085463143382733),
            (9.5, 0.053553922203545615, -0.00573413057436219),
            (123.0, 0.004070548799162678, -3.313867378135924e-05),
            (1e5, 5.000008333333333e-06, -5.000016666666666e-11),
            (1e6, 5.000000833333334e-07, -5.000001666666667e-13),
        ] {
            let (found, bend) = ln_less_digamma(x);
            assert!((found / value - 1.0).abs() < 1e-13, "{x}: {found}");
            assert!((bend / slope - 1.0).abs() < 1e-12, "{x}: {bend}");
        }
    }

    #[test]
    fn the_trigamma_function_has_its_known_values() {
        let sixth = std::f64::consts::PI.powi(2) / 6.0;
        // ψ′(1) = π²/6, ψ′(½) = π²/2, ψ′(3) = π²/6 − 1 − ¼ (Abramowitz and Stegun 6.4.4, 6.4.10).
        for (x, value) in [(1.0, sixth), (0.5, 3.0 * sixth), (3.0, sixth - 1.25)] {
            assert!((trigamma(x) - value).abs() < 1e-13, "{x}");
        }
    }
}
