//! Validation of a model.
//!
//! In: the parts that the builder was given. Out: every [`Fault`], each with its [`Place`], so that the front end can
//! report it at the source and a Rust user can read the message. Invariant: a model is validated as a whole only here;
//! the front end only checks names and types.

mod constants;
mod form;
mod law;
mod question;
mod recursion;

use super::{Model, ParameterKind};
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, QuestionId, VariableId};
use std::collections::HashMap;

pub(super) use question::question_faults;

/// The location of a fault.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Place {
    /// A parameter's declaration.
    Parameter(ParameterId),
    /// A variable's declaration.
    Variable(VariableId),
    /// A factor in the decomposition.
    Factor(FactorId),
    /// The form of a factor.
    Form(FactorId),
    /// An expression in a factor's form.
    Expression(FactorId, ExpressionId),
    /// A row of numbers in a factor's form, from its first entry to its last.
    Row(FactorId, ExpressionId, ExpressionId),
    /// The n-th ask of a question; `None`: of one that is not declared in the model.
    Ask(Option<QuestionId>, usize),
}

/// A fault of a model.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("{message}{}", .help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default())]
pub struct Fault {
    /// Its location.
    pub place: Place,
    /// The message: the found and the expected value.
    pub message: String,
    /// The suggested correction, if there is an obvious one.
    pub help: Option<String>,
}

fn fault(place: Place, message: impl Into<String>) -> Fault {
    Fault { place, message: message.into(), help: None }
}

fn fault_with_help(place: Place, message: impl Into<String>, help: impl Into<String>) -> Fault {
    Fault { place, message: message.into(), help: Some(help.into()) }
}

pub(super) fn faults(model: &Model) -> Vec<Fault> {
    let mut faults = parameter_faults(model);
    faults.extend(decomposition_faults(model));
    if faults.is_empty() {
        faults.extend(
            cycle(model).or_else(|| model.factors.ids().find_map(|id| recursion::recursion_fault(model, id))),
        );
    }
    for (id, _) in model.factors.iter() {
        faults.extend(form::form_faults(model, id));
    }
    for (id, question) in model.questions.iter() {
        let (model, question) = model.posed(question);
        faults.extend(question_faults(&model, &question, Some(id)));
    }
    faults
}

fn parameter_faults(model: &Model) -> Vec<Fault> {
    (model.parameters.iter())
        .filter_map(|(id, parameter)| {
            let (name, place) = (&parameter.name, Place::Parameter(id));
            let refused = |number: &f64| Some((*number, parameter.kind.refuses(*number)?));
            if let Some((number, expected)) = parameter.default.iter().find_map(refused) {
                return Some(fault(place, format!("`{name}` is {number}, but it must be {expected}")));
            }
            let (found, counts) =
                (parameter.default.len(), parameter.over.iter().map(|over| model.index_count(over)));
            let expected = counts.product::<Option<usize>>();
            // If the number of elements is not known yet, it is checked when a question is asked.
            (found > 1 && expected.is_some_and(|expected| expected != found)).then(|| {
                let expected = match expected {
                    Some(1) | None => "is one number".to_owned(),
                    Some(expected) => format!("has {expected} places"),
                };
                fault(place, format!("`{name}` {expected}, but {found} numbers are given"))
            })
        })
        .collect()
}

impl ParameterKind {
    /// The requirement on a parameter of this kind, if `value` violates it.
    pub fn refuses(self, value: f64) -> Option<&'static str> {
        let (holds, expected) = match self {
            ParameterKind::Probability => ((0.0..=1.0).contains(&value), "a probability, between 0 and 1"),
            ParameterKind::Real => (value.is_finite(), "a finite number"),
            ParameterKind::Integer => (value.fract() == 0.0, "a whole number"),
            ParameterKind::Size => (value.fract() == 0.0 && value >= 1.0, "a whole number of at least 1"),
            ParameterKind::Element(_) => {
                (value.fract() == 0.0 && value >= 0.0, "the number of an element, from 0")
            }
        };
        (!holds).then_some(expected)
    }
}

fn decomposition_faults(model: &Model) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut places: HashMap<VariableId, Vec<FactorId>> = HashMap::new();
    for (id, factor) in model.factors.iter() {
        if factor.left.is_empty() {
            faults.push(fault(Place::Factor(id), "this factor distributes no variable"));
        }
        for use_ in &factor.left {
            places.entry(use_.variable).or_default().push(id);
        }
    }
    for (id, variable) in model.variables.iter() {
        let name = model.variable_name(id);
        match places.get(&id).map_or(&[][..], Vec::as_slice) {
            [] if Some(id) == model.plate_index() => {}
            // The value of a real at the previous instant is carried by the closed form; other variables need a form
            // for it.
            [] if variable.previous_of.is_some() && !variable.domain.is_finite() => {}
            [] if variable.previous_of.is_some() => faults.push(fault_with_help(
                Place::Variable(id),
                format!("variable `{name}` has no distribution"),
                format!("add a factor `P({name})` with the form `previous({})`", variable.name),
            )),
            [] => faults.push(fault_with_help(
                Place::Variable(id),
                format!("variable `{name}` has no distribution"),
                format!("add a factor `P({name})` or `P({name} | …)` to the decomposition"),
            )),
            [_] => {}
            [first, others @ ..] => faults.extend(others.iter().map(|other| {
                fault_with_help(
                    Place::Factor(*other),
                    format!("variable `{name}` has two distributions"),
                    format!("it is already on the left of `{}`", model.head(&model.factors[*first])),
                )
            })),
        }
    }
    faults
}

/// A cycle of factors, each of which depends on the next. Linear: each variable is visited once.
fn cycle(model: &Model) -> Option<Fault> {
    let distributions = model.distributions();
    let parents = |factor: Option<FactorId>| {
        let earlier = factor.map_or_else(Vec::new, |id| model.earlier(id));
        let right = factor.map_or(&[][..], |id| &model.factors[id].right).iter().map(|use_| use_.variable);
        right.filter(|parent| !earlier.contains(parent)).collect::<Vec<VariableId>>()
    };
    let parents: Vec<Vec<VariableId>> = distributions.iter().map(|factor| parents(*factor)).collect();
    let (mut entered, mut left) = (vec![false; model.variables.len()], vec![false; model.variables.len()]);
    for start in model.variables.ids() {
        if std::mem::replace(&mut entered[start.position()], true) {
            continue;
        }
        let mut path: Vec<(VariableId, usize)> = vec![(start, 0)];
        while let Some((variable, next)) = path.last_mut() {
            let variable = *variable;
            let parents = &parents[variable.position()];
            let Some(parent) = parents.get(*next).copied() else {
                left[variable.position()] = true;
                path.pop();
                continue;
            };
            *next += 1;
            if !std::mem::replace(&mut entered[parent.position()], true) {
                path.push((parent, 0));
            } else if !left[parent.position()] {
                // Entered and not left: it is on the path.
                let position = path.iter().position(|(seen, _)| *seen == parent)?;
                let mut names: Vec<_> =
                    path[position..].iter().map(|(seen, _)| model.variable_name(*seen)).collect();
                names.push(names[0].clone());
                let families =
                    path[position..].iter().all(|(seen, _)| model.variables[*seen].family.is_some());
                let help = match families {
                    true => recursion::EARLIER,
                    false => "each factor may only depend on variables that do not depend on it",
                };
                return Some(fault_with_help(
                    Place::Factor(distributions[parent.position()]?),
                    format!("the decomposition has a cycle: {}", names.join(" ← ")),
                    help,
                ));
            }
        }
    }
    None
}
