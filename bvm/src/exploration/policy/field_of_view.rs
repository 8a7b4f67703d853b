//! The field of view of a camera on the grid of directions: what a gaze has in view, and sums over it.
//!
//! In: a worth for each direction. Out: for each gaze the sum over its field of view, which is `models/view.bp`'s
//! P(G | Seen = true) up to its normalisation; a test compares the two. The program sums over all pairs of directions;
//! here each row of the field of view is a difference of two cumulative sums. Invariant: a gaze is the centre of a
//! direction; gazes beyond the largest tilt see nothing.

use crate::frame::unit_vector;
use crate::grid::{Direction, Grid};
use crate::world::sensors::DepthCamera;

/// The field of view of each gaze.
#[derive(Clone, Debug)]
pub struct FieldOfView {
    columns: usize,
    /// For each elevation of the camera and each row of the grid: the number of visible columns to either side; none if
    /// the row is not visible.
    reach: Vec<Vec<Option<usize>>>,
    /// The unit vector of each direction.
    rays: Vec<[f32; 3]>,
}

impl FieldOfView {
    /// That of a camera with a tilt of at most `most_tilt` radians.
    pub fn of(camera: &DepthCamera, grid: &Grid, most_tilt: f64) -> Self {
        let elevation = |row: usize| grid.direction_centre(Direction { elevation: row, azimuth: 0 }).1;
        let reach = |tilt: f64, row: usize| {
            let sees = |columns: &usize| {
                camera.sees((*columns as f64 * grid.azimuth_step(), elevation(row)), tilt).is_some()
            };
            let reach = (0..=grid.azimuth_cells() / 2).take_while(sees).last();
            reach.map(|reach| reach.min((grid.azimuth_cells() - 1) / 2))
        };
        let rows = 0..grid.elevation_cells();
        let reach = rows.clone().map(|tilt| match elevation(tilt) {
            tilt if tilt.abs() > most_tilt => vec![None; grid.elevation_cells()],
            tilt => rows.clone().map(|row| reach(tilt, row)).collect(),
        });
        let ray = |direction| {
            let (azimuth, elevation) = grid.direction_centre(direction);
            unit_vector(azimuth, elevation).map(|component| component as f32)
        };
        let rays = grid.all_directions().map(ray).collect();
        Self { columns: grid.azimuth_cells(), reach: reach.collect(), rays }
    }

    /// The number of directions.
    pub fn directions(&self) -> usize {
        self.rays.len()
    }

    /// Whether a direction is in the field of view of a gaze, both as indices of directions.
    pub fn sees(&self, gaze: usize, place: usize) -> bool {
        let gap = (gaze % self.columns).abs_diff(place % self.columns);
        let gap = gap.min(self.columns - gap);
        self.reach[gaze / self.columns][place / self.columns].is_some_and(|reach| gap <= reach)
    }

    /// The sum of a worth over the field of view of each gaze.
    pub fn sums(&self, worth: &[f32]) -> Vec<f32> {
        let columns = self.columns;
        // Cumulative sums over columns, three times around, so that any range of columns is a difference.
        let sums: Vec<Vec<f64>> = worth
            .chunks(columns)
            .map(|line| {
                let mut sums = vec![0.0; 3 * columns + 1];
                for column in 0..3 * columns {
                    sums[column + 1] = sums[column] + f64::from(line[column % columns]);
                }
                sums
            })
            .collect();
        let mut all = Vec::with_capacity(worth.len());
        let mut totals = vec![0.0; columns];
        for reach in &self.reach {
            totals.fill(0.0);
            for (reach, sums) in reach.iter().zip(&sums) {
                let Some(reach) = reach else { continue };
                let (low, high) = (&sums[columns - reach..], &sums[columns + reach + 1..]);
                for ((total, low), high) in totals.iter_mut().zip(low).zip(high) {
                    *total += high - low;
                }
            }
            all.extend(totals.iter().map(|total| *total as f32));
        }
        all
    }

