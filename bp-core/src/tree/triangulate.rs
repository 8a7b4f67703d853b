//! Triangulation: an order in which to eliminate the variables of a graph, and the cliques that it makes.
//!
//! In: which variables stand in a table together. Out: cliques, parents after children, whose running intersections are
//! the separators of a junction tree. Invariant: every table lies in some clique. Finding the best order is NP-hard:
//! several greedy rules are tried, ties broken by a seeded generator, and the order of least total cells is kept
//! (Kjærulff 1990; Koller and Friedman 2009, section 9.4.3).

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

/// An undirected graph: for each variable its neighbours, ascending.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    neighbours: Vec<Vec<u32>>,
    /// ln of the number of values; 0 for those that are given and take no part.
    ln_cardinality: Vec<f64>,
}

/// The cliques of an elimination order.
#[derive(Clone, Debug, Default)]
pub(super) struct Cliques {
    /// The variables of each, ascending.
    pub(super) members: Vec<Vec<u32>>,
    /// The clique that each hands its message to; always a later one. `None` for the root of a component.
    pub(super) parent: Vec<Option<usize>>,
    /// Σ of their cells.
    pub(super) cells: f64,
}

impl Graph {
    /// The graph of some tables, over the variables that are not `given`.
    pub(super) fn of<'t>(
        cardinalities: &[usize],
        tables: impl Iterator<Item = &'t [usize]>,
        given: &[bool],
    ) -> Self {
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); cardinalities.len()];
        for table in tables {
            for one in table.iter().filter(|one| !given[**one]) {
                let others = table.iter().filter(|other| !given[**other] && *other != one);
                neighbours[*one].extend(others.map(|other| *other as u32));
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Self { neighbours, ln_cardinality: cardinalities.iter().map(|count| (*count as f64).ln()).collect() }
    }

    fn adjacent(&self, one: u32, other: u32) -> bool {
        self.neighbours[one as usize].binary_search(&other).is_ok()
    }

    fn connect(&mut self, one: u32, other: u32) {
        for (from, to) in [(one, other), (other, one)] {
            let list = &mut self.neighbours[from as usize];
            if let Err(place) = list.binary_search(&to) {
                list.insert(place, to);
            }
        }
    }

    fn remove(&mut self, variable: u32) -> Vec<u32> {
        let list = std::mem::take(&mut self.neighbours[variable as usize]);
        for neighbour in &list {
            let others = &mut self.neighbours[*neighbour as usize];
            if let Ok(place) = others.binary_search(&variable) {
                others.remove(place);
            }
        }
        list
    }

    /// Pairs of neighbours that are no neighbours of each other.
    fn missing(&self, variable: u32) -> impl Iterator<Item = (u32, u32)> {
        let list = &self.neighbours[variable as usize];
        (list.iter().enumerate())
            .flat_map(|(place, one)| list[place + 1..].iter().map(move |other| (*one, *other)))
            .filter(|(one, other)| !self.adjacent(*one, *other))
    }

    fn ln_weight(&self, variable: u32) -> f64 {
        let around: f64 =
            self.neighbours[variable as usize].iter().map(|one| self.ln_cardinality[*one as usize]).sum();
        around + self.ln_cardinality[variable as usize]
    }

    fn score(&self, rule: Rule, variable: u32) -> f64 {
        match rule {
            Rule::Weight => self.ln_weight(variable),
            Rule::Fill => self.missing(variable).count() as f64,
            Rule::WeightedFill => {
                let cells = |one: u32| self.ln_cardinality[one as usize];
                self.missing(variable).map(|(one, other)| (cells(one) + cells(other)).exp()).sum()
            }
        }
    }

    /// Eliminates all variables by one rule.
    fn eliminate(mut self, rule: Rule, given: &[bool], seed: u64, most: f64) -> Option<Cliques> {
        let count = self.neighbours.len();
        let mut stamp = vec![0u32; count];
        let mut done: Vec<bool> = given.to_vec();
        let mut queue: BinaryHeap<Reverse<(u64, u64, u32, u32)>> = BinaryHeap::new();
        let entry = |graph: &Graph, variable: u32, stamp: u32| {
            // Scores are not negative, so that their bits are in their order; then the tie-break.
            let tie = mix(seed ^ u64::from(variable));
            Reverse((graph.score(rule, variable).to_bits(), tie, variable, stamp))
        };
        (0..count).filter(|one| !done[*one]).for_each(|one| queue.push(entry(&self, one as u32, 0)));
        let (mut order, mut cliques, mut cells) = (Vec::new(), Vec::new(), 0.0);
        while let Some(Reverse((_, _, variable, found))) = queue.pop() {
            if done[variable as usize] || stamp[variable as usize] != found {
                continue;
            }
            done[variable as usize] = true;
            cells += self.ln_weight(variable).exp();
            if cells > most {
                return None;
            }
            let fill: Vec<(u32, u32)> = self.missing(variable).collect();
            // Whose score may change: the neighbours, and those of both ends of a new edge.
            let mut touched: Vec<u32> = self.neighbours[variable as usize].clone();
            for (one, other) in &fill {
                if rule != Rule::Weight {
                    let (first, second) =
                        (&self.neighbours[*one as usize], &self.neighbours[*other as usize]);
                    touched.extend(first.iter().filter(|both| second.binary_search(both).is_ok()));
                }
                self.connect(*one, *other);
            }
            let mut members = self.remove(variable);
            touched.sort_unstable();
            touched.dedup();
            for one in touched.into_iter().filter(|one| !done[*one as usize]) {
                stamp[one as usize] += 1;
                queue.push(entry(&self, one, stamp[one as usize]));
            }
            let place = members.partition_point(|one| *one < variable);
            members.insert(place, variable);
            order.push(variable);
            cliques.push(members);
        }
        Some(join(&order, cliques, count, &self.ln_cardinality))
    }

    /// The best order found. More tries where a better one would save more.
    pub(super) fn triangulate(&self, given: &[bool]) -> Cliques {
        let rules = [Rule::Fill, Rule::WeightedFill, Rule::Weight];
        let first = self.clone().eliminate(Rule::Fill, given, 0, f64::INFINITY);
        let mut best = first.expect("internal: there is no limit");
        let size: usize = self.neighbours.iter().map(Vec::len).sum::<usize>() + self.neighbours.len();
        // One try costs some hundred operations for each edge; a propagation costs a few for each cell.
        let tries = (best.cells / (40.0 * size as f64)).clamp(2.0, 40.0) as u64;
        for attempt in 1..=tries {
            let rule = rules[attempt as usize % rules.len()];
            if let Some(found) = self.clone().eliminate(rule, given, attempt, best.cells * 1.5)
                && found.cells < best.cells
            {
                best = found;
            }
        }
        best
    }
}

