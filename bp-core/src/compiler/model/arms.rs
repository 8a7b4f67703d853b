//! The arms of a long `match` of a finite variable.
//!
//! In: a chain of choices `if X == 3 { a } else { if X == 4 { b } else { … } }`. Out: the arm at each value of X. Invariant: the
//! arm of a value is the one that the chain selects; a value without an arm has the rest of the chain.

use super::{Domain, Expression, Model};
use crate::ids::{ExpressionId, VariableId};
use crate::operators::Binary;

/// Chains with fewer arms stay choices.
const MANY: usize = 64;

/// The most values of a variable.
const MOST: usize = 1 << 24;

/// A chain of choices by the value of one variable.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Arms {
    /// The variable.
    pub(crate) variable: VariableId,
    /// The arm of each value, by its ordinal.
    pub(crate) at: Vec<Option<ExpressionId>>,
    /// The expression for all other values.
    pub(crate) rest: ExpressionId,
}

impl Arms {
    /// The expression that the chain selects at a value of its variable.
    pub(crate) fn selected(&self, ordinal: f64) -> ExpressionId {
        let inside = ordinal >= 0.0 && ordinal.fract() == 0.0;
        inside.then(|| self.at.get(ordinal as usize).copied().flatten()).flatten().unwrap_or(self.rest)
    }
}

impl Model {
    /// The arms of a chain of at least 64 choices that begins here; all arms but the rest are such as is wanted.
    pub(crate) fn arms(&self, id: ExpressionId, is_wanted: impl Fn(&Expression) -> bool) -> Option<Arms> {
        let (variable, _, _) = self.arm(id)?;
        let (mut arms, mut rest) = (Vec::new(), id);
        while let Some((other, arm, otherwise)) = self.arm(rest)
            && other == variable
            && is_wanted(&self.expressions[arm.1])
        {
            arms.push(arm);
            rest = otherwise;
        }
        let declared = &self.variables[variable];
        let count = declared.domain.count().filter(|count| *count <= MOST)?;
        let is_plain = matches!(declared.domain, Domain::Finite { .. }) && declared.family.is_none();
        if !is_plain || arms.len() < MANY {
            return None;
        }
        let (base, mut at) = (declared.domain.base(), vec![None; count]);
        // The first arm of a value counts.
        for (value, arm) in arms.into_iter().rev() {
            let ordinal = value - base as f64;
            if ordinal.fract() == 0.0 && ordinal >= 0.0 && ordinal < count as f64 {
                at[ordinal as usize] = Some(arm);
            }
        }
        Some(Arms { variable, at, rest })
    }

    /// The expression that one choice by a value of a variable leaves for all other values.
    pub(crate) fn after_arm(&self, id: ExpressionId) -> Option<ExpressionId> {
        self.arm(id).map(|(_, _, otherwise)| otherwise)
    }

    /// One choice: the variable, its value and the expression selected there, and the expression for all other values.
    fn arm(&self, id: ExpressionId) -> Option<(VariableId, (f64, ExpressionId), ExpressionId)> {
        let Expression::If { condition, then, otherwise } = &self.expressions[id] else { return None };
        let Expression::Binary(Binary::Equal, left, right) = &self.expressions[*condition] else {
            return None;
        };
        let (Expression::Variable(use_), Expression::Number(value)) =
            (&self.expressions[*left], &self.expressions[*right])
        else {
            return None;
        };
        use_.element.is_none().then_some((use_.variable, (*value, *then), *otherwise))
    }
}
