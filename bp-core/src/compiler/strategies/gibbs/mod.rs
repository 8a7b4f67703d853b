//! Gibbs sampling.
//!
//! In: a setting, the steps of a route, evidence. Out: draws of Markov chains. Invariant: every state of a chain has a
//! positive density; each chain has its own stream of random numbers and starts at its own draw from the prior.
//!
//! Variables are drawn in turn from their full conditionals (Geman and Geman, *IEEE PAMI* 6:721-741, 1984): a finite
//! one from P(x | all else); a real whose blanket is normal and linear, rᵢ(x) = rᵢ(0) + cᵢ x with deviation σᵢ, from
//! the normal law of precision Λ = Σ cᵢ² / σᵢ² and mean −Σ cᵢ rᵢ(0) / σᵢ² / Λ; other reals together along the gradient of their
//! density, where it has one, else by slice sampling, alone or along the directions of a block.

mod beginning;
mod blanket;
mod block;
mod compiled;
mod derive;
mod elimination;
mod finite_rest;
mod gradient;
mod hamiltonian;
mod integrated;
mod linear_rest;
mod metric;
mod signature;
mod sites;
mod slice;
mod tails;

pub(crate) use derive::derivation;
pub(crate) use integrated::{chooses_labels, integrated};

use crate::distribution::{Distribution, Setting, exponentiate};
use crate::equation::Strategy;
use crate::error::Error;
use crate::ids::{FactorId, VariableId};
use crate::law::Law;
use crate::model::{Ask, Model};
use crate::progress::{self, Work};
use crate::random::Random;
use crate::sample::{Draws, MOST_R_HAT, Observations, Sampling, Streams};
use crate::strategies::weighting::{Treatment, drawn, instances};
use crate::strategies::{self, Route, Turn};
use blanket::{Blankets, Memory, Site};
use block::{Block, Directions};
use gradient::{Gradient, gradients};
use hamiltonian::Hamiltonian;
use metric::Metric;
use rayon::prelude::*;
use slice::Slice;

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        drawn(model, asks, turn, Strategy::Gibbs)
    }
}

/// The number of chains.
const CHAINS: usize = 8;

/// The least number of sweeps of a chain.
const FEWEST_SWEEPS: usize = 20;

/// The least number of draws of a chain that is interrupted, which its diagnostics need.
const FEWEST_DRAWS: usize = 4;

/// The chains are advanced together in so many rounds.
const ROUNDS: usize = 64;

/// The first 1/`BURN_IN` of the sweeps, and no more than `MOST_BURN_IN`, is discarded, while a chain approaches its stationary law.
const BURN_IN: usize = 5;
const MOST_BURN_IN: usize = 1000;

/// Directions and metrics are learned after these parts of the burn-in.
const LEARNED_AFTER: [f64; 7] = [0.016, 0.032, 0.064, 0.125, 0.25, 0.5, 0.75];

/// What is drawn along gradients is also drawn one by one, in one of so many sweeps.
const ALONE_OF: usize = 8;

/// Chains end when their draws are worth so many independent ones, and this part of the number that is asked for.
const ENOUGH: usize = 10_000;
const ENOUGH_OF: usize = 10;

