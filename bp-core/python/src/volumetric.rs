//! The Bayesian Volumetric Map with arrays in and out.
//!
//! In: ranges, depth images or likelihoods, numpy float32. Out: P(O), P(V), entropies, the next gaze. Invariant: the frame
//! is that of `bvm`: x ahead, y left, z up, m; azimuth to the left and elevation upwards, rad. Arrays have the axes (ρ,
//! elevation, azimuth); contiguous ones are read where they are, others are copied; what is returned is the caller's own.

use crate::array::{finite, float32};
use crate::error::{raised_by_map, wrong};
use bvm::exploration::Gradient;
use bvm::frame::{Spherical, from_camera};
use bvm::grid::{Direction, Grid, GridConfiguration};
use bvm::head::{self, Attitude};
use bvm::map::{self, Heading};
use bvm::vision::stereo::{DisparityMap, Matcher, match_pair};
use bvm::vision::{EvidenceKind, GreyImage, RangeReading, Sight};
use numpy::{PyArray1, PyArray3, PyArray4, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray4};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A direction to look at.
#[pyclass(frozen, get_all, module = "bayesian_programs.bvm")]
pub(crate) struct Gaze {
    /// Azimuth in the map, rad to the left.
    azimuth: f64,
    /// Elevation, rad upwards.
    elevation: f64,
    /// The score by which it was chosen; 0 if there was no choice.
    score: f64,
    /// The distance of the chosen frontier cell, m.
    range_m: Option<f64>,
}

impl From<head::Gaze> for Gaze {
    fn from(gaze: head::Gaze) -> Self {
        let head::Gaze { azimuth, elevation, score, range_m } = gaze;
        Self { azimuth, elevation, score, range_m }
    }
}

#[pymethods]
impl Gaze {
    fn __repr__(&self) -> String {
        format!("Gaze(azimuth={:.4}, elevation={:.4}, score={:.4})", self.azimuth, self.elevation, self.score)
    }
}

/// The map: a log-spherical grid around the head, fixed in the world, filtered by `bvm/models/cell.bp`.
///
/// `cells_rho` shells from `rho_min_m` to `rho_max_m`, in rows of `elevation_cells` from straight down to straight up, in
/// `azimuth_cells` columns (an even number) from −π to π. The default is a room of 64 800 cells. Numbers and shapes that do
/// not fit raise `InputError`, arrays of another type than float32 `TypeError`.
#[pyclass(frozen, module = "bayesian_programs.bvm")]
pub(crate) struct Map {
    grid: Grid,
    state: Mutex<State>,
}

struct State {
    map: map::Map,
    sight: Sight,
    rule: Gradient,
}

