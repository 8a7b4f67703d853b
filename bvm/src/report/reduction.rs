//! Reduces a value per cell to a value per direction.
//!
//! In: a slice in the grid's storage order, `[cells_rho][elevation_cells][azimuth_cells]`. Out: an image,
//! `[elevation_cells][azimuth_cells]`, or a slice around the horizon, `[cells_rho][azimuth_cells]`.
//! Invariant: a slice of another length than the grid's is refused; nothing is read out of bounds.

use super::{ReportError, expect_length};
use crate::grid::Grid;

/// Folds every line of sight, from the head outwards, into one number.
fn along_rays(
    grid: &Grid,
    what: &str,
    cells: &[f32],
    fold: impl Fn(&mut dyn Iterator<Item = f32>) -> f64,
) -> Result<Vec<f64>, ReportError> {
    expect_length(what, cells.len(), grid.cells())?;
    let rays = grid.directions();
    Ok((0..rays).map(|ray| fold(&mut cells[ray..].iter().step_by(rays).copied())).collect())
}

/// Distance in metres of the centre of the first cell whose occupancy is at least 1/2 + `margin`; NaN ("no
/// data") where there is none.
///
/// # Errors
/// [`ReportError::Length`] unless there is one occupancy per cell.
pub fn first_occupied_range(grid: &Grid, occupancy: &[f32], margin: f32) -> Result<Vec<f64>, ReportError> {
    let edges = grid.edges_m();
    along_rays(grid, "occupancy", occupancy, |ray| {
        let hit = ray.enumerate().find(|(_, p)| *p >= 0.5 + margin);
        hit.map_or(f64::NAN, |(rho, _)| (edges[rho] * edges[rho + 1]).sqrt())
    })
}

/// The mean value on each line of sight.
///
/// # Errors
/// [`ReportError::Length`] unless there is one value per cell.
pub fn mean(grid: &Grid, values: &[f32]) -> Result<Vec<f64>, ReportError> {
    let count = grid.cells_rho() as f64;
    along_rays(grid, "values", values, |ray| ray.map(f64::from).sum::<f64>() / count)
}

/// The occupancy to show for several cells in one place: the largest if it is above 0.6, else the mean.
pub fn strongest(occupancies: impl IntoIterator<Item = f64>) -> f64 {
    let (mut largest, mut sum, mut count) = (f64::NEG_INFINITY, 0.0, 0.0);
    for occupancy in occupancies {
        largest = largest.max(occupancy);
        sum += occupancy;
        count += 1.0;
    }
    if largest > 0.6 { largest } else { sum / count }
}

/// The map seen from above: the [`strongest`] occupancy among the rows whose centres lie within `band`
/// radians of the horizon (at least the row that holds the horizon). Shape: `[cells_rho][azimuth_cells]`.
///
/// # Errors
/// [`ReportError::Length`] unless there is one occupancy per cell.
pub fn slice_around_horizon(grid: &Grid, occupancy: &[f32], band: f64) -> Result<Vec<f64>, ReportError> {
    expect_length("occupancy", occupancy.len(), grid.cells())?;
    let (rows, columns) = (grid.elevation_cells(), grid.azimuth_cells());
    let elevation = |row: usize| (row as f64 + 0.5) * grid.elevation_step() - std::f64::consts::FRAC_PI_2;
    let band = band.max(0.51 * grid.elevation_step());
    let near: Vec<usize> = (0..rows).filter(|&row| elevation(row).abs() <= band).collect();
    Ok((0..grid.cells_rho() * columns)
        .map(|place| {
            let (rho, column) = (place / columns, place % columns);
            strongest(near.iter().map(|row| f64::from(occupancy[(rho * rows + row) * columns + column])))
        })
        .collect())
}
