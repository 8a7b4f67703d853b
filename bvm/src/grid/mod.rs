//! The egocentric log-spherical grid of the Bayesian Volumetric Map.
//!
//! In: a [`GridConfiguration`] (numbers of cells and distances). Out: a checked [`Grid`] that maps points to cells, and
//! cells to intervals, centres and storage indices. Axes and angles are those of [`crate::frame`]: columns run
//! counter-clockwise, from behind over the right-hand side to ahead, then over the left.
//!
//! Equations 1 and 2 (Ferreira, Pinho and Dias, "Active exploration using Bayesian models for multimodal
//! perception", ICIAR 2008), with the base that makes N unit partitions:
//!
//! - `b = (rho_max / rho_min)^(1/N)` and `u = log_b(rho / rho_min)`, `u` in `[0; N]`;
//! - a cell is indexed by its far corner: cell k covers `]k - 1; k]` along every axis, so that its index is
//!   `ceil(u)`, and `u = 0` belongs to cell 1;
//! - azimuth covers `]-180°; 180°]` and wraps; elevation covers `]-90°; 90°]` (with -90° itself in the lowest
//!   row), and its rows stay distinct cells at the poles.
//!
//! The paper counts cells from 1; storage here counts from 0, so that paper index = storage index + 1.
//! Invariant (memory layout): `index = (rho * elevation_cells + elevation) * azimuth_cells + azimuth`.

mod configuration;
#[cfg(test)]
mod tests;

pub use crate::frame::Spherical;
pub use configuration::{GridConfiguration, GridError, MAX_CELLS};

use crate::frame::wrap_angle;
use std::f64::consts::{FRAC_PI_2, PI};

/// A direction of the grid, that is one line of sight: 0-based storage indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Direction {
    /// Row, from 0 (lowest, just above -90 deg) to `elevation_cells - 1`.
    pub elevation: usize,
    /// Column, counter-clockwise: from 0 (just above -180 deg, behind and to the right) to `azimuth_cells - 1` (up to
    /// and with 180 deg, behind and to the left).
    pub azimuth: usize,
}

/// A cell of the grid: 0-based storage indices (the paper's index is one more).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// Shell, from 0 (next to the egocentric gap) to `cells_rho - 1`.
    pub rho: usize,
    /// Row, as in [`Direction::elevation`].
    pub elevation: usize,
    /// Column, as in [`Direction::azimuth`].
    pub azimuth: usize,
}

impl Cell {
    /// The line of sight on which this cell lies.
    pub fn direction(self) -> Direction {
        Direction { elevation: self.elevation, azimuth: self.azimuth }
    }
}

impl Direction {
    /// The cell number `rho` (0-based) of this line of sight.
    pub fn at(self, rho: usize) -> Cell {
        Cell { rho, elevation: self.elevation, azimuth: self.azimuth }
    }
}

/// A checked log-spherical grid: every count is positive, every edge finite and increasing.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    configuration: GridConfiguration,
    base: f64,
    edges_m: Vec<f64>,
}

