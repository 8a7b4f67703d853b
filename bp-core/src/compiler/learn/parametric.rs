//! From `unknown` forms to parametric ones.
//!
//! In: a model. Out: the same model in which each `unknown` is a table, a parametric distribution or a regression with
//! numbers to be learned. Invariant: nothing else is changed; there is one distribution for each combination of
//! right-hand values.

use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, ParameterId, VariableId};
use crate::law::Law;
use crate::model::{
    Apart, Bound, Domain, Expression, Factor, Fit, Form, IndexSpace, Model, Parameter, ParameterKind, Range,
    Unlearned, VariableUse,
};
use crate::operators::{Binary, Unary};
use pest::unicode::XID_CONTINUE;
use std::collections::{HashMap, HashSet};

/// Limit of the combinations of values with a distribution each.
pub(super) const MOST_CONTEXTS: usize = 1 << 20;

/// An `unknown` form in its parametric shape.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    pub(super) factor: FactorId,
    pub(super) fit: Fit,
    /// The indices that have a distribution for each of their values.
    pub(super) by: Vec<Apart>,
    pub(super) shape: Shape,
}

/// The shape of an `unknown` form.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Rows of numbers.
    Table(Vec<Vec<ExpressionId>>),
    /// A field of rows of numbers, a table for each value of the indices that are apart.
    Tables(ParameterId),
    /// Fields of parameters, one for each learned parameter of the distribution.
    Law(Law, Vec<ParameterId>),
    /// Intercept, slopes, deviation.
    Regression(Vec<ParameterId>),
}

/// The learned numbers, and how their forms are identified.
#[derive(Clone, Debug, Default)]
pub(super) struct Unknowns {
    pub(super) list: Vec<Unknown>,
    /// Learned numbers in tables, with their estimators.
    pub(super) entries: HashMap<ExpressionId, usize>,
    /// Learned parameters, with their estimators: `None` for those of `identification`.
    pub(super) parameters: HashMap<ParameterId, Option<usize>>,
    /// Means of regressions.
    pub(super) regressions: HashMap<ExpressionId, usize>,
}

/// Converts every `unknown` form.
pub(super) fn parametric(model: &mut Model) -> Result<Unknowns, Error> {
    let mut unknowns = Unknowns::default();
    for factor in model.factors.ids() {
        let mut form = model.factors[factor].form.clone();
        replace(model, factor, &mut form, &mut unknowns)?;
        model.factors[factor].form = form;
    }
    for identification in &model.identifications {
        unknowns.parameters.extend(identification.parameters.iter().map(|id| (*id, None)));
    }
    Ok(unknowns)
}

fn replace(
    model: &mut Model,
    factor: FactorId,
    form: &mut Form,
    unknowns: &mut Unknowns,
) -> Result<(), Error> {
    match form {
        Form::Unknown(unlearned) => *form = shaped(model, factor, unlearned.clone(), unknowns)?,
        Form::If { then, otherwise, .. } => {
            replace(model, factor, then, unknowns)?;
            replace(model, factor, otherwise, unknowns)?;
        }
        Form::Initial { .. } => {
            let head = model.head(&model.factors[factor]);
            return Err(Error::input(
                head,
                "it has a form of its own at the first instant, which is not learned; in place of `P(initial(X))` write \
                 `P(X^-1) = previous(X) else …`",
            ));
        }
        // The distribution of X^-1 before the first instant.
        Form::Previous { at: None, otherwise, .. } => replace(model, factor, otherwise, unknowns)?,
        other => {
            let mut inside = false;
            other.each_part(&mut |part| inside |= matches!(part, Form::Unknown(_)));
            if inside {
                let (head, name) = (model.head(&model.factors[factor]), other.name());
                let message = format!("`unknown` is not learned inside `{name}`");
                return Err(Error::input(head, message));
            }
        }
    }
    Ok(())
}

