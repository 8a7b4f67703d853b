//! The sums of an equation in order, each with the factors that stand under it.
//!
//! In: the variables on which each factor depends, and those that are to be summed out. Out: the sums in the order that
//! `elimination` finds. Invariant: each variable is summed over exactly the factors that depend on it; scopes are kept for each
//! factor and change only where a sum takes the place of some.

use super::eliminate::size;
use crate::analysis::Scope;
use crate::elimination;
use crate::ids::VariableId;
use crate::model::Model;
use std::collections::{BTreeMap, BTreeSet, HashMap};

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

/// The sums, in the cheapest order that is found. A factor that is a Dirac leaves one value of each variable in its set
/// of `solved`: a sum over such a variable has no more products than its table has numbers.
pub(super) fn sums(
    model: &Model,
    scopes: &[Scope],
    free: &BTreeSet<VariableId>,
    solved: &[Scope],
) -> Vec<Sum> {
    let product = || {
        let mut product = Product { users: HashMap::new(), scopes: Vec::new() };
        scopes.iter().for_each(|scope| product.add(scope.clone()));
        product
    };
    let cost = |sums: &[Sum]| sums.iter().map(|sum| sum.cost(model, solved)).sum::<f64>();
    let mut given = product();
    let order = in_general(model, scopes, free);
    let sums: Vec<Sum> = order.into_iter().map(|variable| given.sum_out(model, variable)).collect();
    if solved.iter().all(Scope::is_empty) {
        return sums;
    }
    let greedy = product().greedily(model, free, solved);
    if cost(&greedy) < cost(&sums) { greedy } else { sums }
}

/// An order that depends on the scopes alone.
fn in_general(model: &Model, scopes: &[Scope], free: &BTreeSet<VariableId>) -> Vec<VariableId> {
    let all: BTreeSet<VariableId> = scopes.iter().flatten().chain(free).copied().collect();
    let all: Vec<VariableId> = all.into_iter().collect();
    let numbers: BTreeMap<VariableId, u32> = all.iter().copied().zip(0..).collect();
    let number = |scope: &Scope| scope.iter().map(|variable| numbers[variable]).collect();
    let numbered: Vec<Vec<u32>> = scopes.iter().map(number).collect();
    let cardinality = all.iter().map(|variable| weight(model, *variable)).collect();
    let order = elimination::order(cardinality, &numbered, &number(free));
    order.variables.iter().map(|one| all[*one as usize]).collect()
}

/// The number of values of a variable; 1 for the plate's index, since every answer iterates over the plate.
fn weight(model: &Model, variable: VariableId) -> f64 {
    if Some(variable) == model.plate_index() { 1.0 } else { size(model, variable) }
}

/// A product of factors in the making.
struct Product {
    /// The scope of each factor, emptied once it is under a sum.
    scopes: Vec<Scope>,
    /// The factors that depend on each variable.
    users: HashMap<VariableId, BTreeSet<usize>>,
}

impl Product {
    fn add(&mut self, scope: Scope) {
        for variable in &scope {
            self.users.entry(*variable).or_default().insert(self.scopes.len());
        }
        self.scopes.push(scope);
    }

    /// The sum over a variable, if it were the next.
    fn sum(&self, model: &Model, variable: VariableId) -> Sum {
        let inside: Vec<usize> = self.users.get(&variable).into_iter().flatten().copied().collect();
        let mut table = Scope::from([variable]);
        inside.iter().for_each(|factor| table.extend(&self.scopes[*factor]));
        let weight = table.iter().map(|variable| weight(model, *variable)).product();
        table.remove(&variable);
        Sum { variable, inside, table, weight }
    }

    /// All sums, the one of the fewest products next.
    fn greedily(mut self, model: &Model, free: &BTreeSet<VariableId>, solved: &[Scope]) -> Vec<Sum> {
        let cost = |product: &Self, one: VariableId| product.sum(model, one).cost(model, solved);
        let mut rest: BTreeMap<VariableId, f64> = free.iter().map(|one| (*one, cost(&self, *one))).collect();
        let mut sums = Vec::with_capacity(rest.len());
        while let Some((next, _)) = rest.iter().min_by(|one, other| one.1.total_cmp(other.1)) {
            let next = *next;
            rest.remove(&next);
            let sum = self.sum_out(model, next);
            for variable in &sum.table {
                if let Some(known) = rest.get_mut(variable) {
                    *known = cost(&self, *variable);
                }
            }
            sums.push(sum);
        }
        sums
    }

    fn sum_out(&mut self, model: &Model, variable: VariableId) -> Sum {
        let sum = self.sum(model, variable);
        self.users.remove(&variable);
        for factor in &sum.inside {
            for other in std::mem::take(&mut self.scopes[*factor]) {
                if let Some(users) = self.users.get_mut(&other) {
                    users.remove(factor);
                }
            }
        }
        self.add(sum.table.clone());
        sum
    }
}

impl Sum {
    /// The number of products.
    fn cost(&self, model: &Model, solved: &[Scope]) -> f64 {
        let is_solved = |factor: &usize| solved.get(*factor).is_some_and(|own| own.contains(&self.variable));
        match self.inside.iter().any(is_solved) {
            true => self.weight / weight(model, self.variable),
            false => self.weight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Domain, Form, ModelBuilder};

    #[test]
    fn each_sum_stands_over_the_factors_that_depend_on_it() {
        // A chain a − b − c − d of 2, 9, 3, 2 values, all but d summed: Σ_a makes 2 · 9, Σ_b 9 · 3, Σ_c 3 · 2.
        let mut model = ModelBuilder::new("M");
        let ids: Vec<_> = ([2, 9, 3, 2].iter().enumerate())
            .map(|(position, size)| model.variable(&format!("X{position}"), Domain::integers(1, *size)))
            .collect();
        for id in &ids {
            model.factor([*id], [], Form::Uniform);
        }
        let model = model.build().unwrap();
        let scopes: Vec<Scope> = ids.windows(2).map(|pair| pair.iter().copied().collect()).collect();
        let sums = sums(&model, &scopes, &ids[..3].iter().copied().collect(), &[]);
        let found: Vec<_> = sums.iter().map(|sum| (sum.variable, sum.weight, sum.inside.clone())).collect();
        assert_eq!(found, [(ids[0], 18.0, vec![0]), (ids[1], 27.0, vec![1, 3]), (ids[2], 6.0, vec![2, 4])]);
    }
}
