//! Two passes over a join tree: products up to the root, derivatives down again.
//!
//! In: a [`Tree`] and evidence. Out: every wanted marginal, and ln P(evidence). Invariant: a power of two is taken out of
//! what becomes very small or very large: nothing underflows that is not zero. Subtrees are independent, and so are the
//! cells of a large product: they may be done at the same time, and nothing depends on the number of threads.
//!
//! up:   T_p = Σ T_a · T_b         over what nothing else has.
//! down: D_a = Σ D_p · T_b,  D_b = Σ D_p · T_a,  D_root = 1:  D = ∂P(e)/∂T, and P(cells, e) = T · D.

use super::compile::{Source, Tree};
use super::contraction::WORTH_SHARING;
use super::evidence::{Evidence, Known, contradiction};
use super::reading::Kind;
use crate::error::Error;

/// The working memory of one asker; it is kept from question to question.
#[derive(Clone, Debug)]
pub struct Session<'t> {
    pub(super) tree: &'t Tree,
    pub(super) known: Known,
    pub(super) cells: Vec<f64>,
    derivatives: Vec<f64>,
    marginals: Vec<f64>,
    pub(super) ln_evidence: f64,
}

impl Tree {
    /// Working memory for asking.
    pub fn session(&self) -> Session<'_> {
        let end = self.offsets.last().copied().unwrap_or_default();
        Session {
            tree: self,
            known: Known::nothing(self),
            cells: vec![0.0; end.value],
            derivatives: vec![0.0; end.derivative],
            marginals: vec![0.0; end.marginals],
            ln_evidence: 0.0,
        }
    }

    /// The cells of a node, from those that a stretch of nodes from `first` on has.
    pub(super) fn value<'c>(
        &'c self,
        known: &Known,
        cells: &'c [f64],
        first: usize,
        node: usize,
    ) -> &'c [f64] {
        let count = self.parts[node].cells;
        match self.parts[node].source {
            Source::Table { start, slice } => {
                &self.tables.values[start + known.slices[slice] * count..][..count]
            }
            Source::Own => &cells[self.offsets[node].value - self.offsets[first].value..][..count],
        }
    }

    /// Where the likelihood of a weighed variable lies.
    pub(super) fn likelihood(&self, variable: usize) -> std::ops::Range<usize> {
        let start = self.offsets[self.likelihoods[variable]].value;
        start..start + self.cardinalities[variable]
    }

    /// A node of a subtree both of whose children are worth a thread of their own.
    fn split(&self, root: usize) -> Option<(usize, usize, usize)> {
        let mut node = root;
        while self.work[node] >= 2.0 * WORTH_SHARING {
            let (one, other) = self.parts[node].children?;
            if self.work[one].min(self.work[other]) >= WORTH_SHARING {
                return Some((node, one, other));
            }
            node = if self.work[one] > self.work[other] { one } else { other };
        }
        None
    }
}

impl Session<'_> {
    /// Computes every wanted marginal given the evidence.
    ///
    /// # Errors
    /// A value out of its domain, a given variable without one, evidence of probability zero.
    pub fn ask(&mut self, evidence: &Evidence) -> Result<(), Error> {
        self.collect::<false>(evidence)?;
        if let Some(root) = self.tree.parts.len().checked_sub(1) {
            let pass = Pass { tree: self.tree, known: &self.known };
            let below = Below { derivatives: &mut self.derivatives, marginals: &mut self.marginals };
            pass.down(&self.cells, 0, root, below, &[]);
        }
        Ok(())
    }

    /// ln P(evidence) of the last question.
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    /// The marginal of a variable that is answered here; of another one nothing.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        &self.marginals[self.tree.places[variable].clone()]
    }

    /// From the leaves to the root: sums, or largest values.
    pub(super) fn collect<const MAXIMUM: bool>(&mut self, evidence: &Evidence) -> Result<(), Error> {
        self.known.read(self.tree, evidence, &mut self.cells)?;
        let (pass, count) = (Pass { tree: self.tree, known: &self.known }, self.tree.parts.len());
        let mut exponent = self.known.exponent + self.tree.tables.exponent;
        let mut total = self.known.certain;
        if let Some(root) = count.checked_sub(1) {
            let found = pass.up::<MAXIMUM>(0, root, &mut self.cells);
            exponent += found.map_err(|node| contradiction(pass.observed(node)))?;
            total *= self.tree.value(&self.known, &self.cells, 0, root)[0];
        }
        self.ln_evidence = total.ln() + exponent as f64 * std::f64::consts::LN_2;
        match total > 0.0 {
            true => Ok(()),
            false => {
                Err(contradiction(count.checked_sub(1).map_or_else(Vec::new, |root| pass.observed(root))))
            }
        }
    }
}