fn shaped(
    model: &mut Model,
    id: FactorId,
    Unlearned { fit, by }: Unlearned,
    unknowns: &mut Unknowns,
) -> Result<Form, Error> {
    let position = unknowns.list.len();
    let factor = model.factors[id].clone();
    let head = model.head(&factor);
    let left: Vec<VariableId> = factor.left.iter().map(|use_| use_.variable).collect();
    if let Some(whole) = factor.right.iter().find(|use_| is_whole_family(model, use_)) {
        let name = model.variable_name(whole.variable);
        let message = format!(
            "`{name}` is a family of variables: an unknown form cannot have a distribution for each combination of \
             its values; write a form with parameters, and name them in `identification`"
        );
        return Err(Error::input(head, message));
    }
    let right: Vec<VariableId> = factor.right.iter().map(|use_| use_.variable).collect();
    let apart: Vec<(IndexSpace, ExpressionId)> =
        by.iter().map(|apart| space(model, &factor, *apart)).collect();
    let (shape, form) = match &fit {
        Fit::LaplaceSuccession | Fit::Histogram | Fit::Dirichlet(_) | Fit::Beta(..) => {
            let columns = count(model, &head, &left)?;
            let rows = count(model, &head, &right)?;
            if rows.saturating_mul(columns) > MOST_CONTEXTS {
                return Err(too_many(&head));
            }
            let share = 1.0 / columns as f64;
            if !apart.is_empty() {
                let (parameter, table) = tables(model, (&left, &factor, share), &apart, (rows, columns));
                unknowns.parameters.insert(parameter, Some(position));
                unknowns.list.push(Unknown { factor: id, fit, by, shape: Shape::Tables(parameter) });
                return Ok(Form::Table(table));
            }
            let table: Vec<Vec<ExpressionId>> = (0..rows)
                .map(|_| (0..columns).map(|_| model.expressions.push(Expression::Number(share))).collect())
                .collect();
            unknowns.entries.extend(table.iter().flatten().map(|entry| (*entry, position)));
            (Shape::Table(table.clone()), Form::Table(table))
        }
        Fit::LinearRegression => {
            let places: Vec<ExpressionId> = apart.iter().map(|(_, index)| *index).collect();
            let mut parameters = vec![field(model, "intercept", &left, &apart, unknowns, position)];
            let mut mean = use_of(model, parameters[0], &places);
            for use_ in &factor.right {
                let variable = &use_.variable;
                if matches!(model.variables[*variable].domain, Domain::Set(_) | Domain::Vector(_)) {
                    let name = model.variable_name(*variable);
                    return Err(Error::input(
                        head,
                        format!("`{name}` is not a number, and cannot be a regressor"),
                    ));
                }
                let what = format!("slope_on_{}", plain(&model.variable_name(*variable)));
                let slope = field(model, &what, &left, &apart, unknowns, position);
                parameters.push(slope);
                let value = model.expressions.push(Expression::Variable(use_.clone()));
                let slope = use_of(model, slope, &places);
                let term = model.expressions.push(Expression::Binary(Binary::Multiply, slope, value));
                mean = model.expressions.push(Expression::Binary(Binary::Add, mean, term));
            }
            let deviation = field(model, "deviation", &left, &apart, unknowns, position);
            parameters.push(deviation);
            unknowns.regressions.insert(mean, position);
            let deviation = use_of(model, deviation, &places);
            (Shape::Regression(parameters), Form::normal(mean, deviation))
        }
        Fit::Law { .. } | Fit::UnbiasedNormal | Fit::Conjugate { .. } => {
            let (law, known) = match &fit {
                Fit::Law { law, known } | Fit::Conjugate { law, known, .. } => (*law, known.clone()),
                _ => (Law::Normal, Vec::new()),
            };
            count(model, &head, &right)?;
            let indices: Vec<(IndexSpace, ExpressionId)> =
                apart.into_iter().chain(factor.right.iter().map(|use_| index(model, use_))).collect();
            let mut fields = Vec::new();
            let mut arguments = Vec::new();
            // The known parameters: the number of trials, which is first, and the deviation, which is last.
            let given = |place: usize| match law {
                Law::Binomial => known.first().filter(|_| place == 0),
                _ => known.first().filter(|_| place == 1),
            };
            for (place, (what, _)) in law.parameters().iter().enumerate() {
                if let Some(number) = given(place) {
                    arguments.push(model.expressions.push(Expression::Number(*number)));
                    continue;
                }
                let parameter = field(model, &what.replace(' ', "_"), &left, &indices, unknowns, position);
                let places: Vec<ExpressionId> = indices.iter().map(|(_, index)| *index).collect();
                fields.push(parameter);
                arguments.push(use_of(model, parameter, &places));
            }
            (Shape::Law(law, fields), Form::Law { law, arguments })
        }
    };
    unknowns.list.push(Unknown { factor: id, fit, by, shape });
    Ok(form)
}

/// The range of an index that is apart, and its value.
fn space(model: &mut Model, factor: &Factor, apart: Apart) -> (IndexSpace, ExpressionId) {
    match (apart, model.plate) {
        (Apart::Plate, Some(plate)) => {
            let value = model.expressions.push(Expression::Variable(VariableUse::from(plate.index)));
            (IndexSpace::Set(plate.set), value)
        }
        (Apart::Product(depth), _) => {
            (factor.products[depth].1, model.expressions.push(Expression::Index(depth)))
        }
        (Apart::Plate, None) => unreachable!("internal: an index of a plate without a plate"),
    }
}

/// A field of probabilities, and the table whose entries are its numbers: `p[n, row, column]`.
fn tables(
    model: &mut Model,
    (left, factor, share): (&[VariableId], &Factor, f64),
    apart: &[(IndexSpace, ExpressionId)],
    (rows, columns): (usize, usize),
) -> (ParameterId, Vec<Vec<ExpressionId>>) {
    let range = |count: usize| IndexSpace::Range(Range { low: 0, high: Bound::constant(count as i64 - 1) });
    let has_rows = !factor.right.is_empty();
    let mut over: Vec<IndexSpace> = apart.iter().map(|(space, _)| *space).collect();
    over.extend(has_rows.then(|| range(rows)));
    over.push(range(columns));
    let name = free_name(model, "probability", left);
    let kind = ParameterKind::Probability;
    let parameter =
        model.parameters.push(Parameter { name, kind, default: vec![share], rows: Vec::new(), over });
    let mut entry = |row: usize, column: usize| {
        let mut indices: Vec<ExpressionId> = apart.iter().map(|(_, index)| *index).collect();
        let mut number = |number: usize| model.expressions.push(Expression::Number(number as f64));
        indices.extend(has_rows.then(|| number(row)));
        indices.push(number(column));
        model.expressions.push(Expression::Parameter { parameter, indices })
    };
    let table = (0..rows).map(|row| (0..columns).map(|column| entry(row, column)).collect()).collect();
    (parameter, table)
}

