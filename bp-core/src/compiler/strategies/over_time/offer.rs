//! The route of a question over time: the carried variables, and how their distribution is represented.
//!
//! In: a model with variables of the previous instant, and a `filter`, `predict`, `smooth` or `sequence`. Out: an
//! [`OverTime`] route. Invariant: the transition is the program's own decomposition; X^-1 before the first instant has
//! its own form (`previous(X) else …`), and a real without one is 0, at rest.
//!
//! P(Xₜ | z₁..ₜ) ∝ Σ_X⁻¹ φₜ P(X⁻¹ | z₁..ₜ₋₁), φₜ the product of the factors of an instant: all but those of X⁻¹. It is
//! read from the forms; a conditional P(Xₜ zₜ | X⁻¹) of the joint distribution would be undefined where P(X⁻¹) = 0.

use super::answer::Instants;
use crate::analysis::{carried, of_form};
use crate::equation::{Line, Mark, Marked, Notation, Strategy, made_of_parts};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, DerivedKind, Finding, Known, Model, Question, Searched, Statistic, Value, When};
use crate::strategies::gaussian::Gaussian;
use crate::strategies::{Offered, Prepared, Purpose};
use std::collections::BTreeSet;

/// A question over time.
#[derive(Clone, PartialEq, Debug)]
pub struct OverTime {
    /// The asks: exactly one.
    pub asks: Vec<Ask>,
    /// The carried variables: (X, X^-1).
    pub carried: Vec<(VariableId, VariableId)>,
    /// The representation of the belief.
    pub by: By,
}

/// How the belief of a question over time is represented.
#[derive(Clone, PartialEq, Debug)]
pub enum By {
    /// Finite states: sums over them, forward and backward.
    Chain,
    /// All variables are linear and Gaussian: a normal law is carried.
    Gaussian(Gaussian),
    /// Real, with normal forms: a normal law is carried, by equations linearised at each instant.
    Extended,
    /// Draws that follow the program, weighted by the likelihood of the observations.
    Particles {
        /// The variables that are not drawn: given the others they are linear and Gaussian, and each particle carries
        /// their normal law. Parents first.
        linear: Vec<VariableId>,
        /// The reason why no exact belief can be carried.
        reason: String,
        /// Whether draws are proposed by the linearised program.
        guided: bool,
    },
}

/// Refuses questions that no strategy answers over time.
pub(crate) fn check(model: &Model, ask: &Ask) -> Result<(), Error> {
    let is_element = |known: &&Known| {
        let variable = &model.variables[known.variable];
        variable.derived == Some(DerivedKind::Element)
            && variable.family.is_none()
            && matches!(known.evidence, Finding::Each | Finding::Hard(Value::Given(_)))
    };
    if let Some(known) = ask.known.iter().find(is_element) {
        let name = model.variable_name(known.variable);
        let reason = format!(
            "over time `{name}` is read from a column only if its index is a number, and is not given by another name: \
             write `{name}` alone, with a number as its index"
        );
        return Err(Error::Unplanned { question: model.ask_text(ask), reason });
    }
    let soft = ask.known.iter().find(|known| matches!(known.evidence, Finding::Soft(_)));
    soft.map_or(Ok(()), |known| {
        let name = model.variable_name(known.variable);
        let reason = format!(
            "soft evidence replaces the distribution at one instant; over time write a likelihood, \
             `{name} virtual [...]`, which holds at each"
        );
        Err(Error::Unplanned { question: model.ask_text(ask), reason })
    })
}

