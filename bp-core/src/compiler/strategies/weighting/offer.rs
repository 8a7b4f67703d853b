//! The offer of sampling: estimates from draws, where no exact route answers.
//!
//! In: a model, asks, and the reason why no exact route answers them. Out: a [`Sampled`] route: the relevant factors,
//! parents first, and the treatment of each. Invariant: observations weigh draws; a Dirac on an observed real, which a
//! draw meets with probability zero, is solved for one of its parents, or refused.
//!
//! P(S = s | K = k) ≈ Σₙ wₙ [Sⁿ = s] / Σₙ wₙ,  wₙ = Π_K P(k | parentsⁿ)   (likelihood weighting: Fung and Chang 1990)
//!
//! Solved: with X = a Y + b observed, Y = (x − b) / a, and the weight is p(Y | parents) / |a|.

use super::preferred::{is_long, moves_reals};
use super::refusal::{refused_ask, refused_factor};
use crate::analysis::{of_form, relevant_factors};
use crate::equation::{Group, Line, Notation, Strategy};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Ask, Domain, Expression, Finding, Form, Model, Question, in_order};
use crate::strategies::conjugate::{Summed, marginalised};
use crate::strategies::gibbs::{chooses_labels, derivation, integrated};
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn};
use std::collections::HashSet;

/// The treatment of a factor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Treatment {
    /// Its left-hand side is drawn.
    Drawn,
    /// Its left-hand side is observed: the draw is weighed.
    Weighed,
    /// Its left-hand side is the solution of this observed Dirac.
    Solved(FactorId),
}

/// An answer by draws.
#[derive(Clone, PartialEq, Debug)]
pub struct Sampled {
    /// The asks, all with the same known variables.
    pub asks: Vec<Ask>,
    /// The factors, parents first, without those that are solved for; and the treatment of each.
    pub steps: Vec<(FactorId, Treatment)>,
    /// The reason why no exact route answers.
    pub reason: String,
    /// Whether an exact answer exists, but exceeds the user's budget.
    pub over_budget: bool,
    /// Likelihood weighting or Gibbs sampling.
    pub by: Strategy,
    /// The reals that Gibbs sampling integrates out.
    pub integrated: Vec<VariableId>,
    /// Whether there are so many observations that few draws of the prior agree with them.
    pub(crate) many: bool,
    /// The unknowns of what is observed, where their posteriors are known: they are drawn from these.
    pub(crate) conjugate: Option<Summed>,
    /// Whether the elements of a family depend on hidden finite elements of their own.
    pub(super) labels: bool,
    /// Whether a long family is observed, and a real on which others depend is drawn.
    pub(super) long: bool,
    /// Whether weighted draws answer where no chain moves.
    pub(crate) or_weighting: bool,
}

/// More observations than this are many; the elements of a family are many.
pub(super) const MANY: usize = 8;