/// Draws by Gibbs sampling, with some variables integrated out, where the chains move; keeps the slots `kept`.
///
/// # Errors
/// A parameter outside the range that its law accepts; a variable that single-site moves cannot change; no prior draw
/// with a positive density of the evidence.
pub fn gibbs(
    setting: &Setting<'_>,
    steps: &[(FactorId, Treatment)],
    observations: &Observations,
    integrated: &[VariableId],
    kept: &[usize],
    sampling: Sampling,
) -> Result<Draws, Error> {
    let steps = instances(setting, steps)?;
    let blankets = Blankets::new(setting, &steps, observations, integrated, kept)?;
    let gradients = gradients(&blankets);
    let others: Vec<usize> = gradients.iter().flat_map(|gradient| gradient.sites.iter().copied()).collect();
    let blocks = block::blocks(&blankets, &others);
    let streams = Streams::new(sampling.seed, "gibbs");
    let sweeps = sampling.particles.div_ceil(CHAINS).max(FEWEST_SWEEPS);
    let work = Work::of(CHAINS * sweeps);
    let chain = |number: usize| {
        let mut random = streams.stream(number);
        let mut memory = Memory::default();
        let mut values = blankets.beginning(&mut memory, &mut random)?;
        blankets.check_tails(&mut values, &mut memory)?;
        let slices = blankets.sites.iter().map(|_| Slice::default()).collect();
        let directions = vec![Directions::default(); blocks.len()];
        let hamiltonians = vec![Hamiltonian::default(); gradients.len()];
        let (blankets, blocks, gradients) = (&blankets, &blocks, &gradients);
        let draws = Vec::new();
        Ok(Chain {
            blankets,
            blocks,
            gradients,
            values,
            slices,
            directions,
            hamiltonians,
            memory,
            random,
            draws,
        })
    };
    let mut chains: Vec<Chain<'_>> = (0..CHAINS).into_par_iter().map(chain).collect::<Result<_, Error>>()?;
    let burn_in = (sweeps / BURN_IN).min(MOST_BURN_IN);
    let enough = ENOUGH.max(sampling.particles / ENOUGH_OF);
    // The sweeps after which the worth of the draws is looked at next.
    let mut look = burn_in + enough / CHAINS;
    // In rounds, so that chains that are interrupted have nearly the same length.
    let round = sweeps.div_ceil(ROUNDS);
    let learned_after = LEARNED_AFTER.map(|part| (part * burn_in as f64) as usize);
    let mut first = 0;
    while first < sweeps {
        let ends = [first + round, burn_in, sweeps].into_iter().chain(learned_after);
        let after = ends.filter(|end| *end > first).min().unwrap_or(sweeps);
        let swept = chains.par_iter_mut().map(|chain| {
            for sweep in first..after {
                let may_end = || chain.draws.len() >= FEWEST_DRAWS * kept.len() || !work.is_wanted();
                if !work.may_go_on() && may_end() {
                    work.ends();
                    break;
                }
                if sweep == burn_in {
                    chain.draws.clear();
                    chain.hamiltonians.iter_mut().for_each(Hamiltonian::settle);
                }
                let has_draws = chain.draws.len() >= FEWEST_DRAWS * kept.len();
                if !chain.sweep(sweep, (sweep < burn_in, has_draws), kept)? {
                    work.ends();
                    break;
                }
            }
            Ok(())
        });
        swept.collect::<Result<(), Error>>()?;
        if !work.is_wanted() {
            return Err(Error::Interrupted);
        }
        if learned_after.contains(&after) {
            learn(&mut chains, &blocks, &gradients);
        }
        first = after;
        if progress::is_stopped() && chains[0].draws.len() >= FEWEST_DRAWS * kept.len() {
            break;
        }
        if after >= look && after < sweeps {
            let draws = last_draws(&chains, kept.len(), after - burn_in);
            if draws.effective() >= enough as f64 && draws.r_hat().is_none_or(|r_hat| r_hat <= MOST_R_HAT) {
                return Ok(draws);
            }
            look = after + (after - burn_in) / 4;
        }
    }
    // When the work is interrupted, all chains have the length of the shortest, without the first part of it.
    let mut length = sweeps - burn_in;
    if progress::is_stopped() && !kept.is_empty() {
        let made = chains.iter().map(|chain| chain.draws.len() / kept.len()).min().unwrap_or(0);
        length = length.min(made - (made / BURN_IN).min(made.saturating_sub(FEWEST_DRAWS)));
    }
    Ok(last_draws(&chains, kept.len(), length))
}

