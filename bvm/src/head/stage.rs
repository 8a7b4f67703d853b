//! The simulated world with the head in it: the truth that the senses measure and the neck moves.
//!
//! In: a world, turns. Out: time, the true attitude, and samples for balance. Invariant: only senses and necks of the
//! simulation read it; map, policy and estimates do not.

use super::frames::Attitude;
use super::policy::Gaze;
use crate::error::Error;
use crate::world::World;
use std::cell::RefCell;
use std::rc::Rc;

/// The truth.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The world.
    pub world: World,
    /// The random seed.
    pub seed: u64,
    /// The true attitude.
    pub attitude: Attitude,
    /// Time, s.
    pub time_s: f64,
    /// The number of the present look, from 1.
    pub look: usize,
    /// The turn that balance has not felt yet: for each sample its time, s, the angular rate, rad/s, and the specific
    /// force, m/s², of the head in its own axes.
    pub felt: Vec<(f64, [f64; 3], [f64; 3])>,
    /// The last turn by the neck's own account: yaw and pitch, rad.
    pub commanded: [f64; 2],
}

/// The truth, shared by the parts of a simulated head.
pub type Shared = Rc<RefCell<Stage>>;

/// A turn of the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    /// The gaze that was reached, by the neck's own account.
    pub gaze: Gaze,
    /// How long it took, s.
    pub seconds: f64,
    /// How far the head turned, rad.
    pub travel_rad: f64,
}

/// What turns the head.
pub trait Neck {
    /// Turns the head from its estimated attitude to a gaze, or as near as it can.
    ///
    /// # Errors
    /// Those of the device.
    fn turn(&mut self, gaze: Gaze, attitude: &Attitude) -> Result<Turned, Error>;

    /// Whether a direction (azimuth and elevation in the map, rad) can be brought into view.
    fn reaches(&self, direction: (f64, f64)) -> bool;

    /// Time, s.
    fn time_s(&self) -> f64;

    /// The true attitude, where it is known.
    fn truth(&self) -> Option<Attitude> {
        None
    }
}

impl Stage {
    /// A head that looks ahead at time 0.
    pub fn new(world: World, seed: u64) -> Shared {
        let attitude = Attitude::default();
        let (felt, commanded) = (Vec::new(), [0.0; 2]);
        Rc::new(RefCell::new(Stage { world, seed, attitude, time_s: 0.0, look: 1, felt, commanded }))
    }
}
