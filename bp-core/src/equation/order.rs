//! Elimination orders: two greedy orders, of which the cheaper is used.
//!
//! In: the variables on which each factor depends, and those that are to be summed out. Out: the sums in order, each
//! with its factors. Invariant: each variable is summed over exactly the factors that depend on it; scopes are stored
//! for each factor and change only if a sum replaces some, so that a sparse network of n variables is ordered in about
//! n log n steps.
//!
//! *Min-weight* eliminates next the variable whose sum makes the smallest table; *min-fill* the one that adds the
//! fewest edges between its neighbours (Kjærulff 1990; Koller and Friedman 2009, section 9.4.3.2).

use super::eliminate::size;
use super::scope::Scope;
use crate::ids::VariableId;
use crate::model::Model;
use std::collections::{BTreeSet, HashMap};

/// Number of joint variables up to which no other order is tried, since little can be gained.
const NARROW: usize = 3;

/// Number of neighbours above which all pairs count as not adjacent, since counting would cost more.
const MANY: usize = 32;

/// One sum: its factors and its result.
pub(super) struct Sum {
    pub(super) variable: VariableId,
    /// Positions of the factors under the sum: those of the draft first, then the sums in their order.
    pub(super) inside: Vec<usize>,
    /// The variables of its table.
    pub(super) table: Scope,
    /// Number of summed products: the joint values of the variable and of the table.
    pub(super) weight: f64,
}

/// The next sum.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    MinWeight,
    MinFill,
}

/// The cheaper of the two orders; min-weight if they cost the same.
pub(super) fn cheaper(model: &Model, scopes: &[Scope], free: &BTreeSet<VariableId>) -> Vec<Sum> {
    let by_weight = Product::new(model, scopes).sums(free, Next::MinWeight);
    if by_weight.iter().all(|sum| sum.table.len() < NARROW) {
        return by_weight;
    }
    let by_fill = Product::new(model, scopes).sums(free, Next::MinFill);
    let cost = |sums: &[Sum]| sums.iter().map(|sum| sum.weight).sum::<f64>();
    if cost(&by_fill) < cost(&by_weight) { by_fill } else { by_weight }
}

/// A product of factors during elimination.
struct Product<'m> {
    model: &'m Model,
    /// The scope of each factor, empty once it is under a sum.
    scopes: Vec<Scope>,
    /// The factors that depend on each variable.
    users: HashMap<VariableId, BTreeSet<usize>>,
}

impl<'m> Product<'m> {
    fn new(model: &'m Model, scopes: &[Scope]) -> Self {
        let mut product = Self { model, scopes: Vec::new(), users: HashMap::new() };
        scopes.iter().for_each(|scope| product.add(scope.clone()));
        product
    }

    fn add(&mut self, scope: Scope) {
        for variable in &scope {
            self.users.entry(*variable).or_default().insert(self.scopes.len());
        }
        self.scopes.push(scope);
    }

    fn sums(mut self, free: &BTreeSet<VariableId>, next: Next) -> Vec<Sum> {
        let mut scores: HashMap<VariableId, u64> = HashMap::new();
        let mut queue = BTreeSet::new();
        for variable in free {
            let score = self.score(*variable, next);
            scores.insert(*variable, score);
            queue.insert((score, *variable));
        }
        let mut sums = Vec::with_capacity(free.len());
        while let Some((_, variable)) = queue.pop_first() {
            scores.remove(&variable);
            let sum = self.sum_out(variable);
            for neighbour in &sum.table {
                if let Some(score) = scores.get_mut(neighbour) {
                    queue.remove(&(*score, *neighbour));
                    *score = self.score(*neighbour, next);
                    queue.insert((*score, *neighbour));
                }
            }
            sums.push(sum);
        }
        sums
    }

    fn sum_out(&mut self, variable: VariableId) -> Sum {
        let mut table = self.together(variable);
        let weight = self.weight(&table);
        table.remove(&variable);
        let inside: Vec<usize> = self.users.remove(&variable).into_iter().flatten().collect();
        for factor in &inside {
            for other in std::mem::take(&mut self.scopes[*factor]) {
                if let Some(users) = self.users.get_mut(&other) {
                    users.remove(factor);
                }
            }
        }
        self.add(table.clone());
        Sum { variable, inside, table, weight }
    }

    /// A variable and all those that share a factor with it.
    fn together(&self, variable: VariableId) -> Scope {
        let mut together = Scope::from([variable]);
        for factor in self.users.get(&variable).into_iter().flatten() {
            together.extend(&self.scopes[*factor]);
        }
        together
    }

