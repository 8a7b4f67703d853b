//! Two passes over a join tree: products up to the root, derivatives down again.
//!
//! In: a [`Tree`] and evidence. Out: the cells of every node, and every wanted marginal. Invariant: a power of two is
//! taken out of tables with very small or very large cells, and where the cells of one table are too far apart for
//! that, all are recomputed with separate exponents: no nonzero cell underflows unnoticed. Subtrees, and the cells of a
//! large product, are independent: they may be computed in parallel, and the result does not depend on the number of
//! threads.
//!
//! up:   T_p = Σ T_a · T_b         over the variables that no other node has.
//! down: D_a = Σ D_p · T_b,  D_b = Σ D_p · T_a,  D_root = 1:  D = ∂P(e)/∂T, and P(cells, e) = T · D.

use super::cell::Cell;
use super::compile::{Cells, Tree};
use super::contraction::WORTH_SHARING;
use super::evidence::Known;
use super::reading::Kind;
use std::sync::atomic::{AtomicBool, Ordering};

/// The powers of two taken out on the way up.
#[derive(Clone, Copy, Default)]
pub(super) struct Taken {
    pub(super) exponent: i64,
    /// Those of them that scaled small products up.
    pub(super) fallen: i64,
}

impl Taken {
    fn and(self, other: Self) -> Self {
        Self { exponent: self.exponent + other.exponent, fallen: self.fallen + other.fallen }
    }
}

impl Tree {
    /// The cells of a node, from the cells of a range of nodes that starts at `first`.
    pub(super) fn value<'c, T: Cell>(
        &'c self,
        known: &Known,
        cells: &'c [T],
        first: usize,
        node: usize,
    ) -> &'c [T] {
        let count = self.parts[node].cells;
        match self.parts[node].source {
            Cells::Table { start, slice, .. } => {
                &T::tables(self)[start + known.slices[slice] * count..][..count]
            }
            Cells::Own => &cells[self.offsets[node].value - self.offsets[first].value..][..count],
        }
    }

    /// Where the likelihood of a weighed variable is stored.
    pub(super) fn likelihood(&self, variable: usize) -> std::ops::Range<usize> {
        let start = self.offsets[self.likelihoods[variable]].value;
        start..start + self.cardinalities[variable]
    }

    /// A node of a subtree both of whose children have enough work for a thread of their own.
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

/// One question during propagation.
#[derive(Clone, Copy)]
pub(super) struct Pass<'s> {
    pub(super) tree: &'s Tree,
    pub(super) known: &'s Known,
    /// Set where a derivative may have underflowed; `None` where that cannot happen.
    pub(super) watch: Option<&'s AtomicBool>,
}

/// The arrays of a range of nodes that the downward pass needs.
pub(super) struct Below<'s, T> {
    pub(super) derivatives: &'s mut [T],
    pub(super) marginals: &'s mut [T],
}