/// One question on its way.
#[derive(Clone, Copy)]
struct Pass<'s> {
    tree: &'s Tree,
    known: &'s Known,
}

/// What the way down needs of a stretch of nodes.
struct Below<'s> {
    derivatives: &'s mut [f64],
    marginals: &'s mut [f64],
}

impl Pass<'_> {
    /// The nodes from `first` to `root`, which are one subtree, and their cells. Gives the power of two taken out of them,
    /// or the first node that is zero everywhere.
    fn up<const MAXIMUM: bool>(self, first: usize, root: usize, cells: &mut [f64]) -> Result<i64, usize> {
        let Some((node, one, other)) = self.tree.split(root) else {
            return self.stretch::<MAXIMUM>(first, first..root + 1, cells);
        };
        let at = |node: usize| self.tree.offsets[node].value - self.tree.offsets[first].value;
        let start = self.tree.first[one];
        let mut exponent = self.stretch::<MAXIMUM>(first, first..start, cells)?;
        let (_, rest) = cells.split_at_mut(at(start));
        let (own, rest) = rest.split_at_mut(at(one + 1) - at(start));
        let (theirs, _) = rest.split_at_mut(at(other + 1) - at(one + 1));
        let (found, also) = rayon::join(
            || self.up::<MAXIMUM>(start, one, own),
            || self.up::<MAXIMUM>(one + 1, other, theirs),
        );
        exponent += found? + also?;
        Ok(exponent + self.stretch::<MAXIMUM>(first, node..root + 1, cells)?)
    }

    /// Some nodes, one after the other; `cells` are those from `first` on.
    fn stretch<const MAXIMUM: bool>(
        self,
        first: usize,
        nodes: std::ops::Range<usize>,
        cells: &mut [f64],
    ) -> Result<i64, usize> {
        let mut exponent = 0;
        for node in nodes {
            let part = &self.tree.parts[node];
            let (Some(up), Some((one, other)), false) = (&part.up, part.children, part.constant) else {
                continue;
            };
            let place = self.tree.offsets[node].value - self.tree.offsets[first].value;
            let (before, own) = cells.split_at_mut(place);
            let own = &mut own[..part.cells];
            let value = |child: usize| self.tree.value(self.known, before, first, child);
            up.run::<MAXIMUM>(&self.tree.pool, value(one), value(other), own, None);
            exponent += rescale(own).ok_or(node)?;
        }
        Ok(exponent)
    }

    /// The derivatives of the nodes from `first` to `root`, which are one subtree, and their marginals. `above` is the
    /// derivative of what stands above the root.
    fn down(self, cells: &[f64], first: usize, root: usize, below: Below<'_>, above: &[f64]) {
        let Below { derivatives, marginals } = below;
        let (tree, base) = (self.tree, self.tree.offsets[first]);
        if tree.parts[root].down.is_none() && tree.parts[root].parent != root {
            return;
        }
        let visit = |node: usize, derivatives: &mut [f64], marginals: &mut [f64]| {
            let (part, own) = (&tree.parts[node], tree.offsets[node]);
            let place = own.derivative - base.derivative;
            match &part.down {
                Some(down) => {
                    let (before, after) = derivatives.split_at_mut(place + part.cells);
                    let parent = part.parent;
                    let from = match node == root {
                        true => above,
                        false => {
                            let place = tree.offsets[parent].derivative - tree.offsets[node + 1].derivative;
                            &after[place..place + tree.parts[parent].cells]
                        }
                    };
                    let (one, other) = tree.parts[parent].children.expect("internal: a parent has children");
                    let sibling = if one == node { other } else { one };
                    let sibling = tree.value(self.known, cells, 0, sibling);
                    let mask = tree.value(self.known, cells, 0, node);
                    down.run::<false>(&tree.pool, from, sibling, &mut before[place..], Some(mask));
                    rescale(&mut before[place..]);
                }
                None if part.parent == node => derivatives[place..place + part.cells].fill(1.0),
                None => return,
            }
            let mut next = own.marginals - base.marginals;
            for reading in &tree.readings[part.readings.clone()] {
                let marginal = &mut marginals[next..next + reading.extent];
                next += reading.extent;
                self.read(cells, node, &derivatives[place..place + part.cells], reading.kind, marginal);
            }
        };
        let Some((node, one, other)) = tree.split(root) else {
            return (first..=root).rev().for_each(|node| visit(node, derivatives, marginals));
        };
        let start = tree.first[one];
        let around = (node..=root).rev().chain((first..start).rev());
        around.for_each(|node| visit(node, derivatives, marginals));
        let at = |node: usize| tree.offsets[node].derivative - base.derivative;
        let (rest, upper) = derivatives.split_at_mut(at(node));
        let (own, theirs) = rest[at(start)..].split_at_mut(at(one + 1) - at(start));
        let of = |node: usize| tree.offsets[node].marginals - base.marginals;
        let (own_marginals, rest) = marginals[of(start)..].split_at_mut(of(one + 1) - of(start));
        let their_marginals = &mut rest[..of(other + 1) - of(one + 1)];
        let above = &upper[..tree.offsets[node + 1].derivative - tree.offsets[node].derivative];
        rayon::join(
            || self.down(cells, start, one, Below { derivatives: own, marginals: own_marginals }, above),
            || {
                self.down(
                    cells,
                    one + 1,
                    other,
                    Below { derivatives: theirs, marginals: their_marginals },
                    above,
                )
            },
        );
    }

    /// The marginal of a variable at a node with these derivatives.
    fn read(self, cells: &[f64], node: usize, derivatives: &[f64], kind: Kind, marginal: &mut [f64]) {
        marginal.fill(0.0);
        let extent = marginal.len();
        match kind {
            Kind::Within { inner } => {
                let values = self.tree.value(self.known, cells, 0, node);
                let rows = values.chunks_exact(extent * inner).zip(derivatives.chunks_exact(extent * inner));
                for (values, derivatives) in rows {
                    let cells = values.chunks_exact(inner).zip(derivatives.chunks_exact(inner));
                    for (p, (values, derivatives)) in marginal.iter_mut().zip(cells) {
                        let terms =
                            values.iter().zip(derivatives).map(|(value, derivative)| value * derivative);
                        *p += terms.sum::<f64>();
                    }
                }
            }
            Kind::Beyond { start, slicing } => {
                let count = derivatives.len() * extent;
                let table = &self.tree.tables.values[start + self.known.slices[slicing] * count..][..count];
                for (row, derivative) in table.chunks_exact(extent).zip(derivatives) {
                    marginal.iter_mut().zip(row).for_each(|(p, cell)| *p += cell * derivative);
                }
            }
        }
        let total: f64 = marginal.iter().sum();
        if total > 0.0 {
            marginal.iter_mut().for_each(|p| *p /= total);
        }
    }

    /// The observed variables of a table below a node that is zero where they are; where there is none, all that are observed
    /// below it.
    fn observed(self, node: usize) -> Vec<usize> {
        let leaves = (self.tree.first[node]..=node).filter(|leaf| self.tree.parts[*leaf].children.is_none());
        let mut all = Vec::new();
        for leaf in leaves {
            let own: Vec<usize> = match self.tree.parts[leaf].source {
                Source::Table { slice, .. } => {
                    self.tree.tables.slicings[slice].iter().map(|(variable, _)| *variable).collect()
                }
                Source::Own => {
                    let of = |variable: &&usize| self.tree.likelihoods[**variable] == leaf;
                    let own = self.tree.weighed.iter().find(of).copied();
                    own.filter(|variable| self.known.weighed[*variable]).into_iter().collect()
                }
            };
            let is_zero = matches!(self.tree.parts[leaf].source, Source::Table { .. })
                && self.tree.value(self.known, &[], 0, leaf).iter().all(|cell| *cell == 0.0);
            if is_zero && !own.is_empty() {
                return own;
            }
            all.extend(own);
        }
        all
    }
}

/// Takes a power of two out of very small or very large cells; `None` if all are zero.
pub(super) fn rescale(cells: &mut [f64]) -> Option<i64> {
    const SMALL: f64 = 1e-90;
    const LARGE: f64 = 1e90;
    let largest = cells.iter().copied().fold(0.0, f64::max);
    if (SMALL..LARGE).contains(&largest) {
        return Some(0);
    }
    if largest <= 0.0 {
        return None;
    }
    // Within what a power of two may be.
    let exponent = largest.log2().floor().clamp(-1000.0, 1000.0) as i32;
    let factor = 2f64.powi(-exponent);
    cells.iter_mut().for_each(|cell| *cell *= factor);
    Some(exponent.into())
}
