//! Questions over time: what is carried from instant to instant, and how.
//!
//! In: a model with variables of the previous instant, and a `filter`, `predict`, `smooth` or `sequence`. Out: an
//! [`OverTime`] route. Invariant: what an instant says is the program's own decomposition; what X^-1 was before the first
//! instant is what its own form says (`previous(X) else …`), and a real without one is 0, at rest.
//!
//! P(Xₜ | z₁..ₜ) ∝ Σ_X⁻¹ P(Xₜ zₜ | X⁻¹) P(X⁻¹ | z₁..ₜ₋₁)

use super::notation::Notation;
use super::print::Line;
use super::{Gaussian, gaussian, plan_exact, sampled};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Evidence, Known, Model, Reduction, Searched, Value};
use std::collections::BTreeSet;

/// A question over time.
#[derive(Clone, PartialEq, Debug)]
pub struct OverTime {
    /// What is asked.
    pub ask: Ask,
    /// What is carried: (X, X^-1).
    pub carried: Vec<(VariableId, VariableId)>,
    /// By what it is answered.
    pub by: By,
}

/// By what a question over time is answered.
#[derive(Clone, PartialEq, Debug)]
pub enum By {
    /// Finite states: sums over them, forward and backward.
    Chain,
    /// All is linear and Gaussian: a normal law is carried.
    Gaussian(Gaussian),
    /// Draws, which follow the program and are weighed by what is observed.
    Particles {
        /// The variables that are not drawn: given the others they are linear and Gaussian, and each particle carries
        /// their normal law. Parents first.
        linear: Vec<VariableId>,
        /// Why nothing exact is carried.
        reason: String,
    },
}

/// Plans a question over time.
pub(super) fn plan(model: &Model, ask: Ask) -> Result<OverTime, Error> {
    let refused = |reason: String| Error::Unplanned { question: model.ask_text(&ask), reason };
    for known in &ask.known {
        if matches!(known.evidence, Evidence::Virtual(_) | Evidence::Soft(_)) {
            let name = model.variable_name(known.variable);
            return Err(refused(format!(
                "over time `{name}` is observed instant by instant, not by likelihoods"
            )));
        }
    }
    if let Some(item) = ask.searched.iter().find(|item| item.at.is_some()) {
        let name = model.variable_name(item.variable);
        return Err(refused(format!("over time all values of `{name}` are told, not one")));
    }
    let carried: Vec<(VariableId, VariableId)> =
        model.variables.iter().filter_map(|(id, variable)| Some((variable.previous_of?, id))).collect();
    if gaussian::is_linear(model) {
        let plain = Ask { reduction: Reduction::Probability, ..ask.clone() };
        let by = By::Gaussian(gaussian::plan(model, vec![plain])?);
        return Ok(OverTime { ask, carried, by });
    }
    let mut route = OverTime { ask: ask.clone(), carried, by: By::Chain };
    let finite = |id: &VariableId| {
        let variable = &model.variables[*id];
        variable.domain.is_finite() && variable.family.is_none()
    };
    let searched = ask.searched.iter().map(|item| item.variable);
    let hidden = route.carried.iter().map(|(now, _)| *now).chain(searched).find(|id| !finite(id));
    let reason = match hidden {
        Some(id) => {
            format!("`{}` is not finite, and not everything is linear and Gaussian", model.variable_name(id))
        }
        None => {
            let transition = route.transition(model, &route.observed(model));
            match plan_exact(model, vec![transition], super::Options::default()) {
                Ok(_) => String::new(),
                Err(Error::Unplanned { reason, .. }) => reason,
                Err(other) => return Err(other),
            }
        }
    };
    if reason.is_empty() {
        let asked: Vec<VariableId> = ask.searched.iter().map(|item| item.variable).collect();
        let missing = route.carried.iter().map(|(now, _)| *now).find(|now| !asked.contains(now));
        if let (Reduction::Sequence, Some(now)) = (&ask.reduction, missing) {
            let name = model.variable_name(now);
            return Err(refused(format!(
                "the most likely sequence is that of all that is carried: search `{name}` too"
            )));
        }
        return Ok(route);
    }
    if matches!(ask.reduction, Reduction::Smooth | Reduction::Sequence) {
        let word = ask.reduction.word();
        return Err(refused(format!("{reason}; and draws go forward only: ask for `filter`, not `{word}`")));
    }
    if let Some(why) = model.factors.values().find_map(|factor| sampled::refused_factor(model, factor)) {
        return Err(refused(format!("{reason}; and {why}")));
    }
    route.by = By::Particles { linear: gaussian::conditionally_linear(model), reason };
    Ok(route)
}

