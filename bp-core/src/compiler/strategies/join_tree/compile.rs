//! Compilation of a network into a join tree.
//!
//! In: a network; which variables will be given, which may be weighed, which are wanted. Out: a [`Tree`]: for each node
//! its products up and down, and where marginals are read. Invariant: everything that does not depend on the evidence
//! is computed here; a question allocates only what a [`Session`](super::Session) keeps.

use super::cell::Cell;
use super::contraction::{Contraction, Pool};
use super::cost::Cost;
use super::layout::{Layout, lay_out};
use super::network::Network;
use super::pair::{Pairing, pair};
use super::problem::Problem;
use super::reading::{Reading, Readings, place};
use super::refused::Refused;
use super::table::{Builder, CONSTANT, Tables};
use crate::elimination::{Effort, HOPELESS};
use crate::error::Error;
use crate::exec::scalar::Extended;
use std::collections::HashSet;
use std::ops::Range;
use std::sync::OnceLock;

/// Where the cells of a node are stored.
#[derive(Clone, Debug)]
pub(super) enum Cells {
    /// In the tree's tables: where the cells and the exponents of their slices begin, and the slicing that selects a
    /// slice.
    Table { start: usize, exponents: usize, slice: usize },
    /// In the working memory of the session.
    Own,
}

/// A node.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) source: Cells,
    pub(super) cells: usize,
    pub(super) children: Option<(usize, usize)>,
    pub(super) parent: usize,
    /// The product of the children.
    pub(super) up: Option<Contraction>,
    /// The derivative by this node, where a node below needs it.
    pub(super) down: Option<Contraction>,
    /// The marginals read at this node, as a range of the tree's readings.
    pub(super) readings: std::ops::Range<usize>,
    /// Whether its cells are the same for all evidence.
    pub(super) constant: bool,
}

/// A join tree that answers any number of questions.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(super) cardinalities: Vec<usize>,
    pub(super) given: Vec<bool>,
    /// The variables whose values are given.
    pub(super) given_variables: Vec<usize>,
    pub(super) weighed: Vec<usize>,
    /// For each variable the node of its likelihood; `usize::MAX` where it has no likelihood.
    pub(super) likelihoods: Vec<usize>,
    pub(super) parts: Vec<Part>,
    /// The first node of the subtree of each node.
    pub(super) first: Vec<usize>,
    /// The number of products in the subtree of each node.
    pub(super) work: Vec<f64>,
    /// Where the cells, derivative and marginals of each node begin; last, the total sizes.
    pub(super) offsets: Vec<Offsets>,
    pub(super) readings: Vec<Reading>,
    pub(super) tables: Tables,
    /// The contexts in which a form refused a number.
    pub(super) refused: Vec<Refused>,
    /// Where ln P(evidence) is below this, cells that underflow in f64 may matter; −∞ where no cell underflows.
    pub(super) ln_least: f64,
    /// The numbers of the tables with separate exponents, made on first use.
    pub(super) extended: OnceLock<Vec<Extended>>,
    pub(super) pool: Pool,
    /// The range of each variable's marginal; empty for a variable without one.
    pub(super) places: Vec<std::ops::Range<usize>>,
    /// For each node its variables, by their numbers in the network, slowest first; filled only for most probable
    /// assignments.
    pub(super) scopes: Vec<Vec<usize>>,
    cost: Cost,
}

/// The offsets of a node's arrays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offsets {
    pub(super) value: usize,
    pub(super) derivative: usize,
    pub(super) marginals: usize,
}

/// The shape of a tree before its tables are made, from which its cost is known.
pub(super) struct Outline {
    problem: Problem,
    pairing: Pairing,
    /// For each leaf its table, or the variable of its likelihood.
    leaves: Vec<Leaf>,
    pub(super) cost: Cost,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Leaf {
    Table(usize),
    Likelihood(u32),
}

impl Outline {
    /// `weighed` is indexed by the network's numbers.
    pub(super) fn of(problem: Problem, weighed: &[bool], effort: Effort) -> Self {
        let order = problem.triangulated(effort);
        let mut leaves: Vec<Leaf> = (0..problem.tables.len()).map(Leaf::Table).collect();
        let mut scopes = problem.scopes.clone();
        let mut has = vec![false; problem.variables.len()];
        scopes.iter().flatten().for_each(|one| has[*one as usize] = true);
        for (own, variable) in problem.variables.iter().enumerate() {
            if weighed[*variable] || !has[own] {
                leaves.push(Leaf::Likelihood(own as u32));
                scopes.push(vec![own as u32]);
            }
        }
        let (pairing, cost) = match order.cells.is_finite() {
            true => {
                let pairing = pair(&problem, &scopes, &order.variables);
                let cost = Cost::of_pairing(&problem, &pairing);
                (pairing, cost)
            }
            false => (Pairing::default(), Cost::beyond(HOPELESS)),
        };
        Self { problem, pairing, leaves, cost }
    }
}

/// The operation of a tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Purpose {
    /// Sums: marginals, the probability of the evidence.
    Sum,
    /// Largest values: the most probable assignment.
    Maximum,
}