/// Plans draws.
///
/// # Errors
/// A factor that can be neither drawn nor weighed; the error also gives the reason why there is no exact answer.
fn offer(
    model: &Model,
    asks: Vec<Ask>,
    reason: String,
    by: Strategy,
    turn: &Turn<'_>,
) -> Result<Sampled, Error> {
    let question = model.ask_text(&asks[0]);
    let refused = |why: String| {
        // If the user chose this strategy, the reasons of the others are left out.
        let reason = if turn.forced { why } else { format!("{reason}; and {why}") };
        Error::Unplanned { question: question.clone(), reason }
    };
    if turn.options.group == Group::Information {
        return Err(refused("the information of observations is not estimated by draws".to_owned()));
    }
    if let Some(why) = asks.iter().find_map(|ask| refused_ask(model, ask)) {
        return Err(refused(why));
    }
    let observed: Vec<VariableId> =
        asks[0].known.iter().filter(|known| is_hard(&known.evidence)).map(|known| known.variable).collect();
    let factors = relevant_factors(model, &asks);
    // A vector that is distributed as a whole has no kernel, even where it is observed.
    let hidden_real = |id: &FactorId| {
        let left = &model.factors[*id].left;
        model.factors[*id].form.couples()
            || left.iter().any(|use_| {
                !observed.contains(&use_.variable) && !model.variables[use_.variable].domain.is_finite()
            })
    };
    // A finite program is refused for its size or its form: that should be mended, not replaced by an estimate.
    if !(turn.forced || turn.over_budget || factors.iter().any(hidden_real)) {
        return Err(Error::Unplanned { question, reason });
    }
    if let Some(why) = factors.iter().find_map(|id| refused_factor(model, &model.factors[*id])) {
        return Err(refused(why));
    }
    let improper = |id: &&FactorId| model.factors[**id].form.is_improper();
    if let Some(id) = factors.iter().find(improper).filter(|_| by == Strategy::Weighting) {
        let head = model.head(&model.factors[*id]);
        return Err(refused(format!("`{head}` is improper: {}", Form::FLAT)));
    }
    let steps = steps(model, &factors, &observed, by).map_err(refused)?;
    let known: Vec<VariableId> = asks[0].known.iter().map(|known| known.variable).collect();
    let integrated = match by {
        Strategy::Gibbs => integrated(model, &steps, &observed, &known),
        _ => Vec::new(),
    };
    // Named by the user, it weighs draws of the prior.
    let conjugate = if turn.forced { None } else { marginalised(model, &asks) };
    let many = known.len() > MANY || known.iter().any(|id| model.variables[*id].family.is_some());
    let labels = factors.iter().any(|id| chooses_labels(model, *id, &observed));
    let long = known.len() > MANY || known.iter().any(|id| is_long(model, *id));
    let long = long && moves_reals(model, &steps);
    Ok(Sampled {
        asks,
        steps,
        reason,
        over_budget: turn.over_budget,
        by,
        integrated,
        many,
        conjugate,
        labels,
        long,
        or_weighting: false,
    })
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        drawn(model, asks, turn, Strategy::Weighting)
    }
}

/// The offer of either sampling strategy.
pub(crate) fn drawn(model: &Model, asks: &[Ask], turn: &Turn<'_>, by: Strategy) -> Result<Route, Error> {
    let reason = match turn.not_exact {
        Some(Error::Unplanned { reason, .. }) => reason.clone(),
        Some(other) => other.to_string(),
        None => "it has an exact answer".to_owned(),
    };
    Ok(Route::Sampled(offer(model, asks.to_vec(), reason, by, turn)?))
}

