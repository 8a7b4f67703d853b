//! The distributions of a learned form, each with the context in which it holds.
//!
//! In: a form whose parameters are numbers. Out: distributions with labels such as `Spam = true`. Invariant: a condition on one
//! variable is written with the names of its values, as in a question; any other as the program has it.

use bp_core::compiler::answer::NamedLaw;
use bp_core::compiler::ids::{ExpressionId, VariableId};
use bp_core::compiler::model::{Expression, Form, Model};
use bp_core::compiler::operators::{Binary, Unary};

/// What holds in a branch of a form.
#[derive(Clone, Default)]
struct Context {
    /// Conditions as they are written.
    words: Vec<String>,
    /// Values that a variable does not have.
    excluded: Vec<(VariableId, usize)>,
}

/// The distributions of a form whose parameters are numbers, each with its context.
pub(super) fn laws(model: &Model, form: &Form) -> Vec<(String, NamedLaw)> {
    let mut found = Vec::new();
    collect(model, form, &Context::default(), &mut found);
    found
}

fn collect(model: &Model, form: &Form, context: &Context, found: &mut Vec<(String, NamedLaw)>) {
    match form {
        Form::Law { law, arguments } => {
            let numbers: Option<Vec<f64>> = arguments.iter().map(|id| number(model, *id)).collect();
            if let Some(numbers) = numbers {
                let mut parameters = [0.0; 3];
                parameters[..numbers.len()].copy_from_slice(&numbers);
                let words = context.text(model);
                let label = if words.is_empty() { law.name().to_owned() } else { words };
                found.push((label, NamedLaw { law: *law, parameters }));
            }
        }
        Form::If { condition, then, otherwise } => {
            let [met, unmet] = match value(model, *condition) {
                Some((variable, ordinal)) => {
                    [context.with_value(model, variable, ordinal), context.without(model, variable, ordinal)]
                }
                None => {
                    let words = model.expression_text(*condition, &[]);
                    [context.with(words.clone()), context.with(format!("not ({words})"))]
                }
            };
            collect(model, then, &met, found);
            collect(model, otherwise, &unmet, found);
        }
        _ => {}
    }
}

impl Context {
    fn with(&self, words: String) -> Self {
        let mut next = self.clone();
        next.words.push(words);
        next
    }

    /// Where the variable has this value.
    fn with_value(&self, model: &Model, variable: VariableId, ordinal: usize) -> Self {
        let mut next = self.clone();
        next.excluded.retain(|(other, _)| *other != variable);
        next.with(format!("{} = {}", model.variable_name(variable), model.value_name(variable, ordinal)))
    }

    /// Where the variable has another value: the only one that is left, or one of several.
    fn without(&self, model: &Model, variable: VariableId, ordinal: usize) -> Self {
        let mut next = self.clone();
        next.excluded.push((variable, ordinal));
        let is_left = |ordinal: &usize| !next.excluded.contains(&(variable, *ordinal));
        let count = model.variables[variable].domain.count().unwrap_or(0);
        match (0..count).filter(is_left).collect::<Vec<_>>().as_slice() {
            [last] => next.with_value(model, variable, *last),
            _ => next,
        }
    }

    fn text(&self, model: &Model) -> String {
        let excluded = self.excluded.iter().map(|(variable, ordinal)| {
            format!("{} != {}", model.variable_name(*variable), model.value_name(*variable, *ordinal))
        });
        self.words.iter().cloned().chain(excluded).collect::<Vec<_>>().join(", ")
    }
}

/// The variable and the value of a condition `X == value`, or of a condition that is a boolean variable.
fn value(model: &Model, condition: ExpressionId) -> Option<(VariableId, usize)> {
    let variable = |id: ExpressionId| match &model.expressions[id] {
        Expression::Variable(use_) if use_.element.is_none() => Some(use_.variable),
        _ => None,
    };
    match &model.expressions[condition] {
        Expression::Binary(Binary::Equal, left, right) => {
            let (found, number) = variable(*left).zip(number(model, *right))?;
            Some((found, model.variables[found].domain.ordinal_at(number)?))
        }
        Expression::Unary(Unary::Not, of) => Some((variable(*of)?, 0)),
        _ => Some((variable(condition)?, 1)),
    }
}

/// The number of a constant, or of a parameter that is the same everywhere.
fn number(model: &Model, id: ExpressionId) -> Option<f64> {
    match &model.expressions[id] {
        Expression::Number(number) => Some(*number),
        Expression::Unary(Unary::Negate, of) => number(model, *of).map(|number| -number),
        Expression::Parameter { parameter, indices } if indices.is_empty() => {
            model.parameters[*parameter].default_number()
        }
        _ => None,
    }
}
