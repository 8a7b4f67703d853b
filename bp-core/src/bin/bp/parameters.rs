//! How much a decomposition saves: its free parameters beside those of the joint distribution.
//!
//! In: a model. Out: counts. Invariant: nothing is said where a count depends on sizes or on reals.

use bp_core::model::{Factor, Form, Model, VariableUse};

/// The counts, as a sentence.
pub(crate) fn in_words(model: &Model) -> String {
    let factors = match model.factors.len() {
        1 => "1 factor".to_owned(),
        several => format!("{several} factors"),
    };
    let whole = model.variables.ids().filter(|id| Some(*id) != model.plate_index());
    let joint = whole.map(|id| values(model, &VariableUse::from(id))).product::<Option<f64>>();
    match (free(model), joint) {
        (Some(free), Some(joint)) => format!(
            "{factors} with {free} free parameters; a table of the joint distribution would have {}",
            joint - 1.0
        ),
        _ => format!("{factors}; how many free parameters depends on sizes, or on reals"),
    }
}

/// Σ over factors of Π|right| · (Π|left| − 1), where all is finite and known; a Dirac has none.
pub(crate) fn free(model: &Model) -> Option<f64> {
    let of_factor = |factor: &Factor| {
        if let Form::Dirac(_) = factor.form {
            return Some(0.0);
        }
        let count = |uses: &[VariableUse]| {
            let uses = uses.iter().filter(|use_| Some(use_.variable) != model.plate_index());
            uses.map(|use_| values(model, use_)).product::<Option<f64>>()
        };
        let repeated = factor.products.iter().map(|(_, over)| Some(model.index_count(over)? as f64));
        Some(count(&factor.right)? * (count(&factor.left)? - 1.0) * repeated.product::<Option<f64>>()?)
    };
    model.factors.values().map(of_factor).sum()
}

/// How many values a use of a variable has: a whole family has those of all its elements together.
fn values(model: &Model, use_: &VariableUse) -> Option<f64> {
    let variable = &model.variables[use_.variable];
    let one = variable.domain.count()? as f64;
    match (&variable.family, use_.element) {
        (Some(family), None) => {
            let elements = model.index_count(&family.over)? - usize::from(family.except.is_some());
            Some(one.powi(elements as i32))
        }
        _ => Some(one),
    }
}
