//! Triangulation: an order in which to eliminate the variables of a graph.
//!
//! In: which variables stand in a table together. Out: an [`Order`] and the cells of the cliques that it makes. Invariant:
//! the same graph gives the same order. Finding the best one is NP-hard. Variables whose neighbours are all neighbours of
//! each other cost nothing that any order could save: they go first. For what is left, greedy rules are tried with ties
//! broken by a seeded generator, and the order of least cells is kept (Kjærulff 1990; Koller and Friedman 2009, 9.4.3).

use super::problem::Problem;
use super::scores::{Graph, Rule, Scores};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An order of elimination.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    pub(super) variables: Vec<u32>,
    /// Σ over the variables of the cells of the clique that their elimination makes; infinite, and no variables, where that
    /// is so much that no order was looked for to the end.
    pub(super) cells: f64,
    /// Variables of the largest clique.
    pub(super) width: usize,
}

/// How hard to look for an order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Effort {
    /// One try.
    Glance,
    /// More tries where a better order would save more.
    Search,
}

/// So many cells are too many for any machine.
pub(super) const HOPELESS: f64 = 1e15;

/// An order for a problem.
pub(super) fn triangulate(problem: &Problem, effort: Effort) -> Order {
    let mut graph = Graph::of(problem);
    let mut order = Order::default();
    let core = graph.strip(&mut order);
    if core.is_empty() {
        return order;
    }
    let graph = graph.restricted(&core);
    let size: usize = graph.neighbours.iter().map(Vec::len).sum::<usize>() + core.len();
    let first = graph.clone().eliminate(Rule::Fill, 0, HOPELESS);
    let Some(mut best) = first else {
        return Order { variables: Vec::new(), cells: f64::INFINITY, ..order };
    };
    // One try costs some hundred operations for each edge; a propagation costs a few for each cell.
    let tries = match effort {
        Effort::Glance => 0,
        Effort::Search => ((order.cells + best.cells) / (60.0 * size as f64)).clamp(1.0, 40.0) as u64,
    };
    let rules = [Rule::Fill, Rule::WeightedFill, Rule::Weight];
    for attempt in 1..=tries {
        let rule = rules[attempt as usize % rules.len()];
        if let Some(found) = graph.clone().eliminate(rule, attempt, best.cells) {
            best = found;
        }
    }
    order.variables.extend(best.variables.iter().map(|one| core[*one as usize]));
    order.cells += best.cells;
    order.width = order.width.max(best.width);
    order
}

