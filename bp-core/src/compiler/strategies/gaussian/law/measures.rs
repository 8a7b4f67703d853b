//! Measures of a normal law: entropy, mutual information, divergence, largest density, draws.
//!
//! In: laws in factored form. Out: numbers in nats, ln of a density, values. Invariant: a determinant is a product of
//! the residuals of each row given the rows before it, never a difference; a law in which a variable is determined, by
//! others or by itself, is singular and has no density.
//!
//! With x = m + L w of n variables and |L| the product of its pivots: H = n/2 ln(2πe) + ln |L|, the largest density is
//! (2π)^(−n/2) / |L|, and D(p ‖ q) = ½ (‖Lq⁻¹ Lp‖² + ‖Lq⁻¹ (mp − mq)‖² − n) + ln |Lq| − ln |Lp| (Kullback 1959).

use super::{NormalLaw, ROUNDING, norm};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Relative size below which the residual of a row given others is rounding error.
const NOTHING: f64 = 1e-13;

/// Tolerance for a value that others determine, as a share of its deviation.
const AGREES: f64 = 1e-9;

/// A law with its noises rotated to triangular form: the first rows of an order depend on the first noises only.
struct Triangular {
    law: NormalLaw,
    /// The rows with a noise that earlier rows do not have.
    pivots: Vec<usize>,
}

impl Triangular {
    fn of(mut law: NormalLaw) -> Self {
        // Noises of a variable that an observation determines are rounding errors.
        for row in &mut law.rows {
            let squares = row.squares.iter();
            let rounding = row.noises.iter_mut().zip(squares);
            let rounding = rounding.filter(|(cell, square)| cell.abs() <= ROUNDING * square.sqrt());
            rounding.for_each(|(cell, _)| *cell = 0.0);
        }
        let whole: Vec<f64> = law.rows.iter().map(|row| norm(&row.noises)).collect();
        let (mut rest, mut pivots): (Vec<usize>, Vec<usize>) = ((0..law.len()).collect(), Vec::new());
        loop {
            let left = |row: usize| norm(law.rows[row].noises.get(pivots.len()..).unwrap_or(&[]));
            // The largest first, so that errors stay small relative to each noise.
            let next = (rest.iter().map(|row| left(*row)).enumerate().rev())
                .filter(|(place, left)| *left > NOTHING * whole[rest[*place]])
                .max_by(|one, other| one.1.total_cmp(&other.1));
            let Some((place, _)) = next else { break };
            let row = rest.swap_remove(place);
            if !law.pivot(row, pivots.len()) {
                break;
            }
            pivots.push(row);
        }
        Self { law, pivots }
    }

    fn is_singular(&self) -> bool {
        self.pivots.len() < self.law.len()
    }

    /// ln |L| of the rows with a noise of their own.
    fn ln_volume(&self) -> f64 {
        let own = |(place, row): (usize, &usize)| self.law.rows[*row].noises[place].abs().ln();
        self.pivots.iter().enumerate().map(own).sum()
    }
}

impl NormalLaw {
    /// ln of the density at some values; −∞ where they contradict a determined variable.
    pub(crate) fn ln_density(&self, values: &[f64]) -> f64 {
        let mut law = self.clone();
        let mut of = |(row, value): (usize, &f64)| law.observe(row, *value).unwrap_or(f64::NEG_INFINITY);
        values.iter().enumerate().map(&mut of).sum()
    }

    /// Whether all of it is determined: it has one value, which has a probability.
    pub(crate) fn is_determined(&self) -> bool {
        self.len() > 0 && Triangular::of(self.clone()).pivots.is_empty()
    }

    /// The entropy, in nats; −∞ of a singular law.
    pub(crate) fn entropy(&self) -> f64 {
        0.5 * self.len() as f64 - self.ln_largest_density()
    }

    /// ln of the density at the mean; ∞ of a singular law.
    pub(crate) fn ln_largest_density(&self) -> f64 {
        let shape = Triangular::of(self.clone());
        match shape.is_singular() {
            true => f64::INFINITY,
            false => -0.5 * self.len() as f64 * TAU.ln() - shape.ln_volume(),
        }
    }

    /// Mutual information between the first variables and the others, in nats; ∞ where one part determines something of
    /// the other.
    pub(crate) fn information(&self, first: usize) -> f64 {
        let of = |rows: std::ops::Range<usize>| {
            let shape = Triangular::of(self.select(rows.clone()));
            let pivots: Vec<usize> = shape.pivots.iter().map(|row| rows.start + row).collect();
            (shape.ln_volume(), pivots)
        };
        let ((one, pivots), (other, others)) = (of(0..first), of(first..self.len()));
        let both = Triangular::of(self.select(pivots.into_iter().chain(others)));
        if both.is_singular() { f64::INFINITY } else { (one + other - both.ln_volume()).max(0.0) }
    }

