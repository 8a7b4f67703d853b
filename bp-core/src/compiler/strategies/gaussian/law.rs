//! A normal law in factored form: x = m + L w, where the w are independent standard normal noises.
//!
//! In: variables one by one, each linear in earlier ones with a noise of its own, and observations. Out: means and
//! covariances. Invariant: no variance is ever the difference of two: noises are rotated, and what an observation
//! determines is dropped, so a vague prior beside precise sensors (1e8 beside 0.1) loses nothing.
//!
//! With a the row of L of what is observed as z, and r = ‖a‖, a Householder reflection H gives a H = ±r e. Then
//! w_e = (z − m) / ±r, x gains (L H)_e w_e, and the other columns of L H are what is left. ln p(z) = ln N(z; m, r²).

mod measures;

use nalgebra::{DMatrix, DVector};

/// A row that is at most this share of the numbers it was computed from is rounding: the variable is determined.
/// A value agrees with a determined variable if it differs by at most this share of the numbers in its mean.
const ROUNDING: f64 = 1e-11;

/// One variable.
#[derive(Clone, PartialEq, Debug, Default)]
struct Row {
    mean: f64,
    /// The largest number that the mean was computed from.
    scale: f64,
    /// Its row of L; beyond the end there are zeros.
    noises: Vec<f64>,
    /// For each noise the squared size of the numbers that its coefficient was computed from: empty where no determined
    /// variable can be observed.
    squares: Vec<f64>,
}

/// A normal law of numbered variables.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct NormalLaw {
    rows: Vec<Row>,
    noises: usize,
    /// Whether a determined variable may be observed.
    dirac: bool,
}

/// I − β v vᵀ, which turns a row into ∓r at its largest place.
struct Reflection {
    vector: Vec<f64>,
    beta: f64,
    pivot: usize,
    /// What is left of the row, at the pivot.
    image: f64,
}

impl Reflection {
    /// For the places of a row from some place on; `None` where they are zero.
    fn of(row: &[f64], from: usize) -> Option<Self> {
        let mut vector = row.to_vec();
        vector.iter_mut().take(from).for_each(|cell| *cell = 0.0);
        let pivot = (0..vector.len()).rev().max_by(|a, b| vector[*a].abs().total_cmp(&vector[*b].abs()))?;
        let norm = norm(&vector);
        if norm == 0.0 {
            return None;
        }
        // The largest noise is the pivot, and nothing cancels there: errors stay small beside each noise.
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
        // Rounding is independent of rounding: squares are added, and their sum stays.
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

/// The sum of two lists, the second times a factor; beyond an end there are zeros.
fn add(to: &mut Vec<f64>, factor: f64, from: &[f64]) {
    to.resize(to.len().max(from.len()), 0.0);
    to.iter_mut().zip(from).for_each(|(cell, from)| *cell += factor * from);
}

/// Takes out a place, which the last one of all fills.
fn take_out(row: &mut Vec<f64>, place: usize, last: usize) {
    let moved = if row.len() > last { row.pop().unwrap_or(0.0) } else { 0.0 };
    if let Some(cell) = row.get_mut(place) {
        *cell = moved;
    }
}

impl NormalLaw {
    /// The law of nothing; whether variables without a noise of their own will be observed.
    pub(crate) fn new(dirac: bool) -> Self {
        Self { dirac, ..Self::default() }
    }

    /// How many variables it has.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// How many noises it has.
    pub(crate) fn noises(&self) -> usize {
        self.noises
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

    /// Takes the means of another law of the same variables.
    pub(crate) fn take_means(&mut self, of: &Self) {
        let rows = self.rows.iter_mut().zip(&of.rows);
        rows.for_each(|(row, of)| (row.mean, row.scale) = (of.mean, of.scale));
    }

    /// Adds a variable: a linear form of earlier ones, and a noise of its own where the deviation is above 0.
    pub(crate) fn extend(&mut self, terms: &[(usize, f64)], constant: f64, deviation: f64) {
        let mut row = Row { mean: constant, scale: constant.abs(), ..Row::default() };
        for (parent, factor) in terms {
            let parent = &self.rows[*parent];
            row.mean += factor * parent.mean;
            row.scale = row.scale.max(factor.abs() * parent.scale);
            add(&mut row.noises, *factor, &parent.noises);
            add(&mut row.squares, factor * factor, &parent.squares);
        }
        self.rows.push(row);
        if deviation > 0.0 {
            self.add_noise(self.len() - 1, self.noises, deviation);
            self.noises += 1;
        }
    }

    /// Adds a variable that is one of the noises.
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

    /// Conditions on the value of a variable; gives ln of the density that it had.
    ///
    /// The value of a determined variable has no density: where it agrees nothing changes and ln 1 is given, where it does
    /// not it is impossible: `None`.
    pub(crate) fn observe(&mut self, observed: usize, value: f64) -> Option<f64> {
        let row = &self.rows[observed];
        let surprise = value - row.mean;
        let squares = row.squares.iter().chain(std::iter::repeat(&0.0));
        let rounding = |(cell, square): (&f64, &f64)| cell.abs() <= ROUNDING * square.sqrt();
        let is_determined = self.dirac && row.noises.iter().zip(squares).all(rounding);
        let reflection = if is_determined { None } else { Reflection::of(&row.noises, 0) };
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
        // It is known now, without the rounding of the above.
        self.rows[observed] =
            Row { mean: value, scale: value.abs(), noises: Vec::new(), squares: Vec::new() };
        // Halved before the second factor: the square may be beyond the range of numbers where the half is not.
        Some(-0.5 * noise * noise - reflection.image.abs().ln() - 0.5 * std::f64::consts::TAU.ln())
    }

    /// Some of the variables, in this order; the others are summed out.
    pub(crate) fn select(&self, rows: impl IntoIterator<Item = usize>) -> Self {
        let rows = rows.into_iter().map(|row| self.rows[row].clone()).collect();
        Self { rows, ..*self }
    }

    /// Takes out a variable, whose place the last one fills.
    pub(crate) fn swap_remove(&mut self, row: usize) {
        self.rows.swap_remove(row);
    }

    /// Rotates the noises so that some variables have the first ones only; gives their number.
    pub(crate) fn concentrate(&mut self, mut rows: Vec<usize>) -> usize {
        let mut first = 0;
        while first < self.noises {
            let left = |row: &usize| norm(self.rows[*row].noises.get(first..).unwrap_or(&[]));
            // The largest first: errors stay small beside each noise.
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

    /// Rotates the noises from `first` on so that a variable has the first of them only; whether it has any.
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

    /// Leaves no more noises than variables.
    pub(crate) fn reduce(&mut self) {
        if self.noises > self.len() {
            let first = self.concentrate((0..self.len()).collect());
            self.keep_noises(first);
        }
    }

    /// Leaves the first noises alone.
    pub(crate) fn keep_noises(&mut self, first: usize) {
        self.noises = first;
        for row in &mut self.rows {
            row.noises.truncate(first);
            row.squares.truncate(first);
        }
    }

    /// Gives the first noises a new law: that of the variables of another.
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