impl Grid {
    /// Checks `configuration` and computes the radial edges.
    ///
    /// # Errors
    /// [`GridError`] names the first key whose value cannot be used, with the value.
    pub fn new(configuration: GridConfiguration) -> Result<Grid, GridError> {
        configuration.check()?;
        let ratio = configuration.rho_max_m / configuration.rho_min_m;
        let count = configuration.cells_rho as f64;
        let base = ratio.powf(1.0 / count);
        let mut edges_m: Vec<f64> = (0..=configuration.cells_rho)
            .map(|k| configuration.rho_min_m * ratio.powf(k as f64 / count))
            .collect();
        edges_m[configuration.cells_rho] = configuration.rho_max_m;
        if !base.is_finite() || edges_m.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(GridError::CellsTooThin {
                cells_rho: configuration.cells_rho,
                rho_min_m: configuration.rho_min_m,
                rho_max_m: configuration.rho_max_m,
            });
        }
        Ok(Grid { configuration, base, edges_m })
    }

    /// The configuration that this grid was built from.
    pub fn configuration(&self) -> &GridConfiguration {
        &self.configuration
    }

    /// Cells along each line of sight, N.
    pub fn cells_rho(&self) -> usize {
        self.configuration.cells_rho
    }

    /// Columns around the head (even).
    pub fn azimuth_cells(&self) -> usize {
        self.configuration.azimuth_cells
    }

    /// Rows from the lowest to the highest elevation.
    pub fn elevation_cells(&self) -> usize {
        self.configuration.elevation_cells
    }

    /// Number of cells in all: `cells_rho * elevation_cells * azimuth_cells`.
    pub fn cells(&self) -> usize {
        self.cells_rho() * self.directions()
    }

    /// Number of lines of sight: `elevation_cells * azimuth_cells`.
    pub fn directions(&self) -> usize {
        self.elevation_cells() * self.azimuth_cells()
    }

    /// Log-distance base `b`, the ratio of a cell's far edge to its near edge.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// The N + 1 radial edges in metres, from `rho_min_m` to `rho_max_m`: cell `rho` covers
    /// `]edges[rho]; edges[rho + 1]]`.
    pub fn edges_m(&self) -> &[f64] {
        &self.edges_m
    }

    /// Width of a column in radians.
    pub fn azimuth_step(&self) -> f64 {
        2.0 * PI / self.azimuth_cells() as f64
    }

    /// Height of a row in radians.
    pub fn elevation_step(&self) -> f64 {
        PI / self.elevation_cells() as f64
    }

    /// The storage index of a cell: `(rho * elevation_cells + elevation) * azimuth_cells + azimuth`.
    pub fn index(&self, cell: Cell) -> usize {
        cell.rho * self.directions() + self.direction_index(cell.direction())
    }

    /// The cell stored at `index`, the inverse of [`Grid::index`]; `None` past the last cell.
    pub fn cell(&self, index: usize) -> Option<Cell> {
        let direction = self.direction(index % self.directions())?;
        (index < self.cells()).then(|| direction.at(index / self.directions()))
    }

    /// The storage index of a direction in an image of one value per line of sight: `elevation * azimuth_cells +
    /// azimuth`.
    pub fn direction_index(&self, direction: Direction) -> usize {
        direction.elevation * self.azimuth_cells() + direction.azimuth
    }

    /// The direction stored at `index`; `None` past the last.
    pub fn direction(&self, index: usize) -> Option<Direction> {
        let columns = self.azimuth_cells();
        (index < self.directions())
            .then(|| Direction { elevation: index / columns, azimuth: index % columns })
    }

    /// Every direction in storage order.
    pub fn all_directions(&self) -> impl Iterator<Item = Direction> + '_ {
        (0..self.directions()).filter_map(|index| self.direction(index))
    }

    /// The log-distance coordinate `u = log_b(rho / rho_min)`, in cells from the inner edge.
    pub fn log_coordinate(&self, rho_m: f64) -> f64 {
        (rho_m / self.configuration.rho_min_m).ln() / self.base.ln()
    }

    /// The shell (0-based) that holds the distance `rho_m`, or `None` in the egocentric gap and beyond reach.
    pub fn rho_of(&self, rho_m: f64) -> Option<usize> {
        let edges = &self.edges_m;
        if !(rho_m >= edges[0] && rho_m <= edges[self.cells_rho()]) {
            return None;
        }
        Some(edges.partition_point(|&edge| edge < rho_m).saturating_sub(1))
    }

    /// The direction that holds the angles (radians; azimuth wraps); `None` where an angle is not finite or
    /// the elevation is steeper than vertical.
    pub fn direction_of(&self, azimuth: f64, elevation: f64) -> Option<Direction> {
        if !azimuth.is_finite() || !(-FRAC_PI_2..=FRAC_PI_2).contains(&elevation) {
            return None;
        }
        Some(Direction {
            elevation: interval(elevation, self.elevation_cells(), |row| self.elevation_edge(row)),
            azimuth: interval(wrap_angle(azimuth), self.azimuth_cells(), |column| self.azimuth_edge(column)),
        })
    }

    /// The cell that holds a point given in spherical coordinates; `None` outside the grid.
    pub fn cell_of(&self, point: Spherical) -> Option<Cell> {
        let rho = self.rho_of(point.rho_m)?;
        Some(self.direction_of(point.azimuth, point.elevation)?.at(rho))
    }

    /// The cell that holds a point given as `[x, y, z]` in metres (ahead, left, up); `None` outside the
    /// grid.
    pub fn cell_of_point(&self, point: [f64; 3]) -> Option<Cell> {
        self.cell_of(Spherical::from_cartesian(point))
    }

    /// The angles (azimuth, elevation) in radians that bisect a direction: step 3 of the paper's section 3.
    pub fn direction_centre(&self, direction: Direction) -> (f64, f64) {
        (
            (direction.azimuth as f64 + 0.5) * self.azimuth_step() - PI,
            (direction.elevation as f64 + 0.5) * self.elevation_step() - FRAC_PI_2,
        )
    }

    /// The centre of a cell: the middle in log-distance (the geometric mean of its edges) and the two
    /// bisectors.
    pub fn centre(&self, cell: Cell) -> Spherical {
        let (azimuth, elevation) = self.direction_centre(cell.direction());
        let rho_m = (self.edges_m[cell.rho] * self.edges_m[cell.rho + 1]).sqrt();
        Spherical { rho_m, azimuth, elevation }
    }

    /// The far corner `(rho_max, theta_max, phi_max)` by which the paper indexes a cell (equation 2).
    pub fn far_corner(&self, cell: Cell) -> Spherical {
        Spherical {
            rho_m: self.edges_m[cell.rho + 1],
            azimuth: self.azimuth_edge(cell.azimuth + 1),
            elevation: self.elevation_edge(cell.elevation + 1),
        }
    }

    /// The near corner `(rho_min, theta_min, phi_min)` of a cell, which the cell itself does not contain.
    pub fn near_corner(&self, cell: Cell) -> Spherical {
        Spherical {
            rho_m: self.edges_m[cell.rho],
            azimuth: self.azimuth_edge(cell.azimuth),
            elevation: self.elevation_edge(cell.elevation),
        }
    }

    /// The cell displaced by `(rho, azimuth, elevation)` whole cells. Azimuth wraps; a displacement over a pole
    /// continues on the other side (azimuth + 180 deg); `None` in the egocentric gap, beyond reach, or past two poles.
    pub fn neighbour(&self, cell: Cell, rho: isize, azimuth: isize, elevation: isize) -> Option<Cell> {
        let shell = cell.rho.checked_add_signed(rho).filter(|&shell| shell < self.cells_rho())?;
        let (rows, columns) = (self.elevation_cells() as isize, self.azimuth_cells() as isize);
        let row = (cell.elevation as isize).checked_add(elevation)?;
        let (row, turn) = match row {
            _ if row < 0 => (-1 - row, columns / 2),
            _ if row >= rows => (2 * rows - 1 - row, columns / 2),
            _ => (row, 0),
        };
        let column = (cell.azimuth as isize).checked_add(azimuth)?.checked_add(turn)?.rem_euclid(columns);
        (0..rows).contains(&row).then_some(Cell {
            rho: shell,
            elevation: row as usize,
            azimuth: column as usize,
        })
    }

    /// Angle in radians of the lower bound of a column (`azimuth_cells` gives 180 deg exactly).
    fn azimuth_edge(&self, column: usize) -> f64 {
        if column == self.azimuth_cells() { PI } else { column as f64 * self.azimuth_step() - PI }
    }

    /// Angle in radians of the lower bound of a row (`elevation_cells` gives 90 deg exactly).
    fn elevation_edge(&self, row: usize) -> f64 {
        if row == self.elevation_cells() { FRAC_PI_2 } else { row as f64 * self.elevation_step() - FRAC_PI_2 }
    }
}

/// The 0-based number of the interval `]edge(k); edge(k + 1)]` that holds `value`, among `count` equal ones;
/// the guess by division is corrected against the edges themselves, so that rounding never contradicts them.
fn interval(value: f64, count: usize, edge: impl Fn(usize) -> f64) -> usize {
    let step = (edge(count) - edge(0)) / count as f64;
    let guess = ((value - edge(0)) / step).ceil() as usize;
    let mut k = guess.saturating_sub(1).min(count - 1);
    while k > 0 && value <= edge(k) {
        k -= 1;
    }
    while k + 1 < count && value > edge(k + 1) {
        k += 1;
    }
    k
}
