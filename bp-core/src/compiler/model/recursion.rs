//! Families whose elements depend on earlier ones: `P(Y[t] | Y[t - 1])`.
//!
//! In: a factor. Out: which elements of which families it reads. Invariant: in a valid model each instance of a factor reads
//! elements that come before its own, so that the instances of all factors have an order.

use super::{Expression, Factor, Folded, Form, Model, VariableUse};
use crate::ids::{ExpressionId, FactorId, Id, VariableId};
use crate::operators::{Binary, Unary};

/// The element of a family that a factor reads.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Reading {
    /// So many elements before the one that it distributes; after it where this is negative.
    Back(i64),
    /// The element with this index.
    At(i64),
    /// All of them, or one whose index depends on more.
    Any,
}

/// The index of a `prod` plus a number, or a number alone.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Shifted {
    /// The depth of the `prod`.
    pub(crate) depth: Option<usize>,
    /// The number.
    pub(crate) by: i64,
}

impl Model {
    /// An index as a shifted one, where it is so.
    pub(crate) fn shifted(&self, id: ExpressionId) -> Option<Shifted> {
        let of = |expression: &Expression, below: &Folded<Option<Shifted>>| match expression {
            Expression::Index(depth) => Some(Shifted { depth: Some(*depth), by: 0 }),
            Expression::Number(by) if by.fract() == 0.0 && by.abs() < 1e15 => {
                Some(Shifted { depth: None, by: *by as i64 })
            }
            Expression::Unary(Unary::Negate, of) => {
                (*below.of(*of)).filter(|it| it.depth.is_none()).map(|it| Shifted { by: -it.by, ..it })
            }
            Expression::Binary(operator, left, right) => {
                let (left, right) = ((*below.of(*left))?, (*below.of(*right))?);
                match (operator, left.depth, right.depth) {
                    (Binary::Add, depth, None) | (Binary::Add, None, depth) => {
                        Some(Shifted { depth, by: left.by + right.by })
                    }
                    (Binary::Subtract, depth, None) => Some(Shifted { depth, by: left.by - right.by }),
                    _ => None,
                }
            }
            _ => None,
        };
        self.fold(id, of).root()
    }

    /// The element of a family that a factor reads.
    pub(crate) fn reading(&self, factor: &Factor, use_: &VariableUse) -> Reading {
        let own = factor.left.first().and_then(|left| self.shifted(left.element?));
        match (own, use_.element.and_then(|element| self.shifted(element))) {
            (_, Some(Shifted { depth: None, by })) => Reading::At(by),
            (Some(own), Some(read)) if own.depth.is_some() && own.depth == read.depth => {
                Reading::Back(own.by - read.by)
            }
            _ => Reading::Any,
        }
    }

    /// The variables on the right of a factor that depend on those on its left in turn.
    pub(crate) fn in_turn(&self, id: FactorId) -> Vec<VariableId> {
        let factor = &self.factors[id];
        let is_other =
            |use_: &VariableUse| !matches!(self.reading(factor, use_), Reading::Any | Reading::Back(0));
        if factor.products.is_empty() || !factor.right.iter().any(is_other) {
            return Vec::new();
        }
        let families = factor.right.iter().map(|use_| use_.variable);
        let mut found: Vec<VariableId> = families.filter(|id| self.variables[*id].family.is_some()).collect();
        found.sort_unstable();
        found.dedup();
        let distributions = self.distributions();
        let is_own = |id: VariableId| factor.left.iter().any(|use_| use_.variable == id);
        found.retain(|family| {
            let (mut seen, mut rest) = (vec![false; self.variables.len()], vec![*family]);
            while let Some(variable) = rest.pop() {
                if is_own(variable) {
                    return true;
                }
                if !std::mem::replace(&mut seen[variable.position()], true)
                    && let Some(factor) = distributions[variable.position()]
                {
                    rest.extend(self.factors[factor].right.iter().map(|use_| use_.variable));
                }
            }
            false
        });
        found
    }

    /// The families of which a factor reads earlier elements alone, and which depend on its own in turn: an order of the families
    /// does not say which comes first, the order of their elements does.
    pub(crate) fn earlier(&self, id: FactorId) -> Vec<VariableId> {
        let factor = &self.factors[id];
        let goes_back =
            |use_: &VariableUse| matches!(self.reading(factor, use_), Reading::Back(1..) | Reading::At(_));
        let mut found = self.in_turn(id);
        found.retain(|family| factor.right.iter().filter(|use_| use_.variable == *family).all(goes_back));
        found
    }

    /// Whether some family depends on its own earlier elements.
    pub(crate) fn is_recursive(&self) -> bool {
        self.factors.ids().any(|id| !self.earlier(id).is_empty())
    }

    /// What a form reads where the index at a depth is known: without the branches that are not taken there; with the node of each
    /// use, `None` for the keys of a table.
    pub(crate) fn uses_at(
        &self,
        factor: &Factor,
        depth: usize,
        index: i64,
    ) -> Vec<(Option<ExpressionId>, VariableUse)> {
        let number = |id: ExpressionId| self.evaluate_at(id, &|own| (own == depth).then_some(index as f64));
        let (mut forms, mut roots, mut uses) = (vec![&factor.form], Vec::new(), Vec::new());
        while let Some(form) = forms.pop() {
            match form {
                Form::If { condition, then, otherwise } => match number(*condition) {
                    Some(condition) => forms.push(if condition != 0.0 { then } else { otherwise }),
                    None => {
                        roots.push(*condition);
                        forms.extend([&**then, &**otherwise]);
                    }
                },
                form => {
                    if matches!(form, Form::Table(_) | Form::Constants(_) | Form::Unknown(_)) {
                        uses.extend(factor.right.iter().map(|use_| (None, use_.clone())));
                    }
                    form.each_expression(&mut |id| roots.push(id));
                }
            }
        }
        let mut seen = std::collections::HashSet::new();
        while let Some(id) = roots.pop() {
            if !seen.insert(id) {
                continue;
            }
            let node = &self.expressions[id];
            if let Expression::If { condition, then, otherwise } = node
                && let Some(condition) = number(*condition)
            {
                roots.push(if condition != 0.0 { *then } else { *otherwise });
                continue;
            }
            if let Expression::Variable(use_) = node {
                uses.push((Some(id), use_.clone()));
            }
            node.each_operand(&mut |operand| roots.push(operand));
        }
        uses
    }
}
