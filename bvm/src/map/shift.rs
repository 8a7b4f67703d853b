//! The index shift: a map in the axes of the head, moved when the head turns (paper, section 2.3).
//!
//! In: how the head turned. Out: where the content of each direction comes from. Invariant: Σ P(O = 1) over the solid angle is kept,
//! and so is a map of equal cells.
//!
//! - About the vertical (yaw), whole columns move, exactly; what is less than a column is carried to the next turn. Turns that
//!   add up to a whole one give the map back bit by bit.
//! - Other rotations have no such shift but on one meridian: directions are rotated and cells resampled. The content of a cell is
//!   the mean of the former cells that it covers, by their solid angles. These are estimated with points in each cell, and balanced:
//!   all that a cell takes adds up to its solid angle, and so does all that it gives. (The plain sum of P(O = 1) over cells can be
//!   kept by no map of probabilities: cells near a pole are smaller than others.)
//! - The paper's own form ([`paper`]) moves rows too: right on the meridian ahead, and what passes a pole is unknown.

use crate::frame::{Spherical, unit_vector};
use crate::grid::Grid;
use crate::vestibular::rotation::{self, Matrix};

/// Points along each side of a cell.
const POINTS: usize = 4;

/// Rounds of balancing, and the largest relative error that ends them.
const ROUNDS: usize = 100;
const BALANCED: f64 = 1e-9;

/// The yaw of an egocentric map: whole columns that were moved, and the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Columns {
    /// The turn of the head that the map has not followed yet, rad; at most half a column.
    rest: f64,
}

impl Columns {
    /// The head turned to the left by an angle: how many columns the content moves to the right.
    pub fn turn(&mut self, grid: &Grid, angle: f64) -> isize {
        let step = grid.azimuth_step();
        let whole = ((self.rest + angle) / step).round();
        self.rest += angle - whole * step;
        whole as isize
    }

    /// What the map lags behind, rad to the left.
    pub fn rest(&self) -> f64 {
        self.rest
    }
}

/// The place of each direction before a turn of whole columns: of index d of the map now, the index of the map before.
pub fn by_columns(grid: &Grid, columns: isize) -> Vec<usize> {
    let count = grid.azimuth_cells() as isize;
    let from = |at: usize| {
        let (row, column) = (at / count as usize, (at % count as usize) as isize);
        row * count as usize + (column + columns).rem_euclid(count) as usize
    };
    (0..grid.directions()).map(from).collect()
}

/// The shift as the paper prints it, with φ_inertial too: whole columns and rows; `None` where a row came from beyond a pole.
pub fn paper(grid: &Grid, columns: isize, rows: isize) -> Vec<Option<usize>> {
    let (height, width) = (grid.elevation_cells() as isize, grid.azimuth_cells());
    let yawed = by_columns(grid, columns);
    let from = |at: usize| {
        let row = (at / width) as isize + rows;
        (0..height).contains(&row).then(|| yawed[row as usize * width + at % width])
    };
    (0..grid.directions()).map(from).collect()
}

/// The former directions from which each direction takes its content, with their shares, which sum to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Resampling {
    /// Where the entries of each direction begin.
    begins: Vec<usize>,
    from: Vec<u32>,
    share: Vec<f64>,
    solid: Vec<f64>,
}

