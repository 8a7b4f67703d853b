//! Functions of many variables, as functions of few: predicates and functions of questions, and forms of many parents
//! (the parents are divorced: Olesen et al. 1989; Heckerman and Breese 1996 for noisy or).
//!
//! In: a Dirac, or a Bernoulli whose probability is a product. Out: the same form, of variables for parts of its expression.
//! Invariant: a part reads variables that nothing else in the expression reads; the sum over the parts is the form as written.
//!
//! before: P(S | F₁ F₂ F₃) = dirac(F₁ + F₂ + F₃)                     all combinations of F₁ F₂ F₃
//! after:  dirac(S₂ + F₃), P(S₂ | F₁ F₂) = dirac(F₁ + F₂)             all combinations of two of them
//!
//! before: P(X | A B C) = bernoulli(1 − f(A) g(B) h(C))              all combinations of A B C
//! after:  bernoulli(1 − Q₂ h(C)), P(Q₂ | Q₁ B) = bernoulli(Q₁ g(B)), P(Q₁ | A) = bernoulli(f(A))
//! of a noisy or f(A) + (1 − f(A)) (g(B) + …) the part is P(Q₂ | Q₁ B) = bernoulli(g(B) + (1 − g(B)) Q₁).

use super::values::Reads;
use super::{DerivedKind, Domain, Expression, Factor, Folded, Form, Model, Question, Variable, VariableUse};
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::operators::Binary;
use std::collections::HashMap;

/// Up to so many combinations an expression stays whole.
const FEW: usize = 1024;

/// The number of combinations of parents beyond which a form of the program is split.
const MANY: f64 = 65_536.0;

/// The most parents of a form that is split.
const MOST_PARENTS: usize = 2000;

impl Model {
    /// The forms of many parents that are split for a question. Programs over time, with a plate or with reals keep their
    /// forms, and so does a question that sums over nothing.
    pub(super) fn with_many_parents(&self, question: &Question) -> Vec<FactorId> {
        let of_few = |factor: &Factor| factor.right.len() < 3;
        if self.plate.is_some() || self.factors.values().all(of_few) {
            return Vec::new();
        }
        let is_plain = |variable: &Variable| variable.domain.is_finite() && variable.previous_of.is_none();
        let sums = |ask: &super::Ask| ask.searched.len() + ask.known.len() < self.variables.len();
        if !self.variables.values().all(is_plain) || !question.asks.iter().any(sums) {
            return Vec::new();
        }
        let is_large = |id: &FactorId| {
            let factor = &self.factors[*id];
            let (Form::Dirac(root) | Form::Bernoulli(root, _)) = factor.form else { return false };
            if of_few(factor) || factor.right.len() > MOST_PARENTS || !factor.products.is_empty() {
                return false;
            }
            let Some(reads) = self.reads(root).of(root).clone() else { return false };
            let counts = reads.iter().map(|(variable, _)| self.variables[*variable].domain.count());
            counts.map(|count| count.map(|count| count as f64)).product::<Option<f64>>().unwrap_or(0.0) > MANY
        };
        self.factors.ids().filter(is_large).collect()
    }

    /// Splits the forms of many parents.
    pub(super) fn divorce(&mut self, question: &Question) {
        for factor in self.with_many_parents(question) {
            match self.factors[factor].form {
                Form::Bernoulli(probability, _) => self.split_product(factor, probability),
                _ => self.split(factor),
            }
        }
    }

    /// Splits a Bernoulli whose probability, or that of `false`, is a product of probabilities that read different
    /// variables, such as a noisy or.
    fn split_product(&mut self, factor: FactorId, root: ExpressionId) {
        let (one, product) = match self.expressions[root] {
            Expression::Binary(Binary::Subtract, one, product) if self.constant(one) == Some(1.0) => {
                (Some(one), product)
            }
            _ => (None, root),
        };
        let (mut rest, mut operands) = (vec![product], self.alternatives(root));
        let is_or = operands.len() > 1;
        if !is_or {
            operands.clear();
        }
        while let Some(id) = rest.pop().filter(|_| !is_or) {
            match self.expressions[id] {
                Expression::Binary(Binary::Multiply, left, right) => rest.extend([right, left]),
                _ => operands.push(id),
            }
        }
        let reads = self.reads(root);
        let mut read = 0;
        for operand in &operands {
            let Some(own) = reads.of(*operand) else { return };
            read += own.len();
            if !self.is_probability(*operand) {
                return;
            }
        }
        if reads.of(root).as_ref().is_none_or(|all| all.len() < read) || operands.len() < 3 {
            return;
        }
        let mut so_far: Option<ExpressionId> = None;
        let count = operands.len();
        for (place, operand) in operands.into_iter().enumerate() {
            let value = match so_far {
                None => operand,
                Some(before) if is_or => {
                    let one = self.expressions.push(Expression::Number(1.0));
                    let fails = self.expressions.push(Expression::Binary(Binary::Subtract, one, operand));
                    let others = self.expressions.push(Expression::Binary(Binary::Multiply, fails, before));
                    self.expressions.push(Expression::Binary(Binary::Add, operand, others))
                }
                Some(before) => self.expressions.push(Expression::Binary(Binary::Multiply, before, operand)),
            };
            so_far = Some(value);
            let is_last = place + 1 == count;
            if !is_last && self.reads(value).of(value).as_ref().is_some_and(|own| !own.is_empty()) {
                let form = self.bernoulli(value);
                let part = self.part(value, Domain::Boolean, form);
                so_far = Some(self.expressions.push(Expression::Variable(part.into())));
            }
        }
        let product = so_far.expect("internal: a product has factors");
        let root = match one {
            Some(one) => self.expressions.push(Expression::Binary(Binary::Subtract, one, product)),
            None => product,
        };
        self.factors[factor].right = self.parents_of(root);
        self.factors[factor].form = self.bernoulli(root);
    }

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
            let inner = self.split_node(*operand, reads);
            let values = self.values_of(inner);
            let smaller = |values: &Vec<f64>| all.is_none_or(|all| values.len() < all);
            let part = values
                .filter(|values| smaller(values) && values.iter().all(|value| value.is_finite()))
                .and_then(Domain::of_numbers)
                .map(|domain| self.part(inner, domain, Form::Dirac(inner)));
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
    fn part(&mut self, value: ExpressionId, domain: Domain, form: Form) -> VariableId {
        let variable = self.variables.push(Variable {
            name: self.expression_text(value, &[]),
            previous_of: None,
            domain,
            family: None,
            derived: Some(DerivedKind::Part),
        });
        let right = self.parents_of(value);
        let left = vec![variable.into()];
        self.factors.push(Factor { left, right, form, products: Vec::new() });
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
