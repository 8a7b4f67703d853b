//! Validation of forms: shapes of tables, valid probabilities, Diracs with a solution.
//!
//! In: a factor and its form. Out: its faults. Invariant: an error is reported once: for a row with the wrong length or
//! an invalid entry, its sum is not checked.

use super::{Fault, Place, constants, fault, fault_with_help, law};
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::law::{Covariance, Dirichlet, Law, Support};
use crate::model::{Domain, Expression, Form, Model};
use crate::radix;
use crate::spelling::number as written;
use std::collections::{HashMap, HashSet};

/// Tolerance of the sum of constant probabilities.
pub(super) const SUM_TOLERANCE: f64 = 1e-6;

/// Number of combinations of parents tried in the search for a possible value of a Dirac.
const MOST_COMBINATIONS: usize = 4096;

pub(super) fn form_faults(model: &Model, id: FactorId) -> Vec<Fault> {
    let factor = &model.factors[id];
    let Some(left) = factor.left.first() else { return Vec::new() };
    let mut faults = Vec::new();
    let place = Place::Form(id);
    if factor.left.len() > 1
        && !matches!(factor.form, Form::Uniform | Form::Table(_) | Form::Constants(_) | Form::Unknown(_))
    {
        let (name, count) = (factor.form.name(), factor.left.len());
        faults.push(fault(
            place,
            format!("`{name}` distributes one variable, but there are {count} on the left"),
        ));
        return faults;
    }
    let name = model.variable_name(left.variable);
    branch_faults(model, id, &factor.form, &model.variables[left.variable].domain, &name, &mut faults);
    faults
}