/// Refuses a sequence that does not search all carried variables, or that fixes the value of one.
pub(crate) fn check_sequence(model: &Model, ask: &Ask) -> Result<(), Error> {
    if ask.when != When::Sequence {
        return Ok(());
    }
    let refused = |reason: String| Err(Error::Unplanned { question: model.ask_text(ask), reason });
    if let Some(item) =
        ask.searched.iter().find(|item| item.at.is_some() && !model.is_predicate(item.variable))
    {
        let name = model.variable_name(item.variable);
        return refused(format!(
            "a sequence finds the value of `{name}` at each instant: leave its value out"
        ));
    }
    let is_asked = |now: &VariableId| ask.searched.iter().any(|item| item.variable == *now);
    let Some(now) = carried(model).into_iter().map(|(now, _)| now).find(|now| !is_asked(now)) else {
        return Ok(());
    };
    let (name, word) = (model.variable_name(now), ask.statistic.word());
    let word = match ask.statistic {
        Statistic::Distribution | Statistic::Argmax { .. } => String::new(),
        _ => format!("{word} "),
    };
    let all = format!("`{word}sequence` is of all that is carried from instant to instant");
    match ask.known.iter().any(|known| known.variable == now) {
        true => refused(format!("{all}, but `{name}` is known: ask `smooth`")),
        false => refused(format!("{all}: search `{name}` too")),
    }
}

/// The reason why a statistic does not apply to a normal law.
pub(crate) fn not_of_normal(model: &Model, ask: &Ask) -> Option<String> {
    match (ask.when, &ask.statistic) {
        (when, _) if asks_whether(model, ask) && when != When::Sequence => None,
        (_, Statistic::Best(_)) => Some("reals have no second best value: ask for `argmax`".to_owned()),
        (When::Sequence, _) => not_of_reals(model, ask),
        _ => with_value(model, ask),
    }
}

/// Whether an ask is for a predicate.
fn asks_whether(model: &Model, ask: &Ask) -> bool {
    matches!(ask.searched.as_slice(), [only] if model.is_predicate(only.variable))
}

/// The refusal of a searched real that has a value.
fn with_value(model: &Model, ask: &Ask) -> Option<String> {
    let is_one_value =
        |item: &&Searched| item.at.is_some() && !model.variables[item.variable].domain.is_finite();
    let item = ask.searched.iter().find(is_one_value)?;
    let name = model.variable_name(item.variable);
    Some(format!("over time the whole distribution is answered: search `{name}`, without a value"))
}

/// Whether an ask is for draws of reals, or for the mode of one: these are read from drawn values, and not from laws.
pub(crate) fn draws_reals(model: &Model, ask: &Ask) -> bool {
    let is_finite = |item: &Searched| model.variables[item.variable].domain.is_finite();
    match (&ask.statistic, ask.searched.as_slice()) {
        (_, searched) if searched.iter().all(is_finite) => false,
        (Statistic::Draw(_), _) => true,
        (Statistic::Argmax { nearest: None }, [only]) => {
            model.components(only.variable) == 1 && model.variables[only.variable].family.is_none()
        }
        _ => false,
    }
}

/// The reason why a statistic does not apply to particles, or to the laws of a sequence.
pub(crate) fn not_of_reals(model: &Model, ask: &Ask) -> Option<String> {
    if let Some(why) = with_value(model, ask) {
        return Some(why);
    }
    let word = match (ask.when, &ask.statistic) {
        (When::Sequence, _) if asks_whether(model, ask) => {
            return Some(
                "a sequence consists of carried variables: ask for `smooth`, each instant alone".to_owned(),
            );
        }
        (_, Statistic::Distribution | Statistic::Expectation | Statistic::Variance) => return None,
        (_, Statistic::Quantile(_) | Statistic::Interval(_)) => return None,
        (When::Filter | When::Predict(_) | When::Smooth, _) if draws_reals(model, ask) => return None,
        (
            When::Filter | When::Predict(_) | When::Smooth,
            Statistic::Argmax { nearest: None }
            | Statistic::Maximum
            | Statistic::Entropy
            | Statistic::Best(_)
            | Statistic::Draw(_),
        ) if ask.searched.iter().all(|item| model.variables[item.variable].domain.is_finite()) => {
            return None;
        }
        // The most likely sequence of a normal law is that of the smoothed means.
        (When::Sequence, Statistic::Argmax { .. }) => return None,
        (_, statistic) => statistic.word(),
    };
    Some(match ask.when {
        When::Sequence => format!(
            "`{word}` is not available for a sequence of reals: ask for `sequence`, or for `{word} smooth P(…)`, each \
             instant alone"
        ),
        _ => format!(
            "`{word}` is not available: ask for the distribution, its `expectation`, `variance` or `quantile(…)`"
        ),
    })
}

