//! What a posterior over places says: sources and regions.
//!
//! In: cells of directions, and a probability for each cell and distance. Out: the sources, most probable first, and the
//! region that holds 90 %. Invariant: these are sums of the posterior's probabilities, nothing else.

use super::directions::Searched;
use crate::frame::{Spherical, unit_vector};
use serde::Serialize;

/// A source is found within this angle, degrees.
const NEAR_DEG: f64 = 10.0;
/// Two sources are at least this far apart, degrees.
const APART_DEG: f64 = 20.0;
/// Least probability of a further source, and most sources.
const LEAST: f64 = 0.05;
const MOST_SOURCES: usize = 5;
/// Most boxes of a region.
pub(super) const MOST_BOXES: usize = 200;

/// A box of the region of the posterior.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RegionBox {
    /// From and to, degrees.
    pub azimuth_deg: [f64; 2],
    /// From and to, degrees.
    pub elevation_deg: [f64; 2],
    /// From and to, m.
    pub distance_m: [f64; 2],
}

/// A source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// Azimuth, degrees, positive to the left.
    pub azimuth_deg: f64,
    /// Elevation, degrees, positive upwards.
    pub elevation_deg: f64,
    /// The most probable distance, m.
    pub distance_m: f64,
    /// Probability that a source is within 10 degrees of this direction.
    pub probability: f64,
    /// Probability of the other side, front or back, of the plane through the ears.
    pub front_back_mass: f64,
    /// The most probable directions that have 90 % together, with their distances.
    pub region90: Vec<RegionBox>,
}

/// The sources of a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Found {
    /// Whether there is no direction: no source, or one whose direction does not fit into boxes.
    pub flat: bool,
    /// The probability of a source.
    pub sounding: f64,
    /// The sources, most probable first.
    pub sources: Vec<Source>,
}

impl Found {
    /// No source.
    pub fn flat() -> Found {
        Found { flat: true, sounding: 0.0, sources: Vec::new() }
    }
}

/// The probability of each direction and distance: `places[direction][distance]`.
pub(super) struct Posterior<'a> {
    pub(super) cells: &'a [Searched],
    pub(super) distances_m: &'a [f64],
    pub(super) places: &'a [f64],
}

