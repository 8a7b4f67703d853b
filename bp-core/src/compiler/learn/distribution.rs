//! The distributions to be fitted, and the assignment of cases to them.
//!
//! In: a program. Out: for a family and a case, the [`Distribution`] and its observation. Invariant: distributions that
//! share all their numbers are the same, in any family: so elements of a family of variables and of a plate share their
//! cases; a learned number belongs to one distribution, except those of normal distributions.

use super::kind::{At, Found, INSTEAD, Places};
use super::parametric::MOST_CONTEXTS;
use super::program::{Family, Program};
use super::statistics::Statistic;
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::{ExpressionId, FactorId, ParameterId};
use crate::law::Law;
use crate::model::{Domain, Expression, Fit, Model};
use crate::radix;
use std::collections::HashMap;

/// A learned number of the model.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub(super) enum Cell {
    /// An entry of a table.
    Entry(ExpressionId),
    /// An element of a parameter.
    Place(ParameterId, usize),
}

/// A probability of a row.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Share {
    /// A learned probability.
    Learned(Cell),
    /// One minus the others.
    Rest,
}

/// An argument of a distribution: learned, or the bits of a known number.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Argument {
    Learned(Cell),
    Known(u64),
}

/// The parameters that are fitted together.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Kind {
    /// A probability for each value.
    Row(Vec<Share>),
    /// A parametric distribution.
    Law(Law, Vec<Argument>),
    /// Intercept, slopes, deviation.
    Regression(Vec<Cell>),
}

/// One fitted distribution.
#[derive(Clone, Debug)]
pub(super) struct Distribution {
    pub(super) kind: Kind,
    /// The factor in which it occurs first.
    pub(super) factor: FactorId,
    /// The estimator; parameters of `identification` by maximum likelihood.
    pub(super) fit: Option<Fit>,
}

/// An observation of a distribution.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Seen {
    /// A value, as its position in the row.
    Value(usize),
    Number(f64),
    /// The regressors, then the left-hand number.
    Numbers(Vec<f64>),
}

/// A program and its distributions.
#[derive(Clone, Debug)]
pub(super) struct Learnable {
    pub(super) program: Program,
    catalogue: Catalogue,
}

/// The distributions found so far.
#[derive(Clone, Debug, Default)]
struct Catalogue {
    distributions: Vec<Distribution>,
    known: HashMap<Kind, usize>,
    /// The first distribution that has a cell.
    owner: HashMap<Cell, usize>,
}

impl Learnable {
    pub(super) fn new(model: &Model, given: &Inputs<'_, f64>) -> Result<Self, Error> {
        let program = Program::new(model, given)?;
        let mut catalogue = Catalogue::default();
        let mut finder = Finder { setting: program.setting()?, program: &program, catalogue: &mut catalogue };
        for family in program.families.iter().filter(|family| family.learned) {
            finder.contexts(family, &mut |_, _| {})?;
        }
        Ok(Self { program, catalogue })
    }

