//! Which distribution a form is in a case.
//!
//! In: a form, and the numbers of the variables on its right. Out: the [`Kind`] of distribution and the cells that it
//! learns. Invariant: nothing where all of it is known; what is learned in a way that has no equation here is refused.

use super::distribution::{Argument, Cell, Kind, Learnable, Share};
use super::parametric::Shape;
use super::worth::{Numbers, each_below, place, worth};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId};
use crate::law::Law;
use crate::model::{Expression, Form};

/// What an expression is where a number is wanted.
#[derive(Clone, Copy, Debug)]
enum Read {
    /// A cell that is learned.
    Cell(Cell),
    /// An expression of some that are.
    Mixed,
    /// A number that is known.
    Known(f64),
}

impl Learnable {
    /// Which distribution a form is for these numbers.
    pub(super) fn kind(
        &self,
        factor: FactorId,
        form: &Form,
        numbers: Numbers<'_>,
    ) -> Result<Option<(Kind, Option<usize>)>, Error> {
        if !self.speaks(form) {
            return Ok(None);
        }
        let row = |entries: &[ExpressionId]| {
            let shares: Vec<Read> = entries
                .iter()
                .map(|entry| self.argument(factor, *entry, numbers))
                .collect::<Result<_, _>>()?;
            let first = entries.iter().find_map(|entry| self.unknowns.entries.get(entry));
            self.row(factor, shares).map(|row| row.map(|row| (row, first.copied())))
        };
        match form {
            Form::If { condition, then, otherwise } => {
                let chosen = worth(&self.model, *condition, numbers)
                    .ok_or_else(|| self.wrong(factor, "its condition cannot be computed from a case"))?;
                self.kind(factor, if chosen != 0.0 { then } else { otherwise }, numbers)
            }
            Form::Bernoulli(chance) => match self.argument(factor, *chance, numbers)? {
                Read::Cell(cell) => Ok(Some((Kind::Row(vec![Share::Rest, Share::Learned(cell)]), None))),
                Read::Mixed => Err(self.indirect(factor)),
                Read::Known(_) => Ok(None),
            },
            Form::Categorical(entries) => row(entries),
            Form::Table(rows) => {
                let mut position = 0;
                for use_ in &self.model.factors[factor].right {
                    let domain = &self.model.variables[use_.variable].domain;
                    let number = numbers(use_.variable);
                    let ordinal = number.and_then(|number| domain.ordinal_at(number));
                    let ordinal = ordinal.ok_or_else(|| self.wrong(factor, "a value is missing"))?;
                    position = position * domain.count().unwrap_or(1) + ordinal;
                }
                row(&rows[position])
            }
            Form::Law { law: Law::Normal, arguments }
                if self.unknowns.regressions.contains_key(&arguments[0]) =>
            {
                let unknown = self.unknowns.regressions[&arguments[0]];
                let Shape::Regression(parameters) = &self.unknowns.list[unknown].shape else {
                    return Ok(None);
                };
                let cells = parameters.iter().map(|parameter| Cell::Place(*parameter, 0)).collect();
                Ok(Some((Kind::Regression(cells), Some(unknown))))
            }
            Form::Law { law, arguments } => self.law(factor, *law, arguments, numbers),
            other => Err(self
                .wrong(factor, format!("parameters inside `{}` are not learned from cases", other.name()))),
        }
    }

    fn law(
        &self,
        factor: FactorId,
        law: Law,
        written: &[ExpressionId],
        numbers: Numbers<'_>,
    ) -> Result<Option<(Kind, Option<usize>)>, Error> {
        let (mut arguments, mut unknown) = (Vec::new(), None);
        for argument in written {
            arguments.push(match self.argument(factor, *argument, numbers)? {
                Read::Cell(cell) => {
                    if let Cell::Place(parameter, _) = cell {
                        unknown = unknown.or(self.unknowns.parameters[&parameter]);
                    }
                    Argument::Learned(cell)
                }
                Read::Mixed => return Err(self.indirect(factor)),
                Read::Known(number) => Argument::Known(number.to_bits()),
            });
        }
        if arguments.iter().all(|argument| matches!(argument, Argument::Known(_))) {
            return Ok(None);
        }
        Ok(Some((Kind::Law(law, arguments), unknown)))
    }

    fn row(&self, factor: FactorId, shares: Vec<Read>) -> Result<Option<Kind>, Error> {
        if shares.iter().all(|share| matches!(share, Read::Known(_))) {
            return Ok(None);
        }
        let row = shares.iter().map(|share| match share {
            Read::Cell(cell) => Share::Learned(*cell),
            _ => Share::Rest,
        });
        let row: Vec<Share> = row.collect();
        let rests = row.iter().filter(|share| **share == Share::Rest).count();
        let known = shares.iter().any(|share| matches!(share, Read::Known(_)));
        if rests > 1 || known {
            let message = "a row is learned whole: each probability a parameter, but for one that is what the \
                           others leave, such as `categorical(p, q, 1 - p - q)`";
            return Err(self.wrong(factor, message));
        }
        Ok(Some(Kind::Row(row)))
    }

    fn indirect(&self, factor: FactorId) -> Error {
        let message = "a parameter is learned where it stands alone as an argument, such as `normal(mu[K], sigma)`; \
                       here it is part of an expression";
        self.wrong(factor, message)
    }

    /// What an argument is: a cell that is learned, an expression of some, or a number.
    fn argument(&self, factor: FactorId, id: ExpressionId, numbers: Numbers<'_>) -> Result<Read, Error> {
        if self.unknowns.entries.contains_key(&id) {
            return Ok(Read::Cell(Cell::Entry(id)));
        }
        let uncomputed = || self.wrong(factor, "a number in it cannot be computed from a case");
        match &self.model.expressions[id] {
            Expression::If { condition, then, otherwise } => {
                let chosen = worth(&self.model, *condition, numbers).ok_or_else(uncomputed)?;
                self.argument(factor, if chosen != 0.0 { *then } else { *otherwise }, numbers)
            }
            Expression::Parameter { parameter, indices }
                if self.unknowns.parameters.contains_key(parameter) =>
            {
                let place = place(&self.model, *parameter, indices, numbers).ok_or_else(|| {
                    let name = &self.model.parameters[*parameter].name;
                    self.wrong(factor, format!("the index of `{name}` is not one of its places"))
                })?;
                Ok(Read::Cell(Cell::Place(*parameter, place)))
            }
            _ if self.mentions(id) => Ok(Read::Mixed),
            _ => worth(&self.model, id, numbers).map(Read::Known).ok_or_else(uncomputed),
        }
    }

    /// Whether an expression has something that is learned in it.
    fn mentions(&self, id: ExpressionId) -> bool {
        let mut found = self.unknowns.entries.contains_key(&id);
        each_below(&self.model, id, &mut |expression| {
            if let Expression::Parameter { parameter, .. } = expression {
                found |= self.unknowns.parameters.contains_key(parameter);
            }
        });
        found
    }

    pub(super) fn speaks(&self, form: &Form) -> bool {
        let mut found = false;
        form.each_expression(&mut |id| found |= self.mentions(id));
        found
    }
}
