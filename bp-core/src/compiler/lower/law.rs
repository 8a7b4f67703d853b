//! Laws and forms built on them, over the domain of the left-hand variable.
//!
//! In: a law and its parameters. Out: a density of a real, or the probability of a value. Invariant: over a finite
//! domain the probabilities sum to one, or are all 0 where the law gives the whole domain no mass.
//!
//! P(k) = w(k) / Σⱼ w(j), w as in `forms/law.rs`; of bins Σⱼ w(j) is F(b_n) − F(b₀) where F has a closed form.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::forms::{self, share, truncated};
use crate::ids::{ExpressionId, ValueId, VariableId};
use crate::kernel::{Fold, KernelBuilder};
use crate::law::{Arithmetic, Law};
use crate::model::{Domain, Factor, Form};
use crate::operators::{Binary, Mass, OPERANDS, Unary};

impl Arithmetic for KernelBuilder {
    type Number = ValueId;
    fn constant(&mut self, number: f64) -> ValueId {
        KernelBuilder::constant(self, number)
    }
    fn known(&self, x: ValueId) -> Option<f64> {
        self.as_constant(x)
    }
    fn unary(&mut self, operator: Unary, x: ValueId) -> ValueId {
        KernelBuilder::unary(self, operator, x)
    }
    fn binary(&mut self, operator: Binary, x: ValueId, y: ValueId) -> ValueId {
        KernelBuilder::binary(self, operator, x, y)
    }
    fn mass(&mut self, law: Mass, operands: [ValueId; OPERANDS]) -> ValueId {
        KernelBuilder::mass(self, law, operands)
    }
    fn select(&mut self, condition: ValueId, then: ValueId, otherwise: ValueId) -> ValueId {
        KernelBuilder::select(self, condition, then, otherwise)
    }
}

