//! What a tree takes, and whether there is room for it.
//!
//! In: a tree that is only outlined. Out: a [`Cost`]; an error that says how much would be needed. Invariant: nothing is
//! allocated that does not fit; on a machine that does not say how much memory it has, eight gigabytes do.

use super::pair::Pairing;
use super::problem::Problem;
use crate::error::Error;
use crate::memory;

/// Bytes that there are on a machine that does not say.
const UNKNOWN_MEMORY: f64 = 8e9;

/// What a tree would take, before it is made.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Cost {
    /// Cells of all products: for each one multiplication and one addition on the way up, and as many for each derivative
    /// on the way down.
    pub cells: f64,
    /// Variables of the largest product; 0 where it was not counted to the end: then there are more cells than it says.
    pub width: usize,
    /// Bytes of what is kept: the tables, and the cells of each node and their derivatives.
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

    /// What takes more cells than these: no order was looked for to the end, and the width is not known.
    pub(super) fn beyond(cells: f64) -> Self {
        Self { cells, width: 0, bytes: 8.0 * cells }
    }

    /// Multiplications and additions of one question, if every derivative is wanted.
    pub fn flops(&self) -> f64 {
        6.0 * self.cells
    }

    /// Both together.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            width: self.width.max(other.width),
            bytes: self.bytes + other.bytes,
        }
    }

    /// Refuses what does not fit.
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
