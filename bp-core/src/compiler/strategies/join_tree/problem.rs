//! The subproblem of a question: a network without its given and its barren variables.
//!
//! In: a network, the given variables, the variables that take part. Out: a [`Problem`]: consecutive numbers for the
//! free variables, and the tables as lists of them. Invariant: work on a problem takes time by its own size, not by
//! that of the network.

use super::network::Network;
use crate::elimination::{Effort, Order, triangulate};

/// The free variables of a question, and the tables that contain them.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// For each free variable its number in the network.
    pub(super) variables: Vec<usize>,
    /// The number of values of each.
    pub(super) cardinalities: Vec<usize>,
    /// The tables of the network with a free variable.
    pub(super) tables: Vec<usize>,
    /// The free variables of each table, by their numbers in the problem.
    pub(super) scopes: Vec<Vec<u32>>,
    /// The tables of the network whose variables are all given.
    pub(super) known: Vec<usize>,
}

impl Problem {
    /// The subproblem of all variables, or of those in `part`, which must contain the parents of each.
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
        // A variable that is in no table.
        for variable in (0..own.len()).filter(|one| part.is_none() && !given[*one]) {
            if own[variable] == u32::MAX {
                problem.variables.push(variable);
                problem.cardinalities.push(network.cardinalities[variable]);
            }
        }
        problem
    }

    /// The product of the cardinalities.
    pub(super) fn cells(&self, scope: &[u32]) -> f64 {
        scope.iter().map(|one| self.cardinalities[*one as usize] as f64).product()
    }

    /// An elimination order of all of its variables.
    pub(super) fn triangulated(&self, effort: Effort) -> Order {
        let cardinality = self.cardinalities.iter().map(|count| *count as f64).collect();
        triangulate(cardinality, &self.scopes, effort)
    }
}
