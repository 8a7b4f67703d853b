//! Questions with their evidence left open.
//!
//! In: a question. Out: the same question with a name in place of each value, and a control for each name. Invariant: with
//! the initial values of the controls it is the question as it is written; of a table, the row of the first values.

use super::control::{Control, Element};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Domain, Finding, IndexSpace, Known, Model, Question, Statistic, Value};

/// The most elements of a family that have controls.
const MOST_ELEMENTS: usize = 64;

/// The question with its evidence open, and the controls that give it.
pub fn opened(model: &Model, question: &Question) -> (Question, Vec<Control>) {
    let mut question = question.clone();
    let mut controls: Vec<Control> = Vec::new();
    let mut open = |known: &mut Known| {
        let one = |known: &Known| {
            let (name, control) = control(model, known, &controls)?;
            Some((name, vec![control]))
        };
        let Some((name, own)) = elements(model, known).or_else(|| one(known)) else { return };
        for control in own {
            if controls.iter().all(|known| known.name != control.name) {
                controls.push(control);
            }
        }
        known.evidence = Finding::Hard(Value::Given(name));
    };
    // Over time each instant has values of its own.
    for ask in question.asks.iter_mut().filter(|ask| !ask.when.is_over_time()) {
        ask.known.iter_mut().for_each(&mut open);
        if let Statistic::Divergence { from, .. } = &mut ask.statistic {
            from.iter_mut().for_each(&mut open);
        }
        // A searched value that is given when the question is asked is shown with all others.
        for item in &mut ask.searched {
            let finite = model.variables[item.variable].domain.is_finite();
            if finite && matches!(item.at, Some(Value::Given(_))) {
                item.at = None;
            }
        }
    }
    (question, controls)
}

/// An opened question with these values in place of its names; the values of families and vectors are lists, which stay
/// inputs.
///
/// # Errors
/// A value that is missing, or is not in the domain of its variable.
pub fn given(
    model: &Model,
    question: &Question,
    value: impl Fn(&str) -> Option<f64>,
) -> Result<Question, Error> {
    let mut question = question.clone();
    let give = |known: &mut Known| {
        let Finding::Hard(Value::Given(name)) = &known.evidence else { return Ok(()) };
        let variable = &model.variables[known.variable];
        if variable.family.is_some() || matches!(variable.domain, Domain::Vector(_)) {
            return Ok(());
        }
        let number = value(name).ok_or_else(|| Error::input(name, "it was not given"))?;
        let domain = &model.variables[known.variable].domain;
        let value = match (domain.is_finite(), domain.ordinal_at(number)) {
            (false, _) => Value::Real(number),
            (true, Some(ordinal)) => Value::Ordinal(ordinal),
            (true, None) => {
                let message = format!("{number} is not a value of `{}`", model.domain_text(domain));
                return Err(Error::input(name, message));
            }
        };
        known.evidence = Finding::Hard(value);
        Ok(())
    };
    for ask in &mut question.asks {
        ask.known.iter_mut().try_for_each(give)?;
        if let Statistic::Divergence { from, .. } = &mut ask.statistic {
            from.iter_mut().try_for_each(give)?;
        }
    }
    Ok(question)
}

/// A question with a value for each known variable that needs one: for a real whose value is open `real`, for a value that is
/// given when the question is asked the first of its domain. A table of a finite variable stays a table, unless a `row` of it is
/// wanted: that of the first value.
pub fn begun(model: &Model, question: &Question, real: f64, row: bool) -> Question {
    let mut question = question.clone();
    let begin = |known: &mut Known| {
        let domain = &model.variables[known.variable].domain;
        let open = match &known.evidence {
            Finding::Hard(Value::Given(name)) => !model.parameters.values().any(|one| one.name == *name),
            Finding::Each => (*domain == Domain::Real || row) && !model.is_equation(known.variable),
            _ => false,
        };
        let alone = model.variables[known.variable].family.is_none();
        if open && alone && (domain.is_finite() || *domain == Domain::Real) {
            let value = if domain.is_finite() { Value::Ordinal(0) } else { Value::Real(real) };
            known.evidence = Finding::Hard(value);
        }
    };
    for ask in &mut question.asks {
        ask.known.iter_mut().for_each(begin);
        if let Statistic::Divergence { from, .. } = &mut ask.statistic {
            from.iter_mut().for_each(begin);
        }
    }
    question
}