fn too_many(head: &str) -> Error {
    Error::input(head, format!("there would be more than {MOST_CONTEXTS} numbers to learn"))
}

/// The number of combinations of values of some variables.
fn count(model: &Model, head: &str, variables: &[VariableId]) -> Result<usize, Error> {
    let mut total = 1usize;
    for variable in variables {
        let domain = &model.variables[*variable].domain;
        let count = domain.count().ok_or_else(|| {
            let (name, text) = (model.variable_name(*variable), model.domain_text(domain));
            let way_out = match domain {
                Domain::Real => "cut it into `bins(low, high, count)`, or learn `unknown(linear_regression)`",
                _ => "write its bounds as numbers",
            };
            let message = format!(
                "it is learned for each value, and `{name}` is `{text}`, which is not finite; {way_out}"
            );
            Error::input(head, message)
        })?;
        total =
            total.checked_mul(count).filter(|total| *total <= MOST_CONTEXTS).ok_or_else(|| too_many(head))?;
    }
    Ok(total)
}

/// The range of a field with a number for each value of a variable, and the index of that value.
fn index(model: &mut Model, use_: &VariableUse) -> (IndexSpace, ExpressionId) {
    let domain = model.variables[use_.variable].domain.clone();
    let value = model.expressions.push(Expression::Variable(use_.clone()));
    let count = domain.count().unwrap_or(1) as i64;
    let range = |low: i64| IndexSpace::Range(Range { low, high: Bound::constant(low + count - 1) });
    let Domain::Bins(bins) = &domain else { return (range(domain.base()), value) };
    let number = |model: &mut Model, number: f64| model.expressions.push(Expression::Number(number));
    let node = |model: &mut Model, operator: Binary, left, right| {
        model.expressions.push(Expression::Binary(operator, left, right))
    };
    if let Some(width) = bins.width() {
        let (low, width) = (number(model, bins.ends().0), number(model, width));
        let offset = node(model, Binary::Subtract, value, low);
        let bin = node(model, Binary::Divide, offset, width);
        return (range(0), model.expressions.push(Expression::Unary(Unary::Floor, bin)));
    }
    // The number of inner edges below the centre.
    let mut bin = number(model, 0.0);
    for edge in &bins.edges()[1..bins.count()] {
        let (edge, one, none) = (number(model, *edge), number(model, 1.0), number(model, 0.0));
        let condition = node(model, Binary::Greater, value, edge);
        let step = model.expressions.push(Expression::If { condition, then: one, otherwise: none });
        bin = node(model, Binary::Add, bin, step);
    }
    (range(0), bin)
}

/// A new learned parameter: `mean_of_X`, with a number for each combination of right-hand values.
fn field(
    model: &mut Model,
    what: &str,
    left: &[VariableId],
    indices: &[(IndexSpace, ExpressionId)],
    unknowns: &mut Unknowns,
    position: usize,
) -> ParameterId {
    let name = free_name(model, what, left);
    let over = indices.iter().map(|(over, _)| *over).collect();
    let parameter = model.parameters.push(Parameter {
        name,
        kind: ParameterKind::Real,
        default: Vec::new(),
        rows: Vec::new(),
        over,
    });
    unknowns.parameters.insert(parameter, Some(position));
    parameter
}

/// `mean_of_X`, or another name that the program does not use.
fn free_name(model: &Model, what: &str, left: &[VariableId]) -> String {
    let of: Vec<String> = left.iter().map(|variable| plain(&model.variable_name(*variable))).collect();
    let stem = format!("{what}_of_{}", of.join("_"));
    let taken: HashSet<&str> = (model.parameters.values().map(|it| it.name.as_str()))
        .chain(model.variables.values().map(|it| it.name.as_str()))
        .chain(model.sets.values().map(|it| it.name.as_str()))
        .collect();
    let names = std::iter::once(stem.clone()).chain((2..).map(|number| format!("{stem}_{number}")));
    names.into_iter().find(|name| !taken.contains(name.as_str())).unwrap_or(stem)
}

fn use_of(model: &mut Model, parameter: ParameterId, indices: &[ExpressionId]) -> ExpressionId {
    model.expressions.push(Expression::Parameter { parameter, indices: indices.to_vec() })
}

fn is_whole_family(model: &Model, use_: &VariableUse) -> bool {
    use_.element.is_none() && model.variables[use_.variable].family.is_some()
}

/// A variable's name as part of another name, without quotes.
fn plain(name: &str) -> String {
    let letter = |letter: char| if XID_CONTINUE(letter) { letter } else { '_' };
    name.replace("^-1", "_before").chars().map(letter).collect()
}
