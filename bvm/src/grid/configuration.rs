//! The configuration of the grid, and the errors of an invalid one.
//!
//! In: counts of cells and two distances in metres. Out: the same, or one [`GridError`] that names the key
//! and its value. Invariant: a configuration that passes [`GridConfiguration::check`] makes a grid of at most
//! [`MAX_CELLS`].

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The largest number of cells that a grid may have (half a gibibyte for each `f32` kept per cell).
pub const MAX_CELLS: usize = 1 << 27;

/// The size of a log-spherical grid; azimuth and elevation always cover the whole sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridConfiguration {
    /// Cells along each line of sight, the paper's N.
    pub cells_rho: usize,
    /// Radius of the egocentric gap in metres.
    pub rho_min_m: f64,
    /// Reach in metres.
    pub rho_max_m: f64,
    /// Columns around the head; even, because a walk over a pole comes down half a turn further.
    pub azimuth_cells: usize,
    /// Rows from -90 to 90 degrees.
    pub elevation_cells: usize,
}

impl GridConfiguration {
    /// Personal space as in the follow-up papers: N = 10 from 1.0 to 2.5 m, 1 x 2 degrees, 324 000 cells.
    pub fn personal_space() -> GridConfiguration {
        GridConfiguration {
            cells_rho: 10,
            rho_min_m: 1.0,
            rho_max_m: 2.5,
            azimuth_cells: 360,
            elevation_cells: 90,
        }
    }

    /// A room: N = 16 from 0.5 to 6 m, 4 x 4 degrees, 64 800 cells. The cells grow from 8 cm deep at 0.5 m to
    /// 86 cm at 6 m, as the error of stereo does.
    pub fn default_exploration() -> GridConfiguration {
        GridConfiguration {
            cells_rho: 16,
            rho_min_m: 0.5,
            rho_max_m: 6.0,
            azimuth_cells: 90,
            elevation_cells: 45,
        }
    }

    /// Checks the configuration.
    ///
    /// # Errors
    /// The first key that cannot be used, with its value.
    pub fn check(&self) -> Result<(), GridError> {
        for (key, value) in [("rho_min_m", self.rho_min_m), ("rho_max_m", self.rho_max_m)] {
            if !value.is_finite() {
                return Err(GridError::NotFinite { key, value });
            }
            if value <= 0.0 {
                return Err(GridError::NotPositive { key, value });
            }
        }
        if self.rho_min_m >= self.rho_max_m {
            return Err(GridError::NoReach { rho_min_m: self.rho_min_m, rho_max_m: self.rho_max_m });
        }
        let counts = [
            ("cells_rho", self.cells_rho),
            ("azimuth_cells", self.azimuth_cells),
            ("elevation_cells", self.elevation_cells),
        ];
        if let Some((key, _)) = counts.into_iter().find(|&(_, count)| count == 0) {
            return Err(GridError::NoCells { key });
        }
        if !self.azimuth_cells.is_multiple_of(2) {
            return Err(GridError::OddAzimuth { azimuth_cells: self.azimuth_cells });
        }
        counts
            .into_iter()
            .try_fold(1_usize, |cells, (_, count)| cells.checked_mul(count))
            .filter(|&cells| cells <= MAX_CELLS)
            .map(|_| ())
            .ok_or(GridError::TooManyCells {
                cells_rho: self.cells_rho,
                elevation_cells: self.elevation_cells,
                azimuth_cells: self.azimuth_cells,
            })
    }
}

/// An invalid configuration: each message names the key and its value.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum GridError {
    /// A distance is NaN or infinite.
    #[error("`{key}` = {value}: expected a finite distance in metres")]
    NotFinite {
        /// Name of the configuration key.
        key: &'static str,
        /// The value that was found.
        value: f64,
    },
    /// A distance is zero or less: the logarithm has no such value.
    #[error("`{key}` = {value}: expected a distance greater than 0 m")]
    NotPositive {
        /// Name of the configuration key.
        key: &'static str,
        /// The value that was found.
        value: f64,
    },
    /// The gap is not smaller than the reach.
    #[error("`rho_min_m` = {rho_min_m} is not less than `rho_max_m` = {rho_max_m}: the grid has no reach")]
    NoReach {
        /// Radius of the egocentric gap in metres.
        rho_min_m: f64,
        /// Reach in metres.
        rho_max_m: f64,
    },
    /// A count is zero.
    #[error("`{key}` = 0: expected at least one cell")]
    NoCells {
        /// Name of the configuration key.
        key: &'static str,
    },
    /// The pole rule needs a column exactly half a turn away.
    #[error(
        "`azimuth_cells` = {azimuth_cells}: expected an even number (a walk over a pole turns by half of them)"
    )]
    OddAzimuth {
        /// Columns asked for.
        azimuth_cells: usize,
    },
    /// The map would not fit in memory.
    #[error(
        "`cells_rho` = {cells_rho} x `elevation_cells` = {elevation_cells} x `azimuth_cells` = {azimuth_cells} is \
         more than {MAX_CELLS} cells"
    )]
    TooManyCells {
        /// Cells along a line of sight asked for.
        cells_rho: usize,
        /// Rows asked for.
        elevation_cells: usize,
        /// Columns asked for.
        azimuth_cells: usize,
    },
    /// Neighbouring radial edges coincide in floating point.
    #[error(
        "`cells_rho` = {cells_rho} between `rho_min_m` = {rho_min_m} and `rho_max_m` = {rho_max_m}: the cells are \
         too thin to distinguish"
    )]
    CellsTooThin {
        /// Cells along a line of sight asked for.
        cells_rho: usize,
        /// Radius of the egocentric gap in metres.
        rho_min_m: f64,
        /// Reach in metres.
        rho_max_m: f64,
    },
}
