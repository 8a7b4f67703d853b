//! Linear equations with normal noise: their integral over the unknowns, and draws of them.
//!
//! In: equations Σ c x = y + noise, each with a deviation. Out: ln ∫ Π N(y; Σ c x, σ) dx, and draws of x in proportion to the
//! integrand. Invariant: equations are only rotated, never squared, so no digits cancel; unknowns are eliminated one by one, each
//! from the equations in which it stands, so a chain of n unknowns takes n small steps.
//!
//! A rotation of the equations of x₁, each divided by its deviation, leaves one with it, r x₁ + Σ r_k x_k = q, and others without
//! it. ∫ exp(−½ (r x₁ + … − q)²) dx₁ = √(2π) / |r|, and x₁ = (q − Σ r_k x_k + noise) / r. Equations without unknowns remain: their
//! values are residuals.

use crate::elimination;
use crate::random::Random;
use rand_distr::{Distribution, StandardNormal};

/// ½ ln 2π.
pub(super) const HALF_LN_TAU: f64 = 0.918_938_533_204_672_8;

/// Share of the largest coefficient of an unknown below which what is left of it is rounding error.
const ROUNDING: f64 = 1e-11;

/// Σ coefficient · unknown = value + noise.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Equation<'t> {
    /// (unknown, coefficient), each unknown once.
    pub(super) terms: &'t [(usize, f64)],
    pub(super) value: f64,
    /// The standard deviation of the noise, > 0.
    pub(super) deviation: f64,
}

/// The order in which unknowns are eliminated from equations of given unknowns.
#[derive(Clone, Debug)]
pub(super) struct Elimination {
    fronts: Vec<Front>,
    unknowns: usize,
    equations: usize,
    /// Whether some unknown has no proper distribution of its own.
    flat: bool,
}

/// The elimination of one unknown.
#[derive(Clone, Debug)]
struct Front {
    /// The unknown, and those that stand beside it.
    unknowns: Vec<usize>,
    /// The equations of which it is the first unknown.
    equations: Vec<usize>,
    /// The earlier fronts whose remaining equations have it as their first unknown.
    earlier: Vec<usize>,
}

/// Equations after elimination: one for each unknown.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangle {
    /// For each front the coefficients of its unknowns, and the value.
    rows: Vec<Vec<f64>>,
    /// ln of the integral over the unknowns.
    pub(super) ln_integral: f64,
}

impl Elimination {
    /// The order for equations in which these unknowns stand; `flat`: whether some unknown stands in no equation of its own.
    pub(super) fn new(unknowns: usize, equations: &[Vec<usize>], flat: bool) -> Self {
        let number = |scope: &Vec<usize>| scope.iter().map(|unknown| *unknown as u32).collect();
        let scopes: Vec<Vec<u32>> = equations.iter().map(number).collect();
        let all: Vec<u32> = (0..unknowns as u32).collect();
        let order = elimination::order(vec![2.0; unknowns], &scopes, &all).variables;
        let mut ranks = vec![0; unknowns];
        order.iter().enumerate().for_each(|(rank, unknown)| ranks[*unknown as usize] = rank);
        let front = |unknown: &u32| Front {
            unknowns: vec![*unknown as usize],
            equations: Vec::new(),
            earlier: Vec::new(),
        };
        let mut fronts: Vec<Front> = order.iter().map(front).collect();
        let first = |scope: &[usize]| scope.iter().map(|unknown| ranks[*unknown]).min();
        for (equation, scope) in equations.iter().enumerate() {
            if let Some(place) = first(scope) {
                fronts[place].equations.push(equation);
                fronts[place].unknowns.extend(scope);
            }
        }
        for place in 0..fronts.len() {
            let front = &mut fronts[place];
            front.unknowns.sort_unstable_by_key(|unknown| ranks[*unknown]);
            front.unknowns.dedup();
            let beside = front.unknowns[1..].to_vec();
            if let Some(next) = first(&beside) {
                fronts[next].earlier.push(place);
                fronts[next].unknowns.extend(beside);
            }
        }
        Self { fronts, unknowns, equations: equations.len(), flat }
    }

