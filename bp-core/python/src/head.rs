//! The active head: sense, estimate, choose, turn.
//!
//! In: a simulated world, or depths and attitudes of a robot. Out: for each look a record, and the map. Invariant: looks of
//! several threads come one after the other.
//!
//! The parts of a head share state that belongs to one thread: the thread of the head holds them.

use crate::array::{finite, float32};
use crate::error::{raised, raised_by_map, wrong};
use crate::volumetric::{Map, ranges_of_depth};
use bp_core::prelude::Error;
use bvm::exploration::Gradient;
use bvm::frame::wrap_angle;
use bvm::grid::{Grid, GridConfiguration};
use bvm::head::{self, Attitude, Evidence, Look, Neck, Sense, Sensed, Turned};
use bvm::map::{self, Heading};
use bvm::vision::{EvidenceKind, RangeReading, Sight};
use bvm::world::World;
use pyo3::prelude::*;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

/// What a robot measured before a look.
#[derive(Default)]
struct Measured {
    readings: Vec<Option<RangeReading>>,
    attitude: Attitude,
    time_s: f64,
}

type Answer = Result<(Look, map::Map), bvm::error::Error>;

/// A request: measurements, or none of a simulated head.
type Request = (Option<Measured>, Sender<Answer>);

/// An active head.
///
/// `Head.simulated()` explores a simulated room by itself; `Head()` takes the depths and the attitude of a robot at each
/// look, and returns where to look next.
#[pyclass(frozen, module = "bayesian_programs.bvm")]
pub(crate) struct Head {
    grid: Grid,
    simulated: bool,
    requests: Mutex<Sender<Request>>,
    map: Mutex<map::Map>,
}

/// Where the parts of a robot's head find what was measured.
type Shared = Rc<RefCell<Measured>>;

struct Depths {
    measured: Shared,
    sigma_m: f64,
    sight: Sight,
}

impl Sense for Depths {
    fn name(&self) -> &'static str {
        "depth"
    }

    fn likelihood(&mut self, prior: &map::Map, _attitude: &Attitude) -> Result<Sensed, bvm::error::Error> {
        let readings = &self.measured.borrow().readings;
        let count = readings.iter().flatten().count();
        let found = self.sight.likelihood(prior.grid(), readings, self.sigma_m, EvidenceKind::Hard)?;
        let view = readings.iter().map(|reading| reading.map(|_| true)).collect();
        Ok(Sensed { evidence: Evidence::Cells(found), readings: count, view, ..Sensed::default() })
    }
}

/// Balance: the attitude that the robot measured.
struct Measuring(Shared);

impl Sense for Measuring {
    fn name(&self) -> &'static str {
        "attitude"
    }

    fn likelihood(&mut self, _prior: &map::Map, _attitude: &Attitude) -> Result<Sensed, bvm::error::Error> {
        let attitude = self.0.borrow().attitude;
        Ok(Sensed { evidence: Evidence::Attitude(attitude), readings: 1, ..Sensed::default() })
    }
}

/// The robot turns its own neck.
struct Robot {
    measured: Shared,
    most_tilt: f64,
}

impl Neck for Robot {
    fn turn(&mut self, gaze: head::Gaze, attitude: &Attitude) -> Result<Turned, bvm::error::Error> {
        let elevation = gaze.elevation.clamp(-self.most_tilt, self.most_tilt);
        let yaw = wrap_angle(gaze.azimuth - attitude.yaw).abs();
        let travel_rad = yaw.max((elevation - attitude.pitch).abs());
        Ok(Turned { gaze: head::Gaze { elevation, ..gaze }, seconds: 0.0, travel_rad })
    }

    fn reaches(&self, (_, elevation): (f64, f64)) -> bool {
        elevation.abs() <= self.most_tilt
    }

    fn time_s(&self) -> f64 {
        self.measured.borrow().time_s
    }
}

/// Answers looks until there are no more requests.
fn serve(mut head: head::Head, measured: Option<&Shared>, requests: &Receiver<Request>) {
    let mut rule = Gradient::default();
    while let Ok((given, answer)) = requests.recv() {
        // A robot knows its attitude at the look; the head would take the one that it felt before.
        let attitude = given.as_ref().map(|given| given.attitude);
        if let (Some(shared), Some(given)) = (measured, given) {
            *shared.borrow_mut() = given;
        }
        let mut policy = |map: &map::Map, heading: &Heading| {
            rule.choose(map, &attitude.map_or(*heading, |attitude| attitude.heading()))
        };
        let looked =
            head.look(&mut policy).map(|look| Look { attitude: attitude.unwrap_or(look.attitude), ..look });
        drop(answer.send(looked.map(|look| (look, head.map().clone()))));
    }
}

impl Head {
    fn begun(
        grid: Grid,
        simulated: bool,
        serve: impl FnOnce(Receiver<Request>, Sender<Result<(), bvm::error::Error>>) + Send + 'static,
    ) -> PyResult<Self> {
        let (requests, receiver) = channel();
        let (ready, begun) = channel();
        std::thread::spawn(move || serve(receiver, ready));
        begun.recv().map_err(|_| raised(Error::Interrupted))?.map_err(raised_by_map)?;
        let map = map::Map::new(grid.clone()).map_err(raised_by_map)?;
        Ok(Self { grid, simulated, requests: Mutex::new(requests), map: Mutex::new(map) })
    }

