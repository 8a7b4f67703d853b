//! What the conjugate strategy offers.
//!
//! In: asks that know the same. Out: a [`Conjugate`], or why not. Invariant: every unobserved variable that matters is an unknown
//! with a conjugate prior, or a finite one that is predicted alone.

use super::likelihood::{Kind, is_conjugate};
use crate::equation::{CLOSE, Line, Notation, OPEN, Strategy, of_form};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::law::Law;
use crate::model::{Ask, DerivedKind, Expression, Finding, Form, Model, Question, Statistic};
use crate::strategies::gaussian::of_normal;
use crate::strategies::weighting::{refused_factor, relevant};
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn, refused};

/// An answer by conjugate priors.
#[derive(Clone, PartialEq, Debug)]
pub struct Conjugate {
    /// What is asked.
    pub asks: Vec<Ask>,
    /// The forms of the unknowns.
    pub priors: Vec<FactorId>,
    /// The forms of what is observed.
    pub observed: Vec<FactorId>,
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], _: &Turn<'_>) -> Result<Route, Error> {
        offer(model, asks).map(Route::Conjugate).map_err(|why| refused(model, asks, &why))
    }
}

/// The kind of unknown that a form is the prior of.
pub(super) fn kind_of(model: &Model, form: &Form) -> Option<Kind> {
    match form {
        Form::Law { law: Law::Beta, .. } => Some(Kind::Probability),
        Form::Law { law: Law::Uniform, arguments } => {
            let bounds: Vec<Option<f64>> = arguments.iter().map(|id| model.constant(*id)).collect();
            (bounds == [Some(0.0), Some(1.0)]).then_some(Kind::Probability)
        }
        Form::Law { law: Law::Gamma | Law::Exponential, .. } => Some(Kind::Rate),
        Form::Dirichlet(_) => Some(Kind::Proportions),
        _ => None,
    }
}

/// The variable of which a variable of a question is an element.
pub(super) fn element_of(model: &Model, variable: VariableId) -> Option<&crate::model::VariableUse> {
    let factor = model.factor_of(variable)?;
    let Form::Dirac(value) = model.factors[factor].form else { return None };
    match &model.expressions[value] {
        Expression::Variable(use_) if model.variables[variable].derived == Some(DerivedKind::Element) => {
            // A slice is a family of its own.
            Some(use_).filter(|use_| use_.element.is_none_or(|id| model.constant(id).is_some()))
        }
        _ => None,
    }
}

/// The expression of a predicate of one unknown that is asked alone.
pub(super) fn predicate_of(model: &Model, variable: VariableId) -> Option<ExpressionId> {
    let root = of_normal(model, variable, true)?;
    let mut read = Vec::new();
    for id in model.nodes_below(root) {
        match &model.expressions[id] {
            Expression::Variable(use_) => {
                let at = use_.element.map(|at| model.constant(at).map(f64::to_bits));
                if !read.contains(&(use_.variable, at)) {
                    read.push((use_.variable, at));
                }
            }
            Expression::Vector(..) => return None,
            _ => {}
        }
    }
    (read.len() == 1).then_some(root)
}

const NO_PRIOR: &str = "no `beta`, `gamma` or `dirichlet` prior";

fn offer(model: &Model, asks: &[Ask]) -> Result<Conjugate, String> {
    if model.plate.is_some() {
        return Err("the program is repeated over a plate".to_owned());
    }
    let relevant = relevant(model, asks);
    let is_finite = |id: VariableId| model.variables[id].domain.is_finite();
    let may_be_prior = |id: &FactorId| {
        let factor = &model.factors[*id];
        kind_of(model, &factor.form).is_some() && !is_finite(factor.left[0].variable)
    };
    if !relevant.iter().any(may_be_prior) {
        return Err(NO_PRIOR.to_owned());
    }
    let is_hard = |evidence: &Finding| matches!(evidence, Finding::Hard(_));
    if let Some(known) = asks[0].known.iter().find(|known| {
        !is_hard(&known.evidence) && (is_finite(known.variable) || known.evidence != Finding::Each)
    }) {
        let name = model.variable_name(known.variable);
        return Err(format!("`{name}` is not observed at one value"));
    }
    let is_known = |id: VariableId| asks[0].known.iter().any(|known| known.variable == id);
    let (mut priors, mut rest) = (Vec::new(), Vec::new());
    for id in model.parents_first(&relevant) {
        let factor = &model.factors[id];
        let left = factor.left[0].variable;
        let is_derived = element_of(model, left).is_some() || predicate_of(model, left).is_some();
        if is_derived && !is_known(left) {
            continue;
        }
        let is_prior = !is_known(left) && kind_of(model, &factor.form).is_some() && !is_finite(left);
        let is_alone = factor.left.len() == 1 && of_form(model, id).is_empty();
        if is_prior && is_alone { priors.push(id) } else { rest.push(id) }
    }
    let kind = |variable: VariableId| {
        let own = |id: &&FactorId| model.factors[**id].left[0].variable == variable;
        priors.iter().find(own).and_then(|id| kind_of(model, &model.factors[*id].form))
    };
    for id in &rest {
        let factor = &model.factors[*id];
        let head = model.head(factor);
        if let Some(why) = refused_factor(model, factor) {
            return Err(why);
        }
        let left = factor.left[0].variable;
        let predicted = |ask: &Ask| {
            let searched = ask.searched[0].variable;
            searched == left || element_of(model, searched).is_some_and(|use_| use_.variable == left)
        };
        let is_predicted = is_finite(left) && asks.iter().any(predicted);
        if factor.left.len() > 1 || !is_known(left) && !is_predicted {
            return Err(format!("`{head}` is neither a conjugate prior nor observed"));
        }
        let mut parents = of_form(model, *id).into_iter();
        if let Some(hidden) = parents.find(|parent| !is_known(*parent) && kind(*parent).is_none()) {
            let hidden = model.variable_name(hidden);
            return Err(format!(
                "`{head}` depends on `{hidden}`, which is neither observed nor has a conjugate prior"
            ));
        }
        if is_finite(left)
            && reads_counts(&factor.form)
            && of_form(model, *id).into_iter().any(|parent| kind(parent).is_some())
        {
            return Err(format!(
                "`{head}` is normalised over its range, so that its rate has no conjugate prior: declare the count as `real`"
            ));
        }
        let is_vector = model.components(left) > 1 && !matches!(factor.form, Form::Multinomial { .. });
        if is_vector || !is_conjugate(model, &factor.form, &kind) {
            return Err(format!("`{head}` is not of a form with a conjugate prior"));
        }
    }
    if priors.is_empty() {
        return Err(NO_PRIOR.to_owned());
    }
    match asks.iter().find_map(|ask| refused_ask(model, ask, &|variable| kind(variable).is_some())) {
        Some(why) => Err(why),
        None => Ok(Conjugate { asks: asks.to_vec(), priors, observed: rest }),
    }
}

