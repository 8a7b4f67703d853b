//! A binary join tree: tables, multiplied two by two.
//!
//! In: the scopes of tables, and an elimination order. Out: a [`Pairing`]: tables at the leaves; each inner node is the
//! product of two nodes, with every variable summed out that no other node has. Invariant: nodes are in post-order, so
//! that a subtree is a contiguous range that ends with its root; the last node is the root.
//!
//! The tables that contain a variable are multiplied when the variable is eliminated, the pair with the smallest
//! product first: a product of many tables is never made in one step (Shenoy 1997, "Binary join trees for computing
//! marginals").

use super::problem::Problem;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A node: a leaf is a table, any other the product of two nodes.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) children: Option<(usize, usize)>,
    /// The node whose child this is; the root is its own parent.
    pub(super) parent: usize,
    /// The variables that remain, ascending.
    pub(super) scope: Vec<u32>,
    /// For a leaf: its index, and its variables that no other leaf has, which are summed out immediately.
    pub(super) leaf: Option<(usize, Vec<u32>)>,
}

/// Nodes in post-order.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairing {
    pub(super) nodes: Vec<Node>,
    /// The first node of the subtree of each.
    pub(super) first: Vec<usize>,
}

/// Up to this number of tables in one product, every pair is compared; more are paired by size.
const FEW: usize = 6;
const MANY: usize = 64;

/// Pairs the leaves that have these scopes.
pub(super) fn pair(problem: &Problem, leaves: &[Vec<u32>], order: &[u32]) -> Pairing {
    let mut forest = Forest::of(problem, leaves);
    for variable in order {
        let mut holders = std::mem::take(&mut forest.holders[*variable as usize]);
        holders.retain(|node| forest.nodes[*node].parent == OPEN);
        if holders.len() <= FEW {
            while holders.len() > 1 {
                let pairs = (0..holders.len()).flat_map(|one| (0..one).map(move |other| (other, one)));
                let best =
                    pairs.map(|(one, other)| (forest.product(holders[one], holders[other]), one, other));
                let best = best.min_by(|one, other| one.0.total_cmp(&other.0));
                let (_, one, other) = best.expect("internal: two nodes are a pair");
                let (second, first) = (holders.swap_remove(other), holders.swap_remove(one));
                let both = forest.join(first, second);
                holders.push(both);
            }
        } else {
            forest.join_by_size(holders);
        }
    }
    let open = (0..forest.nodes.len()).filter(|node| forest.nodes[*node].parent == OPEN).collect();
    forest.join_by_size(open);
    forest.in_post_order()
}

/// Marks a node without a parent.
const OPEN: usize = usize::MAX;

struct Forest<'p> {
    problem: &'p Problem,
    nodes: Vec<Node>,
    /// For each variable the number of open nodes that have it, and the nodes that had it.
    count: Vec<u32>,
    holders: Vec<Vec<usize>>,
}

impl<'p> Forest<'p> {
    fn of(problem: &'p Problem, leaves: &[Vec<u32>]) -> Self {
        let variables = problem.variables.len();
        let mut forest = Self {
            problem,
            nodes: Vec::with_capacity(2 * leaves.len()),
            count: vec![0; variables],
            holders: vec![Vec::new(); variables],
        };
        leaves.iter().flatten().for_each(|one| forest.count[*one as usize] += 1);
        for (leaf, all) in leaves.iter().enumerate() {
            let (mut alone, mut scope) = (Vec::new(), Vec::new());
            for one in all {
                match forest.count[*one as usize] {
                    1 => alone.push(*one),
                    _ => scope.push(*one),
                }
            }
            scope.sort_unstable();
            scope.iter().for_each(|one| forest.holders[*one as usize].push(leaf));
            forest.nodes.push(Node { children: None, parent: OPEN, scope, leaf: Some((leaf, alone)) });
        }
        forest
    }