fn branch_faults(
    model: &Model,
    id: FactorId,
    form: &Form,
    domain: &Domain,
    name: &str,
    faults: &mut Vec<Fault>,
) {
    let place = Place::Form(id);
    let is = || format!("`{name}` is `{}`", model.domain_text(domain));
    match form {
        Form::Uniform if !domain.is_finite() => faults.push(fault_with_help(
            place,
            format!("`uniform` spreads over the values of a finite domain, but {}", is()),
            "give its bounds: `uniform(low, high)`",
        )),
        Form::Flat if !matches!(domain, Domain::Real | Domain::Vector(_)) => {
            let message = format!("`flat` is a density of reals, but {}", is());
            faults.push(fault_with_help(place, message, "`uniform` gives each value the same probability"));
        }
        Form::HalfFlat if *domain != Domain::Real => {
            let message = format!("`half_flat` is a density of one real, but {}", is());
            faults.push(fault_with_help(place, message, "`uniform` gives each value the same probability"));
        }
        Form::Bernoulli(argument, _) => {
            if *domain != Domain::Boolean {
                let message = format!("`bernoulli` distributes a `bool`, but {}", is());
                faults.push(fault_with_help(place, message, "`categorical` takes one probability per value"));
            }
            faults.extend(probability_faults(model, id, *argument));
        }
        Form::Categorical(entries) => {
            row_faults(model, id, entries, domain.count(), name, &|| model.domain_text(domain), faults)
        }
        Form::Table(rows) => table_faults(model, id, rows, faults),
        Form::Constants(numbers) => faults.extend(constants::constants_fault(model, id, numbers)),
        Form::Law { law, arguments } => law::law_faults(model, id, *law, arguments, domain, name, faults),
        Form::NormalVector { covariance, .. } => {
            let constants =
                covariance.iter().map(|row| row.iter().map(|entry| model.constant(*entry)).collect());
            let constants: Option<Vec<Vec<f64>>> = constants.collect();
            faults
                .extend(constants.and_then(|rows| Covariance::new(rows).err()).map(|why| fault(place, why)));
        }
        Form::Dirichlet(parameters) => {
            if *domain != Domain::Vector(parameters.len()) {
                let count = parameters.len();
                let message = format!(
                    "`dirichlet` takes a parameter for each component of a vector, here {count}, but {}",
                    is()
                );
                faults.push(fault(place, message));
            }
            faults.extend(parameters.iter().filter_map(|parameter| {
                let value = model.constant(*parameter)?;
                let expected = Dirichlet::PARAMETER.refuses(value)?;
                let message = format!("a parameter of `dirichlet` must be {expected}, but this is {value}");
                Some(fault(Place::Expression(id, *parameter), message))
            }));
        }
        Form::Multinomial { trials, probabilities } => {
            if *domain != Domain::Vector(probabilities.len()) {
                let count = probabilities.len();
                let message = format!(
                    "`multinomial` takes a number of trials and a probability for each component of a vector, here \
                     {count}, but {}",
                    is()
                );
                faults.push(fault(place, message));
            }
            faults.extend(law::argument_fault(model, id, Law::Binomial, 0, *trials));
            let count = Some(probabilities.len());
            row_faults(model, id, probabilities, count, name, &|| model.domain_text(domain), faults);
        }
        Form::Ordered(form) => match (form.as_ref(), domain) {
            (Form::Law { law, arguments }, Domain::Vector(_)) if law.support() != Support::Counts => {
                law::law_faults(model, id, *law, arguments, &Domain::Real, name, faults);
            }
            (_, Domain::Vector(_)) => {
                let message = format!(
                    "`ordered` takes a distribution of a real such as `normal(0, 10)`, but this is `{}`",
                    form.name()
                );
                faults.push(fault(place, message));
            }
            _ => {
                let message = format!("`ordered` distributes a vector such as `real[2]`, but {}", is());
                faults.push(fault(place, message));
            }
        },
        Form::NormalBins { deviation, .. } => {
            if !matches!(domain, Domain::Finite { labels, range: Some(_) } if labels.len() == 1) {
                let expected = "one label and an integer range, as in `{ NoDetection } or 1..=N`";
                faults.push(fault(place, format!("`normal_bins` needs {expected}, but {}", is())));
            }
            faults.extend(law::argument_fault(model, id, Law::Normal, 1, *deviation));
        }
        Form::Mixture(parts) => {
            let weights: Vec<ExpressionId> = parts.iter().map(|(weight, _)| *weight).collect();
            let count = faults.len();
            faults.extend(weights.iter().filter_map(|weight| probability_faults(model, id, *weight)));
            let constants: Option<Vec<f64>> = weights.iter().map(|weight| model.constant(*weight)).collect();
            let sum = constants.map_or(1.0, |weights| weights.iter().sum());
            if faults.len() == count && (sum - 1.0).abs() > SUM_TOLERANCE {
                let message =
                    format!("the weights of a mixture must sum to 1, but these sum to {}", rounded(sum));
                faults.push(fault(place, message));
            }
            if let Some((_, part)) = parts.iter().find(|(_, part)| part.is_improper()) {
                let message = format!("`{}` has no total, and so no weight in a `mixture`", part.name());
                faults.push(fault(place, message));
            }
            if let Some((_, part)) = parts.iter().find(|(_, part)| part.couples()) {
                let name = part.name();
                let message = format!(
                    "a `mixture` treats the components of a vector separately, but `{name}` couples them"
                );
                let help = format!("write `if … {{ {name}(…) }} else {{ {name}(…) }}`");
                faults.push(fault_with_help(place, message, help));
            }
            parts.iter().for_each(|(_, part)| branch_faults(model, id, part, domain, name, faults));
        }
        Form::Truncated { form, low, high } => {
            if let (Some(low), Some(high)) = (model.constant(*low), model.constant(*high))
                && low >= high
            {
                faults.push(fault(place, format!("`truncated` needs low < high, but {low} ≥ {high}")));
            }
            match (form.as_ref(), domain) {
                (Form::Law { .. }, _) => branch_faults(model, id, form, domain, name, faults),
                (other, _) => {
                    let message = format!(
                        "`truncated` takes a distribution such as `normal`, but this is `{}`",
                        other.name()
                    );
                    faults.push(fault(place, message));
                }
            }
        }
        Form::Unknown(unlearned) => law::fit_faults(model, id, &unlearned.fit, domain, name, faults),
        Form::Dirac(value) => {
            let constant = model.constant(*value).filter(|value| !value.is_finite());
            match constant {
                Some(number) => faults.push(fault(
                    Place::Expression(id, *value),
                    format!(
                        "the value of a `dirac` must be a finite number, but this is {}",
                        written(number)
                    ),
                )),
                None => faults.extend(dirac_fault(model, id, *value, domain, name)),
            }
        }
        Form::Previous { of, otherwise, .. } => {
            if model.variables[*of].domain != *domain {
                let of = model.variable_name(*of);
                faults.push(fault(
                    place,
                    format!("`previous({of})` is a distribution of `{of}`, but {}", is()),
                ));
            }
            let left = model.factors[id].left[0].variable;
            if let Some(now) = model.variables[left].previous_of.filter(|now| now != of) {
                let [left, now, of] = [left, now, *of].map(|id| model.variable_name(id));
                let message = format!(
                    "`{left}` is `{now}` at the previous instant: write `previous({now})`, not `previous({of})`"
                );
                faults.push(fault(place, message));
            }
            branch_faults(model, id, otherwise, domain, name, faults);
        }
        Form::Weights(_) if !domain.is_finite() => {
            faults.push(fault(place, format!("`weights` needs a finite domain, but {}", is())));
        }
        Form::Initial { first, later } => {
            branch_faults(model, id, first, domain, name, faults);
            branch_faults(model, id, later, domain, name, faults);
        }
        Form::If { then, otherwise, .. } => {
            branch_faults(model, id, then, domain, name, faults);
            branch_faults(model, id, otherwise, domain, name, faults);
        }
        Form::Uniform | Form::Flat | Form::HalfFlat | Form::Weights(_) | Form::Ask { .. } => {}
    }
}

