//! One instant of a filter, as a kernel: what is carried in, the observations, what is carried out.
//!
//! In: a program with variables of the previous instant, and a question over time. Out: a [`Step`], the same question of one
//! instant, and its kernel: sums over finite states, or the moments of a normal law. Invariant: kernels have no notion of
//! time; an instant that differs from the others (the first, or one without observations) has a kernel of its own.

mod law;
mod moments;
mod normal;
mod rotation;
mod series;
mod tangent;

pub use normal::{NormalLowered, lower_normal};

use crate::analysis::{is_proper, of_form};
use crate::equation::{self, Exact, Options};
use crate::error::Error;
use crate::ids::{ParameterId, VariableId};
use crate::model::{
    Ask, Expression, Factor, Finding, Form, Known, Model, Parameter, ParameterKind, Searched, Statistic,
    Value, When,
};

/// Which instant a kernel computes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Phase {
    /// The first: X^-1 has the form that the program gives it.
    First,
    /// Any later one: X^-1 has the distribution that was carried.
    Later,
    /// A later one without observations, of a prediction.
    Ahead,
    /// Of a whole series: the message from a later instant to X^-1, Σ_X φ β(X).
    Back,
    /// Of a whole series: the distribution at an instant, α(X) β(X).
    Both,
    /// Of a most likely series: the largest probability of each X, max φ δ(X^-1).
    Best,
    /// Of a most likely series: the X^-1 before an X that is known, φ δ(X^-1).
    Trace,
}

/// A question of one instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Step {
    /// The program of the instant.
    pub model: Model,
    /// Which instant.
    pub phase: Phase,
    /// The asks: that of all that is carried, and that of the question, if it is another.
    pub asks: Vec<Ask>,
    /// The carried variables that matter: (X, X^-1).
    pub carried: Vec<(VariableId, VariableId)>,
    /// The observations that may be absent, each with a parameter: whether it is given.
    pub absent: Vec<(VariableId, ParameterId)>,
}

/// A distribution of some variables at one instant.
fn asked(searched: Vec<VariableId>, known: Vec<Known>) -> Ask {
    let searched = searched.into_iter().map(|variable| Searched { variable, at: None }).collect();
    Ask { statistic: Statistic::Distribution, when: When::Now, searched, known }
}

impl Step {
    /// An instant of a question over time.
    fn new(model: &Model, ask: &Ask, carried: &[(VariableId, VariableId)], phase: Phase) -> Self {
        let mut known = Vec::new();
        for item in &ask.known {
            let evidence = match &item.evidence {
                _ if Some(item.variable) == model.plate_index() => item.evidence.clone(),
                // A predicted instant has no observations.
                _ if phase == Phase::Ahead => continue,
                Finding::Each => Finding::Hard(Value::Given(model.variable_name(item.variable))),
                other => other.clone(),
            };
            known.push(Known { variable: item.variable, evidence });
        }
        let own = Ask { when: When::Now, known: known.clone(), ..ask.clone() };
        let state = asked(carried.iter().map(|(now, _)| *now).collect(), known);
        // Axes are in the order of the asks: what is carried comes first, in the order in which it is read again.
        let asks = if own == state || ask.when.is_every_instant() { vec![state] } else { vec![state, own] };
        let (model, carried) = (model.clone(), carried.to_vec());
        Self { model, phase, asks, carried, absent: Vec::new() }
    }

    /// The observations whose values are given when the step is asked: the variable and the name of its input.
    fn given(&self) -> Vec<(VariableId, String)> {
        let given = |known: &Known| match &known.evidence {
            Finding::Hard(Value::Given(name)) => Some((known.variable, name.clone())),
            _ => None,
        };
        self.asks[0].known.iter().filter_map(given).collect()
    }

    /// Adds the parameter that says whether an observation is given.
    fn may_be_absent(&mut self, variable: VariableId, name: &str) -> ParameterId {
        let name = format!("whether {name} is given");
        let kind = ParameterKind::Integer;
        let flag = self.model.parameters.push(Parameter {
            name,
            kind,
            default: vec![1.0],
            rows: Vec::new(),
            over: Vec::new(),
        });
        self.absent.push((variable, flag));
        flag
    }

