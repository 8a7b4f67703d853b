//! What a model must be before anything is asked of it.
//!
//! In: the parts that the builder was given. Out: every [`Fault`], each with the [`Place`] where it is, so that
//! the front end can point at the words and a Rust user can read the message. Invariant: the one place where a
//! model is judged as a whole; the front end only judges words (names, types).

use super::{Domain, Evidence, Expression, Form, IndexSpace, Model, ParameterKind, Question, Value};
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, QuestionId, VariableId};
use std::collections::{HashMap, HashSet};

/// Where a fault is.
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
    /// The n-th thing asked by a question; `None`: by one that is not declared in the model.
    Ask(Option<QuestionId>, usize),
}

/// One thing that is wrong with a model.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("{message}{}", .help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default())]
pub struct Fault {
    /// Where.
    pub place: Place,
    /// What was found and what was expected.
    pub message: String,
    /// The way out, where there is an evident one.
    pub help: Option<String>,
}

fn fault(place: Place, message: impl Into<String>) -> Fault {
    Fault { place, message: message.into(), help: None }
}

fn fault_with_help(place: Place, message: impl Into<String>, help: impl Into<String>) -> Fault {
    Fault { place, message: message.into(), help: Some(help.into()) }
}

/// How far constant probabilities may sum from one.
const SUM_TOLERANCE: f64 = 1e-6;

/// How many combinations of parents are tried when looking for a value that a Dirac can take.
const MOST_COMBINATIONS: usize = 4096;

pub(super) fn faults(model: &Model) -> Vec<Fault> {
    let mut faults = parameter_faults(model);
    faults.extend(decomposition_faults(model));
    if faults.is_empty() {
        faults.extend(cycle(model));
    }
    for (id, _) in model.factors.iter() {
        faults.extend(form_faults(model, id));
    }
    for (id, question) in model.questions.iter() {
        faults.extend(question_faults(model, question, Some(id)));
    }
    faults
}

fn parameter_faults(model: &Model) -> Vec<Fault> {
    (model.parameters.iter())
        .filter_map(|(id, parameter)| {
            let expected = parameter.kind.refuses(parameter.default?)?;
            let (name, default) = (&parameter.name, parameter.default?);
            Some(fault(Place::Parameter(id), format!("`{name}` is {default}, but it must be {expected}")))
        })
        .collect()
}