impl Lowering<'_> {
    /// The density of a law; NaN where a parameter is invalid.
    pub(super) fn law(
        &mut self,
        law: Law,
        variable: VariableId,
        at: &Meaning,
        arguments: &[ExpressionId],
    ) -> Result<ValueId, Error> {
        let density = self.law_density(law, variable, at, arguments)?;
        let holds = self.law_holds(law, arguments)?;
        Ok(self.only_if(holds, density))
    }

    fn law_density(
        &mut self,
        law: Law,
        variable: VariableId,
        at: &Meaning,
        arguments: &[ExpressionId],
    ) -> Result<ValueId, Error> {
        let domain = self.model.variables[variable].domain.clone();
        let parameters = self.parameters(law, arguments)?;
        let Meaning::Ordinal(ordinal) = *at else {
            let x = self.number_of(variable, at)?;
            return Ok(law.density_by(&mut self.builder, x, &parameters));
        };
        let (law, parameters) = forms::law::located(&mut self.builder, law, domain.bins(), parameters);
        if let Domain::Bins(bins) = &domain
            && !forms::law::goes_round(law, bins)
        {
            let (low, high) = (self.builder.constant(bins.ends().0), self.builder.constant(bins.ends().1));
            // The mass of the whole domain, where it has a closed form.
            if let Some(total) = law.mass(&mut self.builder, low, high, &parameters) {
                let mut value = Ordinal { lowering: self, variable, ordinal };
                let mass = forms::law::weight(&mut value, law, Some(bins), &parameters, None);
                return Ok(share(&mut self.builder, mass, total));
            }
        }
        let bins = domain.bins();
        self.normalised_over(variable, at, &mut |lowering, at| {
            let Meaning::Ordinal(ordinal) = *at else {
                return Err(lowering.unplanned("a law over a grid"));
            };
            let mut value = Ordinal { lowering, variable, ordinal };
            Ok(forms::law::weight(&mut value, law, bins, &parameters, None))
        })
    }

    /// A form restricted to an interval.
    pub(super) fn truncated(
        &mut self,
        factor: &Factor,
        form: &Form,
        variable: VariableId,
        at: &Meaning,
        bounds: [ExpressionId; 2],
    ) -> Result<ValueId, Error> {
        let mut holds = self.are_bounds(bounds)?;
        if let Form::Law { law, arguments } = form {
            let law = self.law_holds(*law, arguments)?;
            holds = self.builder.binary(Binary::And, holds, law);
        }
        let [low, high] = [self.expression(bounds[0])?, self.expression(bounds[1])?];
        let domain = self.model.variables[variable].domain.clone();
        if let (Form::Law { law, arguments }, Some(bins)) = (form, domain.bins()) {
            let parameters = self.parameters(*law, arguments)?;
            let (law, parameters) = forms::law::located(&mut self.builder, *law, Some(bins), parameters);
            let share = self.normalised_over(variable, at, &mut |lowering, at| {
                let Meaning::Ordinal(ordinal) = *at else {
                    return Err(lowering.unplanned("a law over a grid"));
                };
                let mut value = Ordinal { lowering, variable, ordinal };
                Ok(forms::law::weight(&mut value, law, Some(bins), &parameters, Some([low, high])))
            })?;
            return Ok(self.only_if(holds, share));
        }
        let inside = |lowering: &mut Self, at: &Meaning| -> Result<ValueId, Error> {
            let density = lowering.density(factor, form, variable, at)?;
            let x = lowering.number_of(variable, at)?;
            Ok(truncated::density(&mut lowering.builder, density, x, [low, high]))
        };
        if self.model.variables[variable].domain.is_finite() {
            let share = self.normalised_over(variable, at, &mut |lowering, at| inside(lowering, at))?;
            return Ok(self.only_if(holds, share));
        }
        let Form::Law { law, arguments } = form else {
            return Err(self.unplanned("only a law of a real can be truncated"));
        };
        let parameters = self.parameters(*law, arguments)?;
        let Some(total) = law.mass(&mut self.builder, low, high, &parameters) else {
            let name = law.name();
            return Err(self.unplanned(format!(
                "a truncated `{name}` of a real has no closed form: declare the count over an integer range"
            )));
        };
        let density = inside(self, at)?;
        let share = share(&mut self.builder, density, total);
        Ok(self.only_if(holds, share))
    }

    /// A weight at a value, divided by its sum over all values of the variable.
    pub(super) fn normalised_over(
        &mut self,
        variable: VariableId,
        at: &Meaning,
        weight: &mut dyn FnMut(&mut Self, &Meaning) -> Result<ValueId, Error>,
    ) -> Result<ValueId, Error> {
        let outer = self.running.get(&variable).cloned();
        let name = self.name("value");
        let domain = self.model.variables[variable].domain.clone();
        let (running, axes) = self.values(&name, &domain);
        self.run(variable, running.clone());
        // Over the plate's own set an index of the plate means the variable's value.
        let index = self.own_plate(variable);
        let element = index.and_then(|index| self.running.get(&index).cloned());
        index.into_iter().for_each(|index| self.run(index, running.clone()));
        let each = weight(self, &running)?;
        if let (Some(index), Some(element)) = (index, element) {
            self.run(index, element);
        }
        let total = self.fold_over("total", Fold::Sum, &axes, each);
        // The form may use the left-hand variable itself, which has the value in question here.
        self.run(variable, at.clone());
        let here = weight(self, at)?;
        match outer {
            Some(outer) => self.run(variable, outer),
            None => self.stop(variable),
        }
        Ok(share(&mut self.builder, here, total))
    }
}

/// A value of a finite variable, by its ordinal.
struct Ordinal<'l, 'm> {
    lowering: &'l mut Lowering<'m>,
    variable: VariableId,
    ordinal: ValueId,
}

impl forms::law::Value for Ordinal<'_, '_> {
    type By = KernelBuilder;

    fn by(&mut self) -> &mut KernelBuilder {
        &mut self.lowering.builder
    }

    fn number(&mut self) -> ValueId {
        self.lowering.number_at(self.variable, self.ordinal)
    }

    fn edges(&mut self) -> [ValueId; 2] {
        let model = self.lowering.model;
        let bins = model.variables[self.variable].domain.bins().expect("internal: bins have edges");
        let (from, to) = self.lowering.bounds(bins, self.ordinal);
        [from, to]
    }

    fn ends(&mut self) -> [ValueId; 2] {
        let (lowering, variable) = (&mut *self.lowering, self.variable);
        let extent = lowering.extent(&lowering.model.variables[variable].domain.clone());
        let (zero, one, count) =
            (lowering.builder.constant(0.0), lowering.builder.constant(1.0), lowering.count_of(extent));
        let last = lowering.builder.binary(Binary::Subtract, count, one);
        [zero, last].map(|end| lowering.number_at(variable, end))
    }
}
