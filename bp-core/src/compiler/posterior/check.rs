//! Checks of the inputs of a question before it runs.
//!
//! In: a model, a question and inputs. Out: nothing, or an error that names the input and the value. Invariant: kernels
//! have no notion of probability, so given numbers are checked against their domains only here.

use super::{Answer, Figure};
use crate::distribution::Setting;
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Domain, Finding, IndexSpace, Model, Parameter, Question, Value};
use crate::sample::Observations;
use crate::spelling::{exact, number as written};

/// Checks parameters against their kinds, and given values against their domains.
pub(crate) fn inputs(model: &Model, question: &Question, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    for parameter in model.parameters.values() {
        rows(model, parameter, inputs)?;
        for value in inputs.find(&parameter.name).unwrap_or_default() {
            if let Some(expected) = parameter.kind.refuses(*value) {
                return Err(Error::input(
                    &parameter.name,
                    format!("it is {}, but it must be {expected}", written(*value)),
                ));
            }
        }
    }
    elements(model, inputs)?;
    for ask in &question.asks {
        for searched in &ask.searched {
            match &searched.at {
                Some(Value::Given(name)) => given(model, searched.variable, name, inputs)?,
                Some(Value::Ordinal(ordinal)) => fixed(model, searched.variable, *ordinal, inputs)?,
                _ => {}
            }
        }
        for known in ask.known.iter().chain(ask.statistic.from()) {
            match &known.evidence {
                Finding::Hard(Value::Given(name)) => given(model, known.variable, name, inputs)?,
                Finding::Hard(Value::Ordinal(ordinal)) => fixed(model, known.variable, *ordinal, inputs)?,
                Finding::Each => given(model, known.variable, &model.variable_name(known.variable), inputs)?,
                _ => {}
            }
        }
    }
    Ok(())
}

/// Refuses a default whose rows do not have the sizes that are given.
fn rows(model: &Model, parameter: &Parameter, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    if parameter.rows.len() != parameter.over.len() || inputs.find(&parameter.name).is_some() {
        return Ok(());
    }
    let length = |over: &IndexSpace| match over {
        IndexSpace::Set(set) => inputs.find_size(&model.sets[*set].name),
        IndexSpace::Range(range) => {
            count(model, &Domain::Finite { labels: Vec::new(), range: Some(*range) }, inputs)
        }
    };
    let known: Vec<Option<usize>> = parameter.over.iter().map(length).collect();
    let fits = |(own, known): (&usize, &Option<usize>)| known.is_none_or(|known| known == *own);
    if parameter.rows.iter().zip(&known).all(fits) {
        return Ok(());
    }
    let by = |lengths: Vec<String>| lengths.join(" × ");
    let own = by(parameter.rows.iter().map(usize::to_string).collect());
    let sizes =
        by(known.iter().map(|known| known.map_or("any".to_owned(), |known| known.to_string())).collect());
    let message = format!("its list is {own} numbers, but it is declared with {sizes}");
    Err(Error::input(&parameter.name, message))
}

/// Refuses an element that a question names by its number, and that its set, once its size is known, does not have.
fn elements(model: &Model, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    for use_ in model.derived_factors().flat_map(|factor| &factor.right) {
        let (Some(element), Some(family)) = (use_.element, model.variables[use_.variable].family) else {
            continue;
        };
        let (Some(number), IndexSpace::Set(set)) = (model.constant(element), family.over) else { continue };
        let name = model.spelled(use_.variable);
        if let Some(size) = inputs.find_size(&model.sets[set].name).filter(|size| number >= *size as f64) {
            let message = format!("`{name}` has {size} elements, counted from 0");
            return Err(Error::input(format!("{name}[{number}]"), message));
        }
    }
    Ok(())
}

/// The number of values of a finite domain, once its sizes are known.
fn count(model: &Model, domain: &Domain, inputs: &Inputs<'_, f64>) -> Option<usize> {
    match domain {
        Domain::Set(set) => inputs.find_size(&model.sets[*set].name),
        Domain::Finite { range: Some(range), labels } => match range.high.size {
            None => domain.count(),
            Some(size) => inputs
                .find_size(&model.parameters[size].name)
                .or(model.parameters[size].default_number().map(|default| default as usize))
                .map(|size| (size as i64 + range.high.offset + 1 - range.low) as usize + labels.len()),
        },
        _ => domain.count(),
    }
}

/// The number of values of a finite variable, and of its elements, once its sizes are known.
pub(super) fn values(model: &Model, id: VariableId, inputs: &Inputs<'_, f64>) -> Option<(usize, usize)> {
    let variable = &model.variables[id];
    let elements = match variable.family.map(|family| family.over) {
        None => 1,
        Some(IndexSpace::Set(set)) => inputs.find_size(&model.sets[set].name)?,
        Some(IndexSpace::Range(range)) => {
            count(model, &Domain::Finite { labels: Vec::new(), range: Some(range) }, inputs)?
        }
    };
    Some((count(model, &variable.domain, inputs)?, elements))
}

/// Refuses a value that a question writes, and that its domain, once its size is known, does not have.
fn fixed(model: &Model, variable: VariableId, ordinal: usize, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    let domain = &model.variables[variable].domain;
    match count(model, domain, inputs) {
        Some(count) if ordinal >= count => {
            let (value, name) = (domain.value_name(ordinal), model.variable_name(variable));
            let message = format!(
                "{value} is not a value of it: its domain, `{}`, has {count}",
                model.domain_text(domain)
            );
            Err(Error::input(name, message))
        }
        _ => Ok(()),
    }
}