/// Learns the directions of blocks, and the metrics of what is drawn along gradients, from the draws of all chains.
fn learn(chains: &mut [Chain<'_>], blocks: &[Block], gradients: &[Gradient]) {
    for (number, block) in blocks.iter().enumerate() {
        let mut of_chains: Vec<&mut Directions> =
            chains.iter_mut().map(|chain| &mut chain.directions[number]).collect();
        block::learn(&mut of_chains, block);
    }
    for (number, gradient) in gradients.iter().enumerate() {
        let of_chains: Vec<&Hamiltonian> = chains.iter().map(|chain| &chain.hamiltonians[number]).collect();
        let Some(metric) = Metric::learn(&of_chains, gradient.dimensions()) else { continue };
        chains.iter_mut().for_each(|chain| chain.hamiltonians[number].take(metric.clone()));
    }
}

/// The last draws of all chains, so many of each.
fn last_draws(chains: &[Chain<'_>], kept: usize, length: usize) -> Draws {
    let shortest = chains.iter().map(|chain| chain.draws.len()).min().unwrap_or(0);
    let last = |chain: &Chain<'_>| chain.draws[shortest - length * kept..shortest].to_vec();
    let all: Vec<f64> = chains.iter().flat_map(last).collect();
    Draws::chained(all, kept, CHAINS * length, length)
}

struct Chain<'b> {
    blankets: &'b Blankets<'b>,
    blocks: &'b [Block],
    gradients: &'b [Gradient],
    values: Vec<f64>,
    slices: Vec<Slice>,
    /// Those of each block.
    directions: Vec<Directions>,
    /// The samplers along each gradient.
    hamiltonians: Vec<Hamiltonian>,
    memory: Memory,
    random: Random,
    /// The kept slots of each sweep, of the burn-in only while it lasts.
    draws: Vec<f64>,
}

impl Chain<'_> {
    /// Draws each site once, each block along its directions or gradient, and all that is kept; `false` where it may end
    /// early and was asked to.
    fn sweep(
        &mut self,
        sweep: usize,
        (burns_in, may_end): (bool, bool),
        kept: &[usize],
    ) -> Result<bool, Error> {
        let mut alone = vec![true; self.blankets.sites.len()];
        for (block, directions) in self.blocks.iter().zip(&self.directions) {
            let is_alone = directions.is_empty() || !block.is_complete();
            block.sites.iter().for_each(|site| alone[*site] = is_alone);
        }
        for (gradient, hamiltonian) in self.gradients.iter().zip(&self.hamiltonians) {
            let is_alone = hamiltonian.metric.is_none() || sweep.is_multiple_of(ALONE_OF);
            gradient.sites.iter().for_each(|site| alone[*site] = is_alone);
        }
        for site in (0..alone.len()).filter(|site| alone[*site]) {
            if may_end && progress::is_stopped() {
                return Ok(false);
            }
            self.renew(site, burns_in)?;
        }
        for (block, directions) in self.blocks.iter().zip(&mut self.directions) {
            let state = (self.blankets, &mut self.values, &mut self.memory);
            directions.draw(block, state, &mut self.random, burns_in)?;
            if burns_in {
                directions.remember(block, self.blankets, &self.values);
            }
        }
        for (gradient, hamiltonian) in self.gradients.iter().zip(&mut self.hamiltonians) {
            let state = (self.blankets, self.values.as_mut_slice());
            hamiltonian.draw(gradient, state, &mut self.random, burns_in);
        }
        self.blankets.complete(&mut self.values, &mut self.memory, &mut self.random)?;
        self.draws.extend(kept.iter().map(|slot| self.values[*slot]));
        self.blankets.withdraw(&mut self.values);
        Ok(true)
    }

    /// Draws one site from its full conditional.
    fn renew(&mut self, number: usize, burns_in: bool) -> Result<(), Error> {
        let blankets = self.blankets;
        let site = &blankets.sites[number];
        let value = match site.count {
            Some(count) => Some(self.finite(site, count)?),
            None if site.is_normal => self.normal(site)?,
            None => None,
        };
        let Some(value) = value else {
            let (values, memory, random) = (&mut self.values, &mut self.memory, &mut self.random);
            let start = values[site.slot];
            let mut ln_density = |value: f64| {
                values[site.slot] = value;
                blankets.ln_conditional(site, values, memory)
            };
            self.slices[number].draw(start, &mut ln_density, random, burns_in)?;
            return Ok(());
        };
        self.values[site.slot] = value;
        // Recompute the values that depend on the new one.
        blankets.ln_conditional(site, &mut self.values, &mut self.memory)?;
        Ok(())
    }

    fn finite(&mut self, site: &Site, count: usize) -> Result<f64, Error> {
        let before = self.values[site.slot];
        let mut logarithms = Vec::with_capacity(count);
        for value in 0..count {
            self.values[site.slot] = value as f64;
            logarithms.push(self.blankets.ln_conditional(site, &mut self.values, &mut self.memory)?);
        }
        exponentiate(&mut logarithms);
        // The current value has a positive density, so the weights are not all zero.
        Ok(Distribution::Finite(logarithms).draw(&mut self.random).unwrap_or(before))
    }

    fn normal(&mut self, site: &Site) -> Result<Option<f64>, Error> {
        let before = self.values[site.slot];
        let at_zero = self.blankets.residuals(site, 0.0, &mut self.values)?;
        let at_one = self.blankets.residuals(site, 1.0, &mut self.values)?;
        let (Some(at_zero), Some(at_one)) = (at_zero, at_one) else {
            self.values[site.slot] = before;
            return Ok(None);
        };
        let (mut precision, mut pull) = (0.0, 0.0);
        for ([zero, deviation], [one, _]) in at_zero.into_iter().zip(at_one) {
            let (slope, weight) = (one - zero, 1.0 / (deviation * deviation));
            precision += slope * slope * weight;
            pull -= slope * zero * weight;
        }
        let drawn = Law::Normal.draw(&mut self.random, &[pull / precision, 1.0 / precision.sqrt()]);
        Ok(Some(if drawn.is_finite() { drawn } else { before }))
    }
}
