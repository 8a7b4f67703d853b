//! The offer of the linear-Gaussian strategy: whether a model has a closed form.
//!
//! In: a model of reals, each normal or Dirac with a mean that is linear in its parents. Out: the order in which the
//! joint normal law is built, conditioned and carried to the next instant. Invariant: linearity is a property of the
//! program, checked here once; the numbers come with the parameters, when it runs.
//!
//! With x = (parents, noise), y = A x + a: mean(y) = A m + a, cov(y) = A Σ Aᵀ + Q;
//! given z: m ← m + K (z − H m), K = Σ Hᵀ (H Σ Hᵀ)⁻¹, Σ ← Σ − K H Σ (Kalman 1960).

use super::{derivation, not_linearised, predicate};
use crate::analysis::{Admitted, carried, is_linear_form, relevant_variables};
use crate::equation::{Line, Notation, Strategy};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::law::Law;
use crate::model::{Ask, Expression, Finding, Form, Known, Model, Question, Statistic, When};
use crate::strategies::over_time::{self, By, OverTime};
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn, refused};

/// The linear equation of a variable.
#[derive(Clone, PartialEq, Debug)]
pub struct LinearEquation {
    /// The variable, or the family of which each element has such an equation.
    pub variable: VariableId,
    /// The factor.
    pub factor: FactorId,
    /// The conditions on indices and parameters under which it holds, each true or false.
    pub when: Vec<(ExpressionId, bool)>,
    /// Its mean, linear in its parents; `None` of a flat variable.
    pub mean: Option<ExpressionId>,
    /// Its own noise.
    pub noise: Noise,
}

/// The noise of a variable's own.
#[derive(Clone, PartialEq, Debug)]
pub enum Noise {
    /// A Dirac has none.
    None,
    /// Independent in each component, with this standard deviation.
    Deviation(ExpressionId),
    /// Of a vector, with this covariance matrix.
    Covariance(Vec<Vec<ExpressionId>>),
    /// Flat.
    Flat,
}

/// A closed form.
#[derive(Clone, PartialEq, Debug)]
pub struct Gaussian {
    /// The asks.
    pub asks: Vec<Ask>,
    /// The equations of the carried variables before the first instant, parents first; variables without one start at
    /// 0.
    pub initial: Vec<LinearEquation>,
    /// The variables of an instant, parents first.
    pub sources: Vec<LinearEquation>,
    /// The variables that have a form of their own at the first instant (`initial(X)`), with that form.
    pub first: Vec<LinearEquation>,
    /// The variables whose law is carried to the next instant: (X, X^-1).
    pub carried: Vec<(VariableId, VariableId)>,
    /// The variables that are observed, in the order of the question.
    pub observed: Vec<VariableId>,
    /// Whether families are among the variables.
    pub(super) families: bool,
    /// Whether the program has parameters of several numbers.
    fields: bool,
    /// (rule, reason, right-hand side in Unicode, LaTeX and MathML).
    derivation: Vec<(String, String, [String; 3])>,
}

/// Whether all variables that an ask uses are linear and Gaussian, and it asks for reals or for a predicate of them.
pub(crate) fn applies(model: &Model, ask: &Ask) -> bool {
    is_linear(model, ask) && not_of_laws(model, ask).is_none()
}

/// Whether all variables that an ask uses, and their ancestors, are linear and Gaussian.
pub(crate) fn is_linear(model: &Model, ask: &Ask) -> bool {
    // Over a plate a family is one variable of each element; over time it is its elements.
    let elements = model.plate.is_none() || ask.when.is_over_time();
    let degree = |id: ExpressionId| degree(model, id, elements);
    let predicate =
        |id: VariableId| asks_whether(ask, id) && predicate::of_normal(model, id, elements).is_some();
    // A finite variable that the ask names decides at once, without a look at its ancestors.
    let is_finite = |id: VariableId| {
        model.variables[id].domain.is_finite() && Some(id) != model.plate_index() && !predicate(id)
    };
    let named = ask.searched.iter().map(|item| item.variable);
    if named.chain(ask.known.iter().map(|known| known.variable)).any(is_finite) {
        return false;
    }
    let relevant = relevant_variables(model, std::slice::from_ref(ask));
    let reals = relevant.iter().all(|id| {
        let variable = &model.variables[*id];
        Some(*id) == model.plate_index()
            || (!variable.domain.is_finite() && (elements || variable.family.is_none()))
            || predicate(*id)
    });
    let factors = model.factors.values().filter(|factor| {
        factor.left.iter().any(|use_| relevant.contains(&use_.variable) && !predicate(use_.variable))
    });
    let now = !ask.when.is_over_time();
    let admitted = Admitted { flat: now, choices: now && model.plate.is_none() };
    let linear = factors.clone().all(|factor| {
        !(now && matches!(factor.form, Form::Initial { .. }))
            && is_linear_form(&factor.form, &degree, admitted)
    });
    let first = factors.clone().all(|factor| {
        let before = |use_: &crate::model::VariableUse| model.variables[use_.variable].previous_of.is_some();
        !before(&factor.left[0]) || factor.right.iter().all(before)
    });
    reals && linear && first
}

