//! The kernels of a filter: one for each kind of instant.
//!
//! In: a question over time, and which instant. Out: an [`InstantCode`], for printed code. Invariant: chains of finite states and
//! normal laws have the numbers of the other doors; a program that is not linear has a kernel of its tangents, one for each
//! instant, taken at the mean before each observation.

use super::{By, OverTime};
use crate::analysis::relevant_variables;
use crate::distribution::Setting;
use crate::equation::Exact;
use crate::error::Error;
use crate::ids::VariableId;
use crate::lower::{Lowered, NormalLowered, Phase, Step, lower_instant, lower_normal};
use crate::model::{Finding, Model, Searched, Statistic, When};
use crate::strategies::gaussian::{Extended, Filter, not_linearised};

/// The kernel of an instant.
#[derive(Clone, PartialEq, Debug)]
pub enum InstantCode {
    /// Of finite states: a sum of products.
    Chain {
        /// The question of the instant.
        step: Step,
        /// Its equation.
        exact: Exact,
        /// Its kernel.
        lowered: Lowered,
    },
    /// Of a normal law.
    Normal(NormalLowered),
}

impl OverTime {
    /// The kinds of instants of which it needs a kernel.
    pub fn phases(&self) -> &'static [Phase] {
        match self.ask().when {
            When::Smooth => &[Phase::First, Phase::Later, Phase::Back, Phase::Both],
            When::Sequence => &[Phase::First, Phase::Best, Phase::Trace],
            When::Predict(1..) => &[Phase::First, Phase::Later, Phase::Ahead],
            _ => &[Phase::First, Phase::Later],
        }
    }

    /// Whether its kernels compute the exact answer.
    pub fn is_exact(&self) -> bool {
        matches!(self.by, By::Chain | By::Gaussian(_))
    }

    /// The reason why it has no kernels, if it has none.
    pub(super) fn without_kernel(&self, model: &Model) -> Option<String> {
        let ask = self.ask();
        let given = "`answer::ask_over_time` answers it";
        let is_carried = |item: &Searched| self.carried.iter().any(|(now, _)| *now == item.variable);
        let is_family = |(now, _): &(VariableId, VariableId)| model.variables[*now].family.is_some();
        if ask.when.is_every_instant() {
            if self.by != By::Chain {
                return Some(format!(
                    "emitted code answers `smooth` and `sequence` of finite variables; {given}"
                ));
            }
            if !ask.searched.iter().all(is_carried) || self.carried.iter().any(is_family) {
                let what =
                    "emitted code answers `smooth` and `sequence` of carried variables, and not of families";
                return Some(format!("{what}; {given}"));
            }
            if ask.when == When::Sequence
                && !matches!(ask.statistic, Statistic::Distribution | Statistic::Argmax { nearest: None })
            {
                return Some(format!("emitted code answers with the most likely sequence; {given}"));
            }
        }
        let finite = matches!(
            ask.statistic,
            Statistic::Distribution
                | Statistic::Maximum
                | Statistic::Argmax { nearest: None }
                | Statistic::Entropy
        );
        match &self.by {
            By::Chain => (!finite).then(|| format!("emitted code has no such statistic over time; {given}")),
            _ if ask.statistic != Statistic::Distribution
                || ask.searched.iter().any(|item| model.is_predicate(item.variable)) =>
            {
                Some(format!(
                    "emitted code answers with the moments of a normal law: ask for the distribution; {given}"
                ))
            }
            _ if ask.known.iter().any(|known| matches!(known.evidence, Finding::Virtual(_))) => {
                Some("virtual evidence is no observation of a real".to_owned())
            }
            By::Gaussian(_) | By::Extended => None,
            By::Particles { reason, .. } => not_linearised(model, ask)
                .map(|why| format!("{reason}, and it is not linearised: {why}; {given}")),
        }
    }

    /// The number that a form refuses, if its kernels compute a normal law.
    pub fn refused(&self, setting: &Setting<'_>) -> Option<Error> {
        match &self.by {
            By::Chain => None,
            By::Gaussian(gaussian) => Filter::of(setting, gaussian).err(),
            By::Extended | By::Particles { .. } => {
                let nothing = [super::Instant::new()];
                let followed = Extended::new(setting, self).and_then(|mut filter| filter.filtered(&nothing));
                followed.err()
            }
        }
    }

    /// The kernel of an instant; `guarded`: for separate exponents.
    ///
    /// # Errors
    /// A form or an expression that has no kernel.
    pub fn instant(
        &self,
        model: &Model,
        phase: Phase,
        name: &str,
        guarded: bool,
    ) -> Result<InstantCode, Error> {
        if let By::Chain = self.by {
            let (step, exact) = Step::of_chain(model, self.ask(), &self.carried, phase)?;
            let lowered = lower_instant(&step, &exact, name, guarded)?;
            return Ok(InstantCode::Chain { step, exact, lowered });
        }
        let wanted = relevant_variables(model, std::slice::from_ref(self.ask()));
        lower_normal(model, self.ask(), (&self.carried, &wanted), phase, name).map(InstantCode::Normal)
    }
}
