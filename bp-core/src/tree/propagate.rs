//! Two passes over a junction tree: messages up to the roots, and down again.
//!
//! In: a [`Tree`] and evidence. Out: every marginal, and ln P(evidence). Invariant: a message is divided by its largest
//! number as it goes up, and the logarithms are added: nothing underflows that is not zero. Subtrees are independent, so
//! they may be done at the same time, and nothing depends on the number of threads.
//!
//! up:   φ_C = Π tables · Π messages,  m_C = Σ_{C∖S} φ_C.
//! down: β_C = φ_C · (β_S / m_C),  and β_S of each child is a sum of β_C; at a root β_C = φ_C / Σ φ_C.

use super::compile::{Clique, Tree};
use super::evidence::{Evidence, Known};
use crate::error::Error;
use rayon::prelude::*;

/// The working memory of one asker; it is kept from question to question.
#[derive(Clone, Debug)]
pub struct Session<'t> {
    pub(super) tree: &'t Tree,
    pub(super) known: Known,
    pub(super) cells: Vec<f64>,
    messages: Vec<f64>,
    down: Vec<f64>,
    marginals: Vec<f64>,
    pub(super) ln_evidence: f64,
}

/// A subtree of fewer cells is not worth handing to another thread.
const WORTH_SHARING: usize = 1 << 15;

impl Tree {
    /// Working memory for asking.
    pub fn session(&self) -> Session<'_> {
        let end = self.offsets.last().copied().unwrap_or_default();
        Session {
            tree: self,
            known: Known::nothing(self.network.cardinalities.len()),
            cells: vec![0.0; end.cells],
            messages: vec![0.0; end.message],
            down: vec![0.0; end.message],
            marginals: vec![0.0; end.marginals],
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
        self.collect(evidence, false)?;
        let below = Below {
            cells: &self.cells,
            messages: &self.messages,
            down: &mut self.down,
            marginals: &mut self.marginals,
        };
        distribute(self.tree, 0, self.tree.cliques.len(), below);
        Ok(())
    }

    /// ln P(evidence) of the last question.
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    /// The marginal of a variable that is answered here; of a given one nothing.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        &self.marginals[self.tree.places[variable].clone()]
    }

    /// Messages from the leaves to the roots: of sums, or of the largest values.
    pub(super) fn collect(&mut self, evidence: &Evidence, maximum: bool) -> Result<(), Error> {
        self.known.read(self.tree, evidence)?;
        let pass = Pass { tree: self.tree, known: &self.known, maximum };
        let ln_scale = pass.up(0, self.tree.cliques.len(), &mut self.cells, &mut self.messages)?;
        self.ln_evidence = ln_scale + self.known.ln_certain;
        match self.ln_evidence == f64::NEG_INFINITY {
            true => Err(contradiction(self.known.certain_zero(self.tree))),
            false => Ok(()),
        }
    }
}

/// Evidence that cannot be.
fn contradiction(variables: Vec<usize>) -> Error {
    let names = format!("variables {variables:?}");
    Error::Contradiction { variables, names }
}

/// One way up.
struct Pass<'s> {
    tree: &'s Tree,
    known: &'s Known,
    maximum: bool,
}

