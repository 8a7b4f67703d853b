//! Tracks: clusters of cells that are occupied and move.
//!
//! In: the map. Out: for each cluster its position, velocity and their spread. Invariant: probabilities are those of the
//! map; here they are only summed: a cell counts by P(O) (1 − P(V = 0)).

use crate::frame::{Spherical, unit_vector};
use crate::grid::Cell;
use crate::map::{Map, OCCUPIED, VELOCITIES};
use serde::Serialize;

/// A cell belongs to a cluster if it is [`OCCUPIED`], and moves with at least this probability.
const MOVES: f32 = 0.5;
/// Least sum of the weights of a cluster, in cells.
const LEAST: f64 = 2.0;

/// A cluster.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Track {
    /// Its centre `[x, y, z]`, m.
    pub position_m: [f64; 3],
    /// Deviations of its cells about the centre, m.
    pub spread_m: [f64; 3],
    /// Its mean velocity `[x, y, z]`, m/s.
    pub velocity_m_s: [f64; 3],
    /// Deviations of the velocity: of its posterior within the cells, and between them, m/s.
    pub velocity_spread_m_s: [f64; 3],
    /// The number of its cells.
    pub cells: usize,
    /// Σ P(O) (1 − P(V = 0)) over its cells.
    pub weight: f64,
}

impl Track {
    /// A line.
    pub fn text(&self) -> String {
        let place = Spherical::from_cartesian(self.position_m);
        let [x, y, _] = self.velocity_m_s;
        format!(
            "azimuth {:.0}°, {:.1} m; velocity ({x:.2}, {y:.2}) ± ({:.2}, {:.2}) m/s",
            place.azimuth.to_degrees(),
            place.rho_m,
            self.velocity_spread_m_s[0],
            self.velocity_spread_m_s[1]
        )
    }
}

/// The clusters of a map whose step stands for some seconds, the heaviest first.
pub fn tracks(map: &Map, step_s: f64) -> Vec<Track> {
    let (grid, cells) = (map.grid(), map.grid().cells());
    let rest = VELOCITIES.iter().position(|velocity| *velocity == [0; 3]).unwrap_or(0);
    let still = &map.velocity()[rest * cells..][..cells];
    let is_member = |cell: usize| map.occupancy()[cell] >= OCCUPIED && 1.0 - still[cell] >= MOVES;
    let mut free: Vec<bool> = (0..cells).map(is_member).collect();
    let mut found = Vec::new();
    for first in 0..cells {
        if !std::mem::take(&mut free[first]) {
            continue;
        }
        let (mut members, mut next) = (vec![first], 0);
        while let Some(cell) = members.get(next).and_then(|at| grid.cell(*at)) {
            next += 1;
            for neighbour in neighbours(map, cell) {
                if std::mem::take(&mut free[neighbour]) {
                    members.push(neighbour);
                }
            }
        }
        found.extend(track(map, &members, step_s));
    }
    found.sort_by(|one: &Track, other| other.weight.total_cmp(&one.weight));
    found
}

/// The cells within one step along every axis.
fn neighbours(map: &Map, cell: Cell) -> impl Iterator<Item = usize> {
    let grid = map.grid();
    let steps =
        (-1..=1).flat_map(|rho| (-1..=1).flat_map(move |row| (-1..=1).map(move |column| [rho, row, column])));
    steps.filter_map(move |[rho, row, column]| {
        grid.neighbour(cell, rho, column, row).map(|neighbour| grid.index(neighbour))
    })
}

/// The velocity of each displacement in a cell, m/s.
fn velocities(map: &Map, cell: Cell, step_s: f64) -> [[f64; 3]; VELOCITIES.len()] {
    let grid = map.grid();
    let Spherical { rho_m, azimuth, elevation } = grid.centre(cell);
    let ray = unit_vector(azimuth, elevation);
    let up = unit_vector(azimuth, elevation + std::f64::consts::FRAC_PI_2);
    let left = unit_vector(azimuth + std::f64::consts::FRAC_PI_2, 0.0);
    let lengths = [
        rho_m * grid.base().ln(),
        rho_m * grid.elevation_step(),
        rho_m * elevation.cos() * grid.azimuth_step(),
    ];
    VELOCITIES.map(|velocity| {
        let [out, rise, turn] = [0, 1, 2].map(|axis| f64::from(velocity[axis]) * lengths[axis] / step_s);
        [0, 1, 2].map(|axis| out * ray[axis] + rise * up[axis] + turn * left[axis])
    })
}

fn track(map: &Map, members: &[usize], step_s: f64) -> Option<Track> {
    let (grid, cells) = (map.grid(), map.grid().cells());
    let rest = VELOCITIES.iter().position(|velocity| *velocity == [0; 3]).unwrap_or(0);
    let mut sums = Moments::default();
    let mut motion = Moments::default();
    for index in members {
        let cell = grid.cell(*index)?;
        let occupied = f64::from(map.occupancy()[*index]);
        let p = |velocity: usize| f64::from(map.velocity()[velocity * cells + index]);
        sums.add(occupied * (1.0 - p(rest)), grid.centre(cell).to_cartesian());
        for (velocity, vector) in velocities(map, cell, step_s).into_iter().enumerate() {
            motion.add(occupied * p(velocity), vector);
        }
    }
    let (position_m, spread_m) = sums.mean_and_deviation();
    let (velocity_m_s, velocity_spread_m_s) = motion.mean_and_deviation();
    let track = Track {
        position_m,
        spread_m,
        velocity_m_s,
        velocity_spread_m_s,
        cells: members.len(),
        weight: sums.weight,
    };
    (track.weight >= LEAST).then_some(track)
}

/// Weighted sums of vectors and of their squares.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    weight: f64,
    first: [f64; 3],
    second: [f64; 3],
}

impl Moments {
    fn add(&mut self, weight: f64, vector: [f64; 3]) {
        self.weight += weight;
        let sums = self.first.iter_mut().zip(&mut self.second);
        for ((first, second), part) in sums.zip(vector) {
            *first += weight * part;
            *second += weight * part * part;
        }
    }

    fn mean_and_deviation(&self) -> ([f64; 3], [f64; 3]) {
        let mean = self.first.map(|sum| sum / self.weight);
        let deviation = [0, 1, 2].map(|axis| {
            let square: f64 = self.second[axis] / self.weight - mean[axis] * mean[axis];
            square.max(0.0).sqrt()
        });
        (mean, deviation)
    }
}
