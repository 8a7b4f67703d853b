//! Learning from cases, one after the other.
//!
//! In: a model, then cases. Out: a [`Learned`] model and a [`Report`](super::Report), whenever they are wanted. Invariant:
//! what is learned depends on the cases and how often each came, not on their order: a stream and a batch are the same.

use super::case::{Case, no_value};
use super::distribution::{Distribution, Learnable, cells_of};
use super::estimate::{Step, estimate, spreads};
use super::expect::{Cases, Expectation, Key, MISSING};
use super::maximise::maximise;
use super::report::{Figures, report};
use super::{Learned, Settings};
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::Model;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeMap;

/// What has been seen so far.
#[derive(Clone, Debug)]
pub struct Learner {
    pub(super) learnable: Learnable,
    /// Cases, and how often each came.
    pub(super) observed: BTreeMap<Key, f64>,
    pub(super) cases: usize,
    /// How often each slot was seen.
    pub(super) seen: Vec<usize>,
    /// Whether cases came with weights.
    pub(super) weighted: bool,
}

impl Learner {
    /// Nothing has been seen yet.
    ///
    /// # Errors
    /// Nothing is to be learned, or something cannot be; a size or a parameter that is not learned has no value.
    pub fn new(model: &Model) -> Result<Self, Error> {
        Self::with(model, &Inputs::new())
    }

    /// The same, for a program whose sizes, or parameters that are not learned, are given beside it.
    ///
    /// # Errors
    /// See [`Learner::new`].
    pub fn with(model: &Model, given: &Inputs<'_, f64>) -> Result<Self, Error> {
        let learnable = Learnable::new(model, given)?;
        let seen = vec![0; learnable.program.slots.len()];
        Ok(Self { learnable, observed: BTreeMap::new(), cases: 0, seen, weighted: false })
    }

    /// A case was seen.
    ///
    /// # Errors
    /// A number is no value of its variable, or the variable has no such element; nothing is learned of the case then.
    pub fn observe(&mut self, case: &Case) -> Result<(), Error> {
        let key = self.key(case)?;
        self.take(key, 1.0);
        Ok(())
    }

    /// A case was seen as often as its weight says.
    ///
    /// # Errors
    /// As for [`Learner::observe`]; a weight that is negative or not finite.
    pub fn observe_weighted(&mut self, case: &Case, weight: f64) -> Result<(), Error> {
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(Error::input("weight", format!("{weight} is not a finite number of at least 0")));
        }
        let key = self.key(case)?;
        self.weighted = true;
        self.take(key, weight);
        Ok(())
    }

    fn key(&self, case: &Case) -> Result<Vec<u64>, Error> {
        let program = &self.learnable.program;
        let mut key = vec![MISSING; program.slots.len()];
        for (variable, index, number) in case.numbers() {
            let name = || match index {
                Some(index) => format!("{}[{index}]", program.model.variable_name(variable)),
                None => program.model.variable_name(variable),
            };
            let slot = program.element(variable, index).ok_or_else(|| {
                let message = match index {
                    Some(_) => "the program has no such element",
                    None => "it is a family of variables: each element has its own number",
                };
                Error::input(name(), message)
            })?;
            if program.value(slot, number).is_none() {
                let message = format!("{number} is {}", no_value(&program.model, variable));
                return Err(Error::input(name(), message));
            }
            key[slot] = number.to_bits();
        }
        Ok(key)
    }

    /// Takes a checked case in.
    pub(super) fn take(&mut self, key: Vec<u64>, weight: f64) {
        self.cases += 1;
        for (seen, bits) in self.seen.iter_mut().zip(&key) {
            *seen += usize::from(*bits != MISSING);
        }
        // A case of weight 0 says nothing, not even that it can be.
        if weight > 0.0 {
            *self.observed.entry(key.into()).or_default() += weight;
        }
    }

    /// The model with what has been learned so far.
    ///
    /// # Errors
    /// A law that the cases do not tell; a case that the program excludes; a real that is hidden.
    pub fn learned(&self) -> Result<Learned, Error> {
        self.learned_with(&Settings::default(), &mut |_, _| {})
    }

    /// The same, with settings for hidden variables, and a function that is told each iteration and the ln L there.
    ///
    /// # Errors
    /// See [`Learner::learned`].
    pub fn learned_with(
        &self,
        settings: &Settings,
        progress: &mut dyn FnMut(usize, f64),
    ) -> Result<Learned, Error> {
        let mut learnable = self.learnable.clone();
        let cases = Cases::new(&mut learnable, &self.observed)?;
        let figures;
        let (statistics, outcomes);
        if cases.is_incomplete() {
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
            // A start in which all values of a hidden variable are alike would stay so: weights are drawn, u⁴ for contrast.
            let start = cases.weighted(&mut |_, _, _| generator.random::<f64>().powi(4) + 1e-3);
            let keep: Vec<bool> =
                learnable.distributions().iter().map(|it| is_given(&learnable, it)).collect();
            let found = maximise(&mut learnable, &cases, &start, &keep, settings, progress)?;
            (statistics, outcomes) = (found.statistics, found.outcomes);
            let ln_likelihood = found.course.ln_likelihood;
            figures = Figures {
                statistics: &statistics,
                outcomes: &outcomes,
                ln_likelihood,
                course: Some(found.course),
            };
        } else {
            statistics = cases.weighted(&mut |_, _, _| 0.0);
            let spreads = spreads(&learnable, &statistics);
            let keep = vec![false; statistics.len()];
            let step = Step { keep: &keep, spreads: &spreads, iterating: false };
            outcomes = estimate(&mut learnable, &statistics, &step)?;
            let ln_likelihood = cases.expect(&learnable)?.ln_likelihood;
            figures = Figures { statistics: &statistics, outcomes: &outcomes, ln_likelihood, course: None };
        }
        let report = report(self, &learnable, figures);
        Ok(Learned { learnable, report })
    }
}

/// Whether a distribution has numbers before anything is learned: parameters with defaults.
fn is_given(learnable: &Learnable, distribution: &Distribution) -> bool {
    cells_of(&distribution.kind).into_iter().all(|cell| learnable.is_declared(cell))
}
