//! An order of instances in which each comes after those that it reads.
//!
//! In: items that need slots and give slots. Out: the same items. Invariant: of those that are ready the first comes first, so that
//! items that are in order already stay as they are.

use super::{Instance, Setting};
use crate::error::Error;
use crate::ids::FactorId;
use crate::model::in_order;

impl Setting<'_> {
    /// The instances of factors that are in order, each after those that it reads.
    ///
    /// # Errors
    /// As [`Setting::instances`].
    pub(crate) fn in_order(&self, factors: &[FactorId]) -> Result<Vec<Instance>, Error> {
        let mut instances = Vec::new();
        for factor in factors {
            instances.extend(self.instances(*factor)?);
        }
        Ok(self.sorted(instances, |instance| (instance, None)))
    }

    /// Items of an instance, and perhaps of another that is solved for it, each after those that it reads: where families depend on
    /// their own earlier elements, an order of the factors is not one of their instances.
    pub(crate) fn sorted<T>(
        &self,
        items: Vec<T>,
        of: impl Fn(&T) -> (&Instance, Option<&Instance>),
    ) -> Vec<T> {
        if !self.model.is_recursive() {
            return items;
        }
        let needs = |item: &T| {
            let (own, other) = of(item);
            let other = other.map(|other| self.reads(other)).unwrap_or_default();
            self.reads(own).into_iter().chain(other).collect()
        };
        after_needs(items, needs, |item| of(item).0.left.clone())
    }
}

/// The items in order; as they are, if they have no order.
fn after_needs<T>(
    items: Vec<T>,
    needs: impl Fn(&T) -> Vec<usize>,
    gives: impl Fn(&T) -> Vec<usize>,
) -> Vec<T> {
    let needs: Vec<Vec<usize>> = items.iter().map(needs).collect();
    let gives: Vec<Vec<usize>> = items.iter().map(gives).collect();
    let Some(order) = in_order(&needs, &gives) else { return items };
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    order.into_iter().filter_map(|place| items[place].take()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two families of three elements: B₁ needs A₁, A₂ needs B₁, and so on.
    #[test]
    fn elements_alternate() {
        let items: Vec<(usize, Vec<usize>)> =
            vec![(0, vec![]), (1, vec![3]), (2, vec![4]), (3, vec![0]), (4, vec![1]), (5, vec![2, 3])];
        let order = after_needs(items, |(_, needs)| needs.clone(), |(own, _)| vec![*own]);
        assert_eq!(order.into_iter().map(|(own, _)| own).collect::<Vec<_>>(), [0, 3, 1, 4, 2, 5]);
    }
}