    /// How far each direction is from the heading: less the cosine of the angle, so that the nearest is the least.
    pub fn away(&self, yaw: f64) -> Vec<f32> {
        let [x, y, _] = unit_vector(yaw, 0.0).map(|component| component as f32);
        self.rays.iter().map(|ray| -(x * ray[0] + y * ray[1])).collect()
    }
}

/// For each direction the number of looks since it was last in view.
#[derive(Clone, Debug)]
pub struct Looks {
    since: Vec<f32>,
}

impl Looks {
    /// More looks than any run has: never in view. Its inhibition is 0 in single precision.
    pub const NEVER: f32 = 1e6;

    /// Nothing was ever in view.
    pub fn none(directions: usize) -> Self {
        Self { since: vec![Self::NEVER; directions] }
    }

    /// A look in the direction of a gaze (an index): what it has in view was seen 0 looks ago.
    pub fn look(&mut self, field: &FieldOfView, gaze: usize) {
        for (place, since) in self.since.iter_mut().enumerate() {
            *since = match *since {
                _ if field.sees(gaze, place) => 0.0,
                since if since >= Self::NEVER => since,
                since => since + 1.0,
            };
        }
    }

    /// The numbers.
    pub fn since(&self) -> &[f32] {
        &self.since
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;
    use crate::programs::view;

    fn small() -> (Grid, FieldOfView) {
        let grid = Grid::new(GridConfiguration {
            cells_rho: 2,
            rho_min_m: 1.0,
            rho_max_m: 2.0,
            azimuth_cells: 24,
            elevation_cells: 12,
        })
        .unwrap();
        let field = FieldOfView::of(&DepthCamera::default(), &grid, 1.1);
        (grid, field)
    }

    #[test]
    fn sums_are_the_answer_of_the_program() {
        let (grid, field) = small();
        let count = grid.directions();
        let worth: Vec<f64> = (0..count).map(|at| ((at * 7919) % 101) as f64 / 101.0).collect();
        let pairs = (0..count * count).map(|pair| f64::from(field.sees(pair / count, pair % count)));
        let sees: Vec<f64> = pairs.collect();
        let answer = view::gazes().directions(count).worth(&worth).sees(&sees).ask().unwrap();
        let single: Vec<f32> = worth.iter().map(|worth| *worth as f32).collect();
        let sums = field.sums(&single);
        let total: f64 = sums.iter().map(|sum| f64::from(*sum)).sum();
        for (sum, p) in sums.iter().zip(answer.distribution()) {
            assert!((f64::from(*sum) / total - p).abs() < 1e-8, "{sum} {p}");
        }
        // The same choice, among equals too.
        let heading: Vec<f64> = field.away(0.3).iter().map(|away| f64::from(*away)).collect();
        let look = view::look().directions(count).worth(&worth).sees(&sees).heading(&heading).ask().unwrap();
        let chosen = bp_core::compiler::answer::argmax(&sums, Some(&field.away(0.3)));
        assert_eq!(look.argmax(), chosen.first().copied());
    }

    #[test]
    fn the_field_of_view_is_the_camera_s() {
        let (grid, field) = small();
        let camera = DepthCamera::default();
        let gaze = grid.direction_index(grid.direction_of(0.4, 0.2).unwrap());
        let centre = grid.direction_centre(grid.direction(gaze).unwrap());
        for place in 0..grid.directions() {
            let (azimuth, elevation) = grid.direction_centre(grid.direction(place).unwrap());
            let azimuth = crate::frame::wrap_angle(azimuth - centre.0);
            assert_eq!(field.sees(gaze, place), camera.sees((azimuth, elevation), centre.1).is_some());
        }
    }

    #[test]
    fn looks_are_counted_since_a_direction_was_in_view() {
        let (grid, field) = small();
        let [left, right] = [1.5, -1.5].map(|at| grid.direction_index(grid.direction_of(at, 0.0).unwrap()));
        let mut looks = Looks::none(grid.directions());
        looks.look(&field, left);
        assert_eq!((looks.since()[left], looks.since()[right]), (0.0, Looks::NEVER));
        looks.look(&field, right);
        looks.look(&field, right);
        assert_eq!((looks.since()[left], looks.since()[right]), (2.0, 0.0));
    }
}
