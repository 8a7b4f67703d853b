//! The directions that hearing searches, with their cues.
//!
//! In: the calibrated directions. Out: cells of the sphere of directions: around each calibrated one, and parts of these
//! where more resolution is wanted. Invariant: the cues of a direction between calibrated ones are interpolated along its
//! ring of elevation, and then between rings.

use super::calibration::{CueRow, DirectionCues, between};
use crate::frame::great_circle;

/// Gaps of more degrees of azimuth are not calibrated: nothing is put into them.
const GAP_DEG: f64 = 45.0;
/// Half the size in elevation of the only ring of a calibration, degrees.
const LONE_DEG: f64 = 5.0;
/// Sizes of the parts of a cell, degrees of azimuth and elevation.
const PART_DEG: [f64; 2] = [1.0, 3.4];

/// A direction that is searched, and its cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Searched {
    pub(super) azimuth_deg: f64,
    pub(super) elevation_deg: f64,
    /// The cell: degrees to the right and left of the direction, and below and above it.
    pub(super) edges_deg: [[f64; 2]; 2],
    pub(super) cues: CueRow,
}

impl Searched {
    /// Azimuth and elevation, rad.
    pub(super) fn angles(&self) -> (f64, f64) {
        (self.azimuth_deg.to_radians(), self.elevation_deg.to_radians())
    }

    /// The angle to another direction, degrees.
    pub(super) fn angle_deg(&self, from: (f64, f64)) -> f64 {
        great_circle(self.angles(), from).to_degrees()
    }

    /// Half the mean size of the cell, degrees.
    pub(super) fn size_deg(&self, is_plane: bool) -> f64 {
        let half = |[low, high]: [f64; 2]| 0.5 * (low + high);
        let across = half(self.edges_deg[0]) * self.elevation_deg.to_radians().cos();
        if is_plane { across } else { 0.5 * (across + half(self.edges_deg[1])) }
    }

    /// The pixels of a panorama whose middles are in the cell: rows from below, columns from the left (azimuth 180 degrees).
    pub(super) fn pixels(&self, [rows, columns]: [usize; 2]) -> Vec<(usize, usize)> {
        let [[right, left], [below, above]] = self.edges_deg;
        let row_deg = |row: usize| (row as f64 + 0.5) * 180.0 / rows as f64 - 90.0;
        let column_deg = |column: usize| 180.0 - (column as f64 + 0.5) * 360.0 / columns as f64;
        let is_row =
            |row: &usize| (self.elevation_deg - below..self.elevation_deg + above).contains(&row_deg(*row));
        let is_column = |column: &usize| {
            let away = (column_deg(*column) - self.azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
            (-right..left).contains(&away)
        };
        let inside: Vec<usize> = (0..columns).filter(is_column).collect();
        (0..rows).filter(is_row).flat_map(|row| inside.iter().map(move |column| (row, *column))).collect()
    }

    /// The solid angle of the cell, sr.
    pub(super) fn area(&self) -> f64 {
        let [[right, left], [below, above]] = self.edges_deg;
        let sine = |degrees: f64| degrees.clamp(-90.0, 90.0).to_radians().sin();
        (right + left).to_radians() * (sine(self.elevation_deg + above) - sine(self.elevation_deg - below))
    }
}

/// A ring of calibrated directions of one elevation, in the order of their azimuths.
#[derive(Clone, Debug)]
struct Ring {
    elevation_deg: f64,
    directions: Vec<DirectionCues>,
}

impl Ring {
    /// The cues at an azimuth.
    fn at(&self, azimuth_deg: f64) -> CueRow {
        let count = self.directions.len();
        let after = self.directions.partition_point(|one| one.azimuth_deg <= azimuth_deg);
        let [one, next] = [(after + count - 1) % count, after % count].map(|at| &self.directions[at]);
        let gap = (next.azimuth_deg - one.azimuth_deg).rem_euclid(360.0);
        let share = (azimuth_deg - one.azimuth_deg).rem_euclid(360.0);
        match () {
            () if gap <= 0.0 || count == 1 => one.cues.clone(),
            () if gap <= GAP_DEG => between(&one.cues, &next.cues, share / gap),
            () if share < 0.5 * gap => one.cues.clone(),
            () => next.cues.clone(),
        }
    }
}

/// All calibrated directions.
#[derive(Clone, Debug)]
pub(super) struct Sphere {
    rings: Vec<Ring>,
    /// Whether only the horizontal plane is searched.
    is_plane: bool,
}

impl Sphere {
    /// The rings of a calibration; `is_plane`: of the front half of the horizontal plane only.
    pub(super) fn new(directions: &[DirectionCues], is_plane: bool) -> Sphere {
        let frontal = |one: &&DirectionCues| {
            !is_plane || one.azimuth_deg.abs() <= 90.01 && one.elevation_deg.abs() <= 5.0
        };
        let key = |one: &DirectionCues| (one.elevation_deg * 100.0).round();
        let mut all: Vec<&DirectionCues> = directions.iter().filter(frontal).collect();
        all.sort_by(|one, other| {
            key(one).total_cmp(&key(other)).then(one.azimuth_deg.total_cmp(&other.azimuth_deg))
        });
        let ring = |ring: &[&DirectionCues]| Ring {
            elevation_deg: ring[0].elevation_deg,
            directions: ring.iter().map(|one| (*one).clone()).collect(),
        };
        Sphere { rings: all.chunk_by(|one, other| key(one) == key(other)).map(ring).collect(), is_plane }
    }

