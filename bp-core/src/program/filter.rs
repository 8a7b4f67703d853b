//! A filter over time: one instant after the other.
//!
//! In: a program with variables `X^-1`, and the observations at each instant. Out: the posterior after each. Invariant:
//! only what the next instant needs is kept, so that a filter can run indefinitely.

use super::value::{is_missing, read};
use super::{Evidence, Posterior, Program, Value};
use crate::distribution::Setting;
use crate::error::Error;
use crate::model::{Ask, Question, Statistic, When};
use crate::plan::{Route, plan};
use crate::strategies::over_time::{Follower, InstantPosterior, of_instant};
use std::collections::HashMap;
use std::fmt::{self, Debug, Formatter};

/// A filter: the posterior of the searched variables, given all observations so far.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let program = Program::parse(
///     "program Door {
///          variables { Open, Open^-1, Seen : bool; }
///          decomposition { P(Open^-1) P(Open | Open^-1) P(Seen | Open) }
///          forms {
///              P(Open^-1)        = previous(Open) else bernoulli(0);
///              P(Open | Open^-1) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
///              P(Seen | Open)    = bernoulli(if Open { 0.7 } else { 0.1 });
///          }
///      }",
/// )?;
/// let mut door = program.filter("P(Open | Seen)")?;
/// let open = door.step(evidence! { Seen: true })?;
/// // 0.1 · 0.7 / (0.1 · 0.7 + 0.9 · 0.1)
/// assert!((open.p(true)? - 0.4375).abs() < 1e-15);
/// // Nothing is seen: 0.4375 · 0.8 + 0.5625 · 0.1.
/// assert!((door.step(evidence! {})?.p(true)? - 0.40625).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
pub struct Filter<'p> {
    program: &'p Program,
    follower: Follower<'p>,
    /// The observed slots, by name.
    slots: HashMap<String, usize>,
}

impl<'p> Filter<'p> {
    pub(super) fn new(program: &'p Program, mut asked: Question) -> Result<Self, Error> {
        let model = program.model();
        if let Some(derived) = asked.derived.first() {
            let reason = "a filter follows whole variables; `question(\"filter P(…)\")` with `over` or `over_table` \
                answers this one";
            return Err(Error::Unplanned { question: derived.name.clone(), reason: reason.to_owned() });
        }
        for ask in &mut asked.asks {
            if ask.when == When::Now {
                ask.when = When::Filter;
            }
        }
        let mut routes = plan(model, &asked, program.options)?.routes;
        let route = match (routes.pop(), routes.len()) {
            (Some(Route::OverTime(route)), 0) if is_filter(route.ask()) => route,
            _ => {
                let reason = "a filter answers one question: `P(…)` or `filter P(…)`".to_owned();
                let question = asked.asks.first().map(|ask| model.ask_text(ask)).unwrap_or_default();
                return Err(Error::Unplanned { question, reason });
            }
        };
        let setting = Setting::new(model, program.inputs())?;
        let mut slots = HashMap::new();
        for variable in route.observed(model) {
            slots.extend(setting.slots_of(variable).map(|slot| (setting.slot_name(slot), slot)));
        }
        let follower = Follower::new(setting, route, program.sampling)?;
        Ok(Self { program, follower, slots })
    }

    /// One instant: its observations, which may be partial or empty; returns the posterior. The value of a family is
    /// the list of its elements, or each element is given separately, `Z[2]`.
    ///
    /// # Errors
    /// A name that the question does not know, a value that its variable does not have, observations that are
    /// impossible; the filter is then unchanged.
    pub fn step(&mut self, observed: Evidence) -> Result<Posterior, Error> {
        self.step_if(observed, |posterior| (posterior, true))
    }

