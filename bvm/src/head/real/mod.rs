//! The whole head in a simulated world: two cameras, two ears, an inertial sensor, a neck with limits.
//!
//! In: a scene, a seed, the names of senses. Out: a [`Head`]. Pictures, waveforms and samples are simulated; from there on
//! everything is the code that `bvm look`, `bvm listen` and `bvm balance` use. Invariant: no sense reads the truth but to
//! simulate its own device, and the noise of a look depends on the seed and its number only, so that a run can be resumed
//! at any look.

mod ears;
mod eyes;
mod imu;
mod neck;

pub use ears::{LOOK_S, RATE_HZ};
pub use eyes::Views;

use super::stage::{Shared, Stage};
use super::{Attitude, Extrinsics, Head, Sense};
use crate::error::Error;
use crate::grid::{Grid, GridConfiguration};
use crate::map::Map;
use crate::world::scene::{Fault, FaultKind, Organ, Scene};
use crate::world::sensors::DepthCamera;
use neck::SlewingNeck;
use std::cell::RefCell;
use std::rc::Rc;

/// The senses of a head.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses {
    /// Two cameras.
    pub stereo: bool,
    /// Two ears.
    pub audio: bool,
    /// The inertial sensor; without it the attitude is the one commanded to the neck.
    pub imu: bool,
    /// Whether the map carries the joint distribution of O and V (`models/cell_joint.bp`).
    pub joint: bool,
}

/// The last pictures of a head, for its report.
pub type Shown = Rc<RefCell<Option<Views>>>;

/// A head in the world of a scene, and where its last pictures are kept.
///
/// # Errors
/// An impossible rig.
pub fn head(scene: &Scene, senses: Senses, seed: u64) -> Result<(Head, Shown), Error> {
    let grid = Grid::new(GridConfiguration::default_exploration())?;
    let stage = Stage::new(scene.world(seed), seed);
    let extrinsics = Extrinsics::of(scene.cameras.baseline_m, scene.cameras.ahead_m);
    let faults = Faults { stage: stage.clone(), all: scene.faults.clone() };
    let shown = Shown::default();
    let mut own: Vec<Box<dyn Sense>> = Vec::new();
    if senses.stereo {
        let eyes = eyes::Eyes::new(&stage, scene.cameras, extrinsics, faults.clone(), &grid, shown.clone())?;
        own.push(Box::new(eyes));
    }
    if senses.audio {
        own.push(Box::new(ears::EarPair::new(&stage, extrinsics, faults.clone(), &grid)?));
    }
    let balance = imu::InertialSense::new(&stage, scene.imu, faults, senses.imu);
    let neck = SlewingNeck::new(&stage, scene, extrinsics, camera_of(scene));
    let map = if senses.joint { Map::with_joint(grid)? } else { Map::new(grid)? };
    Ok((Head::new(map, own, Box::new(balance), Box::new(neck)), shown))
}

/// The field of view of the cameras, for policies.
pub fn camera_of(scene: &Scene) -> DepthCamera {
    DepthCamera { field_degrees: scene.cameras.fields_degrees(), ..DepthCamera::default() }
}

/// The largest tilt that the neck of a scene allows in both directions, rad.
pub fn most_tilt(scene: &Scene) -> f64 {
    let [down, up] = scene.neck.pitch_degrees;
    down.abs().max(up).to_radians()
}

/// The faults of a scene.
#[derive(Clone)]
struct Faults {
    stage: Shared,
    all: Vec<Fault>,
}

impl Faults {
    /// The fault of an organ at the present look.
    fn of(&self, organ: Organ) -> Option<FaultKind> {
        self.at(organ, self.stage.borrow().look)
    }

    fn at(&self, organ: Organ, look: usize) -> Option<FaultKind> {
        let is_now =
            |fault: &&Fault| fault.organ == organ && (fault.looks[0]..=fault.looks[1]).contains(&look);
        self.all.iter().find(is_now).map(|fault| fault.kind)
    }
}

/// The seed of a look's noise.
fn noise_seed(stage: &Stage) -> u64 {
    stage.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(stage.look as u64)
}

/// A vector with zero rate and gravity, of a head at rest: rate in rad/s, force in m/s², in the axes of the head.
fn at_rest(attitude: &Attitude) -> ([f64; 3], [f64; 3]) {
    let (sine, cosine) = attitude.pitch.sin_cos();
    let gravity = crate::vestibular::inertial::GRAVITY;
    ([0.0; 3], [gravity * sine, 0.0, gravity * cosine])
}
