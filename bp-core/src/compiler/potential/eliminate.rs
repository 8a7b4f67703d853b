//! Products of potentials, of which slots are eliminated one by one.
//!
//! In: potentials. Out: their product without some of the slots, as a list whose members are multiplied no further than
//! sums and maxima require. Invariant: the order is found by `elimination`; orders are cached, so that the instants of
//! a long sequence share one search.

use super::Potential;
use super::sweep::{Fold, folded};
use crate::elimination;
use crate::radix;
use std::collections::HashMap;
use std::sync::Arc;

/// Limit of the cells of one table.
pub(crate) const MOST_CELLS: f64 = 1e7;

/// A product of potentials and a number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Product {
    pub(crate) parts: Vec<Arc<Potential>>,
    /// ln of the number; −∞ where nothing is possible.
    pub(crate) ln_constant: f64,
}

/// The value of a maximised slot for each combination of values of others.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    slot: usize,
    over: Vec<usize>,
    choice: Vec<u32>,
}

/// The scopes of a product and its eliminated slots, which determine the order.
type Kind = (Vec<Vec<usize>>, Vec<usize>);

/// Elimination orders by the scopes of the potentials and the eliminated slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Orders {
    known: HashMap<Kind, Vec<usize>>,
}

impl Orders {
    /// The eliminated slots, in order; `Err` is the number of cells of a table that would be too large.
    fn order(
        &mut self,
        parts: &[Arc<Potential>],
        away: &[usize],
        counts: &[usize],
    ) -> Result<Vec<usize>, f64> {
        let kind: Kind = (parts.iter().map(|part| part.over.clone()).collect(), away.to_vec());
        if let Some(order) = self.known.get(&kind) {
            return Ok(order.clone());
        }
        let mut slots: Vec<usize> = kind.0.iter().flatten().chain(away).copied().collect();
        slots.sort_unstable();
        slots.dedup();
        let number = |slot: &usize| slots.binary_search(slot).map_or(u32::MAX, |at| at as u32);
        let numbered = |scope: &[usize]| scope.iter().map(number).collect::<Vec<u32>>();
        let scopes: Vec<Vec<u32>> = kind.0.iter().map(|scope| numbered(scope)).collect();
        let cardinality = slots.iter().map(|slot| counts[*slot] as f64).collect();
        let found = elimination::order(cardinality, &scopes, &numbered(away));
        let order: Vec<usize> = found.variables.iter().map(|one| slots[*one as usize]).collect();
        fits(kind.0.clone(), &order, counts)?;
        self.known.insert(kind, order.clone());
        Ok(order)
    }
}

/// Refuses an order in which a table is too large; `Err` is the number of its cells.
fn fits(mut scopes: Vec<Vec<usize>>, order: &[usize], counts: &[usize]) -> Result<(), f64> {
    for slot in order {
        let (with, without): (Vec<_>, Vec<_>) = scopes.into_iter().partition(|scope| scope.contains(slot));
        let mut union = with.concat();
        union.sort_unstable();
        union.dedup();
        union.retain(|own| own != slot);
        let cells: f64 = union.iter().map(|slot| counts[*slot] as f64).product();
        if cells > MOST_CELLS {
            return Err(cells);
        }
        scopes = without;
        scopes.push(union);
    }
    Ok(())
}

impl Product {
    /// Multiplies by a potential.
    pub(crate) fn push(&mut self, part: Arc<Potential>) {
        if part.is_zero() {
            self.ln_constant = f64::NEG_INFINITY;
        }
        match part.over.is_empty() {
            true => self.ln_constant += part.ln_scalar(),
            false => self.parts.push(part),
        }
    }

    /// Multiplies by another product.
    pub(crate) fn times(mut self, other: &Self) -> Self {
        self.parts.extend(other.parts.iter().cloned());
        self.ln_constant += other.ln_constant;
        self
    }

    /// The same, each potential with its bands.
    pub(crate) fn with_bands(mut self, counts: &[usize]) -> Self {
        let with_bands = |part: Arc<Potential>| Arc::new(Arc::unwrap_or_clone(part).with_bands(counts));
        self.parts = self.parts.into_iter().map(with_bands).collect();
        self
    }

