//! Paths of particles: smoothing, and the most probable of the drawn paths.
//!
//! In: the particles of all instants, each with the one that it continues. Out: draws of each instant given all observations.
//! Invariant: the particles carry values only, so that a path is a list of values; a path of ancestors follows the law of all
//! instants, and a refreshed one too.
//!
//! Backward simulation: given x at t + 1, particle i of instant t is kept with probability proportional to Wᵢ p(xₜ₊₁ | xᵢ)
//! (Godsill, Doucet and West, *JASA* 99:156-168, 2004), here by a few Metropolis–Hastings steps that start from the ancestor and
//! propose from W (Bunch and Godsill, *IEEE Transactions on Signal Processing* 61:962-974, 2013). Where the transition has no
//! density, no other particle leads to xₜ₊₁, and the path is that of the ancestors (Kitagawa 1996).
//!
//! Paths share particles at many instants, so that one run does not show its own error: it is the scatter of independent runs.

use super::{Cloud, Guide, Moves};
use crate::distribution::Instance;
use crate::error::Error;
use crate::ids::Id;
use crate::progress;
use crate::sample::{Draws, Sampling, Streams};
use crate::strategies::over_time::Instant;
use rand::RngExt;
use rayon::prelude::*;

/// The steps that refresh a particle of a path.
const REFRESHES: usize = 8;

/// The runs whose scatter is the error, which together have as many particles as the answer; and the fewest particles of each.
const REPEATS: usize = 16;
const LEAST: usize = 50;

/// The particles of an instant.
#[derive(Debug)]
struct Snapshot {
    /// The values of all slots, particle by particle.
    values: Vec<f64>,
    ln_weights: Vec<f64>,
    parents: Vec<u32>,
    origins: Vec<u32>,
}

/// The particles of all instants.
#[derive(Debug)]
pub(crate) struct Paths {
    slots: usize,
    instants: Vec<Snapshot>,
}

/// The values of some slots at an instant, path by path.
pub(crate) struct Path {
    pub(crate) draws: Draws,
    /// The effective number of independent paths.
    pub(crate) effective: f64,
}

impl Paths {
    pub(crate) fn new(slots: usize) -> Self {
        Self { slots, instants: Vec::new() }
    }

    /// Keeps the particles of one more instant; those of a new first one replace all.
    pub(crate) fn record(&mut self, cloud: &Cloud) {
        if cloud.effective.len() == 1 {
            self.instants.clear();
        }
        self.instants.push(Snapshot {
            values: cloud.particles.iter().flat_map(|particle| particle.values.iter().copied()).collect(),
            ln_weights: cloud.ln_weights.clone(),
            parents: cloud.parents.clone(),
            origins: cloud.origins.clone(),
        });
    }

    fn values(&self, instant: usize, particle: usize) -> &[f64] {
        &self.instants[instant].values[particle * self.slots..(particle + 1) * self.slots]
    }

    /// The values of some slots of some particles of an instant.
    fn at(&self, instant: usize, particles: &[usize], slots: &[usize]) -> Vec<f64> {
        let of = |particle: &usize| {
            let values = self.values(instant, *particle);
            slots.iter().map(|slot| values[*slot]).collect::<Vec<f64>>()
        };
        particles.iter().flat_map(of).collect()
    }

    /// The values of some slots at each instant along a path.
    fn along(&self, path: &[usize], slots: &[usize]) -> Vec<Vec<f64>> {
        path.iter().enumerate().map(|(instant, particle)| self.at(instant, &[*particle], slots)).collect()
    }
}

