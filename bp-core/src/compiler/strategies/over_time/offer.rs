//! The route of a question over time: the carried variables, and how their distribution is represented.
//!
//! In: a model with variables of the previous instant, and a `filter`, `predict`, `smooth` or `sequence`. Out: an
//! [`OverTime`] route. Invariant: the transition is the program's own decomposition; X^-1 before the first instant has
//! its own form (`previous(X) else …`), and a real without one is 0, at rest.
//!
//! P(Xₜ | z₁..ₜ) ∝ Σ_X⁻¹ φₜ P(X⁻¹ | z₁..ₜ₋₁), φₜ the product of the factors of an instant: all but those of X⁻¹. It is
//! read from the forms; a conditional P(Xₜ zₜ | X⁻¹) of the joint distribution would be undefined where P(X⁻¹) = 0.

use super::answer::Instants;
use crate::equation::{Line, Mark, Marked, Notation, Strategy, made_of_parts, of_form};
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

/// The variables carried from instant to instant: (X, X^-1).
pub(crate) fn carried(model: &Model) -> Vec<(VariableId, VariableId)> {
    model.variables.iter().filter_map(|(id, variable)| Some((variable.previous_of?, id))).collect()
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

/// The refusal of a searched variable that has a value.
fn with_value(model: &Model, ask: &Ask) -> Option<String> {
    let is_one_value = |item: &&Searched| item.at.is_some() && !model.is_predicate(item.variable);
    let item = ask.searched.iter().find(is_one_value)?;
    let name = model.variable_name(item.variable);
    Some(format!("over time the whole distribution is answered: search `{name}`, without a value"))
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

    /// The variables that an instant sums out, and the product of its factors: all except those of X^-1 and barren
    /// ones.
    fn factors(&self, model: &Model, notation: Notation) -> (Vec<VariableId>, String) {
        let observed = self.observed(model);
        let before: Vec<VariableId> = self.carried.iter().map(|(_, before)| *before).collect();
        let searched = self.ask().searched.iter().map(|item| item.variable);
        let axes: BTreeSet<VariableId> = self.carried.iter().map(|(now, _)| *now).chain(searched).collect();
        let mut rest: Vec<VariableId> = axes.iter().chain(&observed).copied().collect();
        let mut wanted = BTreeSet::new();
        while let Some(id) = rest.pop() {
            if !before.contains(&id)
                && let Some(factor) = model.factor_of(id)
                && wanted.insert(factor)
            {
                rest.extend(of_form(model, factor));
            }
        }
        let mut hidden = before;
        let mut heads = Vec::with_capacity(wanted.len());
        for id in wanted {
            let factor = &model.factors[id];
            heads.push(notation.head(model, factor));
            let left = factor.left.iter().map(|use_| use_.variable);
            hidden.extend(left.filter(|id| !axes.contains(id) && !observed.contains(id)));
        }
        (hidden, heads.join(&notation.text(" ", "\\, ")))
    }

    /// The computation of each instant, as lines.
    pub(crate) fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let names = |ids: &[VariableId]| notation.names(model, ids);
        let now: Vec<VariableId> = self.carried.iter().map(|(now, _)| *now).collect();
        let before: Vec<VariableId> = self.carried.iter().map(|(_, before)| *before).collect();
        let observed: Vec<VariableId> = self.observed(model).into_iter().collect();
        let carried_names =
            now.iter().map(|id| format!("`{}`", model.variable_name(*id))).collect::<Vec<_>>().join(", ");
        let past = notation.text("past", "\\text{past}");
        let mut known = names(&observed);
        known.push(past.clone());
        let belief = notation.distribution(&names(&now), &known);
        let proportional = notation.text("∝", "\\propto");
        let carried = notation.distribution(&names(&before), std::slice::from_ref(&past));
        let forward = match self.by {
            By::Chain => {
                let (hidden, factors) = self.factors(model, notation);
                format!("{belief} {proportional} {}{factors} {carried}", notation.sum(&names(&hidden)))
            }
            _ => {
                let mut joint = names(&now);
                joint.extend(names(&observed));
                let moved = notation.distribution(&joint, &names(&before));
                format!("{belief} {proportional} {}{moved} {carried}", notation.integral(&names(&before)))
            }
        };
        let (rule, reason) = match &self.by {
            By::Chain => {
                let starts = |now: &VariableId| {
                    model.factor_of(*now).is_some_and(|factor| model.factors[factor].form.is_initial())
                };
                let started = |(now, before): (&VariableId, &VariableId)| match starts(now) {
                    true => format!("`P(initial({}))`", model.variable_name(*now)),
                    false => format!("`P({})`", model.variable_name(*before)),
                };
                let start: Vec<String> = now.iter().zip(&before).map(started).collect();
                let start = format!("{} has its form", start.join(", "));
                let reason = format!(
                    "{carried_names} is carried and finite: each instant is a sum over its previous value; at the first, {start}"
                );
                ("forward", reason)
            }
            By::Gaussian(_) => (
                "Kalman filter",
                format!("{carried_names} is carried, linear and Gaussian: a normal distribution is carried"),
            ),
            By::Extended => (
                "extended Kalman filter",
                format!(
                    "approximate: a normal distribution of {carried_names} is carried by the tangents of the means, taken at the estimate \
                     of each instant"
                ),
            ),
            By::Particles { reason, .. } => (
                "particle filter",
                format!("{reason}: draws follow the program and are weighted by the observations"),
            ),
        };
        let mut lines = vec![(rule.to_owned(), reason, forward)];
        if let By::Particles { linear, guided, .. } = &self.by {
            if *guided && self.ask().when.is_over_time() {
                let reason = "where all observations are given together, draws are proposed by the program linearised along its \
                              most probable path, and weighted by the program over the proposal; where unguided draws find \
                              observations more probable, they answer";
                let equation = notation
                    .text("wₙ ← wₙ p(x z | x⁻¹) / q(x)", "w_n \\leftarrow w_n\\, p(x z | x^{-1}) / q(x)");
                lines.push(("guided proposal".to_owned(), reason.to_owned(), equation.to_owned()));
            }
            let resampled =
                "particles are resampled (systematically) when their effective number is less than half";
            let equation = notation.text("1 / Σₙ wₙ² < N / 2", "1 / \\sum_n w_n^2 < N / 2").to_owned();
            lines.push(("resampling".to_owned(), resampled.to_owned(), equation));
            if !linear.is_empty() {
                let names: Vec<String> =
                    linear.iter().map(|id| format!("`{}`", model.variable_name(*id))).collect();
                let reason = format!(
                    "given the others, {} is linear and Gaussian: not sampled, carried as a normal distribution by each particle",
                    names.join(", ")
                );
                lines.push((
                    "Rao-Blackwell".to_owned(),
                    reason,
                    notation.text("N(x; mₙ, Σₙ)", "\\mathcal{N}(x; m_n, \\Sigma_n)").to_owned(),
                ));
            }
        }
        let by_particles = matches!(self.by, By::Particles { .. });
        let last = match self.ask().when {
            When::Smooth if by_particles => Some((
                "backward simulation",
                "each path goes back from particle to particle; where the transition has no density, to its ancestors",
                notation.text("xₜ ~ Wₜ p(xₜ₊₁ | xₜ)", "x_t \\sim W_t\\, p(x_{t+1} | x_t)"),
            )),
            When::Sequence if by_particles => Some((
                "most probable path",
                "of the paths of the particles the one with the largest density together with the observations",
                notation.text("maxₙ p(x₁ … x_T z)", "\\max_n p(x_1 \\ldots x_T z)"),
            )),
            When::Smooth => Some((
                "backward",
                "with later observations",
                notation.text(
                    "βₜ₋₁(X⁻¹) ∝ Σ φₜ βₜ(X)",
                    "\\beta_{t-1}(X^{-1}) \\propto \\sum \\phi_t \\beta_t(X)",
                ),
            )),
            When::Sequence if matches!(self.ask().statistic, Statistic::Draw(_)) => Some((
                "drawn sequence",
                "backward, each instant given the one after it",
                notation.text("X⁻¹ ~ φₜ δₜ₋₁(X⁻¹)", "X^{-1} \\sim \\phi_t\\, \\delta_{t-1}(X^{-1})"),
            )),
            When::Sequence => Some((
                "most likely sequence",
                "sums become maxima",
                notation.text(
                    "δₜ(X) = max φₜ δₜ₋₁(X⁻¹)",
                    "\\delta_t(X) = \\max \\phi_t\\, \\delta_{t-1}(X^{-1})",
                ),
            )),
            When::Predict(_) => Some((
                "prediction",
                "instants follow without observations",
                notation.text("Σ P(X | X⁻¹) P(X⁻¹)", "\\sum P(X | X^{-1}) P(X^{-1})"),
            )),
            _ => None,
        };
        lines.extend(last.map(|(rule, reason, equation)| (rule.to_owned(), reason.to_owned(), equation)));
        lines
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
