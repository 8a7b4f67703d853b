//! The product of the factors of an instant, without the slots that are neither carried nor searched.
//!
//! In: the observations of an instant. Out: a [`Product`]. Invariant: what does not depend on the observed values is summed
//! once for all instants with the same observed slots.

use super::{Factors, MOST_MADE, Made};
use crate::error::Error;
use crate::potential::Product;
use crate::strategies::over_time::Instant;

impl Factors<'_> {
    /// The product of all factors of an instant. `first`: include the factors that distribute X^-1. `given`: apply the
    /// likelihoods of the question; false for a predicted instant.
    pub(in super::super) fn product(
        &mut self,
        instant: &Instant,
        first: bool,
        given: bool,
    ) -> Result<Product, Error> {
        let bits = instant.iter().map(|(slot, value)| (*slot, value.to_bits())).collect();
        let key: Made = (first, given, bits);
        // A likelihood of one instant seldom comes again.
        let made = self.made.get(&key).filter(|_| self.weighed.is_empty());
        if let Some(made) = made {
            return Ok(made.clone());
        }
        let slots = self.slots_of(instant);
        let (constant, observed) = self.potentials(instant, first, given)?;
        let constant = self.summed_once(constant, &observed, (first, given, slots));
        let axes = &self.axes;
        let product = constant
            .times(&observed)
            .summed(|slot| axes.contains(&slot), &self.counts, &mut self.orders)
            .map_err(|cells| self.too_large(cells))?;
        let cells: usize = product.parts.iter().map(|part| part.len()).sum();
        let finite = instant.iter().all(|(slot, _)| self.counts[*slot] > 0);
        if finite && self.weighed.is_empty() && self.made_cells + cells <= MOST_MADE {
            self.made_cells += cells;
            self.made.insert(key, product.clone());
        }
        Ok(product)
    }

    /// The factors without observed slots, with the slots summed out that are neither axes nor in the observed factors:
    /// made once for all instants with these observed slots.
    fn summed_once(
        &mut self,
        constant: Product,
        observed: &Product,
        kind: (bool, bool, Vec<usize>),
    ) -> Product {
        if let Some(known) = self.summed.get(&kind) {
            return known.clone();
        }
        let kept = observed.slots();
        let cells = |product: &Product| product.parts.iter().map(|part| part.len()).sum::<usize>();
        let keep = |slot: usize| self.axes.contains(&slot) || kept.contains(&slot);
        let made = match constant.clone().summed(keep, &self.counts, &mut self.orders) {
            Ok(summed) if cells(&summed) <= cells(&constant) => summed,
            _ => constant,
        };
        let made = made.with_bands(&self.counts);
        self.summed.insert(kind, made.clone());
        made
    }
}
