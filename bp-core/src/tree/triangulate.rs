//! Triangulation: an order in which to eliminate the variables of a graph.
//!
//! In: which variables stand in a table together. Out: an [`Order`] and the cells of the cliques that it makes. Invariant:
//! the same graph gives the same order. Finding the best one is NP-hard. Variables whose neighbours are all neighbours of
//! each other cost nothing that any order could save: they go first. For what is left, greedy rules are tried with ties
//! broken by a seeded generator, and the order of least cells is kept (Kjærulff 1990; Koller and Friedman 2009, 9.4.3).

use super::problem::Problem;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What a greedy rule makes small when it chooses the next variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Rule {
    /// Edges added.
    Fill,
    /// Cells of the clique.
    Weight,
    /// Cells of the edges added.
    WeightedFill,
}

/// An order of elimination.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    pub(super) variables: Vec<u32>,
    /// Σ over the variables of the cells of the clique that their elimination makes.
    pub(super) cells: f64,
    /// Variables of the largest clique.
    pub(super) width: usize,
}

/// An undirected graph: for each variable its neighbours.
#[derive(Clone, Debug)]
struct Graph {
    neighbours: Vec<Vec<u32>>,
    cardinality: Vec<f64>,
}

/// How hard to look for an order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Effort {
    /// One try.
    Glance,
    /// More tries where a better order would save more.
    Search,
}

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
    let mut best =
        graph.clone().eliminate(Rule::Fill, 0, f64::INFINITY).expect("internal: there is no limit");
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

    fn score(&self, rule: Rule, variable: u32, marks: &mut Marks) -> f64 {
        let list = &self.neighbours[variable as usize];
        let weigh = |one: &u32| if rule == Rule::Fill { 1.0 } else { self.cardinality[*one as usize] };
        if rule == Rule::Weight {
            return list.iter().map(weigh).product::<f64>() * self.cardinality[variable as usize];
        }
        marks.next();
        list.iter().for_each(|one| marks.set(*one));
        // All ordered pairs, without those that are neighbours.
        let (mut total, mut squares, mut adjacent) = (0.0, 0.0, 0.0);
        for one in list {
            let own = weigh(one);
            total += own;
            squares += own * own;
            let common = self.neighbours[*one as usize].iter().filter(|other| marks.has(**other));
            adjacent += own * common.map(weigh).sum::<f64>();
        }
        ((total * total - squares - adjacent) / 2.0).max(0.0)
    }

    /// Eliminates all variables by one rule; `None` as soon as that takes `most` cells.
    fn eliminate(mut self, rule: Rule, seed: u64, most: f64) -> Option<Order> {
        let count = self.neighbours.len();
        let mut marks = Marks { stamps: vec![0; count], now: 0 };
        let mut version = vec![0u32; count];
        let mut done = vec![false; count];
        let mut queue: BinaryHeap<Reverse<(u64, u64, u32, u32)>> = BinaryHeap::with_capacity(4 * count);
        let entry = |graph: &Graph, variable: u32, version: u32, marks: &mut Marks| {
            // Scores are not negative, so that their bits are in their order; then the tie-break.
            let score = graph.score(rule, variable, marks).to_bits();
            Reverse((score, mix(seed ^ u64::from(variable)), variable, version))
        };
        (0..count as u32).for_each(|one| queue.push(entry(&self, one, 0, &mut marks)));
        let mut order = Order::default();
        let (mut touched, mut seen) = (Vec::new(), vec![0u32; count]);
        while let Some(Reverse((_, _, variable, found))) = queue.pop() {
            if done[variable as usize] || version[variable as usize] != found {
                continue;
            }
            done[variable as usize] = true;
            let around = std::mem::take(&mut self.neighbours[variable as usize]);
            let cells: f64 = around.iter().map(|one| self.cardinality[*one as usize]).product();
            order.cells += cells * self.cardinality[variable as usize];
            if order.cells >= most {
                return None;
            }
            order.variables.push(variable);
            order.width = order.width.max(around.len() + 1);
            let mut filled = false;
            for one in &around {
                let list = &mut self.neighbours[*one as usize];
                if let Some(place) = list.iter().position(|other| *other == variable) {
                    list.swap_remove(place);
                }
                marks.next();
                marks.set(*one);
                list.iter().for_each(|other| marks.set(*other));
                let before = list.len();
                list.extend(around.iter().filter(|other| !marks.has(**other)));
                filled |= list.len() > before;
            }
            // Whose score may change: the neighbours, and those of both ends of a new edge.
            touched.clear();
            touched.extend_from_slice(&around);
            if filled && rule != Rule::Weight {
                marks.next();
                around.iter().for_each(|one| marks.set(*one));
                for other in around.iter().flat_map(|one| &self.neighbours[*one as usize]) {
                    if !marks.has(*other) {
                        seen[*other as usize] += 1;
                        if seen[*other as usize] == 2 {
                            touched.push(*other);
                        }
                    }
                }
                let others = around.iter().flat_map(|one| &self.neighbours[*one as usize]);
                others.for_each(|other| seen[*other as usize] = 0);
            }
            for one in touched.iter().filter(|one| !done[**one as usize]) {
                version[*one as usize] += 1;
                queue.push(entry(&self, *one, version[*one as usize], &mut marks));
            }
        }
        Some(order)
    }
}

/// A set that is emptied in no time.
struct Marks {
    stamps: Vec<u32>,
    now: u32,
}

impl Marks {
    fn next(&mut self) {
        if self.now == u32::MAX {
            self.stamps.fill(0);
            self.now = 0;
        }
        self.now += 1;
    }

    fn set(&mut self, one: u32) {
        self.stamps[one as usize] = self.now;
    }

    fn has(&self, one: u32) -> bool {
        self.stamps[one as usize] == self.now
    }
}

/// A number whose bits have nothing to do with those of the first (Steele, Lea and Flood 2014).
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}