impl OverTime {
    /// The variables that the question knows, without the plate's index.
    pub fn observed(&self, model: &Model) -> BTreeSet<VariableId> {
        let known = self.ask.known.iter().map(|known| known.variable);
        known.filter(|variable| Some(*variable) != model.plate_index()).collect()
    }

    /// P(X S Z | X^-1 each), where a real Z stands for the value that is given.
    pub fn transition(&self, model: &Model, observed: &BTreeSet<VariableId>) -> Ask {
        let mut left: Vec<Searched> =
            self.carried.iter().map(|(now, _)| Searched { variable: *now, at: None }).collect();
        let searched = self.ask.searched.iter().map(|item| &item.variable);
        for variable in searched.chain(observed) {
            if left.iter().any(|item| item.variable == *variable) {
                continue;
            }
            let real = matches!(model.variables[*variable].domain, Domain::Real | Domain::Vector(_));
            let at = real.then(|| Value::Given(model.variable_name(*variable)));
            left.push(Searched { variable: *variable, at });
        }
        let before =
            self.carried.iter().map(|(_, before)| Known { variable: *before, evidence: Evidence::Each });
        Ask { reduction: Reduction::Probability, searched: left, known: before.collect() }
    }

    /// What is done at each instant, as lines.
    pub(super) fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let names = |ids: &[VariableId]| notation.names(model, ids);
        let now: Vec<VariableId> = self.carried.iter().map(|(now, _)| *now).collect();
        let before: Vec<VariableId> = self.carried.iter().map(|(_, before)| *before).collect();
        let observed: Vec<VariableId> = self.observed(model).into_iter().collect();
        let told =
            now.iter().map(|id| format!("`{}`", model.variable_name(*id))).collect::<Vec<_>>().join(", ");
        let past = notation.said("past", "\\text{past}");
        let mut known = names(&observed);
        known.push(past.clone());
        let belief = notation.distribution(&names(&now), &known);
        let mut joint = names(&now);
        joint.extend(names(&observed));
        let forward = format!(
            "{belief} {} {}{} {}",
            notation.said("∝", "\\propto"),
            match self.by {
                By::Chain => notation.sum(&names(&before)),
                _ => notation.integral(&names(&before)),
            },
            notation.distribution(&joint, &names(&before)),
            notation.distribution(&names(&before), std::slice::from_ref(&past)),
        );
        let (rule, reason) = match &self.by {
            By::Chain => {
                ("forward", format!("{told} is carried and finite: each instant is a sum over what it was"))
            }
            By::Gaussian(_) => {
                ("Kalman filter", format!("{told} is carried, linear and Gaussian: a normal law is carried"))
            }
            By::Particles { reason, .. } => (
                "particle filter",
                format!("{reason}: draws follow the program and are weighed by what is observed"),
            ),
        };
        let mut lines = vec![(rule.to_owned(), reason, forward)];
        if let By::Particles { linear, .. } = &self.by {
            let resampled =
                "particles are resampled (systematically) when they are worth less than half of them";
            let equation = notation.said("1 / Σₙ wₙ² < N / 2", "1 / \\sum_n w_n^2 < N / 2").to_owned();
            lines.push(("resampling".to_owned(), resampled.to_owned(), equation));
            if !linear.is_empty() {
                let names: Vec<String> =
                    linear.iter().map(|id| format!("`{}`", model.variable_name(*id))).collect();
                let reason = format!(
                    "given the others, {} is linear and Gaussian: not drawn, carried as a normal law by each particle",
                    names.join(", ")
                );
                lines.push((
                    "Rao-Blackwell".to_owned(),
                    reason,
                    notation.said("N(x; mₙ, Σₙ)", "\\mathcal{N}(x; m_n, \\Sigma_n)").to_owned(),
                ));
            }
        }
        let last = match self.ask.reduction {
            Reduction::Smooth => Some((
                "backward",
                "what came after speaks too",
                notation.said("βₜ₋₁ = Σ P(X zₜ | X⁻¹) βₜ", "\\beta_{t-1} = \\sum P(X z_t | X^{-1}) \\beta_t"),
            )),
            Reduction::Sequence => Some((
                "most likely sequence",
                "sums become maxima",
                notation
                    .said("δₜ = max P(X zₜ | X⁻¹) δₜ₋₁", "\\delta_t = \\max P(X z_t | X^{-1}) \\delta_{t-1}"),
            )),
            Reduction::Predict(_) => Some((
                "prediction",
                "instants follow of which nothing is observed",
                notation.said("Σ P(X | X⁻¹) P(X⁻¹)", "\\sum P(X | X^{-1}) P(X^{-1})"),
            )),
            _ => None,
        };
        lines.extend(last.map(|(rule, reason, equation)| (rule.to_owned(), reason.to_owned(), equation)));
        lines
    }
}
