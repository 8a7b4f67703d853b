//! The contribution of an observation to the posterior of an unknown.
//!
//! In: a form that reads one unknown, and a value of its left-hand side. Out: the unknown, what is observed of it, and ln of the
//! factor that does not depend on it. Invariant: everything else that the form reads is observed.

use super::unknown::Observed;
use crate::distribution::{Instance, Setting};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::{ExpressionId, VariableId};
use crate::law::Law;
use crate::model::{Expression, Form, Model, VariableUse};
use crate::operators::Binary;
use crate::special::{ln_factorial_rest, ln_gamma};

/// The kind of an unknown.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Probability,
    Rate,
    Proportions,
    /// Any other law, of which nothing may be observed: it answers predicates.
    Alone,
}

/// Whether a form reads unknowns in the way that keeps them conjugate; `kind` tells what a variable is.
pub(super) fn is_conjugate(model: &Model, form: &Form, kind: &dyn Fn(VariableId) -> Option<Kind>) -> bool {
    let is_free = |id: ExpressionId| model.degree(id, &|variable| kind(variable).is_some()) == Some(0);
    let is = |id: ExpressionId, wanted: Kind| is_read(model, id, wanted, kind);
    let are_proportions = |ids: &[ExpressionId]| {
        proportions(model, ids).is_some_and(|use_| {
            kind(use_.variable) == Some(Kind::Proportions)
                && model.components(use_.variable) == ids.len()
                && use_.element.is_none_or(is_free)
        })
    };
    match form {
        Form::If { condition, then, otherwise } => {
            is_free(*condition) && is_conjugate(model, then, kind) && is_conjugate(model, otherwise, kind)
        }
        Form::Bernoulli(probability, _) => is(*probability, Kind::Probability) || is_free(*probability),
        Form::Categorical(entries) => are_proportions(entries) || entries.iter().all(|id| is_free(*id)),
        Form::Multinomial { trials, probabilities } => is_free(*trials) && are_proportions(probabilities),
        Form::Law { law, arguments } if arguments.iter().any(|id| !is_free(*id)) => {
            match (law, arguments.as_slice()) {
                (Law::Binomial, [trials, probability]) => {
                    is_free(*trials) && is(*probability, Kind::Probability)
                }
                (Law::Poisson | Law::Exponential, [rate]) => is(*rate, Kind::Rate),
                (Law::Gamma, [shape, rate]) => is_free(*shape) && is(*rate, Kind::Rate),
                _ => false,
            }
        }
        other => {
            let mut free = !matches!(other, Form::Unknown(_) | Form::Ask { .. } | Form::Previous { .. });
            other.each_expression(&mut |id| free &= is_free(id));
            free && !other.is_improper()
        }
    }
}

/// Whether an expression is an unknown of this kind, a rate perhaps times or divided by numbers; or chooses, by what is observed,
/// between such.
fn is_read(model: &Model, id: ExpressionId, wanted: Kind, kind: &dyn Fn(VariableId) -> Option<Kind>) -> bool {
    let degrees = model.degrees(id, &|variable| kind(variable).is_some());
    let is_free = |id: ExpressionId| *degrees.of(id) == Some(0);
    let mut rest = vec![id];
    while let Some(next) = rest.pop() {
        match &model.expressions[next] {
            // Of a choice one side may read none.
            _ if is_free(next) && next != id => {}
            Expression::Variable(use_)
                if kind(use_.variable) == Some(wanted) && use_.element.is_none_or(is_free) => {}
            Expression::If { condition, then, otherwise } if is_free(*condition) => {
                rest.extend([*then, *otherwise]);
            }
            Expression::Binary(Binary::Multiply, left, right) if wanted == Kind::Rate && is_free(*left) => {
                rest.push(*right);
            }
            Expression::Binary(Binary::Multiply | Binary::Divide, left, right)
                if wanted == Kind::Rate && is_free(*right) =>
            {
                rest.push(*left);
            }
            _ => return false,
        }
    }
    true
}

