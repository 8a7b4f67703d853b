//! Reduces a value per cell to a value per direction.
//!
//! In: a slice in the grid's storage order, `[cells_rho][elevation_cells][azimuth_cells]`. Out: an image,
//! `[elevation_cells][azimuth_cells]`, or a slice around the horizon, `[cells_rho][azimuth_cells]`.
//! Invariant: a slice of another length than the grid's is refused; nothing is read out of bounds.

use super::{ReportError, expect_length};
use crate::grid::Grid;

/// Distance in metres of the centre of the first cell whose occupancy is at least 1/2 + `margin`; NaN ("no
/// data") where there is none.
///
/// # Errors
/// [`ReportError::Length`] unless there is one occupancy per cell.
pub fn first_occupied_range(grid: &Grid, occupancy: &[f32], margin: f32) -> Result<Vec<f64>, ReportError> {
    expect_length("occupancy", occupancy.len(), grid.cells())?;
    let mut ranges = vec![f64::NAN; grid.directions()];
    // From the farthest shell inwards, so that the nearest of a direction stays, and shells are read in the order of memory.
    let shells = occupancy.chunks_exact(grid.directions()).zip(grid.edges_m().windows(2));
    for (shell, edges) in shells.rev() {
        let middle = (edges[0] * edges[1]).sqrt();
        for (range, p) in ranges.iter_mut().zip(shell) {
            *range = if *p >= 0.5 + margin { middle } else { *range };
        }
    }
    Ok(ranges)
}

/// The mean value on each line of sight.
///
/// # Errors
/// [`ReportError::Length`] unless there is one value per cell.
pub fn mean(grid: &Grid, values: &[f32]) -> Result<Vec<f64>, ReportError> {
    expect_length("values", values.len(), grid.cells())?;
    let mut means = vec![0.0f64; grid.directions()];
    for shell in values.chunks_exact(grid.directions()) {
        means.iter_mut().zip(shell).for_each(|(sum, value)| *sum += f64::from(*value));
    }
    let count = grid.cells_rho() as f64;
    means.iter_mut().for_each(|mean| *mean /= count);
    Ok(means)
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
