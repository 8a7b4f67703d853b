//! The Bayesian Volumetric Map: a log-spherical grid whose cells are filtered by `models/cell.bp`.
//!
//! In: for each sensor, the likelihood of its reading given that a cell is empty or occupied. Out: P(O), P(V) and the
//! entropies of every cell. Invariant: the map is fixed in the world; sensor data are placed at the exact angle of the
//! head ([`Heading`]), so that a turn does not resample the map. A map in the axes of the head is moved by [`shift`], and a map
//! whose head goes to another place by [`translation`]. [`clock`] says to which instant a sample belongs.
//!
//! Layout: \[value\]\[ρ\]\[φ\]\[θ\], θ contiguous (see [`crate::grid`]).

pub mod clock;
mod heading;
mod joint;
pub mod shift;
pub mod translation;

pub use heading::Heading;

use crate::error::Error;
use crate::grid::Grid;
use crate::programs::{cell, change};
use bp_core::compiler::exec::compiled::Report;
use bp_core::compiler::space::{Edge, Moves, Space};
use joint::Joint;
use rayon::prelude::*;

/// The possible displacements of a cell's content in a step, along (ρ, φ, θ).
pub const VELOCITIES: [[i32; 3]; 7] =
    [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];

/// The least P(O = 1) with which a cell counts as occupied, in figures, files and reports alike: hearing alone raises cells that
/// were never seen a little above one half.
pub const OCCUPIED: f32 = 0.55;

/// The likelihood of a sensor's reading for each cell: if the cell is empty, then if it is occupied, each by
/// \[ρ\]\[φ\]\[θ\]. Ones where the reading is uninformative.
pub type Likelihood = Vec<f32>;

/// The map.
#[derive(Clone, Debug)]
pub struct Map {
    grid: Grid,
    space: Space,
    moves: Moves,
    motion: Vec<f32>,
    /// That the occupancy of a cell changes in a step.
    epsilon: f64,
    /// P(O) and P(V) of the last step, and the entropies.
    state: cell::observe::Answer<f32>,
    /// The buffer of the next step.
    next: cell::observe::Answer<f32>,
    readings: Vec<f32>,
    /// P(O | V), if the joint distribution is carried.
    joint: Option<Joint>,
}

