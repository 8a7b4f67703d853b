//! Distributions to be fitted, and the one to which a case belongs.
//!
//! In: a parametric model. Out: for a factor and a case, the [`Distribution`] and what of it was seen. Invariant:
//! distributions that share all their numbers are one; a number that is learned is a distribution's own, or one of a
//! normal law.

use super::case::{is_value, no_value};
use super::parametric::{MOST_CONTEXTS, Unknowns, parametric};
use super::worth::{Numbers, each_below, place, worth};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, VariableId};
use crate::law::Law;
use crate::model::{Expression, Fit, Form, Model};
use std::collections::HashMap;

/// A number of the model that is learned.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub(super) enum Cell {
    /// An entry of a table.
    Entry(ExpressionId),
    /// A place of a parameter.
    Place(ParameterId, usize),
}

/// A probability of a row.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Share {
    /// One that is learned.
    Learned(Cell),
    /// What the others leave.
    Rest,
}

/// An argument of a law: learned, or the bits of a number that is known.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Argument {
    Learned(Cell),
    Known(u64),
}

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

/// What is fitted at once.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Kind {
    /// A probability for each value.
    Row(Vec<Share>),
    /// A law.
    Law(Law, Vec<Argument>),
    /// Intercept, slopes, deviation.
    Regression(Vec<Cell>),
}

/// One distribution that is fitted.
#[derive(Clone, Debug)]
pub(super) struct Distribution {
    pub(super) kind: Kind,
    /// The factor in which it was met first.
    pub(super) factor: FactorId,
    /// How it is fitted; parameters of `identification` by maximum likelihood.
    pub(super) fit: Option<Fit>,
}

/// What was seen of a distribution.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Seen {
    /// A value, by its position in the row.
    Value(usize),
    Number(f64),
    /// The numbers regressed on, then the one on the left.
    Numbers(Vec<f64>),
}

/// A parametric model and its distributions.
#[derive(Clone, Debug)]
pub(super) struct Learnable {
    pub(super) model: Model,
    pub(super) unknowns: Unknowns,
    /// The factors in which something is learned.
    pub(super) factors: Vec<FactorId>,
    pub(super) distributions: Vec<Distribution>,
    known: HashMap<Kind, usize>,
}

impl Learnable {
    pub(super) fn new(model: &Model) -> Result<Self, Error> {
        if model.plate.is_some() || model.variables.values().any(|variable| variable.family.is_some()) {
            let message =
                "plates and families of variables are not learned from cases; write each variable out";
            return Err(Error::input(&model.name, message));
        }
        let mut model = model.clone();
        let unknowns = parametric(&mut model)?;
        let mut learnable =
            Self { model, unknowns, factors: Vec::new(), distributions: Vec::new(), known: HashMap::new() };
        let model = &learnable.model;
        let factors: Vec<FactorId> =
            model.factors.ids().filter(|id| learnable.speaks(&model.factors[*id].form)).collect();
        if factors.is_empty() {
            let message =
                "nothing is to be learned: no form is `unknown`, and `identification` names no parameter";
            return Err(Error::input(&model.name, message));
        }
        learnable.factors = factors;
        for factor in learnable.factors.clone() {
            learnable.contexts(factor)?;
        }
        Ok(learnable)
    }

    /// The variables of a factor, left first.
    pub(super) fn family(&self, factor: FactorId) -> Vec<VariableId> {
        let factor = &self.model.factors[factor];
        factor.left.iter().chain(&factor.right).map(|use_| use_.variable).collect()
    }

    /// Finds the distributions of a factor for all values of what is on the right, where these can be listed.
    fn contexts(&mut self, factor: FactorId) -> Result<(), Error> {
        let right: Vec<VariableId> =
            self.model.factors[factor].right.iter().map(|use_| use_.variable).collect();
        let counts: Option<Vec<usize>> =
            right.iter().map(|variable| self.model.variables[*variable].domain.count()).collect();
        let Some(counts) = counts else { return Ok(()) };
        let total = counts.iter().try_fold(1usize, |total, count| total.checked_mul(*count));
        let Some(total) = total.filter(|total| *total <= MOST_CONTEXTS) else { return Ok(()) };
        for position in 0..total {
            let mut rest = position;
            let mut numbers = HashMap::new();
            for (variable, count) in right.iter().zip(&counts).rev() {
                numbers.insert(*variable, self.model.variables[*variable].domain.number(rest % count));
                rest /= count;
            }
            self.find(factor, &|variable| numbers.get(&variable).copied())?;
        }
        Ok(())
    }

    /// The distribution of a factor for these numbers, and what was seen of it; nothing where what holds is known.
    pub(super) fn locate(
        &mut self,
        factor: FactorId,
        numbers: Numbers<'_>,
    ) -> Result<Option<(usize, Seen)>, Error> {
        let Some(position) = self.find(factor, numbers)? else { return Ok(None) };
        let missing = || self.wrong(factor, "a value is missing");
        let left: Vec<VariableId> =
            self.model.factors[factor].left.iter().map(|use_| use_.variable).collect();
        let seen = match &self.distributions[position].kind {
            Kind::Row(_) => {
                let mut column = 0;
                for variable in &left {
                    let domain = &self.model.variables[*variable].domain;
                    let ordinal = numbers(*variable).and_then(|number| domain.ordinal_at(number));
                    column = column * domain.count().unwrap_or(1) + ordinal.ok_or_else(missing)?;
                }
                Seen::Value(column)
            }
            Kind::Law(..) => Seen::Number(numbers(left[0]).ok_or_else(missing)?),
            Kind::Regression(_) => {
                let factor_right = &self.model.factors[factor].right;
                let mut all = Vec::with_capacity(factor_right.len() + 1);
                for use_ in factor_right {
                    all.push(numbers(use_.variable).ok_or_else(missing)?);
                }
                all.push(numbers(left[0]).ok_or_else(missing)?);
                Seen::Numbers(all)
            }
        };
        Ok(Some((position, seen)))
    }