impl Offered for Sampled {
    fn strategy(&self) -> Strategy {
        self.by
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    fn reason(&self) -> &'static str {
        match self.over_budget {
            true => "estimated, by draws: an exact answer takes more products than the budget",
            false => "estimated, by draws: a summed variable is neither finite nor linear and Gaussian",
        }
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        (self.derivation(model, notation), Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some(format!("{}; draws are made by `answer::ask`, not by emitted code", self.reason))
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

fn is_hard(evidence: &Finding) -> bool {
    matches!(evidence, Finding::Hard(_) | Finding::Each)
}

/// Orders the factors so that each comes after those that it needs.
fn steps(
    model: &Model,
    factors: &[FactorId],
    observed: &[VariableId],
    by: Strategy,
) -> Result<Vec<(FactorId, Treatment)>, String> {
    let mut solved: Vec<(FactorId, FactorId)> = Vec::new();
    for id in factors {
        let factor = &model.factors[*id];
        let left = factor.left[0].variable;
        if model.variables[left].domain.is_finite() || !observed.contains(&left) || !factor.form.has_point() {
            continue;
        }
        // The component itself is observed.
        if model.named_component(left).is_some() {
            continue;
        }
        // Draws of finite variables meet its values. (Chains would not leave the first one that they meet.)
        let is_hidden = |id: &VariableId| !observed.contains(id) && model.variables[*id].domain.is_finite();
        let may_be_met = by == Strategy::Weighting || !of_form(model, *id).iter().any(is_hidden);
        if may_be_met && model.is_determined(left, &|id| observed.contains(&id)) {
            continue;
        }
        let name = model.variable_name(left);
        let Form::Dirac(value) = factor.form else {
            return Err(format!("`{name}` is observed, but has a `dirac` in part of its form"));
        };
        let free = |candidate: &FactorId| {
            let of = &model.factors[*candidate];
            of.left.len() == 1
                && !observed.contains(&of.left[0].variable)
                && model.variables[of.left[0].variable].domain == Domain::Real
                && model.variables[of.left[0].variable].family.is_none()
                && of.products.is_empty()
                && !of.form.has_point()
                && solved.iter().all(|(taken, _)| taken != candidate)
        };
        let parent = factors.iter().copied().filter(free).find(|candidate| {
            let mut with = solved.clone();
            with.push((*candidate, *id));
            factor.left.len() == 1
                && factor.products.is_empty()
                && model.variables[left].domain == Domain::Real
                && can_be_solved(model, value, model.factors[*candidate].left[0].variable)
                && ordered(model, factors, observed, &with).is_some()
        });
        match parent {
            Some(parent) => solved.push((parent, *id)),
            None => {
                return Err(format!(
                    "`{name}` is observed, and its `dirac` is linear in no parent that could be solved for: \
                     no draw would ever meet the value; observe it with some noise, `normal(…, deviation)`"
                ));
            }
        }
    }
    Ok(ordered(model, factors, observed, &solved).expect("internal: the order was tried before"))
}

/// The steps in order; `None` where the equations to solve are circular.
fn ordered(
    model: &Model,
    factors: &[FactorId],
    observed: &[VariableId],
    solved: &[(FactorId, FactorId)],
) -> Option<Vec<(FactorId, Treatment)>> {
    let rest: Vec<FactorId> =
        factors.iter().copied().filter(|id| solved.iter().all(|(_, dirac)| dirac != id)).collect();
    let observed: HashSet<VariableId> = observed.iter().copied().collect();
    let dirac_of = |id: &FactorId| solved.iter().find(|(parent, _)| parent == id).map(|(_, dirac)| *dirac);
    // Observed values are available from the start; earlier elements of families are put in order with all instances.
    let needs = |id: &FactorId| {
        let earlier = model.earlier(*id);
        let dirac = dirac_of(id).map(|dirac| of_form(model, dirac)).unwrap_or_default();
        let all = of_form(model, *id).into_iter().filter(|need| !earlier.contains(need)).chain(dirac);
        all.filter(|need| !observed.contains(need)).collect::<Vec<_>>()
    };
    let gives = |id: &FactorId| model.factors[*id].left.iter().map(|use_| use_.variable).collect::<Vec<_>>();
    let (needs, gives): (Vec<_>, Vec<_>) = rest.iter().map(|id| (needs(id), gives(id))).unzip();
    let order = in_order(&needs, &gives)?;
    let treated = |position: usize| {
        let treatment = match dirac_of(&rest[position]) {
            Some(dirac) => Treatment::Solved(dirac),
            None if gives[position].iter().all(|given| observed.contains(given)) => Treatment::Weighed,
            None => Treatment::Drawn,
        };
        (rest[position], treatment)
    };
    Some(order.into_iter().map(treated).collect())
}

/// Whether an expression is linear in one variable, with a coefficient that does not depend on a condition.
fn can_be_solved(model: &Model, id: ExpressionId, variable: VariableId) -> bool {
    let degrees = model.degrees(id, &|one| one == variable);
    let chooses = |id: &ExpressionId| {
        matches!(model.expressions[*id], Expression::If { .. }) && *degrees.of(*id) != Some(0)
    };
    *degrees.of(id) == Some(1) && !model.nodes_below(id).iter().any(chooses)
}

impl Sampled {
    /// The estimator, as lines: which variables are drawn, which are weighed.
    pub(crate) fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let searched: Vec<VariableId> =
            self.asks[0].searched.iter().map(|searched| searched.variable).collect();
        let mut right: Vec<VariableId> = self.asks[0].known.iter().map(|known| known.variable).collect();
        right.extend(model.plate_index().filter(|index| !right.contains(index)));
        let names = notation.names(model, &searched);
        let left = notation.distribution(&names, &notation.names(model, &right));
        let head = |id: FactorId| notation.head(model, &model.factors[id]);
        let of = |wanted: &dyn Fn(Treatment) -> bool| {
            self.steps
                .iter()
                .filter(|(_, treatment)| wanted(*treatment))
                .map(|(id, _)| head(*id))
                .collect::<Vec<_>>()
        };
        let list = names.join(&notation.text(" ", "\\, "));
        let draw = |name: &String| format!("{name}{}", notation.text("ⁿ", "^{(n)}"));
        let draws = names.iter().map(draw).collect::<Vec<_>>().join(&notation.text(" ", "\\, "));
        // Chains, and draws of an exact posterior, have no weights.
        let equal = self.by == Strategy::Gibbs || self.conjugate.is_some();
        let estimator = match notation {
            Notation::Unicode if equal => format!("{left} ≈ 1/N Σₙ [{draws} = {list}]"),
            Notation::Latex if equal => {
                format!("{left} \\approx \\frac{{1}}{{N}} \\sum_n [{draws} = {list}]")
            }
            Notation::MathMl if equal => {
                let part = "<mfrac><mn>1</mn><mi>N</mi></mfrac><msub><mo>Σ</mo><mi>n</mi></msub>";
                format!("{left}<mo>≈</mo>{part}<mo>[</mo>{draws}<mo>=</mo>{list}<mo>]</mo>")
            }
            Notation::Unicode => format!("{left} ≈ Σₙ wₙ [{draws} = {list}] / Σₙ wₙ"),
            Notation::Latex => {
                format!("{left} \\approx \\frac{{\\sum_n w_n\\, [{draws} = {list}]}}{{\\sum_n w_n}}")
            }
            Notation::MathMl => {
                let sum = "<msub><mo>Σ</mo><mi>n</mi></msub><msub><mi>w</mi><mi>n</mi></msub>";
                let counted = format!("<mrow>{sum}<mo>[</mo>{draws}<mo>=</mo>{list}<mo>]</mo></mrow>");
                format!("{left}<mo>≈</mo><mfrac>{counted}<mrow>{sum}</mrow></mfrac>")
            }
        };
        if self.by == Strategy::Gibbs {
            let none = if self.over_budget { "" } else { "no exact strategy applies: " };
            let reason = format!("{none}{}; the answer is estimated by Markov chains", self.reason);
            let mut lines = derivation(model, self, notation);
            lines.push(("Gibbs sampling".to_owned(), reason, estimator));
            return lines;
        }
        if let Some(posterior) = &self.conjugate {
            let drawn = notation.names(model, &posterior.unknowns(model));
            let draws = notation.text("draw ~ ", "\\text{draw} \\sim ");
            let from = notation.distribution(&drawn, &notation.names(model, &right));
            let reason = "what is observed is conjugate to the priors: the unknowns are drawn from their exact posterior, and all else \
                          from its own form";
            let none = if self.over_budget { "" } else { "no exact strategy applies: " };
            let last = format!("{none}{}; the answer is estimated by draws", self.reason);
            return vec![
                ("conjugate".to_owned(), reason.to_owned(), format!("{draws}{from}")),
                ("draws of the posterior".to_owned(), last, estimator),
            ];
        }
        let mut lines = Vec::new();
        let space = notation.text(" ", "\\, ");
        let drawn = of(&|treatment| treatment == Treatment::Drawn);
        if !drawn.is_empty() {
            let reason = "each variable is drawn from its own form, parents first".to_owned();
            let draws = notation.text("draw ~ ", "\\text{draw} \\sim ");
            lines.push(("proposal".to_owned(), reason, format!("{draws}{}", drawn.join(&space))));
        }
        for (id, treatment) in &self.steps {
            let Treatment::Solved(dirac) = treatment else { continue };
            let (solved, seen) = (&model.factors[*id].left[0], &model.factors[*dirac].left[0]);
            let (solved, seen) = (model.variable_name(solved.variable), model.variable_name(seen.variable));
            let reason =
                format!("`{seen}` is observed and linear in `{solved}`, which is solved for and weighted");
            let form = notation.text(" / |a|", " / |a|");
            lines.push(("Dirac solved".to_owned(), reason, format!("{}{form}", head(*id))));
        }
        let weighed = of(&|treatment| treatment == Treatment::Weighed);
        let reason = match weighed.is_empty() {
            true => "no observation weights the draws".to_owned(),
            false => "the observations weight each draw".to_owned(),
        };
        let weight = if weighed.is_empty() { "1".to_owned() } else { weighed.join(&space) };
        lines.push(("weights".to_owned(), reason, format!("{}{weight}", notation.text("wₙ = ", "w_n = "))));
        let none = if self.over_budget { "" } else { "no exact strategy applies: " };
        let reason = format!("{none}{}; the answer is estimated by draws", self.reason);
        lines.push(("likelihood weighting".to_owned(), reason, estimator));
        lines
    }
}