/// A sum without the digits of rounding.
fn rounded(sum: f64) -> f64 {
    (sum * 1e9).round() / 1e9
}

fn probability_faults(model: &Model, id: FactorId, entry: ExpressionId) -> Option<Fault> {
    let mut rest = vec![entry];
    let mut seen = HashSet::new();
    while let Some(entry) = rest.pop() {
        if let Expression::If { then, otherwise, .. } = model.expressions[entry] {
            rest.extend([otherwise, then].into_iter().filter(|part| seen.insert(*part)));
            continue;
        }
        let value = model.constant(entry).map(|value| model.rounded(entry, value));
        if let Some(value) = value.filter(|value| !(0.0..=1.0).contains(value)) {
            let why = if value.is_nan() { ", as of counts or weights that are all 0" } else { "" };
            let message = format!("a probability lies between 0 and 1, but this is {}{why}", written(value));
            return Some(fault(Place::Expression(id, entry), message));
        }
    }
    None
}

fn row_faults(
    model: &Model,
    id: FactorId,
    row: &[ExpressionId],
    count: Option<usize>,
    name: &str,
    values: &dyn Fn() -> String,
    faults: &mut Vec<Fault>,
) {
    let place = match row {
        [first, .., last] => Place::Row(id, *first, *last),
        [only] => Place::Expression(id, *only),
        [] => Place::Form(id),
    };
    let before = faults.len();
    match count {
        Some(count) if count != row.len() => {
            let text = values();
            faults.push(fault(
                place,
                format!("`{name}` has {count} values (`{text}`), but this row has {}", entries(row.len())),
            ));
        }
        None => faults.push(fault(
            Place::Form(id),
            format!("`{}` cannot have a table: its values are not known here", values()),
        )),
        _ => {}
    }
    faults.extend(row.iter().filter_map(|entry| probability_faults(model, id, *entry)));
    if faults.len() > before {
        return;
    }
    let constants: Option<Vec<f64>> = row.iter().map(|entry| model.constant(*entry)).collect();
    if let Some(sum) =
        constants.map(|row| row.iter().sum::<f64>()).filter(|sum| (sum - 1.0).abs() > SUM_TOLERANCE)
    {
        let sum = rounded(sum);
        faults
            .push(fault(place, format!("the probabilities of a row must sum to 1, but these sum to {sum}")));
    }
}

