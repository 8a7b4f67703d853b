//! Chains as scans instead of enumerations.
//!
//! In: a draft. Out: the draft in which the sum over a hidden family of booleans, of which only the first true
//! one matters, is a [`FirstScan`]. Invariant: the elements are independent of each other given the rest.
//!
//! before: Σ_G Π_j P(G\[j\] | …) P(Z | first(G with O at C))      2^(N−1) terms
//! after:  A_C + s_C · (P_C if O, else R_C)                      O(N), with p_j = P(G\[j\] = true | …) and
//!         s_k = Π_{j<k} (1 − p_j), A_k = Σ_{j<k} s_j p_j P_j, R_k = p_{k+1} P_{k+1} + (1 − p_{k+1}) R_{k+1},
//!         R_N = P_∅.  No division: p_j may be 1.
//!
//! Yguel, Aycard and Laugier, Int. J. Vehicle Autonomous Systems 6:48–83, 2008, in closed form.

use super::draft::Draft;
use super::{FirstScan, Term, scope};
use crate::analysis::of_form;
use crate::ids::{ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Domain, Expression, Model};

pub(super) fn chains(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.scan {
        return;
    }
    for variable in draft.free.clone() {
        let Some((scan, positions)) = find(draft, variable) else { continue };
        let name = draft.model.variable_name(variable);
        let mut position = 0;
        draft.factors.retain(|_| {
            position += 1;
            !positions.contains(&(position - 1))
        });
        let term = draft.terms.push(Term::FirstScan(scan));
        draft.factors.push(term);
        draft.free.remove(&variable);
        let reason =
            format!("`{name}` matters only through its first true element: 2^N hidden states cost O(N)");
        draft.record("chain scan", reason);
    }
}

fn find(draft: &Draft<'_>, family: VariableId) -> Option<(FirstScan, [usize; 2])> {
    let model = draft.model;
    let variable = &model.variables[family];
    if variable.domain != Domain::Boolean || variable.family.is_none() {
        return None;
    }
    // A factor that depends on the family through a substituted Dirac depends on it too.
    let depends =
        |term: &TermId| scope::of_term(model, &draft.terms, &draft.bindings, *term).contains(&family);
    let dependent: Vec<(usize, TermId)> =
        draft.factors.iter().copied().enumerate().filter(|(_, term)| depends(term)).collect();
    let [(a, first), (b, second)] = dependent.as_slice() else { return None };
    let (Term::Factor(first), Term::Factor(second)) = (&draft.terms[*first], &draft.terms[*second]) else {
        return None;
    };
    let distributes =
        |factor: FactorId| model.factors[factor].left.iter().any(|use_| use_.variable == family);
    let (prior, factor) = if distributes(*first) { (*first, *second) } else { (*second, *first) };
    // The elements must be independent, and the other factor may depend only on the first true one.
    let independent = distributes(prior) && !of_form(model, prior).contains(&family);
    let mut uses = Vec::new();
    model.factors[factor]
        .form
        .each_expression(&mut |expression| first_uses(model, expression, family, &mut uses));
    let with = uses.first().cloned().flatten()?;
    let same = uses.iter().all(|use_| *use_ == Some(with));
    (independent && same).then_some((FirstScan { family, prior, factor, with }, [*a, *b]))
}

/// The use of a family in an expression: `Some(with)` for each `first`, `None` for any other use.
fn first_uses(
    model: &Model,
    id: ExpressionId,
    family: VariableId,
    uses: &mut Vec<Option<Option<(ExpressionId, ExpressionId)>>>,
) {
    for id in model.nodes_below(id) {
        match &model.expressions[id] {
            Expression::First { family: of, with } if *of == family => uses.push(Some(*with)),
            Expression::Variable(use_) if use_.variable == family => uses.push(None),
            _ => {}
        }
    }
}
