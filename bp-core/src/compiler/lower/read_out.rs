//! Statistics of the joint distribution of the searched variables.
//!
//! In: the joint as a value. Out: the output buffers of the kernel, and their meanings. Invariant: asks with the same
//! known variables share one joint, computed once.

use super::{Lowering, Meaning};
use crate::equation::{Term, reachable};
use crate::error::Error;
use crate::ids::{AxisId, BufferId, TermId, ValueId, VariableId};
use crate::kernel::{Check, Fold, Index, Kernel, OutputKey, Reduce, Role};
use crate::model::{Ask, Statistic, Value};
use crate::operators::{Binary, Unary};

/// A kernel and the meanings of its outputs.
#[derive(Clone, PartialEq, Debug)]
pub struct Lowered {
    /// The loops.
    pub kernel: Kernel,
    /// Its outputs.
    pub outputs: Vec<Output>,
}

/// The meaning of an output.
#[derive(Clone, PartialEq, Debug)]
pub struct Output {
    /// The output of the kernel.
    pub key: OutputKey,
    /// Its name: the ask, as a user would type it.
    pub name: String,
    /// The ask; `None` for ln P(evidence).
    pub ask: Option<Ask>,
    /// Its axes before the plate's: known variables with a row for each value, then the searched ones.
    pub variables: Vec<VariableId>,
}

/// The divisor of a joint.
#[derive(Clone, Copy)]
enum Total {
    Divisor(ValueId),
    /// Two reciprocals to multiply by, one after the other.
    Reciprocal {
        scale: ValueId,
        reciprocal: ValueId,
    },
}

