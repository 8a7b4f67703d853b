//! Cases: one observation of each variable.
//!
//! In: numbers, or values by their names. Out: a [`Case`]. Invariant: every number is in the domain of its variable;
//! values that are not given are missing.

use crate::data::Values;
use crate::error::Error;
use crate::ids::{Id, VariableId};
use crate::model::Model;

/// The values of variables: the number of the value in an expression, or nothing if it is missing. A real in bins may
/// keep the number in the data.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    numbers: Vec<Option<f64>>,
}

impl Case {
    /// An empty case.
    pub fn new(model: &Model) -> Self {
        Self { numbers: vec![None; model.variables.len()] }
    }

    /// With the number of a variable: an integer is itself, `true` is 1, the first label of an enumeration is 0.
    pub fn with(mut self, variable: VariableId, number: f64) -> Self {
        // −0 is 0.
        self.numbers[variable.position()] = Some(number + 0.0);
        self
    }

    /// With a value as text, as in a table: an empty text, `NA` and `?` are missing.
    ///
    /// # Errors
    /// The model has no such variable, or the variable no such value.
    pub fn with_value(self, model: &Model, variable: &str, value: &str) -> Result<Self, Error> {
        let id = model.variable(variable);
        let id = id.ok_or_else(|| {
            Error::input(variable, format!("`{}` has no variable of this name", model.name))
        })?;
        match Values::new(model, id, &|_| None).read(value) {
            Ok(Some(value)) => Ok(self.with(id, value.number)),
            Ok(None) => Ok(self),
            Err(expected) => Err(Error::input(variable, format!("`{value}` is {expected}"))),
        }
    }

    /// The number of a variable.
    pub fn number(&self, variable: VariableId) -> Option<f64> {
        self.numbers.get(variable.position()).copied().flatten()
    }

    /// Every known number, with its variable.
    pub(super) fn numbers(&self) -> impl Iterator<Item = (VariableId, f64)> {
        let numbers = self.numbers.iter().enumerate();
        numbers.filter_map(|(id, number)| Some((VariableId::new(id), (*number)?)))
    }
}

/// The message for something that is not a value of a variable.
pub(super) fn no_value(model: &Model, variable: VariableId) -> String {
    let domain = &model.variables[variable].domain;
    let (name, domain) = (model.variable_name(variable), model.domain_text(domain));
    format!("not a value of `{name}`, which is `{domain}`")
}
