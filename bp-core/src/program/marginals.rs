//! The posterior marginal of each variable, by names.
//!
//! In: a program and evidence. Out: a [`Posterior`] with a part for each variable. Invariant: an observed variable has
//! probability 1 at its value; potentials of a Markov network are not shown.

use super::expanded::expanded;
use super::value::{ordinal, read};
use super::{Evidence, Posterior, Program, Value};
use crate::answer::{self, Knowledge, Slot};
use crate::distribution::Setting;
use crate::error::Error;
use crate::guess::{did_you_mean, listed};
use crate::ids::VariableId;
use crate::model::{self, Domain, Known};

/// The posterior of some variables, or of elements of families; of all variables if `only` is empty.
pub(super) fn marginals(program: &Program, only: &[String], evidence: &Evidence) -> Result<Posterior, Error> {
    let model = program.model();
    without_rows(program)?;
    if let Some((program, only, evidence)) = expanded(program, only, evidence)? {
        return marginals(&program, &only, &evidence);
    }
    let inputs = program.settings.inputs();
    let setting = Setting::new(model, &inputs)?;
    let names = Names { program, setting: &setting };
    let knowledge = names.knowledge(evidence)?;
    let wanted = names.wanted(only)?;
    let by = (program.sampling, program.options);
    let mut all = match answer::marginals(model, &wanted, &knowledge, &inputs, by) {
        // The elements of a family may have exact answers one by one.
        Err(error @ Error::Unplanned { .. }) => {
            let names: Vec<String> = wanted.iter().map(|id| model.variable_name(*id)).collect();
            return match expanded(program, &names, evidence)? {
                Some((program, names, evidence)) => marginals(&program, &names, &evidence),
                None => Err(error),
            };
        }
        found => found?,
    };
    if !only.is_empty() {
        all.parts.retain(|part| {
            let slot = |slot: &Slot| {
                only.contains(&slot.name(model)) || only.contains(&model.variable_name(slot.variable))
            };
            part.of.iter().any(slot)
        });
        all.answer = all.parts.iter().flat_map(|part| part.rows(model)).collect();
    }
    all.question = format!("marginals of {}{}", program.name(), given(program, evidence));
    all.ln_evidence = all.ln_evidence.map(|ln| ln + program.opened.ln_scale);
    Ok(Posterior::new(program, all))
}

/// Refuses a program with rows of data.
pub(super) fn without_rows(program: &Program) -> Result<(), Error> {
    let message = "marginals do not read rows: ask a question, such as `P(X)`, or for `missing` cells";
    match program.opened.rows.is_empty() {
        true => Ok(()),
        false => Err(Error::input(program.name(), message)),
    }
}

impl Program {
    /// Whether an answer about all variables shows this one.
    pub(super) fn shows(&self, id: VariableId) -> bool {
        let model = self.model();
        let finite = model.plate.is_none() && model.variables.values().all(|it| it.domain.is_finite());
        Some(id) != model.plate_index()
            && (finite || model.variables[id].previous_of.is_none())
            && !self.opened.known.iter().any(|known| known.variable == id)
    }
}

/// The marginals of cases that know the same names: one plan, compiled once.
pub(super) struct Repeated<'p> {
    program: &'p Program,
    planned: answer::Planned<'p>,
}

impl<'p> Repeated<'p> {
    /// The plan of cases that know what this one knows; `None` where each needs its own.
    pub(super) fn new(program: &'p Program, only: &[String], evidence: &Evidence) -> Option<Self> {
        if expanded(program, only, evidence).ok()?.is_some() {
            return None;
        }
        let inputs = program.settings.inputs();
        let setting = Setting::new(program.model(), &inputs).ok()?;
        let names = Names { program, setting: &setting };
        let (wanted, knowledge) = (names.wanted(only).ok()?, names.knowledge(evidence).ok()?);
        let planned = answer::Planned::new(program.model(), wanted, &knowledge, program.options)?;
        Some(Self { program, planned })
    }

    /// The posterior of each wanted variable in another case.
    ///
    /// # Errors
    /// As [`marginals`].
    pub(super) fn marginals(&self, evidence: &Evidence) -> Result<answer::Answer, Error> {
        let program = self.program;
        let inputs = program.settings.inputs();
        let setting = Setting::new(program.model(), &inputs)?;
        let knowledge = Names { program, setting: &setting }.knowledge(evidence)?;
        let mut all = self.planned.marginals(&knowledge, &inputs, program.sampling)?;
        all.ln_evidence = all.ln_evidence.map(|ln| ln + program.opened.ln_scale);
        Ok(all)
    }
}

/// The evidence in the heading of an answer. A Markov network has ln Z without any evidence.
pub(super) fn given(program: &Program, evidence: &Evidence) -> String {
    match (evidence.iter().next(), program.opened.known.is_empty()) {
        (Some(_), _) => format!(" | {evidence}"),
        (None, true) => String::new(),
        (None, false) => " | potentials".to_owned(),
    }
}

/// Names and their meanings.
pub(super) struct Names<'p> {
    pub(super) program: &'p Program,
    pub(super) setting: &'p Setting<'p>,
}

