//! The normal law that a particle carries over the slots that are not drawn.
//!
//! In: a linear form and a deviation, or an observation. Out: the law, by slots. Invariant: a slot is one row of the
//! law.

use crate::strategies::gaussian::NormalLaw;

/// A normal law.
#[derive(Clone, Debug, Default)]
pub(crate) struct Normal {
    slots: Vec<usize>,
    law: NormalLaw,
}

impl Normal {
    /// A law without slots; `dirac`: whether slots without noise of their own will be observed.
    pub(super) fn new(dirac: bool) -> Self {
        Self { slots: Vec::new(), law: NormalLaw::new(dirac) }
    }

    /// Adds a slot; terms of slots that the law does not have are ignored.
    pub(super) fn extend(&mut self, slot: usize, terms: &[(usize, f64)], constant: f64, deviation: f64) {
        let terms = terms.iter().filter_map(|(parent, weight)| Some((self.row(*parent)?, *weight)));
        let terms: Vec<(usize, f64)> = terms.collect();
        self.law.extend(&terms, constant, deviation);
        self.slots.push(slot);
    }

    /// Conditions on the value of a slot; returns ln of its density before, −∞ where the value is impossible.
    pub(super) fn observe(&mut self, slot: usize, value: f64) -> f64 {
        let row = self.row(slot).expect("internal: the law has the slot that was added");
        self.law.observe(row, value).unwrap_or(f64::NEG_INFINITY)
    }

    /// The law of the slots with a new name, under that name; the others are summed out.
    pub(super) fn renamed(&self, slots: impl Iterator<Item = (usize, usize)>) -> Self {
        let (rows, slots): (Vec<usize>, Vec<usize>) =
            slots.filter_map(|(from, to)| Some((self.row(from)?, to))).unzip();
        Self { law: self.law.select(rows).reduced(), slots }
    }

    /// Mean and standard deviation of a slot.
    pub(super) fn of(&self, slot: usize) -> Option<[f64; 2]> {
        let row = self.row(slot)?;
        Some([self.law.mean(row), self.law.deviation(row)])
    }

    fn row(&self, slot: usize) -> Option<usize> {
        self.slots.iter().rposition(|own| *own == slot)
    }
}
