//! Learning from cases, one after the other.
//!
//! In: a model, then cases. Out: a [`Learned`] model and a [`Report`](super::Report), whenever they are wanted. Invariant:
//! what is learned depends on the cases and how often each came, not on their order: a stream and a batch are the same.

use super::case::{Case, no_value};
use super::distribution::{Distribution, Learnable, cells_of};
use super::estimate::{Step, estimate, spreads};
use super::expect::{Cases, Expectation, Key, MISSING};
use super::maximise::maximise;
use super::over_time::{Sequences, carried};
use super::program::Program;
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
    /// Sequences of cases, each with its name: of a program over time.
    pub(super) sequences: Vec<(String, Vec<Key>)>,
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
        Ok(Self {
            learnable,
            observed: BTreeMap::new(),
            sequences: Vec::new(),
            cases: 0,
            seen,
            weighted: false,
        })
    }

    /// A case was seen. Of a program over time it is the next instant of the last sequence, unless it says what X^-1 was.
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
    /// As for [`Learner::observe`]; a weight that is neither 0 nor between 10⁻¹⁰⁰ and 10¹⁰⁰.
    pub fn observe_weighted(&mut self, case: &Case, weight: f64) -> Result<(), Error> {
        if !is_weight(weight) {
            return Err(Error::input("weight", format!("`{weight}` is {NO_WEIGHT}")));
        }
        let key = self.key(case)?;
        self.weighted = true;
        self.take(key, weight);
        Ok(())
    }

    /// The instants of another sequence were seen, by a program over time.
    ///
    /// # Errors
    /// As for [`Learner::observe`]; the program has no variable of the instant before.
    pub fn observe_sequence(&mut self, cases: &[Case]) -> Result<(), Error> {
        self.is_over_time()?;
        let keys: Vec<Vec<u64>> = cases.iter().map(|case| self.key(case)).collect::<Result<_, _>>()?;
        self.begin(String::new());
        keys.into_iter().for_each(|key| self.take(key, 1.0));
        Ok(())
    }

    /// Refuses sequences of a program whose cases do not follow each other.
    pub(super) fn is_over_time(&self) -> Result<(), Error> {
        let model = &self.learnable.program.model;
        if carried(model).is_empty() {
            let message = "sequences are learned by a program over time, but it has no variable `X^-1`";
            return Err(Error::input(&model.name, message));
        }
        Ok(())
    }

    /// The next cases are those of another sequence.
    pub(super) fn begin(&mut self, name: String) {
        self.sequences.push((name, Vec::new()));
    }

    /// Whether a case is an instant of a sequence: one that says what X^-1 was stands alone.
    fn is_instant(&self, key: &[u64]) -> bool {
        let Program { model, slots, .. } = &self.learnable.program;
        let before = |slot: usize| model.variables[slots[slot].variable].previous_of.is_some();
        let mut all = (0..slots.len()).filter(|slot| before(*slot)).peekable();
        all.peek().is_some() && all.all(|slot| key[slot] == MISSING)
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
        if self.is_instant(&key) {
            if self.sequences.is_empty() {
                self.begin(String::new());
            }
            self.sequences.last_mut().expect("internal: it has begun").1.push(key.into());
            return;
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
        // A file whose rows all say what X^-1 was has begun a sequence, and put nothing into it.
        if self.sequences.iter().any(|(_, keys)| !keys.is_empty()) {
            return self.learned_over_time(learnable, settings, progress);
        }
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

    /// Baum–Welch.
    fn learned_over_time(
        &self,
        mut learnable: Learnable,
        settings: &Settings,
        progress: &mut dyn FnMut(usize, f64),
    ) -> Result<Learned, Error> {
        let model = &learnable.program.model;
        if !self.observed.is_empty() {
            let message = "some cases say what the instant before was, others follow each other";
            return Err(Error::input(&model.name, message));
        }
        if self.weighted {
            let message = "the instants of a sequence have no weights";
            return Err(Error::input(&model.name, message));
        }
        let sequences = Sequences::new(&mut learnable, &self.sequences)?;
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
        let start = sequences.weighted(&mut |_, _| generator.random::<f64>().powi(4) + 1e-3);
        let keep: Vec<bool> = learnable.distributions().iter().map(|it| is_given(&learnable, it)).collect();
        let found = maximise(&mut learnable, &sequences, &start, &keep, settings, progress)?;
        let figures = Figures {
            statistics: &found.statistics,
            outcomes: &found.outcomes,
            ln_likelihood: found.course.ln_likelihood,
            course: Some(found.course),
        };
        let report = report(self, &learnable, figures);
        Ok(Learned { learnable, report })
    }
}

/// The error message for a number that cannot be a weight.
pub(super) const NO_WEIGHT: &str = "not a weight: write 0, or a number between 1e-100 and 1e100";

/// Whether a number can be a weight: sums of them times other numbers neither overflow nor vanish.
pub(super) fn is_weight(number: f64) -> bool {
    number == 0.0 || (1e-100..=1e100).contains(&number)
}

/// Whether a distribution has numbers before anything is learned: parameters with defaults.
fn is_given(learnable: &Learnable, distribution: &Distribution) -> bool {
    cells_of(&distribution.kind).into_iter().all(|cell| learnable.is_declared(cell))
}
