//! Values from outside the program: marginals kept from the previous instant, and answers of other programs.
//!
//! In: a variable, or the path of a question. Out: a number read from an input. Invariant: an input has the name that
//! the program's text gives it; a subroutine's answer comes with the kernel, all others from the host.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{AxisId, ValueId, VariableId};
use crate::kernel::{Index, InputKey, Role};
use crate::model::{Factor, VariableUse};
use crate::operators::Binary;

impl Lowering<'_> {
    /// The marginal kept from the previous instant.
    pub(super) fn previous(
        &mut self,
        of: VariableId,
        cell: Option<VariableId>,
        at: &Meaning,
        (otherwise, is_uniform): (ValueId, bool),
    ) -> Result<ValueId, Error> {
        let Meaning::Ordinal(ordinal) = *at else {
            return Err(self.unplanned("only marginals of finite variables are kept"));
        };
        let domain = self.model.variables[of].domain.clone();
        let key = InputKey::Previous(of);
        let name = self.input_name(&key);
        // Where the host gives no value, `otherwise` applies; −1 marks a missing value, since no probability is
        // negative. A uniform over a known length is a number; over another length it is computed from the size.
        let uniform = domain.count().filter(|_| is_uniform).map(|count| 1.0 / count as f64);
        let default = Some(uniform.unwrap_or(-1.0));
        let extent = self.extent(&domain);
        let known = self.builder.so_far().input(&key);
        let mut axes = self.input_axes(known, &mut |lowering| vec![lowering.builder.axis(&name, extent)]);
        axes.extend(&self.plate);
        let mut indices = vec![self.builder.at(ordinal)];
        match cell {
            None => indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis))),
            Some(cell) => match self.meaning(cell, None)? {
                Meaning::Cell(cell) => indices.extend(cell),
                _ => return Err(self.unplanned("a marginal is kept at a cell")),
            },
        }
        let buffer = self.input(key, default, &axes);
        let kept = match cell {
            None => self.builder.load(buffer, indices),
            Some(_) => self.builder.load_or(buffer, indices, otherwise),
        };
        if uniform.is_some() {
            return Ok(kept);
        }
        let zero = self.builder.constant(0.0);
        let nothing = self.builder.binary(Binary::Less, kept, zero);
        Ok(self.builder.select(nothing, otherwise, kept))
    }

    /// Whether the distribution carried from the previous instant is a joint one.
    pub(super) fn is_joint(&self, left: &[VariableUse]) -> bool {
        let is_family = |use_: &VariableUse| self.model.variables[use_.variable].family.is_some();
        left.len() > 1 || left.iter().any(|use_| use_.element.is_none() && is_family(use_))
    }

    /// The joint distribution carried from the previous instant, by the name of its first variable.
    pub(super) fn joint_previous(&mut self, of: VariableId, left: &[VariableUse]) -> Result<ValueId, Error> {
        let key = InputKey::Previous(of);
        let (mut axes, mut indices) = (Vec::new(), Vec::new());
        let known = self.builder.so_far().input(&key);
        for use_ in left {
            let name = self.model.variable_name(use_.variable);
            let extent = self.extent(&self.model.variables[use_.variable].domain.clone());
            let elements = match self.meaning(use_.variable, None)? {
                Meaning::Family(elements) => elements,
                one => vec![one],
            };
            for element in elements {
                let Meaning::Ordinal(ordinal) = element else {
                    return Err(self.unplanned("only distributions of finite variables are carried"));
                };
                indices.push(self.builder.at(ordinal));
                if known.is_none() {
                    axes.push(self.builder.axis(&name, extent));
                }
            }
        }
        indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis)));
        axes.extend(&self.plate);
        let buffer = self.input(key, None, &axes);
        Ok(self.builder.load(buffer, indices))
    }

    /// The answer of another program: for a subroutine its table; else the likelihood of the observations under it.
    pub(super) fn asked(
        &mut self,
        factor: &Factor,
        path: &str,
        given: &[VariableId],
        left: &VariableUse,
    ) -> Result<ValueId, Error> {
        let subroutine = self.model.subroutine(path);
        if subroutine.is_none()
            && !matches!(self.exact.bindings.get(&left.variable), Some(crate::equation::Binding::Value(_)))
        {
            let name = self.model.variable_name(left.variable);
            return Err(
                self.unplanned(format!("`{name}` is distributed by another program, and must be known"))
            );
        }
        let key = InputKey::Answer(path.to_owned());
        let known = self.builder.so_far().input(&key);
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
        if let Some(subroutine) = subroutine {
            if subroutine.table.is_empty() {
                return Err(self.unplanned(format!("`{path}` has not been asked yet; link the model first")));
            }
            let Meaning::Ordinal(ordinal) = self.use_meaning(left)? else {
                return Err(self.unplanned("a subroutine distributes a finite variable"));
            };
            indices.push(self.builder.at(ordinal));
            local.push(left.variable);
            let table = subroutine.table.clone();
            let axes = self.input_axes(known, &mut |lowering| lowering.value_axes(&local));
            let buffer = self.builder.buffer(path, Role::Table { key: Some(key), numbers: table }, &axes);
            // The value of a Dirac may lie outside, where the probability is 0.
            let zero = self.builder.constant(0.0);
            return Ok(self.builder.load_or(buffer, indices, zero));
        }
        let products: Vec<_> = factor.products.clone();
        let axes = self.input_axes(known, &mut |lowering| {
            let mut axes = Vec::new();
            for (name, over) in &products {
                axes.extend(lowering.index_axes(name, over));
            }
            axes.extend(lowering.value_axes(&local));
            axes
        });
        let on_plate = given.iter().any(|variable| Some(*variable) == self.model.plate_index());
        let mut all = axes;
        if on_plate {
            all.extend(&self.plate);
            indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis)));
        }
        let buffer = self.input(key, None, &all);
        Ok(self.builder.load(buffer, indices))
    }

    /// One axis for the values of each variable.
    fn value_axes(&mut self, variables: &[VariableId]) -> Vec<AxisId> {
        let one = |variable: &VariableId| {
            let name = self.model.variable_name(*variable);
            let extent = self.extent(&self.model.variables[*variable].domain.clone());
            self.builder.axis(&name, extent)
        };
        variables.iter().map(one).collect()
    }
}
