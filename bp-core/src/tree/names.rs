//! Networks by name: evidence as people write it, answers as they read it.
//!
//! In: names of variables and of their values. Out: numbers of both. Invariant: a name that nothing has is told with the
//! nearest one that something has.

use super::evidence::Evidence;
use super::network::Network;
use crate::error::Error;
use crate::guess;
use crate::ids::{Id, VariableId};
use crate::model::Model;
use std::collections::HashMap;

/// A model's finite variables, by name and by number.
#[derive(Clone, Debug)]
pub struct Named {
    /// The variables and their tables.
    pub network: Network,
    model: Model,
    numbers: HashMap<String, VariableId>,
}

impl Named {
    /// The network of a model.
    ///
    /// # Errors
    /// See [`Network::of`].
    pub fn new(model: Model) -> Result<Self, Error> {
        Ok(Self { network: Network::of(&model)?, numbers: model.variables_by_name(), model })
    }

    /// The name of a variable.
    pub fn variable(&self, number: usize) -> String {
        self.model.variable_name(VariableId::new(number))
    }

    /// The name of a variable's value.
    pub fn value(&self, variable: usize, value: usize) -> String {
        self.model.value_name(VariableId::new(variable), value)
    }

    /// The number of a variable.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn number_of(&self, variable: &str) -> Result<usize, Error> {
        self.numbers.get(variable).map(|id| id.position()).ok_or_else(|| {
            let near = guess::nearest(variable, self.numbers.keys().map(String::as_str));
            let help = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            Error::input(variable, format!("`{}` has no variable of this name{help}", self.model.name))
        })
    }

    /// The number of a variable's value.
    ///
    /// # Errors
    /// The variable has none of this name.
    pub fn value_of(&self, variable: usize, value: &str) -> Result<usize, Error> {
        let id = VariableId::new(variable);
        let domain = &self.model.variables[id].domain;
        domain.ordinal_of(value).ok_or_else(|| {
            let text = self.model.domain_text(domain);
            Error::input(
                self.variable(variable),
                format!("`{value}` is not one of its values, which are `{text}`"),
            )
        })
    }

    /// Evidence by names: values, and likelihoods.
    ///
    /// # Errors
    /// A name that nothing has; a likelihood of the wrong length, or with numbers that cannot be.
    pub fn evidence<'n>(
        &self,
        values: impl IntoIterator<Item = (&'n str, &'n str)>,
        likelihoods: impl IntoIterator<Item = (&'n str, &'n [f64])>,
    ) -> Result<Evidence, Error> {
        let mut evidence = Evidence::default();
        for (name, value) in values {
            let variable = self.number_of(name)?;
            evidence.hard.push((variable, self.value_of(variable, value)?));
        }
        for (name, weights) in likelihoods {
            let variable = self.number_of(name)?;
            let (count, found) = (self.network.cardinalities[variable], weights.len());
            let expected = match () {
                () if found != count => format!("its likelihood must have {count} numbers, but has {found}"),
                () if !weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite()) => {
                    format!("a likelihood is made of finite numbers, none negative, but this is {weights:?}")
                }
                () if weights.iter().all(|weight| *weight == 0.0) => {
                    "its likelihood is 0 for every value".to_owned()
                }
                () => {
                    evidence.likelihoods.push((variable, weights.to_vec()));
                    continue;
                }
            };
            return Err(Error::input(name, expected));
        }
        Ok(evidence)
    }

    /// An error with names where it has numbers.
    pub fn tell(&self, error: Error) -> Error {
        match error {
            Error::Contradiction { variables, .. } => {
                let names: Vec<String> = variables.iter().map(|one| self.variable(*one)).collect();
                let names = guess::listed(names.iter().map(String::as_str), "and");
                Error::Contradiction { variables, names }
            }
            other => other,
        }
    }
}
