//! Blocks: reals that are also drawn together, along the directions in which they vary most.
//!
//! In: the sites of a chain. Out: groups of sites that depend on each other, such as the coefficients of a regression or the effects of
//! groups with their mean, and their draws. Invariant: the directions are learned during burn-in only, so that later draws leave the
//! distribution invariant; a sweep along them costs no more than one through the sites.
//!
//! x + t v is drawn by slice sampling in t, for the first principal directions v of the draws of the burn-in (factor slice sampling:
//! Tibbits, Groendyke, Haran and Liechty, *Journal of Computational and Graphical Statistics* 23:543-563, 2014).

use super::blanket::{Blankets, Memory, Site};
use super::slice::Slice;
use crate::error::Error;
use crate::random::Random;
use nalgebra::DMatrix;
use std::collections::BTreeSet;

/// Upper limit on the sites of a block.
const MOST_SITES: usize = 150;

/// The draws for each site from which directions are learned.
const DRAWS_A_SITE: usize = 2;

/// The least variance along a direction, relative to that of the sites.
const LEAST_VARIANCE: f64 = 1e-12;

/// The nodes that cost as much as the integral, or a sum, that a site changes.
const NODES_OF_A_SUM: usize = 50;

/// Sites that are drawn together.
pub(super) struct Block {
    /// Their numbers.
    pub(super) sites: Vec<usize>,
    /// The number of directions.
    count: usize,
    /// All that depends on them.
    all: Site,
}

impl Block {
    /// Whether its directions suffice without its sites one by one.
    pub(super) fn is_complete(&self) -> bool {
        self.count == self.sites.len()
    }
}

fn cost(site: &Site) -> usize {
    site.blanket.len() + NODES_OF_A_SUM * (site.clumps.len() + usize::from(site.moves_rest))
}

/// The blocks among the sites that are drawn by slice sampling; `others` are drawn otherwise.
pub(super) fn blocks(blankets: &Blankets<'_>, others: &[usize]) -> Vec<Block> {
    let sites = &blankets.sites;
    let is_sliced = |site: &Site| site.count.is_none() && !site.is_normal;
    let mut rest: Vec<usize> =
        (0..sites.len()).filter(|number| is_sliced(&sites[*number]) && !others.contains(number)).collect();
    // The largest blankets first, so that what many nodes depend on is in the block.
    rest.sort_by_key(|number| std::cmp::Reverse(sites[*number].blanket.len()));
    let mut blocks = Vec::new();
    while !rest.is_empty() {
        let mut own = vec![rest.remove(0)];
        let mut all = sites[own[0]].clone();
        let mut nodes: BTreeSet<usize> = all.blanket.iter().copied().collect();
        let mut found = true;
        while found {
            let before = own.len();
            rest.retain(|number| {
                let site = &sites[*number];
                let shares = site.moves_rest && all.moves_rest
                    || site.clumps.iter().any(|clump| all.clumps.contains(clump))
                    || site.blanket.iter().any(|node| nodes.contains(node));
                if !shares || own.len() == MOST_SITES {
                    return true;
                }
                own.push(*number);
                nodes.extend(&site.blanket);
                all.moves_rest |= site.moves_rest;
                all.clumps.extend(&site.clumps);
                false
            });
            found = own.len() > before;
        }
        if own.len() > 1 {
            all.blanket = nodes.into_iter().collect();
            all.terms = blankets.compiled.terms(&all.blanket);
            all.clumps.sort_unstable();
            all.clumps.dedup();
            let alone: usize = own.iter().map(|number| cost(&sites[*number])).sum();
            let count = (alone / cost(&all)).clamp(1, own.len());
            blocks.push(Block { sites: own, count, all });
        }
    }
    blocks
}

/// The directions of a block in one chain.
#[derive(Clone, Debug, Default)]
pub(super) struct Directions {
    /// Each with its slice sampler; none before they are learned.
    along: Vec<(Vec<f64>, Slice)>,
    /// The values of the block after each sweep of the burn-in.
    history: Vec<f64>,
}

impl Directions {
    /// Whether there are none yet.
    pub(super) fn is_empty(&self) -> bool {
        self.along.is_empty()
    }

    /// Remembers the values of a block.
    pub(super) fn remember(&mut self, block: &Block, blankets: &Blankets<'_>, values: &[f64]) {
        self.history.extend(block.sites.iter().map(|number| values[blankets.sites[*number].slot]));
    }

