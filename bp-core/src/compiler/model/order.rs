//! Topological orders.
//!
//! In: the inputs and outputs of each item. Out: an order. Invariant: linear except for a heap; among items that are
//! ready the first comes first; inputs that no item provides are available from the start.

use super::Model;
use crate::ids::FactorId;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};
use std::hash::Hash;

/// The positions of the items in order; `None` if there is a cycle.
pub(crate) fn in_order<K: Copy + Eq + Hash>(needs: &[Vec<K>], gives: &[Vec<K>]) -> Option<Vec<usize>> {
    let mut giver: HashMap<K, usize> = HashMap::new();
    for (position, given) in gives.iter().enumerate() {
        giver.extend(given.iter().map(|variable| (*variable, position)));
    }
    let mut waits = vec![0usize; needs.len()];
    let mut followers: Vec<Vec<usize>> = vec![Vec::new(); needs.len()];
    for (position, needs) in needs.iter().enumerate() {
        let givers = needs.iter().filter_map(|variable| giver.get(variable).copied());
        for giver in givers.filter(|giver| *giver != position).collect::<HashSet<_>>() {
            waits[position] += 1;
            followers[giver].push(position);
        }
    }
    let mut ready: BinaryHeap<Reverse<usize>> =
        (0..waits.len()).filter(|position| waits[*position] == 0).map(Reverse).collect();
    let mut order = Vec::with_capacity(waits.len());
    while let Some(Reverse(position)) = ready.pop() {
        order.push(position);
        for follower in &followers[position] {
            waits[*follower] -= 1;
            if waits[*follower] == 0 {
                ready.push(Reverse(*follower));
            }
        }
    }
    (order.len() == waits.len()).then_some(order)
}

impl Model {
    /// Factors, parents first, otherwise in their own order.
    pub fn parents_first(&self, factors: &[FactorId]) -> Vec<FactorId> {
        let uses = |uses: &[super::VariableUse]| uses.iter().map(|use_| use_.variable).collect::<Vec<_>>();
        let needs = |id: &FactorId| {
            let earlier = self.earlier(*id);
            let mut needs = uses(&self.factors[*id].right);
            needs.retain(|variable| !earlier.contains(variable));
            needs
        };
        let needs: Vec<_> = factors.iter().map(needs).collect();
        let gives: Vec<_> = factors.iter().map(|id| uses(&self.factors[*id].left)).collect();
        let order = in_order(&needs, &gives).expect("internal: a checked decomposition has an order");
        order.into_iter().map(|position| factors[position]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{Id, VariableId};

    #[test]
    fn the_first_that_is_ready_comes_first() {
        let [a, b, c] = [0, 1, 2].map(VariableId::new);
        // c needs a and b; b needs a; a needs an input that no item provides.
        let needs = [vec![a, b], vec![a], vec![VariableId::new(9)]];
        assert_eq!(in_order(&needs, &[vec![c], vec![b], vec![a]]), Some(vec![2, 1, 0]));
        assert_eq!(in_order(&[vec![b], vec![a]], &[vec![a], vec![b]]), None);
    }
}
