//! Scores of variables for greedy elimination.
//!
//! In: a [`Graph`], a [`Rule`]. Out: [`Scores`]. Invariant: after each elimination the scores are those of the
//! remaining graph; only variables whose score changed are updated.

/// The quantity that a greedy rule minimises when it chooses the next variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Rule {
    /// The number of added edges.
    Fill,
    /// The cells of the clique.
    Weight,
    /// The total weight of the added edges.
    WeightedFill,
}

/// An undirected graph: the neighbours of each variable.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    pub(super) neighbours: Vec<Vec<u32>>,
    pub(super) cardinality: Vec<f64>,
}

/// The score of each variable, updated during elimination.
///
/// The weight of an edge is the product of its ends' weights: 1 each, or their numbers of values. The score of a
/// variable is the total weight of the missing edges between its neighbours.
pub(super) struct Scores {
    rule: Rule,
    weight: Vec<f64>,
    /// The total weight of the neighbours of each variable.
    around: Vec<f64>,
    missing: Vec<f64>,
    marks: Marks,
    changed: Marks,
    /// The variables whose score the last removal changed.
    pub(super) touched: Vec<u32>,
}

impl Scores {
    pub(super) fn of(graph: &Graph, rule: Rule) -> Self {
        let count = graph.neighbours.len();
        let weight = if rule == Rule::Fill { vec![1.0; count] } else { graph.cardinality.clone() };
        let sum = |list: &Vec<u32>| list.iter().map(|one| weight[*one as usize]).sum();
        let around = graph.neighbours.iter().map(sum).collect();
        let mut marks = Marks::of(count);
        let mut missing = vec![0.0; count];
        for (variable, list) in graph.neighbours.iter().enumerate().filter(|_| rule != Rule::Weight) {
            marks.next();
            list.iter().for_each(|one| marks.set(*one));
            // All ordered pairs, less the adjacent ones.
            let (mut total, mut squares, mut adjacent) = (0.0, 0.0, 0.0);
            for one in list {
                let own = weight[*one as usize];
                total += own;
                squares += own * own;
                let common = graph.neighbours[*one as usize].iter().filter(|other| marks.has(**other));
                adjacent += own * common.map(|other| weight[*other as usize]).sum::<f64>();
            }
            missing[variable] = (total * total - squares - adjacent) / 2.0;
        }
        Self { rule, weight, around, missing, marks, changed: Marks::of(count), touched: Vec::new() }
    }

    pub(super) fn of_variable(&self, graph: &Graph, variable: u32) -> f64 {
        match self.rule {
            Rule::Fill | Rule::WeightedFill => self.missing[variable as usize],
            Rule::Weight => {
                let around = graph.neighbours[variable as usize].iter();
                around.map(|one| self.weight[*one as usize]).product::<f64>() * self.weight[variable as usize]
            }
        }
    }

    fn touch(&mut self, variable: u32) {
        if !self.changed.has(variable) {
            self.changed.set(variable);
            self.touched.push(variable);
        }
    }

    /// Eliminates a variable: connects all of its neighbours, and removes it.
    pub(super) fn remove(&mut self, graph: &mut Graph, variable: u32) {
        self.touched.clear();
        self.changed.next();
        let around = std::mem::take(&mut graph.neighbours[variable as usize]);
        for (place, one) in around.iter().enumerate() {
            self.marks.next();
            graph.neighbours[*one as usize].iter().for_each(|other| self.marks.set(*other));
            for other in &around[place + 1..] {
                if !self.marks.has(*other) {
                    self.connect(graph, *one, *other, variable);
                    self.marks.set(*other);
                }
            }
        }
        let own = self.weight[variable as usize];
        let all: f64 = around.iter().map(|one| self.weight[*one as usize]).sum();
        for one in &around {
            let place = *one as usize;
            // Neighbours of this one that the variable does not have are no longer missing with respect to it.
            self.missing[place] -= own * (self.around[place] - own - (all - self.weight[place]));
            self.around[place] -= own;
            let list = &mut graph.neighbours[place];
            if let Some(found) = list.iter().position(|other| *other == variable) {
                list.swap_remove(found);
            }
            self.touch(*one);
        }
    }

    /// Adds an edge; the neighbours of `one` are marked. `gone` is not counted any more.
    fn connect(&mut self, graph: &mut Graph, one: u32, other: u32, gone: u32) {
        let (first, second) = (self.weight[one as usize], self.weight[other as usize]);
        if self.rule != Rule::Weight {
            let mut common = 0.0;
            for both in &graph.neighbours[other as usize] {
                if self.marks.has(*both) {
                    common += self.weight[*both as usize];
                    if *both != gone {
                        self.missing[*both as usize] -= first * second;
                        if !self.changed.has(*both) {
                            self.changed.set(*both);
                            self.touched.push(*both);
                        }
                    }
                }
            }
            self.missing[one as usize] += second * (self.around[one as usize] - common);
            self.missing[other as usize] += first * (self.around[other as usize] - common);
        }
        self.around[one as usize] += second;
        self.around[other as usize] += first;
        graph.neighbours[one as usize].push(other);
        graph.neighbours[other as usize].push(one);
    }
}

/// A set that is cleared in constant time.
pub(super) struct Marks {
    stamps: Vec<u64>,
    now: u64,
}

impl Marks {
    fn of(count: usize) -> Self {
        Self { stamps: vec![0; count], now: 0 }
    }

    fn next(&mut self) {
        self.now += 1;
    }

    fn set(&mut self, one: u32) {
        self.stamps[one as usize] = self.now;
    }

    fn has(&self, one: u32) -> bool {
        self.stamps[one as usize] == self.now
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::random_graph;
    use super::*;

    #[test]
    fn scores_that_are_kept_are_those_of_the_graph() {
        for seed in 0..100 {
            for rule in [Rule::Fill, Rule::WeightedFill] {
                let mut graph = random_graph(seed);
                let mut scores = Scores::of(&graph, rule);
                for variable in 0..graph.neighbours.len() as u32 {
                    scores.remove(&mut graph, variable);
                    let fresh = Scores::of(&graph, rule);
                    for one in variable as usize + 1..graph.neighbours.len() {
                        assert!(
                            (scores.missing[one] - fresh.missing[one]).abs() < 1e-9,
                            "{seed} {rule:?} {one}"
                        );
                    }
                }
            }
        }
    }
}