impl Map {
    pub(crate) fn of(map: map::Map) -> Self {
        let grid = map.grid().clone();
        let state = State { map, sight: Sight::default(), rule: Gradient::default() };
        Self { grid, state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// An array of one number for each cell.
    fn cells<'py>(
        &self,
        py: Python<'py>,
        read: fn(&map::Map) -> &[f32],
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let numbers = py.detach(|| read(&self.state().map).to_vec());
        PyArray1::from_vec(py, numbers).reshape(self.shape())
    }

    fn shape(&self) -> [usize; 3] {
        [self.grid.cells_rho(), self.grid.elevation_cells(), self.grid.azimuth_cells()]
    }
}

/// The readings of directions from an array of ranges.
pub(crate) fn readings(
    grid: &Grid,
    ranges: &PyReadonlyArray2<'_, f32>,
    confidence: f32,
) -> PyResult<Vec<Option<RangeReading>>> {
    let expected = [grid.elevation_cells(), grid.azimuth_cells()];
    let ranges = ranges.as_array();
    if ranges.shape() != expected {
        return Err(wrong(format!(
            "ranges have the shape {:?}, but the directions of the map have {expected:?} (elevation, azimuth)",
            ranges.shape()
        )));
    }
    if !(confidence > 0.0 && confidence <= 1.0) {
        return Err(wrong(format!("the confidence is {confidence}, but it must be above 0 and at most 1")));
    }
    let one = |range: &f32| match *range {
        range if range.is_nan() => Ok(None),
        range if range > 0.0 && range.is_finite() => Ok(Some(RangeReading { range_m: range, confidence })),
        range => {
            let message = "but it must be positive and finite; NaN means no reading";
            Err(wrong(format!("a range is {range} m, {message}")))
        }
    };
    ranges.iter().map(one).collect()
}

/// The range of the nearest pixel in each direction, from a depth image along the optical axis; NaN where there is none.
pub(crate) fn ranges_of_depth(
    grid: &Grid,
    depth: &PyReadonlyArray2<'_, f32>,
    (focal, centre): ([f64; 2], [f64; 2]),
    attitude: &Attitude,
) -> PyResult<Vec<f32>> {
    let Attitude { yaw, pitch, roll, .. } = *attitude;
    finite(&[
        ("yaw", yaw),
        ("pitch", pitch),
        ("roll", roll),
        ("centre_px", centre[0]),
        ("centre_px", centre[1]),
    ])?;
    if !focal.iter().all(|focal| focal.is_finite() && *focal > 0.0) {
        return Err(wrong(format!("the focal lengths are {focal:?} pixels, but they must be positive")));
    }
    let turned = attitude.matrix();
    let mut nearest = vec![f32::NAN; grid.directions()];
    for ((row, column), depth) in depth.as_array().indexed_iter() {
        if !(depth.is_finite() && *depth > 0.0) {
            continue;
        }
        let ray = [(column as f64 - centre[0]) / focal[0], (row as f64 - centre[1]) / focal[1], 1.0];
        let seen = from_camera(ray.map(|slope| slope * f64::from(*depth)));
        let place = bvm::vestibular::rotation::apply(&turned, seen);
        let Spherical { rho_m, azimuth, elevation } = Spherical::from_cartesian(place);
        let Some(direction) = grid.direction_of(azimuth, elevation) else { continue };
        let held = &mut nearest[grid.direction_index(direction)];
        *held = held.min(rho_m as f32);
    }
    Ok(nearest)
}

/// The kind of evidence by its name.
fn evidence_kind(name: &str) -> PyResult<EvidenceKind> {
    let kinds = [EvidenceKind::Hard, EvidenceKind::Virtual];
    let found = kinds.into_iter().find(|kind| kind.name() == name);
    found.ok_or_else(|| wrong(format!("the evidence is `{name}`, but it must be `hard` or `virtual`")))
}

#[pymethods]
impl Map {
    #[new]
    #[pyo3(signature = (*, cells_rho = 16, rho_min_m = 0.5, rho_max_m = 6.0, azimuth_cells = 90, elevation_cells = 45))]
    fn new(
        cells_rho: usize,
        rho_min_m: f64,
        rho_max_m: f64,
        azimuth_cells: usize,
        elevation_cells: usize,
    ) -> PyResult<Self> {
        let of = GridConfiguration { cells_rho, rho_min_m, rho_max_m, azimuth_cells, elevation_cells };
        let grid = Grid::new(of).map_err(raised_by_map)?;
        map::Map::new(grid).map(Self::of).map_err(raised_by_map)
    }

    /// (ρ, elevation, azimuth): the number of cells along each axis.
    #[getter(shape)]
    fn extents(&self) -> (usize, usize, usize) {
        self.shape().into()
    }

