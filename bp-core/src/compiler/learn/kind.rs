//! The distribution of a form in a case.
//!
//! In: a family, and the values of the slots that it reads. Out: the [`Kind`] of distribution and its learned cells.
//! Invariant: nothing if all of it is known; a learned parameter without an equation here is refused.

use super::distribution::{Argument, Cell, Kind, Share};
use super::parametric::Shape;
use super::program::Program;
use crate::distribution::{Instance, Setting};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId};
use crate::law::Law;
use crate::model::{Expression, Form, VariableUse};
use crate::operators::{Binary, Unary};
use crate::radix;
use std::fmt::{self, Display, Formatter};

/// A family in a case.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub(super) program: &'a Program,
    pub(super) setting: &'a Setting<'a>,
    pub(super) instance: &'a Instance,
    /// Ordinals of finite variables, reals as they are.
    pub(super) values: &'a [f64],
}

/// The value of a numeric expression.
#[derive(Clone, Copy, Debug)]
enum Read {
    /// A learned cell.
    Cell(Cell),
    /// An expression of learned cells.
    Mixed,
    /// A known number.
    Known(f64),
}

/// What else estimates a parameter.
pub(super) const INSTEAD: Instead = Instead;

/// The advice of [`INSTEAD`], in the words of the door.
pub(super) struct Instead;

impl Display for Instead {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "declare it as a variable with a prior, and ask for its posterior: `{}`", Advice::AskRows)
    }
}

/// For each value of a row, its place among the shares; none where its probability is 0.
pub(super) type Places = Vec<Option<usize>>;

/// A kind of distribution.
pub(super) struct Found {
    pub(super) kind: Kind,
    /// Its `unknown` form.
    pub(super) unknown: Option<usize>,
    /// Of a row; empty of other kinds.
    pub(super) places: Places,
}

impl Found {
    fn of(kind: Kind, unknown: Option<usize>) -> Option<Self> {
        Some(Self { kind, unknown, places: Vec::new() })
    }

    /// A row in the order that all rows of the same numbers have: what the others leave first, then cell by cell. So
    /// `categorical(p, 1 - p, 0)` and `bernoulli(p)` are one distribution, and share their counts.
    fn of_row(row: &[Option<Share>], unknown: Option<usize>) -> Option<Self> {
        let mut shares: Vec<Share> = row.iter().flatten().copied().collect();
        shares.sort_unstable_by_key(|share| match share {
            Share::Rest => None,
            Share::Learned(cell) => Some(*cell),
        });
        let place = |share: Share| shares.iter().position(|own| *own == share);
        let places = row.iter().map(|share| share.and_then(place)).collect();
        Some(Self { kind: Kind::Row(shares), unknown, places })
    }
}