/// The vector of which these expressions are all components, in order.
fn proportions<'m>(model: &'m Model, ids: &[ExpressionId]) -> Option<&'m VariableUse> {
    let component = |(place, id): (usize, &ExpressionId)| match &model.expressions[*id] {
        Expression::Vector(name, parts)
            if name == "component" && model.constant(parts[1]) == Some(place as f64) =>
        {
            match &model.expressions[parts[0]] {
                Expression::Variable(use_) => Some(use_),
                _ => None,
            }
        }
        _ => None,
    };
    let all: Vec<&VariableUse> = ids.iter().enumerate().map(component).collect::<Option<_>>()?;
    let first = *all.first()?;
    let index = |use_: &VariableUse| use_.element.map(|id| model.expression_text(id, &[]));
    let same = |use_: &&VariableUse| use_.variable == first.variable && index(use_) == index(first);
    all.iter().all(same).then_some(first)
}

/// The contribution of an observation to the posterior of an unknown.
pub(super) struct Contribution {
    /// The first slot of the unknown; none where the form reads none.
    pub(super) slot: Option<usize>,
    pub(super) observed: Observed,
    pub(super) ln_factor: f64,
}

/// The contribution of a value of an instance's left-hand side, of a vector all components; `unknowns` are the slots of
/// unknowns, which are 0 in `values`.
///
/// # Errors
/// A number outside the range that the form accepts.
pub(super) fn contribution(
    setting: &Setting<'_>,
    instance: &Instance,
    value: &[f64],
    values: &[f64],
    unknowns: &[bool],
) -> Result<Contribution, Error> {
    let model = setting.model;
    let is_unknown = |variable| setting.slots_of(variable).next().is_some_and(|slot| unknowns[slot]);
    let mut form = &model.factors[instance.factor].form;
    let number = |id: ExpressionId| setting.expression(id, instance, values);
    while let Form::If { condition, then, otherwise } = form {
        form = if number(*condition) != 0.0 { then } else { otherwise };
    }
    let slot = |use_: &VariableUse| setting.slot_at(use_.variable, use_.element.map(number), 0);
    let resolved = |mut id: ExpressionId| {
        while let Expression::If { condition, then, otherwise } = &model.expressions[id] {
            id = if number(*condition) != 0.0 { *then } else { *otherwise };
        }
        id
    };
    let read = |id: ExpressionId| {
        let mut uses = model.nodes_below(id).into_iter().filter_map(|node| match &model.expressions[node] {
            Expression::Variable(use_) if is_unknown(use_.variable) => Some(use_),
            _ => None,
        });
        uses.next_back()
    };
    let left = setting.variable_of(instance.left[0]);
    let first = setting.number_at(left, value[0]);
    let found = match form {
        Form::Bernoulli(probability, _) => {
            let unknown = read(resolved(*probability));
            unknown.map(|use_| (slot(use_), Observed::Trials([first, 1.0 - first]), 0.0))
        }
        Form::Categorical(entries) => {
            proportions(model, entries).filter(|use_| is_unknown(use_.variable)).map(|use_| {
                let counts = (0..entries.len()).map(|place| f64::from(u8::from(place as f64 == value[0])));
                (slot(use_), Observed::Counts(counts.collect()), 0.0)
            })
        }
        Form::Multinomial { trials, probabilities } => {
            let unknown = proportions(model, probabilities).filter(|use_| is_unknown(use_.variable));
            match (unknown, counts(value, number(*trials))) {
                (Some(use_), Some(value)) => {
                    let all: f64 = value.iter().sum();
                    let fits = value.iter().all(|count| is_count(*count)) && all == number(*trials);
                    let ln_factor = ln_factor(fits, &|| ln_ways(all, &value));
                    Some((slot(use_), Observed::Counts(value), ln_factor))
                }
                (Some(_), None) => {
                    let head = model.head(&model.factors[instance.factor]);
                    let reason = format!("several components of `{head}` are not observed");
                    return Err(Error::Unplanned { question: model.name.clone(), reason });
                }
                (None, _) => None,
            }
        }
        Form::Law { law, arguments } => {
            let last = resolved(arguments[arguments.len() - 1]);
            match (read(last), law) {
                (None, _) => None,
                (Some(use_), Law::Binomial) => {
                    let trials = number(arguments[0]);
                    check_range(setting, instance, left, trials)?;
                    let fits = first <= trials && is_count(first) && is_count(trials);
                    let both = [first, trials - first];
                    Some((slot(use_), Observed::Trials(both), ln_factor(fits, &|| ln_ways(trials, &both))))
                }
                (Some(use_), law) => {
                    // The form of a choice reads one of its sides.
                    let (terms, _) = setting.linear_form(last, instance, values, unknowns);
                    let term = terms.first().copied().or_else(|| Some((slot(use_)?, 0.0)));
                    let Some((at, per)) = term else { return Err(outside(setting, instance)) };
                    let (count, time, ln) = match law {
                        Law::Poisson if is_count(first) => (first, per, -ln_factorial_rest(first)),
                        Law::Poisson => (first, per, f64::NEG_INFINITY),
                        Law::Exponential => (1.0, per * first, per.ln()),
                        _ => {
                            let shape = number(arguments[0]);
                            (
                                shape,
                                per * first,
                                shape * per.ln() + (shape - 1.0) * first.ln() - ln_gamma(shape),
                            )
                        }
                    };
                    let has_shape = *law != Law::Gamma || count > 0.0;
                    // A density that is 0, or infinite, there.
                    let fits = first >= 0.0 && has_shape && ln.is_finite();
                    if !(per > 0.0 && per.is_finite()) {
                        // The error of the form.
                        let mut one = values.to_vec();
                        one[at] = 1.0;
                        setting.distribution(instance, &one)?;
                    }
                    let observed = match law {
                        Law::Poisson => Observed::Events([count, time]),
                        _ => Observed::Waits([count, time]),
                    };
                    Some((Some(at), observed, ln_factor(fits, &|| ln)))
                }
            }
        }
        _ => None,
    };
    match found {
        Some((Some(slot), observed, ln_factor)) => Ok(Contribution { slot: Some(slot), observed, ln_factor }),
        Some((None, ..)) => Err(outside(setting, instance)),
        None => {
            let ln_factor = setting.distribution(instance, values)?.ln_density(value[0]);
            Ok(Contribution { slot: None, observed: Observed::Counts(Vec::new()), ln_factor })
        }
    }
}