    /// Eliminates all unknowns; `None` where the equations do not determine one.
    pub(super) fn triangle(&self, equations: &[Equation<'_>]) -> Option<Triangle> {
        let mut largest = vec![0.0f64; if self.flat { self.unknowns } else { 0 }];
        if self.flat {
            for equation in equations {
                for (unknown, coefficient) in equation.terms {
                    largest[*unknown] = largest[*unknown].max((coefficient / equation.deviation).abs());
                }
            }
        }
        let mut rest: Vec<Vec<f64>> = vec![Vec::new(); self.fronts.len()];
        let mut rows = Vec::with_capacity(self.fronts.len());
        let mut squares = 0.0;
        let mut ln_integral = (self.unknowns as f64 - self.equations as f64) * HALF_LN_TAU;
        for equation in equations {
            ln_integral -= equation.deviation.ln();
            if equation.terms.is_empty() {
                squares += (equation.value / equation.deviation).powi(2);
            }
        }
        for (place, front) in self.fronts.iter().enumerate() {
            let width = front.unknowns.len() + 1;
            let mut cells = Vec::new();
            let column = |unknown: usize| front.unknowns.iter().position(|own| *own == unknown);
            for equation in &front.equations {
                let equation = &equations[*equation];
                let start = cells.len();
                cells.resize(start + width, 0.0);
                let mut stands = false;
                for (unknown, coefficient) in equation.terms {
                    stands = true;
                    cells[start + column(*unknown)?] = coefficient / equation.deviation;
                }
                if stands {
                    cells[start + width - 1] = equation.value / equation.deviation;
                }
            }
            for earlier in &front.earlier {
                let beside = &self.fronts[*earlier].unknowns[1..];
                let columns: Vec<usize> =
                    beside.iter().map(|unknown| column(*unknown)).collect::<Option<_>>()?;
                for row in std::mem::take(&mut rest[*earlier]).chunks_exact(beside.len() + 1) {
                    let start = cells.len();
                    cells.resize(start + width, 0.0);
                    row.iter().zip(&columns).for_each(|(cell, column)| cells[start + column] = *cell);
                    cells[start + width - 1] = row[beside.len()];
                }
            }
            let least = largest.get(front.unknowns[0]).map_or(0.0, |largest| ROUNDING * largest);
            if !reflect(&mut cells, width, 0, 0) || cells[0].abs() <= least {
                return None;
            }
            ln_integral -= cells[0].abs().ln();
            if width == 2 {
                squares += cells[width..].chunks_exact(width).map(|row| row[1] * row[1]).sum::<f64>();
            } else {
                // Without the first column, and no more equations than needed.
                let without = cells[width..].chunks_exact(width).flat_map(|row| row[1..].iter().copied());
                let mut below: Vec<f64> = without.collect();
                squares += condense(&mut below, width - 1);
                rest[place] = below;
            }
            cells.truncate(width);
            rows.push(cells);
        }
        ln_integral -= 0.5 * squares;
        Some(Triangle { rows, ln_integral })
    }

    /// Draws the unknowns.
    pub(super) fn draw(&self, triangle: &Triangle, random: &mut Random) -> Vec<f64> {
        let mut drawn = vec![0.0; self.unknowns];
        for (front, row) in self.fronts.iter().zip(&triangle.rows).rev() {
            let noise: f64 = StandardNormal.sample(random);
            let known = front.unknowns[1..].iter().zip(&row[1..]);
            let known: f64 = known.map(|(unknown, coefficient)| coefficient * drawn[*unknown]).sum();
            drawn[front.unknowns[0]] = (row[front.unknowns.len()] - known + noise) / row[0];
        }
        drawn
    }
}

/// Replaces rows of `width` cells, coefficients and a value, by as few as say the same; returns the sum of squares of what no
/// coefficient explains.
pub(super) fn condense(cells: &mut Vec<f64>, width: usize) -> f64 {
    let rows = cells.len() / width;
    if rows < width {
        return 0.0;
    }
    let mut row = 0;
    for column in 0..width - 1 {
        row += usize::from(reflect(cells, width, column, row));
    }
    let squares = cells[row * width..].chunks_exact(width).map(|row| row[width - 1].powi(2)).sum();
    cells.truncate(row * width);
    squares
}

/// Reflects the rows from `from` on so that of them only the first has an entry in a column (Householder); returns whether it has
/// one. Entries left of the column are zero.
fn reflect(cells: &mut [f64], width: usize, column: usize, from: usize) -> bool {
    let rows = cells.len() / width;
    let (mut norm, mut pivot) = (0.0, from);
    for row in from..rows {
        let cell = cells[row * width + column];
        norm += cell * cell;
        // The largest entry is the pivot, so that precise equations lose nothing to vague ones.
        if cell.abs() > cells[pivot * width + column].abs() {
            pivot = row;
        }
    }
    let norm: f64 = f64::sqrt(norm);
    if norm == 0.0 || from >= rows {
        return false;
    }
    if pivot != from {
        (column..width).for_each(|at| cells.swap(pivot * width + at, from * width + at));
    }
    let first = cells[from * width + column];
    let image = -norm.copysign(first);
    let beta = 1.0 / (norm * (norm + first.abs()));
    cells[from * width + column] = first - image;
    for at in column + 1..width {
        let dot: f64 = (from..rows).map(|row| cells[row * width + column] * cells[row * width + at]).sum();
        if dot != 0.0 {
            let factor = beta * dot;
            (from..rows).for_each(|row| cells[row * width + at] -= factor * cells[row * width + column]);
        }
    }
    cells[from * width + column] = image;
    (from + 1..rows).for_each(|row| cells[row * width + column] = 0.0);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    type Written = (&'static [(usize, f64)], f64, f64);

    fn triangle(unknowns: usize, written: &[Written], flat: bool) -> Option<Triangle> {
        let equation =
            |(terms, value, deviation): &Written| Equation { terms, value: *value, deviation: *deviation };
        let equations: Vec<Equation<'_>> = written.iter().map(equation).collect();
        let support = |(terms, ..): &Written| terms.iter().map(|(unknown, _)| *unknown).collect();
        let supports: Vec<Vec<usize>> = written.iter().map(support).collect();
        Elimination::new(unknowns, &supports, flat).triangle(&equations)
    }

    /// x ~ N(1, 2), y ~ N(x, 3); observed x/2 + y = 2 ± 1/2, y = 1 ± 1, x = 3/10 ± 4. The covariance of the three has the
    /// determinant 534, and the squared Mahalanobis distance is 19549/106800 (exact fractions).
    #[test]
    fn the_integral_is_the_density_of_what_is_observed() {
        let equations: [Written; 5] = [
            (&[(0, 1.0)], 1.0, 2.0),
            (&[(0, -1.0), (1, 1.0)], 0.0, 3.0),
            (&[(0, 0.5), (1, 1.0)], 2.0, 0.5),
            (&[(1, 1.0)], 1.0, 1.0),
            (&[(0, 1.0)], 0.3, 4.0),
        ];
        let found = triangle(2, &equations, false).unwrap().ln_integral;
        let expected = -0.5 * (19549.0 / 106_800.0) - 0.5 * 534f64.ln() - 3.0 * HALF_LN_TAU;
        assert!((found - expected).abs() < 1e-13, "{found}, expected {expected}");
    }

    /// Only the sum of two unknowns is observed.
    #[test]
    fn flat_unknowns_must_be_determined() {
        let sum: Written = (&[(0, 1.0), (1, 1.0)], 2.0, 1.0);
        assert!(triangle(2, &[sum, sum], true).is_none());
        // N(x; 3, 2) integrates to one, and so does N(x + y; 2, 1) over y.
        let both = triangle(2, &[sum, (&[(0, 1.0)], 3.0, 2.0)], true).unwrap();
        assert!(both.ln_integral.abs() < 1e-15, "{}", both.ln_integral);
    }

    /// y = 1, 2, 4, 3 at x = 0, 1, 2, 3: least squares leave the sum of squares 9/5.
    #[test]
    fn condensed_rows_keep_the_sum_of_squares() {
        let mut cells = vec![1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 2.0, 4.0, 1.0, 3.0, 3.0];
        let squares = condense(&mut cells, 3);
        assert!((squares - 1.8).abs() < 1e-14, "{squares}");
        assert_eq!(cells.len(), 6);
        // The coefficients 13/10 and 4/5.
        let slope = cells[5] / cells[4];
        assert!(
            (slope - 0.8).abs() < 1e-14 && ((cells[2] - cells[1] * slope) / cells[0] - 1.3).abs() < 1e-14
        );
    }
}