/// Whether an ask searches this variable alone.
fn asks_whether(ask: &Ask, variable: VariableId) -> bool {
    matches!(ask.searched.as_slice(), [only] if only.variable == variable)
}

/// The form that applies before the first instant.
fn initial(form: &Form) -> &Form {
    match form {
        Form::Previous { at: None, otherwise, .. } => otherwise,
        form => form,
    }
}

/// The reason why no law is asked of linear Gaussian variables; `None` where one is.
fn not_of_laws(model: &Model, ask: &Ask) -> Option<String> {
    let is_virtual = |known: &&Known| matches!(known.evidence, Finding::Virtual(_));
    if let Some(known) = ask.known.iter().chain(ask.statistic.from()).find(is_virtual) {
        let name = model.variable_name(known.variable);
        return Some(format!("virtual evidence on `{name}` is no observation of a real"));
    }
    if matches!(ask.searched.as_slice(), [only] if model.is_predicate(only.variable)) {
        return None;
    }
    if let Statistic::Best(_) = ask.statistic {
        return Some("reals have no second best value: ask for `argmax`".to_owned());
    }
    let valued = ask.searched.iter().filter(|item| item.at.is_some()).count();
    match (valued, &ask.statistic) {
        (0, _) => None,
        (all, Statistic::Distribution) if all == ask.searched.len() => None,
        _ => Some("the density at some values is asked with all of them: `P(X = 1, Y = 2 | …)`".to_owned()),
    }
}

/// Degree of an expression in the variables: 0 or 1; `None` where it is not linear, or where its coefficients are not known from
/// the parameters alone. `elements`: whether elements of families may stand in it.
pub(super) fn degree(model: &Model, id: ExpressionId, elements: bool) -> Option<u8> {
    let is_constant = |id: ExpressionId| model.degree(id, &|_| true) == Some(0);
    let is_known = |id: ExpressionId| match &model.expressions[id] {
        Expression::Number(_)
        | Expression::Parameter { .. }
        | Expression::Unary(..)
        | Expression::Binary(..)
        | Expression::If { .. } => true,
        Expression::Index(_) => elements,
        Expression::Variable(use_) => match use_.element {
            Some(element) => elements && is_constant(element),
            None => model.variables[use_.variable].family.is_none(),
        },
        // A vector of numbers, or one of its components; a rotation has no such coefficients here.
        Expression::Vector(name, _) => name == "vector" || name == "component",
        _ => false,
    };
    let known = model.nodes_below(id).into_iter().all(is_known);
    model.degree(id, &|_| true).filter(|_| known)
}

/// The offer for asks whose variables are linear and Gaussian.
pub(crate) fn offer(model: &Model, asks: Vec<Ask>) -> Result<Gaussian, Error> {
    let mut sources: Vec<LinearEquation> = Vec::new();
    let relevant = relevant_variables(model, &asks);
    let mut rest: Vec<FactorId> = model.factors.ids().collect();
    rest.retain(|id| relevant.contains(&model.factors[*id].left[0].variable));
    let is_relevant = |(_, previous): &(VariableId, VariableId)| relevant.contains(previous);
    let carried: Vec<(VariableId, VariableId)> = carried(model).into_iter().filter(is_relevant).collect();
    // A carried variable without an initial form is at rest before the first instant.
    let (mut initial_sources, mut first) = (Vec::new(), Vec::new());
    for id in model.parents_first(&rest) {
        let factor = &model.factors[id];
        let variable = factor.left[0].variable;
        let equation = |form: &Form, when: Vec<(ExpressionId, bool)>| -> Result<LinearEquation, Error> {
            let (mean, noise) = match form {
                Form::Law { law: Law::Normal, arguments } => {
                    (Some(arguments[0]), Noise::Deviation(arguments[1]))
                }
                Form::NormalVector { mean, covariance } => {
                    (Some(*mean), Noise::Covariance(covariance.clone()))
                }
                Form::Dirac(value) => (Some(*value), Noise::None),
                Form::Flat => (None, Noise::Flat),
                _ => {
                    let head = model.head(factor);
                    return Err(refused(model, &asks, &format!("`{head}` is not normal with a linear mean")));
                }
            };
            Ok(LinearEquation { variable, factor: id, when, mean, noise })
        };
        match &factor.form {
            form if model.variables[variable].previous_of.is_some() => {
                initial_sources.push(equation(initial(form), Vec::new())?);
            }
            Form::Initial { first: form, later } => {
                first.push(equation(form, Vec::new())?);
                sources.push(equation(later, Vec::new())?);
            }
            form => {
                let mut forms = vec![(initial(form), Vec::new())];
                while let Some((form, when)) = forms.pop() {
                    let Form::If { condition, then, otherwise } = form else {
                        sources.push(equation(form, when)?);
                        continue;
                    };
                    let with = |holds: bool| [&when[..], &[(*condition, holds)]].concat();
                    forms.extend([(&**otherwise, with(false)), (&**then, with(true))]);
                }
            }
        }
    }
    let observed: Vec<VariableId> = asks[0].known.iter().map(|known| known.variable).collect();
    let derivation = derivation::lines(model, &carried, &observed);
    let families = relevant.iter().any(|id| model.variables[*id].family.is_some());
    let fields = model.parameters.values().any(|parameter| !parameter.over.is_empty());
    Ok(Gaussian {
        asks,
        initial: initial_sources,
        sources,
        first,
        carried,
        observed,
        families,
        fields,
        derivation,
    })
}

