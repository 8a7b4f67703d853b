//! The learned numbers as text of the language.
//!
//! In: a learned model. Out: a program with only the learned parameters and forms. Invariant: each number is read back
//! exactly; forms are in the order of their `unknown`s.

use super::distribution::Learnable;
use super::parametric::{Shape, Unknown};
use super::program::Program;
use crate::ids::{ExpressionId, ParameterId};
use crate::law::Law;
use crate::model::{
    Apart, Bound, Domain, Factor, Fit, IndexSpace, Model, Parameter, ParameterKind, Range, VariableUse,
};
use crate::spelling::quoted;

/// Limit of distributions written one by one.
const WRITTEN_OUT: usize = 12;

pub(super) fn text(learnable: &Learnable) -> String {
    let Program { model, unknowns, .. } = &learnable.program;
    let (mut parameters, mut forms) = (String::new(), String::new());
    for unknown in &unknowns.list {
        let (form, fields) = form(model, unknown);
        for field in fields {
            parameters.push_str(&declaration(model, &field));
        }
        forms.push_str(&format!("{} = {form};\n", learnable.program.head(unknown.factor)));
    }
    for identification in &model.identifications {
        for parameter in &identification.parameters {
            parameters.push_str(&declaration(model, &model.parameters[*parameter]));
        }
    }
    // The sizes with which it was learned.
    let sizes =
        model.parameters.values().filter(|it| it.kind == ParameterKind::Size && !it.default.is_empty());
    sizes.for_each(|size| parameters.push_str(&declaration(model, size)));
    format!("program Learned {{ parameters {{\n{parameters}}} forms {{\n{forms}}} }}")
}

/// A number that is read back exactly.
fn number(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 || (1e-6..1e15).contains(&size) { number.to_string() } else { format!("{number:e}") }
}

fn list(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(number).collect::<Vec<_>>().join(", ")
}

