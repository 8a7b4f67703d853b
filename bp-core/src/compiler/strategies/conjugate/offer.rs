//! What the conjugate strategy offers.
//!
//! In: asks that know the same. Out: a [`Conjugate`], or why not. Invariant: every unobserved variable that matters is an unknown
//! with a conjugate prior, or a finite one that is predicted alone.

use super::likelihood::{Kind, is_conjugate};
use super::{precision, summed};
use crate::analysis::{of_form, relevant_factors};
use crate::equation::{CLOSE, Line, Notation, OPEN, Strategy};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::law::Law;
use crate::model::{
    Ask, DerivedKind, Domain, Expression, Finding, Form, Known, Model, Question, Searched, Statistic, Value,
    VariableUse,
};
use crate::posterior::{refused_of_reals, refused_values};
use crate::strategies::gaussian::of_normal;
use crate::strategies::weighting::refused_factor;
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
        let why = match offer(model, asks) {
            Ok(conjugate) => return Ok(Route::Conjugate(conjugate)),
            Err(why) => why,
        };
        let now = model.plate.is_none() && !asks[0].when.is_over_time();
        match now.then(|| precision::offer(model, asks)).flatten() {
            Some(Ok(precision)) => Ok(Route::Precision(precision)),
            Some(Err(why)) => Err(refused(model, asks, &why)),
            None => match summed::offer(model, asks) {
                Ok(summed) => Ok(Route::Summed(summed)),
                Err(_) => Err(refused(model, asks, &why)),
            },
        }
    }
}

/// The kind of unknown that a form is the prior of.
pub(super) fn kind_of(model: &Model, form: &Form) -> Option<Kind> {
    match form {
        Form::Law { law: Law::Beta, .. } => Some(Kind::Probability),
        Form::Law { law: Law::Uniform, arguments } => {
            let bounds: Vec<Option<f64>> = arguments.iter().map(|id| model.constant(*id)).collect();
            let unit = bounds == [Some(0.0), Some(1.0)];
            Some(if unit { Kind::Probability } else { Kind::Alone })
        }
        Form::Law { law: Law::Gamma | Law::Exponential, .. } => Some(Kind::Rate),
        Form::Dirichlet(_) => Some(Kind::Proportions),
        Form::Law { .. } => Some(Kind::Alone),
        _ => None,
    }
}

/// The variable of which a variable of a question is an element; and the component, of a vector.
pub(super) fn element_of(model: &Model, variable: VariableId) -> Option<(&VariableUse, Option<usize>)> {
    let factor = model.factor_of(variable)?;
    let Form::Dirac(value) = model.factors[factor].form else { return None };
    match &model.expressions[value] {
        Expression::Variable(use_) if model.variables[variable].derived == Some(DerivedKind::Element) => {
            // A slice is a family of its own.
            Some((use_, None)).filter(|_| use_.element.is_none_or(|id| model.constant(id).is_some()))
        }
        _ => model.component_of(value).map(|(use_, component)| (use_, Some(component))),
    }
}

/// The expression of a predicate of one unknown that is asked alone.
pub(super) fn predicate_of(model: &Model, variable: VariableId) -> Option<ExpressionId> {
    let root = of_normal(model, variable, true)?;
    let mut read = Vec::new();
    for id in model.nodes_below(root) {
        let (use_, component) = match &model.expressions[id] {
            Expression::Variable(use_) if model.components(use_.variable) == 1 => (use_, 0),
            Expression::Variable(_) => continue,
            Expression::Vector(..) => model.component_of(id)?,
            _ => continue,
        };
        let at = use_.element.map(|at| model.constant(at).map(f64::to_bits));
        if !read.contains(&(use_.variable, at, component)) {
            read.push((use_.variable, at, component));
        }
    }
    (read.len() == 1).then_some(root)
}

pub(super) const NO_PRIOR: &str = "no `beta`, `gamma` or `dirichlet` prior";