impl Gaussian {
    /// The derivation, line by line.
    pub(crate) fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let searched: Vec<VariableId> =
            self.asks[0].searched.iter().map(|searched| searched.variable).collect();
        let mut right: Vec<VariableId> = (self.asks[0].known.iter())
            .filter(|known| !matches!(known.evidence, Finding::Virtual(_)))
            .map(|known| known.variable)
            .collect();
        right.extend(model.plate_index());
        let left = notation.distribution(&notation.names(model, &searched), &notation.names(model, &right));
        let line = |(rule, reason, right): &(String, String, [String; 3])| {
            let [unicode, latex, mathml] = right;
            let right = notation.choose(unicode, latex, mathml);
            (rule.clone(), reason.clone(), notation.equation(&left, "=", right))
        };
        self.derivation.iter().map(line).collect()
    }
}

/// The extended Kalman filter, where the user names it.
pub(crate) struct ExtendedEngine;

impl strategies::Engine for ExtendedEngine {
    fn offer(&self, model: &Model, asks: &[Ask], _: &Turn<'_>) -> Result<Route, Error> {
        let ask = &asks[0];
        over_time::check(model, ask)?;
        let virtually = |known: &Known| matches!(known.evidence, Finding::Virtual(_));
        let why = over_time::not_of_normal(model, ask).or_else(|| not_linearised(model, ask));
        if let Some(why) = why {
            return Err(refused(model, asks, &why));
        }
        if ask.known.iter().any(virtually) {
            return Err(refused(model, asks, "virtual evidence is no observation of a real"));
        }
        let (asks, carried) = (asks.to_vec(), carried(model));
        Ok(Route::OverTime(OverTime { asks, carried, by: By::Extended }))
    }
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], _: &Turn<'_>) -> Result<Route, Error> {
        let not_all = || refused(model, asks, "not all variables are real, linear and Gaussian");
        if !asks[0].when.is_over_time() {
            if !asks.iter().all(|ask| is_linear(model, ask)) {
                return Err(not_all());
            }
            return match asks.iter().find_map(|ask| not_of_laws(model, ask)) {
                Some(why) => Err(refused(model, asks, &why)),
                None => Ok(Route::Gaussian(offer(model, asks.to_vec())?)),
            };
        }
        let ask = &asks[0];
        over_time::check(model, ask)?;
        if !is_linear(model, ask) {
            return Err(not_all());
        }
        if let Some(why) = over_time::not_of_normal(model, ask) {
            return Err(refused(model, asks, &why));
        }
        let plain = Ask { statistic: Statistic::Distribution, when: When::Now, ..ask.clone() };
        let by = By::Gaussian(offer(model, vec![plain])?);
        Ok(Route::OverTime(OverTime { asks: vec![ask.clone()], carried: carried(model), by }))
    }
}

impl Offered for Gaussian {
    fn strategy(&self) -> Strategy {
        Strategy::Gaussian
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    /// Conditioning a law of n numbers takes at most n³ products.
    fn cost(&self, model: &Model) -> Option<f64> {
        let before = self.carried.iter().map(|(_, before)| *before);
        let all = self.sources.iter().map(|source| source.variable).chain(before);
        let elements = |id: VariableId| match model.variables[id].family {
            Some(family) => model.index_count(&family.over).map_or(16.0, |count| count as f64),
            None => 1.0,
        };
        let numbers: f64 = all.map(|id| model.components(id) as f64 * elements(id)).sum();
        Some(numbers.powi(3))
    }

    fn reason(&self) -> &'static str {
        "exact, in closed form: all variables are real, linear and Gaussian"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        (self.derivation(model, notation), Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        let reason = match (self.families, self.fields) {
            (true, _) => {
                "emitted code makes the filter of whole variables, but this question is answered element by element"
            }
            (false, true) => "emitted code takes parameters of one number each, but the program has fields",
            (false, false) => return None,
        };
        Some(format!("{reason}; `answer::ask` answers it"))
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}