    /// An instant of a chain of finite states: a sum of products.
    ///
    /// # Errors
    /// A program whose instants have no sums.
    pub fn of_chain(
        model: &Model,
        ask: &Ask,
        carried: &[(VariableId, VariableId)],
        phase: Phase,
    ) -> Result<(Self, Exact), Error> {
        let mut step = Self::new(model, ask, carried, phase);
        if phase == Phase::Both {
            return step.of_both(ask);
        }
        let before = |variable: VariableId| carried.iter().any(|(_, before)| *before == variable);
        for (variable, name) in step.given() {
            let Some(factor) = leaf(model, variable) else { continue };
            let flag = step.may_be_absent(variable, &name);
            let given = Expression::Parameter { parameter: flag, indices: Vec::new() };
            let condition = step.model.expressions.push(given);
            let form = &mut step.model.factors[factor].form;
            let then = Box::new(of_phase(std::mem::replace(form, Form::Flat), phase));
            *form = Form::If { condition, then, otherwise: Box::new(Form::Flat) };
        }
        let mut factors: Vec<Factor> = std::mem::take(&mut step.model.factors).values().cloned().collect();
        match (phase, carried) {
            (Phase::First, _) | (_, []) => {}
            (_, [(now, _), ..]) => {
                factors.retain(|factor| !factor.left.iter().any(|use_| before(use_.variable)));
                let form = match phase {
                    Phase::Back => Form::Uniform,
                    _ => Form::Previous { of: *now, at: None, otherwise: Box::new(Form::Uniform) },
                };
                factors.push(joint(carried.iter().map(|(_, before)| *before), form));
            }
        }
        for mut factor in factors {
            let is_carried = factor.left.iter().any(|use_| before(use_.variable));
            if phase == Phase::First
                && is_carried
                && let Form::Previous { otherwise, .. } = factor.form
            {
                factor.form = *otherwise;
            }
            factor.form = of_phase(factor.form, phase);
            step.model.factors.push(factor);
        }
        match phase {
            Phase::Back | Phase::Both | Phase::Best | Phase::Trace => step.of_series(),
            Phase::First | Phase::Later | Phase::Ahead => {
                let options = Options { ln_evidence: true, ..Options::default() };
                let exact = equation::exact(&step.model, step.asks.clone(), options)?;
                Ok((step, exact))
            }
        }
    }

    /// An instant of normal variables.
    pub(super) fn of_normal(
        model: &Model,
        ask: &Ask,
        carried: &[(VariableId, VariableId)],
        phase: Phase,
    ) -> Self {
        let mut step = Self::new(model, ask, carried, phase);
        for (variable, name) in step.given() {
            if Some(variable) != model.plate_index() {
                step.may_be_absent(variable, &name);
            }
        }
        step
    }
}

/// A factor of several variables without parents.
fn joint(left: impl Iterator<Item = VariableId>, form: Form) -> Factor {
    Factor { left: left.map(Into::into).collect(), right: Vec::new(), form, products: Vec::new() }
}

/// The form that holds at an instant.
fn of_phase(form: Form, phase: Phase) -> Form {
    match form {
        Form::Initial { first, .. } if phase == Phase::First => *first,
        Form::Initial { later, .. } => *later,
        form => form,
    }
}

/// The factor of an observation that may be absent: nothing depends on it, so that without it the factor sums to one.
fn leaf(model: &Model, variable: VariableId) -> Option<crate::ids::FactorId> {
    let id = model.factor_of(variable)?;
    let factor = &model.factors[id];
    let is_used = model.factors.ids().any(|other| of_form(model, other).contains(&variable));
    let is_carried = model.variables.values().any(|other| other.previous_of == Some(variable));
    let is_plain = model.variables[variable].family.is_none() && factor.left.len() == 1;
    let is_asked = matches!(factor.form, Form::Ask { .. });
    (is_plain && !is_used && !is_carried && !is_asked && is_proper(model, id)).then_some(id)
}
