//! Slice sampling: a draw of a real whose density is known up to a constant.
//!
//! In: the current value, and ln of the density. Out: the next value. Invariant: the density at the current value is
//! positive; the width adapts during burn-in only, so that later draws leave the distribution invariant.
//!
//! y = u f(x₀); the interval around x₀ is stepped out by its width until f < y at both ends, then shrunk towards x₀
//! until a draw from it has f > y (Neal, *Annals of Statistics* 31:705-767, 2003).

use crate::error::Error;
use crate::random::Random;
use rand::RngExt;

/// Upper limit on the stepping-out steps, both ends together.
const MOST_STEPS: u32 = 100;

/// A slice sampler: the width of its interval, which adapts during burn-in.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Slice {
    width: f64,
}

impl Default for Slice {
    fn default() -> Self {
        Self { width: 1.0 }
    }
}

impl Slice {
    /// Draws the next value. The last call of `ln_density` is at the returned value.
    ///
    /// # Errors
    /// Those of `ln_density`.
    pub(super) fn draw(
        &mut self,
        start: f64,
        ln_density: &mut impl FnMut(f64) -> Result<f64, Error>,
        random: &mut Random,
        learns: bool,
    ) -> Result<f64, Error> {
        let level = ln_density(start)? + (1.0 - random.random::<f64>()).ln();
        let mut low = start - self.width * random.random::<f64>();
        let mut high = low + self.width;
        // Neal's limit: the number of downward steps is drawn at random, which keeps the move reversible.
        let down = (random.random::<f64>() * f64::from(MOST_STEPS)) as u32;
        for _ in 0..down {
            if ln_density(low)? <= level {
                break;
            }
            low -= self.width;
        }
        for _ in down + 1..MOST_STEPS {
            if ln_density(high)? <= level {
                break;
            }
            high += self.width;
        }
        if learns {
            self.width = (0.75 * self.width + 0.25 * (high - low)).clamp(f64::MIN_POSITIVE, f64::MAX);
        }
        loop {
            let drawn = low + random.random::<f64>() * (high - low);
            if ln_density(drawn)? > level {
                return Ok(drawn);
            }
            let (from, to) = (low, high);
            if drawn < start {
                low = drawn
            } else {
                high = drawn
            }
            // The interval cannot shrink further.
            if drawn == start || (low, high) == (from, to) {
                ln_density(start)?;
                return Ok(start);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::seeded;

    /// An exponential law whose scale, 1000, is far from the initial width.
    #[test]
    fn draws_have_the_moments_of_the_density() {
        let mut random = seeded(1, "slice");
        let mut ln = |x: f64| Ok(if x > 0.0 { -x / 1000.0 } else { f64::NEG_INFINITY });
        let (mut slice, mut x) = (Slice::default(), 1.0);
        for _ in 0..200 {
            x = slice.draw(x, &mut ln, &mut random, true).unwrap();
        }
        let (mut sum, mut square) = (0.0, 0.0);
        let count = 40_000.0;
        for _ in 0..40_000 {
            x = slice.draw(x, &mut ln, &mut random, false).unwrap();
            sum += x;
            square += x * x;
        }
        // Autocorrelation leaves at least a third of the draws effective: four standard errors of the mean, and of E x²
        // = 2 000 000.
        let error = 4.0 * (3.0f64 / count).sqrt();
        assert!((sum / count / 1e3 - 1.0).abs() < error, "{}", sum / count);
        assert!((square / count / 2e6 - 1.0).abs() < error * 5f64.sqrt(), "{}", square / count);
    }

    #[test]
    fn a_single_point_is_not_left() {
        let mut ln = |x: f64| Ok(if x == 2.0 { 0.0 } else { f64::NEG_INFINITY });
        let mut slice = Slice::default();
        assert_eq!(slice.draw(2.0, &mut ln, &mut seeded(1, "slice"), false).unwrap(), 2.0);
    }
}
