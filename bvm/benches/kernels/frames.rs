//! Frames of range sensors fused into a map, at the resolution of voxel mappers.
//!
//! In: ranges in metres (f32), from the files named by `FRAME_SPHERE` (360 × 90 directions, \[φ\]\[θ\]) and
//! `FRAME_CAMERA` (640 × 480 pixels), or else of the embedded world. Out: the time of a frame, of occupancy alone and
//! with motion. Invariant: the programs are the map's own; occupancy alone is the cell program whose only velocity is
//! 0.

use crate::clock::{Task, Work, table};
use bp_core::compiler::space::{Edge, Space};
use bvm::grid::{Grid, GridConfiguration};
use bvm::map::VELOCITIES;
use bvm::programs::{cell, line_of_sight};
use bvm::vision::{EvidenceKind, RangeReading, Sight};
use bvm::world::World;
use std::hint::black_box;

/// Standard deviation of a reading, m.
const SIGMA_M: f64 = 0.02;

/// The camera: pixels, focal length in pixels; ranges are cut off at this one, m.
const CAMERA: ([usize; 2], f64, f32) = ([640, 480], 554.0, 5.0);

/// Columns and rows of directions in the camera's field of view, half a degree each; cells along each, from half a metre.
const FIELD: ([usize; 2], usize, f32) = ([120, 94], 46, 0.5);

/// Prints the rows.
pub(crate) fn run(seconds: f64) {
    sphere(seconds);
    camera(seconds);
}

/// 32 400 directions all around, to 2.5 m, into 10 cells of each.
fn sphere(seconds: f64) {
    let grid = Grid::new(GridConfiguration::personal_space()).expect("a grid");
    let farthest = grid.configuration().rho_max_m as f32;
    let directions = grid.all_directions().map(|direction| grid.direction_centre(direction));
    let ranges = ranges("FRAME_SPHERE", &directions.collect::<Vec<_>>());
    // A range beyond the grid means free space up to its end.
    let reading = |range: f32| RangeReading { range_m: range.min(2.0 * farthest), confidence: 1.0 };
    let readings: Vec<Option<RangeReading>> = ranges.into_iter().map(|range| Some(reading(range))).collect();
    let extents = [grid.cells_rho(), grid.elevation_cells(), grid.azimuth_cells()];
    let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle]).expect("a grid");
    let mut states =
        [1, VELOCITIES.len()].map(|velocities| (State::new(&space, velocities), Sight::default()));
    let frame = |(state, sight): &mut (State, Sight)| {
        let likelihood =
            sight.likelihood(&grid, &readings, SIGMA_M, EvidenceKind::Hard).expect("as many as directions");
        state.estimate(&space, &likelihood);
    };
    states.iter_mut().for_each(frame);
    let [still, moving] = &mut states;
    // Cells nearer than the range by three deviations are probably empty.
    for (direction, reading) in readings.iter().flatten().enumerate() {
        for depth in 0..grid.cells_rho() {
            let cell = depth * grid.directions() + direction;
            if grid.edges_m()[depth + 1] < f64::from(reading.range_m) - 3.0 * SIGMA_M {
                assert!(
                    still.0.now.distribution_o()[cell] > 0.5,
                    "cell {cell} is before a range of {}",
                    reading.range_m
                );
            }
        }
    }
    let mut tasks: Vec<Task<'_>> = vec![
        ("occupancy", Box::new(|| frame(black_box(still)))),
        ("occupancy and motion", Box::new(|| frame(black_box(moving)))),
    ];
    let title = "a frame: 32 400 ranges into 324 000 cells";
    table(&Work { title, bytes: 0, unit: ("ms", 1e3) }, 2.0 * seconds, &mut tasks);
}

