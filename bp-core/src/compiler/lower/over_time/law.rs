//! A normal law whose moments are values of a kernel.
//!
//! In: slots, one after the other, each with its mean and its slopes in earlier slots; observations. Out: means and
//! covariances. Invariant: a covariance that the program makes 0 has no value, so that it costs nothing.
//!
//! With y = f(x) + e, slopes F at the means: cov(y, ·) = F cov(x, ·), var(y) = F cov(x, y) + var(e).
//! Given one number y = z: m ← m + c (z − m_y) / s, Σ ← Σ − c cᵀ / s, c = cov(·, y), s = var(y) (Kalman 1960); ln of its
//! density is −½ (ln 2πs + (z − m_y)² / s). Observations are taken one after the other, so no matrix is inverted.

use crate::ids::ValueId;
use crate::kernel::KernelBuilder;
use crate::operators::{Binary, Unary};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// The law of some slots.
#[derive(Default)]
pub(super) struct SymbolicLaw {
    pub(super) means: BTreeMap<usize, ValueId>,
    /// By pairs of slots, the smaller one first.
    covariances: BTreeMap<(usize, usize), ValueId>,
}

/// An observation of a slot.
pub(super) struct Observation {
    pub(super) slot: usize,
    pub(super) value: ValueId,
    /// Whether it is given; `None`: always.
    pub(super) given: Option<ValueId>,
}

impl SymbolicLaw {
    pub(super) fn covariance(&self, one: usize, other: usize) -> Option<ValueId> {
        self.covariances.get(&(one.min(other), one.max(other))).copied()
    }

    pub(super) fn set(&mut self, one: usize, other: usize, value: ValueId) {
        self.covariances.insert((one.min(other), one.max(other)), value);
    }

    fn slots(&self) -> Vec<usize> {
        self.means.keys().copied().collect()
    }

    /// Adds to a covariance.
    pub(super) fn add(&mut self, by: &mut KernelBuilder, one: usize, other: usize, more: ValueId) {
        let sum = match self.covariance(one, other) {
            Some(own) => by.binary(Binary::Add, own, more),
            None => more,
        };
        self.set(one, other, sum);
    }

    /// Adds a slot without noise of its own.
    pub(super) fn extend(
        &mut self,
        by: &mut KernelBuilder,
        slot: usize,
        mean: ValueId,
        slopes: &BTreeMap<usize, ValueId>,
    ) {
        let combined = |law: &Self, by: &mut KernelBuilder, with: usize| {
            let terms: Vec<ValueId> = (slopes.iter())
                .filter_map(|(parent, slope)| {
                    Some(by.binary(Binary::Multiply, *slope, law.covariance(*parent, with)?))
                })
                .collect();
            terms.into_iter().reduce(|sum, term| by.binary(Binary::Add, sum, term))
        };
        for other in self.slots() {
            if let Some(value) = combined(self, by, other) {
                self.set(slot, other, value);
            }
        }
        self.means.insert(slot, mean);
        if let Some(variance) = combined(self, by, slot) {
            self.set(slot, slot, variance);
        }
    }

    /// Conditions on an observation; returns ln of its density, 0 where it is absent. `None`: the slot has no variance.
    pub(super) fn observe(&mut self, by: &mut KernelBuilder, seen: &Observation) -> Option<ValueId> {
        let Observation { slot, value, given } = *seen;
        let variance = self.covariance(slot, slot)?;
        let mean = self.means[&slot];
        let [zero, one, minus_half, tau] = [0.0, 1.0, -0.5, TAU].map(|number| by.constant(number));
        let if_given = |by: &mut KernelBuilder, then: ValueId, otherwise: ValueId| match given {
            Some(given) => by.select(given, then, otherwise),
            None => then,
        };
        let precision = by.binary(Binary::Divide, one, variance);
        let precision = if_given(by, precision, zero);
        let rest = by.binary(Binary::Subtract, value, mean);
        let rest = if_given(by, rest, zero);
        let scaled = by.binary(Binary::Multiply, rest, precision);
        let others: Vec<(usize, ValueId)> = (self.slots().into_iter())
            .filter(|other| *other != slot)
            .filter_map(|other| Some((other, self.covariance(slot, other)?)))
            .collect();
        for (place, (one, with)) in others.iter().enumerate() {
            let shift = by.binary(Binary::Multiply, *with, scaled);
            let moved = by.binary(Binary::Add, self.means[one], shift);
            self.means.insert(*one, moved);
            let gain = by.binary(Binary::Multiply, *with, precision);
            for (other, with) in &others[place..] {
                let less = by.binary(Binary::Multiply, gain, *with);
                let own = match self.covariance(*one, *other) {
                    Some(own) => by.binary(Binary::Subtract, own, less),
                    None => by.unary(Unary::Negate, less),
                };
                self.set(*one, *other, own);
            }
        }
        // The slot itself is known, where it is given.
        let known = if_given(by, value, mean);
        self.means.insert(slot, known);
        for (other, with) in others.into_iter().chain([(slot, variance)]) {
            match given {
                Some(given) => {
                    let kept = by.select(given, zero, with);
                    self.set(slot, other, kept);
                }
                None => drop(self.covariances.remove(&(slot.min(other), slot.max(other)))),
            }
        }
        let ln = by.binary(Binary::Multiply, tau, variance);
        let ln = by.unary(Unary::NaturalLogarithm, ln);
        let distance = by.binary(Binary::Multiply, rest, scaled);
        let sum = by.binary(Binary::Add, ln, distance);
        let ln = by.binary(Binary::Multiply, minus_half, sum);
        Some(if_given(by, ln, zero))
    }

    /// Keeps some slots only.
    pub(super) fn keep(&mut self, slots: &BTreeSet<usize>) {
        self.means.retain(|slot, _| slots.contains(slot));
        self.covariances.retain(|(one, other), _| slots.contains(one) && slots.contains(other));
    }
}
