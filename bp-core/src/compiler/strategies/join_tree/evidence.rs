//! Evidence on the variables of a network.
//!
//! In: values and likelihoods. Out: the evidence in the form that a tree reads. Invariant: the value of a given
//! variable slices its tables; that of a weighed one is a likelihood of 0 and 1; any other variable must not have
//! evidence.

use super::cell::Cell;
use super::compile::Tree;
use super::refused::Refused;
use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};

/// Hard and virtual evidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NetworkEvidence {
    /// (variable, value); every given variable of a tree must have a value.
    pub hard: Vec<(usize, usize)>,
    /// (variable, a likelihood for each of its values): virtual evidence.
    pub likelihoods: Vec<(usize, Vec<f64>)>,
}

/// Evidence as a tree reads it.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// The value of each variable; `usize::MAX` where it has none.
    pub(super) values: Vec<usize>,
    /// Which variables have a likelihood that is not constant.
    pub(super) weighed: Vec<bool>,
    /// The selected slice of each slicing of the tree's tables.
    pub(super) slices: Vec<usize>,
    /// The constant factor: tables and likelihoods of given variables only.
    pub(super) certain: Extended,
    /// The power of two taken out of the likelihoods.
    pub(super) exponent: i64,
    /// Whether a product of likelihoods underflowed.
    pub(super) lost: bool,
}

impl Known {
    pub(super) fn nothing(tree: &Tree) -> Self {
        let count = tree.cardinalities.len();
        Self {
            values: vec![usize::MAX; count],
            weighed: vec![false; count],
            slices: vec![0; tree.tables.slicings.len()],
            certain: Extended::ONE,
            exponent: 0,
            lost: false,
        }
    }

    /// Reads evidence for a tree; the likelihoods go into `cells`.
    pub(super) fn read<T: Cell>(
        &mut self,
        tree: &Tree,
        evidence: &NetworkEvidence,
        cells: &mut [T],
    ) -> Result<(), Error> {
        self.values.fill(usize::MAX);
        self.weighed.fill(false);
        (self.certain, self.exponent, self.lost) = (Extended::ONE, 0, false);
        for variable in &tree.weighed {
            cells[tree.likelihood(*variable)].fill(T::ONE);
        }
        evidence.hard.iter().for_each(|(variable, value)| self.values[*variable] = *value);
        Refused::check(&tree.refused, &self.values)?;
        for (variable, value) in &evidence.hard {
            let count = tree.cardinalities[*variable];
            if *value >= count {
                return Err(Error::Evidence {
                    variable: *variable,
                    message: format!("{value} is not one of its {count} values"),
                });
            }
            if !tree.given[*variable] {
                self.weigh(tree, *variable, cells, |other| f64::from(u8::from(other == *value)))?;
            }
        }
        if let Some(variable) = tree.given_variables.iter().find(|one| self.values[**one] == usize::MAX) {
            return Err(Error::Evidence {
                variable: *variable,
                message: "its value was not given".to_owned(),
            });
        }
        for (variable, weights) in &evidence.likelihoods {
            let count = tree.cardinalities[*variable];
            let valid =
                weights.len() == count && weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite());
            if !valid {
                let message = format!(
                    "its likelihood must be {count} finite numbers, none negative, but it is {weights:?}"
                );
                return Err(Error::Evidence { variable: *variable, message });
            }
            match tree.given[*variable] {
                true => {
                    let weight = Extended::from_f64(weights[self.values[*variable]]);
                    self.include(weight, || vec![*variable])?;
                }
                false => self.weigh(tree, *variable, cells, |value| weights[value])?,
            }
        }
        for (slice, slicing) in self.slices.iter_mut().zip(&tree.tables.slicings) {
            *slice = slicing.iter().map(|(variable, step)| self.values[*variable] * step).sum();
        }
        for (start, slicing) in &tree.tables.known {
            let value = T::tables(tree)[start + self.slices[*slicing]].extended();
            let variables = || tree.tables.slicings[*slicing].iter().map(|(variable, _)| *variable).collect();
            self.include(value, variables)?;
        }
        Ok(())
    }

    /// Multiplies the constant factor by a number.
    fn include(&mut self, value: Extended, variables: impl Fn() -> Vec<usize>) -> Result<(), Error> {
        self.certain = self.certain * value;
        match self.certain > Extended::ZERO {
            true => Ok(()),
            false => Err(contradiction(variables())),
        }
    }

    fn weigh<T: Cell>(
        &mut self,
        tree: &Tree,
        variable: usize,
        cells: &mut [T],
        weight: impl Fn(usize) -> f64,
    ) -> Result<(), Error> {
        if tree.likelihoods[variable] == usize::MAX {
            let message = "there is evidence for it, but it is neither an observed nor a weighted variable of this plan";
            return Err(Error::Evidence { variable, message: message.to_owned() });
        }
        self.weighed[variable] = true;
        let own = &mut cells[tree.likelihood(variable)];
        for (value, cell) in own.iter_mut().enumerate() {
            let weight = [T::from_f64(weight(value))];
            self.lost |= T::may_lose(&[*cell], &weight);
            *cell = *cell * weight[0];
        }
        self.exponent += T::rescale(own).ok_or_else(|| contradiction(vec![variable]))?;
        Ok(())
    }
}

/// The error for evidence of probability zero.
pub(super) fn contradiction(mut variables: Vec<usize>) -> Error {
    variables.sort_unstable();
    variables.dedup();
    let names = format!("variables {variables:?}");
    Error::Contradiction { variables, names }
}
