//! Long `match`es on a finite variable, as arrays.
//!
//! In: a chain of choices `if X == 3 { 0.2 } else { … }`. Out: the number read at the value of X. Invariant: the array
//! holds the values of the chain; a chain of n numbers takes n steps to lower and one to run, not n for each value of
//! X.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{ExpressionId, ValueId, VariableId};
use crate::kernel::{Extent, Role};
use crate::model::{Domain, Expression};
use crate::operators::Binary;

/// Chains with fewer numbers remain choices.
const MANY: usize = 64;

/// Upper limit on the values of a variable.
const MOST: usize = 1 << 24;

/// A chain of choices on the value of one variable.
struct Arms {
    variable: VariableId,
    /// A value of the variable, and the number that the chain gives for it.
    numbers: Vec<(f64, f64)>,
    /// The expression for all other values.
    rest: ExpressionId,
}

impl Lowering<'_> {
    /// The value of an expression that begins with such a chain.
    pub(super) fn chain(&mut self, id: ExpressionId) -> Result<Option<ValueId>, Error> {
        let Some(Arms { variable, numbers: arms, rest }) = self.arms(id) else { return Ok(None) };
        let domain = &self.model.variables[variable].domain;
        let (base, count) = (domain.base(), domain.count().unwrap_or(0));
        let mut numbers: Vec<Option<f64>> = vec![None; count];
        // Of several arms for a value the first applies.
        for (value, number) in arms.into_iter().rev() {
            let ordinal = value - base as f64;
            if ordinal.fract() == 0.0 && ordinal >= 0.0 && ordinal < count as f64 {
                numbers[ordinal as usize] = Some(number);
            }
        }
        let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else { return Ok(None) };
        let otherwise = self.expression(rest)?;
        if let Some(known) = self.builder.as_constant(ordinal) {
            let number = numbers.get(known as usize).filter(|_| known >= 0.0 && known.fract() == 0.0);
            return Ok(Some(match number.copied().flatten() {
                Some(number) => self.builder.constant(number),
                None => otherwise,
            }));
        }
        let what = format!("match {}", self.model.variable_name(variable));
        if let Some(rest) = self.builder.as_constant(otherwise) {
            let numbers = numbers.into_iter().map(|number| number.unwrap_or(rest)).collect();
            return Ok(Some(self.looked_up(&what, numbers, ordinal, otherwise)));
        }
        let is_arm = numbers.iter().map(|number| f64::from(u8::from(number.is_some()))).collect();
        let zero = self.builder.constant(0.0);
        let is_arm = self.looked_up(&format!("{what}: has an arm"), is_arm, ordinal, zero);
        let numbers = numbers.into_iter().map(|number| number.unwrap_or(0.0)).collect();
        let number = self.looked_up(&what, numbers, ordinal, zero);
        Ok(Some(self.builder.select(is_arm, number, otherwise)))
    }

    /// The number at an ordinal.
    fn looked_up(&mut self, what: &str, numbers: Vec<f64>, ordinal: ValueId, otherwise: ValueId) -> ValueId {
        let name = self.name(what);
        let axis = self.builder.axis(&name, Extent::constant(numbers.len()));
        let buffer = self.builder.buffer(&name, Role::Table { key: None, numbers }, &[axis]);
        let place = self.builder.at(ordinal);
        self.builder.load_or(buffer, vec![place], otherwise)
    }

    /// The variable that a chain tests, its numbers by value, and the remaining expression.
    fn arms(&self, id: ExpressionId) -> Option<Arms> {
        let expressions = &self.model.expressions;
        let number = |id: &ExpressionId| match expressions[*id] {
            Expression::Number(number) => Some(number),
            _ => None,
        };
        let arm = |id: ExpressionId| {
            let Expression::If { condition, then, otherwise } = &expressions[id] else { return None };
            let Expression::Binary(Binary::Equal, left, right) = &expressions[*condition] else {
                return None;
            };
            let Expression::Variable(use_) = &expressions[*left] else { return None };
            (use_.element.is_none()).then_some(())?;
            Some((use_.variable, (number(right)?, number(then)?), *otherwise))
        };
        let (variable, _, _) = arm(id)?;
        let (mut arms, mut rest) = (Vec::new(), id);
        while let Some((_, values, otherwise)) = arm(rest).filter(|(other, ..)| *other == variable) {
            arms.push(values);
            rest = otherwise;
        }
        let declared = &self.model.variables[variable];
        let fits = matches!(declared.domain, Domain::Finite { .. })
            && declared.family.is_none()
            && declared.domain.count().is_some_and(|count| count <= MOST);
        (fits && arms.len() >= MANY).then_some(Arms { variable, numbers: arms, rest })
    }
}