impl Posterior<'_> {
    /// The probability of each direction.
    pub(super) fn of_directions(&self) -> Vec<f64> {
        self.places.chunks_exact(self.distances_m.len()).map(|places| places.iter().sum()).collect()
    }

    /// The sources.
    pub(super) fn sources(&self) -> Found {
        let of_direction = self.of_directions();
        let mut free: Vec<bool> = vec![true; of_direction.len()];
        let sounding = of_direction.iter().sum::<f64>().min(1.0);
        if sounding < 0.5 {
            return Found { sounding, ..Found::flat() };
        }
        let region = self.region(&of_direction);
        // A cell that is small holds little: what counts is the density.
        let density: Vec<f64> =
            of_direction.iter().zip(self.cells).map(|(p, cell)| p / cell.area().max(1e-9)).collect();
        let mut found = Found { flat: region.is_empty(), sounding, sources: Vec::new() };
        while found.sources.len() < MOST_SOURCES {
            let likelier = |best: Option<usize>, at: usize| match best {
                Some(best) if density[best] >= density[at] => Some(best),
                _ => Some(at),
            };
            let Some(best) = (0..free.len()).filter(|at| free[*at]).fold(None, likelier) else { break };
            let source = self.source(best, &of_direction, &region);
            let centre = (source.azimuth_deg.to_radians(), source.elevation_deg.to_radians());
            for (free, one) in free.iter_mut().zip(self.cells) {
                *free &= one.angle_deg(centre) > APART_DEG;
            }
            free[best] = false;
            if source.probability >= LEAST || found.sources.is_empty() {
                found.sources.push(source);
            }
        }
        found.sources.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        found
    }

    /// The source around a direction.
    fn source(&self, best: usize, of_direction: &[f64], region: &[RegionBox]) -> Source {
        let distances = self.distances_m.len();
        let near = |centre: (f64, f64)| {
            let is_near = move |at: &usize| self.cells[*at].angle_deg(centre) <= NEAR_DEG;
            (0..self.cells.len()).filter(is_near)
        };
        let [mut x, mut y, mut z] = [0.0; 3];
        for at in near(self.cells[best].angles()) {
            let (azimuth, elevation) = self.cells[at].angles();
            let [dx, dy, dz] = unit_vector(azimuth, elevation).map(|part| part * of_direction[at]);
            (x, y, z) = (x + dx, y + dy, z + dz);
        }
        let mean = Spherical::from_cartesian([x, y, z]);
        let centre = (mean.azimuth, mean.elevation);
        let mut by_distance = vec![0.0; distances];
        for at in near(centre) {
            for (sum, value) in by_distance.iter_mut().zip(&self.places[at * distances..]) {
                *sum += value;
            }
        }
        let likeliest =
            (0..distances).fold(0, |best, at| if by_distance[at] > by_distance[best] { at } else { best });
        let ahead = centre.0.cos() * centre.1.cos();
        let across = |at: &usize| {
            let (azimuth, elevation) = self.cells[*at].angles();
            azimuth.cos() * elevation.cos() * ahead < -1e-9
        };
        Source {
            azimuth_deg: mean.azimuth.to_degrees(),
            elevation_deg: mean.elevation.to_degrees(),
            distance_m: self.distances_m[likeliest],
            probability: by_distance.iter().sum::<f64>().min(1.0),
            front_back_mass: (0..of_direction.len())
                .filter(across)
                .fold(0.0, |sum, at| sum + of_direction[at])
                .min(1.0),
            region90: region.to_vec(),
        }
    }

    /// The densest cells that have 90 % together; empty if they are too many to say anything.
    pub(super) fn region(&self, of_direction: &[f64]) -> Vec<RegionBox> {
        let density = |at: usize| of_direction[at] / self.cells[at].area().max(1e-9);
        let mut order: Vec<usize> = (0..of_direction.len()).collect();
        order.sort_by(|one, other| density(*other).total_cmp(&density(*one)));
        let (mut boxes, mut sum) = (Vec::new(), 0.0);
        let enough = 0.9 * of_direction.iter().sum::<f64>();
        for at in order {
            if boxes.len() == MOST_BOXES {
                return Vec::new();
            }
            let one = &self.cells[at];
            let [[right, left], [below, above]] = one.edges_deg;
            boxes.push(RegionBox {
                azimuth_deg: [one.azimuth_deg - right, one.azimuth_deg + left],
                elevation_deg: [one.elevation_deg - below, one.elevation_deg + above]
                    .map(|edge| edge.clamp(-90.0, 90.0)),
                distance_m: self
                    .distances(&self.places[at * self.distances_m.len()..][..self.distances_m.len()]),
            });
            sum += of_direction[at];
            if sum >= enough {
                break;
            }
        }
        boxes
    }

    /// The range of distances that holds 90 %: the most probable ones, and those between them.
    fn distances(&self, places: &[f64]) -> [f64; 2] {
        let total: f64 = places.iter().sum();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|one, other| places[*other].total_cmp(&places[*one]));
        let (mut sum, mut low, mut high) = (0.0, order[0], order[0]);
        for at in order {
            (low, high) = (low.min(at), high.max(at));
            sum += places[at];
            if sum >= 0.9 * total {
                break;
            }
        }
        // Edges lie in the middle, by ratio.
        let distance = |at: usize| self.distances_m[at];
        let last = self.distances_m.len() - 1;
        let first_edge = if low == 0 { distance(0) } else { (distance(low - 1) * distance(low)).sqrt() };
        let last_edge =
            if high == last { distance(last) } else { (distance(high) * distance(high + 1)).sqrt() };
        [first_edge, last_edge]
    }
}
