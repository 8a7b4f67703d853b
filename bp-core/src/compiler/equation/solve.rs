//! Sums over a Dirac of whole numbers, as reads at one value.
//!
//! In: a draft whose sums are in order. Out: the draft in which a sum over A of a product that contains
//! P(S | A …) = dirac(A + r) is the rest of the product at A = S − r, and 0 where that is outside the domain of A.
//! Invariant: r has whole values and does not depend on A, so that at most one value of A fulfils the Dirac.
//!
//! before: P(S) = Σ_D P(D) Σ_A P(A) P(S | A D)     |S| · |D| · |A| products
//! after:  P(S) = Σ_D P(D) P(A = S − D)             |S| · |D|

use super::draft::Draft;
use super::eliminate::size;
use super::{Binding, Term, elision, reachable};
use crate::analysis::{Scope, of_form};
use crate::ids::{ExpressionId, FactorId, Id, TermId, VariableId};
use crate::model::{Domain, Expression, Form, Model};
use crate::operators::{Binary, Unary};
use std::collections::BTreeMap;

/// Limit of the number of printed reasons.
const MOST_REASONS: usize = 4;

/// The one value of a variable that fulfils a Dirac: ±(`of` − Σ rest).
#[derive(Clone, PartialEq, Debug)]
pub struct Solution {
    /// The variable that the Dirac determines.
    pub of: VariableId,
    /// Whether the solved variable is subtracted in the Dirac's expression.
    pub negated: bool,
    /// The other operands; `true` for those that are subtracted in the Dirac's expression.
    pub rest: Vec<(bool, ExpressionId)>,
}

/// Whether the rule applies to the program.
fn applies(draft: &Draft<'_>) -> bool {
    let model = draft.model;
    let is_finite = || model.variables.values().all(|variable| variable.domain.is_finite());
    draft.options.rewrites.solve && model.plate.is_none() && is_finite()
}

/// The variables of which a factor leaves one value, given the others.
pub(super) fn by(draft: &Draft<'_>, term: TermId) -> Scope {
    match draft.terms[term] {
        Term::Factor(factor)
            if matches!(draft.model.factors[factor].form, Form::Dirac(_)) && applies(draft) =>
        {
            let parents = of_form(draft.model, factor);
            parents.into_iter().filter(|one| solution(draft, *one, factor).is_some()).collect()
        }
        _ => Scope::new(),
    }
}

pub(super) fn sums(draft: &mut Draft<'_>) {
    let model = draft.model;
    if !applies(draft) {
        return;
    }
    let mut new: BTreeMap<TermId, TermId> = BTreeMap::new();
    // Terms with virtual evidence are summed as logarithms.
    let mut weighed: Vec<bool> = Vec::with_capacity(draft.terms.len());
    let mut reasons = Vec::new();
    let reachable = reachable(&draft.terms, &draft.factors);
    let known: Vec<(TermId, Term)> = draft.terms.iter().map(|(id, term)| (id, term.clone())).collect();
    for (id, term) in known {
        let of = |id: &TermId| new.get(id).copied().unwrap_or(*id);
        weighed.push(match &term {
            Term::Likelihood(..) => true,
            Term::Product(factors) => factors.iter().any(|factor| weighed[factor.position()]),
            Term::Sum(_, body) | Term::Normalise(_, body) => weighed[body.position()],
            _ => false,
        });
        if !reachable.contains(&id) {
            continue;
        }
        let changed = match term {
            Term::Product(factors) if factors.iter().any(|factor| new.contains_key(factor)) => {
                Term::Product(factors.iter().map(of).collect())
            }
            Term::Sum(over, body) => {
                let factors = match &draft.terms[of(&body)] {
                    Term::Product(factors) => factors.clone(),
                    _ => vec![of(&body)],
                };
                let found = match over.as_slice() {
                    [variable] if !weighed[body.position()] => solved(draft, *variable, &factors),
                    _ => None,
                };
                match found {
                    Some((place, solution)) => {
                        let mut rest = factors;
                        rest.remove(place);
                        let rest = match rest.as_slice() {
                            [one] => *one,
                            _ => draft.terms.push(Term::Product(rest)),
                        };
                        let variable = over[0];
                        count(draft, variable);
                        draft.bindings.insert(variable, Binding::Solved(solution));
                        reasons.push(variable);
                        Term::At(variable, rest)
                    }
                    None if new.contains_key(&body) => Term::Sum(over, of(&body)),
                    None => continue,
                }
            }
            _ => continue,
        };
        let changed = draft.terms.push(changed);
        new.insert(id, changed);
    }
    if reasons.is_empty() {
        return;
    }
    draft.factors.iter_mut().for_each(|factor| *factor = new.get(factor).copied().unwrap_or(*factor));
    let one = |at: usize| {
        let name = model.variable_name(reasons[at]);
        let Some(Binding::Solved(solution)) = draft.bindings.get(&reasons[at]) else { return name };
        format!("{name} = {}", solution.text(model))
    };
    let shown = reasons.len().min(MOST_REASONS);
    let mut text: Vec<String> = (0..shown).map(one).collect();
    if reasons.len() > shown {
        text.push(format!("… ({} more)", elision::grouped(reasons.len() - shown)));
    }
    let reason =
        format!("one value fulfils the Dirac: {}; about {:.0} products", text.join("; "), draft.cost);
    draft.record("Dirac solved", reason);
}

