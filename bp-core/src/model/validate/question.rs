//! What a question must be.
//!
//! In: a question, declared or asked later. Out: its faults. Invariant: a variable is searched or known, not both, and
//! once; every value lies in its domain.

use super::{Fault, Place, fault};
use crate::ids::{QuestionId, VariableId};
use crate::model::{Domain, Evidence, Model, Question, Value};
use std::collections::HashSet;

pub(in crate::model) fn question_faults(
    model: &Model,
    question: &Question,
    id: Option<QuestionId>,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (number, ask) in question.asks.iter().enumerate() {
        let place = Place::Ask(id, number);
        if ask.searched.is_empty() {
            faults.push(fault(place, "this question searches nothing"));
        }
        let mut seen = HashSet::new();
        for searched in &ask.searched {
            let name = model.variable_name(searched.variable);
            if !seen.insert(searched.variable) {
                faults.push(fault(place, format!("`{name}` is searched twice")));
            }
            faults
                .extend(searched.at.as_ref().and_then(|at| value_fault(model, place, searched.variable, at)));
        }
        let mut known_once = HashSet::new();
        for known in &ask.known {
            let name = model.variable_name(known.variable);
            if seen.contains(&known.variable) {
                faults.push(fault(
                    place,
                    format!("this question asks what it knows: `{name}` is on both sides"),
                ));
            }
            if !known_once.insert(known.variable) {
                faults.push(fault(place, format!("`{name}` is known twice")));
            }
            match &known.evidence {
                Evidence::Hard(value) => faults.extend(value_fault(model, place, known.variable, value)),
                Evidence::Each => {}
                Evidence::Virtual(weights) => {
                    let count = model.variables[known.variable].domain.count();
                    if count != Some(weights.len()) {
                        let expected = count.map_or("a finite domain".to_owned(), |count| count.to_string());
                        let found = weights.len();
                        faults.push(fault(
                            place,
                            format!(
                                "virtual evidence gives each value of `{name}` a likelihood: expected {expected}, \
                                 found {found}"
                            ),
                        ));
                    }
                    let bad = weights.iter().find(|weight| !weight.is_finite() || **weight < 0.0);
                    if let Some(bad) = bad {
                        faults.push(fault(place, format!("a likelihood is a number ≥ 0, but this is {bad}")));
                    } else if weights.iter().all(|weight| *weight == 0.0) {
                        faults.push(fault(place, format!("the likelihoods of `{name}` are all zero")));
                    }
                }
            }
        }
    }
    faults
}

fn value_fault(model: &Model, place: Place, variable: VariableId, value: &Value) -> Option<Fault> {
    let name = model.variable_name(variable);
    let domain = &model.variables[variable].domain;
    let text = model.domain_text(domain);
    match value {
        Value::Ordinal(ordinal) => {
            let out = domain.count().is_some_and(|count| *ordinal >= count) || !domain.is_finite();
            out.then(|| {
                fault(place, format!("`{name}` is `{text}`, which has no value of ordinal {ordinal}"))
            })
        }
        Value::Real(number) => (*domain != Domain::Real)
            .then(|| fault(place, format!("`{name}` is `{text}`, but its value is {number}"))),
        Value::Given(_) => None,
    }
}
