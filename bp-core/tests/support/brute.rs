//! The joint distribution of a discrete model, by enumeration.
//!
//! In: a model of finite variables without plates, families or parameters. Out: the answer to each ask, by P(S | K) =
//! Σ_F P(S F K) / Σ_{S F} P(S F K). Invariant: written from the definition of the model, not from its plan.

use super::{Table, Values};
use bp_core::compiler::ids::{ExpressionId, VariableId};
use bp_core::compiler::model::{Ask, Domain, Expression, Factor, Finding, Form, Model, Statistic, Value};
use bp_core::compiler::operators::{Binary, Unary};

/// All assignments of some variables.
pub(crate) fn assignments(model: &Model, variables: &[VariableId]) -> Vec<Values> {
    let mut all = vec![Values::new()];
    for variable in variables {
        let count = model.variables[*variable].domain.count().unwrap();
        let extend = |values: &Values| {
            (0..count)
                .map(|value| {
                    let mut values = values.clone();
                    values.insert(*variable, value);
                    values
                })
                .collect::<Vec<_>>()
        };
        all = all.iter().flat_map(extend).collect();
    }
    all
}

fn number(model: &Model, values: &Values, id: ExpressionId) -> f64 {
    let at = |id: &ExpressionId| number(model, values, *id);
    let truth = |condition: bool| if condition { 1.0 } else { 0.0 };
    match &model.expressions[id] {
        Expression::Number(number) => *number,
        Expression::Variable(use_) => {
            let low = match &model.variables[use_.variable].domain {
                Domain::Finite { labels, range: Some(range) } => range.low - labels.len() as i64,
                _ => 0,
            };
            values[&use_.variable] as f64 + low as f64
        }
        Expression::Unary(operator, operand) => {
            let x = at(operand);
            match operator {
                Unary::Negate => -x,
                Unary::Not => truth(x == 0.0),
                Unary::Absolute => x.abs(),
                other => panic!("{other:?}"),
            }
        }
        Expression::Binary(operator, left, right) => {
            let (x, y) = (at(left), at(right));
            match operator {
                Binary::Add => x + y,
                Binary::Subtract => x - y,
                Binary::Multiply => x * y,
                Binary::Divide => x / y,
                Binary::Minimum => {
                    if x < y {
                        x
                    } else {
                        y
                    }
                }
                Binary::Maximum => {
                    if x > y {
                        x
                    } else {
                        y
                    }
                }
                Binary::Equal => truth(x == y),
                Binary::NotEqual => truth(x != y),
                Binary::Less => truth(x < y),
                Binary::LessOrEqual => truth(x <= y),
                Binary::Greater => truth(x > y),
                Binary::GreaterOrEqual => truth(x >= y),
                Binary::And => truth(x == 1.0 && y == 1.0),
                Binary::Or => truth(x == 1.0 || y == 1.0),
                other => panic!("{other:?}"),
            }
        }
        Expression::If { condition, then, otherwise } => {
            at(if at(condition) == 1.0 { then } else { otherwise })
        }
        other => panic!("{other:?}"),
    }
}

fn density(model: &Model, values: &Values, factor: &Factor, form: &Form) -> f64 {
    let of = |id: &ExpressionId| number(model, values, *id);
    let left = factor.left[0].variable;
    let domain = &model.variables[left].domain;
    let base = match domain {
        Domain::Finite { labels, range: Some(range) } => (range.low - labels.len() as i64) as f64,
        _ => 0.0,
    };
    match form {
        Form::Uniform => factor
            .left
            .iter()
            .map(|left| 1.0 / model.variables[left.variable].domain.count().unwrap() as f64)
            .product(),
        Form::Bernoulli(p, _) => {
            if values[&left] == 1 {
                of(p)
            } else {
                1.0 - of(p)
            }
        }
        Form::Categorical(entries) => of(&entries[values[&left]]),
        Form::Table(rows) => {
            let place = |uses: &[bp_core::compiler::model::VariableUse]| {
                uses.iter().fold(0, |place, use_| {
                    place * model.variables[use_.variable].domain.count().unwrap() + values[&use_.variable]
                })
            };
            of(&rows[place(&factor.right)][place(&factor.left)])
        }
        Form::Constants(numbers) => {
            let uses = factor.right.iter().chain(&factor.left);
            numbers[uses.fold(0, |place, use_| {
                place * model.variables[use_.variable].domain.count().unwrap() + values[&use_.variable]
            })]
        }
        Form::Dirac(value) => {
            if of(value) == values[&left] as f64 + base {
                1.0
            } else {
                0.0
            }
        }
        Form::Law { law: bp_core::compiler::law::Law::Normal, arguments } => {
            let (mean, deviation) = (&arguments[0], &arguments[1]);
            let (mean, deviation) = (of(mean), of(deviation));
            let bell = |ordinal: usize| (-0.5 * ((ordinal as f64 + base - mean) / deviation).powi(2)).exp();
            bell(values[&left]) / (0..domain.count().unwrap()).map(bell).sum::<f64>()
        }
        Form::If { condition, then, otherwise } => {
            density(model, values, factor, if of(condition) == 1.0 { then } else { otherwise })
        }
        other => panic!("{other:?}"),
    }
}

