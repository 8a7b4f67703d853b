//! Elimination orders: the order in which the variables of a graph are summed, or maximised, out.
//!
//! In: the number of values of each variable, the scopes of tables, and the variables to eliminate. Out: an [`Order`]
//! and the cells of its cliques. Invariant: the same graph gives the same order. Finding the best order is NP-hard:
//! greedy rules are tried, and the order with the fewest cells is kept (Kjærulff 1990; Koller and Friedman 2009,
//! 9.4.3).

mod scores;

use scores::{Graph, Rule, Scores};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An order of elimination.
#[derive(Clone, Debug, Default)]
pub(crate) struct Order {
    pub(crate) variables: Vec<u32>,
    /// Σ over the variables of the cells of their cliques; infinite, with an empty order, if it is so large that the
    /// search stopped early.
    pub(crate) cells: f64,
    /// The number of variables in the largest clique.
    pub(crate) width: usize,
}

/// The effort spent on an order of all variables.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Effort {
    /// One attempt.
    Glance,
    /// More attempts where a better order would save more.
    Search,
}

/// More cells than any machine can process.
pub(crate) const HOPELESS: f64 = 1e15;

/// If no clique has more variables than this, no other order is tried: little could be gained.
const NARROW: usize = 3;

/// With more edges than these no order is sought: the tables are too large in any.
const MOST_EDGES: usize = 10_000_000;

/// An order of some variables; the others remain. The variable with the smallest clique goes first (min-weight); if its
/// total is smaller, the order of the variable that adds the fewest edges (min-fill) is used. Ties go to the first
/// variable.
pub(crate) fn order(cardinality: Vec<f64>, scopes: &[Vec<u32>], away: &[u32]) -> Order {
    let edges: usize = scopes.iter().map(|scope| scope.len() * scope.len()).sum();
    if edges > MOST_EDGES {
        return Order { variables: away.to_vec(), cells: f64::INFINITY, width: 0 };
    }
    let graph = Graph::of(cardinality, scopes);
    let by = |rule| graph.clone().eliminate(rule, away, None, f64::INFINITY);
    let by_weight = by(Rule::Weight).unwrap_or_default();
    if by_weight.width <= NARROW {
        return by_weight;
    }
    by(Rule::Fill).filter(|by_fill| by_fill.cells < by_weight.cells).unwrap_or(by_weight)
}

/// An order of all variables. Simplicial variables (whose neighbours form a clique) go first, since no order does
/// better for them. For the rest, rules are tried with ties broken by a seeded generator.
pub(crate) fn triangulate(cardinality: Vec<f64>, scopes: &[Vec<u32>], effort: Effort) -> Order {
    let mut graph = Graph::of(cardinality, scopes);
    let mut order = Order::default();
    let core = graph.strip(&mut order);
    if core.is_empty() {
        return order;
    }
    let graph = graph.restricted(&core);
    let all: Vec<u32> = (0..core.len() as u32).collect();
    let size: usize = graph.neighbours.iter().map(Vec::len).sum::<usize>() + core.len();
    let first = graph.clone().eliminate(Rule::Fill, &all, Some(0), HOPELESS);
    let Some(mut best) = first else {
        return Order { variables: Vec::new(), cells: f64::INFINITY, ..order };
    };
    // One attempt costs some hundred operations for each edge; a propagation costs a few for each cell.
    let tries = match effort {
        Effort::Glance => 0,
        Effort::Search => ((order.cells + best.cells) / (60.0 * size as f64)).clamp(1.0, 40.0) as u64,
    };
    let rules = [Rule::Fill, Rule::WeightedFill, Rule::Weight];
    for attempt in 1..=tries {
        let rule = rules[attempt as usize % rules.len()];
        if let Some(found) = graph.clone().eliminate(rule, &all, Some(attempt), best.cells) {
            best = found;
        }
    }
    order.variables.extend(best.variables.iter().map(|one| core[*one as usize]));
    order.cells += best.cells;
    order.width = order.width.max(best.width);
    order
}

