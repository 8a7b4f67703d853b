//! The question to a program with expanded families.
//!
//! In: an ask of the original program. Out: the same ask of elements, each with its value. Invariant: the values given
//! for a family are assigned to its elements in order.

use super::Writer;
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Finding, Known, Searched, Statistic, Value};
use std::collections::HashMap;

impl Writer<'_, '_> {
    pub(super) fn ask(
        &self,
        ask: &Ask,
        names: &mut HashMap<VariableId, (VariableId, Option<i64>)>,
    ) -> Result<Ask, Error> {
        let mut searched = Vec::new();
        for item in &ask.searched {
            for (variable, element) in self.meant(item.variable, names) {
                let at = item.at.as_ref().map(|at| self.value_at(item.variable, element, at)).transpose()?;
                searched.push(Searched { variable, at });
            }
        }
        let known = self.known(&ask.known, names)?;
        let statistic = match &ask.statistic {
            Statistic::Divergence { when, from } => {
                Statistic::Divergence { when: *when, from: self.known(from, names)? }
            }
            other => other.clone(),
        };
        Ok(Ask { statistic, when: ask.when, searched, known })
    }

    /// The expanded variables of a variable, each with its position; their names are kept.
    fn meant(
        &self,
        variable: VariableId,
        names: &mut HashMap<VariableId, (VariableId, Option<i64>)>,
    ) -> Vec<(VariableId, Option<usize>)> {
        let family = self.setting.model.variables[variable].family;
        let Some(family) = family else {
            let meant = self.element(variable, 0);
            names.insert(meant, (variable, None));
            return vec![(meant, None)];
        };
        let of = |element: usize| {
            let meant = self.element(variable, element);
            names.insert(meant, (variable, Some(family.over.first() + element as i64)));
            (meant, Some(element))
        };
        (0..self.elements(variable)).map(of).collect()
    }

    fn known(
        &self,
        known: &[Known],
        names: &mut HashMap<VariableId, (VariableId, Option<i64>)>,
    ) -> Result<Vec<Known>, Error> {
        let mut all = Vec::new();
        for item in known {
            let name = self.setting.model.variable_name(item.variable);
            let real = !self.setting.model.variables[item.variable].domain.is_finite();
            for (variable, element) in self.meant(item.variable, names) {
                let own = Value::Given(name.clone());
                let value = match &item.evidence {
                    Finding::Hard(value) => Some(value),
                    Finding::Each if real && element.is_some() => Some(&own),
                    _ => None,
                };
                let evidence = match value {
                    Some(value) if self.is_missing(element, value) => continue,
                    Some(value) => Finding::Hard(self.value_at(item.variable, element, value)?),
                    None => item.evidence.clone(),
                };
                all.push(Known { variable, evidence });
            }
        }
        Ok(all)
    }

    /// Whether the value of a family's element is missing: the element is then not known.
    fn is_missing(&self, element: Option<usize>, value: &Value) -> bool {
        let (Value::Given(name), Some(element)) = (value, element) else { return false };
        let value = self.setting.given(name).and_then(|given| given.get(element));
        value.is_some_and(|value| value.is_nan())
    }

    /// The value of one element, from the values given for its family.
    fn value_at(&self, variable: VariableId, element: Option<usize>, value: &Value) -> Result<Value, Error> {
        let (Value::Given(name), Some(element)) = (value, element) else { return Ok(value.clone()) };
        let given = self.setting.given(name);
        let given = given.ok_or_else(|| Error::input(name, "this value was not given"))?;
        let count = self.elements(variable);
        if given.len() != count {
            let message = format!("{} numbers were given, but {count} are expected", given.len());
            return Err(Error::input(name, message));
        }
        let domain = &self.setting.model.variables[variable].domain;
        let refused = || {
            let message = format!("{} is not a value of it", given[element]);
            Error::input(format!("{name}[{element}]"), message)
        };
        match domain {
            Domain::Real => Ok(Value::Real(given[element])),
            Domain::Vector(_) => Err(refused()),
            _ => {
                let count = Some(self.setting.count(variable));
                domain.ordinal_among(given[element], count).map(Value::Ordinal).ok_or_else(refused)
            }
        }
    }
}
