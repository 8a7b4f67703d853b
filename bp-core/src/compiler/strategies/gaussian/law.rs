//! A normal law in factored form: x = m + L w, where the w are independent standard normal noises.
//!
//! In: variables one by one, each linear in earlier ones with noise of its own, and observations. Out: means and
//! covariances. Invariant: no variance is computed as a difference: an observation rotates the noises and removes the
//! one that it determines, so a vague prior with precise sensors (deviations 1e8 and 0.1) loses no digits.
//!
//! A flat variable is a noise f of its own with density 1 everywhere: x = m + L w + G f. An observation of a row with g = G's row
//! and a largest g_p ≠ 0 determines f_p = (z − m − L w − Σ g_q f_q)/g_p, which is substituted everywhere; its density is 1/|g_p|.
//! The law is proper once no flat noise remains.
//!
//! With a the row of L of the variable observed as z, and r = ‖a‖, a Householder reflection H gives a H = ±r e. Then
//! w_e = (z − m) / ±r, x gains (L H)_e w_e, and the other columns of L H remain. ln p(z) = ln N(z; m, r²).

mod measures;

use nalgebra::{DMatrix, DVector};

/// Relative size below which a row is rounding error and its variable counts as determined. A value agrees with a
/// determined variable if it differs by at most this share of the numbers in its mean.
const ROUNDING: f64 = 1e-11;

/// One variable.
#[derive(Clone, PartialEq, Debug, Default)]
struct Row {
    mean: f64,
    /// The largest number that entered the mean.
    scale: f64,
    /// Its row of L; entries beyond the end are zero.
    noises: Vec<f64>,
    /// For each noise, the squared size of the numbers that entered its coefficient; empty where no determined variable
    /// can be observed.
    squares: Vec<f64>,
    /// Its row of G, and for each entry the size of the numbers that it was computed from.
    flat: Vec<f64>,
    flat_sizes: Vec<f64>,
}

impl Row {
    /// Whether its noises are rounding errors of the numbers that they were computed from.
    fn is_determined(&self) -> bool {
        let squares = self.squares.iter().chain(std::iter::repeat(&0.0));
        self.noises.iter().zip(squares).all(|(cell, square)| cell.abs() <= ROUNDING * square.sqrt())
    }
}

/// A normal law over numbered variables.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct NormalLaw {
    rows: Vec<Row>,
    noises: usize,
    flats: usize,
    /// Whether a determined variable may be observed.
    dirac: bool,
}

/// The Householder reflection I − β v vᵀ, which maps a row to ∓r at its largest entry.
struct Reflection {
    vector: Vec<f64>,
    beta: f64,
    pivot: usize,
    /// The value of the reflected row, at the pivot.
    image: f64,
}

impl Reflection {
    /// The reflection of the entries of a row from `from` on; `None` where they are zero.
    fn of(row: &[f64], from: usize) -> Option<Self> {
        let mut vector = row.to_vec();
        vector.iter_mut().take(from).for_each(|cell| *cell = 0.0);
        let pivot = (0..vector.len()).rev().max_by(|a, b| vector[*a].abs().total_cmp(&vector[*b].abs()))?;
        let norm = norm(&vector);
        if norm == 0.0 {
            return None;
        }
        // The largest entry is the pivot, so that nothing cancels: errors stay small relative to each noise.
        let image = -norm.copysign(vector[pivot]);
        let beta = 1.0 / (norm * (norm + vector[pivot].abs()));
        vector[pivot] -= image;
        Some(Self { vector, beta, pivot, image })
    }