    /// Draws a block along each direction.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    pub(super) fn draw(
        &mut self,
        block: &Block,
        (blankets, values, memory): (&Blankets<'_>, &mut Vec<f64>, &mut Memory),
        random: &mut Random,
        burns_in: bool,
    ) -> Result<(), Error> {
        let slots: Vec<usize> = block.sites.iter().map(|number| blankets.sites[*number].slot).collect();
        for (direction, slice) in &mut self.along {
            let start: Vec<f64> = slots.iter().map(|slot| values[*slot]).collect();
            let mut ln_density = |t: f64| {
                for ((slot, from), part) in slots.iter().zip(&start).zip(&*direction) {
                    values[*slot] = from + t * part;
                }
                blankets.ln_conditional(&block.all, values, memory)
            };
            slice.draw(0.0, &mut ln_density, random, burns_in)?;
        }
        Ok(())
    }
}

/// Learns the directions of a block of some sites from the later half of what all chains remember; each chain varies about its own
/// mean. Directions are those of the correlations, so that the units of the sites do not matter.
pub(super) fn learn(chains: &mut [&mut Directions], block: &Block) {
    let sites = block.sites.len();
    // A chain that is interrupted remembers less.
    let draws = chains.iter().map(|chain| chain.history.len() / sites).min().unwrap_or(0);
    let later = draws - draws / 2;
    if chains.len() * later < DRAWS_A_SITE * sites {
        return;
    }
    let mut covariance = DMatrix::<f64>::zeros(sites, sites);
    for chain in chains.iter() {
        let own =
            DMatrix::from_column_slice(sites, later, &chain.history[(draws - later) * sites..draws * sites]);
        let mean = own.column_mean();
        let away = DMatrix::from_fn(sites, later, |row, column| own[(row, column)] - mean[row]);
        covariance += &away * away.transpose() / (chains.len() * later) as f64;
    }
    let deviations: Vec<f64> = (0..sites).map(|site| covariance[(site, site)].sqrt()).collect();
    if !deviations.iter().all(|deviation| *deviation > 0.0 && deviation.is_finite()) {
        return;
    }
    let correlation = DMatrix::from_fn(sites, sites, |row, column| {
        covariance[(row, column)] / deviations[row] / deviations[column]
    });
    let eigen = correlation.symmetric_eigen();
    let scaled = |place: usize| {
        let scale = eigen.eigenvalues[place].max(LEAST_VARIANCE).sqrt();
        let vector = eigen.eigenvectors.column(place);
        let direction = vector.iter().zip(&deviations).map(|(part, deviation)| part * deviation * scale);
        (direction.collect::<Vec<f64>>(), Slice::default())
    };
    let mut places: Vec<usize> = (0..sites).collect();
    places.sort_by(|one, other| eigen.eigenvalues[*other].total_cmp(&eigen.eigenvalues[*one]));
    let along: Vec<(Vec<f64>, Slice)> = places.into_iter().take(block.count).map(scaled).collect();
    chains.iter_mut().for_each(|chain| chain.along.clone_from(&along));
}

#[cfg(test)]
mod tests {
    use super::super::compiled::Terms;
    use super::*;

    /// Two numbers with correlation 0.99 and deviations 1 and 1000: along the sum and the difference of both in their own deviations,
    /// whose variances are 1.99 and 0.01.
    #[test]
    fn directions_are_those_of_the_correlations() {
        let mut directions = Directions::default();
        // The first half is not read; the other has the four corners of the ellipse.
        directions.history.extend([7.0; 64]);
        let (long, short) = (1.99f64.sqrt(), 0.01f64.sqrt());
        for _ in 0..8 {
            for (sum, difference) in [(long, short), (long, -short), (-long, short), (-long, -short)] {
                directions
                    .history
                    .extend([(sum + difference) / 2f64.sqrt(), 1000.0 * (sum - difference) / 2f64.sqrt()]);
            }
        }
        let all = Site {
            slot: 0,
            count: None,
            blanket: Vec::new(),
            is_normal: false,
            moves_rest: false,
            clumps: Vec::new(),
            terms: Terms::default(),
        };
        let mut interrupted =
            Directions { history: directions.history[..100].to_vec(), ..Directions::default() };
        let block = Block { sites: vec![0, 1], count: 2, all };
        learn(&mut [&mut directions.clone(), &mut interrupted], &block);
        assert_eq!(interrupted.along.len(), 2);
        learn(&mut [&mut directions], &block);
        let lengths: Vec<f64> =
            directions.along.iter().map(|(part, _)| part[0].hypot(part[1] / 1000.0)).collect();
        assert!((lengths[0] - long).abs() < 1e-9 && (lengths[1] - short).abs() < 1e-9, "{lengths:?}");
    }
}
