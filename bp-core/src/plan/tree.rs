//! Thousands of factors: a join tree answers what would take as many loops.
//!
//! In: asks of a program of many factors, all finite, without a plate. Out: a [`JoinTree`]: the sum of products that is
//! computed, without an order of the sums, which the tree finds (`crate::tree`). Invariant: barren factors have gone
//! already, by the rule that keeps improper ones; what is left is the same sum that loops would compute.

use super::draft::Draft;
use super::{Exact, Options, Term, barren, sampled};
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Model};

/// With more factors than these, a tree is found faster than loops are written.
pub const MANY_FACTORS: usize = 2000;

/// An answer by sums and products over a join tree.
#[derive(Clone, PartialEq, Debug)]
pub struct JoinTree {
    /// The sum of products, its sums in no order: what is asked, what variables stand for, the derivation.
    pub exact: Exact,
    /// The factors of the product.
    pub factors: Vec<FactorId>,
    /// Virtual evidence: variables with a likelihood for each value.
    pub likelihoods: Vec<(VariableId, Vec<f64>)>,
}

/// A join tree, where many factors are left that all have tables.
pub(super) fn plan(model: &Model, asks: &[Ask], options: Options) -> Option<JoinTree> {
    if model.plate.is_some() || model.factors.len() <= MANY_FACTORS {
        return None;
    }
    let mut draft = Draft::define(model, asks.to_vec(), options);
    draft.marginalise();
    draft.decompose();
    draft.condition();
    barren::remove(&mut draft);
    let (mut factors, mut likelihoods) = (Vec::new(), Vec::new());
    for term in &draft.factors {
        match &draft.terms[*term] {
            Term::Factor(factor) if has_table(model, *factor) => factors.push(*factor),
            Term::Likelihood(variable, weights) => likelihoods.push((*variable, weights.clone())),
            _ => return None,
        }
    }
    let is_finite = |variable: &VariableId| model.variables[*variable].domain.is_finite();
    let asked = draft.searched.iter().chain(&draft.each).all(is_finite);
    (asked && factors.len() > MANY_FACTORS).then(|| JoinTree {
        exact: draft.unordered(),
        factors,
        likelihoods,
    })
}

/// Whether a factor is a table of numbers once its parameters have values.
fn has_table(model: &Model, factor: FactorId) -> bool {
    let factor = &model.factors[factor];
    let mut uses = factor.left.iter().chain(&factor.right);
    uses.all(|use_| model.variables[use_.variable].domain.is_finite())
        && sampled::refused_factor(model, factor).is_none()
}
