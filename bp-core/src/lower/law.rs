//! Laws and what is made of them, over the domain of the left-hand variable.
//!
//! In: a law and its parameters. Out: a density of a real, or the probability of a value. Invariant: over a finite domain
//! the probabilities sum to one, or are all 0 where the law gives the whole domain nothing.
//!
//! Integers: f(k) / Σⱼ f(j).  Bins: (F(bᵢ₊₁) − F(bᵢ)) / (F(b_n) − F(b₀)); without a closed form of F, each mass is that
//! of five Gauss–Legendre points.  Circles: distances from the mean go the shorter way round.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{ExpressionId, ValueId, VariableId};
use crate::kernel::{Fold, KernelBuilder};
use crate::law::{Arithmetic, Law, Support};
use crate::model::{Bins, Domain, Factor, Form};
use crate::operators::{Binary, Unary};

/// Nodes and weights of the Gauss–Legendre rule of five points on [−1, 1] (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

impl Arithmetic for KernelBuilder {
    type Number = ValueId;
    fn constant(&mut self, number: f64) -> ValueId {
        KernelBuilder::constant(self, number)
    }
    fn unary(&mut self, operator: Unary, x: ValueId) -> ValueId {
        KernelBuilder::unary(self, operator, x)
    }
    fn binary(&mut self, operator: Binary, x: ValueId, y: ValueId) -> ValueId {
        KernelBuilder::binary(self, operator, x, y)
    }
    fn select(&mut self, condition: ValueId, then: ValueId, otherwise: ValueId) -> ValueId {
        KernelBuilder::select(self, condition, then, otherwise)
    }
}