    /// The divergence from another law of the same variables, in nats; ∞ where that law excludes what this one allows.
    pub(crate) fn divergence(&self, from: &Self) -> f64 {
        let q = Triangular::of(from.clone());
        let p = Triangular::of(self.select(q.pivots.iter().copied()));
        let own = p.ln_volume();
        if p.is_singular() {
            return f64::INFINITY;
        }
        // Lq⁻¹ Lp and Lq⁻¹ (mp − mq), row by row.
        let (mut solved, mut shift): (Vec<Vec<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
        let rest = |row: usize, solved: &[Vec<f64>], shift: &[f64]| {
            let mut left = self.rows[row].noises.clone();
            let mut off = self.rows[row].mean - from.rows[row].mean;
            for ((factor, solved), shift) in q.law.rows[row].noises.iter().zip(solved).zip(shift) {
                super::add(&mut left, -factor, solved);
                off -= factor * shift;
            }
            (left, off)
        };
        for (place, row) in q.pivots.iter().enumerate() {
            let (mut left, off) = rest(*row, &solved, &shift);
            let pivot = q.law.rows[*row].noises[place];
            left.iter_mut().for_each(|cell| *cell /= pivot);
            solved.push(left);
            shift.push(off / pivot);
        }
        // A variable that the others determine under q must satisfy the same equation under p.
        for row in (0..self.len()).filter(|row| !q.pivots.contains(row)) {
            let (left, off) = rest(row, &solved, &shift);
            let deviation = norm(&self.rows[row].noises).max(norm(&from.rows[row].noises));
            let size = self.rows[row].mean.abs().max(from.rows[row].mean.abs());
            if norm(&left) > AGREES * deviation || off.abs() > AGREES * (deviation + size) {
                return f64::INFINITY;
            }
        }
        let squares = solved.iter().map(|row| norm(row).powi(2)).sum::<f64>();
        let squares = squares + shift.iter().map(|cell| cell * cell).sum::<f64>();
        (0.5 * (squares - q.pivots.len() as f64) + q.ln_volume() - own).max(0.0)
    }

    /// Values drawn at random.
    pub(crate) fn draw(&self, by: &mut impl Rng) -> Vec<f64> {
        let noises: Vec<f64> = (0..self.noises).map(|_| StandardNormal.sample(by)).collect();
        let value = |row: &super::Row| {
            row.mean + row.noises.iter().zip(&noises).map(|(factor, noise)| factor * noise).sum::<f64>()
        };
        self.rows.iter().map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::NormalLaw;
    use std::f64::consts::{E, TAU};

    /// X of deviation s and mean m, Y = a X + b + noise of deviation t.
    fn pair([m, s]: [f64; 2], [a, b, t]: [f64; 3]) -> NormalLaw {
        let mut law = NormalLaw::new(false);
        law.extend(&[], m, s);
        law.extend(&[(0, a)], b, t);
        law
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-13 * expected.abs().max(1.0), "{found}, expected {expected}");
    }

    #[test]
    fn closed_forms_of_two_variables() {
        // |Σ| = s² t²; information ½ ln(1 + a² s² / t²).
        let law = pair([1.0, 2.0], [3.0, -1.0, 0.5]);
        near(law.entropy(), (TAU * E).ln() + 1f64.ln());
        near(law.ln_largest_density(), -TAU.ln());
        near(law.information(1), 0.5 * (1.0 + 36.0 / 0.25f64).ln());
        // A vague prior and a precise sensor: deviations 10⁸ and 0.1.
        let vague = pair([0.0, 1e8], [1.0, 0.0, 0.1]);
        near(vague.entropy(), (TAU * E).ln() + 1e7f64.ln());
        near(vague.information(1), 0.5 * (1.0 + 1e18f64).ln());
        // Chain rule: the divergence of X, plus that of Y given X averaged over X.
        let other = pair([0.0, 1.0], [2.0, 0.0, 1.0]);
        let of_x = 0.5 * (4.0 + 1.0 - 1.0) - 2f64.ln();
        // Y − 2X under the first: mean X − 1 is 0, variance 4 + ¼.
        let of_y = 0.5 * (4.25 - 1.0) - 0.5f64.ln();
        near(law.divergence(&other), of_x + of_y);
        near(law.divergence(&law), 0.0);
    }

    #[test]
    fn singular_laws_have_no_density() {
        // Y = 3 X − 1 with certainty.
        let law = pair([1.0, 2.0], [3.0, -1.0, 0.0]);
        assert_eq!((law.entropy(), law.ln_largest_density()), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(law.information(1), f64::INFINITY);
        // Against a law with the same equation for Y, the divergence is that of X; against any other it is infinite.
        near(law.divergence(&pair([0.0, 1.0], [3.0, -1.0, 0.0])), 2.0 - 2f64.ln());
        assert_eq!(law.divergence(&pair([0.0, 1.0], [3.0, -1.5, 0.0])), f64::INFINITY);
        assert_eq!(law.divergence(&pair([0.0, 1.0], [2.0, -1.0, 0.0])), f64::INFINITY);
        assert_eq!(law.divergence(&pair([0.0, 1.0], [3.0, -1.0, 1.0])), f64::INFINITY);
        // A known variable carries no information.
        let known = pair([1.0, 0.0], [3.0, -1.0, 1.0]);
        assert_eq!(known.information(1), 0.0);
    }
}