    pub(super) fn is_plane(&self) -> bool {
        self.is_plane
    }

    /// A cell around each calibrated direction.
    pub(super) fn cells(&self) -> Vec<Searched> {
        let mut cells = Vec::new();
        for (index, ring) in self.rings.iter().enumerate() {
            let height = |other: Option<&Ring>| {
                other.map(|other| 0.5 * (other.elevation_deg - ring.elevation_deg).abs())
            };
            let below = height(index.checked_sub(1).map(|below| &self.rings[below]));
            let above = height(self.rings.get(index + 1));
            let heights = [below.or(above), above.or(below)].map(|height| height.unwrap_or(LONE_DEG));
            let count = ring.directions.len();
            for (at, one) in ring.directions.iter().enumerate() {
                let gap = |from: usize, to: usize| {
                    (ring.directions[to].azimuth_deg - ring.directions[from].azimuth_deg).rem_euclid(360.0)
                };
                let [right, left] = [gap((at + count - 1) % count, at), gap(at, (at + 1) % count)];
                let smaller = right.min(left);
                // A lone direction is a whole ring; the edge of what is calibrated is as wide as the other side.
                let half = |gap: f64| if gap > GAP_DEG { 0.5 * smaller.min(GAP_DEG) } else { 0.5 * gap };
                let widths = if count == 1 { [180.0; 2] } else { [half(right), half(left)] };
                cells.push(Searched {
                    azimuth_deg: one.azimuth_deg,
                    elevation_deg: one.elevation_deg,
                    edges_deg: [widths, heights],
                    cues: one.cues.clone(),
                });
            }
        }
        cells
    }

    /// Parts of a cell.
    pub(super) fn parts(&self, cell: &Searched) -> Vec<Searched> {
        let [[right, left], [below, above]] = cell.edges_deg;
        let rows =
            if self.is_plane || self.rings.len() == 1 { 1.0 } else { ((below + above) / PART_DEG[1]).ceil() };
        let wide = PART_DEG[0] / cell.elevation_deg.to_radians().cos().max(0.05);
        let columns = ((right + left) / wide).ceil().max(1.0);
        let (width, height) = (0.5 * (right + left) / columns, 0.5 * (below + above) / rows);
        let mut parts = Vec::new();
        for row in 0..rows as usize {
            let elevation_deg = cell.elevation_deg - below + height * (2 * row + 1) as f64;
            let is_inside = elevation_deg.abs() <= 90.0;
            for column in (0..columns as usize).filter(|_| is_inside) {
                let turned = cell.azimuth_deg - right + width * (2 * column + 1) as f64;
                let azimuth_deg = 180.0 - (180.0 - turned).rem_euclid(360.0);
                parts.push(Searched {
                    azimuth_deg,
                    elevation_deg,
                    edges_deg: [[width; 2], [height; 2]],
                    cues: self.at(azimuth_deg, elevation_deg),
                });
            }
        }
        parts
    }

    /// The cues of a direction.
    pub(super) fn at(&self, azimuth_deg: f64, elevation_deg: f64) -> CueRow {
        let above = self.rings.partition_point(|ring| ring.elevation_deg <= elevation_deg);
        let [lower, upper] =
            [above.saturating_sub(1), above.min(self.rings.len() - 1)].map(|at| &self.rings[at]);
        let gap = upper.elevation_deg - lower.elevation_deg;
        if gap <= 0.0 {
            return lower.at(azimuth_deg);
        }
        let share = (elevation_deg - lower.elevation_deg) / gap;
        between(&lower.at(azimuth_deg), &upper.at(azimuth_deg), share)
    }
}
