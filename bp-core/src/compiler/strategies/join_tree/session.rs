//! Questions to a tree: in f64, and with separate exponents where f64 may underflow.
//!
//! In: a [`Tree`] and evidence. Out: every wanted marginal, or the most probable values, and ln P(evidence). Invariant:
//! a contradiction comes from the program, never from the range of numbers; the result does not depend on the number of
//! threads.

use super::cell::Cell;
use super::compile::{Cells, Tree, ln_ceiling};
use super::evidence::{Known, NetworkEvidence, contradiction};
use super::propagate::{Below, Pass};
use crate::error::Error;
use crate::exec::beyond_range;
use crate::exec::scalar::{Extended, Scalar};
use std::sync::atomic::{AtomicBool, Ordering};

/// The working memory of a session, kept from question to question.
#[derive(Clone, Debug)]
pub struct Session<'t> {
    pub(super) tree: &'t Tree,
    pub(super) known: Known,
    memory: Memory<f64>,
    /// Made on first use.
    extended: Option<Memory<Extended>>,
    pub(super) ln_evidence: f64,
}

/// The arrays of a tree.
#[derive(Clone, Debug)]
struct Memory<T> {
    cells: Vec<T>,
    derivatives: Vec<T>,
    marginals: Vec<T>,
}

impl<T: Cell> Memory<T> {
    fn of(tree: &Tree) -> Self {
        let end = tree.offsets.last().copied().unwrap_or_default();
        Self {
            cells: vec![T::ZERO; end.value],
            derivatives: vec![T::ZERO; end.derivative],
            marginals: vec![T::ZERO; end.marginals],
        }
    }
}

/// The operation of a question.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Doing {
    /// Sums up, derivatives down.
    Marginals,
    /// Largest values up.
    Largest,
}

/// A total power of two above this means that no significant cell was lost: a lost cell is below 2⁻⁷²² of the largest
/// of its table.
const FALLEN: i64 = -100;

impl Tree {
    /// Working memory for questions.
    pub fn session(&self) -> Session<'_> {
        Session {
            tree: self,
            known: Known::nothing(self),
            memory: Memory::of(self),
            extended: None,
            ln_evidence: 0.0,
        }
    }
}

#[cfg(test)]
thread_local! {
    static PROPAGATIONS: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// The number of propagations in this thread.
#[cfg(test)]
pub(crate) fn propagations() -> usize {
    PROPAGATIONS.get()
}

impl Session<'_> {
    /// Computes every wanted marginal given the evidence.
    ///
    /// # Errors
    /// A value outside its domain, a given variable without a value, evidence of probability zero.
    pub fn ask(&mut self, evidence: &NetworkEvidence) -> Result<(), Error> {
        #[cfg(test)]
        PROPAGATIONS.set(PROPAGATIONS.get() + 1);
        let (tree, known) = (self.tree, &mut self.known);
        match answer(tree, known, &mut self.memory, evidence, Doing::Marginals) {
            Ok(Some(ln_evidence)) => self.ln_evidence = ln_evidence,
            Ok(None) | Err(Error::Contradiction { .. }) => {
                let memory = self.extended.get_or_insert_with(|| Memory::of(tree));
                let found = answer(tree, known, memory, evidence, Doing::Marginals)?;
                self.ln_evidence = found.expect("internal: separate exponents do not underflow");
                let marginals = self.memory.marginals.iter_mut().zip(&memory.marginals);
                marginals.for_each(|(p, extended)| *p = extended.to_f64());
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// The most probable values of all variables, for a tree of maxima.
    pub(super) fn most_probable(&mut self, evidence: &NetworkEvidence) -> Result<Vec<usize>, Error> {
        let (tree, known) = (self.tree, &mut self.known);
        match answer(tree, known, &mut self.memory, evidence, Doing::Largest) {
            Ok(Some(ln_evidence)) => {
                self.ln_evidence = ln_evidence;
                Ok(self.assignment(&self.memory.cells))
            }
            Ok(None) | Err(Error::Contradiction { .. }) => {
                let mut memory = Memory::<Extended>::of(tree);
                let found = answer(tree, known, &mut memory, evidence, Doing::Largest)?;
                self.ln_evidence = found.expect("internal: separate exponents do not underflow");
                Ok(self.assignment(&memory.cells))
            }
            Err(error) => Err(error),
        }
    }

    /// ln P(evidence) of the last question.
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    /// The marginal of a variable that this tree answers; empty for any other.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        &self.memory.marginals[self.tree.places[variable].clone()]
    }
}

/// Answers a question; returns ln P(evidence), or `None` where cells of this type may have underflowed.
fn answer<T: Cell>(
    tree: &Tree,
    known: &mut Known,
    memory: &mut Memory<T>,
    evidence: &NetworkEvidence,
    doing: Doing,
) -> Result<Option<f64>, Error> {
    known.read(tree, evidence, &mut memory.cells)?;
    let known = &*known;
    if known.lost {
        return Ok(None);
    }
    let (pass, Memory { cells, derivatives, marginals }) = (Pass { tree, known, watch: None }, memory);
    let mut exponent = known.exponent + tree.tables.exponent;
    let mut total = known.certain;
    let lost = AtomicBool::new(false);
    if let Some(root) = tree.parts.len().checked_sub(1) {
        let taken = match doing {
            Doing::Largest => pass.up::<T, true>(0, root, cells),
            Doing::Marginals => pass.up::<T, false>(0, root, cells),
        };
        let taken = taken.map_err(|node| contradiction(pass.observed::<T>(node)))?;
        exponent += taken.exponent;
        for part in tree.parts.iter().filter(|part| part.children.is_none()) {
            if let Cells::Table { exponents, slice, .. } = part.source {
                exponent += tree.tables.exponents[exponents + known.slices[slice]];
            }
        }
        total = total * tree.value(known, cells, 0, root)[0].extended();
        if total.is_beyond() {
            return Err(beyond_range());
        }
        if total == Extended::ZERO {
            return Err(contradiction(pass.observed::<T>(root)));
        }
        let watch = (taken.fallen < FALLEN && T::MAY_LOSE).then_some(&lost);
        if let Some(lost) = watch {
            lost.store(pass.has_lost(cells), Ordering::Relaxed);
        }
        if doing == Doing::Marginals && !lost.load(Ordering::Relaxed) {
            Pass { watch, ..pass }.down(cells, 0, root, Below { derivatives, marginals }, &[]);
        }
    }
    let ln_evidence = total.times_power_of_two(exponent).natural_logarithm().to_f64();
    let may_count = T::MAY_LOSE && tree.ln_least.is_finite() && {
        let weights = evidence.likelihoods.iter().map(|(_, weights)| ln_ceiling(weights));
        ln_evidence < tree.ln_least + weights.sum::<f64>()
    };
    Ok((!may_count && !lost.into_inner()).then_some(ln_evidence))
}
