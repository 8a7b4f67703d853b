//! Networks by name: translates evidence and answers between names and numbers.
//!
//! In: names of variables and of their values. Out: numbers of both. Invariant: the error for an unknown name suggests
//! the nearest known one.

use super::evidence::NetworkEvidence;
use super::network::Network;
use crate::data::Values;
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess;
use crate::ids::{FactorId, VariableId};
use crate::model::{self, Known, Model, Value};
use std::collections::{HashMap, HashSet};

/// A model's finite variables, by name and by number; an element of a family is `Z[2]`.
#[derive(Clone, Debug)]
pub struct Named {
    /// The variables and their tables.
    pub network: Network,
    model: Model,
    /// A constant added to ln P(evidence): ln Z of a Markov network, otherwise 0.
    pub ln_scale: f64,
    /// For each number its name, and its variable in the model (or the family that it is an element of).
    names: Vec<(String, VariableId)>,
    numbers: HashMap<String, usize>,
    /// Evidence that holds for every question: (variable, value). Answers do not show these variables.
    known: Vec<(usize, usize)>,
}

/// The names of the variables of a network, and the evidence that holds for every question.
type Names = (Vec<(String, VariableId)>, Vec<(usize, usize)>);

/// The names of the slots of a setting that a network has: `numbers` has the number of each, `usize::MAX` where it has none.
fn names(setting: &Setting<'_>, known: &[Known], numbers: &[usize]) -> Names {
    let value = |known: &Known| match known.evidence {
        model::Finding::Hard(Value::Ordinal(ordinal)) => {
            Some((numbers[setting.slots_of(known.variable).start], ordinal))
        }
        _ => None,
    };
    let slots = (0..setting.slots()).filter(|slot| numbers[*slot] != usize::MAX);
    let names = slots.map(|slot| (setting.slot_name(slot), setting.variable_of(slot)));
    (names.collect(), known.iter().filter_map(value).collect())
}

impl Named {
    /// The network of a model, with evidence that holds for every question.
    ///
    /// # Errors
    /// See [`Network::of`].
    pub fn new(model: Model, known: &[Known]) -> Result<Self, Error> {
        Self::with(model, known, &Inputs::default())
    }

    /// The same with numbers for its parameters.
    ///
    /// # Errors
    /// See [`Network::of`].
    pub fn with(model: Model, known: &[Known], inputs: &Inputs<'_, f64>) -> Result<Self, Error> {
        let setting = Setting::new(&model, inputs)?;
        let network = Network::of(&setting)?;
        let slots: Vec<usize> = (0..setting.slots()).collect();
        let names = names(&setting, known, &slots);
        Ok(Self::made(model, network, names))
    }

