//! Which slots the form of an instance reads.
//!
//! In: an instance. Out: slots, its own left out where the form does not speak of them. Invariant: never too few; too
//! many only where an index depends on a variable, or a vector is read for one of its components.

use super::setting::{Instance, Setting};
use crate::ids::ExpressionId;
use crate::model::{Expression, Form, VariableUse};
use std::collections::{BTreeSet, HashSet};
use std::ops::Range;

impl Setting<'_> {
    /// The slots on which the distribution of an instance's left-hand side may depend.
    pub fn reads(&self, instance: &Instance) -> BTreeSet<usize> {
        let factor = &self.model.factors[instance.factor];
        let mut slots = BTreeSet::new();
        factor.form.each_expression(&mut |id| slots.extend(self.slots_read(id, &instance.indices)));
        // Looked up by the values of all that stands on the right.
        if has(&factor.form, &|form| matches!(form, Form::Table(_) | Form::Constants(_))) {
            let of = |use_: &VariableUse| self.slots_used(use_, &instance.indices);
            slots.extend(factor.right.iter().flat_map(of));
        }
        // A proportion is a share of what those before it leave.
        if has(&factor.form, &|form| matches!(form, Form::Dirichlet(_))) {
            slots.extend(instance.left[0] - instance.component..instance.left[0]);
        }
        slots
    }

    fn slots_read(&self, id: ExpressionId, indices: &[f64]) -> BTreeSet<usize> {
        let (mut rest, mut seen, mut slots) = (vec![id], HashSet::new(), BTreeSet::new());
        while let Some(id) = rest.pop() {
            if !seen.insert(id) {
                continue;
            }
            match &self.model.expressions[id] {
                Expression::Number(_) | Expression::Index(_) => {}
                Expression::Parameter { indices, .. } | Expression::Vector(_, indices) => {
                    rest.extend(indices)
                }
                Expression::Variable(use_) => {
                    slots.extend(self.slots_used(use_, indices));
                    rest.extend(use_.element);
                }
                Expression::Unary(_, operand) => rest.push(*operand),
                Expression::Binary(_, left, right) => rest.extend([*left, *right]),
                Expression::If { condition, then, otherwise } => {
                    rest.extend([*condition, *then, *otherwise]);
                }
                Expression::First { family, with } => {
                    slots.extend(self.slots_of(*family));
                    rest.extend(with.iter().flat_map(|(value, at)| [*value, *at]));
                }
                Expression::Foreign { at, .. } => rest.extend(at),
                Expression::GradientNorm { at, field } => rest.extend([*field, *at]),
                Expression::Frontier { condition, at } => rest.extend([*condition, *at]),
            }
        }
        slots
    }

    /// The slots that a use may mean: all of a family, where the index depends on a variable.
    fn slots_used(&self, use_: &VariableUse, indices: &[f64]) -> Range<usize> {
        let slots = self.slots_of(use_.variable);
        let Some(element) = use_.element.filter(|element| self.slots_read(*element, indices).is_empty())
        else {
            return slots;
        };
        let components = self.components(use_.variable);
        match self.element(use_.variable, self.index_number(element, indices)) {
            Some(element) => {
                let start = slots.start + element * components;
                start..start + components
            }
            None => slots.start..slots.start,
        }
    }
}

fn has(form: &Form, wanted: &impl Fn(&Form) -> bool) -> bool {
    let mut found = wanted(form);
    form.each_part(&mut |part| found |= has(part, wanted));
    found
}
