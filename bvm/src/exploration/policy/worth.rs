//! The worth of each direction, by the program of a policy.
//!
//! In: the map, and the looks since each direction was in view. Out: a worth for each direction, `[φ][θ]`. Where a
//! program answers for cells, the worth of a direction is the sum over its cells, or their largest where the program
//! chooses a single cell. Invariant: no worth is negative or NaN.

use super::Looks;
use crate::error::Error;
use crate::grid::Grid;
use crate::map::{Likelihood, Map};
use crate::programs::{attention, entropy_in_view, gaze, information_gain, inhibited, null, paper, readable};

/// The share of a sound's evidence that is left after a look.
const SOUND_LEFT: f32 = 0.7;

/// Features stay above 0, the end of the support of a Beta density, and below 1, where those of saliency have no bound.
const FEATURES: [f32; 2] = [0.001, 0.99];

/// The buffers of the programs.
#[derive(Clone, Debug)]
pub(super) struct Worth {
    directions: usize,
    readable: readable::readable::Answer<f32>,
    inhibited: inhibited::worth::Answer<f32>,
    paper: paper::look::Answer<f32>,
    gaze: gaze::look::Answer<f32>,
    null: null::worth::Answer<f32>,
    entropy: entropy_in_view::worth::Answer<f32>,
    information: information_gain::worth::Answer<f32>,
    attention: attention::attended::Answer<f32>,
    looks: Vec<f32>,
    reads: Vec<f32>,
    sums: Vec<f32>,
    sound: Vec<f32>,
}

impl Worth {
    pub(super) fn new(grid: &Grid) -> Self {
        Self {
            directions: grid.directions(),
            readable: Default::default(),
            inhibited: Default::default(),
            paper: Default::default(),
            gaze: Default::default(),
            null: Default::default(),
            entropy: Default::default(),
            information: Default::default(),
            attention: Default::default(),
            looks: Vec::new(),
            reads: Vec::new(),
            sums: Vec::new(),
            sound: vec![0.0; grid.directions()],
        }
    }

    /// `models/inhibited.bp`, summed over the cells of each direction, with `models/readable.bp` of the counts of looks with a
    /// reading and without.
    pub(super) fn inhibited(
        &mut self,
        map: &Map,
        looks: &Looks,
        [readings, silent]: &[Vec<f32>; 2],
    ) -> Result<&[f32], Error> {
        let question = readable::readable().directions(self.directions);
        question.readings(readings).silent(silent).run_into(&mut self.readable)?;
        self.looks.clear();
        self.reads.clear();
        for _ in 0..map.grid().cells_rho() {
            self.looks.extend_from_slice(looks.since());
            self.reads.extend_from_slice(self.readable.p());
        }
        inhibited::worth(map.space())
            .map_p_o_c(map.occupancy())
            .map_h(map.entropy())
            .looks(&self.looks)
            .reads(&self.reads)
            .run_into(&mut self.inhibited)?;
        self.sums.clear();
        self.sums.resize(self.directions, 0.0);
        for shell in self.inhibited.scores().chunks(self.directions) {
            self.sums.iter_mut().zip(shell).for_each(|(sum, score)| *sum += score);
        }
        Ok(&self.sums)
    }

    /// `models/paper.bp`: the best cell of each direction, and its distance in metres.
    pub(super) fn paper(&mut self, map: &Map) -> Result<(Vec<f32>, Vec<f64>), Error> {
        paper::look(map.space()).map_p_o_c(map.occupancy()).map_h(map.entropy()).run_into(&mut self.paper)?;
        let edges = map.grid().edges_m();
        let (mut most, mut ranges) = (vec![0.0; self.directions], vec![0.0; self.directions]);
        for (depth, shell) in self.paper.scores().chunks(self.directions).enumerate() {
            for ((most, range), score) in most.iter_mut().zip(&mut ranges).zip(shell) {
                if *score > *most {
                    (*most, *range) = (*score, (edges[depth] * edges[depth + 1]).sqrt());
                }
            }
        }
        Ok((most, ranges))
    }