    /// The network of some factors, which distribute all ancestors of their variables, and of the variables `kept`: what the
    /// others distribute is summed out.
    ///
    /// # Errors
    /// See [`Network::of`].
    pub(crate) fn of_factors<'n>(
        model: Model,
        known: &[Known],
        inputs: &Inputs<'_, f64>,
        factors: &[FactorId],
        kept: impl Iterator<Item = &'n str>,
    ) -> Result<Self, Error> {
        let setting = Setting::new(&model, inputs)?;
        let slots: HashMap<String, usize> =
            (0..setting.slots()).map(|slot| (setting.slot_name(slot), slot)).collect();
        let kept: Vec<usize> = kept.filter_map(|name| slots.get(name).copied()).collect();
        let (network, numbers) = Network::ancestral(&setting, factors, &kept)?;
        let names = names(&setting, known, &numbers);
        Ok(Self::made(model, network, names))
    }

    fn made(model: Model, network: Network, (names, known): Names) -> Self {
        let mut numbers = HashMap::with_capacity(names.len());
        for (number, (name, _)) in names.iter().enumerate() {
            numbers.entry(name.clone()).or_insert(number);
        }
        Self { network, ln_scale: 0.0, names, numbers, model, known }
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The variables that an answer shows: all except those known for every question, and parts of forms.
    pub fn shown(&self) -> Vec<usize> {
        let hidden: HashSet<usize> = self.known.iter().map(|(variable, _)| *variable).collect();
        let is_own = |one: &usize| self.model.variables[self.names[*one].1].derived.is_none();
        (0..self.network.cardinalities.len()).filter(|one| !hidden.contains(one) && is_own(one)).collect()
    }

    /// The name of a variable.
    pub fn variable(&self, number: usize) -> String {
        self.names[number].0.clone()
    }

    /// The name of a variable's value.
    pub fn value(&self, variable: usize, value: usize) -> String {
        self.model.value_name(self.names[variable].1, value)
    }

    /// The number of a variable.
    ///
    /// # Errors
    /// No variable has this name.
    pub fn number_of(&self, variable: &str) -> Result<usize, Error> {
        self.numbers.get(variable).copied().ok_or_else(|| {
            let family =
                self.model.variable(variable).filter(|id| self.model.variables[*id].family.is_some());
            if let Some(first) = family.and_then(|id| self.names.iter().find(|(_, own)| *own == id)) {
                let message = format!("it is a family: name its elements, such as `{}`", first.0);
                return Error::input(variable, message);
            }
            let near = guess::did_you_mean(variable, self.numbers.keys().map(String::as_str));
            let help = near.map_or_else(String::new, |near| format!("; {near}"));
            Error::input(variable, format!("`{}` has no variable of this name{help}", self.model.name))
        })
    }

    /// The names of the values of a variable.
    pub fn values(&self, variable: usize) -> Values<'_> {
        Values::new(&self.model, self.names[variable].1, &|_| None)
    }

    /// The number of a variable's value; `None` where the text marks a missing value, as `NA` does.
    ///
    /// # Errors
    /// The variable has no such value.
    pub fn value_of(&self, variable: usize, value: &str) -> Result<Option<usize>, Error> {
        match self.values(variable).read(value) {
            Ok(read) => Ok(read.and_then(|value| value.ordinal)),
            Err(expected) => Err(Error::input(self.variable(variable), format!("`{value}` is {expected}"))),
        }
    }

    /// Evidence by names: values, and likelihoods.
    ///
    /// # Errors
    /// An unknown name; a likelihood of the wrong length, or with negative or non-finite numbers.
    pub fn evidence<'n>(
        &self,
        values: impl IntoIterator<Item = (&'n str, &'n str)>,
        likelihoods: impl IntoIterator<Item = (&'n str, &'n [f64])>,
    ) -> Result<NetworkEvidence, Error> {
        let mut evidence = NetworkEvidence { hard: self.known.clone(), ..NetworkEvidence::default() };
        for (name, value) in values {
            let variable = self.number_of(name)?;
            if let Some(value) = self.value_of(variable, value)? {
                evidence.hard.push((variable, value));
            }
        }
        for (name, weights) in likelihoods {
            let variable = self.number_of(name)?;
            let is_known = evidence.hard.iter().any(|(known, _)| *known == variable);
            let (count, found) = (self.network.cardinalities[variable], weights.len());
            let expected = match () {
                () if is_known => format!("`{name}` is known twice"),
                () if found != count => format!("its likelihood must have {count} numbers, but has {found}"),
                () if !weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite()) => {
                    format!("a likelihood needs finite numbers, none negative, but this is {weights:?}")
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

    /// Replaces the numbers in an error by names.
    pub fn with_names(&self, error: Error) -> Error {
        match error {
            Error::Contradiction { variables, .. } => {
                let names: Vec<String> = variables.iter().map(|one| self.variable(*one)).collect();
                let names = guess::listed(names.iter().map(String::as_str), "and");
                Error::Contradiction { variables, names }
            }
            Error::Evidence { variable, message } => Error::input(self.variable(variable), message),
            other => other,
        }
    }
}
