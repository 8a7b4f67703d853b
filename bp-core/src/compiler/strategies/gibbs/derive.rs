//! The derivation of an answer by Gibbs sampling.
//!
//! In: a route. Out: its lines: what is integrated out, what is drawn. Invariant: a form is named as in the program.

use crate::analysis::of_form;
use crate::equation::{Line, Notation};
use crate::ids::{FactorId, VariableId};
use crate::model::Model;
use crate::strategies::weighting::Sampled;

/// The lines of a route.
pub(crate) fn derivation(model: &Model, route: &Sampled, notation: Notation) -> Vec<Line> {
    let space = notation.text(" ", "\\, ");
    let plain = |ids: &[VariableId]| {
        let names: Vec<String> = ids.iter().map(|id| format!("`{}`", model.variable_name(*id))).collect();
        names.join(", ")
    };
    let mut lines = Vec::new();
    if !route.integrated.is_empty() {
        let reads = |id: &FactorId| {
            let left = model.factors[*id].left.iter().map(|use_| use_.variable);
            left.chain(of_form(model, *id)).any(|variable| route.integrated.contains(&variable))
        };
        let heads = route.steps.iter().map(|(id, _)| *id).filter(|id| reads(id));
        let heads: Vec<String> = heads.map(|id| notation.head(model, &model.factors[id])).collect();
        let over: Vec<String> = notation.names(model, &route.integrated);
        let over: Vec<String> =
            over.iter().map(|name| format!("{}{name}", notation.text("d", "\\mathrm{d}"))).collect();
        let integral = notation.text("∫ ", "\\int ");
        let text = format!("{integral}{}{space}{}", heads.join(&space), over.join(&space));
        let names = plain(&route.integrated);
        let reason = format!(
            "linear and Gaussian given the others: {names} are integrated out, and drawn after a sweep if they are asked"
        );
        lines.push(("integral".to_owned(), reason, text));
    }
    let left = |id: &FactorId| model.factors[*id].left.iter().map(|use_| use_.variable).collect::<Vec<_>>();
    let known = |id: &VariableId| route.asks[0].known.iter().any(|known| known.variable == *id);
    let drawn = route.steps.iter().flat_map(|(id, _)| left(id));
    let drawn: Vec<VariableId> = drawn.filter(|id| !known(id) && !route.integrated.contains(id)).collect();
    if !drawn.is_empty() {
        let names = plain(&drawn);
        let reason = format!(
            "{names}: finite ones are summed out where the tables are small, the others drawn in turn, each given all that is drawn"
        );
        let conditional =
            |name: String| notation.distribution(&[name], &[notation.text("all else", "\\text{all else}")]);
        let all: Vec<String> = notation.names(model, &drawn).into_iter().map(conditional).collect();
        lines.push(("full conditionals".to_owned(), reason, all.join(&space)));
    }
    lines
}
