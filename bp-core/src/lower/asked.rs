//! What others say: marginals that the last step kept, and the answers of other programs.
//!
//! In: a variable, or the path of a question. Out: a number read from an input. Invariant: what is read comes from the
//! host under a name that the program's text gives it.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{ValueId, VariableId};
use crate::kernel::{Index, Role};
use crate::model::{Factor, VariableUse};

impl Lowering<'_> {
    /// The marginal that the last step kept.
    pub(super) fn previous(
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
    pub(super) fn asked(
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
