//! The chain scan, as three recurrences (see `equation/scan.rs`).
//!
//! In: a family that matters only through its first true element. Out: the sum over its 2ᴺ states in O(N). Invariant:
//! there is no division, so a prior of 1 is allowed.

use super::{Lowering, Meaning};
use crate::equation::FirstScan;
use crate::error::Error;
use crate::ids::{AxisId, ValueId};
use crate::kernel::{Index, Reduce};
use crate::model::IndexSpace;
use crate::operators::Binary;

impl Lowering<'_> {
    pub(super) fn first_scan(&mut self, scan: &FirstScan) -> Result<ValueId, Error> {
        let Some(IndexSpace::Range(range)) =
            self.model.variables[scan.family].family.map(|family| family.over)
        else {
            return Err(self.unplanned("`first` needs a family along a range"));
        };
        let name = self.name("k");
        let extent = self.bounded(range.high, 1 - range.low);
        let axis = self.builder.axis(&name, extent);
        let running = self.builder.running(axis);
        let low = self.builder.constant(range.low as f64);
        let index = self.builder.binary(Binary::Add, running, low);

        // P_k: the factor where the first true element is k, and P_∅: where all are false.
        let factor = self.model.factors[scan.factor].clone();
        let at_first = self.factor_at(&factor, index)?;
        let count = self.count_of(extent);
        let past = self.builder.binary(Binary::Add, count, low);
        let at_none = self.factor_at(&factor, past)?;

        // p_k = P(G[k] = true | …)
        let prior = self.model.factors[scan.prior].clone();
        let one = self.builder.constant(1.0);
        let outer = std::mem::replace(&mut self.products, vec![index]);
        let probability = self.density(&prior, &prior.form, scan.family, &Meaning::Ordinal(one));
        self.products = outer;
        let probability = probability?;

        let zero = self.builder.constant(0.0);
        let at_first = self.along("P_k", axis, Reduce::None, at_first);
        let clear = self.builder.binary(Binary::Subtract, one, probability);
        let forward = |keep, initial| Reduce::Scan { axis, backward: false, keep, initial };
        let seen = self.along("s", axis, forward(clear, one), zero);
        let hit = self.builder.binary(Binary::Multiply, probability, at_first);
        let stopped = self.builder.binary(Binary::Multiply, seen, hit);
        let nearer = self.along("A", axis, forward(one, zero), stopped);
        let backward = Reduce::Scan { axis, backward: true, keep: clear, initial: at_none };

        let Some((value, at)) = scan.with else {
            // Σ_k s_k p_k P_k + s_{N+1} P_∅ = p_1 P_1 + (1 − p_1) R_1
            let rest = self.along("R", axis, backward, hit);
            let first = self.builder.constant(0.0);
            let (rest, hit, clear) = (self.at_element(rest, axis, first), hit, clear);
            let start = self.along("first element", axis, Reduce::None, hit);
            let start = self.at_element(start, axis, first);
            let clear = self.along("clear", axis, Reduce::None, clear);
            let clear = self.at_element(clear, axis, first);
            let rest = self.builder.binary(Binary::Multiply, clear, rest);
            return Ok(self.builder.binary(Binary::Add, start, rest));
        };
        let beyond = self.along("R", axis, backward, hit);
        let (value, at) = (self.expression(value)?, self.expression(at)?);
        let place = self.builder.binary(Binary::Subtract, at, low);
        let [nearer, seen, here, beyond] =
            [nearer, seen, at_first, beyond].map(|scanned| self.at_element(scanned, axis, place));
        let chosen = self.builder.select(value, here, beyond);
        let reached = self.builder.binary(Binary::Multiply, seen, chosen);
        Ok(self.builder.binary(Binary::Add, nearer, reached))
    }

    /// The scanned factor's density where its `first(…)` has this value.
    fn factor_at(&mut self, factor: &crate::model::Factor, first: ValueId) -> Result<ValueId, Error> {
        let outer = self.first.replace(first);
        let value = self.density_of(factor, &factor.form);
        self.first = outer;
        value
    }

    /// A nest along the scanned axis, and all others that its parts depend on.
    pub(super) fn along(&mut self, what: &str, axis: AxisId, reduce: Reduce, value: ValueId) -> ValueId {
        let mut parts = vec![value];
        if let Reduce::Scan { keep, initial, .. } = &reduce {
            parts.extend([*keep, *initial]);
        }
        // The sum depends on every axis that some part depends on.
        let mut all = value;
        for part in parts {
            all = self.builder.binary(Binary::Add, all, part);
        }
        let mut axes = self.axes_but(all, &[axis]);
        axes.insert(0, axis);
        let name = self.name(what);
        self.builder.compute(&name, &axes, reduce, value)
    }

    /// A scanned value read at another element of its axis.
    fn at_element(&mut self, scanned: ValueId, axis: AxisId, place: ValueId) -> ValueId {
        let crate::kernel::Node::Load { buffer, indices, .. } = self.builder.so_far().nodes[scanned].clone()
        else {
            return scanned;
        };
        let place = self.builder.at(place);
        let indices = indices
            .into_iter()
            .map(|index| if index == Index::Axis(axis) { place.clone() } else { index })
            .collect();
        self.builder.load(buffer, indices)
    }
}