impl At<'_> {
    /// The distribution of the family.
    pub(super) fn kind(&self) -> Result<Option<Found>, Error> {
        self.of_form(&self.program.model.factors[self.factor()].form)
    }

    fn factor(&self) -> FactorId {
        self.instance.factor
    }

    fn wrong(&self, message: &str) -> Error {
        self.program.wrong(self.factor(), message)
    }

    fn number(&self, id: ExpressionId) -> Option<f64> {
        Some(self.setting.expression(id, self.instance, self.values)).filter(|number| !number.is_nan())
    }

    fn of_form(&self, form: &Form) -> Result<Option<Found>, Error> {
        let (program, model) = (self.program, &self.program.model);
        if !program.is_learned(form) {
            return Ok(None);
        }
        match form {
            Form::If { condition, then, otherwise } => {
                let chosen = self.condition(*condition)?;
                self.of_form(if chosen { then } else { otherwise })
            }
            Form::Previous { at: None, otherwise, .. } => self.of_form(otherwise),
            Form::Bernoulli(chance, _) => match self.argument(*chance)? {
                Read::Cell(cell) => Ok(Found::of_row(&[Some(Share::Rest), Some(Share::Learned(cell))], None)),
                Read::Mixed => match self.complement(*chance)?.as_deref() {
                    Some([cell]) => {
                        Ok(Found::of_row(&[Some(Share::Learned(*cell)), Some(Share::Rest)], None))
                    }
                    _ => Err(self.indirect()),
                },
                Read::Known(_) => Ok(None),
            },
            Form::Categorical(entries) => self.row(entries),
            Form::Table(rows) => {
                let digit = |use_: &VariableUse| {
                    let ordinal = self.setting.value_used(use_, self.instance, self.values);
                    (ordinal.max(0.0) as usize, self.setting.count(use_.variable))
                };
                let position = radix::position(model.factors[self.factor()].right.iter().map(digit));
                self.row(rows.get(position).ok_or_else(|| self.wrong("its table has too few rows"))?)
            }
            Form::Law { law: Law::Normal, arguments }
                if program.unknowns.regressions.contains_key(&arguments[0]) =>
            {
                let unknown = program.unknowns.regressions[&arguments[0]];
                let Shape::Regression(parameters) = &program.unknowns.list[unknown].shape else {
                    return Ok(None);
                };
                let Read::Cell(Cell::Place(_, place)) = self.argument(arguments[1])? else {
                    return Ok(None);
                };
                let cells = parameters.iter().map(|parameter| Cell::Place(*parameter, place)).collect();
                Ok(Found::of(Kind::Regression(cells), Some(unknown)))
            }
            Form::Law { law, arguments } => self.law(*law, arguments),
            other => {
                let name = match other {
                    Form::Mixture(_) => "`mixture` or `zero_inflated`".to_owned(),
                    other => format!("`{}`", other.name()),
                };
                Err(self.wrong(&format!(
                    "a parameter inside {name} is not learned from counts or moments; {INSTEAD}"
                )))
            }
        }
    }

    /// Whether a condition holds.
    fn condition(&self, condition: ExpressionId) -> Result<bool, Error> {
        if self.program.mentions(condition) {
            return Err(self.wrong("a parameter in a condition cannot be learned"));
        }
        let chosen = self.number(condition);
        Ok(chosen.ok_or_else(|| self.wrong("its condition cannot be computed from a case"))? != 0.0)
    }

    fn law(&self, law: Law, written: &[ExpressionId]) -> Result<Option<Found>, Error> {
        let (mut arguments, mut unknown) = (Vec::new(), None);
        for argument in written {
            arguments.push(match self.argument(*argument)? {
                Read::Cell(cell) => {
                    if let Cell::Place(parameter, _) = cell {
                        unknown = unknown.or(self.program.unknowns.parameters[&parameter]);
                    }
                    Argument::Learned(cell)
                }
                Read::Mixed => return Err(self.indirect()),
                Read::Known(number) => Argument::Known(number.to_bits()),
            });
        }
        if arguments.iter().all(|argument| matches!(argument, Argument::Known(_))) {
            return Ok(None);
        }
        Ok(Found::of(Kind::Law(law, arguments), unknown))
    }

    fn row(&self, entries: &[ExpressionId]) -> Result<Option<Found>, Error> {
        let shares: Vec<Read> =
            entries.iter().map(|entry| self.argument(*entry)).collect::<Result<_, _>>()?;
        if shares.iter().all(|share| matches!(share, Read::Known(_))) {
            return Ok(None);
        }
        let row = shares.iter().map(|share| match share {
            Read::Cell(cell) => Some(Share::Learned(*cell)),
            Read::Mixed => Some(Share::Rest),
            Read::Known(_) => None,
        });
        let row: Vec<Option<Share>> = row.collect();
        let rests = row.iter().filter(|share| **share == Some(Share::Rest)).count();
        let known = shares.iter().any(|share| matches!(share, Read::Known(number) if *number != 0.0));
        if rests > 1 || known {
            let message = "a row is learned whole: each probability a parameter or 0, but for one that is what the \
                           others leave, such as `categorical(p, q, 1 - p - q)`";
            return Err(self.wrong(message));
        }
        if let Some(rest) = row.iter().position(|share| *share == Some(Share::Rest)) {
            let mut cells: Vec<Cell> = (row.iter().flatten())
                .filter_map(|share| if let Share::Learned(cell) = share { Some(*cell) } else { None })
                .collect();
            cells.sort_unstable();
            if self.complement(entries[rest])? != Some(cells) {
                return Err(
                    self.wrong("a probability of a row is neither a parameter nor one minus the others")
                );
            }
        }
        let unknowns = &self.program.unknowns;
        let unknown = entries.iter().find_map(|entry| match &self.program.model.expressions[*entry] {
            Expression::Parameter { parameter, .. } => unknowns.parameters.get(parameter).copied().flatten(),
            _ => unknowns.entries.get(entry).copied(),
        });
        Ok(Found::of_row(&row, unknown))
    }

    /// The cells of an expression that is one minus each of them, in order.
    fn complement(&self, id: ExpressionId) -> Result<Option<Vec<Cell>>, Error> {
        let (mut constant, mut cells) = (0.0, Vec::new());
        let mut waiting = vec![(id, 1.0)];
        while let Some((id, sign)) = waiting.pop() {
            match &self.program.model.expressions[id] {
                Expression::Binary(operator @ (Binary::Add | Binary::Subtract), left, right) => {
                    let right_sign = if *operator == Binary::Add { sign } else { -sign };
                    waiting.extend([(*left, sign), (*right, right_sign)]);
                }
                Expression::Unary(Unary::Negate, operand) => waiting.push((*operand, -sign)),
                Expression::If { condition, then, otherwise } => {
                    waiting.push((if self.condition(*condition)? { *then } else { *otherwise }, sign));
                }
                _ => match self.argument(id)? {
                    Read::Cell(cell) if sign < 0.0 => cells.push(cell),
                    Read::Known(number) => constant += sign * number,
                    _ => return Ok(None),
                },
            }
        }
        cells.sort_unstable();
        Ok((constant == 1.0).then_some(cells))
    }

    fn indirect(&self) -> Error {
        self.wrong(&format!(
            "a parameter is learned where it stands alone as an argument, such as `normal(mu[K], sigma)`; here it \
             is part of an expression; {INSTEAD}"
        ))
    }

    /// The kind of an argument: a learned cell, an expression of some, or a number.
    fn argument(&self, id: ExpressionId) -> Result<Read, Error> {
        let unknowns = &self.program.unknowns;
        if unknowns.entries.contains_key(&id) {
            return Ok(Read::Cell(Cell::Entry(id)));
        }
        match &self.program.model.expressions[id] {
            Expression::If { condition, then, otherwise } => {
                self.argument(if self.condition(*condition)? { *then } else { *otherwise })
            }
            Expression::Parameter { parameter, indices } if unknowns.parameters.contains_key(parameter) => {
                let place = self.setting.place(*parameter, indices, self.instance, self.values);
                let place = place.ok_or_else(|| {
                    let name = &self.program.model.parameters[*parameter].name;
                    self.wrong(&format!("the index of `{name}` is out of range"))
                })?;
                Ok(Read::Cell(Cell::Place(*parameter, place)))
            }
            _ if self.program.mentions(id) => Ok(Read::Mixed),
            _ => {
                let number = self.number(id).map(Read::Known);
                number.ok_or_else(|| self.wrong("a number in it cannot be computed from a case"))
            }
        }
    }
}