impl Lowering<'_> {
    pub(super) fn read_out(&mut self) -> Result<Vec<Output>, Error> {
        let exact = self.exact;
        let mut rows: Vec<AxisId> = Vec::new();
        for variable in &exact.each {
            rows.extend(self.run_through(*variable));
        }
        let mut searched: Vec<(VariableId, Vec<AxisId>)> = Vec::new();
        for variable in &exact.searched {
            if !exact.bindings.contains_key(variable) && !self.stands_for_one_value(*variable) {
                let axes = self.run_through_searched(*variable);
                searched.push((*variable, axes));
            } else if !exact.bindings.contains_key(variable) {
                let value = self.wanted(*variable)?;
                self.run(*variable, value);
            }
        }
        let over: Vec<AxisId> = searched.iter().flat_map(|(_, axes)| axes.clone()).collect();
        let (joint, shift) = self.joint(&over)?;
        let sole = exact.asks.len() == 1 && exact.normalised && !exact.ln_evidence;
        let joint = match sole || self.maximises {
            true => joint,
            false => {
                let axes = self.output_axes(&rows, &searched);
                let name = self.name("joint");
                self.builder.compute(&name, &axes, Reduce::None, joint)
            }
        };
        let mut outputs = Vec::new();
        let mut total = None;
        for (place, ask) in exact.asks.iter().enumerate() {
            let key = OutputKey::Ask(place);
            outputs.push(self.answer((key, ask), joint, &rows, &searched, &mut total)?);
        }
        if total.is_none() {
            self.check_without_total(&rows)?;
        }
        if exact.ln_evidence {
            let axes = self.output_axes(&rows, &[]);
            let name = self.name("evidence");
            let total = self.builder.fold(&name, &axes, Fold::Sum, &over, joint);
            let mut ln = self.builder.unary(Unary::NaturalLogarithm, total);
            if let Some(shift) = shift {
                ln = self.builder.binary(Binary::Add, ln, shift);
            }
            let (key, name) = (OutputKey::LnEvidence, "ln_evidence".to_owned());
            let out = self.builder.buffer(&name, Role::Output(key), &axes);
            self.builder.nest(out, Reduce::None, ln);
            outputs.push(Output { key, name, ask: None, variables: exact.each.clone() });
        }
        Ok(outputs)
    }

    /// Checks that no output is NaN and that the evidence is possible, where there is no division by a total.
    fn check_without_total(&mut self, rows: &[AxisId]) -> Result<(), Error> {
        let outputs: Vec<BufferId> = self.builder.so_far().outputs().map(|(id, _)| id).collect();
        outputs.into_iter().for_each(|id| self.builder.check_buffer(id, Check::Number));
        let terms = &self.exact.terms;
        let possible: Vec<TermId> = (reachable(terms, &[self.exact.joint]).into_iter())
            .filter(|id| matches!(terms[*id], Term::Possible(_)))
            .collect();
        if possible.is_empty() {
            return Ok(());
        }
        let mut all = self.builder.constant(1.0);
        for term in possible {
            let term = self.term(term)?;
            all = self.builder.binary(Binary::Multiply, all, term);
        }
        let name = self.name("possible");
        let all = self.builder.compute(&name, &self.output_axes(rows, &[]), Reduce::None, all);
        self.builder.check(all, Check::Total);
        Ok(())
    }

    /// Whether only one value of a searched variable is wanted, and the others are not summed.
    fn stands_for_one_value(&self, variable: VariableId) -> bool {
        let wanted = (self.exact.asks.iter().flat_map(|ask| &ask.searched))
            .filter(|searched| searched.variable == variable)
            .all(|searched| searched.at.is_some());
        wanted && self.exact.normalised && self.exact.asks.len() == 1
    }

    /// The wanted value of a searched variable.
    fn wanted(&mut self, variable: VariableId) -> Result<Meaning, Error> {
        let at = (self.exact.asks.iter().flat_map(|ask| &ask.searched))
            .find(|searched| searched.variable == variable)
            .and_then(|searched| searched.at.clone());
        match at {
            Some(Value::Ordinal(ordinal)) => Ok(Meaning::Ordinal(self.builder.constant(ordinal as f64))),
            Some(Value::Given(name)) => {
                let axes = self.plate.clone();
                let buffer = self.given_buffer(variable, &name, &axes);
                let indices = axes.iter().map(|axis| Index::Axis(*axis)).collect();
                Ok(Meaning::Ordinal(self.builder.load(buffer, indices)))
            }
            _ => Err(self.unplanned("a finite variable is searched at a real value")),
        }
    }

    fn output_axes(&self, rows: &[AxisId], searched: &[(VariableId, Vec<AxisId>)]) -> Vec<AxisId> {
        let local = rows.iter().chain(searched.iter().flat_map(|(_, axes)| axes));
        let mut axes: Vec<AxisId> = local.copied().filter(|axis| !self.plate.contains(axis)).collect();
        axes.extend(&self.plate);
        axes
    }

    fn answer(
        &mut self,
        (key, ask): (OutputKey, &Ask),
        joint: ValueId,
        rows: &[AxisId],
        searched: &[(VariableId, Vec<AxisId>)],
        shared: &mut Option<Total>,
    ) -> Result<Output, Error> {
        let own = |variable: &VariableId| ask.searched.iter().any(|item| item.variable == *variable);
        let (kept, summed): (Vec<_>, Vec<_>) =
            searched.iter().cloned().partition(|(variable, _)| own(variable));
        let mut axes = self.output_axes(rows, &kept);
        // A searched variable that ranges over the plate's own grid is distributed over the plate.
        let over_plate = kept.iter().any(|(_, axes)| axes == &self.plate && !self.plate.is_empty());
        let own_axes: Vec<AxisId> = kept.iter().flat_map(|(_, axes)| axes.clone()).collect();
        let mut value = joint;
        if !summed.is_empty() {
            let over: Vec<AxisId> = summed.iter().flat_map(|(_, axes)| axes.clone()).collect();
            let name = self.name("marginal");
            let fold = if self.maximises { Fold::Maximum } else { Fold::Sum };
            value = self.builder.fold(&name, &axes, fold, &over, joint);
        }
        let argmax = matches!(ask.statistic, Statistic::Argmax { .. });
        if !(self.exact.normalised || argmax && over_plate) {
            let totals: Vec<AxisId> = axes.iter().copied().filter(|axis| !own_axes.contains(axis)).collect();
            // All asks have the same total, that of the joint.
            let total = match shared {
                Some(total) => *total,
                None => *shared.insert(self.total(&totals, &own_axes, value)),
            };
            value = self.normalised(value, total);
        }
        let mut variables = self.exact.each.clone();
        // Where one value of a searched variable is wanted, its other values are skipped.
        let wanted = |variable: &VariableId| {
            ask.searched.iter().any(|item| item.variable == *variable && item.at.is_some())
        };
        let (fixed, open): (Vec<_>, Vec<_>) =
            kept.into_iter().partition(|(variable, _)| wanted(variable) && !over_plate);
        let fixed_axes: Vec<AxisId> = fixed.iter().flat_map(|(_, axes)| axes.clone()).collect();
        variables.extend(open.iter().map(|(variable, _)| *variable));
        axes.retain(|axis| !fixed_axes.contains(axis));
        if !fixed.is_empty() {
            let here = self.at_wanted(ask, &fixed)?;
            let zero = self.builder.constant(0.0);
            value = self.builder.select(here, value, zero);
        }
        let reduce = match ask.statistic {
            Statistic::Entropy => {
                value = self.builder.unary(Unary::EntropyTerm, value);
                axes.retain(|axis| !own_axes.contains(axis));
                variables.retain(|variable| !own(variable));
                Reduce::Fold(Fold::Sum, own_axes)
            }
            _ if !fixed.is_empty() => Reduce::Fold(Fold::Sum, fixed_axes),
            _ => Reduce::None,
        };
        let name = self.model.ask_text(ask);
        let out = self.builder.buffer(&name, Role::Output(key), &axes);
        self.builder.nest(out, reduce, value);
        Ok(Output { key, name, ask: Some(ask.clone()), variables })
    }

    /// The total of a value over some axes, prepared as a divisor.
    fn total(&mut self, totals: &[AxisId], over: &[AxisId], value: ValueId) -> Total {
        let name = self.name("total");
        let total = self.builder.fold(&name, totals, Fold::Sum, over, value);
        self.builder.check(total, Check::Total);
        if self.guarded {
            let out = self.builder.buffer("total of each context", Role::Output(OutputKey::Total), totals);
            self.builder.nest(out, Reduce::None, total);
        }
        let divisor = self.builder.or_one(total);
        if self.plate.is_empty() {
            let name = self.name("divisor");
            return Total::Divisor(self.builder.compute(&name, totals, Reduce::None, divisor));
        }
        // One division for each cell of the plate. The reciprocal of a very small total would overflow: such a total
        // and its dividend are scaled up first.
        let (small, large) = (self.builder.constant(2f64.powi(-100)), self.builder.constant(2f64.powi(100)));
        let one = self.builder.constant(1.0);
        let is_small = self.builder.binary(Binary::Less, divisor, small);
        let scale = self.builder.select(is_small, large, one);
        let name = self.name("scale");
        let scale = self.builder.compute(&name, totals, Reduce::None, scale);
        let scaled = self.builder.binary(Binary::Multiply, divisor, scale);
        let reciprocal = self.builder.binary(Binary::Divide, one, scaled);
        let name = self.name("reciprocal");
        let reciprocal = self.builder.compute(&name, totals, Reduce::None, reciprocal);
        Total::Reciprocal { scale, reciprocal }
    }

    fn normalised(&mut self, value: ValueId, total: Total) -> ValueId {
        match total {
            Total::Divisor(divisor) => self.builder.binary(Binary::Divide, value, divisor),
            Total::Reciprocal { scale, reciprocal } => {
                let scaled = self.builder.binary(Binary::Multiply, value, scale);
                self.builder.binary(Binary::Multiply, scaled, reciprocal)
            }
        }
    }

    /// Whether these searched variables have their wanted values in the running loop.
    fn at_wanted(&mut self, ask: &Ask, fixed: &[(VariableId, Vec<AxisId>)]) -> Result<ValueId, Error> {
        let mut here = self.builder.constant(1.0);
        for (variable, axes) in fixed {
            let running = self.builder.running(axes[0]);
            let wanted = match ask
                .searched
                .iter()
                .find(|item| item.variable == *variable)
                .and_then(|i| i.at.clone())
            {
                Some(Value::Ordinal(ordinal)) => self.builder.constant(ordinal as f64),
                Some(Value::Given(name)) => {
                    let axes = self.plate.clone();
                    let buffer = self.given_buffer(*variable, &name, &axes);
                    self.builder.load(buffer, axes.iter().map(|axis| Index::Axis(*axis)).collect())
                }
                _ => return Err(self.unplanned("a finite variable is searched at a real value")),
            };
            let same = self.builder.binary(Binary::Equal, running, wanted);
            here = self.builder.binary(Binary::And, here, same);
        }
        Ok(here)
    }
}
