//! Distributions to be fitted, and the one to which a case belongs.
//!
//! In: a parametric model. Out: for a factor and a case, the [`Distribution`] and what of it was seen. Invariant:
//! distributions that share all their numbers are one; a number that is learned is a distribution's own, or one of a
//! normal law.

use super::case::{is_value, no_value};
use super::parametric::{MOST_CONTEXTS, Unknowns, parametric};
use super::worth::Numbers;
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, VariableId};
use crate::law::Law;
use crate::model::{Expression, Fit, Model};
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

    pub(super) fn wrong(&self, factor: FactorId, message: impl Into<String>) -> Error {
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
