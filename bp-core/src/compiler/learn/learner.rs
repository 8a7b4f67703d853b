//! Learning from a stream of cases.
//!
//! In: a model, then cases. Out: a [`Learned`] model and a [`Report`](super::Report), at any time. Invariant: the
//! result depends on the cases and their counts, not on their order: a stream and a batch give the same.

use super::case::{Case, no_value};
use super::columns::are_columns;
use super::distinct::{DistinctCases, Key, MISSING};
use super::distribution::{Distribution, Learnable, cells_of};
use super::estimate::{Step, check_unbiased, estimate, spreads};
use super::expect::{Cases, Expectation};
use super::maximise::maximise;
use super::over_time::Sequences;
use super::program::Program;
use super::report::{Figures, report};
use super::{Learned, Settings};
use crate::analysis::carried;
use crate::data::PlateData;
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::Model;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// The cases so far.
#[derive(Clone, Debug)]
pub struct Learner {
    pub(super) learnable: Learnable,
    /// Cases with their counts.
    pub(super) observed: DistinctCases,
    /// Over time: sequences of cases, each with its name.
    pub(super) sequences: Vec<(String, Vec<Key>)>,
    pub(super) cases: usize,
    /// The number of observations of each slot.
    pub(super) seen: Vec<usize>,
    /// Whether each slot is a row of a column of elements.
    pub(super) of_rows: Vec<bool>,
    /// Whether cases have weights.
    pub(super) weighted: bool,
}

impl Learner {
    /// A learner without cases.
    ///
    /// # Errors
    /// There is nothing to learn, or it cannot be learned; a size or a known parameter has no value.
    pub fn new(model: &Model) -> Result<Self, Error> {
        Self::with(model, &Inputs::new())
    }

    /// The same, with sizes and known parameters given.
    ///
    /// # Errors
    /// See [`Learner::new`].
    pub fn with(model: &Model, given: &Inputs<'_, f64>) -> Result<Self, Error> {
        let learnable = Learnable::new(model, given)?;
        let count = learnable.program.slots.len();
        Ok(Self {
            observed: DistinctCases::new(&learnable.program),
            learnable,
            sequences: Vec::new(),
            cases: 0,
            seen: vec![0; count],
            of_rows: vec![false; count],
            weighted: false,
        })
    }

    /// Observes a case. Over time it is the next instant of the last sequence, unless it contains X^-1.
    ///
    /// # Errors
    /// A number is not a value of its variable, or the variable has no such element; the case is then ignored.
    pub fn observe(&mut self, case: &Case) -> Result<(), Error> {
        let key = self.key(case)?;
        let apart = !self.is_instant(&key);
        self.take(key, 1.0, apart);
        Ok(())
    }

    /// Over time: observes the instants of another sequence.
    ///
    /// # Errors
    /// As for [`Learner::observe`]; the program has no variable of the instant before.
    pub fn observe_sequence(&mut self, cases: &[Case]) -> Result<(), Error> {
        self.is_over_time()?;
        let keys: Vec<Vec<u64>> = cases.iter().map(|case| self.key(case)).collect::<Result<_, _>>()?;
        self.begin(String::new());
        keys.into_iter().for_each(|key| {
            let apart = !self.is_instant(&key);
            self.take(key, 1.0, apart);
        });
        Ok(())
    }

    /// Refuses sequences for a program that is not over time.
    pub(super) fn is_over_time(&self) -> Result<(), Error> {
        let model = &self.learnable.program.model;
        if carried(model).is_empty() {
            let message = "sequences are learned by a program over time, but it has no variable `X^-1`";
            return Err(Error::input(&model.name, message));
        }
        Ok(())
    }

    /// Begins another sequence.
    pub(super) fn begin(&mut self, name: String) {
        self.sequences.push((name, Vec::new()));
    }

    /// Whether a case is an instant of a sequence: a case with X^-1 is a separate transition.
    pub(super) fn is_instant(&self, key: &[u64]) -> bool {
        let Program { model, slots, .. } = &self.learnable.program;
        let before = |slot: usize| model.variables[slots[slot].variable].previous_of.is_some();
        let mut all = (0..slots.len()).filter(|slot| before(*slot)).peekable();
        all.peek().is_some() && all.all(|slot| key[slot] == MISSING)
    }

    fn key(&self, case: &Case) -> Result<Vec<u64>, Error> {
        let program = &self.learnable.program;
        let mut key = vec![MISSING; program.slots.len()];
        for (variable, number) in case.numbers() {
            let name = || program.model.variable_name(variable);
            let slot = program.only_slot(variable).ok_or_else(|| {
                Error::input(
                    name(),
                    "it is a family of variables: give a table, with a column for each element",
                )
            })?;
            if program.value(slot, number).is_none() {
                let message = format!("{number} is {}", no_value(&program.model, variable));
                return Err(Error::input(name(), message));
            }
            key[slot] = number.to_bits();
        }
        Ok(key)
    }