    /// The slots of its potentials.
    pub(crate) fn slots(&self) -> Vec<usize> {
        let mut slots: Vec<usize> = self.parts.iter().flat_map(|part| part.over.iter().copied()).collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    /// The product with the slots that are not wanted summed out.
    pub(crate) fn summed(
        self,
        keep: impl Fn(usize) -> bool,
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<Self, f64> {
        Ok(self.eliminated(keep, Fold::Sum, counts, orders)?.0)
    }

    /// The product with the slots that are not wanted maximised out; and the maximising values.
    pub(crate) fn maximised(
        self,
        keep: impl Fn(usize) -> bool,
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<(Self, Vec<Trace>), f64> {
        self.eliminated(keep, Fold::Maximum, counts, orders)
    }

    fn eliminated(
        mut self,
        keep: impl Fn(usize) -> bool,
        fold: Fold,
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<(Self, Vec<Trace>), f64> {
        let away: Vec<usize> = self.slots().into_iter().filter(|slot| !keep(*slot)).collect();
        let order = orders.order(&self.parts, &away, counts)?;
        let mut traces = Vec::new();
        for slot in order {
            let (with, without): (Vec<_>, Vec<_>) =
                self.parts.into_iter().partition(|part| part.over.contains(&slot));
            self.parts = without;
            let parts: Vec<&Potential> = with.iter().map(Arc::as_ref).collect();
            let (made, choice) = folded(&parts, Some(slot), fold, counts);
            if fold == Fold::Maximum {
                traces.push(Trace { slot, over: made.over.clone(), choice });
            }
            self.push(Arc::new(made));
        }
        Ok((self, traces))
    }

    /// ln of the sum over all slots.
    pub(crate) fn ln_total(&self, counts: &[usize], orders: &mut Orders) -> Result<f64, f64> {
        Ok(self.clone().summed(|_| false, counts, orders)?.ln_constant)
    }

    /// The distribution of some slots, the last one fastest: all others are summed.
    pub(crate) fn distribution(
        self,
        slots: &[usize],
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<Vec<f64>, f64> {
        Ok(match self.joint(slots, counts, orders)? {
            (cells, None) => vec![0.0; cells],
            (_, Some((joint, _))) => joint.distribution(slots, counts),
        })
    }

    /// ln of the sum over all other slots, for each combination of values of these, the last one fastest.
    pub(crate) fn ln_table(
        self,
        slots: &[usize],
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<Vec<f64>, f64> {
        Ok(match self.joint(slots, counts, orders)? {
            (cells, None) => vec![f64::NEG_INFINITY; cells],
            (_, Some((joint, ln_constant))) => joint.ln_table(slots, counts, ln_constant),
        })
    }

    /// The number of cells over some slots, and the sum over all others as one potential with ln of a constant; none where
    /// nothing is possible.
    fn joint(
        self,
        slots: &[usize],
        counts: &[usize],
        orders: &mut Orders,
    ) -> Result<(usize, Option<(Potential, f64)>), f64> {
        let cells: f64 = slots.iter().map(|slot| counts[*slot] as f64).product();
        if cells > MOST_CELLS {
            return Err(cells);
        }
        let left = self.summed(|slot| slots.contains(&slot), counts, orders)?;
        if left.ln_constant == f64::NEG_INFINITY {
            return Ok((cells as usize, None));
        }
        let parts: Vec<&Potential> = left.parts.iter().map(Arc::as_ref).collect();
        let (joint, _) = folded(&parts, None, Fold::Sum, counts);
        Ok((cells as usize, Some((joint, left.ln_constant))))
    }

    /// The same up to a factor, and ln of that factor.
    pub(crate) fn unscaled(self) -> (Self, f64) {
        let (mut ln_factor, mut parts) = (self.ln_constant, Vec::with_capacity(self.parts.len()));
        for part in self.parts {
            let (part, ln_scale) = Arc::unwrap_or_clone(part).unscaled();
            ln_factor += ln_scale;
            parts.push(Arc::new(part));
        }
        (Self { parts, ln_constant: 0.0 }, ln_factor)
    }

    /// The same over other slots.
    pub(crate) fn renamed(&self, slot: impl Fn(usize) -> usize) -> Self {
        let parts = self.parts.iter().map(|part| Arc::new(part.renamed(&slot)));
        Self { parts: parts.collect(), ln_constant: self.ln_constant }
    }
}

impl Trace {
    /// Sets the value of the slot in an assignment that has values for the slots on which it depends.
    pub(crate) fn follow(&self, values: &mut [usize], counts: &[usize]) {
        let cell = radix::position(self.over.iter().map(|slot| (values[*slot], counts[*slot])));
        values[self.slot] = self.choice[cell] as usize;
    }
}
