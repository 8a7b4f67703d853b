//! What the fits of the laws share: Newton's method, and the derivative of the digamma function.
//!
//! In: a function with its derivative. Out: its root. Invariant: an iterate stays positive, and the number of steps is
//! bounded.

/// Why a law cannot be fitted to a sample.
pub type Refusal = &'static str;

pub(super) const TOO_EQUAL: Refusal = "needs values that differ";
pub(super) const NOT_POSITIVE: Refusal = "needs values greater than 0";
pub(super) const NO_CONVERGENCE: Refusal = "finds no maximum of the likelihood for these values";

/// The positive root of a function, given with its derivative: Newton's steps, halved where they would leave the
/// positive numbers.
pub(super) fn positive_root(start: f64, step: impl Fn(f64) -> (f64, f64)) -> Result<f64, Refusal> {
    let mut x = start;
    for _ in 0..200 {
        let (value, slope) = step(x);
        let next = (x - value / slope).max(0.5 * x).min(2.0 * x);
        if !next.is_finite() || next <= 0.0 {
            break;
        }
        if (next - x).abs() <= 1e-14 * x {
            return Ok(next);
        }
        x = next;
    }
    // Rounding may make the last steps go to and fro.
    let (value, slope) = step(x);
    if (value / slope).abs() <= 1e-9 * x { Ok(x) } else { Err(NO_CONVERGENCE) }
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
    use super::trigamma;

    #[test]
    fn the_trigamma_function_has_its_known_values() {
        let sixth = std::f64::consts::PI.powi(2) / 6.0;
        // ψ′(1) = π²/6, ψ′(½) = π²/2, ψ′(3) = π²/6 − 1 − ¼ (Abramowitz and Stegun 6.4.4, 6.4.10).
        for (x, value) in [(1.0, sixth), (0.5, 3.0 * sixth), (3.0, sixth - 1.25)] {
            assert!((trigamma(x) - value).abs() < 1e-13, "{x}");
        }
    }
}