    /// Observes the rows of tables, whose elements are one case together.
    ///
    /// # Errors
    /// There are no rows; a family that could be a column is none, and is not declared hidden.
    pub fn observe_rows(&mut self, rows: &PlateData, hidden: &[String]) -> Result<(), Error> {
        let program = &self.learnable.program;
        if rows.is_empty() {
            return Err(Error::input(&program.model.name, "there are no rows to learn from"));
        }
        are_columns(program, rows, hidden)?;
        let mut key = vec![MISSING; program.slots.len()];
        for (family, index, number) in rows.elements() {
            if let Some(slot) = program.element_slot(family, index) {
                self.of_rows[slot] = true;
                if !number.is_nan() {
                    key[slot] = (number + 0.0).to_bits();
                }
            }
        }
        let apart = !self.is_instant(&key);
        self.take(key, 1.0, apart);
        Ok(())
    }

    /// Adds a checked case: apart, or as the next instant of the last sequence.
    pub(super) fn take(&mut self, key: Vec<u64>, weight: f64, apart: bool) {
        self.cases += 1;
        count_seen(&mut self.seen, &key);
        if !apart {
            if self.sequences.is_empty() {
                self.begin(String::new());
            }
            self.sequences.last_mut().expect("internal: it has begun").1.push(key.into());
            return;
        }
        // A case of weight 0 does not count, not even that it is possible.
        if weight > 0.0 {
            self.observed.add(&key, weight);
        }
    }

    /// The model learned from the cases so far.
    ///
    /// # Errors
    /// A distribution that the cases do not determine; an impossible case; a hidden real.
    pub fn learned(&self) -> Result<Learned, Error> {
        self.learned_with(&Settings::default(), &mut |_, _| {})
    }

    /// The same, with settings for hidden variables, and a callback with each iteration and its ln L.
    ///
    /// # Errors
    /// See [`Learner::learned`].
    pub fn learned_with(
        &self,
        settings: &Settings,
        progress: &mut dyn FnMut(usize, f64),
    ) -> Result<Learned, Error> {
        let mut learnable = self.learnable.clone();
        // A file whose rows all contain X^-1 has begun a sequence, and put nothing into it.
        if self.sequences.iter().any(|(_, keys)| !keys.is_empty()) {
            return self.learned_over_time(learnable, settings, progress);
        }
        let cases = Cases::new(&mut learnable, &self.observed)?;
        let figures;
        let (statistics, outcomes);
        if cases.is_incomplete() {
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
            // EM cannot leave a start in which all values of a hidden variable are equivalent: weights are drawn, u⁴
            // for contrast.
            let start = cases.weighted(&learnable, &mut || generator.random::<f64>().powi(4) + 1e-3);
            let keep: Vec<bool> =
                learnable.distributions().iter().map(|it| is_given(&learnable, it)).collect();
            let found = maximise(&mut learnable, &cases, &start, &keep, settings, progress)?;
            check_unbiased(&learnable, &found.statistics)?;
            (statistics, outcomes) = (found.statistics, found.outcomes);
            let ln_likelihood = found.course.ln_likelihood;
            figures = Figures {
                statistics: &statistics,
                outcomes: &outcomes,
                ln_likelihood,
                course: Some(found.course),
            };
        } else {
            statistics = cases.weighted(&learnable, &mut || 0.0);
            let spreads = spreads(&learnable, &statistics);
            let keep = vec![false; statistics.len()];
            let step = Step { keep: &keep, spreads: &spreads, iterating: false };
            outcomes = estimate(&mut learnable, &statistics, &step)?;
            check_unbiased(&learnable, &statistics)?;
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
            let message = "some cases give the previous instant, others form a sequence";
            return Err(Error::input(&model.name, message));
        }
        if self.weighted {
            let message = "the instants of a sequence cannot have weights";
            return Err(Error::input(&model.name, message));
        }
        let sequences = Sequences::new(&mut learnable, &self.sequences)?;
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
        let start = sequences.weighted(&mut |_, _| generator.random::<f64>().powi(4) + 1e-3);
        let keep: Vec<bool> = learnable.distributions().iter().map(|it| is_given(&learnable, it)).collect();
        let found = maximise(&mut learnable, &sequences, &start, &keep, settings, progress)?;
        check_unbiased(&learnable, &found.statistics)?;
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

/// Counts the slots that a case observes.
pub(super) fn count_seen(seen: &mut [usize], key: &[u64]) {
    seen.iter_mut().zip(key).for_each(|(seen, bits)| *seen += usize::from(*bits != MISSING));
}

/// The error message for a number that cannot be a weight.
pub(super) const NO_WEIGHT: &str = "not a weight: write 0, or a number between 1e-100 and 1e100";

/// Whether a number can be a weight: its products with other numbers neither overflow nor underflow.
pub(super) fn is_weight(number: f64) -> bool {
    number == 0.0 || (1e-100..=1e100).contains(&number)
}

/// Whether a distribution has numbers before anything is learned: parameters with defaults.
fn is_given(learnable: &Learnable, distribution: &Distribution) -> bool {
    cells_of(&distribution.kind).into_iter().all(|cell| learnable.is_declared(cell))
}
