//! The sums of an equation in order, each with the factors that stand under it.
//!
//! In: the variables on which each factor depends, and those that are to be summed out. Out: the sums in the order that
//! `elimination` finds. Invariant: each variable is summed over exactly the factors that depend on it; scopes are kept for each
//! factor and change only where a sum takes the place of some.

use super::eliminate::size;
use super::scope::Scope;
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

/// The sums, in the cheapest order that is found.
pub(super) fn sums(model: &Model, scopes: &[Scope], free: &BTreeSet<VariableId>) -> Vec<Sum> {
    let all: BTreeSet<VariableId> = scopes.iter().flatten().chain(free).copied().collect();
    let all: Vec<VariableId> = all.into_iter().collect();
    let numbers: BTreeMap<VariableId, u32> = all.iter().copied().zip(0..).collect();
    let number = |scope: &Scope| scope.iter().map(|variable| numbers[variable]).collect();
    let numbered: Vec<Vec<u32>> = scopes.iter().map(number).collect();
    let cardinality = all.iter().map(|variable| weight(model, *variable)).collect();
    let order = elimination::order(cardinality, &numbered, &number(free));
    let mut product = Product { users: HashMap::new(), scopes: Vec::new() };
    scopes.iter().for_each(|scope| product.add(scope.clone()));
    order.variables.iter().map(|one| product.sum_out(model, all[*one as usize])).collect()
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

    fn sum_out(&mut self, model: &Model, variable: VariableId) -> Sum {
        let inside: Vec<usize> = self.users.remove(&variable).into_iter().flatten().collect();
        let mut table = Scope::from([variable]);
        inside.iter().for_each(|factor| table.extend(&self.scopes[*factor]));
        let weight = table.iter().map(|variable| weight(model, *variable)).product();
        table.remove(&variable);
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
        let sums = sums(&model, &scopes, &ids[..3].iter().copied().collect());
        let found: Vec<_> = sums.iter().map(|sum| (sum.variable, sum.weight, sum.inside.clone())).collect();
        assert_eq!(found, [(ids[0], 18.0, vec![0]), (ids[1], 27.0, vec![1, 3]), (ids[2], 6.0, vec![2, 4])]);
    }
}
