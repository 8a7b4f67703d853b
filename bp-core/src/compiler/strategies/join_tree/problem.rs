//! What is left of a network: without what is given, and without what is barren.
//!
//! In: a network, which variables are given, which take part. Out: a [`Problem`]: its own small numbers for the free
//! variables, and the tables as lists of them. Invariant: all work on a problem takes time by its own size, not by that of
//! the network.

use super::network::Network;
use crate::elimination::{Effort, Order, triangulate};

/// The free variables of a question, and the tables that speak of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// For each free variable its number in the network.
    pub(super) variables: Vec<usize>,
    /// How many values each has.
    pub(super) cardinalities: Vec<usize>,
    /// Tables of the network that have a free variable.
    pub(super) tables: Vec<usize>,
    /// The free variables of each, by their own numbers.
    pub(super) scopes: Vec<Vec<u32>>,
    /// Tables of the network all of whose variables are given.
    pub(super) known: Vec<usize>,
}

impl Problem {
    /// The variables that take part are all, or those that are named: then every one's parents must be among them.
    pub(super) fn of(network: &Network, given: &[bool], part: Option<&[usize]>) -> Self {
        let mut problem = Self::default();
        let mut own = vec![u32::MAX; network.cardinalities.len()];
        let tables: Vec<usize> = match part {
            None => (0..network.tables.len()).collect(),
            Some(part) => part.iter().filter_map(|one| network.table_of[*one]).collect(),
        };
        for table in tables {
            let mut scope = Vec::new();
            for variable in network.tables[table].variables.iter().copied().filter(|one| !given[*one]) {
                if own[variable] == u32::MAX {
                    own[variable] = problem.variables.len() as u32;
                    problem.variables.push(variable);
                    problem.cardinalities.push(network.cardinalities[variable]);
                }
                scope.push(own[variable]);
            }
            match scope.is_empty() {
                true => problem.known.push(table),
                false => {
                    problem.tables.push(table);
                    problem.scopes.push(scope);
                }
            }
        }
        // A variable that no table speaks of.
        for variable in (0..own.len()).filter(|one| part.is_none() && !given[*one]) {
            if own[variable] == u32::MAX {
                problem.variables.push(variable);
                problem.cardinalities.push(network.cardinalities[variable]);
            }
        }
        problem
    }

    /// The product of the numbers of values.
    pub(super) fn cells(&self, scope: &[u32]) -> f64 {
        scope.iter().map(|one| self.cardinalities[*one as usize] as f64).product()
    }

    /// An order in which to eliminate all of its variables.
    pub(super) fn triangulated(&self, effort: Effort) -> Order {
        let cardinality = self.cardinalities.iter().map(|count| *count as f64).collect();
        triangulate(cardinality, &self.scopes, effort)
    }
}
