//! Predicates and functions of many variables, as functions of few.
//!
//! In: the Dirac of a variable that a question derives. Out: the same Dirac, of variables for parts of its expression. Invariant: a
//! part reads variables that nothing else in the expression reads, and has fewer values than these have combinations.
//!
//! before: P(F₁ + F₂ + F₃ > 9)                            all combinations of F₁ F₂ F₃
//! after:  P(S₃ > 9), S₃ = S₂ + F₃, S₂ = F₁ + F₂           all combinations of two of them

use super::values::Reads;
use super::{DerivedKind, Domain, Expression, Factor, Folded, Form, Model, Variable, VariableUse};
use crate::ids::{ExpressionId, FactorId, VariableId};
use std::collections::HashMap;

/// Up to so many combinations an expression stays whole.
const FEW: usize = 1024;

impl Model {
    /// Splits the expression of a Dirac.
    pub(super) fn split(&mut self, factor: FactorId) {
        let Form::Dirac(root) = self.factors[factor].form else { return };
        let reads = self.reads(root);
        let new = self.split_node(root, &reads);
        if new != root {
            self.factors[factor].right = self.parents_of(new);
            self.factors[factor].form = Form::Dirac(new);
        }
    }

    /// The node, of variables for its parts.
    fn split_node(&mut self, id: ExpressionId, reads: &Folded<Reads>) -> ExpressionId {
        let is_few = |own: &Reads| own.as_ref().is_some_and(|own| own.len() < 2);
        if self.combinations(reads.of(id)).is_some_and(|all| all <= FEW) || is_few(reads.of(id)) {
            return id;
        }
        let node = self.expressions[id].clone();
        if !matches!(node, Expression::Unary(..) | Expression::Binary(..)) {
            return id;
        }
        let mut operands = Vec::new();
        node.each_operand(&mut |operand| operands.push(operand));
        let mut new: HashMap<ExpressionId, ExpressionId> = HashMap::new();
        for (place, operand) in operands.iter().enumerate() {
            let Some(own) = reads.of(*operand) else { continue };
            let apart = (operands.iter().enumerate())
                .filter(|(other, _)| *other != place)
                .all(|(_, other)| reads.of(*other).as_ref().is_some_and(|other| other.is_disjoint(own)));
            if own.len() < 2 || !apart {
                continue;
            }
            let all = self.combinations(reads.of(*operand));
            let values = self.values_among(*operand, reads);
            let inner = self.split_node(*operand, reads);
            let smaller = |values: &Vec<f64>| all.is_none_or(|all| values.len() < all);
            let part = values
                .filter(|values| smaller(values) && values.iter().all(|value| value.is_finite()))
                .and_then(Domain::of_numbers)
                .map(|domain| self.part(inner, domain));
            let part = part.map(|variable| self.expressions.push(Expression::Variable(variable.into())));
            new.insert(*operand, part.unwrap_or(inner));
        }
        match new.iter().all(|(old, new)| old == new) {
            true => id,
            false => {
                let node = node.renumbered(&|id| new.get(&id).copied().unwrap_or(id));
                self.expressions.push(node)
            }
        }
    }

    /// A variable that is a part of an expression.
    fn part(&mut self, value: ExpressionId, domain: Domain) -> VariableId {
        let variable = self.variables.push(Variable {
            name: self.expression_text(value, &[]),
            previous_of: None,
            domain,
            family: None,
            derived: Some(DerivedKind::Part),
        });
        let right = self.parents_of(value);
        let left = vec![variable.into()];
        self.factors.push(Factor { left, right, form: Form::Dirac(value), products: Vec::new() });
        variable
    }

    /// The variables that an expression reads, each once.
    fn parents_of(&self, root: ExpressionId) -> Vec<VariableUse> {
        let mut found: Vec<VariableUse> = Vec::new();
        for id in self.nodes_below(root) {
            if let Expression::Variable(use_) = &self.expressions[id]
                && found.iter().all(|other| self.read(other) != self.read(use_))
            {
                found.push(use_.clone());
            }
        }
        found
    }
}
