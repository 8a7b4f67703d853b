//! Two passes over a junction tree: messages up to the roots, and down again.
//!
//! In: a [`Tree`], given values and likelihoods. Out: every marginal, and ln P(evidence). Invariant: a message is divided
//! by its largest number as it goes up, and the logarithms are added: nothing underflows that is not zero.
//!
//! up:   φ_C = Π tables · Π messages,  m_C = Σ_{C∖S} φ_C.
//! down: β_C = φ_C · (β_S / m_C),  and β_S of each child is a sum of β_C; at a root β_C = φ_C / Σ φ_C.

use super::compile::{Clique, Tree};
use crate::error::Error;

/// What is known: values, and likelihoods.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// (variable, value); for the given variables of a tree each must be there.
    pub hard: Vec<(usize, usize)>,
    /// (variable, a likelihood for each of its values).
    pub virtual_: Vec<(usize, Vec<f64>)>,
}

/// The working memory of one asker; it is kept from question to question.
#[derive(Clone, Debug)]
pub struct Session<'t> {
    pub(super) tree: &'t Tree,
    pub(super) cells: Vec<f64>,
    pub(super) messages: Vec<f64>,
    down: Vec<f64>,
    block: Vec<f64>,
    marginals: Vec<f64>,
    pub(super) values: Vec<usize>,
    /// For each variable: where its likelihood begins, or `usize::MAX`.
    likelihood_of: Vec<usize>,
    likelihoods: Vec<f64>,
    pub(super) ln_evidence: f64,
}

impl Tree {
    /// Working memory for asking.
    pub fn session(&self) -> Session<'_> {
        let (cells, messages) = self.offsets.last().copied().unwrap_or_default();
        let widest = self.cliques.iter().map(|clique| clique.blocks.width).max().unwrap_or(1);
        let count = self.network.cardinalities.len();
        Session {
            tree: self,
            cells: vec![0.0; cells],
            messages: vec![0.0; messages],
            down: vec![0.0; messages],
            block: vec![0.0; widest],
            marginals: vec![0.0; self.places.last().copied().unwrap_or(0)],
            values: vec![usize::MAX; count],
            likelihood_of: vec![usize::MAX; count],
            likelihoods: Vec::new(),
            ln_evidence: 0.0,
        }
    }
}