fn offer(model: &Model, asks: &[Ask]) -> Result<Conjugate, String> {
    if model.plate.is_some() {
        return Err("the program is repeated over a plate".to_owned());
    }
    let relevant = relevant_factors(model, asks);
    let is_finite = |id: VariableId| model.variables[id].domain.is_finite();
    let may_be_prior = |id: &FactorId| {
        let factor = &model.factors[*id];
        kind_of(model, &factor.form).is_some() && !is_finite(factor.left[0].variable)
    };
    if !relevant.iter().any(may_be_prior) {
        return Err(NO_PRIOR.to_owned());
    }
    if let Some(known) = asks[0].known.iter().find(|known| !is_observed(model, known)) {
        let name = model.variable_name(known.variable);
        return Err(format!("`{name}` is not observed at one value"));
    }
    let is_known = |id: VariableId| asks[0].known.iter().any(|known| known.variable == id);
    let is_derived = |id: &FactorId| {
        let left = model.factors[*id].left[0].variable;
        !is_known(left) && (element_of(model, left).is_some() || predicate_of(model, left).is_some())
    };
    let all: Vec<FactorId> = relevant.iter().copied().filter(|id| !is_derived(id)).collect();
    let (priors, rest) = parted(model, &all, &is_known);
    let kind = |variable: VariableId| kind_among(model, &priors, variable);
    for id in &rest {
        let factor = &model.factors[*id];
        let head = model.head(factor);
        let left = factor.left[0].variable;
        let predicted = |ask: &Ask| {
            let searched = ask.searched[0].variable;
            searched == left || element_of(model, searched).is_some_and(|(use_, _)| use_.variable == left)
        };
        // A real is predicted at one value.
        let at_value = |ask: &Ask| ask.searched[0].at.is_some() || !predicted(ask);
        let is_predicted = asks.iter().any(predicted) && (is_finite(left) || asks.iter().all(at_value));
        if factor.left.len() > 1 || !is_known(left) && !is_predicted {
            return Err(format!("`{head}` is neither a conjugate prior nor observed"));
        }
        if let Some(why) = observed_fault(model, *id, &is_known, &kind) {
            return Err(why);
        }
    }
    if priors.is_empty() {
        return Err(NO_PRIOR.to_owned());
    }
    let has_prior = |variable: VariableId| kind(variable).is_some_and(|kind| kind != Kind::Alone);
    match asks.iter().find_map(|ask| refused_ask(model, ask, &|id| kind(id).is_some(), &has_prior)) {
        Some(why) => Err(why),
        None => Ok(Conjugate { asks: asks.to_vec(), priors, observed: rest }),
    }
}

/// Whether a variable is known by one value.
pub(super) fn is_observed(model: &Model, known: &Known) -> bool {
    match &known.evidence {
        // Of proportions all counts but one tell the last.
        Finding::Hard(Value::Vector(numbers)) => numbers.iter().filter(|number| number.is_nan()).count() < 2,
        Finding::Hard(_) => true,
        Finding::Each => !model.variables[known.variable].domain.is_finite(),
        _ => false,
    }
}

/// Why some factors, whose left-hand sides must be known, have no conjugate priors among these.
pub(super) fn conjugate_faults(
    model: &Model,
    priors: &[FactorId],
    observed: &[FactorId],
    is_known: &dyn Fn(VariableId) -> bool,
) -> Option<String> {
    let kind = |variable: VariableId| kind_among(model, priors, variable);
    observed.iter().find_map(|id| {
        let left = &model.factors[*id].left;
        match left.len() == 1 && is_known(left[0].variable) {
            true => observed_fault(model, *id, is_known, &kind),
            false => Some(format!(
                "`{}` is neither a conjugate prior nor observed",
                model.head(&model.factors[*id])
            )),
        }
    })
}

/// The conjugate priors among some factors, and the others; parents first.
pub(super) fn parted(
    model: &Model,
    factors: &[FactorId],
    is_known: &dyn Fn(VariableId) -> bool,
) -> (Vec<FactorId>, Vec<FactorId>) {
    let is_prior = |id: &FactorId| {
        let factor = &model.factors[*id];
        let left = factor.left[0].variable;
        let is_unknown = !is_known(left) && !model.variables[left].domain.is_finite();
        let is_alone = factor.left.len() == 1 && of_form(model, *id).is_empty();
        let kind = kind_of(model, &factor.form);
        let is_whole = kind != Some(Kind::Alone) || model.variables[left].domain == Domain::Real;
        is_unknown && is_alone && is_whole && kind.is_some()
    };
    model.parents_first(factors).into_iter().partition(is_prior)
}

/// The kind of a variable, where its prior is among these.
pub(super) fn kind_among(model: &Model, priors: &[FactorId], variable: VariableId) -> Option<Kind> {
    let own = |id: &&FactorId| model.factors[**id].left[0].variable == variable;
    priors.iter().find(own).and_then(|id| kind_of(model, &model.factors[*id].form))
}

