//! The fast head: a depth camera, formulas of hearing, a gyroscope about the vertical.
//!
//! In: the shared truth. Out: senses and a neck for [`super::Head`]. Invariant: each sense has its own generator of noise,
//! so that a gaze changes no other sense's noise.

use super::Head;
use super::frames::Attitude;
use super::policy::Gaze;
use super::sense::{Evidence, Sense, Sensed};
use super::stage::{Neck, Shared, Stage, Turned};
use crate::audition::Hearing;
use crate::error::Error;
use crate::frame::wrap_angle;
use crate::grid::{Grid, GridConfiguration};
use crate::map::Map;
use crate::vestibular::{Balance, Vestibular};
use crate::vision::{EvidenceKind, Missing, RangeReading, Sight};
use crate::world::sensors::{Cues, DepthCamera, Ears, Gyroscope, Pose, turn_profile};
use crate::world::{Random, World, seeded};

/// Time between looks, seconds; turns take no time of the world.
pub const STEP_S: f64 = 0.5;

/// Most tilt of the camera, rad.
pub const MOST_TILT: f64 = 1.1;

/// A head in a world, with this kind of evidence from a range reading. As in the paper, a direction without a reading is
/// predicted and not estimated.
///
/// # Errors
/// None that valid programs give.
pub fn head(world: World, evidence: EvidenceKind, seed: u64) -> Result<Head, Error> {
    head_with(world, evidence, Options::default(), seed)
}

/// What differs from the paper's head.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// A missing reading is evidence (`models/missing.bp`): what leaves is forgotten even where nothing behind it returns a
    /// reading.
    pub missing: bool,
    /// The joint distribution of O and V is carried (`models/cell_joint.bp`).
    pub joint: bool,
}

/// [`head`] with options.
///
/// # Errors
/// None that valid programs give.
pub fn head_with(world: World, evidence: EvidenceKind, options: Options, seed: u64) -> Result<Head, Error> {
    let grid = Grid::new(GridConfiguration::default_exploration())?;
    let stage = Stage::new(world, seed);
    let camera = DepthCamera::default();
    let sight = DepthSight {
        stage: stage.clone(),
        camera,
        evidence,
        noise: seeded(seed, "sight"),
        sight: Sight::default(),
        missing: options.missing.then(|| Missing::new(grid.cells())),
    };
    let hearing = FormulaHearing {
        stage: stage.clone(),
        ears: Ears::default(),
        noise: seeded(seed, "hearing"),
        hearing: Hearing::calibrated(&grid),
    };
    let balance = Gyroscopic {
        stage: stage.clone(),
        gyroscope: Gyroscope::default(),
        noise: seeded(seed, "balance"),
        balance: Vestibular::at_rest(Balance::Gyroscope)?,
    };
    let neck = FastNeck { stage, camera };
    let map = if options.joint { Map::with_joint(grid)? } else { Map::new(grid)? };
    Ok(Head::new(map, vec![Box::new(sight), Box::new(hearing)], Box::new(balance), Box::new(neck)))
}

struct DepthSight {
    stage: Shared,
    camera: DepthCamera,
    evidence: EvidenceKind,
    noise: Random,
    sight: Sight,
    missing: Option<Missing>,
}

impl DepthSight {
    fn readings(&mut self, grid: &Grid, attitude: &Attitude) -> Vec<Option<RangeReading>> {
        let stage = self.stage.borrow();
        let pose = Pose { yaw: stage.attitude.yaw, heading: attitude.heading(), pitch: stage.attitude.pitch };
        self.camera.look(&stage.world, grid, pose, stage.time_s, &mut self.noise)
    }
}