impl Pass<'_> {
    /// Computes the nodes from `first` to `root`, which form one subtree. Returns the power of two taken out of them,
    /// or the first node that is zero everywhere.
    pub(super) fn up<T: Cell, const MAXIMUM: bool>(
        self,
        first: usize,
        root: usize,
        cells: &mut [T],
    ) -> Result<Taken, usize> {
        let Some((node, one, other)) = self.tree.split(root) else {
            return self.stretch::<T, MAXIMUM>(first, first..root + 1, cells);
        };
        let at = |node: usize| self.tree.offsets[node].value - self.tree.offsets[first].value;
        let start = self.tree.first[one];
        let taken = self.stretch::<T, MAXIMUM>(first, first..start, cells)?;
        let (_, rest) = cells.split_at_mut(at(start));
        let (own, rest) = rest.split_at_mut(at(one + 1) - at(start));
        let (theirs, _) = rest.split_at_mut(at(other + 1) - at(one + 1));
        let (found, also) = rayon::join(
            || self.up::<T, MAXIMUM>(start, one, own),
            || self.up::<T, MAXIMUM>(one + 1, other, theirs),
        );
        let taken = taken.and(found?).and(also?);
        Ok(taken.and(self.stretch::<T, MAXIMUM>(first, node..root + 1, cells)?))
    }

    /// Computes a range of nodes, one after the other; `cells` are those from `first` on.
    fn stretch<T: Cell, const MAXIMUM: bool>(
        self,
        first: usize,
        nodes: std::ops::Range<usize>,
        cells: &mut [T],
    ) -> Result<Taken, usize> {
        let mut taken = Taken::default();
        for node in nodes {
            let part = &self.tree.parts[node];
            let (Some(up), Some((one, other)), false) = (&part.up, part.children, part.constant) else {
                continue;
            };
            let place = self.tree.offsets[node].value - self.tree.offsets[first].value;
            let (before, own) = cells.split_at_mut(place);
            let own = &mut own[..part.cells];
            let value = |child: usize| self.tree.value(self.known, before, first, child);
            up.run::<T, MAXIMUM>(&self.tree.pool, value(one), value(other), own, None);
            let exponent = T::rescale(own).ok_or(node)?;
            taken = taken.and(Taken { exponent, fallen: exponent.min(0) });
        }
        Ok(taken)
    }

    /// Whether a product on the way up may have lost a cell.
    pub(super) fn has_lost<T: Cell>(self, cells: &[T]) -> bool {
        let value = |node: usize| self.tree.value(self.known, cells, 0, node);
        let mut products =
            self.tree.parts.iter().filter(|part| !part.constant).filter_map(|part| part.children);
        products.any(|(one, other)| T::may_lose(value(one), value(other)))
    }

    /// Computes the derivatives of the nodes from `first` to `root`, which form one subtree, and their marginals.
    /// `above` is the derivative of the root's parent.
    pub(super) fn down<T: Cell>(
        self,
        cells: &[T],
        first: usize,
        root: usize,
        below: Below<'_, T>,
        above: &[T],
    ) {
        let Below { derivatives, marginals } = below;
        let (tree, base) = (self.tree, self.tree.offsets[first]);
        if tree.parts[root].down.is_none() && tree.parts[root].parent != root {
            return;
        }
        let visit = |node: usize, derivatives: &mut [T], marginals: &mut [T]| {
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
                    if let Some(lost) = self.watch.filter(|_| T::may_lose(from, sibling)) {
                        lost.store(true, Ordering::Relaxed);
                    }
                    down.run::<T, false>(&tree.pool, from, sibling, &mut before[place..], Some(mask));
                    T::rescale(&mut before[place..]);
                }
                None if part.parent == node => derivatives[place..place + part.cells].fill(T::ONE),
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
    fn read<T: Cell>(self, cells: &[T], node: usize, derivatives: &[T], kind: Kind, marginal: &mut [T]) {
        marginal.fill(T::ZERO);
        let extent = marginal.len();
        match kind {
            Kind::Within { inner } => {
                let values = self.tree.value(self.known, cells, 0, node);
                let rows = values.chunks_exact(extent * inner).zip(derivatives.chunks_exact(extent * inner));
                for (values, derivatives) in rows {
                    let cells = values.chunks_exact(inner).zip(derivatives.chunks_exact(inner));
                    for (p, (values, derivatives)) in marginal.iter_mut().zip(cells) {
                        let terms =
                            values.iter().zip(derivatives).map(|(value, derivative)| *value * *derivative);
                        *p = *p + terms.sum::<T>();
                    }
                }
            }
            Kind::Beyond { start, slicing } => {
                let count = derivatives.len() * extent;
                let table = &T::tables(self.tree)[start + self.known.slices[slicing] * count..][..count];
                for (row, derivative) in table.chunks_exact(extent).zip(derivatives) {
                    marginal.iter_mut().zip(row).for_each(|(p, cell)| *p = *p + *cell * *derivative);
                }
            }
        }
        let total: T = marginal.iter().copied().sum();
        if total > T::ZERO {
            marginal.iter_mut().for_each(|p| *p = *p / total);
        }
    }

    /// The observed variables of a table below a node that is zero at their values; where there is no such table, all
    /// variables observed below the node.
    pub(super) fn observed<T: Cell>(self, node: usize) -> Vec<usize> {
        let leaves = (self.tree.first[node]..=node).filter(|leaf| self.tree.parts[*leaf].children.is_none());
        let mut all = Vec::new();
        for leaf in leaves {
            let own: Vec<usize> = match self.tree.parts[leaf].source {
                Cells::Table { slice, .. } => {
                    self.tree.tables.slicings[slice].iter().map(|(variable, _)| *variable).collect()
                }
                Cells::Own => {
                    let of = |variable: &&usize| self.tree.likelihoods[**variable] == leaf;
                    let own = self.tree.weighed.iter().find(of).copied();
                    own.filter(|variable| self.known.weighed[*variable]).into_iter().collect()
                }
            };
            let is_zero = matches!(self.tree.parts[leaf].source, Cells::Table { .. })
                && self.tree.value::<T>(self.known, &[], 0, leaf).iter().all(|cell| *cell == T::ZERO);
            if is_zero && !own.is_empty() {
                return own;
            }
            all.extend(own);
        }
        all
    }
}
