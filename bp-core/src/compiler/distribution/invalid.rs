//! The number of a program that made an answer NaN.
//!
//! In: a setting, and the known values of some variables. Out: the first number that a form refuses, with its form and
//! its context. Invariant: contexts that agree with the known values come first; a form whose context is not finite (it
//! reads an unknown real, or a field of another program) is skipped.
//!
//! Kernels mark an invalid number as NaN, which every sum and product propagates; this search finds its origin.

use super::setting::{Instance, Setting};
use crate::error::Error;
use crate::ids::FactorId;

/// Upper limit on the contexts that are tried.
const MOST_CONTEXTS: usize = 1_000_000;

impl Setting<'_> {
    /// The first [`Error::Number`] of the program; `known` has a value for each slot, NaN where it is unknown.
    pub fn refused_number(&self, known: &[f64]) -> Option<Error> {
        let (all, nothing): (Vec<FactorId>, _) =
            (self.model.factors.ids().collect(), vec![f64::NAN; self.slots()]);
        [known, &nothing].into_iter().find_map(|known| self.refused_number_in(&all, known))
    }

    /// The first [`Error::Number`] of some factors in the contexts that agree with the known values.
    pub fn refused_number_in(&self, factors: &[FactorId], known: &[f64]) -> Option<Error> {
        let mut tried = 0;
        factors.iter().find_map(|factor| {
            let instances = self.instances(*factor).unwrap_or_default();
            instances.iter().find_map(|instance| self.refused_in(instance, known, &mut tried))
        })
    }

    /// As [`Setting::refused_number`]; where no form refuses a number, an error that names the question alone.
    pub fn not_a_number(&self, question: &str, known: &[f64]) -> Error {
        self.refused_number(known).unwrap_or_else(|| {
            let message =
                "the answer is beyond the range of numbers: a density or a weight overflows".to_owned();
            Error::Number { form: question.to_owned(), context: String::new(), message }
        })
    }

    fn refused_in(&self, instance: &Instance, known: &[f64], tried: &mut usize) -> Option<Error> {
        if self.reads_elsewhere(instance) {
            return None;
        }
        let mut values: Vec<f64> = known.to_vec();
        let mut open = Vec::new();
        for slot in self.reads(instance).into_iter().filter(|slot| !instance.left.contains(slot)) {
            if !values[slot].is_nan() {
                continue;
            }
            match self.count(self.variable_of(slot)) {
                0 => return None,
                count => open.push((slot, count)),
            }
        }
        open.iter().for_each(|(slot, _)| values[*slot] = 0.0);
        loop {
            *tried += 1;
            if *tried > MOST_CONTEXTS {
                return None;
            }
            if let Err(error @ Error::Number { .. }) = self.distribution(instance, &values) {
                return Some(error);
            }
            // Counts through the open slots, the last one fastest.
            let (slot, _) = open.iter().rev().find(|(slot, count)| values[*slot] + 1.0 < *count as f64)?;
            values[*slot] += 1.0;
            open.iter()
                .rev()
                .take_while(|(other, _)| other != slot)
                .for_each(|(other, _)| values[*other] = 0.0);
        }
    }
}