    /// Finds the distribution of a family in a case.
    pub(super) fn finder(&mut self) -> Result<Finder<'_>, Error> {
        let Self { program, catalogue } = self;
        Ok(Finder { setting: program.setting()?, program, catalogue })
    }

    /// All distributions, in the order in which they were found.
    pub(super) fn distributions(&self) -> &[Distribution] {
        &self.catalogue.distributions
    }

    /// The context of a distribution: its factor, and the right-hand values.
    pub(super) fn place(&self, position: usize) -> String {
        let distribution = &self.catalogue.distributions[position];
        let head = self.program.head(distribution.factor);
        let mut place = None;
        // A learned number may be unset, and does not identify the context.
        let mut program = self.program.clone();
        for id in self.program.unknowns.parameters.keys() {
            program.model.parameters[*id].default.fill(1.0);
        }
        if let Ok(setting) = program.setting() {
            let mut catalogue = Catalogue::default();
            let mut finder = Finder { setting, program: &program, catalogue: &mut catalogue };
            let families = program.families.iter();
            for family in families.filter(|family| family.instance.factor == distribution.factor) {
                let _ = finder.contexts(family, &mut |kind, values| {
                    if *kind == distribution.kind && place.is_none() {
                        place = Some(self.context(family, values));
                    }
                });
            }
        }
        match place.filter(|place| !place.is_empty()) {
            Some(place) => format!("{head}, {place}"),
            None => head,
        }
    }

    /// The values that a family depends on: `K = b, C = 2`.
    fn context(&self, family: &Family, values: &[f64]) -> String {
        let right = family.slots.iter().filter(|slot| !family.instance.left.contains(slot));
        let shown = right.map(|slot| {
            let value = self.program.spelled(*slot, values[*slot]);
            format!("{} = {value}", self.program.slots[*slot].name)
        });
        shown.collect::<Vec<_>>().join(", ")
    }

    /// The domain of the left-hand variable of a distribution.
    pub(super) fn domain(&self, distribution: &Distribution) -> &Domain {
        let left = self.program.model.factors[distribution.factor].left[0].variable;
        &self.program.model.variables[left].domain
    }

    /// Its number of values; `None` for reals.
    pub(super) fn count(&self, distribution: &Distribution) -> Option<usize> {
        let left = self.program.model.factors[distribution.factor].left[0].variable;
        self.program.slots.iter().find(|slot| slot.variable == left).and_then(|slot| slot.count)
    }

    /// The number in a cell.
    pub(super) fn number(&self, cell: Cell) -> f64 {
        match cell {
            Cell::Entry(id) => self.program.model.constant(id).unwrap_or(f64::NAN),
            Cell::Place(parameter, place) => self.program.model.parameters[parameter].default[place],
        }
    }

    /// Whether a cell had a number before learning.
    pub(super) fn is_declared(&self, cell: Cell) -> bool {
        matches!(cell, Cell::Place(parameter, _) if self.program.declared.contains(&parameter))
    }

    /// Sets the number in a cell.
    pub(super) fn set(&mut self, cell: Cell, number: f64) {
        match cell {
            Cell::Entry(id) => self.program.model.expressions[id] = Expression::Number(number),
            Cell::Place(parameter, place) => self.program.model.parameters[parameter].default[place] = number,
        }
    }

    /// The current parameters of a distribution.
    pub(super) fn arguments(&self, arguments: &[Argument]) -> Vec<f64> {
        (arguments.iter())
            .map(|argument| match argument {
                Argument::Learned(cell) => self.number(*cell),
                Argument::Known(bits) => f64::from_bits(*bits),
            })
            .collect()
    }

    /// The position of a factor among those with learned numbers.
    pub(super) fn rank(&self, factor: FactorId) -> usize {
        let factors = &self.program.factors;
        factors.iter().position(|known| *known == factor).unwrap_or_default()
    }
}

/// Finds and stores distributions.
pub(super) struct Finder<'p> {
    pub(super) setting: Setting<'p>,
    pub(super) program: &'p Program,
    catalogue: &'p mut Catalogue,
}

