//! Values given with a question: the inputs of a kernel that hold them.
//!
//! In: a variable, and the name under which its value is given. Out: the input, which knows the domain. Invariant: the
//! host gives values as the program writes them; the kernel reads their ordinals.

use super::Lowering;
use crate::ids::{AxisId, BufferId, VariableId};
use crate::kernel::{Extent, GridAxis, InputKey, Numbers, SizeKey, Values};
use crate::model::{Domain, Finding, SetKind, Value};

/// Upper limit on the labels that a message lists with their numbers.
const MOST_LABELS: usize = 12;

impl Lowering<'_> {
    /// The input that holds values of a variable.
    pub(super) fn given_buffer(&mut self, variable: VariableId, name: &str, axes: &[AxisId]) -> BufferId {
        let values = self.values_of(variable);
        self.builder.given(name, InputKey::Value(variable, name.to_owned()), values, axes)
    }

    /// Makes inputs for the values that the question leaves open and on which the answer does not depend: the host gives them
    /// by name all the same, and values outside of their domains are refused.
    pub(super) fn take_all(&mut self) {
        for known in &self.exact.asks[0].known {
            let Finding::Hard(Value::Given(name)) = &known.evidence else { continue };
            let is_taken =
                self.builder.so_far().input(&InputKey::Value(known.variable, name.clone())).is_some();
            if !is_taken && self.model.variables[known.variable].family.is_none() {
                let axes = self.plate.clone();
                self.given_buffer(known.variable, name, &axes);
            }
        }
    }

    /// The numbers that are values of a variable.
    fn values_of(&self, variable: VariableId) -> Values {
        let domain = &self.model.variables[variable].domain;
        let whole = |count| Numbers::Whole { first: domain.base(), count };
        let numbers = match domain {
            Domain::Real | Domain::Vector(_) => Numbers::Real,
            Domain::Bins(bins) => Numbers::Bins(bins.clone()),
            Domain::Set(set) if self.model.sets[*set].kind == SetKind::Grid => {
                whole(GridAxis::ALL.map(|axis| Extent::sized(SizeKey::Grid(*set, axis))).to_vec())
            }
            domain => whole(vec![self.extent(domain)]),
        };
        let text = format!("`{}`", self.model.domain_text(domain));
        Values { variable: self.model.variable_name(variable), domain: text + &numbered(domain), numbers }
    }
}

/// The numbers of values that are labels.
fn numbered(domain: &Domain) -> String {
    let labels = match domain {
        Domain::Boolean => 2,
        Domain::Finite { labels, .. } => labels.len(),
        Domain::Set(_) => return ": elements are counted from 0".to_owned(),
        _ => 0,
    };
    if labels == 0 {
        return String::new();
    }
    let number = |ordinal: usize| format!("{} is `{}`", domain.number(ordinal), domain.value_name(ordinal));
    let listed: Vec<String> = (0..labels.min(MOST_LABELS)).map(number).collect();
    format!(": {}{}", listed.join(", "), if labels > MOST_LABELS { ", …" } else { "" })
}