impl Lowering<'_> {
    /// The density of a law; NaN where its parameters are such as it cannot have.
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
        if let (Law::Normal, false) = (law, matches!(domain, Domain::Bins(_))) {
            return self.normal(variable, &domain, at, arguments[0], arguments[1]);
        }
        let parameters: Vec<ValueId> =
            arguments.iter().map(|argument| self.expression(*argument)).collect::<Result<_, _>>()?;
        match (&domain, at) {
            (Domain::Bins(bins), Meaning::Ordinal(ordinal)) => {
                self.law_in_bins(law, variable, bins, *ordinal, &parameters)
            }
            (_, Meaning::Ordinal(_)) => self.normalised_over(variable, at, &mut |lowering, at| {
                let x = lowering.number_of(variable, at)?;
                let ln_density = law.ln_density(&mut lowering.builder, x, &parameters);
                Ok(lowering.builder.unary(Unary::Exponential, ln_density))
            }),
            _ => {
                let x = self.number_of(variable, at)?;
                let ln_density = law.ln_density(&mut self.builder, x, &parameters);
                Ok(self.builder.unary(Unary::Exponential, ln_density))
            }
        }
    }

    fn law_in_bins(
        &mut self,
        law: Law,
        variable: VariableId,
        bins: &Bins,
        ordinal: ValueId,
        parameters: &[ValueId],
    ) -> Result<ValueId, Error> {
        if bins.is_circle() && matches!(law, Law::Normal | Law::VonMises) {
            return self.law_on_circle(law, variable, bins, ordinal, parameters);
        }
        let (low, high) = (self.builder.constant(bins.ends().0), self.builder.constant(bins.ends().1));
        let (from, to) = self.bounds(bins, ordinal);
        if let Some(total) = law.mass(&mut self.builder, low, high, parameters) {
            let mass = law.mass(&mut self.builder, from, to, parameters).expect("internal: as for the whole");
            return Ok(self.share(mass, total));
        }
        let (bins, counts) = (bins.clone(), law.support() == Support::Counts);
        self.normalised_over(variable, &Meaning::Ordinal(ordinal), &mut |lowering, at| {
            let Meaning::Ordinal(ordinal) = at else { unreachable!("internal: a bin has an ordinal") };
            let (from, to) = lowering.bounds(&bins, *ordinal);
            if counts {
                // The whole number at the centre stands for the bin.
                let centre = lowering.centre(&bins, *ordinal);
                let ln_density = law.ln_density(&mut lowering.builder, centre, parameters);
                return Ok(lowering.builder.unary(Unary::Exponential, ln_density));
            }
            Ok(lowering.quadrature(law, from, to, parameters))
        })
    }

    /// ∫ f between two numbers, by five points.
    fn quadrature(&mut self, law: Law, from: ValueId, to: ValueId, parameters: &[ValueId]) -> ValueId {
        let by = &mut self.builder;
        let half = KernelBuilder::constant(by, 0.5);
        let (sum, width) = (by.add(from, to), by.subtract(to, from));
        let (middle, half_width) = (by.multiply(half, sum), by.multiply(half, width));
        let mut mass = KernelBuilder::constant(by, 0.0);
        for (node, weight) in RULE {
            let (node, weight) = (KernelBuilder::constant(by, node), KernelBuilder::constant(by, weight));
            let offset = by.multiply(node, half_width);
            let x = by.add(middle, offset);
            let ln_density = law.ln_density(by, x, parameters);
            let density = by.exp(ln_density);
            let part = by.multiply(weight, density);
            mass = by.add(mass, part);
        }
        by.multiply(mass, half_width)
    }

    /// A law around a mean on a circle. Normal: the mass of the bin where it lies nearest to the mean. Von Mises: its
    /// density there, the turn being 2π.
    fn law_on_circle(
        &mut self,
        law: Law,
        variable: VariableId,
        bins: &Bins,
        ordinal: ValueId,
        parameters: &[ValueId],
    ) -> Result<ValueId, Error> {
        let (low, high) = bins.ends();
        let (turn, width) = (high - low, bins.width().expect("internal: a circle has even bins"));
        let bins = bins.clone();
        self.normalised_over(variable, &Meaning::Ordinal(ordinal), &mut |lowering, at| {
            let Meaning::Ordinal(ordinal) = at else { unreachable!("internal: a bin has an ordinal") };
            let centre = lowering.centre(&bins, *ordinal);
            let by = &mut lowering.builder;
            let (half, whole) = (KernelBuilder::constant(by, 0.5 * turn), KernelBuilder::constant(by, turn));
            let centred = by.subtract(centre, parameters[0]);
            let shifted = by.add(centred, half);
            let around = KernelBuilder::binary(by, Binary::Remainder, shifted, whole);
            let distance = by.subtract(around, half);
            let zero = KernelBuilder::constant(by, 0.0);
            let centred = [zero, parameters[1]];
            if law == Law::VonMises {
                let scale = KernelBuilder::constant(by, std::f64::consts::TAU / turn);
                let angle = by.multiply(distance, scale);
                let ln_density = law.ln_density(by, angle, &centred);
                return Ok(by.exp(ln_density));
            }
            let half_width = KernelBuilder::constant(by, 0.5 * width);
            let (from, to) = (by.subtract(distance, half_width), by.add(distance, half_width));
            Ok(law.mass(by, from, to, &centred).expect("internal: a normal law has masses"))
        })
    }

    /// A form between two bounds.
    pub(super) fn truncated(
        &mut self,
        factor: &Factor,
        form: &Form,
        variable: VariableId,
        at: &Meaning,
        (low, high): (ExpressionId, ExpressionId),
    ) -> Result<ValueId, Error> {
        let mut holds = self.is_less(low, high)?;
        if let Form::Law { law, arguments } = form {
            let law = self.law_holds(*law, arguments)?;
            holds = self.builder.binary(Binary::And, holds, law);
        }
        let (low, high) = (self.expression(low)?, self.expression(high)?);
        let inside = |lowering: &mut Self, at: &Meaning| -> Result<ValueId, Error> {
            let x = lowering.number_of(variable, at)?;
            let above = lowering.builder.binary(Binary::GreaterOrEqual, x, low);
            let below = lowering.builder.binary(Binary::LessOrEqual, x, high);
            Ok(lowering.builder.binary(Binary::And, above, below))
        };
        let zero = self.builder.constant(0.0);
        if self.model.variables[variable].domain.is_finite() {
            let share = self.normalised_over(variable, at, &mut |lowering, at| {
                let density = lowering.density(factor, form, variable, at)?;
                let inside = inside(lowering, at)?;
                Ok(lowering.builder.select(inside, density, zero))
            })?;
            return Ok(self.only_if(holds, share));
        }
        let Form::Law { law, arguments } = form else {
            return Err(self.unplanned("only a law of a real can be truncated"));
        };
        let parameters: Vec<ValueId> =
            arguments.iter().map(|argument| self.expression(*argument)).collect::<Result<_, _>>()?;
        let Some(total) = law.mass(&mut self.builder, low, high, &parameters) else {
            let name = law.name();
            return Err(self.unplanned(format!(
                "a truncated `{name}` of a real has no closed form; over `bins(low, high, count)` it can be computed"
            )));
        };
        let density = self.density(factor, form, variable, at)?;
        let inside = inside(self, at)?;
        let density = self.builder.select(inside, density, zero);
        let share = self.share(density, total);
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
        // A form may speak of the left-hand variable itself, which here has the value in question.
        self.run(variable, at.clone());
        let here = weight(self, at)?;
        match outer {
            Some(outer) => self.run(variable, outer),
            None => self.stop(variable),
        }
        Ok(self.share(here, total))
    }

    /// A part of a total; 0 where the total is 0.
    fn share(&mut self, part: ValueId, total: ValueId) -> ValueId {
        let zero = self.builder.constant(0.0);
        let nothing = self.builder.binary(Binary::Equal, total, zero);
        let share = self.builder.binary(Binary::Divide, part, total);
        self.builder.select(nothing, zero, share)
    }
}