    /// The record of a look, as JSON.
    fn looked(&self, py: Python<'_>, measured: Option<Measured>) -> PyResult<String> {
        let answer = py.detach(|| {
            let requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
            let (send, answer) = channel();
            requests.send((measured, send)).ok()?;
            let answer = answer.recv().ok()?;
            Some(answer.map(|(look, map)| {
                *self.map.lock().unwrap_or_else(PoisonError::into_inner) = map;
                look
            }))
        });
        let look = answer.ok_or_else(|| wrong("the head has ended after an internal error"))?;
        let look = look.map_err(raised_by_map)?;
        serde_json::to_string(&look).map_err(|error| wrong(error.to_string()))
    }
}

#[pymethods]
impl Head {
    /// A robot's head with an empty map: `sigma_m` is the standard deviation of a range, m; `most_tilt`, rad, limits the
    /// elevation of the next gaze.
    #[new]
    #[pyo3(signature = (
        *, cells_rho = 16, rho_min_m = 0.5, rho_max_m = 6.0, azimuth_cells = 90, elevation_cells = 45,
        sigma_m = 0.05, most_tilt = 1.1
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        cells_rho: usize,
        rho_min_m: f64,
        rho_max_m: f64,
        azimuth_cells: usize,
        elevation_cells: usize,
        sigma_m: f64,
        most_tilt: f64,
    ) -> PyResult<Self> {
        let of = GridConfiguration { cells_rho, rho_min_m, rho_max_m, azimuth_cells, elevation_cells };
        let grid = Grid::new(of).map_err(raised_by_map)?;
        for (name, number) in [("sigma_m", sigma_m), ("most_tilt", most_tilt)] {
            if !(number > 0.0 && number.is_finite()) {
                return Err(wrong(format!("{name} is {number}, but it must be positive")));
            }
        }
        let own = grid.clone();
        Self::begun(grid, false, move |requests, ready| match map::Map::new(own) {
            Ok(map) => {
                drop(ready.send(Ok(())));
                let measured = Shared::default();
                let depths = Depths { measured: measured.clone(), sigma_m, sight: Sight::default() };
                let neck = Robot { measured: measured.clone(), most_tilt };
                let balance = Box::new(Measuring(measured.clone()));
                let head = head::Head::new(map, vec![Box::new(depths)], balance, Box::new(neck));
                serve(head, Some(&measured), &requests);
            }
            Err(error) => drop(ready.send(Err(error))),
        })
    }

    /// The simulated head of `bvm explore` in its simulated room: depth, hearing and balance with noise of this seed.
    #[staticmethod]
    #[pyo3(signature = (seed = 1))]
    fn simulated(seed: u64) -> PyResult<Self> {
        let grid = Grid::new(GridConfiguration::default_exploration()).map_err(raised_by_map)?;
        Self::begun(grid, true, move |requests, ready| {
            match head::depth::head(World::embedded(seed), EvidenceKind::Hard, seed) {
                Ok(head) => {
                    drop(ready.send(Ok(())));
                    serve(head, None, &requests);
                }
                Err(error) => drop(ready.send(Err(error))),
            }
        })
    }

    /// One look: sense, estimate, choose. A robot gives `depth` (row, column), m, float32, along the optical axis, with
    /// `focal_px` (fx, fy) and `centre_px` (cx, cy), and its attitude, rad; a simulated head gives nothing. Returns the record
    /// of the look, a dict with the next gaze as `next`, in the units of `bvm explore`. Raises `InputError`.
    #[pyo3(signature = (depth = None, *, focal_px = None, centre_px = None, yaw = 0.0, pitch = 0.0, roll = 0.0, time_s = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn look<'py>(
        &self,
        py: Python<'py>,
        depth: Option<&Bound<'py, PyAny>>,
        focal_px: Option<[f64; 2]>,
        centre_px: Option<[f64; 2]>,
        yaw: f64,
        pitch: f64,
        roll: f64,
        time_s: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let record = match (self.simulated, depth, focal_px, centre_px) {
            (true, None, ..) => self.looked(py, None),
            (true, Some(_), ..) => Err(wrong("a simulated head measures by itself: give no depth")),
            (false, Some(depth), Some(focal), Some(centre)) => {
                finite(&[("time_s", time_s)])?;
                let depth = float32("depth", "(row, column)", depth)?;
                let attitude = Attitude { yaw, pitch, roll, sd_yaw: 0.0 };
                let ranges = ranges_of_depth(&self.grid, &depth, (focal, centre), &attitude)?;
                let reading = |range: &f32| {
                    (!range.is_nan()).then_some(RangeReading { range_m: *range, confidence: 1.0 })
                };
                let readings = ranges.iter().map(reading).collect();
                self.looked(py, Some(Measured { readings, attitude, time_s }))
            }
            (false, ..) => Err(wrong("a look of a robot needs `depth`, `focal_px` and `centre_px`")),
        };
        py.import("json")?.call_method1("loads", (record?,))
    }

    /// A copy of the map.
    #[getter]
    fn map(&self, py: Python<'_>) -> Map {
        py.detach(|| Map::of(self.map.lock().unwrap_or_else(PoisonError::into_inner).clone()))
    }

    fn __repr__(&self) -> String {
        format!(
            "<Head, {}, {} cells>",
            if self.simulated { "simulated" } else { "of a robot" },
            self.grid.cells()
        )
    }
}