    fn wrong(&self, factor: FactorId, message: impl Into<String>) -> Error {
        Error::input(self.model.head(&self.model.factors[factor]), message)
    }

    fn find(&mut self, factor: FactorId, numbers: Numbers<'_>) -> Result<Option<usize>, Error> {
        let form = &self.model.factors[factor].form;
        let Some((kind, unknown)) = self.kind(factor, form, numbers)? else { return Ok(None) };
        if let Some(position) = self.known.get(&kind) {
            return Ok(Some(*position));
        }
        let fit = unknown.map(|unknown| self.unknowns.list[unknown].fit.clone());
        self.is_sound(factor, &kind)?;
        self.known.insert(kind.clone(), self.distributions.len());
        self.distributions.push(Distribution { kind, factor, fit });
        Ok(Some(self.distributions.len() - 1))
    }

    /// Which distribution a form is for these numbers.
    fn kind(
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
                let super::parametric::Shape::Regression(parameters) = &self.unknowns.list[unknown].shape
                else {
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

    fn speaks(&self, form: &Form) -> bool {
        let mut found = false;
        form.each_expression(&mut |id| found |= self.mentions(id));
        found
    }

    /// Refuses distributions whose maximum has no form here.
    fn is_sound(&self, factor: FactorId, kind: &Kind) -> Result<(), Error> {
        let cells = cells_of(kind);
        let shared = |cell: &Cell| {
            self.distributions.iter().any(|other| other.kind != *kind && cells_of(&other.kind).contains(cell))
        };
        match kind {
            // Means and deviations of normal laws may be shared or known: each has its own equation.
            Kind::Law(Law::Normal, _) => Ok(()),
            Kind::Law(Law::Binomial, arguments) if matches!(arguments[0], Argument::Learned(_)) => {
                Err(self.wrong(factor, "the number of trials of `binomial` is not learned; write it"))
            }
            Kind::Law(law, arguments)
                if *law != Law::Binomial
                    && arguments.iter().any(|argument| matches!(argument, Argument::Known(_))) =>
            {
                let name = law.name();
                Err(self.wrong(factor, format!("`{name}` is learned whole: all its arguments or none")))
            }
            _ if cells.iter().any(shared) => {
                Err(self.wrong(factor, "a parameter that is learned stands in two different distributions"))
            }
            _ => Ok(()),
        }
    }

    /// Checks that the numbers of a case are values of their variables.
    pub(super) fn check(&self, case: &super::Case) -> Result<(), Error> {
        for (id, variable) in self.model.variables.iter() {
            if let Some(number) = case.number(id)
                && !is_value(&variable.domain, number)
            {
                let name = self.model.variable_name(id);
                return Err(Error::input(name, format!("{number} is {}", no_value(&self.model, id))));
            }
        }
        Ok(())
    }

    /// The number in a cell.
    pub(super) fn number(&self, cell: Cell) -> Option<f64> {
        match cell {
            Cell::Entry(id) => self.model.constant(id),
            Cell::Place(parameter, place) => match self.model.parameters[parameter].default.as_slice() {
                [number] => Some(*number),
                several => several.get(place).copied(),
            },
        }
    }

    /// Puts a number into a cell.
    pub(super) fn set(&mut self, cell: Cell, number: f64) {
        match cell {
            Cell::Entry(id) => self.model.expressions[id] = Expression::Number(number),
            Cell::Place(parameter, place) => {
                let places = super::worth::places(&self.model, parameter).unwrap_or(1);
                let default = &mut self.model.parameters[parameter].default;
                if default.len() != places {
                    // One number for all places, or none at all.
                    let all = default.first().copied().unwrap_or(1.0);
                    *default = vec![all; places];
                }
                default[place] = number;
            }
        }
    }

    /// The parameters of a law as they are now.
    pub(super) fn arguments(&self, arguments: &[Argument]) -> Option<Vec<f64>> {
        (arguments.iter())
            .map(|argument| match argument {
                Argument::Learned(cell) => self.number(*cell),
                Argument::Known(bits) => Some(f64::from_bits(*bits)),
            })
            .collect()
    }

    /// The name of a factor.
    pub(super) fn head(&self, factor: FactorId) -> String {
        self.model.head(&self.model.factors[factor])
    }

    /// The position of a factor among those in which something is learned.
    pub(super) fn rank(&self, factor: FactorId) -> usize {
        self.factors.iter().position(|known| *known == factor).unwrap_or(factor.position())
    }
}

/// The numbers that a distribution learns.
pub(super) fn cells_of(kind: &Kind) -> Vec<Cell> {
    match kind {
        Kind::Row(row) => row
            .iter()
            .filter_map(|share| match share {
                Share::Learned(cell) => Some(*cell),
                Share::Rest => None,
            })
            .collect(),
        Kind::Law(_, arguments) => arguments
            .iter()
            .filter_map(|argument| match argument {
                Argument::Learned(cell) => Some(*cell),
                Argument::Known(_) => None,
            })
            .collect(),
        Kind::Regression(cells) => cells.clone(),
    }
}