fn given(model: &Model, variable: VariableId, name: &str, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    let domain = &model.variables[variable].domain;
    let count = count(model, domain, inputs);
    let several = model.variables[variable].family.is_some() || matches!(domain, Domain::Vector(_));
    for value in inputs.find(name).unwrap_or_default() {
        // An element of a family, or a component of a vector, that is not known.
        if several && value.is_nan() {
            continue;
        }
        let inside = match domain {
            Domain::Real | Domain::Vector(_) => value.is_finite(),
            _ => domain.ordinal_among(*value, count).is_some(),
        };
        if !inside {
            let (variable, text) = (model.variable_name(variable), model.domain_text(domain));
            let help = domain.help().map_or_else(String::new, |help| format!(": {help}"));
            return Err(Error::input(
                name,
                format!("{} is not a value of `{variable}`, which is `{text}`{help}", exact(*value)),
            ));
        }
    }
    Ok(())
}

/// Refuses a family of which only some elements are given: loops read all of them.
pub(crate) fn families<'a>(
    asks: impl IntoIterator<Item = &'a Ask>,
    inputs: &Inputs<'_, f64>,
) -> Result<(), Error> {
    for known in asks.into_iter().flat_map(|ask| &ask.known) {
        let Finding::Hard(Value::Given(name)) = &known.evidence else { continue };
        if inputs.find(name).unwrap_or_default().iter().any(|value| value.is_nan()) {
            let message = format!(
                "some of its elements are not given, but sums need all of them; `{}`, where all variables are finite, or `{}` \
                 does without",
                Advice::By("join_tree"),
                Advice::By("weighting")
            );
            return Err(Error::input(name, message));
        }
    }
    Ok(())
}

/// Answers unchanged, if all of their numbers can be written: none is NaN, and none infinite, except a divergence,
/// statistics of a singular normal distribution, and moments that a law does not have. −0 becomes 0.
pub(crate) fn answers(mut answers: Vec<Answer>) -> Result<Vec<Answer>, Error> {
    for answer in &mut answers {
        let mut wrong: Option<f64> = None;
        let mut look = |number: &mut f64| {
            *number += 0.0;
            wrong = wrong.or(Some(*number).filter(|number| !number.is_finite()));
        };
        answer.answer.each_number(each_number, &mut look);
        answer.ln_evidence.iter_mut().for_each(&mut look);
        if let Some(estimate) = &mut answer.estimate {
            look(&mut estimate.effective);
            estimate.ln_evidence_error.iter_mut().for_each(&mut look);
        }
        if let Some(number) = wrong {
            let message = format!("a number of the answer is {number}: it is beyond the range of numbers");
            return Err(Error::Number { form: answer.question.clone(), context: String::new(), message });
        }
    }
    Ok(answers)
}

fn each_number(figure: &mut Figure, look: &mut dyn FnMut(&mut f64)) {
    match figure {
        Figure::Probability { p } | Figure::LnProbability { ln_p: p } => look(p),
        Figure::Estimated { p, error } => [p, error].into_iter().for_each(look),
        Figure::Entropy { entropy: number, .. }
        | Figure::Information { information: number }
        | Figure::Density { density: number } => {
            if !number.is_infinite() {
                look(number);
            }
        }
        Figure::Expectation { expectation: number, error } | Figure::Variance { variance: number, error } => {
            std::iter::once(number).chain(error).for_each(look);
        }
        Figure::Quantile { quantile, error, .. } => std::iter::once(quantile).chain(error).for_each(look),
        Figure::Interval { interval, errors, .. } => {
            interval.iter_mut().chain(errors.iter_mut().flatten()).for_each(look);
        }
        Figure::Real { mean, deviation, quantiles } => {
            [mean, deviation].into_iter().chain(quantiles).flatten().for_each(look);
        }
        Figure::Mixture { mean, deviation, quantiles } => {
            [mean, deviation].into_iter().chain(quantiles).for_each(look);
        }
        // Of some laws the mean or the deviation does not exist.
        Figure::Law { mean, deviation, quantiles, .. } => {
            let moments = [mean, deviation].into_iter().filter(|moment| moment.is_finite());
            moments.chain(quantiles).for_each(look);
        }
        Figure::Normal { mean, deviation } => [mean, deviation].into_iter().for_each(look),
        Figure::Draw { .. } | Figure::Mode { .. } | Figure::Divergence { .. } => {}
    }
}

/// The reason why an answer is not a number: the form with an invalid number, with its context.
pub(crate) fn not_a_number(model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Error {
    match Setting::new(model, inputs) {
        Err(error) => error,
        Ok(setting) => setting.not_a_number(&model.ask_text(ask), &known(&setting, ask)),
    }
}

/// The number that a form refuses, if there is one.
pub(crate) fn refused(model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Option<Error> {
    match Setting::new(model, inputs) {
        Err(error) => Some(error),
        Ok(setting) => setting.refused_number(&known(&setting, ask)),
    }
}

/// The value that one of these factors, Diracs of reals, does not have in a context that agrees with the known values. (A
/// kernel computes with a real that a Dirac determines as with its value, and a comparison takes NaN for a number.)
pub(crate) fn refused_value(
    model: &Model,
    ask: &Ask,
    inputs: &Inputs<'_, f64>,
    factors: &[FactorId],
) -> Result<(), Error> {
    if factors.is_empty() {
        return Ok(());
    }
    let setting = Setting::new(model, inputs)?;
    let known =
        Observations::of(&setting, ask).map_or_else(|_| vec![f64::NAN; setting.slots()], |all| all.values);
    setting.refused_number_in(factors, &known).map_or(Ok(()), Err)
}

/// The known values of an ask, one for each slot.
fn known(setting: &Setting<'_>, ask: &Ask) -> Vec<f64> {
    Observations::of(setting, ask).unwrap_or_else(|_| Observations::none(setting)).values
}
