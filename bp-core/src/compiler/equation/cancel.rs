//! Cancellation: factors common to numerator and normalising constant, and a normalising constant of 1.
//!
//! In: a draft. Out: the draft without them. Invariant: if ln P(evidence) is needed, none of its factors is removed; a
//! factor that can be 0 is replaced by an indicator, since a context of probability zero has an answer of zeros.
//!
//! before: P(C) P(O | C) P(Z | O C) / Σ_Z …      after: P(Z | O C)

use super::draft::Draft;
use super::{Term, elision};
use crate::analysis::{is_proper, of_factor};
use crate::ids::ExpressionId;
use crate::law::Law;
use crate::model::{Form, Model};
use std::collections::HashSet;

/// The rule by which constants are dropped.
pub(super) const CONSTANTS: &str = "cancellation";

/// Removes factors of known variables only, and uniform factors, which are constants.
pub(super) fn constants(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.cancel || draft.options.ln_evidence {
        return;
    }
    let (mut dropped, mut reduced) = (Vec::new(), Vec::new());
    let factors = std::mem::take(&mut draft.factors);
    for term in factors {
        let Term::Factor(factor) = draft.terms[term] else {
            draft.factors.push(term);
            continue;
        };
        let known = |variable| draft.is_known(variable);
        let all_known = of_factor(draft.model, factor).into_iter().all(known);
        if all_known && !is_positive(draft.model, &draft.model.factors[factor].form) {
            let possible = draft.terms.push(Term::Possible(factor));
            draft.factors.push(possible);
            reduced.push(draft.model.head(&draft.model.factors[factor]));
            continue;
        }
        let left = &draft.model.factors[factor].left;
        // A uniform factor of a summed variable is the same number in every term of the sum.
        let uniform = matches!(draft.model.factors[factor].form, Form::Uniform)
            && left
                .iter()
                .all(|use_| draft.free.contains(&use_.variable) && !is_family(draft, use_.variable));
        match all_known || uniform {
            true => dropped.push(draft.model.head(&draft.model.factors[factor])),
            false => draft.factors.push(term),
        }
    }
    if !dropped.is_empty() {
        draft.record(CONSTANTS, format!("constant in the normalisation: {}", listed(&dropped)));
    }
    if !reduced.is_empty() {
        let reason = format!("constant in the normalisation, unless it is 0: {}", listed(&reduced));
        draft.record(CONSTANTS, reason);
    }
}

/// Heads of factors, a long list shortened.
fn listed(heads: &[String]) -> String {
    let others = |count| format!("… ({} more)", elision::grouped(count));
    elision::list(heads.len(), |at| heads[at].clone(), others).join(", ")
}

/// Whether a form gives no value probability 0, whatever its parents are.
fn is_positive(model: &Model, form: &Form) -> bool {
    let positive = |id: &ExpressionId| model.constant(*id).is_some_and(|p| p > 0.0);
    match form {
        Form::Uniform | Form::Law { law: Law::Normal, .. } => true,
        Form::Mixture(parts) => {
            parts.iter().any(|(weight, part)| positive(weight) && is_positive(model, part))
        }
        Form::Bernoulli(p, None) => model.constant(*p).is_some_and(|p| p > 0.0 && p < 1.0),
        Form::Bernoulli(p, Some(other)) => positive(p) && positive(other),
        Form::Categorical(entries) => entries.iter().all(positive),
        Form::Table(rows) => rows.iter().flatten().all(positive),
        Form::Constants(numbers) => numbers.iter().all(|p| *p > 0.0),
        Form::If { then, otherwise, .. } => is_positive(model, then) && is_positive(model, otherwise),
        _ => false,
    }
}

fn is_family(draft: &Draft<'_>, variable: crate::ids::VariableId) -> bool {
    draft.model.variables[variable].family.is_some()
}

/// Removes the normalising constant if the rest is a product of distributions of searched and free variables only.
pub(super) fn normaliser(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.cancel || draft.options.ln_evidence {
        return;
    }
    let mut distributed = HashSet::new();
    let proper = draft.factors.iter().all(|term| match &draft.terms[*term] {
        Term::Factor(factor) => {
            let left = draft.model.factors[*factor].left.iter().map(|use_| use_.variable);
            distributed.extend(left.clone());
            left.into_iter().all(|variable| !draft.is_known(variable)) && is_proper(draft.model, *factor)
        }
        Term::FirstScan(scan) => {
            let left = draft.model.factors[scan.factor].left.iter().map(|use_| use_.variable);
            distributed.extend(left.clone());
            left.into_iter().all(|variable| !draft.is_known(variable))
                && is_proper(draft.model, scan.factor)
                && is_proper(draft.model, scan.prior)
        }
        Term::Possible(_) => true,
        _ => false,
    });
    // Every remaining free variable must still have its own distribution in the product.
    let whole = draft.free.iter().chain(&draft.searched).all(|variable| distributed.contains(variable));
    if proper && whole {
        draft.normalise = false;
        draft.record("normaliser", "the remaining product of distributions sums to one".to_owned());
    }
}
