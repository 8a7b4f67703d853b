//! Programs whose families are expanded, so that each element is a variable.
//!
//! In: a program, and evidence or names of single elements. Out: the same program without families, and the same evidence.
//! Invariant: the joint distribution is the same, and an element keeps its name: `Y[2]`.

use super::value::is_missing;
use super::{Evidence, Opened, Program, Value};
use crate::distribution::Setting;
use crate::error::Error;
use crate::model::{Model, Question};
use std::borrow::Cow;
use std::sync::Arc;

/// Above this many elements a program is not expanded.
const MOST_ELEMENTS: usize = 10_000;

/// The evidence without missing values: a list with some is that of the elements of a family, or of the components of a vector, that
/// have values.
pub(super) fn observed<'e>(model: &Model, evidence: &'e Evidence) -> Cow<'e, Evidence> {
    let lacks = |value: &Value| matches!(value, Value::List(all) if all.iter().any(is_missing));
    if !evidence.iter().any(|(_, value)| lacks(value)) {
        return Cow::Borrowed(evidence);
    }
    let mut known = Evidence::new();
    for (name, value) in evidence.iter() {
        match (value, model.variable(name)) {
            (Value::List(all), Some(id)) if lacks(value) => {
                let first = model.variables[id].family.map_or(0, |family| family.over.first());
                for (index, value) in (first..).zip(all).filter(|(_, value)| !is_missing(value)) {
                    known.set(model.element_name(id, index), value.clone());
                }
            }
            _ => known.set(name, value.clone()),
        }
    }
    Cow::Owned(known)
}

/// Whether elements of a program are known only once its families are expanded: a join tree knows those of finite variables.
pub(super) fn is_expanded(model: &Model) -> bool {
    model.variables.values().any(|it| !it.domain.is_finite())
        && model.variables.values().any(|it| it.family.is_some())
}

/// The program with its families expanded, the names of its variables, and the evidence on them; `None` where all variables are finite (a join tree
/// knows single elements), where only whole variables are named, or where the program cannot be expanded.
///
/// # Errors
/// A family with another number of values than elements.
pub(super) fn expanded(
    program: &Program,
    names: &[String],
    evidence: &Evidence,
) -> Result<Option<(Program, Vec<String>, Evidence)>, Error> {
    let model = program.model();
    let is_family = |name: &str| model.variable(name).is_some_and(|id| model.variables[id].family.is_some());
    let mut named = names.iter().map(String::as_str).chain(evidence.iter().map(|(name, _)| name));
    if !is_expanded(model) || !named.any(|name| model.variable(name).is_none() || is_family(name)) {
        return Ok(None);
    }
    let inputs = program.settings.inputs();
    let setting = Setting::new(model, &inputs)?;
    if setting.slots() > MOST_ELEMENTS {
        return Ok(None);
    }
    let nothing = Question { name: String::new(), asks: Vec::new(), derived: Vec::new() };
    let Some(written) = setting.written_out(&nothing)? else { return Ok(None) };
    let elements = |name: &str| {
        let slots = model.variable(name).filter(|_| is_family(name)).map(|id| setting.slots_of(id));
        slots.map(|slots| slots.map(|slot| setting.slot_name(slot)).collect::<Vec<String>>())
    };
    let names = names.iter().flat_map(|name| elements(name).unwrap_or_else(|| vec![name.clone()])).collect();
    let mut known = Evidence::new();
    for (name, value) in evidence.iter() {
        let Some(elements) = elements(name) else {
            known.set(name, value.clone());
            continue;
        };
        let values = value.flat();
        if values.len() != elements.len() {
            let message = format!("{} values were given, but {} are expected", values.len(), elements.len());
            return Err(Error::input(name, message));
        }
        for (element, value) in elements.into_iter().zip(values) {
            if evidence.get(&element).is_some() {
                return Err(Error::input(&element, format!("`{element}` is known twice")));
            }
            known.set(element, value.clone());
        }
    }
    let opened = Opened { model: written.model, ..(*program.opened).clone() };
    let settings = (*program.given).clone();
    let by = (program.sampling, program.options);
    Ok(Some((Program::with_settings(Arc::new(opened), settings, by), names, known)))
}