impl Pass<'_> {
    /// The cliques from `first` to before `end`, which are whole subtrees, and their cells and messages.
    fn up(&self, first: usize, end: usize, cells: &mut [f64], messages: &mut [f64]) -> Result<f64, Error> {
        let offsets = &self.tree.offsets;
        let mut ln_scale = 0.0;
        if cells.len() < WORTH_SHARING || end - first < 2 {
            for number in first..end {
                ln_scale += self.clique(number, first, cells, messages)?;
            }
            return Ok(ln_scale);
        }
        // The roots of these subtrees, and what is below each. A single root is done after what is below it.
        let single = self.tree.first[end - 1] == first;
        let inner = if single { end - 1 } else { end };
        let mut parts = Vec::new();
        let (mut rest_cells, mut rest_messages) = (&mut *cells, &mut *messages);
        let mut start = first;
        for root in self.roots(first, inner) {
            let (from, to) = (offsets[start], offsets[root + 1]);
            let (own_cells, other_cells) = rest_cells.split_at_mut(to.cells - from.cells);
            let (own_messages, other_messages) = rest_messages.split_at_mut(to.message - from.message);
            parts.push((start, root + 1, own_cells, own_messages));
            (rest_cells, rest_messages, start) = (other_cells, other_messages, root + 1);
        }
        let scales: Vec<Result<f64, Error>> = (parts.into_par_iter())
            .map(|(first, end, cells, messages)| self.up(first, end, cells, messages))
            .collect();
        for scale in scales {
            ln_scale += scale?;
        }
        if single {
            ln_scale += self.clique(end - 1, first, cells, messages)?;
        }
        Ok(ln_scale)
    }

    /// The roots of the subtrees that make up a stretch of cliques.
    fn roots(&self, first: usize, end: usize) -> Vec<usize> {
        let (mut roots, mut next) = (Vec::new(), end);
        while next > first {
            roots.push(next - 1);
            next = self.tree.first[next - 1];
        }
        roots.reverse();
        roots
    }

    /// One clique: its cells, and its message. Gives ln of what the message was divided by.
    fn clique(
        &self,
        number: usize,
        first: usize,
        cells: &mut [f64],
        messages: &mut [f64],
    ) -> Result<f64, Error> {
        let (clique, offsets) = (&self.tree.cliques[number], &self.tree.offsets);
        let (base, own) = (offsets[first], offsets[number]);
        let cells = &mut cells[own.cells - base.cells..][..clique.blocks.cells()];
        let (before, from) = messages.split_at_mut(own.message - base.message);
        let message = &mut from[..clique.message];
        message.fill(0.0);
        for (block_number, block) in cells.chunks_exact_mut(clique.blocks.width).enumerate() {
            self.fill(clique, block_number, block, before, base.message);
            match &clique.parent {
                Some((_, reach)) if self.maximum => reach.maximise(block, block_number, message),
                Some((_, reach)) => reach.add(block, block_number, message),
                None if self.maximum => message[0] = block.iter().copied().fold(message[0], f64::max),
                None => message[0] += block.iter().sum::<f64>(),
            }
        }
        let largest = message.iter().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return Err(contradiction(self.observed(number)));
        }
        let scale = 1.0 / largest;
        message.iter_mut().for_each(|cell| *cell *= scale);
        from[clique.message] = scale;
        Ok(largest.ln())
    }

    /// The observed variables of a clique; where it has none, those of all cliques below it.
    fn observed(&self, number: usize) -> Vec<usize> {
        let of = |clique: &Clique| {
            let given =
                clique.sources.iter().flat_map(|source| source.given.iter().map(|(variable, _)| *variable));
            let weighed =
                clique.variables.iter().copied().filter(|one| self.known.places[*one] != usize::MAX);
            given.chain(weighed).collect::<Vec<usize>>()
        };
        let mut found = of(&self.tree.cliques[number]);
        if found.is_empty() {
            found = self.tree.cliques[self.tree.first[number]..=number].iter().flat_map(of).collect();
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// One block of a clique: tables, likelihoods and messages, multiplied.
    #[inline]
    fn fill(&self, clique: &Clique, number: usize, block: &mut [f64], messages: &[f64], base: usize) {
        let width = clique.blocks.width;
        match &clique.fixed {
            Some(fixed) => block.copy_from_slice(&fixed[number * width..(number + 1) * width]),
            None => block.fill(1.0),
        }
        for source in &clique.sources {
            let place = self.known.base(&source.given);
            source.reach.multiply(block, number, &self.tree.network.tables[source.table].values, place);
        }
        for (variable, reach) in &clique.likelihoods {
            let place = self.known.places[*variable];
            if place != usize::MAX {
                reach.multiply(block, number, &self.known.likelihoods, place);
            }
        }
        for (child, reach) in &clique.children {
            reach.multiply(block, number, messages, self.tree.offsets[*child].message - base);
        }
    }
}

/// What the way down needs of a stretch of cliques.
struct Below<'s> {
    cells: &'s [f64],
    messages: &'s [f64],
    down: &'s mut [f64],
    marginals: &'s mut [f64],
}