impl Resampling {
    /// Of a rotation: `before` takes a direction in the axes of the head now to the same direction in those before.
    pub fn of(grid: &Grid, before: &Matrix) -> Self {
        let after = rotation::transposed(before);
        let place = |direction: [f64; 3]| {
            let seen = Spherical::from_cartesian(direction);
            let direction = grid.direction_of(seen.azimuth, seen.elevation);
            direction.map(|direction| grid.direction_index(direction) as u32)
        };
        // Points of both: a cell near a pole may lie between the points of the other map.
        let mut shared: Vec<(u32, u32, f64)> = Vec::new();
        for cell in 0..grid.directions() {
            for (direction, weight) in points(grid, cell) {
                let was = place(rotation::apply(before, direction)).map(|was| (cell as u32, was, weight));
                let is = place(rotation::apply(&after, direction)).map(|is| (is, cell as u32, weight));
                shared.extend(was.into_iter().chain(is));
            }
        }
        shared.sort_unstable_by_key(|(now, was, _)| (*now, *was));
        shared.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            if same {
                kept.2 += next.2;
            }
            same
        });
        let begins =
            (0..=grid.directions()).map(|cell| shared.partition_point(|it| it.0 < cell as u32)).collect();
        let (from, share) = shared.into_iter().map(|(_, was, share)| (was, share)).unzip();
        let mut resampling = Self { begins, from, share, solid: solid_angles(grid) };
        resampling.balance();
        resampling
    }

    /// Scales what cells take and give, in turns, until both are their solid angles; then each takes shares that sum to 1.
    fn balance(&mut self) {
        let solid = std::mem::take(&mut self.solid);
        let mut given = vec![0.0; solid.len()];
        for _ in 0..ROUNDS {
            self.each_takes(|at| solid[at]);
            given.iter_mut().for_each(|sum| *sum = 0.0);
            for (from, share) in self.from.iter().zip(&self.share) {
                given[*from as usize] += share;
            }
            let error = given
                .iter()
                .zip(&solid)
                .map(|(given, solid)| (given / solid - 1.0).abs())
                .fold(0.0, f64::max);
            if error < BALANCED {
                break;
            }
            for (from, share) in self.from.iter().zip(&mut self.share) {
                *share *= solid[*from as usize] / given[*from as usize];
            }
        }
        self.each_takes(|_| 1.0);
        self.solid = solid;
    }

    fn each_takes(&mut self, total: impl Fn(usize) -> f64) {
        for at in 0..self.begins.len() - 1 {
            let own = &mut self.share[self.begins[at]..self.begins[at + 1]];
            let scale = total(at) / own.iter().sum::<f64>();
            own.iter_mut().for_each(|share| *share *= scale);
        }
    }

    /// The probabilities of one shell, resampled; what balancing has left of the sum over solid angles, less than 10⁻⁴ of it,
    /// is made up in proportion to p (1 − p), so that they stay probabilities.
    pub fn apply_to_probabilities(&self, before: &[f32], now: &mut [f32]) {
        self.apply(before, now);
        let sum = |values: &[f32], of: fn(f64) -> f64| {
            values.iter().zip(&self.solid).map(|(value, solid)| solid * of(f64::from(*value))).sum::<f64>()
        };
        let (lost, room) = (sum(before, |p| p) - sum(now, |p| p), sum(now, |p| p * (1.0 - p)));
        if room > lost.abs() {
            let share = lost / room;
            now.iter_mut().for_each(|p| *p = (f64::from(*p) * (1.0 + share * (1.0 - f64::from(*p)))) as f32);
        }
    }

    /// The values of one shell, resampled.
    pub fn apply(&self, before: &[f32], now: &mut [f32]) {
        for (at, value) in now.iter_mut().enumerate() {
            let entries = self.begins[at]..self.begins[at + 1];
            let terms = self.from[entries.clone()].iter().zip(&self.share[entries]);
            *value = terms.map(|(from, share)| share * f64::from(before[*from as usize])).sum::<f64>() as f32;
        }
    }
}

/// Points of a direction, and the solid angle that each stands for.
fn points(grid: &Grid, cell: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
    let (row, column) = (cell / grid.azimuth_cells(), cell % grid.azimuth_cells());
    let steps = [grid.elevation_step(), grid.azimuth_step()];
    (0..POINTS * POINTS).map(move |point| {
        let inside = |at: usize| (at as f64 + 0.5) / POINTS as f64;
        let elevation = (row as f64 + inside(point / POINTS)) * steps[0] - std::f64::consts::FRAC_PI_2;
        let azimuth = (column as f64 + inside(point % POINTS)) * steps[1] - std::f64::consts::PI;
        // Equal steps of elevation are not equal solid angles.
        (unit_vector(azimuth, elevation), elevation.cos())
    })
}