impl Moves<'_> {
    /// Draws of some slots at each instant, given all observations; and by which the paths were guided.
    ///
    /// # Errors
    /// Numbers outside the range that a form accepts.
    pub(crate) fn smoothed(
        &self,
        paths: &Paths,
        slots: &[usize],
        (instants, guide): (&[Instant], Option<&Guide>),
    ) -> Result<Vec<Path>, Error> {
        let chosen = self.backward(paths)?;
        let particles = chosen[0].len();
        let repeats = self.repeats((instants, guide), slots, particles)?;
        let path = |(instant, own): (usize, &Vec<usize>)| {
            let origins = own.iter().map(|particle| paths.instants[instant].origins[*particle]).collect();
            let values = paths.at(instant, own, slots);
            let draws = Draws::weighted(values, slots.len(), &vec![0.0; particles]).of_origins(origins);
            let of_repeats = repeats.iter().map(|repeat| repeat[instant].as_slice());
            let draws = draws.with_repeats(of_repeats.collect());
            Path { effective: draws.effective(), draws }
        };
        Ok(chosen.iter().enumerate().map(path).collect())
    }

    /// The values of some slots at each instant in independent runs.
    fn repeats(
        &self,
        (instants, guide): (&[Instant], Option<&Guide>),
        slots: &[usize],
        particles: usize,
    ) -> Result<Vec<Vec<Vec<f64>>>, Error> {
        let particles = (particles / REPEATS).max(LEAST).min(particles);
        let seeds = Streams::new(self.sampling.seed, "repeats");
        let mut all = Vec::with_capacity(REPEATS);
        for number in 0..REPEATS {
            if progress::is_stopped() {
                break;
            }
            let sampling = Sampling { particles, seed: seeds.stream(number).random() };
            let moves = Moves { sampling, ..self.clone() };
            let mut paths = Paths::new(self.setting.slots());
            let followed = moves.follow_by(instants, guide, particles, &mut |cloud| paths.record(cloud))?;
            // A run in which no particle agrees with the observations has no values.
            if followed.is_ok() && paths.instants.len() == instants.len() {
                let chosen = moves.backward(&paths)?;
                let at = |(instant, own): (usize, &Vec<usize>)| paths.at(instant, own, slots);
                all.push(chosen.iter().enumerate().map(at).collect());
            }
        }
        Ok(all)
    }

    /// For each instant the particle of each path.
    fn backward(&self, paths: &Paths) -> Result<Vec<Vec<usize>>, Error> {
        let last = paths.instants.len() - 1;
        let count = paths.instants[last].ln_weights.len();
        let streams = Streams::new(self.sampling.seed, "paths");
        let ends = Chooser::of(&paths.instants[last].ln_weights);
        let uniform: f64 = streams.stream(usize::MAX).random();
        let end = |path: usize| ends.at((path as f64 + uniform) / count as f64);
        let mut chosen = vec![(0..count).map(end).collect::<Vec<usize>>()];
        let moving = self.moving();
        let refreshed = !moving.iter().any(|it| self.setting.model.factors[it.factor].form.has_point());
        for instant in (0..last).rev() {
            let (later, weights) =
                (&chosen[chosen.len() - 1], Chooser::of(&paths.instants[instant].ln_weights));
            let one = |(path, after): (usize, &usize)| -> Result<usize, Error> {
                let mut own = paths.instants[instant + 1].parents[*after] as usize;
                if !refreshed {
                    return Ok(own);
                }
                let mut random = streams.stream(instant * count + path);
                let mut values = paths.values(instant + 1, *after).to_vec();
                let mut ln = self.ln_transition(&moving, paths.values(instant, own), &mut values)?;
                for _ in 0..REFRESHES {
                    let other = weights.at(random.random());
                    let ln_other = self.ln_transition(&moving, paths.values(instant, other), &mut values)?;
                    if random.random::<f64>().ln() < ln_other - ln {
                        (own, ln) = (other, ln_other);
                    }
                }
                Ok(own)
            };
            let earlier = later.par_iter().enumerate().map(one).collect::<Result<Vec<usize>, Error>>()?;
            chosen.push(earlier);
        }
        chosen.reverse();
        Ok(chosen)
    }

    /// The instances of an instant that depend on X^-1.
    fn moving(&self) -> Vec<&Instance> {
        let moves = |instance: &&Instance| {
            let read = self.setting.reads(instance);
            let matters = self.relevant[self.setting.variable_of(instance.left[0]).position()];
            matters && self.carried.iter().any(|(_, before)| read.contains(before))
        };
        self.now.iter().filter(moves).collect()
    }

    /// ln p(the values of an instant | those of the one before), up to factors that do not depend on the latter.
    fn ln_transition(&self, moving: &[&Instance], before: &[f64], values: &mut [f64]) -> Result<f64, Error> {
        self.carried.iter().for_each(|(now, previous)| values[*previous] = before[*now]);
        moving.iter().map(|instance| self.setting.ln_density(instance, values)).sum()
    }

    /// The values of some slots at each instant along the most probable of the paths of the particles: with the largest density
    /// together with the observations.
    ///
    /// # Errors
    /// Numbers outside the range that a form accepts.
    pub(crate) fn most_probable(&self, paths: &Paths, slots: &[usize]) -> Result<Vec<Vec<f64>>, Error> {
        let last = paths.instants.len() - 1;
        let mut ln: Vec<f64> = Vec::new();
        for (instant, snapshot) in paths.instants.iter().enumerate() {
            let setting = if instant == 0 { &self.first } else { &self.setting };
            let instances: Vec<&Instance> = if instant == 0 {
                self.before.iter().chain(&self.now).collect()
            } else {
                self.now.iter().collect()
            };
            let of = |particle: usize| -> Result<f64, Error> {
                // A particle of weight zero has no values.
                if snapshot.ln_weights[particle] == f64::NEG_INFINITY {
                    return Ok(f64::NEG_INFINITY);
                }
                let values = paths.values(instant, particle);
                let earlier = if instant == 0 { 0.0 } else { ln[snapshot.parents[particle] as usize] };
                let matters = |it: &&&Instance| self.relevant[setting.variable_of(it.left[0]).position()];
                let own = instances.iter().filter(matters).map(|it| setting.ln_density(it, values));
                Ok(earlier + own.sum::<Result<f64, Error>>()?)
            };
            ln = (0..snapshot.ln_weights.len()).into_par_iter().map(of).collect::<Result<_, Error>>()?;
        }
        let best = (0..ln.len()).max_by(|one, other| ln[*one].total_cmp(&ln[*other]));
        let mut path = vec![best.unwrap_or(0)];
        for instant in (1..=last).rev() {
            path.push(paths.instants[instant].parents[path[path.len() - 1]] as usize);
        }
        path.reverse();
        Ok(paths.along(&path, slots))
    }
}

/// Chooses particles in proportion to their weights.
struct Chooser {
    sums: Vec<f64>,
}

impl Chooser {
    fn of(ln_weights: &[f64]) -> Self {
        let mut sum = 0.0;
        let sums = ln_weights.iter().map(|ln| {
            sum += ln.exp();
            sum
        });
        Self { sums: sums.collect() }
    }

    /// The particle at a share of the sum of the weights.
    fn at(&self, share: f64) -> usize {
        let total = self.sums[self.sums.len() - 1];
        let at = self.sums.partition_point(|sum| *sum <= share * total);
        // Rounding must not choose a particle of weight zero at the end.
        let most = self.sums.partition_point(|sum| *sum < total);
        at.min(most)
    }
}