/// `mu[1..=3] : real = [1, 2, 3];`
fn declaration(model: &Model, parameter: &Parameter) -> String {
    let kind = match parameter.kind {
        ParameterKind::Probability => "probability".into(),
        ParameterKind::Real => "real".into(),
        ParameterKind::Integer => "integer".into(),
        ParameterKind::Size => "size".into(),
        ParameterKind::Element(set) => quoted(&model.sets[set].name),
    };
    let over: Vec<String> = (parameter.over.iter())
        .map(|over| match over {
            IndexSpace::Set(set) => quoted(&model.sets[*set].name).into_owned(),
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
    format!("{}{over} : {kind}{default};\n", quoted(&parameter.name))
}

/// The values of the variables on the right, for each combination; the last variable fastest.
fn contexts(model: &Model, right: &[VariableUse]) -> Vec<Vec<String>> {
    let mut all = vec![Vec::new()];
    for use_ in right {
        let domain = &model.variables[use_.variable].domain;
        let extend = |before: &Vec<String>| {
            let with = |ordinal| before.iter().cloned().chain([domain.value_spelled(ordinal)]).collect();
            (0..domain.count().unwrap_or(1)).map(with).collect::<Vec<Vec<String>>>()
        };
        all = all.iter().flat_map(extend).collect();
    }
    all
}

/// A form, and the fields that it uses.
fn form(model: &Model, unknown: &Unknown) -> (String, Vec<Parameter>) {
    let factor = &model.factors[unknown.factor];
    let right = factor.right.as_slice();
    let values = |parameter: &ParameterId| model.parameters[*parameter].default.clone();
    let owned =
        |fields: &[ParameterId]| fields.iter().map(|field| model.parameters[*field].clone()).collect();
    let entry = |field: &ParameterId, indices: &[String]| {
        format!("{}[{}]", quoted(&model.parameters[*field].name), indices.join(", "))
    };
    let apart: Vec<String> = unknown.by.iter().map(|apart| index_apart(model, factor, *apart)).collect();
    match &unknown.shape {
        Shape::Table(rows) => (table(model, factor, rows), Vec::new()),
        Shape::Tables(field) => tables(model, factor, &model.parameters[*field], apart),
        Shape::Regression(parameters) if apart.is_empty() => {
            let numbers = parameters.iter().flat_map(values);
            (format!("linear_regression({})", list(numbers)), Vec::new())
        }
        Shape::Regression(parameters) => {
            let words: Vec<String> = parameters.iter().map(|field| entry(field, &apart)).collect();
            (format!("linear_regression({})", words.join(", ")), owned(parameters))
        }
        Shape::Law(law, fields) => {
            let count = fields.first().map_or(1, |field| values(field).len());
            let at = |place: usize| {
                let learned = fields.iter().map(|field| number(values(field)[place])).collect();
                format!("{}({})", law.name(), arguments(*law, &unknown.fit, learned).join(", "))
            };
            let bins = |use_: &VariableUse| matches!(model.variables[use_.variable].domain, Domain::Bins(_));
            if apart.is_empty() && count <= WRITTEN_OUT && !right.iter().any(bins) {
                return (chosen(model, factor, right, 0, &at), Vec::new());
            }
            let indices: Vec<String> =
                apart.into_iter().chain(right.iter().map(|use_| index(model, factor, use_))).collect();
            let learned = fields.iter().map(|field| match indices.is_empty() {
                true => quoted(&model.parameters[*field].name).into_owned(),
                false => entry(field, &indices),
            });
            let words = arguments(*law, &unknown.fit, learned.collect());
            (format!("{}({})", law.name(), words.join(", ")), owned(fields))
        }
    }
}

/// An index that is apart, as the form names it.
fn index_apart(model: &Model, factor: &Factor, apart: Apart) -> String {
    match apart {
        Apart::Product(depth) => quoted(&factor.products[depth].0).into_owned(),
        Apart::Plate => model.plate_index().map_or_else(String::new, |id| model.variable_name(id)),
    }
}

/// A table for each value of the indices that are apart, in a field: of a truth value its probability.
fn tables(model: &Model, factor: &Factor, field: &Parameter, apart: Vec<String>) -> (String, Vec<Parameter>) {
    let name = quoted(&field.name);
    let is_truth =
        matches!(factor.left.as_slice(), [left] if model.variables[left.variable].domain == Domain::Boolean);
    let is_small = |row: &[f64]| (1.0 - row[1] - row[0]).abs() > 1e-12 * row[0];
    if is_truth && !field.default.chunks(2).any(is_small) {
        let space = |use_: &VariableUse| {
            let domain = &model.variables[use_.variable].domain;
            let low = if domain.bins().is_some() { 0 } else { domain.base() };
            let high = Bound::constant(low + domain.count().unwrap_or(1) as i64 - 1);
            IndexSpace::Range(Range { low, high })
        };
        let over = field.over[..apart.len()].iter().copied().chain(factor.right.iter().map(space)).collect();
        let default = field.default.chunks(2).map(|row| row[1]).collect();
        let indices = apart.into_iter().chain(factor.right.iter().map(|use_| index(model, factor, use_)));
        let indices = indices.collect::<Vec<_>>().join(", ");
        let field = Parameter { over, default, ..field.clone() };
        return (format!("bernoulli({name}[{indices}])"), vec![field]);
    }
    let columns = factor.left.iter().map(|use_| model.variables[use_.variable].domain.count().unwrap_or(1));
    let columns: usize = columns.product();
    let apart = apart.join(", ");
    let row = |row: Option<usize>| {
        let row = row.map_or_else(String::new, |row| format!("{row}, "));
        let entries: Vec<String> =
            (0..columns).map(|column| format!("{name}[{apart}, {row}{column}]")).collect();
        entries.join(", ")
    };
    let form = match (factor.right.is_empty(), factor.left.len()) {
        (true, 1) => format!("categorical({})", row(None)),
        (true, _) => format!("table {{ {} }}", row(None)),
        (false, _) => {
            let contexts = contexts(model, &factor.right).into_iter().enumerate();
            let rows = contexts.map(|(place, keys)| format!("{}: {};", keys.join(", "), row(Some(place))));
            format!("table {{ {} }}", rows.collect::<Vec<_>>().join(" "))
        }
    };
    (form, vec![field.clone()])
}

/// The arguments of a distribution, with the known ones in their positions.
fn arguments(law: Law, fit: &Fit, mut learned: Vec<String>) -> Vec<String> {
    if let Fit::Law { known, .. } | Fit::Conjugate { known, .. } = fit
        && let Some(known) = known.first()
    {
        learned.insert(if law == Law::Binomial { 0 } else { learned.len() }, number(*known));
    }
    learned
}

fn table(model: &Model, factor: &Factor, rows: &[Vec<ExpressionId>]) -> String {
    let row = |row: &[ExpressionId]| -> Vec<f64> {
        row.iter().map(|entry| model.constant(*entry).unwrap_or(f64::NAN)).collect()
    };
    if factor.right.is_empty() {
        let numbers = row(&rows[0]);
        return match (factor.left.as_slice(), numbers.as_slice()) {
            // `bernoulli` has one number: it does not hold a small probability of `false`.
            ([left], [rest, chance])
                if model.variables[left.variable].domain == Domain::Boolean
                    && (1.0 - chance - rest).abs() <= 1e-12 * rest =>
            {
                format!("bernoulli({})", number(*chance))
            }
            ([_], _) => format!("categorical({})", list(numbers)),
            _ => format!("table {{ {} }}", list(numbers)),
        };
    }
    let rows = contexts(model, &factor.right)
        .into_iter()
        .zip(rows)
        .map(|(keys, entries)| format!("{}: {};", keys.join(", "), list(row(entries))));
    format!("table {{ {} }}", rows.collect::<Vec<_>>().join(" "))
}

/// A distribution for each combination of values, by nested `match`.
fn chosen(
    model: &Model,
    factor: &Factor,
    right: &[VariableUse],
    from: usize,
    at: &dyn Fn(usize) -> String,
) -> String {
    let Some((use_, rest)) = right.split_first() else { return at(from) };
    let count = |use_: &VariableUse| model.variables[use_.variable].domain.count().unwrap_or(1);
    let below: usize = rest.iter().map(count).product();
    let arms = (0..count(use_)).map(|ordinal| {
        let body = chosen(model, factor, rest, from + ordinal * below, at);
        format!("{} => {body}", model.variables[use_.variable].domain.value_spelled(ordinal))
    });
    let arms: Vec<String> = arms.collect();
    format!("match {} {{ {} }}", model.use_name(use_, &factor.products), arms.join(", "))
}

/// The index of a variable's value in a field: for a bin its number.
fn index(model: &Model, factor: &Factor, use_: &VariableUse) -> String {
    let name = model.use_name(use_, &factor.products);
    let Domain::Bins(bins) = &model.variables[use_.variable].domain else { return name };
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

/// A number after an operator.
fn signed(value: f64) -> String {
    if value < 0.0 { format!("({})", number(value)) } else { number(value) }
}