/// Whether a form is or has a Poisson distribution.
fn reads_counts(form: &Form) -> bool {
    let mut found = matches!(form, Form::Law { law: Law::Poisson, .. });
    form.each_part(&mut |part| found |= reads_counts(part));
    found
}

/// Why an ask is not answered.
fn refused_ask(model: &Model, ask: &Ask, is_unknown: &dyn Fn(VariableId) -> bool) -> Option<String> {
    let origin = |variable: VariableId| element_of(model, variable).map_or(variable, |use_| use_.variable);
    let finite = ask.searched.iter().filter(|item| model.variables[item.variable].domain.is_finite()).count();
    if let ([only], Statistic::Distribution) = (ask.searched.as_slice(), &ask.statistic)
        && predicate_of(model, only.variable).is_some()
    {
        let factor = model.factor_of(only.variable).map(|id| of_form(model, id));
        let hidden = factor.into_iter().flatten().find(|id| !is_unknown(origin(*id)));
        return hidden.map(|id| format!("`{}` has no conjugate prior", model.variable_name(id)));
    }
    if finite > 0 {
        return (ask.searched.len() > 1)
            .then(|| "one finite variable is predicted at a time: ask for each".to_owned());
    }
    if let Some(item) = ask.searched.iter().find(|item| !is_unknown(origin(item.variable))) {
        let name = model.variable_name(item.variable);
        return Some(format!("`{name}` is neither finite nor has a conjugate prior"));
    }
    let moments =
        matches!(ask.statistic, Statistic::Distribution | Statistic::Expectation | Statistic::Variance)
            || ask.statistic.levels().is_some();
    if !moments || ask.searched.iter().any(|item| item.at.is_some()) {
        return Some(format!("`{}` of a named distribution is not made here", ask.statistic.word()));
    }
    None
}

impl Offered for Conjugate {
    fn strategy(&self) -> Strategy {
        Strategy::Conjugate
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    /// One product for each form; families count once.
    fn cost(&self, _: &Model) -> Option<f64> {
        Some((self.priors.len() + self.observed.len()) as f64)
    }

    fn reason(&self) -> &'static str {
        "exact, in closed form: the priors of all unknowns are conjugate to what is observed"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        let ids = |ids: &mut dyn Iterator<Item = VariableId>| notation.names(model, &ids.collect::<Vec<_>>());
        let searched = ids(&mut self.asks[0].searched.iter().map(|item| item.variable));
        let known = ids(&mut self.asks[0].known.iter().map(|known| known.variable));
        let left = notation.distribution(&searched, &known);
        let line = |id: &FactorId| {
            let factor = &model.factors[*id];
            let name = model.variable_name(factor.left[0].variable);
            let (prior, unicode, latex, mathml) = match kind_of(model, &factor.form) {
                Some(Kind::Probability) => {
                    ("beta", "beta(a + s, b + n − s)", "\\text{beta}(a + s, b + n - s)", "a + s, b + n − s")
                }
                Some(Kind::Rate) => {
                    ("gamma", "gamma(k + n, r + t)", "\\text{gamma}(k + n, r + t)", "k + n, r + t")
                }
                _ => ("dirichlet", "dirichlet(a + n)", "\\text{dirichlet}(a + n)", "a + n"),
            };
            let mathml = format!("<mi>{prior}</mi>{OPEN}<mtext>{mathml}</mtext>{CLOSE}");
            let right = notation.choose(unicode, latex, &mathml);
            let reason = format!(
                "the `{prior}` prior of `{name}` is conjugate to the observed forms that read it: `{name}` is marginalised exactly"
            );
            ("conjugate".to_owned(), reason, notation.equation(&left, "∝", right))
        };
        (self.priors.iter().map(line).collect(), Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some("conjugate posteriors are computed by `answer::ask`, not by emitted code".to_owned())
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}