impl Finder<'_> {
    /// Finds the distributions of a family for all right-hand values, if these are finite.
    fn contexts(&mut self, family: &Family, visit: &mut dyn FnMut(&Kind, &[f64])) -> Result<(), Error> {
        let right = family.slots.iter().filter(|slot| !family.instance.left.contains(slot)).copied();
        let right: Vec<usize> = right.collect();
        let counts: Option<Vec<usize>> = right.iter().map(|slot| self.program.slots[*slot].count).collect();
        let Some(counts) = counts else { return Ok(()) };
        let total = counts.iter().try_fold(1usize, |total, count| total.checked_mul(*count));
        let Some(total) = total.filter(|total| *total <= MOST_CONTEXTS) else { return Ok(()) };
        let mut values = vec![0.0; self.program.slots.len()];
        for position in 0..total {
            let ordinals = radix::ordinals(position, counts.iter().rev().copied());
            for (slot, ordinal) in right.iter().rev().zip(ordinals) {
                values[*slot] = ordinal as f64;
            }
            if let Some((found, _)) = self.find(family, &values)? {
                visit(&self.catalogue.distributions[found].kind, &values);
            }
        }
        Ok(())
    }

    /// The distribution of a family for values of its slots, with the observation; nothing if it is known. `numbers`
    /// are those in the data: for a bin not its centre.
    pub(super) fn locate(
        &mut self,
        family: &Family,
        values: &[f64],
        numbers: &[f64],
    ) -> Result<Option<(usize, Seen)>, Error> {
        let Some((position, places)) = self.find(family, values)? else { return Ok(None) };
        let left = family.instance.left[0];
        let seen = match &self.catalogue.distributions[position].kind {
            Kind::Row(_) => {
                let value = self.setting.left_value(&family.instance, values) as usize;
                // A value of probability 0 has no share.
                let Some(place) = places.get(value).copied().flatten() else { return Ok(None) };
                Seen::Value(place)
            }
            Kind::Law(..) => Seen::Number(numbers[left]),
            Kind::Regression(_) => {
                let right = &self.program.model.factors[family.instance.factor].right;
                let on = right.iter().map(|use_| self.setting.value_used(use_, &family.instance, numbers));
                Seen::Numbers(on.chain([numbers[left]]).collect())
            }
        };
        Ok(Some((position, seen)))
    }

    /// Adds an empty statistic for each distribution found.
    pub(super) fn grow(&self, statistics: &mut Vec<Statistic>) {
        let new = self.catalogue.distributions.iter().skip(statistics.len());
        statistics.extend(new.map(|it| Statistic::of(&it.kind)));
    }

    /// The position of the distribution, and the places of the values in its row.
    fn find(&mut self, family: &Family, values: &[f64]) -> Result<Option<(usize, Places)>, Error> {
        let (program, setting) = (self.program, &self.setting);
        let at = At { program, setting, instance: &family.instance, values };
        let Some(Found { kind, unknown, places }) = at.kind()? else { return Ok(None) };
        if let Some(position) = self.catalogue.known.get(&kind) {
            return Ok(Some((*position, places)));
        }
        let (factor, fit) = (family.instance.factor, unknown.map(|it| program.unknowns.list[it].fit.clone()));
        self.is_sound(factor, &kind)?;
        let position = self.catalogue.distributions.len();
        self.catalogue.known.insert(kind.clone(), position);
        self.catalogue.distributions.push(Distribution { kind, factor, fit });
        Ok(Some((position, places)))
    }

    /// Refuses distributions whose maximum cannot be computed here.
    fn is_sound(&mut self, factor: FactorId, kind: &Kind) -> Result<(), Error> {
        let cells = cells_of(kind);
        let Catalogue { distributions, owner, .. } = &mut *self.catalogue;
        let position = distributions.len();
        let shared = cells.iter().any(|cell| *owner.entry(*cell).or_insert(position) != position);
        let wrong = |message: String| Err(self.program.wrong(factor, message));
        match kind {
            // Means and deviations of normal distributions may be shared or known: each has its own equation.
            Kind::Law(Law::Normal, _) => Ok(()),
            Kind::Law(Law::Binomial, arguments) if matches!(arguments[0], Argument::Learned(_)) => {
                wrong("the number of trials of `binomial` is not learned; write it".to_owned())
            }
            Kind::Law(law, arguments)
                if *law != Law::Binomial
                    && arguments.iter().any(|argument| matches!(argument, Argument::Known(_))) =>
            {
                let name = law.name();
                wrong(format!(
                    "`{name}` is fitted in all of its arguments together, and one is known here; {INSTEAD}"
                ))
            }
            _ if shared => wrong(format!(
                "a parameter is shared by several distributions, each of which is fitted alone (only those of `normal` are \
                 fitted together); {INSTEAD}"
            )),
            _ => Ok(()),
        }
    }
}

/// The learned numbers of a distribution.
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
