//! Tables over two slots that consist of a band and a background.
//!
//! In: a table T(i, j), and a vector w(i). Out: Σ_i w(i) T(i, j), or the maximum, in a time proportional to the cells of
//! the band. Invariant: outside its band, column j has the cells r(i) v(j), bit by bit, where r or v is 1; nothing is
//! subtracted, so a zero is a zero of the table.
//!
//! A transition "stay near, or with probability p go anywhere" is one: Σ_i w(i) T(i, j) is the sum of the band plus
//! v(j) (Σ_{i before the band} w(i) r(i) + Σ_{i after it} w(i) r(i)), with running sums from both ends.

use std::ops::Range;

/// Tables with fewer cells are multiplied as they are.
const FEW: usize = 64 * 64;

/// The largest share of the cells of a table that a band may have.
const MOST_SHARE: f64 = 0.25;

/// A band and a background, for sums and maxima over the rows.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Bands {
    /// r: the background of each row.
    rows: Vec<f64>,
    /// For each column v, the rows of its band, and where its cells begin.
    columns: Vec<(f64, Range<usize>, usize)>,
    cells: Vec<f64>,
}

/// A number type with a sum, a product and an order: numbers, or logarithms of numbers.
pub(super) trait Measure: Copy + PartialOrd {
    const ZERO: Self;
    fn of(number: f64) -> Self;
    fn times(self, other: Self) -> Self;
    fn plus(self, other: Self) -> Self;
}

impl Measure for f64 {
    const ZERO: Self = 0.0;
    fn of(number: f64) -> Self {
        number
    }
    fn times(self, other: Self) -> Self {
        self * other
    }
    fn plus(self, other: Self) -> Self {
        self + other
    }
}

/// The logarithm of a number.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub(super) struct Ln(pub(super) f64);

impl Measure for Ln {
    const ZERO: Self = Self(f64::NEG_INFINITY);
    fn of(number: f64) -> Self {
        Self(number.ln())
    }
    fn times(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
    fn plus(self, other: Self) -> Self {
        let (less, more) = if self.0 < other.0 { (self.0, other.0) } else { (other.0, self.0) };
        if less == f64::NEG_INFINITY { Self(more) } else { Self(more + (less - more).exp().ln_1p()) }
    }
}

impl Bands {
    /// The band of a table of `rows` × `columns` cells, where it is worth it.
    pub(super) fn of(cell: impl Fn(usize, usize) -> f64, rows: usize, columns: usize) -> Option<Self> {
        if rows * columns < FEW {
            return None;
        }
        // The first or the last cell of a row or of a column is outside its band, unless the band is the whole.
        let common = |count: usize, cell: &dyn Fn(usize) -> f64| {
            let (first, last) = (cell(0), cell(count - 1));
            let equal =
                |value: f64| (0..count).filter(|place| cell(*place).to_bits() == value.to_bits()).count();
            if first.to_bits() == last.to_bits() || equal(first) >= equal(last) { first } else { last }
        };
        let one = |count: usize| vec![1.0; count];
        let of_columns: Vec<f64> = (0..columns).map(|j| common(rows, &|i| cell(i, j))).collect();
        let of_rows: Vec<f64> = (0..rows).map(|i| common(columns, &|j| cell(i, j))).collect();
        let backgrounds = [(one(rows), of_columns), (of_rows, one(columns))];
        let most = MOST_SHARE * (rows * columns) as f64;
        let (mut best, mut least): (Option<Self>, f64) = (None, most);
        for (own, background) in backgrounds {
            let band = |j: usize| {
                let is_other = |i: &usize| cell(*i, j).to_bits() != (own[*i] * background[j]).to_bits();
                let first = (0..rows).find(is_other).unwrap_or(0);
                first..(first..rows).rev().find(is_other).map_or(first, |last| last + 1)
            };
            let bands: Vec<Range<usize>> = (0..columns).map(band).collect();
            let count = bands.iter().map(|band| band.len()).sum::<usize>();
            if (count as f64) < least {
                let mut columns = Vec::with_capacity(bands.len());
                let mut cells = Vec::with_capacity(count);
                for (j, band) in bands.into_iter().enumerate() {
                    columns.push((background[j], band.clone(), cells.len()));
                    cells.extend(band.map(|i| cell(i, j)));
                }
                (best, least) = (Some(Self { rows: own, columns, cells }), count as f64);
            }
        }
        best
    }