    fn apply(&self, row: &mut Row) {
        let dot: f64 = row.noises.iter().zip(&self.vector).map(|(cell, v)| cell * v).sum();
        if dot != 0.0 {
            row.noises.resize(row.noises.len().max(self.vector.len()), 0.0);
            row.noises.iter_mut().zip(&self.vector).for_each(|(cell, v)| *cell -= self.beta * dot * v);
        }
        // Rounding errors are independent: their squares are added.
        let dot: f64 = row.squares.iter().zip(&self.vector).map(|(square, v)| square * v * v).sum();
        if dot != 0.0 {
            row.squares.resize(row.squares.len().max(self.vector.len()), 0.0);
            for (square, v) in row.squares.iter_mut().zip(&self.vector) {
                let turned = self.beta * v * v;
                *square = (*square * (1.0 - 2.0 * turned) + self.beta * turned * dot).max(0.0);
            }
        }
    }
}

fn norm(row: &[f64]) -> f64 {
    row.iter().map(|cell| cell * cell).sum::<f64>().sqrt()
}

/// Adds `factor` times one list to another; entries beyond an end are zero.
fn add(to: &mut Vec<f64>, factor: f64, from: &[f64]) {
    to.resize(to.len().max(from.len()), 0.0);
    to.iter_mut().zip(from).for_each(|(cell, from)| *cell += factor * from);
}

/// Removes an entry and moves the last one into its place.
fn take_out(row: &mut Vec<f64>, place: usize, last: usize) {
    let moved = if row.len() > last { row.pop().unwrap_or(0.0) } else { 0.0 };
    if let Some(cell) = row.get_mut(place) {
        *cell = moved;
    }
}

impl NormalLaw {
    /// A law without variables; `dirac`: whether variables without noise of their own will be observed.
    pub(crate) fn new(dirac: bool) -> Self {
        Self { dirac, ..Self::default() }
    }

    /// The number of variables.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The number of noises.
    pub(crate) fn noises(&self) -> usize {
        self.noises
    }

    /// How many flat noises are not determined.
    pub(crate) fn flats(&self) -> usize {
        self.flats
    }

    /// Mean of a variable.
    pub(crate) fn mean(&self, row: usize) -> f64 {
        self.rows[row].mean
    }

    /// Standard deviation of a variable.
    pub(crate) fn deviation(&self, row: usize) -> f64 {
        norm(&self.rows[row].noises)
    }