impl Graph {
    /// Variables that share a table are neighbours. Lists are ascending.
    fn of(cardinality: Vec<f64>, scopes: &[Vec<u32>]) -> Self {
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); cardinality.len()];
        for scope in scopes {
            for one in scope {
                neighbours[*one as usize].extend(scope.iter().filter(|other| *other != one));
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Self { neighbours, cardinality }
    }

    /// Eliminates simplicial variables, one after the other. Returns the rest.
    fn strip(&mut self, order: &mut Order) -> Vec<u32> {
        let count = self.neighbours.len();
        let mut done = vec![false; count];
        let mut degree: Vec<u64> = self.neighbours.iter().map(|list| list.len() as u64).collect();
        // The number of pairs of neighbours that are not adjacent.
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
                // Neighbours of `other` that are not neighbours of `one` no longer count as missing for it.
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

    /// The subgraph of some variables, renumbered.
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

    /// Eliminates variables by one rule, with ties broken by a seed, or by number; `None` as soon as the order takes
    /// `most` cells.
    fn eliminate(mut self, rule: Rule, away: &[u32], seed: Option<u64>, most: f64) -> Option<Order> {
        let count = self.neighbours.len();
        let mut scores = Scores::of(&self, rule);
        // Variables that remain are never in the queue.
        let mut version = vec![u32::MAX; count];
        away.iter().for_each(|one| version[*one as usize] = 0);
        let mut queue: BinaryHeap<Reverse<(u64, u64, u32, u32)>> = BinaryHeap::with_capacity(2 * count);
        let entry = |score: f64, variable: u32, version: u32| {
            // Scores are non-negative, so their bit patterns have the same order; then the tie-break.
            let tie = seed.map_or(0, |seed| mix(seed ^ u64::from(variable)));
            Reverse((score.max(0.0).to_bits(), tie, variable, version))
        };
        away.iter().for_each(|one| queue.push(entry(scores.of_variable(&self, *one), *one, 0)));
        let mut order = Order::default();
        while let Some(Reverse((_, _, variable, found))) = queue.pop() {
            if version[variable as usize] != found {
                continue;
            }
            // All other queue entries of this variable are stale.
            version[variable as usize] = u32::MAX;
            let around: f64 = self.neighbours[variable as usize]
                .iter()
                .map(|one| self.cardinality[*one as usize])
                .product();
            order.cells += around * self.cardinality[variable as usize];
            if most.is_finite() && order.cells >= most {
                return None;
            }
            order.variables.push(variable);
            order.width = order.width.max(self.neighbours[variable as usize].len() + 1);
            scores.remove(&mut self, variable);
            for one in &scores.touched {
                // Skips variables that are eliminated already.
                if version[*one as usize] == u32::MAX {
                    continue;
                }
                version[*one as usize] += 1;
                queue.push(entry(scores.of_variable(&self, *one), *one, version[*one as usize]));
            }
        }
        Some(order)
    }
}

/// A mixing function: statistically independent bits for consecutive inputs (Steele, Lea and Flood 2014).
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(super) fn random_graph(seed: u64) -> Graph {
        let (cardinality, scopes) = random(seed);
        Graph::of(cardinality, &scopes)
    }

    fn random(seed: u64) -> (Vec<f64>, Vec<Vec<u32>>) {
        let count = 3 + (seed % 12) as usize;
        let pick = |salt: u64| (mix(seed * 1000 + salt) % count as u64) as u32;
        let scopes = (0..count as u64 + 3).map(|table| {
            let mut scope: Vec<u32> = (0..1 + table % 4).map(|place| pick(table * 10 + place)).collect();
            scope.sort_unstable();
            scope.dedup();
            scope
        });
        ((0..count).map(|one| (2 + one % 3) as f64).collect(), scopes.collect())
    }

    /// Eliminates with sets, by the definition: the cells of each clique, and the number of variables in the largest.
    fn by_definition(cardinality: &[f64], scopes: &[Vec<u32>], order: &[u32]) -> (Vec<f64>, usize) {
        let mut scopes: Vec<Vec<u32>> = scopes.to_vec();
        let (mut cells, mut width) = (Vec::new(), 0);
        for variable in order {
            let (with, without): (Vec<_>, Vec<_>) =
                scopes.into_iter().partition(|scope| scope.contains(variable));
            let mut clique: Vec<u32> = with.concat();
            clique.push(*variable);
            clique.sort_unstable();
            clique.dedup();
            cells.push(clique.iter().map(|one| cardinality[*one as usize]).product());
            width = width.max(clique.len());
            clique.retain(|one| one != variable);
            scopes = without;
            scopes.push(clique);
        }
        (cells, width)
    }

    #[test]
    fn an_order_has_every_variable_and_its_reported_cells() {
        for seed in 0..200 {
            let (cardinality, scopes) = random(seed);
            let every: Vec<u32> = (0..cardinality.len() as u32).collect();
            let some: Vec<u32> = every.iter().copied().filter(|one| one % 3 != 1).collect();
            let glance = triangulate(cardinality.clone(), &scopes, Effort::Glance);
            let search = triangulate(cardinality.clone(), &scopes, Effort::Search);
            let of_some = order(cardinality.clone(), &scopes, &some);
            for (order, expected) in [(glance, &every), (search, &every), (of_some, &some)] {
                let mut all = order.variables.clone();
                all.sort_unstable();
                assert_eq!(&all, expected);
                let (cells, width) = by_definition(&cardinality, &scopes, &order.variables);
                let cells: f64 = cells.iter().sum();
                assert!((order.cells - cells).abs() < 1e-9 * cells, "{seed}: {} {cells}", order.cells);
                assert_eq!(order.width, width, "seed {seed}");
            }
        }
    }

    #[test]
    fn the_smallest_clique_first() {
        // A chain a − b − c − d of 2, 9, 3, 2 values, all but d summed: a first makes 2 · 9, then b 9 · 3, c 3 · 2; c
        // before b would make 9 · 3 · 2.
        let scopes = [vec![0, 1], vec![1, 2], vec![2, 3]];
        let found = order(vec![2.0, 9.0, 3.0, 2.0], &scopes, &[0, 1, 2]);
        assert_eq!((found.variables, found.cells), (vec![0, 1, 2], 18.0 + 27.0 + 6.0));
    }

    #[test]
    fn min_fill_where_it_is_cheaper() {
        // Each of a, b, c shares a factor with d and one with e; e has 5 values, the others 2. Min-weight sums d first
        // and so joins a, b, c: 16, then 2·2·2·5 = 40, 20, 10, 5. Min-fill begins with a: 20, 20, 20, 10, 5.
        let cardinality = vec![2.0, 2.0, 2.0, 2.0, 5.0];
        let scopes: Vec<Vec<u32>> = (0..3).flat_map(|one| [vec![one, 3], vec![one, 4]]).collect();
        let all: Vec<u32> = (0..5).collect();
        let by = |rule| Graph::of(cardinality.clone(), &scopes).eliminate(rule, &all, None, f64::INFINITY);
        let cells = |order: &Order| by_definition(&cardinality, &scopes, &order.variables).0;
        assert_eq!(cells(&by(Rule::Weight).unwrap()), [16.0, 40.0, 20.0, 10.0, 5.0]);
        assert_eq!(cells(&order(cardinality.clone(), &scopes, &all)), [20.0, 20.0, 20.0, 10.0, 5.0]);
    }
}
