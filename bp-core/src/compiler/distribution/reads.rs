//! The slots that the form of an instance reads.
//!
//! In: an instance. Out: slots, without its own unless the form uses them. Invariant: never too few; too many only
//! where an index depends on a variable, or a vector is read for one of its components.

use super::setting::{Instance, Setting};
use crate::ids::ExpressionId;
use crate::model::{Expression, Form, VariableUse};
use std::collections::BTreeSet;
use std::ops::Range;

impl<'m> Setting<'m> {
    /// The slots on which the distribution of an instance's left-hand side may depend.
    pub fn reads(&self, instance: &Instance) -> BTreeSet<usize> {
        let form = self.form_at(instance);
        let mut slots = BTreeSet::new();
        form.each_expression(&mut |id| slots.extend(self.slots_read(id, &instance.indices)));
        slots.extend(self.looked_up(instance));
        // A component depends on the earlier ones.
        if has(form, &Form::couples) {
            slots.extend(instance.left[0] - instance.component..instance.left[0]);
        }
        slots
    }

    /// The form of an instance: of `if`s whose condition depends on no variable, the branch that is taken.
    pub(crate) fn form_at(&self, instance: &Instance) -> &'m Form {
        self.branch(&self.model.factors[instance.factor].form, &instance.indices)
    }

    /// The branch of a form that is taken at these indices, as far as it depends on no variable.
    pub(super) fn branch<'f>(&self, mut form: &'f Form, indices: &[f64]) -> &'f Form {
        let is_known = |node: ExpressionId| {
            matches!(
                self.model.expressions[node],
                Expression::Number(_)
                    | Expression::Index(_)
                    | Expression::Parameter { .. }
                    | Expression::Unary(..)
                    | Expression::Binary(..)
                    | Expression::If { .. }
            )
        };
        while let Form::If { condition, then, otherwise } = form {
            if !self.model.nodes_below(*condition).into_iter().all(is_known) {
                break;
            }
            let number = self.index_number(*condition, indices);
            if number.is_nan() {
                break;
            }
            form = if number != 0.0 { then } else { otherwise };
        }
        form
    }

    /// The slots by whose values a table or the answer of a subroutine is looked up, in the order of the factor.
    pub(crate) fn looked_up(&self, instance: &Instance) -> Vec<usize> {
        let (factor, own) = (&self.model.factors[instance.factor], self.form_at(instance));
        let mut slots = Vec::new();
        // A table is looked up by the values of all right-hand variables.
        if has(own, &|form| matches!(form, Form::Table(_) | Form::Constants(_))) {
            let of = |use_: &VariableUse| self.slots_used(use_, &instance.indices);
            slots.extend(factor.right.iter().flat_map(of));
        }
        each(own, &mut |form| {
            if let Form::Ask { given, .. } = form {
                slots.extend(given.iter().flat_map(|variable| self.slots_of(*variable)));
            }
        });
        slots
    }

    /// The slots that an expression reads in an instance with these indices.
    pub(crate) fn slots_read(&self, id: ExpressionId, indices: &[f64]) -> BTreeSet<usize> {
        let mut slots = BTreeSet::new();
        for node in self.model.nodes_below(id) {
            match &self.model.expressions[node] {
                Expression::Variable(use_) => slots.extend(self.slots_used(use_, indices)),
                Expression::First { family, .. } => slots.extend(self.slots_of(*family)),
                _ => {}
            }
        }
        slots
    }

    /// Whether a form reads a field or an answer of another program, or a value kept at a cell, which are not numbers
    /// here.
    pub(super) fn reads_elsewhere(&self, instance: &Instance) -> bool {
        let form = &self.model.factors[instance.factor].form;
        let mut found = has(form, &|form| {
            matches!(form, Form::Ask { .. } | Form::Unknown(_) | Form::Previous { at: Some(_), .. })
        });
        form.each_expression(&mut |id| {
            found |= self.model.nodes_below(id).into_iter().any(|node| {
                matches!(
                    self.model.expressions[node],
                    Expression::Foreign { .. }
                        | Expression::GradientNorm { .. }
                        | Expression::Frontier { .. }
                        | Expression::Innermost { .. }
                )
            });
        });
        found
    }

    /// The slots that a use may refer to: the whole family, where the index depends on a variable.
    pub(crate) fn slots_used(&self, use_: &VariableUse, indices: &[f64]) -> Range<usize> {
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

fn each(form: &Form, visit: &mut impl FnMut(&Form)) {
    visit(form);
    form.each_part(&mut |part| each(part, visit));
}

fn has(form: &Form, wanted: &impl Fn(&Form) -> bool) -> bool {
    let mut found = wanted(form);
    form.each_part(&mut |part| found |= has(part, wanted));
    found
}