/// The products of a solved sum: one for each number of its table.
fn count(draft: &mut Draft<'_>, variable: VariableId) {
    let values = size(draft.model, variable);
    let own = draft.eliminations.iter_mut().find(|elimination| elimination.variable == variable);
    if let Some(elimination) = own {
        draft.cost -= elimination.cost.entries * (values - 1.0);
        elimination.cost.multiplications /= values;
        elimination.cost.additions = 0.0;
    }
}

/// The Dirac among the factors of a sum that determines the summed variable, and the solution.
fn solved(draft: &Draft<'_>, variable: VariableId, factors: &[TermId]) -> Option<(usize, Solution)> {
    factors.iter().enumerate().find_map(|(place, term)| match draft.terms[*term] {
        Term::Factor(factor) => Some((place, solution(draft, variable, factor)?)),
        _ => None,
    })
}

fn solution(draft: &Draft<'_>, variable: VariableId, factor: FactorId) -> Option<Solution> {
    let model = draft.model;
    let factor = &model.factors[factor];
    let (Form::Dirac(root), [left], []) = (&factor.form, factor.left.as_slice(), factor.products.as_slice())
    else {
        return None;
    };
    let is_whole = |id: VariableId| is_whole(draft, id);
    if left.variable == variable || left.element.is_some() || !is_whole(variable) || !is_whole(left.variable)
    {
        return None;
    }
    let (mut open, mut rest, mut found) = (vec![(false, *root)], Vec::new(), None);
    while let Some((negated, id)) = open.pop() {
        match &model.expressions[id] {
            Expression::Binary(Binary::Add, one, other) => open.extend([(negated, *other), (negated, *one)]),
            Expression::Binary(Binary::Subtract, one, other) => {
                open.extend([(!negated, *other), (negated, *one)]);
            }
            Expression::Unary(Unary::Negate, one) => open.push((!negated, *one)),
            Expression::Number(number) if number.fract() == 0.0 => rest.push((negated, id)),
            Expression::Variable(use_) if use_.element.is_none() && use_.variable == variable => {
                if found.replace(negated).is_some() {
                    return None;
                }
            }
            Expression::Variable(use_) if use_.element.is_none() && is_whole(use_.variable) => {
                rest.push((negated, id));
            }
            _ => return None,
        }
    }
    Some(Solution { of: left.variable, negated: found?, rest })
}

/// Whether the values of a variable are whole numbers, in a range that is known.
fn is_whole(draft: &Draft<'_>, id: VariableId) -> bool {
    let variable = &draft.model.variables[id];
    let whole = match &variable.domain {
        Domain::Boolean => true,
        Domain::Finite { labels, .. } => labels.is_empty() && variable.domain.count().is_some(),
        _ => false,
    };
    whole && variable.family.is_none() && matches!(draft.bindings.get(&id), None | Some(Binding::Value(_)))
}

impl Solution {
    /// `S - D`
    pub(crate) fn text(&self, model: &Model) -> String {
        let operand = |id: ExpressionId| model.expression_text(id, &[]);
        self.written(&model.variable_name(self.of), operand, "-")
    }

    /// The operands in signs: those that are added first.
    pub(super) fn written(&self, of: &str, operand: impl Fn(ExpressionId) -> String, minus: &str) -> String {
        // A = S − Σ r, or A = Σ r − S.
        let mut terms = vec![(self.negated, of.to_owned())];
        terms.extend(self.rest.iter().map(|(negated, id)| (*negated == self.negated, operand(*id))));
        terms.sort_by_key(|(subtracted, _)| *subtracted);
        let mut text = String::new();
        for (place, (subtracted, operand)) in terms.iter().enumerate() {
            match (place, subtracted) {
                (0, false) => {}
                (0, true) => text.push_str(minus),
                (_, false) => text.push_str(" + "),
                (_, true) => {
                    text.push_str(&format!(" {minus} "));
                }
            }
            text.push_str(operand);
        }
        text
    }
}