impl Sense for DepthSight {
    fn name(&self) -> &'static str {
        "depth"
    }

    fn likelihood(&mut self, prior: &Map, attitude: &Attitude) -> Result<Sensed, Error> {
        let grid = prior.grid();
        let readings = self.readings(grid, attitude);
        let mut likelihood =
            self.sight.likelihood(grid, &readings, self.camera.sigma_min_m, self.evidence)?;
        let heading = attitude.heading();
        let pitch = self.stage.borrow().attitude.pitch;
        let view = grid.all_directions().zip(&readings).map(|(direction, reading)| {
            let (azimuth, elevation) = grid.direction_centre(direction);
            let is_in_view = self.camera.sees((heading.relative(azimuth), elevation), pitch).is_some();
            is_in_view.then_some(reading.is_some())
        });
        let (view, count): (Vec<_>, usize) = (view.collect(), readings.iter().flatten().count());
        if let Some(missing) = &mut self.missing {
            missing.add(prior, &view, &mut likelihood)?;
        }
        Ok(Sensed { evidence: Evidence::Cells(likelihood), readings: count, view, ..Sensed::default() })
    }

    fn skip(&mut self, attitude: &Attitude) -> Result<(), Error> {
        let grid = Grid::new(GridConfiguration::default_exploration())?;
        self.readings(&grid, attitude);
        Ok(())
    }

    fn memory(&self) -> Vec<f32> {
        self.missing.as_ref().map_or(Vec::new(), |missing| missing.was_read().to_vec())
    }

    fn remember(&mut self, memory: &[f32]) {
        if let Some(missing) = &mut self.missing {
            missing.restore(memory);
        }
    }
}

struct FormulaHearing {
    stage: Shared,
    ears: Ears,
    noise: Random,
    hearing: Hearing,
}

impl FormulaHearing {
    fn cues(&mut self) -> Option<Cues> {
        let stage = self.stage.borrow();
        self.ears.hear(&stage.world, stage.attitude.yaw, stage.time_s, &mut self.noise)
    }
}

impl Sense for FormulaHearing {
    fn name(&self) -> &'static str {
        "hearing"
    }

    fn likelihood(&mut self, _prior: &Map, attitude: &Attitude) -> Result<Sensed, Error> {
        let Some(cues) = self.cues() else { return Ok(Sensed::default()) };
        let likelihood = self.hearing.turned(attitude.heading()).likelihood(&cues)?;
        Ok(Sensed { evidence: Evidence::Cells(likelihood), readings: 1, ..Sensed::default() })
    }

    fn skip(&mut self, _attitude: &Attitude) -> Result<(), Error> {
        self.cues();
        Ok(())
    }
}

struct Gyroscopic {
    stage: Shared,
    gyroscope: Gyroscope,
    noise: Random,
    balance: Vestibular,
}

impl Sense for Gyroscopic {
    fn name(&self) -> &'static str {
        "balance"
    }

    fn likelihood(&mut self, _prior: &Map, _attitude: &Attitude) -> Result<Sensed, Error> {
        let felt = std::mem::take(&mut self.stage.borrow_mut().felt);
        for (_, rate, _) in &felt {
            self.balance.feel(self.gyroscope.measure(rate[2], &mut self.noise))?;
        }
        // The tilt of the camera is known.
        let pitch = self.stage.borrow().attitude.pitch;
        let attitude = Attitude { yaw: self.balance.yaw(), pitch, ..Attitude::default() };
        Ok(Sensed { evidence: Evidence::Attitude(attitude), readings: felt.len(), ..Sensed::default() })
    }
}

struct FastNeck {
    stage: Shared,
    camera: DepthCamera,
}

impl Neck for FastNeck {
    fn turn(&mut self, gaze: Gaze, attitude: &Attitude) -> Result<Turned, Error> {
        let gaze = Gaze { elevation: gaze.elevation.clamp(-MOST_TILT, MOST_TILT), ..gaze };
        let mut stage = self.stage.borrow_mut();
        let rates = turn_profile(attitude.heading().relative(gaze.azimuth), Vestibular::DT);
        let before = stage.attitude;
        for rate in &rates {
            stage.attitude.yaw += rate * Vestibular::DT;
            let time = stage.time_s;
            stage.felt.push((time, [0.0, 0.0, *rate], [0.0; 3]));
        }
        stage.attitude.pitch = gaze.elevation;
        stage.time_s += STEP_S;
        stage.look += 1;
        let travel_rad = (stage.attitude.yaw - before.yaw).abs().max((gaze.elevation - before.pitch).abs());
        Ok(Turned { gaze, seconds: rates.len() as f64 * Vestibular::DT, travel_rad })
    }

    fn reaches(&self, (_, elevation): (f64, f64)) -> bool {
        let pitch = elevation.clamp(-MOST_TILT, MOST_TILT);
        self.camera.sees((0.0, elevation), pitch).is_some()
    }

    fn time_s(&self) -> f64 {
        self.stage.borrow().time_s
    }

    fn truth(&self) -> Option<Attitude> {
        let attitude = self.stage.borrow().attitude;
        Some(Attitude { yaw: wrap_angle(attitude.yaw), ..attitude })
    }
}