/// Why what is observed by a factor has no conjugate prior.
fn observed_fault(
    model: &Model,
    id: FactorId,
    is_known: &dyn Fn(VariableId) -> bool,
    kind: &dyn Fn(VariableId) -> Option<Kind>,
) -> Option<String> {
    let factor = &model.factors[id];
    let head = model.head(factor);
    let left = factor.left[0].variable;
    let is_finite = model.variables[left].domain.is_finite();
    if let Some(why) = refused_factor(model, factor) {
        return Some(why);
    }
    let scope = of_form(model, id);
    if is_finite && reads_counts(&factor.form) && scope.iter().any(|parent| kind(*parent).is_some()) {
        return Some(format!(
            "`{head}` is normalised over its range, so that its rate has no conjugate prior: declare the count as `real`"
        ));
    }
    if let Some(hidden) = scope.iter().find(|parent| !is_known(**parent) && kind(**parent).is_none()) {
        let hidden = model.variable_name(*hidden);
        return Some(format!(
            "`{head}` depends on `{hidden}`, which is neither observed nor has a conjugate prior"
        ));
    }
    let is_vector = model.components(left) > 1 && !matches!(factor.form, Form::Multinomial { .. });
    (is_vector || !is_conjugate(model, &factor.form, kind))
        .then(|| format!("`{head}` is not of a form with a conjugate prior"))
}

/// Whether a form is or has a Poisson distribution.
fn reads_counts(form: &Form) -> bool {
    let mut found = matches!(form, Form::Law { law: Law::Poisson, .. });
    form.each_part(&mut |part| found |= reads_counts(part));
    found
}

/// Why an ask is not answered.
fn refused_ask(
    model: &Model,
    ask: &Ask,
    is_unknown: &dyn Fn(VariableId) -> bool,
    has_prior: &dyn Fn(VariableId) -> bool,
) -> Option<String> {
    let origin =
        |variable: VariableId| element_of(model, variable).map_or(variable, |(use_, _)| use_.variable);
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
    if let ([only], Statistic::Distribution) = (ask.searched.as_slice(), &ask.statistic)
        && only.at.is_some()
        && !is_unknown(origin(only.variable))
        && model.variables[only.variable].domain == Domain::Real
        && model.variables[only.variable].family.is_none()
    {
        return None;
    }
    if let Some(item) = ask.searched.iter().find(|item| !has_prior(origin(item.variable))) {
        let name = model.variable_name(item.variable);
        return Some(format!("`{name}` is neither finite nor has a conjugate prior"));
    }
    let alone = |item: &Searched| {
        model.components(item.variable) == 1 && model.variables[item.variable].family.is_none()
    };
    let reals = ask.searched.iter().map(|item| if alone(item) { 1 } else { 2 }).sum();
    if let Some(why) = refused_of_reals(&ask.statistic, reals) {
        return Some(why);
    }
    refused_values(model, ask)
        .or_else(|| dependent_values(model, ask))
        .or_else(|| dependent_draws(model, ask))
}

/// A searched variable that is a vector or a component, where several are searched: components of proportions depend on each other.
fn dependent<'a>(model: &Model, ask: &'a Ask) -> Option<&'a Searched> {
    let has_components = |item: &&Searched| {
        model.components(item.variable) > 1
            || element_of(model, item.variable).is_some_and(|(_, component)| component.is_some())
    };
    let several =
        ask.searched.len() > 1 || ask.searched.iter().any(|item| model.components(item.variable) > 1);
    ask.searched.iter().find(has_components).filter(|_| several)
}

/// Why unknowns are not drawn from their distributions one by one.
pub(super) fn dependent_draws(model: &Model, ask: &Ask) -> Option<String> {
    let is_draw = matches!(ask.statistic, Statistic::Draw(_));
    dependent(model, ask)
        .filter(|_| is_draw)
        .map(|_| "proportions are drawn by draws of the program".to_owned())
}

/// Why the density of several unknowns at values is not computed: components of proportions depend on each other.
pub(super) fn dependent_values(model: &Model, ask: &Ask) -> Option<String> {
    let at = ask.searched.iter().any(|item| item.at.is_some());
    let item = dependent(model, ask).filter(|_| at)?;
    let name = model.variable_name(item.variable);
    Some(format!(
        "the density of several components of `{name}` together is not computed: ask for each alone"
    ))
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
