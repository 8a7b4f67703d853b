//! The cues that are expected of places.
//!
//! In: cells of directions, the law of distance, and how the head was turned while each group of cues was heard. Out: time
//! differences, level differences and slopes of each place, for the bands of all groups. Invariant: a direction is that
//! in the frame of the map; its cues are those of the direction in the axes of the head.

use super::calibration::DistanceLaw;
use super::cochlea::BANDS;
use super::directions::{Searched, Sphere};
use super::head::lateral_sine;
use super::turns::Turn;
use crate::frame::{Spherical, unit_vector};
use crate::vestibular::rotation;

/// The expected cues of places: of each direction at each distance, in ms and dB.
#[derive(Clone, Debug, Default)]
pub(super) struct Expected {
    pub(super) tau: Vec<f64>,
    pub(super) l: Vec<f64>,
    pub(super) slope: Vec<f64>,
    /// The solid angle of the cell.
    pub(super) area: Vec<f64>,
    /// Half the usual size of a cell, degrees. It is one number: a deviation for each cell would be counted once for each
    /// band, and make a source in a larger cell improbable.
    pub(super) size_deg: f64,
}

impl Expected {
    /// With the head in the axes of the map.
    pub(super) fn of(cells: &[Searched], law: &DistanceLaw, distances_m: &[f64], is_plane: bool) -> Expected {
        let mut all = Expected::sized(cells, is_plane);
        for one in cells {
            for distance in distances_m {
                all.push(&one.cues, one.angles(), law, *distance);
                all.area.push(weight(one, is_plane));
            }
        }
        all
    }

    /// With a head that was turned: the cues of each turn, one after the other.
    pub(super) fn turned(
        cells: &[Searched],
        law: &DistanceLaw,
        is_plane: bool,
        turns: &[Turn],
        sphere: &Sphere,
    ) -> Expected {
        let mut all = Expected::sized(cells, is_plane);
        let spread = turns.iter().map(|turn| turn.spread_deg).fold(0.0, f64::max);
        all.size_deg = all.size_deg.hypot(spread);
        for one in cells {
            let (azimuth, elevation) = one.angles();
            let ray = unit_vector(azimuth, elevation);
            let heard: Vec<_> = (turns.iter())
                .map(|turn| {
                    let to_head = rotation::transposed(&turn.to_map());
                    let of_head = Spherical::from_cartesian(rotation::apply(&to_head, ray));
                    let cues = sphere.at(of_head.azimuth.to_degrees(), of_head.elevation.to_degrees());
                    (cues, (of_head.azimuth, of_head.elevation))
                })
                .collect();
            for distance in &law.distances_m {
                for (cues, angles) in &heard {
                    all.push(cues, *angles, law, *distance);
                }
                all.area.push(weight(one, is_plane));
            }
        }
        all
    }

    /// The same for one band.
    pub(super) fn band(&self, band: usize) -> Expected {
        let of = |all: &[f64]| all.iter().skip(band).step_by(BANDS).copied().collect();
        let [tau, l, slope] = [&self.tau, &self.l, &self.slope].map(|all| of(all));
        Expected { tau, l, slope, area: self.area.clone(), size_deg: self.size_deg }
    }

    fn sized(cells: &[Searched], is_plane: bool) -> Expected {
        let mut sizes: Vec<f64> = cells.iter().map(|one| one.size_deg(is_plane)).collect();
        sizes.sort_by(f64::total_cmp);
        let size_deg = sizes.get(sizes.len() / 2).copied().unwrap_or_default();
        Expected { size_deg, ..Expected::default() }
    }

    /// The cues of all bands from a direction in the axes of the head (rad), at a distance.
    fn push(
        &mut self,
        cues: &super::CueRow,
        (azimuth, elevation): (f64, f64),
        law: &DistanceLaw,
        distance_m: f64,
    ) {
        let sine = lateral_sine(Spherical { rho_m: 1.0, azimuth, elevation });
        let (near, far) = (law.cues(distance_m, sine), law.cues(law.reference_m, sine));
        for band in 0..BANDS {
            self.tau.push(1e-3 * (cues.itd_us[band] + near.itd_us[band] - far.itd_us[band]));
            self.l.push(cues.ild_db[band] + near.ild_db[band] - far.ild_db[band]);
            self.slope.push(cues.slope_db[band] + near.slope_db[band] - far.slope_db[band]);
        }
    }
}

/// What the prior of a place is proportional to.
fn weight(cell: &Searched, is_plane: bool) -> f64 {
    if is_plane { cell.edges_deg[0].iter().sum() } else { cell.area() }
}