fn flags(count: usize, which: &[usize]) -> Vec<bool> {
    let mut flags = vec![false; count];
    which.iter().for_each(|one| flags[*one] = true);
    flags
}

impl Tree {
    /// One join tree of the whole network. The values of `given` variables are part of each question; `weighed`
    /// variables may get a value or a likelihood. Marginals are computed for `wanted` variables.
    ///
    /// # Errors
    /// Memory does not hold it.
    pub fn new(
        network: &Network,
        given: &[usize],
        weighed: &[usize],
        wanted: &[usize],
    ) -> Result<Self, Error> {
        Self::whole(network, given, weighed, wanted, Purpose::Sum)
    }

    pub(super) fn whole(
        network: &Network,
        given: &[usize],
        weighed: &[usize],
        wanted: &[usize],
        purpose: Purpose,
    ) -> Result<Self, Error> {
        let count = network.cardinalities.len();
        let given = flags(count, given);
        let problem = Problem::of(network, &given, None);
        let outline = Outline::of(problem, &flags(count, weighed), Effort::Search);
        outline.cost.fits()?;
        Ok(Self::from_outline(network, &given, outline, wanted, purpose))
    }

    /// The cost of the tree, without making it.
    pub fn cost_of(network: &Network, given: &[usize]) -> Cost {
        let count = network.cardinalities.len();
        let problem = Problem::of(network, &flags(count, given), None);
        Outline::of(problem, &flags(count, &[]), Effort::Search).cost
    }

    /// The cost of the tree.
    pub fn cost(&self) -> Cost {
        self.cost
    }

    pub(super) fn from_outline(
        network: &Network,
        given: &[bool],
        outline: Outline,
        wanted: &[usize],
        purpose: Purpose,
    ) -> Self {
        let Outline { problem, pairing, leaves, mut cost } = outline;
        let extents = &problem.cardinalities;
        let density: Vec<f64> = leaves
            .iter()
            .map(|leaf| match leaf {
                Leaf::Table(table) => network.tables[problem.tables[*table]].density(),
                Leaf::Likelihood(_) => 1.0,
            })
            .collect();
        let Layout { axes, rows } = lay_out(&pairing, extents, &density);
        let builder = Builder::new(network, &problem, given);
        let mut tables = Tables::new(&builder);
        let mut pool = Pool::new();
        let mut likelihoods = vec![usize::MAX; network.cardinalities.len()];
        let mut parts: Vec<Part> = Vec::with_capacity(pairing.nodes.len());
        for (number, node) in pairing.nodes.iter().enumerate() {
            let leaf = node.leaf.as_ref().map(|(leaf, alone)| (leaves[*leaf], alone));
            let (source, constant) = match (leaf, node.children) {
                (Some((Leaf::Table(table), alone)), _) => {
                    let (start, exponents, slice) = tables.keep(&builder, table, &axes[number], alone);
                    (Cells::Table { start, exponents, slice }, slice == CONSTANT)
                }
                (Some((Leaf::Likelihood(own), _)), _) => {
                    likelihoods[problem.variables[own as usize]] = number;
                    (Cells::Own, false)
                }
                (None, children) => {
                    let constant = children.is_some_and(|(first, second): (usize, usize)| {
                        parts[first].constant && parts[second].constant
                    });
                    (Cells::Own, constant)
                }
            };
            let up = node.children.map(|(first, second)| {
                Contraction::of(&axes[number], &axes[first], &axes[second], &rows[number], extents, &mut pool)
            });
            let cells = axes[number].iter().map(|axis| extents[*axis as usize]).product();
            let (children, parent) = (node.children, node.parent);
            parts.push(Part { source, cells, children, parent, up, down: None, readings: 0..0, constant });
        }
        keep_constants(&mut parts, &mut tables, &pool, purpose);
        let shape = (&pairing, axes.as_slice(), leaves.as_slice());
        let Readings { all: readings, active } = place(&builder, shape, &mut parts, wanted, &mut tables);
        for number in 0..parts.len() {
            let parent = parts[number].parent;
            if !active[number] || parent == number {
                continue;
            }
            let (first, second) = parts[parent].children.expect("internal: a parent has children");
            let sibling = if first == number { second } else { first };
            let (z, x, y) = (&axes[number], &axes[parent], &axes[sibling]);
            parts[number].down = Some(Contraction::of(z, x, y, &rows[parent], extents, &mut pool));
        }
        let (mut offsets, mut next) = (Vec::with_capacity(parts.len() + 1), Offsets::default());
        let mut places = vec![0..0; network.cardinalities.len()];
        let mut work: Vec<f64> = Vec::with_capacity(parts.len());
        for (number, part) in parts.iter().enumerate() {
            offsets.push(next);
            if matches!(part.source, Cells::Own) {
                next.value += part.cells;
            }
            if part.down.is_some() || part.parent == number {
                next.derivative += part.cells;
            }
            for reading in &readings[part.readings.clone()] {
                let end = next.marginals + network.cardinalities[reading.variable];
                places[reading.variable] = next.marginals..end;
                next.marginals = end;
            }
            let below = part.children.map_or(0.0, |(first, second)| work[first] + work[second]);
            work.push(below + part.up.map_or(0.0, |up| up.cells));
        }
        offsets.push(next);
        let wide = tables.wide.take();
        cost.bytes = 8.0 * (next.value + next.derivative + tables.values.len()) as f64
            + 16.0 * wide.as_ref().map_or(0, Vec::len) as f64;
        let ln_least = match &wide {
            Some(_) => {
                problem.tables.iter().map(|table| ln_ceiling(&network.tables[*table].values)).sum::<f64>()
                    + LN_LOST
            }
            None => f64::NEG_INFINITY,
        };
        let own: HashSet<usize> = problem.tables.iter().chain(&problem.known).copied().collect();
        let refused = network.refused.iter().filter(|refused| own.contains(&refused.table));
        let refused: Vec<Refused> = refused.cloned().collect();
        let scopes = match purpose {
            Purpose::Sum => Vec::new(),
            Purpose::Maximum => scopes(&problem, &pairing, &axes),
        };
        Self {
            cardinalities: network.cardinalities.clone(),
            given: given.to_vec(),
            given_variables: (0..given.len()).filter(|one| given[*one]).collect(),
            weighed: (0..given.len()).filter(|one| likelihoods[*one] != usize::MAX).collect(),
            likelihoods,
            parts,
            first: pairing.first,
            work,
            offsets,
            readings,
            tables,
            refused,
            ln_least,
            extended: wide.map_or_else(OnceLock::new, OnceLock::from),
            pool,
            places,
            scopes,
            cost,
        }
    }
}