impl Session<'_> {
    /// Computes every marginal of the tree given the evidence.
    ///
    /// # Errors
    /// A value out of its domain, a given variable without one, evidence of probability zero.
    pub fn ask(&mut self, evidence: &Evidence) -> Result<(), Error> {
        self.know(evidence)?;
        self.collect(false)?;
        self.distribute();
        Ok(())
    }

    /// ln P(evidence) of the last question.
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    /// The marginal of a variable that is answered here; of a given one nothing.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        &self.marginals[self.tree.places[variable]..self.tree.places[variable + 1]]
    }

    /// Takes in the evidence.
    pub(super) fn know(&mut self, evidence: &Evidence) -> Result<(), Error> {
        self.values.fill(usize::MAX);
        self.likelihood_of.fill(usize::MAX);
        self.likelihoods.clear();
        let cardinalities = &self.tree.network.cardinalities;
        for (variable, value) in &evidence.hard {
            if *value >= cardinalities[*variable] {
                let (count, name) = (cardinalities[*variable], format!("variable {variable}"));
                return Err(Error::input(name, format!("value {value} is not one of its {count}")));
            }
            self.values[*variable] = *value;
            if !self.tree.given[*variable] {
                self.likelihood_of[*variable] = self.likelihoods.len();
                self.likelihoods
                    .extend((0..cardinalities[*variable]).map(|other| f64::from(u8::from(other == *value))));
            }
        }
        for (variable, weights) in &evidence.virtual_ {
            if self.tree.given[*variable] {
                continue;
            }
            match self.likelihood_of[*variable] {
                usize::MAX => {
                    self.likelihood_of[*variable] = self.likelihoods.len();
                    self.likelihoods.extend_from_slice(weights);
                }
                place => {
                    let known = &mut self.likelihoods[place..place + weights.len()];
                    known.iter_mut().zip(weights).for_each(|(known, weight)| *known *= weight);
                }
            }
        }
        let missing =
            (0..cardinalities.len()).find(|one| self.tree.given[*one] && self.values[*one] == usize::MAX);
        if let Some(variable) = missing {
            return Err(Error::input(format!("variable {variable}"), "its value was not given"));
        }
        // What is given and certain counts at once.
        self.ln_evidence = 0.0;
        for (table, given) in &self.tree.known {
            let place: usize = given.iter().map(|(variable, stride)| self.values[*variable] * stride).sum();
            self.ln_evidence += self.tree.network.tables[*table].values[place].ln();
        }
        for (variable, weights) in &evidence.virtual_ {
            if self.tree.given[*variable] {
                self.ln_evidence += weights[self.values[*variable]].ln();
            }
        }
        if self.ln_evidence == f64::NEG_INFINITY { Err(impossible()) } else { Ok(()) }
    }

    /// Messages from the leaves to the roots: sums, or largest values.
    pub(super) fn collect(&mut self, maximum: bool) -> Result<(), Error> {
        for (number, clique) in self.tree.cliques.iter().enumerate() {
            let (start, own) = self.tree.offsets[number];
            let cells = &mut self.cells[start..start + clique.blocks.cells()];
            let (before, from) = self.messages.split_at_mut(own);
            let message = &mut from[..clique.message];
            message.fill(0.0);
            for (block_number, block) in cells.chunks_exact_mut(clique.blocks.width).enumerate() {
                let context = Context {
                    tree: self.tree,
                    values: &self.values,
                    likelihood_of: &self.likelihood_of,
                    likelihoods: &self.likelihoods,
                    messages: before,
                };
                context.fill(clique, block_number, block);
                match &clique.parent {
                    Some((_, reach)) if maximum => reach.maximise(block, block_number, message),
                    Some((_, reach)) => reach.add(block, block_number, message),
                    None if maximum => message[0] = block.iter().copied().fold(message[0], f64::max),
                    None => message[0] += block.iter().sum::<f64>(),
                }
            }
            let largest = message.iter().copied().fold(0.0, f64::max);
            if largest <= 0.0 {
                return Err(impossible());
            }
            let scale = 1.0 / largest;
            message.iter_mut().for_each(|cell| *cell *= scale);
            self.ln_evidence += largest.ln();
        }
        Ok(())
    }

    /// Beliefs from the roots to the leaves.
    fn distribute(&mut self) {
        for (number, clique) in self.tree.cliques.iter().enumerate().rev() {
            let (start, own) = self.tree.offsets[number];
            let cells = &self.cells[start..start + clique.blocks.cells()];
            let (below, ratio) = self.down.split_at_mut(own);
            let ratio = &mut ratio[..clique.message];
            match &clique.parent {
                // What came down, over what went up.
                Some(_) => {
                    let up = &self.messages[own..own + clique.message];
                    for (down, up) in ratio.iter_mut().zip(up) {
                        *down = if *up > 0.0 { *down / up } else { 0.0 };
                    }
                }
                None => ratio[0] = 1.0 / cells.iter().sum::<f64>(),
            }
            let needed = !clique.children.is_empty() || !clique.marginals.is_empty();
            if !needed {
                continue;
            }
            for (child, _) in &clique.children {
                let place = self.tree.offsets[*child].1;
                below[place..place + self.tree.cliques[*child].message].fill(0.0);
            }
            for (variable, _) in &clique.marginals {
                self.marginals[self.tree.places[*variable]..self.tree.places[variable + 1]].fill(0.0);
            }
            let block = &mut self.block[..clique.blocks.width];
            for (block_number, cells) in cells.chunks_exact(clique.blocks.width).enumerate() {
                block.copy_from_slice(cells);
                match &clique.parent {
                    Some((_, reach)) => reach.multiply(block, block_number, ratio, 0),
                    None => block.iter_mut().for_each(|cell| *cell *= ratio[0]),
                }
                for (child, reach) in &clique.children {
                    let place = self.tree.offsets[*child].1;
                    let message = &mut below[place..place + self.tree.cliques[*child].message];
                    reach.add(block, block_number, message);
                }
                for (variable, reach) in &clique.marginals {
                    let place = self.tree.places[*variable]..self.tree.places[variable + 1];
                    reach.add(block, block_number, &mut self.marginals[place]);
                }
            }
            for (variable, _) in &clique.marginals {
                let place = self.tree.places[*variable]..self.tree.places[variable + 1];
                let marginal = &mut self.marginals[place];
                let total = 1.0 / marginal.iter().sum::<f64>();
                marginal.iter_mut().for_each(|p| *p *= total);
            }
        }
    }
}

/// What a clique's cells are made of.
struct Context<'s> {
    tree: &'s Tree,
    values: &'s [usize],
    likelihood_of: &'s [usize],
    likelihoods: &'s [f64],
    messages: &'s [f64],
}

impl Context<'_> {
    /// One block of a clique: tables, likelihoods and messages, multiplied.
    #[inline]
    fn fill(&self, clique: &Clique, number: usize, block: &mut [f64]) {
        let width = clique.blocks.width;
        match &clique.fixed {
            Some(fixed) => block.copy_from_slice(&fixed[number * width..(number + 1) * width]),
            None => block.fill(1.0),
        }
        for source in &clique.sources {
            let base: usize =
                source.given.iter().map(|(variable, stride)| self.values[*variable] * stride).sum();
            source.reach.multiply(block, number, &self.tree.network.tables[source.table].values, base);
        }
        for (variable, reach) in &clique.likelihoods {
            let place = self.likelihood_of[*variable];
            if place != usize::MAX {
                reach.multiply(block, number, self.likelihoods, place);
            }
        }
        for (child, reach) in &clique.children {
            reach.multiply(block, number, self.messages, self.tree.offsets[*child].1);
        }
    }
}

fn impossible() -> Error {
    Error::Impossible("the network".to_owned())
}