/// The probability of an assignment of all variables.
pub(crate) fn joint(model: &Model, values: &Values) -> f64 {
    model.factors.values().map(|factor| density(model, values, factor, &factor.form)).product()
}

/// The likelihood of the evidence under an assignment: 0 or 1, or the virtual evidence.
fn agreement(ask: &Ask, values: &Values) -> f64 {
    let one = |known: &bp_core::compiler::model::Known| match &known.evidence {
        Finding::Hard(Value::Ordinal(ordinal)) => f64::from(u8::from(values[&known.variable] == *ordinal)),
        Finding::Virtual(weights) => weights[values[&known.variable]],
        Finding::Each => 1.0,
        other => panic!("{other:?}"),
    };
    ask.known.iter().map(one).product()
}

/// Σ of the joint over all assignments that agree with some values and with the evidence.
fn mass(ask: &Ask, all: &[(Values, f64)], fixed: &Values) -> f64 {
    let agrees = |values: &Values| fixed.iter().all(|(variable, value)| values[variable] == *value);
    all.iter().filter(|(values, _)| agrees(values)).map(|(values, p)| p * agreement(ask, values)).sum()
}

/// Every assignment with its probability.
pub(crate) fn enumerate(model: &Model) -> Vec<(Values, f64)> {
    let variables: Vec<VariableId> = model.variables.ids().collect();
    assignments(model, &variables)
        .into_iter()
        .map(|values| {
            let p = joint(model, &values);
            (values, p)
        })
        .collect()
}

/// The answer to an ask as a table, and the mass of the evidence.
pub(crate) fn answer(model: &Model, all: &[(Values, f64)], ask: &Ask) -> (Table, f64) {
    let each: Vec<VariableId> = (ask.known.iter())
        .filter(|known| known.evidence == Finding::Each)
        .map(|known| known.variable)
        .collect();
    let searched: Vec<VariableId> = ask.searched.iter().map(|searched| searched.variable).collect();
    let wanted = |values: &Values| {
        ask.searched.iter().all(|searched| match searched.at {
            Some(Value::Ordinal(ordinal)) => values[&searched.variable] == ordinal,
            _ => true,
        })
    };
    let mut table = Table::new();
    for context in assignments(model, &each) {
        let total = mass(ask, all, &context);
        let rows: Vec<(Values, f64)> = (assignments(model, &searched).into_iter())
            .map(|mut values| {
                values.extend(context.clone());
                let p = mass(ask, all, &values);
                (values, if total > 0.0 { p / total } else { 0.0 })
            })
            .filter(|(values, _)| wanted(values))
            .collect();
        match ask.statistic {
            Statistic::Entropy => {
                let entropy = rows.iter().map(|(_, p)| if *p > 0.0 { -p * p.ln() } else { 0.0 }).sum();
                table.push((context, entropy));
            }
            _ => table.extend(rows.into_iter().map(|(mut values, p)| {
                for searched in ask.searched.iter().filter(|searched| searched.at.is_some()) {
                    values.remove(&searched.variable);
                }
                (values, p)
            })),
        }
    }
    (table, mass(ask, all, &Values::new()))
}