    /// The same, but the instant is taken in only if `accepts`, which is given the posterior, returns true with its result: so that
    /// a host may forget an instant while it is computed.
    ///
    /// # Errors
    /// As [`Filter::step`].
    pub fn step_if<T>(
        &mut self,
        observed: Evidence,
        accepts: impl FnOnce(Posterior) -> (T, bool),
    ) -> Result<T, Error> {
        let (mut values, mut weighed) = (Vec::new(), Vec::new());
        for (name, value) in observed.iter() {
            let flat = value.flat();
            let places: Vec<usize> = match self.slots.get(name) {
                Some(slot) => vec![*slot],
                None => self.elements(name),
            };
            if places.is_empty() {
                let names: Vec<&str> = self.slots.keys().map(String::as_str).collect();
                return Err(Error::input(name, super::lookup::unknown(name, names)));
            }
            let setting = self.follower.setting();
            if let Value::Likelihood(weights) = value {
                let count = setting.count(setting.variable_of(places[0]));
                super::marginals::check(name, weights, count, places.len() == 1)?;
                weighed.push((places[0], weights.clone()));
                continue;
            }
            if places.len() != flat.len() {
                let message = format!("{} values were given, but {} are expected", flat.len(), places.len());
                return Err(Error::input(name, message));
            }
            for (slot, value) in places.into_iter().zip(flat).filter(|(_, value)| !is_missing(value)) {
                let size = |name: &str| setting.inputs().find_size(name);
                let read = read(setting.model, setting.variable_of(slot), value, &size);
                let (_, number) = read.map_err(|message| Error::input(name, message))?;
                values.push((slot, number));
            }
        }
        if let Some((slot, _)) = weighed.iter().find(|(slot, _)| values.iter().any(|(own, _)| own == slot)) {
            let name = self.follower.setting().slot_name(*slot);
            let message = format!("`{name}` is known twice");
            return Err(Error::input(name, message));
        }
        let program = self.program;
        self.follower.step_if(&values, &weighed, |follower, posterior, ln_evidence| {
            accepts(shown(program, follower, posterior, ln_evidence))
        })
    }

    /// The posterior `steps` instants later, without further observations. The filter does not advance.
    ///
    /// # Errors
    /// No steps, or a question that has no answer.
    pub fn predict(&mut self, steps: usize) -> Result<Posterior, Error> {
        if steps == 0 {
            return Err(Error::input("predict", "0 instants ahead is the answer of the last step"));
        }
        let posterior = self.follower.predict(steps)?;
        let mut posterior = shown(self.program, &self.follower, &posterior, self.follower.ln_evidence());
        posterior.answer.question.push_str(&format!(", {steps} later"));
        Ok(posterior)
    }

    /// ln P(all observations so far); for reals the density.
    pub fn ln_evidence(&self) -> f64 {
        self.follower.ln_evidence()
    }

    /// Number of instants so far.
    pub fn instants(&self) -> usize {
        self.follower.instants()
    }

    /// The slots of the elements of a family, or of the components of a vector.
    fn elements(&self, name: &str) -> Vec<usize> {
        let setting = self.follower.setting();
        let known = setting.model.variables_by_name();
        let slots = known.get(name).map(|variable| setting.slots_of(*variable)).unwrap_or_default();
        slots.filter(|slot| self.slots.values().any(|own| own == slot)).collect()
    }
}

/// The posterior at an instant.
fn shown(
    program: &Program,
    follower: &Follower<'_>,
    instant: &InstantPosterior,
    ln_evidence: f64,
) -> Posterior {
    let (setting, route) = (follower.setting(), follower.route());
    Posterior::new(program, of_instant(setting, route, instant, ln_evidence, program.sampling))
}

/// Whether an ask is for the distribution of the last instant.
fn is_filter(ask: &Ask) -> bool {
    ask.when == When::Filter && ask.statistic == Statistic::Distribution
}

impl Debug for Filter<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let ask = self.program.model().ask_text(self.follower.route().ask());
        write!(f, "Filter({ask}, {} instants)", self.instants())
    }
}