impl Names<'_> {
    /// The variables that are named, or all that an answer shows, in the order of the model.
    fn wanted(&self, only: &[String]) -> Result<Vec<VariableId>, Error> {
        let named = only.iter().map(|name| Ok(self.find(name)?.0)).collect::<Result<Vec<_>, Error>>()?;
        let is_wanted = |id: &VariableId| self.program.shows(*id) && (named.is_empty() || named.contains(id));
        Ok(self.program.model().variables.ids().filter(is_wanted).collect())
    }

    /// A variable, or an element of one, from 0.
    pub(super) fn find(&self, name: &str) -> Result<(VariableId, Option<usize>), Error> {
        let model = self.program.model();
        if let Some(variable) = model.variable(name) {
            return Ok((variable, None));
        }
        let plain = name.split('[').next().unwrap_or(name).trim();
        let slots = model.variable(plain).map(|id| (id, self.setting.slots_of(id)));
        let element = slots.and_then(|(id, mut slots)| {
            let start = slots.start;
            slots.find(|slot| self.setting.slot_name(*slot) == name).map(|slot| (id, Some(slot - start)))
        });
        element.ok_or_else(|| {
            let names = self.program.variables();
            let near = did_you_mean(name, names.iter().map(String::as_str));
            let all = || format!("the variables are {}", listed(names.iter().map(String::as_str), "and"));
            let help = near.unwrap_or_else(all);
            Error::input(name, format!("`{}` has no variable of this name; {help}", model.name))
        })
    }

    /// Evidence on variables and on elements, together with the evidence that always holds.
    pub(super) fn knowledge(&self, evidence: &Evidence) -> Result<Knowledge, Error> {
        let model = self.program.model();
        let mut all = Knowledge { known: self.program.opened.known.clone(), ..Knowledge::default() };
        for (name, value) in evidence.iter() {
            let (variable, element) = self.find(name)?;
            let slots = self.setting.slots_of(variable);
            if self.program.opened.known.iter().any(|known| known.variable == variable) {
                return Err(Error::input(name, "it is a potential, which is not observed"));
            }
            let is_vector = matches!(model.variables[variable].domain, Domain::Vector(_));
            if let (true, Some(component)) = (is_vector, element)
                && !matches!(value, Value::Likelihood(_))
            {
                let number = self.number(variable, name, value)?;
                if !all.know_component(variable, (component, number), slots.len()) {
                    return Err(Error::input(name, format!("`{name}` is known twice")));
                }
                continue;
            }
            if all.holds(variable, element) {
                return Err(Error::input(name, format!("`{name}` is known twice")));
            }
            if let Value::Likelihood(weights) = value {
                check(name, weights, self.setting.count(variable), element.is_some() || slots.len() == 1)?;
                match element {
                    Some(element) => all.elements.weighed.push((variable, element, weights.clone())),
                    None => {
                        all.known.push(Known { variable, evidence: model::Finding::Virtual(weights.clone()) })
                    }
                }
                continue;
            }
            if let (None, 1) = (element, slots.len()) {
                all.known.push(Known {
                    variable,
                    evidence: model::Finding::Hard(self.value(variable, name, value)?),
                });
                continue;
            }
            if let (true, None, Value::List(numbers)) = (is_vector, element, value)
                && numbers.len() == slots.len()
            {
                let one = |value: &Value| self.number(variable, name, value);
                let numbers = numbers.iter().map(one).collect::<Result<Vec<f64>, Error>>()?;
                let evidence = model::Finding::Hard(model::Value::Vector(numbers));
                all.known.push(Known { variable, evidence });
                continue;
            }
            if !model.variables[variable].domain.is_finite() {
                let message = match is_vector && element.is_none() {
                    true => format!("a vector of {} numbers is expected", slots.len()),
                    false => "one component is not known here: ask `P(X | Z[2] = 3)` instead".to_owned(),
                };
                return Err(Error::input(name, message));
            }
            let values = value.flat();
            let places: Vec<usize> = element.map_or_else(|| (0..slots.len()).collect(), |one| vec![one]);
            if values.len() != places.len() {
                let message =
                    format!("{} values were given, but {} are expected", values.len(), places.len());
                return Err(Error::input(name, message));
            }
            for (place, value) in places.into_iter().zip(values) {
                let slot = Slot::of(self.setting, slots.start + place);
                let value = ordinal(self.program.model(), &slot, value);
                all.elements.hard.push((
                    variable,
                    place,
                    value.map_err(|message| Error::input(name, message))?,
                ));
            }
        }
        Ok(all)
    }

    /// The number of a component of a vector.
    fn number(&self, variable: VariableId, name: &str, value: &Value) -> Result<f64, Error> {
        match self.value(variable, name, value)? {
            model::Value::Real(number) => Ok(number),
            model::Value::Ordinal(_) | model::Value::Vector(_) | model::Value::Given(_) => {
                Err(Error::input(name, format!("`{value}` is not a number")))
            }
        }
    }

    /// A value of a variable.
    fn value(&self, variable: VariableId, name: &str, value: &Value) -> Result<model::Value, Error> {
        let size = |name: &str| self.program.settings.size(name);
        let read = read(self.program.model(), variable, value, &size);
        let (ordinal, number) = read.map_err(|message| Error::input(name, message))?;
        Ok(ordinal.map_or(model::Value::Real(number), model::Value::Ordinal))
    }
}

/// Refuses a likelihood with a number that is negative or not finite.
pub(super) fn check(name: &str, weights: &[f64], count: usize, is_one: bool) -> Result<(), Error> {
    let found = weights.len();
    let wrong = match () {
        () if !is_one => "a likelihood is given to one element, such as `Z[2]`".to_owned(),
        () if count == 0 => {
            "it is real: a likelihood has a number for each value of a finite variable".to_owned()
        }
        () if found != count => format!("its likelihood must have {count} numbers, but has {found}"),
        () if !weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite()) => {
            format!("a likelihood is made of finite numbers, none negative, but this is {weights:?}")
        }
        () if weights.iter().all(|weight| *weight == 0.0) => "its likelihood is 0 for every value".to_owned(),
        () => return Ok(()),
    };
    Err(Error::input(name, wrong))
}
