//! The cost of a tree in time and memory, and whether memory holds it.
//!
//! In: the outline of a tree. Out: a [`Cost`]; an error that names the memory needed. Invariant: nothing is allocated
//! that does not fit; a machine that does not report its memory is taken to have eight gigabytes.

use super::pair::Pairing;
use super::problem::Problem;
use crate::error::Error;
use crate::memory;

/// Bytes assumed on a machine that does not report its memory.
const UNKNOWN_MEMORY: f64 = 8e9;

/// The cost of a tree before it is made.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Cost {
    /// Cells of all products: each takes one multiplication and one addition on the way up, and as many for each
    /// derivative on the way down.
    pub cells: f64,
    /// The number of variables in the largest product; 0 where the search stopped early and `cells` is a lower bound.
    pub width: usize,
    /// Bytes of memory: the tables, and the cells of each node and their derivatives.
    pub bytes: f64,
}

impl Cost {
    pub(super) fn of_pairing(problem: &Problem, pairing: &Pairing) -> Self {
        let mut cost = Self::default();
        for node in &pairing.nodes {
            let own = problem.cells(&node.scope);
            cost.bytes += 16.0 * own;
            let Some((first, second)) = node.children else { continue };
            let (one, other) = (&pairing.nodes[first].scope, &pairing.nodes[second].scope);
            let more: Vec<u32> =
                other.iter().copied().filter(|axis| one.binary_search(axis).is_err()).collect();
            cost.cells += problem.cells(one) * problem.cells(&more);
            cost.width = cost.width.max(one.len() + more.len());
        }
        cost
    }

    /// The cost of a tree with more cells than these: the search for an order stopped, so the width is not known.
    pub(super) fn beyond(cells: f64) -> Self {
        Self { cells, width: 0, bytes: 8.0 * cells }
    }

    /// Multiplications and additions of one question, if every derivative is wanted.
    pub fn flops(&self) -> f64 {
        6.0 * self.cells
    }

    /// The cost of both together.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            width: self.width.max(other.width),
            bytes: self.bytes + other.bytes,
        }
    }

    /// Returns an error if memory does not hold it.
    pub(super) fn fits(self) -> Result<(), Error> {
        let most = memory::free().unwrap_or(UNKNOWN_MEMORY);
        match self.bytes <= most {
            true => Ok(()),
            false => Err(Error::TooLarge {
                name: "the join tree".to_owned(),
                cells: self.bytes / 8.0,
                most: (most / 8.0).floor(),
                help: "observe more variables, ask for fewer of them, or estimate by sampling".to_owned(),
            }),
        }
    }
}