    /// The cells of the product of two nodes; ties prefer the larger nodes.
    fn product(&self, one: usize, other: usize) -> f64 {
        let (one, other) = (&self.nodes[one].scope, &self.nodes[other].scope);
        let more = other.iter().filter(|variable| one.binary_search(variable).is_err());
        let more: f64 = more.map(|variable| self.problem.cardinalities[*variable as usize] as f64).product();
        let size = self.problem.cells(one);
        size * more - 1e-3 * (size + self.problem.cells(other))
    }

    /// Makes the product of two nodes.
    fn join(&mut self, one: usize, other: usize) -> usize {
        let node = self.nodes.len();
        let (first, second) = (&self.nodes[one].scope, &self.nodes[other].scope);
        let mut scope = Vec::with_capacity(first.len() + second.len());
        let (mut left, mut right) = (first.iter().peekable(), second.iter().peekable());
        loop {
            let variable = match (left.peek(), right.peek()) {
                (None, None) => break,
                (Some(one), Some(other)) if one == other => {
                    let variable = **one;
                    left.next();
                    right.next();
                    self.count[variable as usize] -= 1;
                    // No other open node has it: it is summed out.
                    if self.count[variable as usize] == 1 {
                        continue;
                    }
                    variable
                }
                (Some(one), other) if other.is_none_or(|other| one < other) => {
                    let variable = **one;
                    left.next();
                    variable
                }
                (_, other) => {
                    let variable = **other.expect("internal: one of both has more");
                    right.next();
                    variable
                }
            };
            scope.push(variable);
        }
        scope.iter().for_each(|variable| self.holders[*variable as usize].push(node));
        self.nodes[one].parent = node;
        self.nodes[other].parent = node;
        self.nodes.push(Node { children: Some((one, other)), parent: OPEN, scope, leaf: None });
        node
    }

    /// Joins many nodes: the smallest with its best partner, or the two smallest where comparing would take too long.
    fn join_by_size(&mut self, nodes: Vec<usize>) {
        let size = |forest: &Self, node: usize| forest.problem.cells(&forest.nodes[node].scope).to_bits();
        let mut rest: BinaryHeap<Reverse<(u64, usize)>> =
            nodes.into_iter().map(|node| Reverse((size(self, node), node))).collect();
        while rest.len() > 1 {
            let Some(Reverse((_, smallest))) = rest.pop() else { break };
            let partner = match rest.len() <= MANY {
                false => rest.pop().map(|Reverse((_, node))| node),
                true => {
                    let nodes = rest.iter().map(|Reverse((_, node))| *node);
                    let best = nodes.map(|node| (self.product(smallest, node), node));
                    let best = best.min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
                    let best = best.map(|(_, node)| node);
                    rest.retain(|Reverse((_, node))| Some(*node) != best);
                    best
                }
            };
            let Some(partner) = partner else { break };
            let both = self.join(smallest, partner);
            rest.push(Reverse((size(self, both), both)));
        }
    }

    fn in_post_order(mut self) -> Pairing {
        let mut order = Vec::with_capacity(self.nodes.len());
        // The root, then its descendants: read backwards, each node follows its subtree.
        let mut rest: Vec<usize> = self.nodes.len().checked_sub(1).into_iter().collect();
        while let Some(node) = rest.pop() {
            order.push(node);
            rest.extend(self.nodes[node].children.into_iter().flat_map(|(one, other)| [one, other]));
        }
        order.reverse();
        let mut new = vec![0; self.nodes.len()];
        order.iter().enumerate().for_each(|(number, node)| new[*node] = number);
        let mut pairing =
            Pairing { nodes: Vec::with_capacity(order.len()), first: Vec::with_capacity(order.len()) };
        for (number, old) in order.into_iter().enumerate() {
            let node = &mut self.nodes[old];
            let children = node.children.map(|(one, other)| (new[one], new[other]));
            let parent = if node.parent == OPEN { number } else { new[node.parent] };
            pairing.first.push(children.map_or(number, |(first, _)| pairing.first[first]));
            let (scope, leaf) = (std::mem::take(&mut node.scope), node.leaf.take());
            pairing.nodes.push(Node { children, parent, scope, leaf });
        }
        pairing
    }
}
