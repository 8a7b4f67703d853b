//! Where marginals are read.
//!
//! In: a tree, and the wanted variables. Out: for each a [`Reading`]: the node whose cells, times their derivatives,
//! are the joint probability with the evidence, to be summed to the variable. Invariant: ∂P(e)/∂T at a node's cells,
//! times T, is P(cells, e) (Darwiche 2003, "A differential approach to inference in Bayesian networks").
//!
//! A variable is in many nodes. It is read at the one with the least work, counting derivatives that no other reading
//! needs.

use super::compile::{Leaf, Part};
use super::pair::Pairing;
use super::table::{Builder, Tables};

/// One marginal.
#[derive(Clone, Debug)]
pub(super) struct Reading {
    /// Its number in the network.
    pub(super) variable: usize,
    pub(super) extent: usize,
    pub(super) kind: Kind,
}

/// How a marginal is read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// The node has the variable; `inner` contiguous cells for each value.
    Within { inner: usize },
    /// Only the leaf's table has it: where a table with the variable as its last axis begins, and its slicing.
    Beyond { start: usize, slicing: usize },
}

/// The readings of a tree.
pub(super) struct Readings {
    /// In the order of their nodes.
    pub(super) all: Vec<Reading>,
    /// Which nodes need a derivative.
    pub(super) active: Vec<bool>,
}

/// Chooses a node for each wanted variable that is free.
pub(super) fn place(
    builder: &Builder<'_>,
    (pairing, axes, leaves): (&Pairing, &[Vec<u32>], &[Leaf]),
    parts: &mut [Part],
    wanted: &[usize],
    tables: &mut Tables,
) -> Readings {
    let problem = builder.problem;
    let mut is_wanted = vec![false; problem.variables.len()];
    let mut own: Vec<(usize, usize)> = problem.variables.iter().copied().zip(0..).collect();
    own.sort_unstable();
    for variable in wanted {
        if let Ok(place) = own.binary_search_by_key(variable, |(one, _)| *one) {
            is_wanted[own[place].1] = true;
        }
    }
    let mut having: Vec<Vec<usize>> = vec![Vec::new(); problem.variables.len()];
    for (number, node) in pairing.nodes.iter().enumerate() {
        let alone = node.leaf.iter().flat_map(|(_, alone)| alone);
        let here = node.scope.iter().chain(alone).filter(|axis| is_wanted[**axis as usize]);
        here.for_each(|axis| having[*axis as usize].push(number));
    }
    let mut active = vec![false; parts.len()];
    let mut homes = Vec::new();
    for (axis, nodes) in having.iter().enumerate().filter(|(axis, _)| is_wanted[*axis]) {
        let (mut best, mut least) = (None, f64::INFINITY);
        for node in nodes {
            let (mut above, mut cost) = (*node, parts[*node].cells as f64);
            while !active[above] && cost < least && parts[above].parent != above {
                above = parts[above].parent;
                cost += parts[above].up.map_or(0.0, |up| up.cells);
            }
            if cost < least {
                (best, least) = (Some(*node), cost);
            }
        }
        let Some(node) = best else { continue };
        let mut above = node;
        while !std::mem::replace(&mut active[above], true) {
            above = parts[above].parent;
        }
        homes.push((node, axis as u32));
    }
    homes.sort_unstable();
    let mut all: Vec<Reading> = Vec::with_capacity(homes.len());
    for (node, axis) in homes {
        let kind = match axes[node].iter().position(|one| *one == axis) {
            Some(place) => {
                let inner = axes[node][place + 1..].iter().map(|one| problem.cardinalities[*one as usize]);
                Kind::Within { inner: inner.product() }
            }
            None => {
                let (leaf, alone) =
                    pairing.nodes[node].leaf.as_ref().expect("internal: only a leaf sums alone");
                let Leaf::Table(table) = leaves[*leaf] else { unreachable!("internal: only tables do") };
                let others: Vec<u32> = alone.iter().copied().filter(|one| *one != axis).collect();
                let (start, _, slicing) =
                    tables.keep(builder, table, &[axes[node].as_slice(), &[axis]].concat(), &others);
                Kind::Beyond { start, slicing }
            }
        };
        if all.len() == parts[node].readings.end || parts[node].readings.is_empty() {
            let start = if parts[node].readings.is_empty() { all.len() } else { parts[node].readings.start };
            parts[node].readings = start..all.len() + 1;
        }
        let variable = problem.variables[axis as usize];
        all.push(Reading { variable, extent: problem.cardinalities[axis as usize], kind });
    }
    Readings { all, active }
}