    /// The number of combinations of values.
    fn weight(&self, together: &Scope) -> f64 {
        let own = together.iter().filter(|variable| Some(**variable) != self.model.plate_index());
        own.map(|variable| size(self.model, *variable)).product()
    }

    /// The priority of a variable, as bits in the order of the number: small first.
    fn score(&self, variable: VariableId, next: Next) -> u64 {
        let together = self.together(variable);
        let score = match next {
            Next::MinWeight => self.weight(&together),
            Next::MinFill => self.fill(variable, &together),
        };
        score.to_bits()
    }

    /// The number of pairs of neighbours that share no factor.
    fn fill(&self, variable: VariableId, together: &Scope) -> f64 {
        let neighbours: Vec<_> = together.iter().copied().filter(|other| *other != variable).collect();
        let pairs = neighbours.len() * neighbours.len().saturating_sub(1) / 2;
        if neighbours.len() > MANY {
            return pairs as f64;
        }
        let joined = (neighbours.iter().enumerate()).map(|(position, one)| {
            let known = self.together(*one);
            neighbours[position + 1..].iter().filter(|other| known.contains(other)).count()
        });
        (pairs - joined.sum::<usize>()) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Domain, Form, ModelBuilder};

    fn model(sizes: &[i64]) -> (Model, Vec<VariableId>) {
        let mut model = ModelBuilder::new("M");
        let ids: Vec<_> = (sizes.iter().enumerate())
            .map(|(position, size)| model.variable(&format!("X{position}"), Domain::integers(1, *size)))
            .collect();
        for id in &ids {
            model.factor([*id], [], Form::Uniform);
        }
        (model.build().unwrap(), ids)
    }

    #[test]
    fn the_smallest_table_first() {
        // A chain a − b − c − d of 2, 9, 3, 2 values, all but d summed: Σ_a first makes 2 · 9, then Σ_b 9 · 3, Σ_c 3 · 2;
        // c before b would make 9 · 3 · 2.
        let (model, ids) = model(&[2, 9, 3, 2]);
        let scopes: Vec<Scope> = ids.windows(2).map(|pair| pair.iter().copied().collect()).collect();
        let sums = cheaper(&model, &scopes, &ids[..3].iter().copied().collect());
        let told: Vec<_> = sums.iter().map(|sum| (sum.variable, sum.weight, sum.inside.clone())).collect();
        assert_eq!(told, [(ids[0], 18.0, vec![0]), (ids[1], 27.0, vec![1, 3]), (ids[2], 6.0, vec![2, 4])]);
    }

    #[test]
    fn min_fill_where_it_is_cheaper() {
        // Each of a, b, c shares a factor with d and one with e; e has 5 values, the others 2. Min-weight sums d first
        // and so brings a, b, c together: 16, then 2·2·2·5 = 40, 20, 10, 5. Min-fill begins with a: 20, 20, 20, 10, 5.
        let (model, ids) = model(&[2, 2, 2, 2, 5]);
        let pairs = [(0, 3), (0, 4), (1, 3), (1, 4), (2, 3), (2, 4)];
        let scopes: Vec<Scope> = pairs.iter().map(|(a, b)| Scope::from([ids[*a], ids[*b]])).collect();
        let free: BTreeSet<_> = ids.iter().copied().collect();
        let weights = |sums: &[Sum]| sums.iter().map(|sum| sum.weight).collect::<Vec<_>>();
        let by_weight = Product::new(&model, &scopes).sums(&free, Next::MinWeight);
        assert_eq!(weights(&by_weight), [16.0, 40.0, 20.0, 10.0, 5.0]);
        assert_eq!(weights(&cheaper(&model, &scopes, &free)), [20.0, 20.0, 20.0, 10.0, 5.0]);
    }

    #[test]
    fn fill_counts_the_pairs_that_were_apart() {
        let (model, ids) = model(&[2; 4]);
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2)];
        let scopes: Vec<Scope> = pairs.iter().map(|(a, b)| Scope::from([ids[*a], ids[*b]])).collect();
        let product = Product::new(&model, &scopes);
        let fill = |id| product.fill(id, &product.together(id));
        // The neighbours of 0 are 1, 2 and 3, of which only 1 and 2 share a factor; those of 1 are 0 and 2, which do.
        assert_eq!((fill(ids[0]), fill(ids[1]), fill(ids[3])), (2.0, 0.0, 0.0));
    }
}