    /// `models/entropy_in_view.bp`.
    pub(super) fn entropy_in_view(&mut self, map: &Map) -> Result<&[f32], Error> {
        let velocities = crate::map::VELOCITIES.len();
        entropy_in_view::worth()
            .rays(self.directions)
            .n(map.grid().cells_rho())
            .occupied(map.occupancy())
            .entropy(map.entropy())
            // A little above ln 14, by which rounding may exceed it.
            .most(1.001 * (2.0 * velocities as f64).ln())
            .run_into(&mut self.entropy)?;
        Ok(self.entropy.p())
    }

    /// `models/information_gain.bp`.
    pub(super) fn information_gain(&mut self, map: &Map) -> Result<&[f32], Error> {
        information_gain::worth()
            .rays(self.directions)
            .n(map.grid().cells_rho())
            .occupied(map.occupancy())
            .run_into(&mut self.information)?;
        Ok(self.information.entropy())
    }

    /// `models/null.bp`.
    pub(super) fn null(&mut self, looks: &Looks) -> Result<&[f32], Error> {
        null::worth().directions(self.directions).looks(looks.since()).run_into(&mut self.null)?;
        Ok(self.null.scores())
    }

    /// `models/attention.bp`.
    pub(super) fn attention(
        &mut self,
        map: &Map,
        looks: &Looks,
        heard: Option<&Likelihood>,
    ) -> Result<&[f32], Error> {
        gaze::look(map.space()).map_p_o_c(map.occupancy()).map_h(map.entropy()).run_into(&mut self.gaze)?;
        let uncertainty = normalised(self.most(self.gaze.scores()));
        let (cells, still) = (map.grid().cells(), &map.velocity()[..map.grid().cells()]);
        let moving = map.occupancy().iter().zip(still).map(|(occupied, still)| occupied * (1.0 - still));
        let motion = self.most(&moving.collect::<Vec<f32>>());
        self.sound.iter_mut().for_each(|sound| *sound *= SOUND_LEFT);
        if let Some(heard) = heard {
            // How much more likely the sound is if the cell is a source.
            let ratio = (0..cells)
                .map(|cell| (heard[cells + cell] / heard[cell].max(f32::MIN_POSITIVE) - 1.0).max(0.0));
            let now = normalised(self.most(&ratio.collect::<Vec<f32>>()));
            self.sound.iter_mut().zip(&now).for_each(|(sound, now)| *sound = sound.max(*now));
        }
        let clamped = |values: &[f32]| {
            values.iter().map(|value| value.clamp(FEATURES[0], FEATURES[1])).collect::<Vec<f32>>()
        };
        null::worth().directions(self.directions).looks(looks.since()).run_into(&mut self.null)?;
        let recent: Vec<f32> =
            self.null.scores().iter().map(|fresh| (1.0 - fresh).clamp(FEATURES[0], 0.999)).collect();
        attention::attended()
            .directions(self.directions)
            .uncertainty(&clamped(&uncertainty))
            .motion(&clamped(&motion))
            .sound(&clamped(&self.sound))
            .recent(&recent)
            .run_into(&mut self.attention)?;
        Ok(self.attention.p())
    }

    /// The largest value of each direction.
    fn most(&self, cells: &[f32]) -> Vec<f32> {
        let mut most = vec![0f32; self.directions];
        for shell in cells.chunks(self.directions) {
            most.iter_mut().zip(shell).for_each(|(most, value)| *most = most.max(*value));
        }
        most
    }
}

/// Divided by the largest, unless all are 0.
fn normalised(mut values: Vec<f32>) -> Vec<f32> {
    let most = values.iter().copied().fold(0.0, f32::max);
    if most > 0.0 {
        values.iter_mut().for_each(|value| *value /= most);
    }
    values
}
