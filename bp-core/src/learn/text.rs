//! What was learned, as text of the language.
//!
//! In: a learned model. Out: a program that holds the parameters and forms that were learned, and nothing else. Invariant:
//! each number is written so that it is read back to the last bit; forms come in the order of the `unknown`s that they
//! stand for.

use super::distribution::Learnable;
use super::parametric::{Shape, Unknown};
use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::law::Law;
use crate::model::{Domain, Fit, IndexSpace, Model, ParameterKind};

/// The most laws that are written out one by one.
const WRITTEN_OUT: usize = 12;

pub(super) fn text(learnable: &Learnable) -> String {
    let (mut parameters, mut forms) = (String::new(), String::new());
    for unknown in &learnable.unknowns.list {
        let (form, fields) = form(&learnable.model, unknown);
        for field in fields {
            parameters.push_str(&declaration(&learnable.model, field));
        }
        forms.push_str(&format!("{} = {form};\n", learnable.head(unknown.factor)));
    }
    for identification in &learnable.model.identifications {
        for parameter in &identification.parameters {
            parameters.push_str(&declaration(&learnable.model, *parameter));
        }
    }
    format!("program Learned {{ parameters {{\n{parameters}}} forms {{\n{forms}}} }}")
}

/// A number, read back as it is.
fn number(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 || (1e-6..1e15).contains(&size) { number.to_string() } else { format!("{number:e}") }
}

fn list(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(number).collect::<Vec<_>>().join(", ")
}

/// `mu[1..=3] : real = [1, 2, 3];`
fn declaration(model: &Model, id: ParameterId) -> String {
    let parameter = &model.parameters[id];
    let kind = match parameter.kind {
        ParameterKind::Probability => "probability",
        ParameterKind::Real => "real",
        ParameterKind::Integer => "integer",
        ParameterKind::Size => "size",
    };
    let over: Vec<String> = (parameter.over.iter())
        .map(|over| match over {
            IndexSpace::Set(set) => model.sets[*set].name.clone(),
            IndexSpace::Range(range) => {
                model.domain_text(&Domain::Finite { labels: Vec::new(), range: Some(*range) })
            }
        })
        .collect();
    let over = if over.is_empty() { String::new() } else { format!("[{}]", over.join(", ")) };
    let default = match parameter.default.as_slice() {
        [] => String::new(),
        [one] => format!(" = {}", number(*one)),
        several => format!(" = [{}]", list(several.iter().copied())),
    };
    format!("{}{over} : {kind}{default};\n", parameter.name)
}

/// The values of the variables on the right, for each combination; the last variable fastest.
fn contexts(model: &Model, right: &[VariableId]) -> Vec<Vec<String>> {
    let mut all = vec![Vec::new()];
    for variable in right {
        let count = model.variables[*variable].domain.count().unwrap_or(1);
        let extend = |before: &Vec<String>| {
            let with =
                |ordinal| before.iter().cloned().chain([model.value_name(*variable, ordinal)]).collect();
            (0..count).map(with).collect::<Vec<Vec<String>>>()
        };
        all = all.iter().flat_map(extend).collect();
    }
    all
}