/// The cliques from `first` to before `end`, which are whole subtrees; what comes down to their roots is there.
fn distribute(tree: &Tree, first: usize, end: usize, mut below: Below<'_>) {
    let mut block = Vec::new();
    if below.cells.len() < WORTH_SHARING || end - first < 2 {
        (first..end).rev().for_each(|number| down(tree, number, first, &mut below, &mut block));
        return;
    }
    let mut inner = end;
    if tree.first[end - 1] == first {
        down(tree, end - 1, first, &mut below, &mut block);
        inner = end - 1;
    }
    let (mut parts, mut start) = (Vec::new(), first);
    let pass = Pass { tree, known: &Known::nothing(0), maximum: false };
    let Below { mut cells, mut messages, down: mut rest_down, marginals: mut rest_marginals } = below;
    for root in pass.roots(first, inner) {
        let (from, to) = (tree.offsets[start], tree.offsets[root + 1]);
        let (own_cells, other_cells) = cells.split_at(to.cells - from.cells);
        let (own_messages, other_messages) = messages.split_at(to.message - from.message);
        let (own_down, other_down) = rest_down.split_at_mut(to.message - from.message);
        let (own_marginals, other_marginals) = rest_marginals.split_at_mut(to.marginals - from.marginals);
        let own =
            Below { cells: own_cells, messages: own_messages, down: own_down, marginals: own_marginals };
        parts.push((start, root + 1, own));
        (cells, messages, start) = (other_cells, other_messages, root + 1);
        (rest_down, rest_marginals) = (other_down, other_marginals);
    }
    parts.into_par_iter().for_each(|(first, end, own)| distribute(tree, first, end, own));
}

/// One clique on the way down: the beliefs of its children's separators, and its marginals.
fn down(tree: &Tree, number: usize, first: usize, below: &mut Below<'_>, block: &mut Vec<f64>) {
    let (clique, base, own) = (&tree.cliques[number], tree.offsets[first], tree.offsets[number]);
    if clique.children.is_empty() && clique.marginals.is_empty() {
        return;
    }
    let cells = &below.cells[own.cells - base.cells..][..clique.blocks.cells()];
    let (lower, upper) = below.down.split_at_mut(own.message - base.message);
    let ratio = &mut upper[..clique.message];
    match &clique.parent {
        // What came down, over what went up.
        Some(_) => {
            let up = &below.messages[own.message - base.message..];
            let scale = up[clique.message];
            for (down, up) in ratio.iter_mut().zip(up) {
                *down = if *up > 0.0 { *down / up * scale } else { 0.0 };
            }
        }
        None => ratio[0] = 1.0 / cells.iter().sum::<f64>(),
    }
    let place = |child: usize| {
        let start = tree.offsets[child].message - base.message;
        start..start + tree.cliques[child].message
    };
    clique.children.iter().for_each(|(child, _)| lower[place(*child)].fill(0.0));
    let of = |variable: usize| {
        let place = tree.places[variable].clone();
        place.start - base.marginals..place.end - base.marginals
    };
    clique.marginals.iter().for_each(|(variable, _)| below.marginals[of(*variable)].fill(0.0));
    block.resize(clique.blocks.width, 0.0);
    for (block_number, cells) in cells.chunks_exact(clique.blocks.width).enumerate() {
        block.copy_from_slice(cells);
        match &clique.parent {
            Some((_, reach)) => reach.multiply(block, block_number, ratio, 0),
            None => block.iter_mut().for_each(|cell| *cell *= ratio[0]),
        }
        for (child, reach) in &clique.children {
            reach.add(block, block_number, &mut lower[place(*child)]);
        }
        for (variable, reach) in &clique.marginals {
            reach.add(block, block_number, &mut below.marginals[of(*variable)]);
        }
    }
    for (variable, _) in &clique.marginals {
        let marginal = &mut below.marginals[of(*variable)];
        let total = 1.0 / marginal.iter().sum::<f64>();
        marginal.iter_mut().for_each(|p| *p *= total);
    }
}
