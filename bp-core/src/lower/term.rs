//! Terms of a plan, as values of a kernel.
//!
//! In: a term. Out: a value. Invariant: a sum of a handful of products without inner sums is written out; any
//! other becomes a nest of its own, over the axes on which it depends.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{AxisId, TermId, ValueId, VariableId};
use crate::kernel::Fold;
use crate::operators::Binary;
use crate::plan::{Binding, Term};

/// The longest sum that is written out.
const WRITTEN_OUT: usize = 4;

impl Lowering<'_> {
    pub(super) fn term(&mut self, id: TermId) -> Result<ValueId, Error> {
        match self.exact.terms[id].clone() {
            Term::Joint => unreachable!("internal: a finished plan has no joint left"),
            Term::Factor(factor) => self.factor(factor),
            Term::Likelihood(variable, weights) => {
                let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else {
                    return Err(self.unplanned("virtual evidence is on a finite variable"));
                };
                let mut chosen = self.builder.constant(*weights.last().expect("internal: checked evidence"));
                for (position, weight) in weights.iter().enumerate().rev().skip(1) {
                    let (position, weight) =
                        (self.builder.constant(position as f64), self.builder.constant(*weight));
                    let here = self.builder.binary(Binary::Equal, ordinal, position);
                    chosen = self.builder.select(here, weight, chosen);
                }
                Ok(chosen)
            }
            Term::Inside(variable) => {
                let (inside, holds) = self.inside(variable)?;
                Ok(self.only_if(holds, inside))
            }
            Term::Possible(factor) => {
                // What is NaN stays so.
                let (value, zero) = (self.factor(factor)?, self.builder.constant(0.0));
                let (one, positive) =
                    (self.builder.constant(1.0), self.builder.binary(Binary::Greater, value, zero));
                Ok(self.builder.select(positive, one, value))
            }
            Term::Product(factors) => {
                // What lies outside its domain is 0 whatever the other factors are there: they may be undefined.
                let is_guard = |id: &TermId| matches!(self.exact.terms[*id], Term::Inside(_));
                let (guards, factors): (Vec<_>, Vec<_>) = factors.into_iter().partition(is_guard);
                let mut product = self.builder.constant(1.0);
                for factor in factors {
                    let factor = self.term(factor)?;
                    product = self.builder.binary(Binary::Multiply, product, factor);
                }
                let zero = self.builder.constant(0.0);
                for guard in guards {
                    let Term::Inside(variable) = self.exact.terms[guard] else { continue };
                    let (inside, holds) = self.inside(variable)?;
                    product = self.builder.select(inside, product, zero);
                    product = self.only_if(holds, product);
                }
                Ok(product)
            }
            Term::Sum(over, body) => match over.as_slice() {
                [one] if self.is_short(*one, body) => self.written_out(*one, body),
                several => {
                    let mut axes: Vec<AxisId> = Vec::new();
                    for variable in several {
                        axes.extend(self.run_through(*variable));
                    }
                    let value = self.term(body)?;
                    several.iter().for_each(|variable| self.stop(*variable));
                    Ok(self.fold_over("sum", Fold::Sum, &axes, value))
                }
            },
            Term::FirstScan(scan) => self.first_scan(&scan),
            Term::Normalise(_, body) => self.term(body),
        }
    }

    pub(super) fn is_short(&self, variable: VariableId, body: TermId) -> bool {
        let declared = &self.model.variables[variable];
        declared.family.is_none()
            && declared.domain.count().is_some_and(|count| count <= WRITTEN_OUT)
            && !self.has_sum(body)
    }

    fn has_sum(&self, id: TermId) -> bool {
        match &self.exact.terms[id] {
            Term::Sum(..) | Term::FirstScan(_) => true,
            Term::Product(factors) => factors.iter().any(|factor| self.has_sum(*factor)),
            Term::Normalise(_, body) => self.has_sum(*body),
            _ => false,
        }
    }

    fn written_out(&mut self, variable: VariableId, body: TermId) -> Result<ValueId, Error> {
        let mut sum = self.builder.constant(0.0);
        for term in self.each_value(variable, |lowering| lowering.term(body))? {
            sum = self.builder.binary(Binary::Add, sum, term);
        }
        Ok(sum)
    }

    /// What stands at each value of a variable.
    pub(super) fn each_value(
        &mut self,
        variable: VariableId,
        mut term: impl FnMut(&mut Self) -> Result<ValueId, Error>,
    ) -> Result<Vec<ValueId>, Error> {
        let count = self.model.variables[variable].domain.count().expect("internal: a short sum has a count");
        let mut terms = Vec::with_capacity(count);
        for ordinal in 0..count {
            let value = self.builder.constant(ordinal as f64);
            self.run(variable, Meaning::Ordinal(value));
            terms.push(term(self)?);
        }
        self.stop(variable);
        Ok(terms)
    }

    /// Whether the value that a variable is bound to lies in its domain, and whether it is a finite number.
    pub(super) fn inside(&mut self, variable: VariableId) -> Result<(ValueId, ValueId), Error> {
        let holds = match self.exact.bindings.get(&variable) {
            Some(Binding::Expression(expression)) => self.is_finite(*expression)?,
            _ => self.builder.constant(1.0),
        };
        let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else {
            return Ok((self.builder.constant(1.0), holds));
        };
        let extent = self.extent(&self.model.variables[variable].domain);
        let (zero, count) = (self.builder.constant(0.0), self.count_of(extent, 0));
        let above = self.builder.binary(Binary::GreaterOrEqual, ordinal, zero);
        let below = self.builder.binary(Binary::Less, ordinal, count);
        let whole = self.builder.unary(crate::operators::Unary::Floor, ordinal);
        let whole = self.builder.binary(Binary::Equal, ordinal, whole);
        let inside = self.builder.binary(Binary::And, above, below);
        Ok((self.builder.binary(Binary::And, inside, whole), holds))
    }
}
