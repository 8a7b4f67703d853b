//! The instants of a whole series: messages from later instants, and the most likely states.
//!
//! In: a [`Step`] whose factors are those of its instant. Out: its question and equation. Invariant: each is a sum of products as
//! of any question; a message from later instants is the likelihood of an observation that is always made.
//!
//! βₜ₋₁(X⁻¹) ∝ Σ_X φₜ βₜ(X), P(X | z) ∝ αₜ(X) βₜ(X) (Baum et al. 1970); δₜ(X) = max φₜ δₜ₋₁(X⁻¹), and back: the largest of
//! φₜ δₜ₋₁(X⁻¹) at the X that was found (Viterbi 1967).

use super::{Phase, Step, asked, joint};
use crate::equation::{self, Exact, Options};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Factor, Finding, Form, Known, Value, Variable, When};

/// The name of the message from later instants.
const LATER: &str = "later observations";

impl Step {
    fn now(&self) -> Vec<VariableId> {
        self.carried.iter().map(|(now, _)| *now).collect()
    }

    /// The observation whose likelihood is the message from later instants.
    fn later_observations(&mut self) -> Known {
        let name = LATER.to_owned();
        let domain = Domain::Boolean;
        let seen = Variable { name, previous_of: None, domain, family: None, derived: None };
        let variable = self.model.variables.push(seen);
        let now = self.now();
        let given = now.iter().copied().chain(self.model.plate_index()).collect();
        self.model.factors.push(Factor {
            left: vec![variable.into()],
            right: now.iter().map(|id| (*id).into()).collect(),
            form: Form::Ask { path: LATER.to_owned(), given },
            products: Vec::new(),
        });
        Known { variable, evidence: Finding::Hard(Value::Ordinal(1)) }
    }

    /// α(X) β(X): all other variables of the program are left out.
    pub(super) fn of_both(mut self, ask: &Ask) -> Result<(Self, Exact), Error> {
        let now = self.now();
        self.model.factors = Default::default();
        let mut known = Vec::new();
        for (id, variable) in self.model.variables.iter() {
            if !now.contains(&id) && Some(id) != self.model.plate_index() {
                let value = if variable.domain.is_finite() { Value::Ordinal(0) } else { Value::Real(0.0) };
                known.push(Known { variable: id, evidence: Finding::Hard(value) });
            }
        }
        let form = Form::Previous { of: now[0], at: None, otherwise: Box::new(Form::Uniform) };
        self.model.factors.push(joint(now.into_iter(), form));
        known.push(self.later_observations());
        self.asks = vec![Ask { when: When::Now, known, ..ask.clone() }];
        let asks = self.asks.clone();
        self.planned(asks)
    }

    /// The message to the instant before, the most likely states, or those before a known one.
    pub(super) fn of_series(mut self) -> Result<(Self, Exact), Error> {
        let (now, mut known) = (self.now(), self.asks[0].known.clone());
        let before: Vec<VariableId> = self.carried.iter().map(|(_, before)| *before).collect();
        match self.phase {
            Phase::Best => {
                let all = before.into_iter().chain(now).collect();
                let (step, mut exact) = self.planned(vec![asked(all, known)])?;
                exact.asks = step.asks.clone();
                return Ok((step, exact));
            }
            Phase::Trace => known.extend(now.iter().map(|id| Known {
                variable: *id,
                evidence: Finding::Hard(Value::Given(format!("{} then", self.model.variable_name(*id)))),
            })),
            _ => known.push(self.later_observations()),
        }
        self.asks = vec![asked(before, known)];
        let asks = self.asks.clone();
        self.planned(asks)
    }

    fn planned(self, asks: Vec<Ask>) -> Result<(Self, Exact), Error> {
        let exact = equation::exact(&self.model, asks, Options::default())?;
        Ok((self, exact))
    }
}