/// 307 200 pixels to 5 m: the nearest of each direction, into 46 cells of 5 % of the range.
fn camera(seconds: f64) {
    let ([width, height], focal, farthest) = CAMERA;
    let ([columns, rows], cells, nearest) = FIELD;
    let rays = rows * columns;
    let angles = |pixel: usize| {
        let [x, y] = [pixel % width, pixel / width].map(|at| at as f64);
        let (left, up) = ((319.5 - x) / focal, (239.5 - y) / focal);
        (left.atan(), (up / left.hypot(1.0)).atan())
    };
    let directions: Vec<(f64, f64)> = (0..width * height).map(angles).collect();
    let ranges = ranges("FRAME_CAMERA", &directions);
    // The camera does not turn in its own frame: the directions of its pixels are computed once.
    let column = |angle: f64, count: usize| {
        ((angle.to_degrees() * 2.0 + count as f64 / 2.0).floor().max(0.0) as usize).min(count - 1)
    };
    let place: Vec<u32> = (directions.iter())
        .map(|(azimuth, elevation)| (column(*elevation, rows) * columns + column(*azimuth, columns)) as u32)
        .collect();
    let space = Space::new([cells, rows, columns], [Edge::Open; 3]).expect("a grid");
    let ln_b = (farthest / nearest).ln() / cells as f32;
    let mut state = State::new(&space, 1);
    let mut answer = line_of_sight::reading::Answer::default();
    let (mut rho, lambda) = (vec![0.0f32; rays], vec![1.0f32; rays]);
    let mut z = vec![0.0f32; rays];
    let mut frame = || {
        rho.fill(f32::INFINITY);
        for (place, range) in place.iter().zip(black_box(&ranges)) {
            let held = &mut rho[*place as usize];
            *held = held.min(*range);
        }
        for (z, rho) in z.iter_mut().zip(&mut rho) {
            *rho = rho.min(2.0 * farthest);
            let bin = ((*rho / nearest).ln() / ln_b).ceil().max(1.0);
            *z = if bin > cells as f32 { 0.0 } else { bin };
        }
        let inputs = line_of_sight::reading()
            .rays(rays)
            .n(cells)
            .z(&z)
            .sigma_min(SIGMA_M)
            .ln_b(f64::from(ln_b))
            .lambda(&lambda)
            .rho(&rho);
        inputs.run_into(&mut answer).expect("it fits");
        state.estimate(&space, answer.distribution());
    };
    let mut tasks: Vec<Task<'_>> = vec![("occupancy", Box::new(&mut frame))];
    let title = format!("a frame: 640 x 480 ranges into {} cells", space.cells());
    table(&Work { title: &title, bytes: 0, unit: ("ms", 1e3) }, seconds, &mut tasks);
}

/// A map that is estimated repeatedly.
struct State {
    velocities: usize,
    now: cell::step::Answer<f32>,
    next: cell::step::Answer<f32>,
}

impl State {
    fn new(space: &Space, velocities: usize) -> Self {
        let mut now = cell::step::Answer::default();
        *now.distribution_o_mut() = vec![0.5; 2 * space.cells()];
        *now.distribution_v_mut() = vec![1.0 / velocities as f32; velocities * space.cells()];
        Self { velocities, now, next: cell::step::Answer::default() }
    }

    fn estimate(&mut self, space: &Space, likelihood: &[f32]) {
        let moves = space.antecedents(&VELOCITIES[..self.velocities]);
        let motion = vec![1.0 / self.velocities as f32; self.velocities];
        cell::step(space, &moves)
            .sensors(1)
            .epsilon(0.01)
            .motion(&motion)
            .previous_o(self.now.distribution_o())
            .previous_v(self.now.distribution_v())
            .sensors_i_reading(likelihood)
            .run_into(&mut self.next)
            .expect("it fits");
        std::mem::swap(&mut self.now, &mut self.next);
    }
}

/// The range along each direction, m; infinite where there is no surface.
fn ranges(variable: &str, directions: &[(f64, f64)]) -> Vec<f32> {
    let Ok(path) = std::env::var(variable) else {
        let world = World::embedded(0);
        return directions.iter().map(|direction| world.range(*direction, 0.0) as f32).collect();
    };
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{variable}: {path}: {error}"));
    let numbers = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let ranges: Vec<f32> = numbers.collect();
    assert_eq!(ranges.len(), directions.len(), "{path}: one range for each direction");
    ranges
}
