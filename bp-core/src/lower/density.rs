//! The density of each form, as a value of a kernel.
//!
//! In: a form, and what the left-hand variable stands for. Out: its probability, or its density. Invariant: the
//! one place where forms become arithmetic; summed over a finite left-hand domain each gives one, but for a
//! Dirac outside its domain and for weights.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{AxisId, ExpressionId, FactorId, ValueId, VariableId};
use crate::kernel::{Extent, Fold, Index, Reduce, Role};
use crate::model::{Domain, Factor, Form, VariableUse};
use crate::operators::Binary;

impl Lowering<'_> {
    /// The density of a factor; under `prod`s, the product over their indices.
    pub(super) fn factor(&mut self, id: FactorId) -> Result<ValueId, Error> {
        let factor = self.model.factors[id].clone();
        let outer = std::mem::take(&mut self.products);
        let mut loops: Vec<AxisId> = Vec::new();
        for (name, over) in &factor.products {
            if let Some(count) = self.model.index_count(over) {
                // A family of known length: its elements are variables of their own.
                return self.unrolled(&factor, count, outer);
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
        let value = self.density_of(&factor, &factor.form);
        self.products = outer;
        let value = value?;
        match loops.is_empty() {
            true => Ok(self.computed_once(value)),
            false => Ok(self.fold_over("product", Fold::Product, &loops, value)),
        }
    }

    /// What does not depend on the plate, but takes some computing, is a small array that is filled once.
    fn computed_once(&mut self, value: ValueId) -> ValueId {
        let axes: Vec<AxisId> = self.axes(value).into_iter().collect();
        let cheap = matches!(
            self.builder.so_far().nodes[value],
            crate::kernel::Node::Constant(_)
                | crate::kernel::Node::Load { .. }
                | crate::kernel::Node::Axis(_)
        );
        if self.plate.is_empty() || cheap || axes.iter().any(|axis| self.plate.contains(axis)) {
            return value;
        }
        let name = self.name("once");
        self.builder.compute(&name, &axes, Reduce::None, value)
    }

    fn unrolled(&mut self, factor: &Factor, count: usize, outer: Vec<ValueId>) -> Result<ValueId, Error> {
        let crate::model::IndexSpace::Range(range) = factor.products[0].1 else {
            return Err(self.unplanned("nested products over ranges"));
        };
        let mut product = self.builder.constant(1.0);
        for position in 0..count {
            let index = self.builder.constant((range.low + position as i64) as f64);
            self.products = vec![index];
            let value = self.density_of(factor, &factor.form)?;
            product = self.builder.binary(Binary::Multiply, product, value);
        }
        self.products = outer;
        Ok(product)
    }

    /// The density of one element's factor.
    pub(super) fn density_of(&mut self, factor: &Factor, form: &Form) -> Result<ValueId, Error> {
        match (form, factor.left.as_slice()) {
            (Form::Ask { path, given }, [left]) => self.asked(factor, path, given, left),
            (Form::Table(rows), _) => self.table(factor, rows),
            (Form::Uniform, several) => {
                let mut product = self.builder.constant(1.0);
                for left in several {
                    let share = self.uniform(&self.model.variables[left.variable].domain.clone());
                    product = self.builder.binary(Binary::Multiply, product, share);
                }
                Ok(product)
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
            Form::UniformInterval { low, high } => {
                let x = self.to_number(variable, at)?;
                let (low, high) = (self.expression(*low)?, self.expression(*high)?);
                let above = self.builder.binary(Binary::GreaterOrEqual, x, low);
                let below = self.builder.binary(Binary::LessOrEqual, x, high);
                let inside = self.builder.binary(Binary::And, above, below);
                let width = self.builder.binary(Binary::Subtract, high, low);
                let (zero, one) = (self.builder.constant(0.0), self.builder.constant(1.0));
                let height = self.builder.binary(Binary::Divide, one, width);
                Ok(self.builder.select(inside, height, zero))
            }
            Form::Bernoulli(probability) => {
                let (Meaning::Ordinal(ordinal), one) = (at, self.builder.constant(1.0)) else {
                    return Err(self.unplanned("`bernoulli` distributes a bool"));
                };
                let probability = self.expression(*probability)?;
                let complement = self.builder.binary(Binary::Subtract, one, probability);
                Ok(self.builder.select(*ordinal, probability, complement))
            }
            Form::Categorical(entries) => {
                let Meaning::Ordinal(ordinal) = at else {
                    return Err(self.unplanned("`categorical` distributes a finite variable"));
                };
                self.choose(*ordinal, entries)
            }
            Form::Normal { mean, deviation } => self.normal(variable, &domain, at, *mean, *deviation),
            Form::NormalBins { mean, deviation } => self.normal_bins(&domain, at, *mean, *deviation),
            Form::Dirac(value) => {
                let value = self.expression(*value)?;
                let x = self.to_number(variable, at)?;
                Ok(self.builder.binary(Binary::Equal, x, value))
            }
            Form::Previous { of, at: cell, otherwise } => {
                let otherwise = self.density(factor, otherwise, variable, at)?;
                self.previous(*of, *cell, at, otherwise)
            }
            Form::Weights(weight) => self.expression(*weight),
            Form::If { condition, then, otherwise } => {
                let condition = self.expression(*condition)?;
                let then = self.density(factor, then, variable, at)?;
                let otherwise = self.density(factor, otherwise, variable, at)?;
                Ok(self.builder.select(condition, then, otherwise))
            }
            Form::Ask { .. } | Form::Table(_) => {
                Err(self.unplanned("this form may not stand inside another"))
            }
        }
    }

    /// 1 / the number of values.
    fn uniform(&mut self, domain: &Domain) -> ValueId {
        let extents = match domain {
            Domain::Set(set) if self.model.sets[*set].kind == crate::model::SetKind::Grid => {
                let name = &self.model.sets[*set].name;
                ["depth", "rows", "lanes"].map(|part| Extent::named(&format!("{name}.{part}"))).to_vec()
            }
            _ => vec![self.extent(domain)],
        };
        let mut count = self.builder.constant(1.0);
        for extent in extents {
            let factor = match extent.known() {
                Some(known) => self.builder.constant(known as f64),
                None => {
                    // A size is a sum of ones over an axis of that extent: computed once.
                    let name = format!("number of values of {}", extent.size.clone().unwrap_or_default());
                    let axis = self.builder.axis(&name, extent);
                    let one = self.builder.constant(1.0);
                    self.builder.fold(&name, &[], Fold::Sum, &[axis], one)
                }
            };
            count = self.builder.binary(Binary::Multiply, count, factor);
        }
        let one = self.builder.constant(1.0);
        self.builder.binary(Binary::Divide, one, count)
    }

    /// The entry at an ordinal.
    fn choose(&mut self, ordinal: ValueId, entries: &[ExpressionId]) -> Result<ValueId, Error> {
        let values: Vec<ValueId> =
            entries.iter().map(|entry| self.expression(*entry)).collect::<Result<_, _>>()?;
        Ok(self.choose_value(ordinal, &values))
    }

    fn choose_value(&mut self, ordinal: ValueId, values: &[ValueId]) -> ValueId {
        if let Some(constant) = self.builder.as_constant(ordinal) {
            // A Dirac may say a value outside the domain: an indicator then stands beside this entry.
            let inside = constant >= 0.0 && constant < values.len() as f64;
            return if inside { values[constant as usize] } else { self.builder.constant(0.0) };
        }
        let (last, first) = values.split_last().expect("internal: a row has entries");
        let mut chosen = *last;
        for (position, value) in first.iter().enumerate().rev() {
            let position = self.builder.constant(position as f64);
            let here = self.builder.binary(Binary::Equal, ordinal, position);
            chosen = self.builder.select(here, *value, chosen);
        }
        chosen
    }

    /// A table: its rows are a small array, filled once, from which the entry is read.
    fn table(&mut self, factor: &Factor, rows: &[Vec<ExpressionId>]) -> Result<ValueId, Error> {
        let ordinal = |lowering: &mut Self, use_: &VariableUse| match lowering.use_meaning(use_)? {
            Meaning::Ordinal(ordinal) => {
                let count = lowering.model.variables[use_.variable].domain.count();
                Ok((ordinal, count.expect("internal: a checked table has finite parents")))
            }
            _ => Err(lowering.unplanned("a table needs finite variables")),
        };
        // Row-major position, last variable fastest, right-hand variables first.
        let (mut position, mut constant) = (self.builder.constant(0.0), true);
        for use_ in factor.right.iter().chain(&factor.left) {
            let (ordinal, count) = ordinal(self, use_)?;
            constant &= self.builder.as_constant(ordinal).is_some();
            let count = self.builder.constant(count as f64);
            position = self.builder.binary(Binary::Multiply, position, count);
            position = self.builder.binary(Binary::Add, position, ordinal);
        }
        let entries: Vec<ExpressionId> = rows.iter().flatten().copied().collect();
        if constant {
            return self.choose(position, &entries);
        }
        let values: Vec<ValueId> =
            entries.iter().map(|entry| self.expression(*entry)).collect::<Result<_, _>>()?;
        let mut axes = std::collections::BTreeSet::new();
        for value in &values {
            axes.extend(self.axes(*value));
        }
        if !axes.is_empty() || values.len() <= 8 {
            return Ok(self.choose_value(position, &values));
        }
        let head = self.model.head(factor);
        let axis = self.builder.axis(&head, Extent::constant(values.len()));
        let running = self.builder.running(axis);
        let entry = self.choose_value(running, &values);
        let name = self.name("table");
        self.builder.compute(&name, &[axis], Reduce::None, entry);
        let buffer = self.builder.so_far().buffer(&name).expect("internal: the table has just been made");
        let place = self.builder.at(position);
        let substituted = |use_: &VariableUse| {
            matches!(self.exact.bindings.get(&use_.variable), Some(crate::plan::Binding::Expression(_)))
        };
        if factor.right.iter().chain(&factor.left).any(substituted) {
            let zero = self.builder.constant(0.0);
            return Ok(self.builder.load_or(buffer, vec![place], zero));
        }
        Ok(self.builder.load(buffer, vec![place]))
    }

    /// The marginal that the last step kept.
    fn previous(
        &mut self,
        of: VariableId,
        cell: Option<VariableId>,
        at: &Meaning,
        otherwise: ValueId,
    ) -> Result<ValueId, Error> {
        let Meaning::Ordinal(ordinal) = *at else {
            return Err(self.unplanned("only marginals of finite variables are kept"));
        };
        let domain = self.model.variables[of].domain.clone();
        let name = format!("previous {}", self.model.variable_name(of));
        let default = domain.count().map(|count| 1.0 / count as f64);
        let extent = self.extent(&domain);
        let values =
            self.input_axes(&name, &mut |lowering| vec![lowering.builder.axis(&name, extent.clone())]);
        let mut axes = values;
        axes.extend(&self.plate);
        let mut indices = vec![self.builder.at(ordinal)];
        match cell {
            None => indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis))),
            Some(cell) => match self.meaning(cell, None)? {
                Meaning::Cell(cell) => indices.extend(cell),
                _ => return Err(self.unplanned("a marginal is kept at a cell")),
            },
        }
        let buffer = self.builder.buffer(&name, Role::Input { default, broadcast: false }, &axes);
        match cell {
            None => Ok(self.builder.load(buffer, indices)),
            Some(_) => Ok(self.builder.load_or(buffer, indices, otherwise)),
        }
    }

    /// The likelihood that another program gives to what is observed.
    fn asked(
        &mut self,
        factor: &Factor,
        path: &str,
        given: &[VariableId],
        left: &VariableUse,
    ) -> Result<ValueId, Error> {
        if !matches!(self.exact.bindings.get(&left.variable), Some(crate::plan::Binding::Value(_))) {
            let name = self.model.variable_name(left.variable);
            return Err(
                self.unplanned(format!("`{name}` is distributed by another program, and must be known"))
            );
        }
        let mut indices: Vec<Index> =
            self.products.clone().into_iter().map(|index| self.builder.at(index)).collect();
        let mut local: Vec<VariableId> = Vec::new();
        for variable in given.iter().filter(|variable| Some(**variable) != self.model.plate_index()) {
            match self.meaning(*variable, None)? {
                Meaning::Ordinal(ordinal) => indices.push(self.builder.at(ordinal)),
                _ => return Err(self.unplanned("another program's answer is read at finite values")),
            }
            local.push(*variable);
        }
        let products: Vec<_> = factor.products.clone();
        let axes = self.input_axes(path, &mut |lowering| {
            let mut axes = Vec::new();
            for (name, over) in &products {
                axes.extend(lowering.index_axes(name, over));
            }
            for variable in &local {
                let name = lowering.model.variable_name(*variable);
                let extent = lowering.extent(&lowering.model.variables[*variable].domain.clone());
                axes.push(lowering.builder.axis(&name, extent));
            }
            axes
        });
        let on_plate = given.iter().any(|variable| Some(*variable) == self.model.plate_index());
        let mut all = axes;
        if on_plate {
            all.extend(&self.plate);
            indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis)));
        }
        let buffer = self.builder.buffer(path, Role::Input { default: None, broadcast: false }, &all);
        Ok(self.builder.load(buffer, indices))
    }
}