fn table_faults(model: &Model, id: FactorId, rows: &[Vec<ExpressionId>], faults: &mut Vec<Fault>) {
    let factor = &model.factors[id];
    let count = |id: VariableId| model.variables[id].domain.count();
    let names: Vec<_> = factor.right.iter().map(|use_| model.spelled(use_.variable)).collect();
    let expected =
        factor.right.iter().try_fold(1usize, |product, use_| product.checked_mul(count(use_.variable)?));
    match expected {
        Some(expected) if expected != rows.len() => {
            let of = if names.is_empty() { String::new() } else { format!(" of `{}`", names.join(" ")) };
            let message = format!(
                "a table for `{}` has one row for each combination{of}: {expected}, but this has {}",
                model.head(factor),
                rows.len()
            );
            faults.push(fault(Place::Form(id), message));
        }
        None => faults.push(fault(
            Place::Form(id),
            format!("a table needs finite parents of known size, but `{}` has others", model.head(factor)),
        )),
        _ => {}
    }
    if let [left] = factor.left.as_slice() {
        let variable = &model.variables[left.variable];
        for row in rows {
            row_faults(
                model,
                id,
                row,
                variable.domain.count(),
                &variable.name,
                &|| model.domain_text(&variable.domain),
                faults,
            );
        }
    } else {
        let entries: Option<usize> = factor.left.iter().map(|use_| count(use_.variable)).product();
        let names: Vec<_> = factor.left.iter().map(|use_| model.variable_name(use_.variable)).collect();
        for row in rows {
            row_faults(model, id, row, entries, &names.join(" "), &|| "all combinations".to_owned(), faults);
        }
    }
}

fn dirac_fault(
    model: &Model,
    id: FactorId,
    value: ExpressionId,
    domain: &Domain,
    name: &str,
) -> Option<Fault> {
    domain.count()?;
    let mut parents: Vec<(VariableId, usize, &Domain)> = Vec::new();
    for use_ in &model.factors[id].right {
        let domain = &model.variables[use_.variable].domain;
        parents.push((use_.variable, domain.count()?, domain));
    }
    let combinations = parents.iter().try_fold(1usize, |product, parent| product.checked_mul(parent.1))?;
    if combinations > MOST_COMBINATIONS {
        return None;
    }
    let mut example = None;
    for combination in 0..combinations {
        let ordinals = radix::ordinals(combination, parents.iter().map(|(_, count, _)| *count));
        let number = |((variable, _, domain), ordinal): (&(VariableId, usize, &Domain), usize)| {
            (*variable, domain.number(ordinal))
        };
        let values: HashMap<VariableId, f64> = parents.iter().zip(ordinals).map(number).collect();
        let result = model.evaluate(value, &|variable| values.get(&variable).copied())?;
        if domain.ordinal_at(result).is_some() {
            return None;
        }
        example = Some(result);
    }
    let found = example.map_or_else(String::new, |found| format!(", for example {found}"));
    Some(fault_with_help(
        Place::Expression(id, value),
        format!("this `dirac` has no solution: its value is never in `{}`{found}", model.domain_text(domain)),
        format!("`{name}` would have probability zero everywhere"),
    ))
}

/// A number of entries, in words.
fn entries(count: usize) -> String {
    match count {
        1 => "1 entry: write the probability of each value".to_owned(),
        count => format!("{count} entries"),
    }
}
