//! The values that an expression of finite variables can take.
//!
//! In: an expression. Out: its values, and a domain of them. Invariant: where two operands read nothing in common, their values are
//! combined; else all combinations of the variables read are gone through. No value that can be taken is missing.

use super::{Domain, Expression, Model, VariableUse};
use crate::bins::Bins;
use crate::ids::{ExpressionId, VariableId};
use crate::radix;
use std::collections::BTreeSet;

/// The most combinations of values that are looked through.
const MOST_COMBINATIONS: usize = 1 << 16;

/// The largest whole number that a function may be as an integer.
const LARGEST: f64 = 1e9;

/// Integers are a range where at least one in so many of them is taken.
const SPARSE: f64 = 4.0;

/// Values that differ by at most this share are one value, rounded.
const ROUNDING: f64 = 1e-12;

/// The variables and elements of families that a node reads; `None` where they are not known.
pub(super) type Reads = Option<BTreeSet<(VariableId, Option<i64>)>>;

impl Domain {
    /// The domain of these numbers: a range of integers, or the numbers themselves. `None` if there are none, or too many.
    pub fn of_numbers(mut numbers: Vec<f64>) -> Option<Self> {
        numbers.retain(|number| number.is_finite());
        let (low, high) = (*numbers.first()?, *numbers.last()?);
        let whole = numbers.iter().all(|number| number.fract() == 0.0 && number.abs() < LARGEST);
        match whole && high - low + 1.0 <= SPARSE * numbers.len() as f64 {
            true => Some(Domain::integers(low as i64, high as i64)),
            false => Bins::of_values(numbers).map(Domain::Bins),
        }
    }
}

impl Model {
    /// The variables that each node of an expression reads.
    pub(super) fn reads(&self, root: ExpressionId) -> super::Folded<Reads> {
        self.fold(root, |expression, below| {
            let mut all = match expression {
                Expression::Variable(use_) => BTreeSet::from([self.read(use_)?]),
                Expression::First { .. } => return None,
                _ => BTreeSet::new(),
            };
            let mut known = true;
            if !matches!(expression, Expression::Variable(_)) {
                expression.each_operand(&mut |operand| match below.of(operand) {
                    Some(own) => all.extend(own),
                    None => known = false,
                });
            }
            known.then_some(all)
        })
    }

    /// A variable, or an element whose index is known.
    pub(super) fn read(&self, use_: &VariableUse) -> Option<(VariableId, Option<i64>)> {
        match use_.element {
            None => self.variables[use_.variable].family.is_none().then_some((use_.variable, None)),
            Some(element) => Some((use_.variable, Some(self.constant(element)? as i64))),
        }
    }

    /// The number of combinations of values of the variables read; `None` if it is not known, or too large to count.
    pub(super) fn combinations(&self, reads: &Reads) -> Option<usize> {
        let counts = reads.as_ref()?.iter().map(|(variable, _)| self.variables[*variable].domain.count());
        counts.into_iter().try_fold(1usize, |all, count| all.checked_mul(count?))
    }

    /// The values of an expression, ascending; `None` where they are not known without parameters or sizes, or are too many.
    pub fn values_of(&self, root: ExpressionId) -> Option<Vec<f64>> {
        self.values_among(root, &self.reads(root))
    }

    pub(super) fn values_among(&self, root: ExpressionId, reads: &super::Folded<Reads>) -> Option<Vec<f64>> {
        let apart = |one: &ExpressionId, other: &ExpressionId| match (reads.of(*one), reads.of(*other)) {
            (Some(one), Some(other)) => one.is_disjoint(other),
            _ => false,
        };
        let of = |id: &ExpressionId| self.values_among(*id, reads);
        match &self.expressions[root] {
            Expression::Number(number) => Some(vec![*number]),
            Expression::Variable(use_) => {
                let domain = &self.variables[use_.variable].domain;
                let count = domain.count().filter(|count| *count <= MOST_COMBINATIONS)?;
                Some(distinct((0..count).map(|value| domain.number(value)).collect()))
            }
            Expression::First { family, with: None } => {
                let family = self.variables[*family].family?;
                let count = self.index_count(&family.over).filter(|count| *count < MOST_COMBINATIONS)?;
                // One past the last element, if none is true.
                Some((0..=count).map(|at| (family.over.first() + at as i64) as f64).collect())
            }
            Expression::Unary(operator, operand) => {
                Some(distinct(of(operand)?.into_iter().map(|value| operator.apply(value)).collect()))
            }
            Expression::Binary(operator, left, right) if apart(left, right) => {
                let (left, right) = (of(left)?, of(right)?);
                let few = left.len().checked_mul(right.len()).is_some_and(|all| all <= MOST_COMBINATIONS);
                let pairs =
                    left.iter().flat_map(|one| right.iter().map(|other| operator.apply(*one, *other)));
                few.then(|| distinct(pairs.collect()))
            }
            _ => self.values_one_by_one(root, reads.of(root)),
        }
    }

    /// The values of an expression for each combination of the variables that it reads.
    fn values_one_by_one(&self, root: ExpressionId, reads: &Reads) -> Option<Vec<f64>> {
        let total = self.combinations(reads).filter(|total| *total <= MOST_COMBINATIONS)?;
        let all: Vec<(VariableId, Option<i64>)> = reads.iter().flatten().copied().collect();
        let count = |(variable, _): &(VariableId, Option<i64>)| self.variables[*variable].domain.count();
        let counts: Vec<usize> = all.iter().map(count).collect::<Option<_>>()?;
        let mut found = Vec::with_capacity(total);
        for combination in 0..total {
            let value = |use_: &VariableUse| {
                let own = self.read(use_)?;
                let mut ordinals = all.iter().zip(radix::ordinals(combination, counts.iter().copied()));
                let (_, ordinal) = ordinals.find(|(other, _)| **other == own)?;
                Some(self.variables[own.0].domain.number(ordinal))
            };
            found.push(self.evaluate_uses(root, &value)?);
        }
        Some(distinct(found))
    }
}

/// Numbers in ascending order, each once.
fn distinct(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.iter_mut().for_each(|number| *number += 0.0);
    numbers.sort_by(f64::total_cmp);
    numbers.dedup_by(|next, last| {
        *next == *last
            || next.is_nan() && last.is_nan()
            || next.is_finite()
                && last.is_finite()
                && (*next - *last).abs() <= ROUNDING * next.abs().max(last.abs())
    });
    numbers
}
