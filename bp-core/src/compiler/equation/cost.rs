//! The cost of an answer: tables, multiplications and additions.
//!
//! In: an exact plan. Out: a [`Cost`] for each sum, and for the final product. Invariant: an unknown size counts as 16;
//! the plate is counted once.
//!
//! A sum over X of k factors that depend on X and on T makes a table of |T| numbers with |X| · |T| · (k − 1)
//! multiplications and (|X| − 1) · |T| additions.

use super::eliminate::size;
use super::{Exact, Term};
use crate::ids::VariableId;
use crate::model::Model;

/// The cost of one table.
#[derive(Clone, PartialEq, Debug)]
pub struct Cost {
    /// Its variables.
    pub table: Vec<VariableId>,
    /// Numbers in it.
    pub entries: f64,
    /// Multiplications.
    pub multiplications: f64,
    /// Additions.
    pub additions: f64,
}

/// A sum over one variable.
#[derive(Clone, PartialEq, Debug)]
pub struct Elimination {
    /// The variable.
    pub variable: VariableId,
    /// The cost.
    pub cost: Cost,
}

impl Cost {
    /// Bytes of the table, at eight for each number.
    pub fn bytes(&self) -> f64 {
        self.entries * 8.0
    }
}

impl Exact {
    /// The product over the searched variables after all sums, and its normalisation if needed.
    pub fn answer_cost(&self, model: &Model) -> Cost {
        let open = |id: &VariableId| !self.bindings.contains_key(id) && Some(*id) != model.plate_index();
        let count =
            |ids: &[VariableId]| ids.iter().filter(|id| open(id)).map(|id| size(model, *id)).product::<f64>();
        let (rows, contexts) = (count(&self.searched), count(&self.each));
        let factors = match &self.terms[self.joint] {
            Term::Product(factors) => factors.len(),
            _ => 1,
        };
        let entries = rows * contexts;
        Cost {
            table: self.searched.iter().chain(&self.each).copied().filter(open).collect(),
            entries,
            // Normalisation is one product with the inverse of the sum for each number.
            multiplications: entries * (factors.max(1) - usize::from(self.normalised)) as f64,
            additions: if self.normalised { 0.0 } else { entries - contexts },
        }
    }

    /// Whether a sum is a scan, at a few operations for each element; those are not counted.
    pub fn has_scan(&self) -> bool {
        let (mut rest, mut found) = (vec![self.joint], false);
        while let Some(term) = rest.pop() {
            match &self.terms[term] {
                Term::FirstScan(_) => found = true,
                Term::Product(factors) => rest.extend(factors),
                Term::Sum(_, body) | Term::At(_, body) | Term::Normalise(_, body) => rest.push(*body),
                _ => {}
            }
        }
        found
    }

    /// Whether the counts are exact: every size on which a table depends is known.
    pub fn sizes_are_known(&self, model: &Model) -> bool {
        let tables = self.eliminations.iter().flat_map(|sum| sum.cost.table.iter().chain([&sum.variable]));
        let known = |id: &VariableId| {
            let variable = &model.variables[*id];
            let family = variable.family.as_ref().map(|family| model.index_count(&family.over));
            variable.domain.count().is_some() && family != Some(None)
        };
        tables.chain(&self.answer_cost(model).table).all(known)
    }
}
