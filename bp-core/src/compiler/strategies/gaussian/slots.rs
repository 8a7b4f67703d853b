//! A normal distribution of slots: of the reals that a particle or a component of a mixture does not fix.
//!
//! In: a linear mean and a deviation, or an observation. Out: the distribution, by slots. Invariant: a slot is one row.

use super::NormalLaw;

/// A normal law.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlotLaw {
    slots: Vec<usize>,
    law: NormalLaw,
}

impl SlotLaw {
    /// A law without slots; `dirac`: whether slots without noise of their own will be observed.
    pub(crate) fn new(dirac: bool) -> Self {
        Self { slots: Vec::new(), law: NormalLaw::new(dirac) }
    }

    /// Adds a slot; terms of slots that the law does not have are ignored.
    pub(crate) fn extend(&mut self, slot: usize, terms: &[(usize, f64)], constant: f64, deviation: f64) {
        let terms = terms.iter().filter_map(|(parent, weight)| Some((self.row(*parent)?, *weight)));
        let terms: Vec<(usize, f64)> = terms.collect();
        self.law.extend(&terms, constant, deviation);
        self.slots.push(slot);
    }

    /// Conditions on the value of a slot; returns ln of its density before, −∞ where the value is impossible.
    pub(crate) fn observe(&mut self, slot: usize, value: f64) -> f64 {
        self.observed(slot, value).unwrap_or(f64::NEG_INFINITY)
    }

    /// The same, `None` where the value is impossible: −∞ where the logarithm leaves the range of f64.
    pub(crate) fn observed(&mut self, slot: usize, value: f64) -> Option<f64> {
        let row = self.row(slot).expect("internal: the law has the slot that was added");
        self.law.observe(row, value)
    }

    /// Whether the law has a slot.
    pub(crate) fn has(&self, slot: usize) -> bool {
        self.row(slot).is_some()
    }

    /// The mean of a slot, if the law has it.
    pub(crate) fn mean(&self, slot: usize) -> Option<f64> {
        Some(self.law.mean(self.row(slot)?))
    }

    /// The same law with the mean of a slot elsewhere.
    pub(crate) fn with_mean(&self, slot: usize, mean: f64) -> Self {
        let mut moved = self.clone();
        if let Some(row) = moved.row(slot) {
            moved.law.set_mean(row, mean);
        }
        moved
    }

    /// How many independent noises are left.
    pub(crate) fn noises(&self) -> usize {
        self.law.noises()
    }

    /// The distribution of some slots, in this order.
    pub(crate) fn select(&self, slots: &[usize]) -> NormalLaw {
        let row = |slot: &usize| self.row(*slot).expect("internal: an asked slot is among the factors");
        self.law.select(slots.iter().map(row))
    }

    /// Mean and standard deviation of a linear form of slots.
    pub(crate) fn of_form(&self, terms: &[(usize, f64)], constant: f64) -> [f64; 2] {
        let mut with = self.clone();
        with.extend(usize::MAX, terms, constant, 0.0);
        with.of(usize::MAX).expect("internal: it was added")
    }

    /// The law of the slots with a new name, under that name; the others are summed out.
    pub(crate) fn renamed(&self, slots: impl Iterator<Item = (usize, usize)>) -> Self {
        let (rows, slots): (Vec<usize>, Vec<usize>) =
            slots.filter_map(|(from, to)| Some((self.row(from)?, to))).unzip();
        Self { law: self.law.select(rows).reduced(), slots }
    }

    /// Mean and standard deviation of a slot.
    pub(crate) fn of(&self, slot: usize) -> Option<[f64; 2]> {
        let row = self.row(slot)?;
        Some([self.law.mean(row), self.law.deviation(row)])
    }

    fn row(&self, slot: usize) -> Option<usize> {
        self.slots.iter().rposition(|own| *own == slot)
    }
}