/// ln 10⁻¹⁵⁰: where the total is at least this, the cells that f64 loses sum to less than 10⁻¹⁵⁰.
const LN_LOST: f64 = -150.0 * std::f64::consts::LN_10;

/// ln of the largest number, or of 1 where that is larger.
pub(super) fn ln_ceiling(numbers: &[f64]) -> f64 {
    numbers.iter().copied().fold(1.0, f64::max).ln()
}

/// Computes the nodes that do not depend on the evidence; they become tables like those of the network. A node that
/// might lose a cell in f64 is computed with each question instead.
fn keep_constants(parts: &mut [Part], tables: &mut Tables, pool: &Pool, purpose: Purpose) {
    for number in 0..parts.len() {
        let (Some(up), Some((first, second)), true) =
            (parts[number].up, parts[number].children, parts[number].constant)
        else {
            continue;
        };
        let cells = |child: usize| match parts[child].source {
            Cells::Table { start, .. } => Some(start..start + parts[child].cells),
            Cells::Own => None,
        };
        let both = cells(first).zip(cells(second));
        let values = |range: &Range<usize>| &tables.values[range.clone()];
        let Some((one, other)) = both.filter(|(one, other)| !f64::may_lose(values(one), values(other)))
        else {
            parts[number].constant = false;
            continue;
        };
        let mut own = product(&up, pool, (values(&one), values(&other)), parts[number].cells, purpose);
        let exponent = f64::rescale(&mut own).unwrap_or(0);
        if let Some(wide) = &tables.wide {
            let mut own = product(&up, pool, (&wide[one], &wide[other]), parts[number].cells, purpose);
            own.iter_mut().for_each(|cell| *cell = cell.times_power_of_two(-exponent));
            tables.wide.iter_mut().for_each(|wide| wide.extend(&own));
        }
        tables.exponent += exponent;
        let exponents = tables.exponents.len();
        tables.exponents.push(0);
        parts[number].source = Cells::Table { start: tables.values.len(), exponents, slice: CONSTANT };
        tables.values.extend_from_slice(&own);
    }
}

/// The cells of a node that does not depend on the evidence.
fn product<T: Cell>(
    up: &Contraction,
    pool: &Pool,
    (one, other): (&[T], &[T]),
    cells: usize,
    purpose: Purpose,
) -> Vec<T> {
    let mut own = vec![T::ZERO; cells];
    match purpose {
        Purpose::Sum => up.run::<T, false>(pool, one, other, &mut own, None),
        Purpose::Maximum => up.run::<T, true>(pool, one, other, &mut own, None),
    }
    own
}

/// The variables of each node by their numbers in the network, followed by those that only this leaf has.
fn scopes(problem: &Problem, pairing: &Pairing, axes: &[Vec<u32>]) -> Vec<Vec<usize>> {
    let of = |axis: &u32| problem.variables[*axis as usize];
    let all = pairing.nodes.iter().zip(axes).map(|(node, axes)| {
        let alone = node.leaf.iter().flat_map(|(_, alone)| alone);
        axes.iter().chain(alone).map(of).collect()
    });
    all.collect()
}
