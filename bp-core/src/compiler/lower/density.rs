//! The density of each form, as a value of a kernel.
//!
//! In: a form, and the meaning of the left-hand variable. Out: its probability, or its density. Invariant: the
//! equations are those of `forms/`; summed over a finite left-hand domain each gives one, except a Dirac outside its
//! domain and weights. An invalid number of the form makes it NaN.

use super::{Lowering, Meaning};
use crate::equation::Binding;
use crate::error::Error;
use crate::forms::{bernoulli, dirac, mixture, uniform};
use crate::ids::{AxisId, ExpressionId, FactorId, ValueId, VariableId};
use crate::kernel::{Extent, Fold, GridAxis, Index, Node, Reduce, SizeKey};
use crate::law::Constraint;
use crate::model::{Domain, Expression, Factor, Form, Value, VariableUse};
use crate::operators::{Binary, Unary};

/// The longest product over a given family that is unrolled; a longer one is a loop.
const WRITTEN_OUT: usize = 64;

impl Lowering<'_> {
    /// The density of a factor; under `prod`s, the product over their indices.
    pub(super) fn factor(&mut self, id: FactorId) -> Result<ValueId, Error> {
        self.over_products(id, Fold::Product, &mut |lowering, factor| {
            lowering.density_of(factor, &factor.form)
        })
    }

    /// The densities of the elements of a factor, folded over the indices of its `prod`s.
    pub(super) fn over_products(
        &mut self,
        id: FactorId,
        fold: Fold,
        each: &mut dyn FnMut(&mut Self, &Factor) -> Result<ValueId, Error>,
    ) -> Result<ValueId, Error> {
        let factor = self.model.factors[id].clone();
        let outer = std::mem::take(&mut self.products);
        let mut loops: Vec<AxisId> = Vec::new();
        for (name, over) in &factor.products {
            if let Some(count) = self.model.index_count(over)
                && (count <= WRITTEN_OUT || self.is_enumerated(&factor))
            {
                // A family of known length: its elements are variables of their own.
                return self.unrolled(&factor, count, outer, fold, each);
            }
            let axes = self.index_axes(name, over);
            let running = self.builder.running(axes[0]);
            let low = match over {
                crate::model::IndexSpace::Range(range) => range.low as f64,
                crate::model::IndexSpace::Set(_) => 0.0,
            };
            let low = self.builder.constant(low);
            let index = self.builder.binary(Binary::Add, running, low);
            self.products.push(index);
            loops.extend(axes);
        }
        let value = each(self, &factor);
        self.products = outer;
        let value = value?;
        match loops.is_empty() {
            true => Ok(self.computed_once(value)),
            false => Ok(self.fold_over("product", fold, &loops, value)),
        }
    }

    /// Whether a factor uses a family whose elements are enumerated; given ones are an array.
    fn is_enumerated(&self, factor: &Factor) -> bool {
        let families = factor.left.iter().chain(&factor.right).map(|use_| use_.variable);
        families.into_iter().any(|id| {
            self.model.variables[id].family.is_some()
                && !matches!(self.exact.bindings.get(&id), Some(Binding::Value(Value::Given(_))))
        })
    }

    /// A value that does not depend on the plate but takes some computing is stored in a small array, filled once. So is
    /// one of an instant of a filter, which is a table where it reads no input; its last axis is contiguous.
    fn computed_once(&mut self, value: ValueId) -> ValueId {
        let axes: Vec<AxisId> = self.axes(value).into_iter().collect();
        let is_running = |index: &Index| matches!(index, Index::Axis(_));
        let cheap = match &self.builder.so_far().nodes[value] {
            Node::Constant(_) | Node::Axis(_) => true,
            Node::Load { indices, .. } => !self.is_step || indices.iter().all(is_running),
            _ => false,
        };
        let is_number = self.is_step && axes.is_empty();
        if (self.plate.is_empty() && !self.is_step)
            || is_number
            || cheap
            || axes.iter().any(|axis| self.plate.contains(axis))
        {
            return value;
        }
        let name = self.name("once");
        self.builder.compute(&name, &axes, Reduce::None, value)
    }

    fn unrolled(
        &mut self,
        factor: &Factor,
        count: usize,
        outer: Vec<ValueId>,
        fold: Fold,
        each: &mut dyn FnMut(&mut Self, &Factor) -> Result<ValueId, Error>,
    ) -> Result<ValueId, Error> {
        let crate::model::IndexSpace::Range(range) = factor.products[0].1 else {
            return Err(self.unplanned("nested products over ranges"));
        };
        let operator = if fold == Fold::Sum { Binary::Add } else { Binary::Multiply };
        let mut folded = self.builder.constant(fold.start());
        for position in 0..count {
            let index = self.builder.constant((range.low + position as i64) as f64);
            self.products = vec![index];
            let value = each(self, factor)?;
            folded = self.builder.binary(operator, folded, value);
        }
        self.products = outer;
        Ok(folded)
    }

    /// The density of the factor of one element.
    pub(super) fn density_of(&mut self, factor: &Factor, form: &Form) -> Result<ValueId, Error> {
        match (form, factor.left.as_slice()) {
            // A variable observed through another program is not itself read.
            (Form::Ask { path, given }, [left]) => self.asked(factor, path, given, left),
            (Form::Table(rows), _) => self.table(factor, rows),
            (Form::Constants(numbers), _) => self.constants(factor, numbers),
            (Form::Uniform, several) => {
                let mut product = self.builder.constant(1.0);
                for left in several {
                    let share = self.uniform(&self.model.variables[left.variable].domain.clone());
                    product = self.builder.binary(Binary::Multiply, product, share);
                }
                Ok(product)
            }
            (Form::Previous { of, at: None, .. }, left) if self.is_joint(left) => {
                self.joint_previous(*of, left)
            }
            (_, [left]) => {
                let meaning = self.use_meaning(left)?;
                self.density(factor, form, left.variable, &meaning)
            }
            _ => Err(self.unplanned("this form distributes one variable")),
        }
    }

    pub(super) fn use_meaning(&mut self, use_: &VariableUse) -> Result<Meaning, Error> {
        let element = use_.element.map(|element| self.element_ordinal(use_.variable, element)).transpose()?;
        self.meaning(use_.variable, element)
    }

    /// The density of a form at a value of the left-hand variable.
    pub(super) fn density(
        &mut self,
        factor: &Factor,
        form: &Form,
        variable: VariableId,
        at: &Meaning,
    ) -> Result<ValueId, Error> {
        let domain = self.model.variables[variable].domain.clone();
        match form {
            Form::Uniform => Ok(self.uniform(&domain)),
            Form::Bernoulli(probability, complement) => {
                let Meaning::Ordinal(truth) = *at else {
                    return Err(self.unplanned("`bernoulli` distributes a bool"));
                };
                let probability = self.probability(*probability)?;
                let complement = complement.map(|id| self.probability(id)).transpose()?;
                Ok(bernoulli::probability(&mut self.builder, truth, probability, complement))
            }
            Form::Categorical(entries) => {
                let Meaning::Ordinal(ordinal) = at else {
                    return Err(self.unplanned("`categorical` distributes a finite variable"));
                };
                let row = self.row(entries)?;
                Ok(self.choose(*ordinal, &row))
            }
            Form::Law { law, arguments } => self.law(*law, variable, at, arguments),
            Form::Mixture(parts) => {
                let weights: Vec<ExpressionId> = parts.iter().map(|(weight, _)| *weight).collect();
                let weights = self.row(&weights)?;
                let parts = (parts.iter().map(|(_, part)| self.density(factor, part, variable, at)))
                    .collect::<Result<Vec<ValueId>, Error>>()?;
                Ok(mixture::density(&mut self.builder, weights.into_iter().zip(parts)))
            }
            Form::Truncated { form, low, high } => self.truncated(factor, form, variable, at, [*low, *high]),
            Form::NormalVector { .. } | Form::Dirichlet(_) | Form::Multinomial { .. } | Form::Ordered(_) => {
                let name = form.name();
                Err(self.unplanned(format!("`{name}` distributes a vector, which has no kernel")))
            }
            // An observation that is absent.
            Form::Flat if self.is_step => Ok(self.builder.constant(1.0)),
            Form::Flat | Form::HalfFlat => {
                let head = self.model.head(factor);
                Err(self.unplanned(format!("`{head}` is improper: {}", Form::FLAT)))
            }
            Form::Initial { .. } => {
                let head = self.model.head(factor);
                Err(self.unplanned(format!(
                    "`{head}` has a form of its own at the first instant: ask over time, such as `filter P(…)`"
                )))
            }
            Form::Unknown(_) => {
                let head = self.model.head(factor);
                Err(self
                    .unplanned(format!("`{head}` is `unknown`: learn it from data first, with `bp learn`")))
            }
            Form::NormalBins { mean, deviation } => {
                let density = self.normal_bins(&domain, at, *mean, *deviation)?;
                let holds = self.keeps(*mean, Constraint::Real)?;
                Ok(self.only_if(holds, density))
            }
            Form::Dirac(value) => {
                let expression = *value;
                let holds = self.keeps(*value, dirac::VALUE)?;
                let value = match self.model.compares_determined(factor) {
                    true => self.sharing(|lowering| lowering.compared(variable, *value))?,
                    false => self.expression(*value)?,
                };
                let (x, value) = match (&domain, at) {
                    // A number anywhere in a bin means that bin.
                    (Domain::Bins(bins), Meaning::Ordinal(bin)) => (*bin, self.bin_holding(bins, value)),
                    _ => {
                        (self.number_of(variable, at)?, self.whole_where_needed(variable, expression, value))
                    }
                };
                let equal = match domain.is_finite() {
                    true => dirac::probability(&mut self.builder, x, value),
                    false => dirac::probability_of_real(&mut self.builder, x, value),
                };
                Ok(self.only_if(holds, equal))
            }
            Form::Previous { of, at: cell, otherwise } => {
                let is_uniform = matches!(**otherwise, Form::Uniform);
                let otherwise = self.density(factor, otherwise, variable, at)?;
                self.previous(*of, *cell, at, (otherwise, is_uniform))
            }
            // Over the plate's own set, without parents, their sum is a constant of the answer.
            Form::Weights(weight) if self.own_plate(variable).is_some() && factor.right.is_empty() => {
                self.weight(*weight)
            }
            Form::Weights(weight) => {
                self.normalised_over(variable, at, &mut |lowering, _| lowering.weight(*weight))
            }
            Form::If { condition, then, otherwise } => {
                let condition = self.expression(*condition)?;
                let then = self.density(factor, then, variable, at)?;
                let otherwise = self.density(factor, otherwise, variable, at)?;
                Ok(self.builder.select(condition, then, otherwise))
            }
            Form::Ask { path, given } => {
                let left = factor.left.first().expect("internal: a factor has a left side");
                self.asked(factor, path, given, left)
            }
            Form::Table(rows) => self.table(factor, rows),
            Form::Constants(numbers) => self.constants(factor, numbers),
        }
    }

    /// The value of a predicate or an equation of a question, which compares reals that others determine as an observation
    /// does.
    fn compared(&mut self, variable: VariableId, id: ExpressionId) -> Result<ValueId, Error> {
        match self.model.expressions[id] {
            Expression::Binary(Binary::Subtract, left, right) if self.model.is_equation(variable) => {
                let (left, right) = (self.expression(left)?, self.expression(right)?);
                Ok(dirac::difference(&mut self.builder, left, right))
            }
            Expression::Binary(operator, left, right) if operator.compares() => {
                let (left, right) = (self.expression(left)?, self.expression(right)?);
                Ok(dirac::compared(&mut self.builder, operator, left, right))
            }
            Expression::Binary(operator @ (Binary::And | Binary::Or | Binary::Add), left, right) => {
                let (left, right) = (self.compared(variable, left)?, self.compared(variable, right)?);
                Ok(self.builder.binary(operator, left, right))
            }
            Expression::Unary(Unary::Not, operand) => {
                let operand = self.compared(variable, operand)?;
                Ok(self.builder.unary(Unary::Not, operand))
            }
            _ => self.expression(id),
        }
    }

    /// 1 / the number of values.
    fn uniform(&mut self, domain: &Domain) -> ValueId {
        let extents = match domain {
            Domain::Set(set) if self.model.sets[*set].kind == crate::model::SetKind::Grid => {
                GridAxis::ALL.map(|axis| Extent::sized(SizeKey::Grid(*set, axis))).to_vec()
            }
            _ => vec![self.extent(domain)],
        };
        let mut count = self.builder.constant(1.0);
        for extent in extents {
            let factor = self.count_of(extent);
            count = self.builder.binary(Binary::Multiply, count, factor);
        }
        uniform::probability(&mut self.builder, count)
    }
}