    /// The edges of the shells, m: an array of `cells_rho + 1` (float64).
    #[getter]
    fn edges_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.grid.edges_m())
    }

    /// The azimuths of the columns, rad to the left (float64).
    #[getter]
    fn azimuths<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let centre = |azimuth| self.grid.direction_centre(Direction { elevation: 0, azimuth }).0;
        PyArray1::from_vec(py, (0..self.grid.azimuth_cells()).map(centre).collect())
    }

    /// The elevations of the rows, rad upwards (float64).
    #[getter]
    fn elevations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let centre = |elevation| self.grid.direction_centre(Direction { elevation, azimuth: 0 }).1;
        PyArray1::from_vec(py, (0..self.grid.elevation_cells()).map(centre).collect())
    }

    /// P(O = 1) of each cell: a new array (ρ, elevation, azimuth), float32.
    #[getter]
    fn occupancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        self.cells(py, map::Map::occupancy)
    }

    /// H(O, V) of each cell, nats: a new array (ρ, elevation, azimuth), float32.
    #[getter]
    fn entropy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        self.cells(py, map::Map::entropy)
    }

    /// H(O) of each cell, nats: a new array (ρ, elevation, azimuth), float32.
    #[getter]
    fn occupancy_entropy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        self.cells(py, map::Map::occupancy_entropy)
    }

    /// P(V = v) of each cell: a new array (velocity, ρ, elevation, azimuth), float32; the velocities are `velocities`.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray4<f32>>> {
        let numbers = py.detach(|| self.state().map.velocity().to_vec());
        let [rho, elevation, azimuth] = self.shape();
        PyArray1::from_vec(py, numbers).reshape([map::VELOCITIES.len(), rho, elevation, azimuth])
    }

    /// The displacements of a step, in cells along (ρ, elevation, azimuth), in the order of `velocity`.
    #[getter]
    fn velocities(&self) -> Vec<[i32; 3]> {
        map::VELOCITIES.to_vec()
    }

    /// The likelihood of a range in each direction: `ranges` (elevation, azimuth), m, float32, NaN where there is no reading;
    /// the standard deviation of a range is `sigma_m / confidence` m. `evidence` is `hard` (of the cell that contains the
    /// range) or `virtual` (spread over the neighbouring cells). Returns an array (2, ρ, elevation, azimuth), float32: if a
    /// cell is empty, then if it is occupied.
    #[pyo3(signature = (ranges, *, sigma_m = 0.05, confidence = 1.0, evidence = "hard"))]
    fn likelihood<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        sigma_m: f64,
        confidence: f32,
        evidence: &str,
    ) -> PyResult<Bound<'py, PyArray4<f32>>> {
        if !(sigma_m > 0.0 && sigma_m.is_finite()) {
            return Err(wrong(format!("sigma_m is {sigma_m}, but it must be positive")));
        }
        let ranges = float32("ranges", "(elevation, azimuth)", ranges)?;
        let (readings, evidence) = (readings(&self.grid, &ranges, confidence)?, evidence_kind(evidence)?);
        let found = py.detach(|| self.state().sight.likelihood(&self.grid, &readings, sigma_m, evidence));
        let [rho, elevation, azimuth] = self.shape();
        PyArray1::from_vec(py, found.map_err(raised_by_map)?).reshape([2, rho, elevation, azimuth])
    }

    /// One step of the filter: prediction, then estimation from the likelihoods of some sensors, each an array (2, ρ,
    /// elevation, azimuth), float32, none negative; without any it is only predicted.
    #[pyo3(signature = (*likelihoods))]
    fn observe(&self, py: Python<'_>, likelihoods: Vec<Bound<'_, PyAny>>) -> PyResult<()> {
        let [rho, elevation, azimuth] = self.shape();
        let expected = [2, rho, elevation, azimuth];
        let mut all: Vec<map::Likelihood> = Vec::with_capacity(likelihoods.len());
        for likelihood in &likelihoods {
            let likelihood: PyReadonlyArray4<'_, f32> =
                float32("likelihood", "(empty and occupied, ρ, elevation, azimuth)", likelihood)?;
            let likelihood = likelihood.as_array();
            if likelihood.shape() != expected {
                return Err(wrong(format!(
                    "a likelihood has the shape {:?}, but the map needs {expected:?} (empty and occupied, ρ, \
                     elevation, azimuth)",
                    likelihood.shape()
                )));
            }
            if let Some(number) = likelihood.iter().find(|number| !(number.is_finite() && **number >= 0.0)) {
                return Err(wrong(format!(
                    "a likelihood contains {number}: give finite numbers, none negative"
                )));
            }
            all.push(likelihood.iter().copied().collect());
        }
        py.detach(|| self.state().map.observe(&all.iter().collect::<Vec<_>>())).map_err(raised_by_map)
    }

    /// One step of the filter from ranges: `observe(likelihood(ranges, …))`.
    #[pyo3(signature = (ranges, *, sigma_m = 0.05, confidence = 1.0, evidence = "hard"))]
    fn see(
        &self,
        py: Python<'_>,
        ranges: &Bound<'_, PyAny>,
        sigma_m: f64,
        confidence: f32,
        evidence: &str,
    ) -> PyResult<()> {
        let likelihood = self.likelihood(py, ranges, sigma_m, confidence, evidence)?;
        self.observe(py, vec![likelihood.into_any()])
    }

    /// The range of the nearest pixel in each direction of the map, m: an array (elevation, azimuth), float32, NaN where no
    /// pixel has a depth. `depth` is an image (row, column) of depths along the optical axis, m, float32; what is not
    /// positive or not finite has none. `focal_px` is (fx, fy), `centre_px` (cx, cy); the head is turned by `yaw` (rad to the
    /// left), then `pitch` (rad upwards), then `roll` (rad, right side down).
    #[pyo3(signature = (depth, *, focal_px, centre_px, yaw = 0.0, pitch = 0.0, roll = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn ranges<'py>(
        &self,
        py: Python<'py>,
        depth: &Bound<'py, PyAny>,
        focal_px: [f64; 2],
        centre_px: [f64; 2],
        yaw: f64,
        pitch: f64,
        roll: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let attitude = Attitude { yaw, pitch, roll, sd_yaw: 0.0 };
        let depth = float32("depth", "(row, column)", depth)?;
        let ranges = ranges_of_depth(&self.grid, &depth, (focal_px, centre_px), &attitude)?;
        PyArray1::from_vec(py, ranges).reshape(vec![self.grid.elevation_cells(), self.grid.azimuth_cells()])
    }

    /// The next gaze of the paper's rule (`bvm/models/gaze.bp`): the frontier cell with the steepest entropy, nearest to the
    /// heading among equals; `yaw`, rad to the left, is the heading.
    #[pyo3(signature = (yaw = 0.0))]
    fn gaze(&self, py: Python<'_>, yaw: f64) -> PyResult<Gaze> {
        finite(&[("yaw", yaw)])?;
        let chosen = py.detach(|| {
            let state = &mut *self.state();
            state.rule.choose(&state.map, &Heading { yaw })
        });
        chosen.map(Gaze::from).map_err(raised_by_map)
    }

    fn __repr__(&self) -> String {
        let [rho, elevation, azimuth] = self.shape();
        let edges = self.grid.edges_m();
        format!("<Map {rho} × {elevation} × {azimuth} cells, {} to {} m>", edges[0], edges[rho])
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("volumetric_map", (slf,))
    }
}