/// The solid angle of each direction, in units of the widest.
pub fn solid_angles(grid: &Grid) -> Vec<f64> {
    let step = grid.elevation_step();
    let edge = |row: usize| (row as f64 * step - std::f64::consts::FRAC_PI_2).sin();
    let row = |row: usize| (edge(row + 1) - edge(row)) / step;
    (0..grid.directions()).map(|at| row(at / grid.azimuth_cells())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;

    fn grid(azimuth_cells: usize, elevation_cells: usize) -> Grid {
        let configuration = GridConfiguration {
            cells_rho: 1,
            rho_min_m: 1.0,
            rho_max_m: 2.0,
            azimuth_cells,
            elevation_cells,
        };
        Grid::new(configuration).unwrap()
    }

    #[test]
    fn fractions_of_a_column_are_carried() {
        let grid = grid(36, 18);
        let mut columns = Columns::default();
        // 4° at a time, columns of 10°: 0.4, 0.8, 1.2, 1.6, 2.0 columns.
        let moved: Vec<isize> = (0..5).map(|_| columns.turn(&grid, 4f64.to_radians())).collect();
        assert_eq!(moved, [0, 1, 0, 1, 0]);
        assert!(columns.rest().abs() < 1e-12);
        // To the left by a column: what was in column 5 is in column 4.
        let from = by_columns(&grid, 1);
        assert_eq!((from[4], from[35], from[36 + 35]), (5, 0, 36));
        // A whole turn in 77 parts.
        let mut columns = Columns::default();
        let whole: isize = (0..77).map(|_| columns.turn(&grid, std::f64::consts::TAU / 77.0)).sum();
        assert_eq!((whole, by_columns(&grid, whole)), (36, (0..36 * 18).collect::<Vec<_>>()));
    }

    #[test]
    fn the_form_of_the_paper_loses_what_passes_a_pole() {
        let grid = grid(36, 18);
        let from = paper(&grid, 0, 3);
        assert_eq!((from[0], from[36 * 14], from[36 * 15]), (Some(36 * 3), Some(36 * 17), None));
        assert_eq!(paper(&grid, 2, 0)[0], Some(2));
    }

    /// A map with structure, and its sum over solid angles.
    fn map(grid: &Grid) -> Vec<f32> {
        (0..grid.directions()).map(|at| ((at * 7919) % 1000) as f32 / 1000.0).collect()
    }

    fn mass(values: &[f32], solid: &[f64]) -> f64 {
        values.iter().zip(solid).map(|(value, solid)| f64::from(*value) * solid).sum()
    }

    #[test]
    fn rotations_keep_the_occupied_solid_angle() {
        for (size, about) in [
            (36, [0.0, 0.3, 0.0]),
            (18, [1.1, 0.0, 0.0]),
            (36, [0.4, -0.7, 2.0]),
            (36, [0.0, 3.0, 0.1]),
            (36, [0.001, 0.0, 0.0]),
            (18, [0.3, -0.5, 1.0]),
        ] {
            let grid = grid(2 * size, size);
            let (solid, before) = (solid_angles(&grid), map(&grid));
            let matrix = rotation::matrix(rotation::from_vector(about));
            let resampling = Resampling::of(&grid, &matrix);
            let mut now = vec![0.0; before.len()];
            resampling.apply_to_probabilities(&before, &mut now);
            let [was, is] = [mass(&before, &solid), mass(&now, &solid)];
            assert!((is / was - 1.0).abs() < 1e-6, "{about:?}: {was} {is}");
            assert!(now.iter().all(|p| (0.0..=1.0).contains(p)));
            let mut flat = vec![0.0; before.len()];
            resampling.apply_to_probabilities(&vec![0.5; before.len()], &mut flat);
            assert!(flat.iter().all(|p| (p - 0.5).abs() < 1e-6), "an unknown map stays unknown");
        }
    }

    #[test]
    fn content_goes_where_the_head_sees_it() {
        let grid = grid(72, 36);
        // The head pitches its nose up by 30°: what was ahead is 30° below.
        let matrix = rotation::matrix(rotation::from_vector([0.0, -30f64.to_radians(), 0.0]));
        let resampling = Resampling::of(&grid, &matrix);
        let mut before = vec![0.0; grid.directions()];
        before[grid.direction_index(grid.direction_of(0.04, 0.04).unwrap())] = 1.0;
        let mut now = vec![0.0; grid.directions()];
        resampling.apply(&before, &mut now);
        let place = (0..now.len()).max_by(|a, b| now[*a].total_cmp(&now[*b])).unwrap();
        let (azimuth, elevation) = grid.direction_centre(grid.direction(place).unwrap());
        assert!(azimuth.abs() < 0.1 && (elevation.to_degrees() + 27.5).abs() < 5.1, "{azimuth} {elevation}");
    }
}