/// A number whose bits have nothing to do with those of the first (Steele, Lea and Flood 2014).
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Elimination cliques as a tree: each hands on to the clique of the member that is eliminated next; one that lies in
/// the one before is absorbed by it.
fn join(order: &[u32], cliques: Vec<Vec<u32>>, count: usize, ln_cardinality: &[f64]) -> Cliques {
    let mut place = vec![usize::MAX; count];
    order.iter().enumerate().for_each(|(position, variable)| place[*variable as usize] = position);
    let parent_of = |position: usize| {
        let own = order[position];
        cliques[position].iter().filter(|one| **one != own).map(|one| place[*one as usize]).min()
    };
    // Where each elimination clique went; a clique is absorbed by the first child that holds all of it.
    let mut home: Vec<usize> = (0..order.len()).collect();
    let mut parent: Vec<Option<usize>> = (0..order.len()).map(parent_of).collect();
    for position in 0..order.len() {
        let Some(above) = parent[position] else { continue };
        let holder = home[position];
        if home[above] == above
            && cliques[holder].len() > cliques[above].len()
            && holds(&cliques[holder], &cliques[above])
        {
            home[above] = holder;
        }
    }
    for position in 0..order.len() {
        if home[position] != position {
            // Its own parent becomes that of the clique that took its place.
            let holder = home[position];
            parent[holder] = parent[position];
        }
    }
    let mut new = vec![usize::MAX; order.len()];
    let mut result = Cliques::default();
    // A holder stands before what it holds: numbering by where the last clique that it took stood keeps parents later.
    let mut last: Vec<usize> = (0..order.len()).collect();
    (0..order.len()).for_each(|position| last[home[position]] = last[home[position]].max(position));
    let mut kept: Vec<usize> = (0..order.len()).filter(|position| home[*position] == *position).collect();
    kept.sort_by_key(|position| last[*position]);
    for (number, position) in kept.iter().enumerate() {
        new[*position] = number;
    }
    for position in &kept {
        let members = cliques[*position].clone();
        result.cells += members.iter().map(|one| ln_cardinality[*one as usize]).sum::<f64>().exp();
        result.members.push(members);
        let mut above = parent[*position];
        while let Some(next) = above.filter(|next| home[*next] == *position) {
            above = parent_of(next);
        }
        result.parent.push(above.map(|above| new[home[above]]));
    }
    result
}