/// The name and the control of an observation; `None` where it stays as it is written.
fn control(model: &Model, known: &Known, others: &[Control]) -> Option<(String, Control)> {
    let variable = &model.variables[known.variable];
    if variable.family.is_some()
        || model.is_equation(known.variable)
        || Some(known.variable) == model.plate_index()
    {
        return None;
    }
    let own = model.variable_name(known.variable);
    let (name, value) = match &known.evidence {
        Finding::Hard(Value::Ordinal(ordinal)) => (own.clone(), variable.domain.number(*ordinal)),
        Finding::Hard(Value::Real(number)) => (own.clone(), *number),
        Finding::Hard(Value::Given(name)) => (name.clone(), first(model, known.variable, name)),
        Finding::Each => (own.clone(), first(model, known.variable, &own)),
        Finding::Hard(Value::Vector(_)) | Finding::Virtual(_) | Finding::Soft(_) => return None,
    };
    let made = |name: &str| Control::of_evidence(name, &own, &variable.domain, value);
    // Two values of one variable in one question have names of their own.
    let numbered = (2..).map(|number| format!("{name} ({number})"));
    let mut names = std::iter::once(name.clone()).chain(numbered);
    let name = names.find(|name| match others.iter().find(|other| other.name == *name) {
        Some(other) => other.label == own && made(name).is_some_and(|control| control.value == other.value),
        None => true,
    })?;
    Some((name.clone(), made(&name)?))
}

/// The name and the controls of a family or a vector, one for each element; `None` where it stays as it is written.
fn elements(model: &Model, known: &Known) -> Option<(String, Vec<Control>)> {
    let variable = &model.variables[known.variable];
    if variable.derived.is_some() || model.plate.is_some() {
        return None;
    }
    let (count, low) = match (variable.family, &variable.domain) {
        (Some(family), _) if family.except.is_none() => (count(model, &family.over)?, family.over.first()),
        (None, Domain::Vector(length)) => (*length, 0),
        _ => return None,
    };
    let own = model.variable_name(known.variable);
    let (name, written) = match &known.evidence {
        Finding::Hard(Value::Given(name)) => (name.clone(), None),
        Finding::Hard(Value::Vector(numbers)) => (own.clone(), Some(numbers)),
        Finding::Each => (own.clone(), None),
        _ => return None,
    };
    let count = Some(count).filter(|count| *count <= MOST_ELEMENTS)?;
    let default = model.parameters.values().find(|parameter| parameter.name == name);
    let default = written.or(default.map(|parameter| &parameter.default));
    let controls = (0..count).map(|place| {
        let index = low + place as i64;
        let value = default.and_then(|numbers| numbers.get(place).copied());
        let value = value.unwrap_or_else(|| first(model, known.variable, &name));
        let (one, label) = (format!("{name}[{index}]"), format!("{own}[{index}]"));
        let control = Control::of_evidence(&one, &label, component(&variable.domain), value)?;
        Some(Control { element: Some(Element { of: name.clone(), place }), ..control })
    });
    Some((name.clone(), controls.collect::<Option<_>>()?))
}

/// The domain of a component of a vector; of another variable, its own.
pub(super) fn component(domain: &Domain) -> &Domain {
    if let Domain::Vector(_) = domain { &Domain::Real } else { domain }
}

/// The number of elements of a family, with the default of its size.
pub(super) fn count(model: &Model, over: &IndexSpace) -> Option<usize> {
    let IndexSpace::Range(range) = over else { return None };
    let size = range.high.size.map_or(Some(0.0), |size| model.parameters[size].default_number())?;
    usize::try_from(size as i64 + range.high.offset - range.low + 1).ok()
}

/// The value of an open variable at first: the default of the parameter of that name, else the first value.
pub(super) fn first(model: &Model, variable: VariableId, name: &str) -> f64 {
    let parameter = model.parameters.values().find(|parameter| parameter.name == name);
    let domain = &model.variables[variable].domain;
    let first = if domain.is_finite() { domain.number(0) } else { 0.0 };
    parameter.and_then(|parameter| parameter.default_number()).unwrap_or(first)
}