impl ParameterKind {
    /// What a parameter of this kind must be, if `value` is not that.
    pub fn refuses(self, value: f64) -> Option<&'static str> {
        let (holds, expected) = match self {
            ParameterKind::Probability => ((0.0..=1.0).contains(&value), "a probability, between 0 and 1"),
            ParameterKind::Real => (value.is_finite(), "a finite number"),
            ParameterKind::Integer => (value.fract() == 0.0, "a whole number"),
            ParameterKind::Size => (value.fract() == 0.0 && value >= 1.0, "a whole number of at least 1"),
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
            [] if Some(id) == model.plate_index() || variable.previous_of.is_some() => {}
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

/// A chain of factors each of which needs the next, back to the first.
fn cycle(model: &Model) -> Option<Fault> {
    let mut done: HashSet<VariableId> = HashSet::new();
    for start in model.variables.ids() {
        let mut path: Vec<(VariableId, usize)> = vec![(start, 0)];
        while let Some((variable, next)) = path.last_mut() {
            let variable = *variable;
            let parents = model.factor_of(variable).map_or(&[][..], |factor| &model.factors[factor].right);
            let Some(parent) =
                parents.get(*next).map(|use_| use_.variable).filter(|_| !done.contains(&variable))
            else {
                done.insert(variable);
                path.pop();
                continue;
            };
            *next += 1;
            if let Some(position) = path.iter().position(|(seen, _)| *seen == parent) {
                let mut names: Vec<_> =
                    path[position..].iter().map(|(seen, _)| model.variable_name(*seen)).collect();
                names.push(names[0].clone());
                let factor = model.factor_of(parent).expect("internal: a variable on a cycle has a factor");
                return Some(fault_with_help(
                    Place::Factor(factor),
                    format!("the decomposition has a cycle: {}", names.join(" ← ")),
                    "each factor may only depend on variables that do not depend on it",
                ));
            }
            path.push((parent, 0));
        }
    }
    None
}

fn form_faults(model: &Model, id: FactorId) -> Vec<Fault> {
    let factor = &model.factors[id];
    let Some(left) = factor.left.first() else { return Vec::new() };
    let mut faults = Vec::new();
    let place = Place::Form(id);
    if factor.left.len() > 1 && !matches!(factor.form, Form::Uniform | Form::Table(_)) {
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
        Form::UniformInterval { low, high } => {
            if *domain != Domain::Real {
                faults
                    .push(fault(place, format!("`uniform(low, high)` needs a real variable, but {}", is())));
            }
            if let (Some(low), Some(high)) = (model.constant(*low), model.constant(*high))
                && low >= high
            {
                faults.push(fault(place, format!("`uniform` needs low < high, but {low} ≥ {high}")));
            }
        }
        Form::Bernoulli(argument) => {
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
        Form::Normal { deviation, .. } | Form::NormalBins { deviation, .. } => {
            let fits = match (form, domain) {
                (Form::NormalBins { .. }, Domain::Finite { labels, range: Some(_) }) => labels.len() == 1,
                (Form::NormalBins { .. }, _) => false,
                (_, Domain::Real | Domain::Vector(_)) => true,
                (_, Domain::Finite { labels, range: Some(_) }) => labels.is_empty(),
                _ => false,
            };
            let expected = match form {
                Form::Normal { .. } => "a real or an integer range",
                _ => "one label and an integer range, as in `{ NoDetection } or 1..=N`",
            };
            if !fits {
                faults.push(fault(place, format!("`{}` needs {expected}, but {}", form.name(), is())));
            }
            if let Some(value) = model.constant(*deviation).filter(|value| *value <= 0.0) {
                let place = Place::Expression(id, *deviation);
                faults.push(fault(
                    place,
                    format!("a standard deviation must be positive, but this is {value}"),
                ));
            }
        }
        Form::Dirac(value) => faults.extend(dirac_fault(model, id, *value, domain, name)),
        Form::Previous { of, otherwise, .. } => {
            if model.variables[*of].domain != *domain {
                let of = model.variable_name(*of);
                faults.push(fault(
                    place,
                    format!("`previous({of})` is a distribution of `{of}`, but {}", is()),
                ));
            }
            branch_faults(model, id, otherwise, domain, name, faults);
        }
        Form::Weights(_) if !domain.is_finite() => {
            faults.push(fault(place, format!("`weights` needs a finite domain, but {}", is())));
        }
        Form::If { then, otherwise, .. } => {
            branch_faults(model, id, then, domain, name, faults);
            branch_faults(model, id, otherwise, domain, name, faults);
        }
        Form::Uniform | Form::Weights(_) | Form::Ask { .. } => {}
    }
}

fn probability_faults(model: &Model, id: FactorId, entry: ExpressionId) -> Option<Fault> {
    if let Expression::If { then, otherwise, .. } = model.expressions[entry] {
        return probability_faults(model, id, then).or_else(|| probability_faults(model, id, otherwise));
    }
    let value = model.constant(entry).filter(|value| !(0.0..=1.0).contains(value))?;
    Some(fault(
        Place::Expression(id, entry),
        format!("a probability lies between 0 and 1, but this is {value}"),
    ))
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
    let place = row.first().map_or(Place::Form(id), |first| Place::Expression(id, *first));
    match count {
        Some(count) if count != row.len() => {
            let text = values();
            faults.push(fault(
                place,
                format!("`{name}` has {count} values (`{text}`), but this row has {} entries", row.len()),
            ));
        }
        None => faults.push(fault(
            Place::Form(id),
            format!("`{}` cannot be written in rows: its values are not known here", values()),
        )),
        _ => {}
    }
    faults.extend(row.iter().filter_map(|entry| probability_faults(model, id, *entry)));
    let constants: Option<Vec<f64>> = row.iter().map(|entry| model.constant(*entry)).collect();
    if let Some(sum) =
        constants.map(|row| row.iter().sum::<f64>()).filter(|sum| (sum - 1.0).abs() > SUM_TOLERANCE)
    {
        let sum = (sum * 1e9).round() / 1e9;
        faults
            .push(fault(place, format!("the probabilities of a row must sum to 1, but these sum to {sum}")));
    }
}

fn table_faults(model: &Model, id: FactorId, rows: &[Vec<ExpressionId>], faults: &mut Vec<Fault>) {
    let factor = &model.factors[id];
    let count = |id: VariableId| model.variables[id].domain.count();
    let names: Vec<_> = factor.right.iter().map(|use_| model.variable_name(use_.variable)).collect();
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
    let count = domain.count()?;
    let mut parents: Vec<(VariableId, usize, i64)> = Vec::new();
    for use_ in &model.factors[id].right {
        let domain = &model.variables[use_.variable].domain;
        parents.push((use_.variable, domain.count()?, domain.base()));
    }
    let combinations = parents.iter().try_fold(1usize, |product, parent| product.checked_mul(parent.1))?;
    if combinations > MOST_COMBINATIONS {
        return None;
    }
    let mut example = None;
    for combination in 0..combinations {
        let (mut rest, mut values) = (combination, HashMap::new());
        for (variable, count, base) in &parents {
            values.insert(*variable, (rest % count) as f64 + *base as f64);
            rest /= count;
        }
        let result = model.evaluate(value, &|variable| values.get(&variable).copied())?;
        let ordinal = result - domain.base() as f64;
        if ordinal.fract() == 0.0 && ordinal >= 0.0 && ordinal < count as f64 {
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

pub(super) fn question_faults(model: &Model, question: &Question, id: Option<QuestionId>) -> Vec<Fault> {
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

impl Model {
    /// The number that an expression is, whatever the variables and parameters are; `None` if it depends on them.
    pub fn constant(&self, id: ExpressionId) -> Option<f64> {
        self.evaluate(id, &|_| None)
    }

    /// The number that an expression is where variables have these values; `None` if it depends on more.
    pub fn evaluate(&self, id: ExpressionId, value: &impl Fn(VariableId) -> Option<f64>) -> Option<f64> {
        match &self.expressions[id] {
            Expression::Number(number) => Some(*number),
            Expression::Variable(use_) if use_.element.is_none() => value(use_.variable),
            Expression::Unary(operator, operand) => Some(operator.apply(self.evaluate(*operand, value)?)),
            Expression::Binary(operator, left, right) => {
                Some(operator.apply(self.evaluate(*left, value)?, self.evaluate(*right, value)?))
            }
            Expression::If { condition, then, otherwise } => {
                let branch = if self.evaluate(*condition, value)? != 0.0 { *then } else { *otherwise };
                self.evaluate(branch, value)
            }
            _ => None,
        }
    }

    /// How many elements an index space has, where that is known without any size.
    pub fn index_count(&self, over: &IndexSpace) -> Option<usize> {
        match over {
            IndexSpace::Range(range) => Domain::Finite { labels: Vec::new(), range: Some(*range) }.count(),
            IndexSpace::Set(_) => None,
        }
    }

    /// The position of a question among the declared ones.
    pub fn question_id(&self, name: &str) -> Option<QuestionId> {
        self.questions
            .ids()
            .find(|id| self.questions[*id].name == name && id.position() < self.questions.len())
    }
}