    /// Σ_i w(i) T(i, j) for each j.
    pub(super) fn sums<T: Measure>(&self, weights: &[T], out: &mut Vec<T>) {
        let parts = weights.iter().zip(&self.rows).map(|(weight, row)| weight.times(T::of(*row)));
        let mut before = vec![T::ZERO];
        parts.for_each(|part| before.push(before[before.len() - 1].plus(part)));
        let mut after = vec![T::ZERO; weights.len() + 1];
        for (i, row) in self.rows.iter().enumerate().rev() {
            after[i] = after[i + 1].plus(weights[i].times(T::of(*row)));
        }
        out.extend(self.columns.iter().map(|(value, band, start)| {
            let rest = before[band.start].plus(after[band.end]).times(T::of(*value));
            let cells = weights[band.clone()].iter().zip(&self.cells[*start..]);
            cells.fold(rest, |sum, (weight, cell)| sum.plus(weight.times(T::of(*cell))))
        }));
    }

    /// max_i w(i) T(i, j) for each j, and the first i that attains it.
    pub(super) fn largest<T: Measure>(&self, weights: &[T], out: &mut Vec<T>, choice: &mut Vec<u32>) {
        let part = |i: usize| (weights[i].times(T::of(self.rows[i])), i);
        let larger = |one: (T, usize), other: (T, usize)| if other.0 > one.0 { other } else { one };
        let nothing = (T::ZERO, 0);
        let mut before = vec![nothing];
        (0..weights.len()).for_each(|i| before.push(larger(before[before.len() - 1], part(i))));
        let mut after = vec![nothing; weights.len() + 1];
        for i in (0..weights.len()).rev() {
            let own = part(i);
            after[i] = if after[i + 1].0 > own.0 { after[i + 1] } else { own };
        }
        for (value, band, start) in &self.columns {
            let scaled = |(number, i): (T, usize)| (number.times(T::of(*value)), i);
            let cells = self.cells[*start..].iter().zip(band.clone());
            let inside = cells.fold(scaled(before[band.start]), |best, (cell, i)| {
                larger(best, (weights[i].times(T::of(*cell)), i))
            });
            let (number, i) = larger(inside, scaled(after[band.end]));
            out.push(number);
            choice.push(i as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::seeded;
    use rand::RngExt;

    /// "Near, or anywhere": against the sums over all cells.
    #[test]
    fn a_band_and_a_background_give_the_sums_and_maxima_of_the_table() {
        let (rows, columns) = (90, 80);
        let near = |i: usize, j: usize| if i.abs_diff(j) <= 2 { 0.3 + 0.01 * j as f64 } else { 0.0 };
        let jumps = |i: usize| 0.01 + 0.001 * i as f64;
        let tables: [&dyn Fn(usize, usize) -> f64; 4] =
            [&|i, j| near(i, j), &|i, j| near(i, j) + 0.02, &|i, j| near(i, j) + jumps(i), &|i, j| {
                if i.abs_diff(j) <= 1 { 0.0 } else { jumps(j) }
            }];
        let mut random = seeded(5, "bands");
        let weights: Vec<f64> = (0..rows).map(|_| random.random()).collect();
        for table in tables {
            let bands = Bands::of(table, rows, columns).expect("a band");
            let (mut sums, mut logarithms) = (Vec::new(), Vec::new());
            let (mut most, mut choice) = (Vec::new(), Vec::new());
            bands.sums(&weights, &mut sums);
            bands.sums(&weights.iter().map(|one| Ln(one.ln())).collect::<Vec<_>>(), &mut logarithms);
            bands.largest(&weights, &mut most, &mut choice);
            for j in 0..columns {
                let terms: Vec<f64> = (0..rows).map(|i| weights[i] * table(i, j)).collect();
                let (sum, largest) = (terms.iter().sum::<f64>(), terms.iter().copied().fold(0.0, f64::max));
                assert!((sums[j] / sum - 1.0).abs() < 1e-13);
                assert!((logarithms[j].0 - sum.ln()).abs() < 1e-12);
                assert!((most[j] / largest - 1.0).abs() < 1e-15);
                assert!((terms[choice[j] as usize] / largest - 1.0).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_table_without_a_band_has_none() {
        assert!(Bands::of(|i, j| 1.0 / (1.0 + (i * 97 + j * 31) as f64), 70, 70).is_none());
        assert!(Bands::of(|_, _| 0.0, 3, 3).is_none());
    }
}