/// The disparity of each pixel of the left picture of a rectified pair, pixels, and its confidence, 0 to 1: two arrays
/// (row, column), float32; infinity with confidence 0 where there is no estimate. Pictures are (row, column), float32, grey
/// levels 0 to 255. `matcher` is `scanline` or `coherence`.
#[pyfunction]
#[pyo3(name = "_disparities", signature = (left, right, *, most, matcher = "scanline"))]
#[allow(clippy::type_complexity)]
pub(crate) fn disparities<'py>(
    py: Python<'py>,
    left: &Bound<'py, PyAny>,
    right: &Bound<'py, PyAny>,
    most: usize,
    matcher: &str,
) -> PyResult<(Bound<'py, PyArrayDyn<f32>>, Bound<'py, PyArrayDyn<f32>>)> {
    let matcher = match matcher {
        "scanline" => Matcher::Scanline,
        "coherence" => Matcher::Coherence,
        other => return Err(wrong(format!("there is no matcher `{other}`: give `scanline` or `coherence`"))),
    };
    let picture = |name: &str, pixels: &Bound<'py, PyAny>| {
        let pixels: PyReadonlyArray2<'_, f32> = float32(name, "(row, column)", pixels)?;
        let pixels = pixels.as_array();
        let (height, width) = pixels.dim();
        GreyImage::new(width, height, pixels.iter().copied().collect()).map_err(raised_by_map)
    };
    let (left, right) = (picture("left", left)?, picture("right", right)?);
    let found = py.detach(|| match_pair(&left, &right, most, matcher)).map_err(raised_by_map)?;
    let DisparityMap { width, height, disparity, confidence, .. } = found;
    let array = |numbers: Vec<f32>| PyArray1::from_vec(py, numbers).reshape(vec![height, width]);
    Ok((array(disparity)?, array(confidence)?))
}