/// Whether one ascending list holds all of another.
fn holds(outer: &[u32], inner: &[u32]) -> bool {
    inner.iter().all(|one| outer.binary_search(one).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(tables: &[Vec<usize>], count: usize, given: &[bool]) {
        let cardinalities = vec![2; count];
        let graph = Graph::of(&cardinalities, tables.iter().map(Vec::as_slice), given);
        for rule in [Rule::Fill, Rule::Weight, Rule::WeightedFill] {
            for seed in 0..3 {
                let cliques = graph.clone().eliminate(rule, given, seed, f64::INFINITY).unwrap();
                for table in tables {
                    let free: Vec<u32> =
                        table.iter().filter(|one| !given[**one]).map(|one| *one as u32).collect();
                    let mut sorted = free.clone();
                    sorted.sort_unstable();
                    assert!(
                        cliques.members.iter().any(|clique| holds(clique, &sorted)),
                        "{sorted:?} in no clique"
                    );
                }
                for (number, parent) in cliques.parent.iter().enumerate() {
                    assert!(parent.is_none_or(|parent| parent > number), "parents come later");
                }
                // Running intersection: the cliques of each variable are one subtree.
                for variable in (0..count as u32).filter(|one| !given[*one as usize]) {
                    let has = |number: &usize| cliques.members[*number].binary_search(&variable).is_ok();
                    let own: Vec<usize> = (0..cliques.members.len()).filter(has).collect();
                    let tops =
                        own.iter().filter(|number| cliques.parent[**number].is_none_or(|above| !has(&above)));
                    assert_eq!(tops.count(), 1, "variable {variable}: {cliques:?}");
                }
                for (number, clique) in cliques.members.iter().enumerate() {
                    let inside = |other: &usize| *other != number && holds(&cliques.members[*other], clique);
                    assert!(
                        !(0..cliques.members.len()).any(|other| inside(&other)),
                        "{clique:?} lies in another"
                    );
                }
            }
        }
    }

    #[test]
    fn cliques_hold_the_tables_and_run_together() {
        let cycle: Vec<Vec<usize>> = (0..6).map(|one| vec![one, (one + 1) % 6]).collect();
        check(&cycle, 6, &[false; 6]);
        let mut given = [false; 6];
        given[2] = true;
        check(&cycle, 6, &given);
        // Random graphs, by a fixed generator.
        for seed in 0..60u64 {
            let count = 3 + (seed % 9) as usize;
            let pick = |salt: u64| (mix(seed * 1000 + salt) % count as u64) as usize;
            let tables: Vec<Vec<usize>> = (0..count as u64 + 2)
                .map(|table| {
                    let mut list: Vec<usize> =
                        (0..1 + table % 3).map(|place| pick(table * 10 + place)).collect();
                    list.sort_unstable();
                    list.dedup();
                    list
                })
                .collect();
            check(&tables, count, &vec![false; count]);
        }
    }
}
