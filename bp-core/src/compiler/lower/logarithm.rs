//! Products in logarithms, for code that is not run again with separate exponents.
//!
//! In: the joint of a plan, and the axes of the searched variables. Out: e^(ln joint − shift), and the shift: the
//! largest logarithm over the searched variables. Invariant: one exponential for each value of the joint; zeros remain
//! 0, since e^−∞ is 0.
//!
//! ln Π pᵢ = Σ ln pᵢ,  ln Σ e^tᵢ = m + ln Σ e^(tᵢ − m) with m = max tᵢ, or 0 where all are −∞.

use super::{Lowering, Meaning};
use crate::equation::{Mark, Term};
use crate::error::Error;
use crate::ids::{AxisId, FactorId, Id, TermId, ValueId, VariableId};
use crate::kernel::{Fold, Reduce};
use crate::model::{Domain, Factor, Form};
use crate::operators::{Binary, Unary};

impl Lowering<'_> {
    /// The joint divided by e to the shift; no shift where the joint is computed without logarithms.
    pub(super) fn joint(&mut self, searched: &[AxisId]) -> Result<(ValueId, Option<ValueId>), Error> {
        let exact = self.exact;
        let over_plate = searched.iter().any(|axis| self.plate.contains(axis));
        if self.runs_anew || self.multiplies || over_plate || exact.mark(self.model) == Mark::Linear {
            return Ok((self.term(exact.joint)?, None));
        }
        self.densities = self.of_densities();
        // Probabilities without a normalising constant may underflow to 0.
        if exact.normalised && !self.densities[exact.joint.position()] {
            return Ok((self.term(exact.joint)?, None));
        }
        let ln = self.ln_term(exact.joint)?;
        if exact.normalised {
            return Ok((self.builder.unary(Unary::Exponential, ln), None));
        }
        let ln = self.kept("ln joint", ln);
        let (shift, joint) = self.shifted(searched, ln);
        Ok((joint, Some(shift)))
    }

    /// A value in an array of its own, over all axes on which it depends.
    fn kept(&mut self, what: &str, value: ValueId) -> ValueId {
        let (axes, name) = (self.axes_but(value, &[]), self.name(what));
        self.builder.compute(&name, &axes, Reduce::None, value)
    }

    /// m = max t over some axes, or 0 where that is −∞; and e^(t − m).
    fn shifted(&mut self, over: &[AxisId], ln: ValueId) -> (ValueId, ValueId) {
        let largest = self.fold_over("largest", Fold::Maximum, over, ln);
        let shift = self.or_zero(largest);
        (shift, self.exponential_from(shift, ln))
    }

    fn or_zero(&mut self, largest: ValueId) -> ValueId {
        let (zero, least) = (self.builder.constant(0.0), self.builder.constant(f64::NEG_INFINITY));
        let nothing = self.builder.binary(Binary::Equal, largest, least);
        self.builder.select(nothing, zero, largest)
    }

    fn exponential_from(&mut self, shift: ValueId, ln: ValueId) -> ValueId {
        let difference = self.builder.binary(Binary::Subtract, ln, shift);
        self.builder.unary(Unary::Exponential, difference)
    }

    /// The terms that multiply densities of reals, or likelihoods, whose scale is arbitrary: those are computed in
    /// logarithms throughout.
    fn of_densities(&self) -> Vec<bool> {
        let mut densities = vec![false; self.exact.terms.len()];
        let mut changed = true;
        while changed {
            changed = false;
            for (id, term) in self.exact.terms.iter() {
                let has = |id: &TermId| densities[id.position()];
                let found = match term {
                    Term::Factor(factor) => self.is_density(&self.model.factors[*factor]),
                    Term::Likelihood(..) => true,
                    Term::Product(factors) => factors.iter().any(has),
                    Term::Sum(_, body) | Term::Normalise(_, body) => has(body),
                    _ => false,
                };
                changed |= found && !has(&id);
                densities[id.position()] |= found;
            }
        }
        densities
    }

    pub(super) fn is_density(&self, factor: &Factor) -> bool {
        let finite = factor.left.iter().all(|left| self.model.variables[left.variable].domain.is_finite());
        !finite && !matches!(factor.form, Form::Dirac(_) | Form::Ask { .. })
    }

    /// ln of a term.
    fn ln_term(&mut self, id: TermId) -> Result<ValueId, Error> {
        match self.exact.terms[id].clone() {
            Term::Factor(factor) => self.ln_factor(factor),
            Term::Likelihood(variable, weights) => {
                let ln: Vec<f64> = weights.iter().map(|weight| weight.ln()).collect();
                self.likelihood(variable, &ln)
            }
            Term::Normalise(_, body) => self.ln_term(body),
            Term::Product(factors) => {
                let (guards, factors): (Vec<_>, Vec<_>) =
                    factors.into_iter().partition(|id| matches!(self.exact.terms[*id], Term::Inside(_)));
                let mut sum = self.builder.constant(0.0);
                for factor in factors {
                    let ln = self.ln_term(factor)?;
                    sum = self.builder.binary(Binary::Add, sum, ln);
                }
                let nothing = self.builder.constant(f64::NEG_INFINITY);
                for guard in guards {
                    let Term::Inside(variable) = self.exact.terms[guard] else { continue };
                    let (inside, holds) = self.inside(variable)?;
                    sum = self.builder.select(inside, sum, nothing);
                    sum = self.only_if(holds, sum);
                }
                Ok(sum)
            }
            Term::Sum(over, body) if self.densities[body.position()] => self.ln_sum(&over, body),
            _ => {
                let value = self.term(id)?;
                Ok(self.builder.unary(Unary::NaturalLogarithm, value))
            }
        }
    }

    fn ln_sum(&mut self, over: &[VariableId], body: TermId) -> Result<ValueId, Error> {
        if let ([one], true) = (over, over.len() == 1 && self.is_short(over[0], body)) {
            let terms = self.each_value(*one, |lowering| lowering.ln_term(body))?;
            let mut largest = terms[0];
            for term in &terms[1..] {
                largest = self.builder.binary(Binary::Maximum, largest, *term);
            }
            let (shift, mut sum) = (self.or_zero(largest), self.builder.constant(0.0));
            for term in terms {
                let part = self.exponential_from(shift, term);
                sum = self.builder.binary(Binary::Add, sum, part);
            }
            let ln = self.builder.unary(Unary::NaturalLogarithm, sum);
            return Ok(self.builder.binary(Binary::Add, shift, ln));
        }
        let mut axes: Vec<AxisId> = Vec::new();
        for variable in over {
            axes.extend(self.run_through(*variable));
        }
        let ln = self.ln_term(body)?;
        over.iter().for_each(|variable| self.stop(*variable));
        let ln = self.kept("ln terms", ln);
        let (shift, part) = self.shifted(&axes, ln);
        let sum = self.fold_over("sum", Fold::Sum, &axes, part);
        let ln = self.builder.unary(Unary::NaturalLogarithm, sum);
        Ok(self.builder.binary(Binary::Add, shift, ln))
    }

    /// ln of a factor; under `prod`s, the sum over their indices.
    pub(super) fn ln_factor(&mut self, id: FactorId) -> Result<ValueId, Error> {
        self.over_products(id, Fold::Sum, &mut |lowering, factor| {
            let left = match factor.left.as_slice() {
                [left] if lowering.is_density(factor) => left,
                _ => return lowering.ln_of(factor, &factor.form),
            };
            let meaning = lowering.use_meaning(left)?;
            lowering.ln_density(factor, &factor.form, left.variable, &meaning)
        })
    }

    fn ln_of(&mut self, factor: &Factor, form: &Form) -> Result<ValueId, Error> {
        let value = self.density_of(factor, form)?;
        Ok(self.builder.unary(Unary::NaturalLogarithm, value))
    }

    fn ln_density(
        &mut self,
        factor: &Factor,
        form: &Form,
        variable: VariableId,
        at: &Meaning,
    ) -> Result<ValueId, Error> {
        match form {
            Form::Law { law, arguments } if self.model.variables[variable].domain == Domain::Real => {
                let parameters = self.parameters(*law, arguments)?;
                let x = self.number_of(variable, at)?;
                let ln = law.ln_density(&mut self.builder, x, &parameters);
                let holds = self.law_holds(*law, arguments)?;
                Ok(self.only_if(holds, ln))
            }
            Form::If { condition, then, otherwise } => {
                let condition = self.expression(*condition)?;
                let then = self.ln_density(factor, then, variable, at)?;
                let otherwise = self.ln_density(factor, otherwise, variable, at)?;
                Ok(self.builder.select(condition, then, otherwise))
            }
            _ => self.ln_of(factor, form),
        }
    }
}