impl Map {
    /// An empty map: every cell unknown.
    ///
    /// # Errors
    /// A grid that has poles over an odd number of azimuth cells.
    pub fn new(grid: Grid) -> Result<Self, Error> {
        let extents = [grid.cells_rho(), grid.elevation_cells(), grid.azimuth_cells()];
        let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle])?;
        let moves = space.antecedents(&VELOCITIES);
        let (cells, motions) = (grid.cells(), VELOCITIES.len());
        let still = cell::DEFAULT_STILL as f32;
        let motion: Vec<f32> = (VELOCITIES.iter())
            .map(|velocity| if *velocity == [0; 3] { still } else { (1.0 - still) / (motions - 1) as f32 })
            .collect();
        let unknown = 2f32.ln() - motion.iter().map(|p| p * p.ln()).sum::<f32>();
        let mut state = cell::observe::Answer::default();
        *state.distribution_o_mut() = vec![0.5; 2 * cells];
        *state.distribution_v_mut() = motion.iter().flat_map(|p| std::iter::repeat_n(*p, cells)).collect();
        *state.entropy_o_v_mut() = vec![unknown; cells];
        *state.entropy_o_mut() = vec![2f32.ln(); cells];
        let next = cell::observe::Answer::default();
        let epsilon = cell::DEFAULT_EPSILON;
        Ok(Self { grid, space, moves, motion, epsilon, state, next, readings: Vec::new(), joint: None })
    }

    /// An empty map that carries the joint distribution of O and V of each cell, not the paper's two marginals.
    ///
    /// # Errors
    /// Those of [`Map::new`].
    pub fn with_joint(grid: Grid) -> Result<Self, Error> {
        let joint = Some(Joint::unknown(&grid)?);
        Ok(Self { joint, ..Self::new(grid)? })
    }

    /// The next step stands for some seconds: how much is forgotten in it, by `models/change.bp`. Without this a step has the
    /// `epsilon` of `models/cell.bp`, whatever time it stands for.
    ///
    /// # Errors
    /// A time that is negative or no number.
    pub fn after(&mut self, seconds: f64) -> Result<(), Error> {
        self.epsilon = change::change().dt(seconds).ask()?.p();
        Ok(())
    }

    /// One step of the filter: prediction by constant velocity, estimation from the sensors' likelihoods. A cell whose
    /// sensors contradict each other, so that no state is possible, is only predicted.
    ///
    /// # Errors
    /// A likelihood of the wrong length.
    pub fn observe(&mut self, likelihoods: &[&Likelihood]) -> Result<(), Error> {
        self.readings.clear();
        likelihoods.iter().for_each(|likelihood| self.readings.extend_from_slice(likelihood));
        if likelihoods.is_empty() {
            self.readings.resize(2 * self.grid.cells(), 1.0);
        }
        let mut next = std::mem::take(&mut self.next);
        let readings = std::mem::take(&mut self.readings);
        let report = self.step(likelihoods.len().max(1), &readings, &mut next);
        self.readings = readings;
        let report = report?;
        let cells = self.grid.cells();
        if report.impossible > 0 {
            let (empty, occupied) = (next.p_o(false), next.p_o(true));
            let is_possible = |cell: &usize| empty[*cell] + occupied[*cell] > 0.5;
            let impossible: Vec<usize> = (0..cells).filter(|cell| !is_possible(cell)).collect();
            let mut predicted = cell::observe::Answer::default();
            let carried = self.joint.as_mut().map(Joint::take);
            self.step(1, &vec![1.0; 2 * cells], &mut predicted)?;
            if let Some((joint, carried)) = self.joint.as_mut().zip(carried) {
                joint.put_back(carried, &impossible);
            }
            let copy = |to: &mut [f32], from: &[f32]| {
                for (to, from) in to.chunks_exact_mut(cells).zip(from.chunks_exact(cells)) {
                    impossible.iter().for_each(|cell| to[*cell] = from[*cell]);
                }
            };
            copy(next.distribution_o_mut(), predicted.distribution_o());
            copy(next.distribution_v_mut(), predicted.distribution_v());
            copy(next.entropy_o_v_mut(), predicted.entropy_o_v());
            copy(next.entropy_o_mut(), predicted.entropy_o());
        }
        if let Some(joint) = &mut self.joint {
            joint.accept();
        }
        self.next = std::mem::replace(&mut self.state, next);
        Ok(())
    }

    /// The program's question, for the current state.
    fn step(
        &mut self,
        sensors: usize,
        readings: &[f32],
        next: &mut cell::observe::Answer<f32>,
    ) -> Result<Report, Error> {
        if let Some(joint) = &mut self.joint {
            let velocity = self.state.distribution_v();
            return joint.step((self.epsilon, &self.motion), velocity, (sensors, readings), next);
        }
        let question = cell::observe(&self.space, &self.moves).epsilon(self.epsilon).motion(&self.motion);
        let before = question.previous_o(self.state.distribution_o()).previous_v(self.state.distribution_v());
        Ok(before.sensors(sensors).sensors_i_reading(readings).run_into(next)?)
    }

    /// All numbers of the state: P(O), P(V), H(O, V), H(O), each by cell; then P(O | V), if it is carried.
    pub fn numbers(&self) -> Vec<f32> {
        let state = &self.state;
        let lean = self.joint.as_ref().map_or(&[][..], |joint| &joint.lean);
        [state.distribution_o(), state.distribution_v(), state.entropy_o_v(), state.entropy_o(), lean]
            .concat()
    }

    /// The map with these [`Map::numbers`]; `None` if they are not as many as this map has, or no probabilities.
    pub fn with_numbers(&self, numbers: &[f32]) -> Option<Self> {
        let mut map = self.clone();
        let probabilities = map.state.distribution_o().len() + map.state.distribution_v().len();
        let fits = numbers.len() == map.numbers().len()
            && numbers.iter().all(|number| number.is_finite())
            && numbers[..probabilities].iter().all(|p| (0.0..=1.0).contains(p));
        if !fits {
            return None;
        }
        let (of_o, rest) = numbers.split_at(map.state.distribution_o().len());
        let (of_v, rest) = rest.split_at(map.state.distribution_v().len());
        let (both, rest) = rest.split_at(map.grid.cells());
        let (occupancy, lean) = rest.split_at(map.grid.cells());
        map.state.distribution_o_mut().copy_from_slice(of_o);
        map.state.distribution_v_mut().copy_from_slice(of_v);
        map.state.entropy_o_v_mut().copy_from_slice(both);
        map.state.entropy_o_mut().copy_from_slice(occupancy);
        if let Some(joint) = &mut map.joint {
            joint.lean.copy_from_slice(lean);
        }
        Some(map)
    }

    /// Moves the content of the directions: what is now in direction d was in direction `from[d]`; `None`: it is unknown
    /// ([`shift::by_columns`], [`shift::paper`]).
    pub fn shift(&mut self, from: &[Option<usize>]) {
        let unknown = self.unknown();
        self.each_shell(|value, before, now| {
            let own = |from: &Option<usize>| from.map_or(unknown[value], |from| before[from]);
            now.iter_mut().zip(from).for_each(|(now, from)| *now = own(from));
        });
    }

    /// Resamples the content of the directions after a rotation of the head. Velocities keep their axes.
    pub fn resample(&mut self, resampling: &shift::Resampling) {
        self.weigh_lean();
        self.each_shell(|value, before, now| match value {
            // P(O): the occupied solid angle is kept.
            0 | 1 => resampling.apply_to_probabilities(before, now),
            _ => resampling.apply(before, now),
        });
        self.mixed();
    }

    /// Moves the map to the place of a head that moved by `step`, m, in the axes of the map ([`translation`]). Velocities keep
    /// their axes; what was outside the grid is unknown.
    pub fn translate(&mut self, step: [f64; 3]) {
        self.weigh_lean();
        let (cells, unknown) = (self.grid.cells(), self.unknown());
        let from: Vec<Option<translation::Shares>> = (0..cells)
            .into_par_iter()
            .map(|at| translation::shares(&self.grid, self.grid.cell(at)?, step))
            .collect();
        let move_planes = |numbers: &mut [f32], unknown: &[f32]| {
            numbers.par_chunks_exact_mut(cells).zip(unknown).for_each(|(plane, unknown)| {
                let before = plane.to_vec();
                for (now, from) in plane.iter_mut().zip(&from) {
                    let mixed = |shares: &translation::Shares| {
                        shares.iter().map(|(at, share)| share * before[*at]).sum::<f32>()
                    };
                    *now = from.as_ref().map_or(*unknown, mixed);
                }
            });
        };
        move_planes(self.state.distribution_o_mut(), &unknown[..2]);
        move_planes(self.state.distribution_v_mut(), &unknown[2..]);
        if let Some(joint) = &mut self.joint {
            move_planes(&mut joint.lean, &[0.0; VELOCITIES.len()]);
        }
        self.mixed();
    }

    /// P(O | V) − ½ times P(V): what mixes linearly, beside P(V).
    fn weigh_lean(&mut self) {
        if let Some(joint) = &mut self.joint {
            joint.lean.iter_mut().zip(self.state.distribution_v()).for_each(|(lean, p)| *lean *= p);
        }
    }

    /// After cells were mixed: P(O | V) again, and the entropies; that of O and V together, as the next step reads them:
    /// independent.
    fn mixed(&mut self) {
        if let Some(joint) = &mut self.joint {
            let divide = |(lean, p): (&mut f32, &f32)| {
                *lean = if *p > 0.0 { (*lean / p).clamp(-0.5, 0.5) } else { 0.0 }
            };
            joint.lean.iter_mut().zip(self.state.distribution_v()).for_each(divide);
        }
        let cells = self.grid.cells();
        let entropy_of = |distribution: &[f32], cell: usize| {
            let term = |p: &f32| if *p > 0.0 { -p * p.ln() } else { 0.0 };
            distribution.iter().skip(cell).step_by(cells).map(term).sum::<f32>()
        };
        let of_o: Vec<f32> = (0..cells).map(|cell| entropy_of(self.state.distribution_o(), cell)).collect();
        let both = |(cell, own): (usize, &f32)| own + entropy_of(self.state.distribution_v(), cell);
        let of_both: Vec<f32> = of_o.iter().enumerate().map(both).collect();
        *self.state.entropy_o_mut() = of_o;
        *self.state.entropy_o_v_mut() = of_both;
    }

    /// The numbers of an unknown cell: P(O) by value, P(V) by velocity, H(O, V), H(O), P(O | V) − ½ by velocity.
    fn unknown(&self) -> Vec<f32> {
        let both = 2f32.ln() - self.motion.iter().map(|p| p * p.ln()).sum::<f32>();
        let marginals = [0.5; 2].into_iter().chain(self.motion.iter().copied()).chain([both, 2f32.ln()]);
        marginals.chain([0.0; VELOCITIES.len()]).collect()
    }

    /// Rewrites each shell of each number of the state; `value` counts the numbers as [`Map::unknown`] does.
    fn each_shell(&mut self, mut rewrite: impl FnMut(usize, &[f32], &mut [f32])) {
        let (directions, cells) = (self.grid.directions(), self.grid.cells());
        let mut value = 0;
        let mut before = vec![0.0; directions];
        let mut numbers = |array: &mut Vec<f32>| {
            for plane in array.chunks_exact_mut(cells) {
                for shell in plane.chunks_exact_mut(directions) {
                    before.copy_from_slice(shell);
                    rewrite(value, &before, shell);
                }
                value += 1;
            }
        };
        numbers(self.state.distribution_o_mut());
        numbers(self.state.distribution_v_mut());
        numbers(self.state.entropy_o_v_mut());
        numbers(self.state.entropy_o_mut());
        if let Some(joint) = &mut self.joint {
            numbers(&mut joint.lean);
        }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The grid in the form that kernels take.
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// P(O = 1) of each cell.
    pub fn occupancy(&self) -> &[f32] {
        self.state.p_o(true)
    }

    /// P(V = v) of each cell, by \[velocity\]\[ρ\]\[φ\]\[θ\].
    pub fn velocity(&self) -> &[f32] {
        self.state.distribution_v()
    }

    /// H(O, V) of each cell, in nats (paper, Eq. 5).
    pub fn entropy(&self) -> &[f32] {
        self.state.entropy_o_v()
    }

    /// H(O) of each cell, in nats.
    pub fn occupancy_entropy(&self) -> &[f32] {
        self.state.entropy_o()
    }
}
