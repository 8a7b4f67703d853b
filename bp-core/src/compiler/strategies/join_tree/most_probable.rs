//! The most probable explanation (MPE): an assignment of all variables.
//!
//! In: a network and evidence. Out: a value for each variable, and ln of their joint probability with the evidence.
//! Invariant: no assignment that agrees with the evidence is more probable; any of several equal ones may be returned.
//!
//! Maxima instead of sums go up; then, from the root down, each product chooses the maximising values of its eliminated
//! variables given the choices above (Dawid 1992).

use super::cell::Cell;
use super::compile::{Purpose, Tree};
use super::evidence::NetworkEvidence;
use super::network::Network;
use super::session::Session;
use crate::error::Error;
use crate::radix;

/// A most probable value for each variable, and ln P(values, evidence).
///
/// # Errors
/// Too little memory; evidence of probability zero, or a value outside its domain.
pub fn most_probable(network: &Network, evidence: &NetworkEvidence) -> Result<(Vec<usize>, f64), Error> {
    let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
    // Each variable gets a likelihood of its own, so that no table is maximised before it is in a product.
    let every: Vec<usize> = (0..network.cardinalities.len()).collect();
    let tree = Tree::whole(network, &given, &every, &[], Purpose::Maximum)?;
    let mut session = tree.session();
    let values = session.most_probable(evidence)?;
    Ok((values, session.ln_evidence))
}

impl Session<'_> {
    /// The maximising values, after the upward pass of maxima.
    pub(super) fn assignment<T: Cell>(&self, own: &[T]) -> Vec<usize> {
        let (tree, mut values) = (self.tree, self.known.values.clone());
        for part in tree.parts.iter().rev() {
            let Some((one, other)) = part.children else { continue };
            let open = tree.scopes[one].iter().copied().filter(|variable| values[*variable] == usize::MAX);
            let open: Vec<usize> = open.collect();
            let cells = |child: usize| tree.value(&self.known, own, 0, child);
            let (first, second) = (cells(one), cells(other));
            let count: usize = open.iter().map(|variable| tree.cardinalities[*variable]).product();
            let (mut best, mut most) = (0, -T::ONE);
            for row in 0..count {
                self.choose(&open, row, &mut values);
                let product = first[self.place(one, &values)] * second[self.place(other, &values)];
                if product > most {
                    (best, most) = (row, product);
                }
            }
            self.choose(&open, best, &mut values);
        }
        values
    }

    /// Sets some variables to the values that a mixed-radix number encodes, the last variable fastest.
    fn choose(&self, variables: &[usize], row: usize, values: &mut [usize]) {
        let counts = variables.iter().rev().map(|variable| self.tree.cardinalities[*variable]);
        for (variable, value) in variables.iter().rev().zip(radix::ordinals(row, counts)) {
            values[*variable] = value;
        }
    }

    fn place(&self, node: usize, values: &[usize]) -> usize {
        let scope = &self.tree.scopes[node];
        radix::position(scope.iter().map(|one| (values[*one], self.tree.cardinalities[*one])))
    }
}