impl Graph {
    /// Variables that stand in a table together are neighbours. Lists are ascending.
    fn of(problem: &Problem) -> Self {
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); problem.variables.len()];
        for scope in &problem.scopes {
            for one in scope {
                neighbours[*one as usize].extend(scope.iter().filter(|other| *other != one));
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Self { neighbours, cardinality: problem.cardinalities.iter().map(|count| *count as f64).collect() }
    }

    /// Eliminates, one after the other, variables whose neighbours are neighbours of each other. Gives the rest.
    fn strip(&mut self, order: &mut Order) -> Vec<u32> {
        let count = self.neighbours.len();
        let mut done = vec![false; count];
        let mut degree: Vec<u64> = self.neighbours.iter().map(|list| list.len() as u64).collect();
        // Pairs of neighbours that are no neighbours of each other.
        let mut missing: Vec<u64> = degree.iter().map(|degree| degree * degree.saturating_sub(1)).collect();
        for one in 0..count {
            for other in self.neighbours[one].iter().map(|other| *other as usize).filter(|other| *other > one)
            {
                let (few, many) = if degree[one] < degree[other] { (one, other) } else { (other, one) };
                let many = &self.neighbours[many];
                let common = self.neighbours[few].iter().filter(|both| many.binary_search(both).is_ok());
                let common = common.count() as u64;
                missing[one] -= common;
                missing[other] -= common;
            }
        }
        missing.iter_mut().for_each(|pairs| *pairs /= 2);
        let mut ready: Vec<u32> = (0..count as u32).rev().filter(|one| missing[*one as usize] == 0).collect();
        while let Some(one) = ready.pop() {
            if std::mem::replace(&mut done[one as usize], true) {
                continue;
            }
            let around = std::mem::take(&mut self.neighbours[one as usize]);
            let own = degree[one as usize];
            let mut cells = self.cardinality[one as usize];
            for other in around.into_iter().filter(|other| !done[*other as usize]) {
                let other = other as usize;
                cells *= self.cardinality[other];
                // The neighbours of `other` that are none of `one` are no longer missing beside it.
                let before = missing[other];
                missing[other] -= degree[other] - own;
                degree[other] -= 1;
                if before > 0 && missing[other] == 0 {
                    ready.push(other as u32);
                }
            }
            order.variables.push(one);
            order.cells += cells;
            order.width = order.width.max(own as usize + 1);
        }
        (0..count as u32).filter(|one| !done[*one as usize]).collect()
    }

    /// The graph of some of its variables, numbered by their place among them.
    fn restricted(&self, core: &[u32]) -> Self {
        let mut place = vec![u32::MAX; self.neighbours.len()];
        core.iter().enumerate().for_each(|(number, one)| place[*one as usize] = number as u32);
        let neighbours = core.iter().map(|one| {
            let list = self.neighbours[*one as usize].iter().map(|other| place[*other as usize]);
            list.filter(|other| *other != u32::MAX).collect()
        });
        Self {
            neighbours: neighbours.collect(),
            cardinality: core.iter().map(|one| self.cardinality[*one as usize]).collect(),
        }
    }

    /// Eliminates all variables by one rule; `None` as soon as that takes `most` cells.
    fn eliminate(mut self, rule: Rule, seed: u64, most: f64) -> Option<Order> {
        let count = self.neighbours.len();
        let mut scores = Scores::of(&self, rule);
        let mut version = vec![0u32; count];
        let mut queue: BinaryHeap<Reverse<(u64, u64, u32, u32)>> = BinaryHeap::with_capacity(2 * count);
        let entry = |score: f64, variable: u32, version: u32| {
            // Scores are not negative, so that their bits are in their order; then the tie-break.
            Reverse((score.max(0.0).to_bits(), mix(seed ^ u64::from(variable)), variable, version))
        };
        (0..count as u32).for_each(|one| queue.push(entry(scores.of_variable(&self, one), one, 0)));
        let mut order = Order::default();
        while let Some(Reverse((_, _, variable, found))) = queue.pop() {
            if version[variable as usize] != found {
                continue;
            }
            // None of its other entries holds any more.
            version[variable as usize] = u32::MAX;
            let around: f64 = self.neighbours[variable as usize]
                .iter()
                .map(|one| self.cardinality[*one as usize])
                .product();
            order.cells += around * self.cardinality[variable as usize];
            if order.cells >= most {
                return None;
            }
            order.variables.push(variable);
            order.width = order.width.max(self.neighbours[variable as usize].len() + 1);
            scores.remove(&mut self, variable);
            for one in &scores.touched {
                version[*one as usize] += 1;
                queue.push(entry(scores.of_variable(&self, *one), *one, version[*one as usize]));
            }
        }
        Some(order)
    }
}

/// A number whose bits have nothing to do with those of the first (Steele, Lea and Flood 2014).
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(crate) fn random_graph(seed: u64) -> Graph {
        Graph::of(&random_problem(seed))
    }

    fn random_problem(seed: u64) -> Problem {
        let count = 3 + (seed % 12) as usize;
        let pick = |salt: u64| (mix(seed * 1000 + salt) % count as u64) as u32;
        let scopes = (0..count as u64 + 3).map(|table| {
            let mut scope: Vec<u32> = (0..1 + table % 4).map(|place| pick(table * 10 + place)).collect();
            scope.sort_unstable();
            scope.dedup();
            scope
        });
        let cardinalities = (0..count).map(|one| 2 + one % 3).collect();
        Problem {
            variables: (0..count).collect(),
            cardinalities,
            scopes: scopes.collect(),
            ..Problem::default()
        }
    }

    /// Eliminates by sets, as the definition says: the cells of all cliques, and what each step would have added.
    fn by_definition(problem: &Problem, order: &[u32]) -> (f64, usize) {
        let mut scopes: Vec<Vec<u32>> = problem.scopes.clone();
        let (mut cells, mut width) = (0.0, 0);
        for variable in order {
            let (with, without): (Vec<_>, Vec<_>) =
                scopes.into_iter().partition(|scope| scope.contains(variable));
            let mut clique: Vec<u32> = with.concat();
            clique.push(*variable);
            clique.sort_unstable();
            clique.dedup();
            cells += problem.cells(&clique);
            width = width.max(clique.len());
            clique.retain(|one| one != variable);
            scopes = without;
            scopes.push(clique);
        }
        (cells, width)
    }

    #[test]
    fn an_order_has_every_variable_and_the_cells_that_it_says() {
        for seed in 0..200 {
            let problem = random_problem(seed);
            for effort in [Effort::Glance, Effort::Search] {
                let order = triangulate(&problem, effort);
                let mut all = order.variables.clone();
                all.sort_unstable();
                assert_eq!(all, (0..problem.variables.len() as u32).collect::<Vec<u32>>());
                let (cells, width) = by_definition(&problem, &order.variables);
                assert!((order.cells - cells).abs() < 1e-9 * cells, "{seed}: {} {cells}", order.cells);
                assert_eq!(order.width, width, "seed {seed}");
            }
        }
    }
}
