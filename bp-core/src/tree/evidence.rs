//! Evidence: what is known of the variables of a network.
//!
//! In: values and likelihoods. Out: them, ready for a tree. Invariant: a given variable's value slices its tables; any
//! other's is a likelihood of 0 and 1.

use super::compile::Tree;
use crate::error::Error;

/// What is known: values, and likelihoods.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// (variable, value); for the given variables of a tree each must be there.
    pub hard: Vec<(usize, usize)>,
    /// (variable, a likelihood for each of its values): virtual evidence.
    pub likelihoods: Vec<(usize, Vec<f64>)>,
}

/// Evidence as a tree reads it.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// The value of each variable that has one; else `usize::MAX`.
    pub(super) values: Vec<usize>,
    /// Where the likelihood of each variable begins; `usize::MAX` where it has none.
    pub(super) places: Vec<usize>,
    pub(super) likelihoods: Vec<f64>,
    /// ln of what is certain: tables and likelihoods of given variables only.
    pub(super) ln_certain: f64,
}

impl Known {
    pub(super) fn nothing(count: usize) -> Self {
        Self {
            values: vec![usize::MAX; count],
            places: vec![usize::MAX; count],
            likelihoods: Vec::new(),
            ln_certain: 0.0,
        }
    }

    /// Reads evidence for a tree.
    pub(super) fn read(&mut self, tree: &Tree, evidence: &Evidence) -> Result<(), Error> {
        self.values.fill(usize::MAX);
        self.places.fill(usize::MAX);
        self.likelihoods.clear();
        self.ln_certain = 0.0;
        let cardinalities = &tree.network.cardinalities;
        for (variable, value) in &evidence.hard {
            let count = cardinalities[*variable];
            if *value >= count {
                return Err(Error::input(
                    format!("variable {variable}"),
                    format!("{value} is not one of its {count} values"),
                ));
            }
            self.values[*variable] = *value;
            if !tree.given[*variable] {
                self.places[*variable] = self.likelihoods.len();
                self.likelihoods.extend((0..count).map(|other| f64::from(u8::from(other == *value))));
            }
        }
        for (variable, weights) in &evidence.likelihoods {
            self.weigh(tree, *variable, weights)?;
        }
        let missing =
            (0..cardinalities.len()).find(|one| tree.given[*one] && self.values[*one] == usize::MAX);
        if let Some(variable) = missing {
            return Err(Error::input(format!("variable {variable}"), "its value was not given"));
        }
        for (table, given) in &tree.known {
            self.ln_certain += tree.network.tables[*table].values[self.base(given)].ln();
        }
        Ok(())
    }

    fn weigh(&mut self, tree: &Tree, variable: usize, weights: &[f64]) -> Result<(), Error> {
        let count = tree.network.cardinalities[variable];
        let valid =
            weights.len() == count && weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite());
        if !valid {
            let message = format!(
                "its likelihood must be {count} finite numbers, none negative, but it is {weights:?}"
            );
            return Err(Error::input(format!("variable {variable}"), message));
        }
        match (self.values[variable], self.places[variable]) {
            (value, _) if tree.given[variable] && value < count => self.ln_certain += weights[value].ln(),
            (_, usize::MAX) => {
                self.places[variable] = self.likelihoods.len();
                self.likelihoods.extend_from_slice(weights);
            }
            (_, place) => {
                let known = &mut self.likelihoods[place..place + count];
                known.iter_mut().zip(weights).for_each(|(known, weight)| *known *= weight);
            }
        }
        Ok(())
    }

    /// The given variables of a table that is 0 at their values, or a variable whose likelihood is.
    pub(super) fn certain_zero(&self, tree: &Tree) -> Vec<usize> {
        let zero = |(table, given): &&(usize, Vec<(usize, usize)>)| {
            tree.network.tables[*table].values[self.base(given)] == 0.0
        };
        let table = tree.known.iter().find(zero);
        table.map_or_else(Vec::new, |(_, given)| given.iter().map(|(variable, _)| *variable).collect())
    }

    /// Where a table begins at the given values.
    pub(super) fn base(&self, given: &[(usize, usize)]) -> usize {
        given.iter().map(|(variable, stride)| self.values[*variable] * stride).sum()
    }
}
