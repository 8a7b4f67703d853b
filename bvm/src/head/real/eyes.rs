//! Sight: simulated pictures through rectified stereo to the map.
//!
//! In: the world and the true attitude, for the pictures; the estimated attitude, for their place in the map. Out: the
//! likelihood of the population codes of all directions. Invariant: what the cameras did not see gives no evidence.

use super::{Faults, noise_seed};
use crate::error::Error;
use crate::frame::{Spherical, angles};
use crate::grid::Grid;
use crate::head::frames::{Attitude, Extrinsics};
use crate::head::sense::{Evidence, Sense, Sensed};
use crate::head::stage::Shared;
use crate::map::Map;
use crate::vestibular::rotation;
use crate::vision::readings::placed_readings;
use crate::vision::{
    Calibration, DisparityMap, EvidenceKind, FrameEvidence, GreyImage, Matcher, Missing, Pair, Sight,
    ViewReadings,
};
use crate::world::render::{Pinhole, exposed, exposure};
use crate::world::scene::{Cameras, FaultKind, Organ};
use crate::world::seeded;
use std::time::Instant;

/// The nearest depth that is searched, as a share of the radius of the gap.
const NEAREST: f64 = 0.7;

/// Surfaces that are farther than this, m, are seen by both cameras wherever silence counts.
const NEAR_M: f64 = 0.6;

/// The last pictures.
#[derive(Clone, Debug)]
pub struct Views {
    /// Left and right.
    pub pair: [GreyImage; 2],
    /// Disparities of the left picture.
    pub found: DisparityMap,
}

pub(super) struct Eyes {
    stage: Shared,
    cameras: Cameras,
    extrinsics: Extrinsics,
    calibration: Calibration,
    faults: Faults,
    sight: Sight,
    missing: Missing,
    /// The last picture of each camera.
    kept: [Option<GreyImage>; 2],
    shown: super::Shown,
}

impl Eyes {
    pub(super) fn new(
        stage: &Shared,
        cameras: Cameras,
        extrinsics: Extrinsics,
        faults: Faults,
        grid: &Grid,
        shown: super::Shown,
    ) -> Result<Self, Error> {
        let [width, height] = cameras.size_px;
        let nearest = NEAREST * grid.edges_m()[0];
        let levels = (cameras.focal_px() * cameras.baseline_m / nearest).ceil() as usize + 2;
        let centre = [width, height].map(|size| 0.5 * (size as f64 - 1.0));
        let levels = levels.min(width - 1);
        let calibration = Calibration::of_rig(cameras.focal_px(), centre, cameras.baseline_m, levels)?;
        let (stage, kept) = (stage.clone(), [None, None]);
        let (sight, missing) = (Sight::default(), Missing::new(grid.cells()));
        Ok(Self { stage, cameras, extrinsics, calibration, faults, sight, missing, kept, shown })
    }

    /// What both cameras see.
    fn pictures(&self) -> Result<[GreyImage; 2], Error> {
        let stage = self.stage.borrow();
        let mut random = seeded(noise_seed(&stage), "cameras");
        let seen = [0, 1].map(|side| {
            let camera = self.extrinsics.camera_to_map(side, &stage.attitude);
            let (size_px, focal_px) = (self.cameras.size_px, self.cameras.focal_px());
            let pinhole = Pinhole { place: camera.translation, rotation: camera.rotation, size_px, focal_px };
            pinhole.brightness(&stage.world, stage.time_s)
        });
        let level = exposure(&seen[0]);
        let gains = [1.0, self.cameras.gain];
        let mut expose = |side: usize| {
            exposed(self.cameras.size_px, &seen[side], gains[side] * level, self.cameras.noise, &mut random)
        };
        Ok([expose(0)?, expose(1)?])
    }

