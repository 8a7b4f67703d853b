//! Long `match`es on a finite variable, as arrays.
//!
//! In: the arms of a `match` that are numbers. Out: the number read at the value of the variable. Invariant: the array holds
//! the values of the chain of choices; a chain of n numbers takes n steps to lower and one to run, not n for each value.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{ExpressionId, ValueId};
use crate::kernel::{Extent, Role};
use crate::model::{Arms, Expression};

impl Lowering<'_> {
    /// A chain of choices between numbers that begins here.
    pub(super) fn arms(&self, id: ExpressionId) -> Option<Arms> {
        self.model.arms(id, |arm| matches!(arm, Expression::Number(_)))
    }

    /// The value of a chain of choices between numbers, with the value for all other values of its variable; `refused`
    /// numbers become NaN.
    pub(super) fn chain(
        &mut self,
        arms: &Arms,
        otherwise: ValueId,
        refused: impl Fn(f64) -> bool,
    ) -> Result<Option<ValueId>, Error> {
        let Meaning::Ordinal(ordinal) = self.meaning(arms.variable, None)? else { return Ok(None) };
        let number = |arm: &ExpressionId| match self.model.expressions[*arm] {
            Expression::Number(number) if !refused(number) => number,
            _ => f64::NAN,
        };
        let numbers = arms.at.iter().map(|arm| arm.as_ref().map(number)).collect::<Vec<Option<f64>>>();
        if let Some(known) = self.builder.as_constant(ordinal) {
            let number = numbers.get(known as usize).filter(|_| known >= 0.0 && known.fract() == 0.0);
            return Ok(Some(match number.copied().flatten() {
                Some(number) => self.builder.constant(number),
                None => otherwise,
            }));
        }
        let what = format!("match {}", self.model.variable_name(arms.variable));
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
}