/// The counts of so many trials, of which one may be missing: it is the rest of the trials.
fn counts(value: &[f64], trials: f64) -> Option<Vec<f64>> {
    let known = || value.iter().filter(|count| !count.is_nan());
    let rest = trials - known().sum::<f64>();
    let complete = |count: &f64| if count.is_nan() { rest } else { *count };
    (known().count() + 1 >= value.len()).then(|| value.iter().map(complete).collect())
}

fn is_count(number: f64) -> bool {
    number >= 0.0 && number.fract() == 0.0
}

/// ln of a factor, −∞ where what is observed does not fit.
fn ln_factor(fits: bool, ln: &dyn Fn() -> f64) -> f64 {
    if fits { ln() } else { f64::NEG_INFINITY }
}

/// ln S(n) − Σ ln S(nᵢ), S(n) = n! eⁿ/nⁿ: what [`Evidenced::ln_probability`](super::unknown::Evidenced::ln_probability) leaves out.
fn ln_ways(trials: f64, counts: &[f64]) -> f64 {
    ln_factorial_rest(trials) - counts.iter().map(|count| ln_factorial_rest(*count)).sum::<f64>()
}

/// Refuses a range that does not have all numbers of successes: over it a binomial distribution is normalised, and not conjugate.
fn check_range(
    setting: &Setting<'_>,
    instance: &Instance,
    left: VariableId,
    trials: f64,
) -> Result<(), Error> {
    let (model, count) = (setting.model, setting.count(left));
    if count == 0
        || setting.number_at(left, 0.0) <= 0.0 && setting.number_at(left, count as f64 - 1.0) >= trials
    {
        return Ok(());
    }
    let head = model.head(&model.factors[instance.factor]);
    let reason = format!(
        "`{head}` is normalised over a range without all numbers of successes of {trials} trials, so that its probability has no \
         conjugate prior; declare `{} : 0..={trials}`, or take `{}`",
        model.variable_name(left),
        Advice::By("gibbs")
    );
    Err(Error::Unplanned { question: model.name.clone(), reason })
}

/// The error of an unknown outside its family.
fn outside(setting: &Setting<'_>, instance: &Instance) -> Error {
    let head = setting.model.head(&setting.model.factors[instance.factor]);
    let reason = format!("`{head}` reads an element outside its family");
    Error::Unplanned { question: setting.model.name.clone(), reason }
}