    /// The pictures that arrive, and what is wrong with them.
    fn received(&mut self) -> Result<(Option<[GreyImage; 2]>, Option<String>), Error> {
        let pictures = self.pictures()?;
        let organs = [(Organ::LeftCamera, "left"), (Organ::RightCamera, "right")];
        let mut arrived = [None, None];
        let mut wrong = Vec::new();
        for (side, (picture, (organ, name))) in pictures.into_iter().zip(organs).enumerate() {
            match self.faults.of(organ) {
                Some(FaultKind::Lost) => wrong.push(format!("the {name} camera gave no picture")),
                Some(FaultKind::Frozen) => arrived[side] = self.kept[side].clone(),
                None => {
                    self.kept[side] = Some(picture.clone());
                    arrived[side] = Some(picture);
                }
            }
        }
        let fault = (!wrong.is_empty()).then(|| wrong.join(", "));
        Ok(match arrived {
            [Some(left), Some(right)] => (Some([left, right]), fault),
            _ => (None, fault),
        })
    }
}

impl Sense for Eyes {
    fn name(&self) -> &'static str {
        "stereo"
    }

    fn likelihood(&mut self, prior: &Map, attitude: &Attitude) -> Result<Sensed, Error> {
        let before = self.kept.clone();
        let begun = Instant::now();
        let (pictures, mut fault) = self.received()?;
        let simulated_ms = begun.elapsed().as_secs_f64() * 1e3;
        let Some([left, right]) = pictures else { return Ok(Sensed { fault, ..Sensed::default() }) };
        // The noise of two pictures differs, unless the second is the first again.
        for (side, (now, was)) in [&left, &right].into_iter().zip(&before).enumerate() {
            if self.cameras.noise > 0.0 && was.as_ref() == Some(now) {
                let name = ["left", "right"][side];
                fault = Some(format!("the {name} camera repeats its last picture to the bit: not used"));
            }
        }
        if fault.is_some() {
            return Ok(Sensed { fault, ..Sensed::default() });
        }
        let pair = Pair::new(left, right, self.calibration)?;
        let (found, population) = pair.matched_with_population(Matcher::Scanline)?;
        let grid = prior.grid();
        let camera = self.extrinsics.camera_to_map(0, attitude);
        let ray = |x: f64, y: f64| {
            let ray = self.calibration.ray(x, y);
            let length = ray.iter().map(|part| part * part).sum::<f64>().sqrt();
            ray.map(|part| part / length)
        };
        let place = |x: f64, y: f64, range: f64| {
            let point = camera.point(ray(x, y).map(|part| part * range));
            let (azimuth, elevation) = angles(point);
            let rho_m = point.iter().map(|part| part * part).sum::<f64>().sqrt();
            Spherical { rho_m, azimuth, elevation }
        };
        let cells = [grid.azimuth_cells(), grid.elevation_cells()];
        let steps = [grid.azimuth_step(), grid.elevation_step()];
        let pixels = placed_readings(&found, &self.calibration, place, cells, steps)?;
        let heard = FrameEvidence {
            evidence: EvidenceKind::Virtual,
            population: population.as_ref(),
            camera_m: rotation::apply(&rotation::transposed(&camera.rotation), camera.translation),
        };
        let view = ViewReadings::of(&pixels, &found, &self.calibration, grid, grid.edges_m()[0], &heard);
        let mut likelihood = self.sight.likelihood_of(grid, &view, None)?;
        let fields = self.cameras.fields_degrees();
        let readings = view.readings.iter().flatten().count();
        // At its left edge the left picture shows what the right camera cannot see.
        let alone = self.cameras.baseline_m / NEAR_M;
        let view = super::neck::view(grid, attitude, fields, alone, &view.readings);
        self.missing.add(prior, &view, &mut likelihood)?;
        let Pair { left, right, .. } = pair;
        *self.shown.borrow_mut() = Some(Views { pair: [left, right], found });
        Ok(Sensed {
            evidence: Evidence::Cells(likelihood),
            readings,
            view,
            simulated_ms,
            ..Sensed::default()
        })
    }

    fn memory(&self) -> Vec<f32> {
        self.missing.was_read().to_vec()
    }

    fn remember(&mut self, memory: &[f32]) {
        self.missing.restore(memory);
    }
}