    /// All means.
    pub(crate) fn means(&self) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.rows.iter().map(|row| row.mean))
    }

    /// All covariances.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), self.len(), |one, other| {
            let (one, other) = (&self.rows[one].noises, &self.rows[other].noises);
            one.iter().zip(other).map(|(a, b)| a * b).sum()
        })
    }

    /// The same law with all means 0.
    pub(crate) fn centred(mut self) -> Self {
        self.rows.iter_mut().for_each(|row| (row.mean, row.scale) = (0.0, 0.0));
        self
    }

    /// Copies the means of another law over the same variables.
    pub(crate) fn take_means(&mut self, of: &Self) {
        let rows = self.rows.iter_mut().zip(&of.rows);
        rows.for_each(|(row, of)| (row.mean, row.scale) = (of.mean, of.scale));
    }

    /// Puts the mean of a variable elsewhere.
    pub(crate) fn set_mean(&mut self, row: usize, mean: f64) {
        self.rows[row].mean = mean;
    }

    /// Adds a variable: a linear form of earlier ones, plus noise of its own where the deviation is positive; flat
    /// where it is infinite.
    pub(crate) fn extend(&mut self, terms: &[(usize, f64)], constant: f64, deviation: f64) {
        let mut row = Row { mean: constant, scale: constant.abs(), ..Row::default() };
        for (parent, factor) in terms {
            let parent = &self.rows[*parent];
            row.mean += factor * parent.mean;
            row.scale = row.scale.max(factor.abs() * parent.scale);
            add(&mut row.noises, *factor, &parent.noises);
            add(&mut row.squares, factor * factor, &parent.squares);
            add(&mut row.flat, *factor, &parent.flat);
            add(&mut row.flat_sizes, factor.abs(), &parent.flat_sizes);
        }
        self.rows.push(row);
        if deviation == f64::INFINITY {
            let row = self.rows.last_mut().expect("internal: it was added");
            row.flat.resize(self.flats, 0.0);
            row.flat.push(1.0);
            row.flat_sizes.resize(self.flats, 0.0);
            row.flat_sizes.push(1.0);
            self.flats += 1;
        } else if deviation > 0.0 {
            self.add_noise(self.len() - 1, self.noises, deviation);
            self.noises += 1;
        }
    }

    /// Adds a variable equal to one of the noises.
    pub(crate) fn extend_by_noise(&mut self, noise: usize) {
        self.rows.push(Row::default());
        self.add_noise(self.len() - 1, noise, 1.0);
    }

    fn add_noise(&mut self, row: usize, noise: usize, deviation: f64) {
        let row = &mut self.rows[row];
        row.noises.resize(noise, 0.0);
        row.noises.push(deviation);
        if self.dirac {
            row.squares.resize(noise, 0.0);
            row.squares.push(deviation * deviation);
        }
    }

    /// Conditions on the value of a variable; returns ln of its density before.
    ///
    /// A determined variable has no density: a value that agrees changes nothing and returns ln 1; a value that does
    /// not is impossible and returns `None`.
    pub(crate) fn observe(&mut self, observed: usize, value: f64) -> Option<f64> {
        if let Some(ln) = self.observe_flat(observed, value) {
            return Some(ln);
        }
        let row = &self.rows[observed];
        let surprise = value - row.mean;
        let reflection =
            if self.dirac && row.is_determined() { None } else { Reflection::of(&row.noises, 0) };
        let Some(reflection) = reflection else {
            let agrees = surprise.abs() <= ROUNDING * row.scale.max(value.abs());
            return agrees.then_some(0.0);
        };
        self.noises -= 1;
        let (pivot, last) = (reflection.pivot, self.noises);
        let noise = surprise / reflection.image;
        let scale = row.scale.max(value.abs()) / reflection.image.abs();
        for row in &mut self.rows {
            reflection.apply(row);
            let factor = row.noises.get(pivot).copied().unwrap_or(0.0);
            row.mean += factor * noise;
            row.scale = row.scale.max(factor.abs() * scale);
            take_out(&mut row.noises, pivot, last);
            take_out(&mut row.squares, pivot, last);
        }
        // The variable is now known; this drops the rounding errors of the steps above.
        self.rows[observed] = Row { mean: value, scale: value.abs(), ..Row::default() };
        // Multiply by one half before squaring: the square may overflow where half of it does not.
        Some(-0.5 * noise * noise - reflection.image.abs().ln() - 0.5 * std::f64::consts::TAU.ln())
    }

    /// Conditions on the value of a variable with a flat noise; `None` if it has none.
    fn observe_flat(&mut self, observed: usize, value: f64) -> Option<f64> {
        let own = self.rows[observed].clone();
        // Coefficients that are not rounding errors of the numbers that they were computed from.
        let significant = |at: &usize| own.flat[*at].abs() > ROUNDING * own.flat_sizes[*at];
        let pivot = (0..own.flat.len())
            .filter(significant)
            .max_by(|a, b| own.flat[*a].abs().total_cmp(&own.flat[*b].abs()))?;
        let largest = own.flat[pivot];
        self.flats -= 1;
        for row in &mut self.rows {
            let factor = row.flat.get(pivot).copied().unwrap_or(0.0) / largest;
            if factor != 0.0 {
                row.mean += factor * (value - own.mean);
                row.scale = row.scale.max(factor.abs() * own.scale.max(value.abs()));
                add(&mut row.noises, -factor, &own.noises);
                add(&mut row.squares, factor * factor, &own.squares);
                add(&mut row.flat, -factor, &own.flat);
                add(&mut row.flat_sizes, factor.abs(), &own.flat_sizes);
            }
            take_out(&mut row.flat, pivot, self.flats);
            take_out(&mut row.flat_sizes, pivot, self.flats);
        }
        self.rows[observed] = Row { mean: value, scale: value.abs(), ..Row::default() };
        Some(-largest.abs().ln())
    }

    /// The law of some of the variables, in this order; the others are summed out. What is left of a determined variable but
    /// rounding errors is dropped.
    pub(crate) fn select(&self, rows: impl IntoIterator<Item = usize>) -> Self {
        let row = |row: usize| match &self.rows[row] {
            row if self.dirac && row.flat.is_empty() && row.is_determined() => {
                let mean = if row.mean.abs() <= ROUNDING * row.scale { 0.0 } else { row.mean };
                Row { mean, scale: row.scale, ..Row::default() }
            }
            row => row.clone(),
        };
        let rows = rows.into_iter().map(row).collect();
        Self { rows, ..*self }
    }

    /// Upper limit on the rounding error of a mean.
    pub(crate) fn rounding(&self, row: usize) -> f64 {
        ROUNDING * self.rows[row].scale
    }

    /// Removes a variable and moves the last one into its place.
    pub(crate) fn swap_remove(&mut self, row: usize) {
        self.rows.swap_remove(row);
    }

    /// Leaves the first variables, which have the first noises alone.
    pub(crate) fn truncate(&mut self, rows: usize, noises: usize) {
        self.rows.truncate(rows);
        self.noises = noises;
    }

    /// Rotates the noises so that some variables have the first ones only; gives their number.
    pub(crate) fn concentrate(&mut self, mut rows: Vec<usize>) -> usize {
        let mut first = 0;
        while first < self.noises {
            let left = |row: &usize| norm(self.rows[*row].noises.get(first..).unwrap_or(&[]));
            // The largest first, so that errors stay small relative to each noise.
            let Some((place, _)) = (rows.iter().map(left).enumerate().rev())
                .filter(|(_, left)| *left != 0.0)
                .max_by(|one, other| one.1.total_cmp(&other.1))
            else {
                break;
            };
            if !self.pivot(rows.swap_remove(place), first) {
                break;
            }
            first += 1;
        }
        first
    }

    /// Rotates the noises from `first` on so that a variable depends on the first of them only; returns whether it
    /// depends on any.
    fn pivot(&mut self, row: usize, first: usize) -> bool {
        let Some(reflection) = Reflection::of(&self.rows[row].noises, first) else { return false };
        for row in &mut self.rows {
            reflection.apply(row);
            for cells in [&mut row.noises, &mut row.squares] {
                if cells.len() > first {
                    cells.resize(cells.len().max(reflection.pivot + 1), 0.0);
                    cells.swap(first, reflection.pivot);
                }
            }
        }
        self.rows[row].noises.truncate(first);
        self.rows[row].noises.push(reflection.image);
        true
    }

    /// The same law with no more noises than variables.
    pub(crate) fn reduced(mut self) -> Self {
        self.reduce();
        self
    }

    /// Rotates the noises until there are no more than variables.
    pub(crate) fn reduce(&mut self) {
        if self.noises > self.len() {
            let first = self.concentrate((0..self.len()).collect());
            self.keep_noises(first);
        }
    }

    /// Removes all noises except the first ones.
    pub(crate) fn keep_noises(&mut self, first: usize) {
        self.noises = first;
        for row in &mut self.rows {
            row.noises.truncate(first);
            row.squares.truncate(first);
        }
    }

    /// Replaces the standard normal law of the first noises by that of another law's variables.
    pub(crate) fn replace_noises(&mut self, law: &Self) {
        let (first, new) = (law.len(), law.noises);
        for row in &mut self.rows {
            let rest = row.noises.split_off(row.noises.len().min(first));
            let mut noises = vec![0.0; if rest.is_empty() { 0 } else { new }];
            for (factor, noise) in row.noises.iter().zip(&law.rows) {
                row.mean += factor * noise.mean;
                add(&mut noises, *factor, &noise.noises);
            }
            if !rest.is_empty() {
                noises.resize(new, 0.0);
                noises.extend(rest);
            }
            row.noises = noises;
            row.squares.clear();
        }
        self.noises = self.noises - first + new;
    }
}