/// A form, and the fields that it speaks of.
fn form(model: &Model, unknown: &Unknown) -> (String, Vec<ParameterId>) {
    let factor = &model.factors[unknown.factor];
    let right: Vec<VariableId> = factor.right.iter().map(|use_| use_.variable).collect();
    let values = |parameter: &ParameterId| model.parameters[*parameter].default.clone();
    match &unknown.shape {
        Shape::Table(rows) => (table(model, unknown, &right, rows), Vec::new()),
        Shape::Regression(parameters) => {
            let numbers = parameters.iter().flat_map(values);
            (format!("linear_regression({})", list(numbers)), Vec::new())
        }
        Shape::Law(law, fields) => {
            let count = fields.first().map_or(1, |field| values(field).len());
            let at = |place: usize| {
                let learned = fields.iter().map(|field| number(values(field)[place])).collect();
                format!("{}({})", law.name(), arguments(*law, &unknown.fit, learned).join(", "))
            };
            let bins = |variable: &VariableId| matches!(model.variables[*variable].domain, Domain::Bins(_));
            if count <= WRITTEN_OUT && !right.iter().any(bins) {
                return (chosen(model, &right, 0, &at), Vec::new());
            }
            let indices: Vec<String> = right.iter().map(|variable| index(model, *variable)).collect();
            let learned = fields
                .iter()
                .map(|field| format!("{}[{}]", model.parameters[*field].name, indices.join(", ")));
            let words = arguments(*law, &unknown.fit, learned.collect());
            (format!("{}({})", law.name(), words.join(", ")), fields.clone())
        }
    }
}

/// The arguments of a law: those that are known in their places.
fn arguments(law: Law, fit: &Fit, mut learned: Vec<String>) -> Vec<String> {
    if let Fit::Law { known, .. } | Fit::Conjugate { known, .. } = fit
        && let Some(known) = known.first()
    {
        learned.insert(if law == Law::Binomial { 0 } else { learned.len() }, number(*known));
    }
    learned
}

fn table(model: &Model, unknown: &Unknown, right: &[VariableId], rows: &[Vec<ExpressionId>]) -> String {
    let factor = &model.factors[unknown.factor];
    let row = |row: &[ExpressionId]| -> Vec<f64> {
        row.iter().map(|entry| model.constant(*entry).unwrap_or(f64::NAN)).collect()
    };
    if right.is_empty() {
        let numbers = row(&rows[0]);
        return match (factor.left.as_slice(), numbers.as_slice()) {
            ([left], [_, chance]) if model.variables[left.variable].domain == Domain::Boolean => {
                format!("bernoulli({})", number(*chance))
            }
            ([_], _) => format!("categorical({})", list(numbers)),
            _ => format!("table {{ {} }}", list(numbers)),
        };
    }
    let rows = contexts(model, right)
        .into_iter()
        .zip(rows)
        .map(|(keys, entries)| format!("{}: {};", keys.join(", "), list(row(entries))));
    format!("table {{ {} }}", rows.collect::<Vec<_>>().join(" "))
}

/// A law for each combination of values, by nested `match`.
fn chosen(model: &Model, right: &[VariableId], from: usize, at: &dyn Fn(usize) -> String) -> String {
    let Some((variable, rest)) = right.split_first() else { return at(from) };
    let count = model.variables[*variable].domain.count().unwrap_or(1);
    let below: usize = rest.iter().map(|other| model.variables[*other].domain.count().unwrap_or(1)).product();
    let arms = (0..count).map(|ordinal| {
        let body = chosen(model, rest, from + ordinal * below, at);
        format!("{} => {body}", model.value_name(*variable, ordinal))
    });
    let arms: Vec<String> = arms.collect();
    format!("match {} {{ {} }}", model.variable_name(*variable), arms.join(", "))
}

/// The index of a variable's value in a field: a bin is counted.
fn index(model: &Model, variable: VariableId) -> String {
    let name = model.variable_name(variable);
    let Domain::Bins(bins) = &model.variables[variable].domain else { return name };
    match bins.width() {
        Some(width) => format!("floor(({name} - {}) / {})", signed(bins.ends().0), number(width)),
        None => {
            let inner = &bins.edges()[1..bins.count()];
            let steps =
                inner.iter().map(|edge| format!("if {name} > {} {{ 1 }} else {{ 0 }}", number(*edge)));
            let steps: Vec<String> = steps.map(|step| format!("({step})")).collect();
            if steps.is_empty() { "0".to_owned() } else { steps.join(" + ") }
        }
    }
}

/// A number behind an operator.
fn signed(value: f64) -> String {
    if value < 0.0 { format!("({})", number(value)) } else { number(value) }
}
