//! The most probable assignment of all variables (MPE).
//!
//! In: a tree and evidence. Out: a value for each variable, and ln of their joint probability with the evidence.
//! Invariant: no assignment that agrees with the evidence is more probable; among equals it is one of them.
//!
//! Largest values instead of sums go up; then each clique chooses the best of what its parent left open (Dawid 1992).

use super::evidence::Evidence;
use super::propagate::Session;
use crate::error::Error;

impl Session<'_> {
    /// A most probable value for each variable, and ln P(values, evidence).
    ///
    /// # Errors
    /// As for [`Session::ask`].
    pub fn most_probable(&mut self, evidence: &Evidence) -> Result<(Vec<usize>, f64), Error> {
        self.collect(evidence, true)?;
        let (tree, cardinalities) = (self.tree, &self.tree.network.cardinalities);
        let mut values = self.known.values.clone();
        // A value that is a likelihood of 0 and 1 is found again.
        (0..values.len()).filter(|one| !tree.given[*one]).for_each(|one| values[one] = usize::MAX);
        for (number, clique) in tree.cliques.iter().enumerate().rev() {
            let cells = &self.cells[tree.offsets[number].cells..][..clique.blocks.cells()];
            // What is shared with the parent comes last.
            let open = clique.variables.iter().take_while(|one| values[**one] == usize::MAX).count();
            let shared = clique.variables[open..]
                .iter()
                .fold(0, |place, one| place * cardinalities[*one] + values[*one]);
            let rows = clique.blocks.cells() / clique.message;
            let at = |row: &usize| cells[row * clique.message + shared];
            let best = (0..rows).max_by(|one, other| at(one).total_cmp(&at(other)));
            let mut row = best.expect("internal: a clique has cells");
            for one in clique.variables[..open].iter().rev() {
                values[*one] = row % cardinalities[*one];
                row /= cardinalities[*one];
            }
        }
        let mut ln_joint = 0.0;
        for table in &tree.network.tables {
            let place =
                table.variables.iter().fold(0, |place, one| place * cardinalities[*one] + values[*one]);
            ln_joint += table.values[place].ln();
        }
        for (variable, weights) in &evidence.likelihoods {
            ln_joint += weights[values[*variable]].ln();
        }
        Ok((values, ln_joint))
    }
}