impl Offered for OverTime {
    fn strategy(&self) -> Strategy {
        match self.by {
            By::Chain => Strategy::Chain,
            By::Gaussian(_) => Strategy::Gaussian,
            By::Particles { .. } => Strategy::Particles,
            By::Extended => Strategy::ExtendedKalman,
        }
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    fn cost(&self, model: &Model) -> Option<f64> {
        match &self.by {
            By::Gaussian(gaussian) => gaussian.cost(model),
            By::Chain | By::Particles { .. } | By::Extended => None,
        }
    }

    fn reason(&self) -> &'static str {
        match self.by {
            By::Chain => "exact, instant by instant: the carried variables are finite",
            By::Gaussian(_) => "exact, instant by instant: the carried variables are linear and Gaussian",
            By::Particles { .. } => "estimated, instant by instant, by particles",
            By::Extended => "approximate, instant by instant: linearised",
        }
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        (self.derivation(model, notation), Vec::new())
    }

    fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        OverTime::marks(self, model, notation)
    }

    fn not_printed(&self, model: &Model) -> Option<String> {
        self.without_kernel(model)
    }

    fn prepare(&self, _: &Model, _: &Question, purpose: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(Instants { route: self.clone(), purpose }))
    }
}

impl OverTime {
    /// The ask.
    pub fn ask(&self) -> &Ask {
        &self.asks[0]
    }

    /// The known variables of the question, without the plate's index.
    pub fn observed(&self, model: &Model) -> BTreeSet<VariableId> {
        let known = self.ask().known.iter().map(|known| known.variable);
        known.filter(|variable| Some(*variable) != model.plate_index()).collect()
    }

    /// Why the ask has no answer at the first instant: it searches a variable of the instant before, but the first
    /// instant has a form of its own, so there is none before it.
    pub(crate) fn absent_at_first(&self, model: &Model) -> Option<Error> {
        let starts = |id: &VariableId| {
            model.factor_of(*id).is_some_and(|factor| model.factors[factor].form.is_initial())
        };
        // A function or a predicate reads variables.
        let mut read: Vec<VariableId> = self.ask().searched.iter().map(|item| item.variable).collect();
        let mut next = 0;
        while let Some(id) = read.get(next).copied() {
            next += 1;
            if model.variables[id].derived.is_some() {
                read.extend(model.factor_of(id).into_iter().flat_map(|factor| of_form(model, factor)));
            }
        }
        let absent =
            read.into_iter().find(|id| model.variables[*id].previous_of.as_ref().is_some_and(starts))?;
        let name = model.variable_name(absent);
        let now = name.strip_suffix("^-1").unwrap_or(&name);
        let reason = format!(
            "`{name}` has no value at the first instant, where `P(initial({now}))` is the distribution of `{now}`"
        );
        Some(Error::Unplanned { question: model.ask_text(self.ask()), reason })
    }

    /// The products of an instant. Linear-Gaussian programs carry a mean and a covariance and have no products.
    pub(crate) fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        let reason = match self.by {
            By::Gaussian(_) | By::Extended => return Vec::new(),
            By::Chain => "over time each potential has a separate scale",
            By::Particles { .. } => "weights of draws are logarithms",
        };
        let last = self.derivation(model, notation).pop().map(|(_, _, equation)| equation);
        let marked = |product| Marked { product, mark: Mark::Log, reason: reason.to_owned() };
        let made = made_of_parts(model, self.ask(), notation).into_iter().map(|(_, _, equation)| equation);
        last.into_iter().chain(made).map(marked).collect()
    }
}
