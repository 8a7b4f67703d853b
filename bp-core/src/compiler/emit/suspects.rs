//! Detection of suspect cells in emitted code: totals that are too small, and NaN.
//!
//! In: a computed buffer. Out: the check of its cells. Invariant: totals are counted; numbers are only summed as they
//! are computed, and counted if the sum is NaN.

use super::nest::Nests;
use super::print::name;
use crate::ids::BufferId;
use crate::kernel::Check;
use crate::loops::{Look, Of};

impl Nests<'_> {
    /// The check of a buffer's cells, if there is one.
    pub(super) fn checked(&self, buffer: BufferId) -> Option<Check> {
        let check = self.kernel.checks.iter().find(|(checked, _)| *checked == buffer);
        check.map(|(_, check)| *check)
    }

    /// The check of totals: a cell is suspect unless it is above a limit, which is 0 if no product can underflow, or if
    /// there is a plate.
    pub(super) fn totals(&self) -> Look {
        Look::Totals { is_linear: self.is_linear }
    }

    /// The check of a buffer that is computed once.
    pub(super) fn looked_at_once(&self, buffer: BufferId) -> Option<Look> {
        self.checked(buffer).map(|check| match check {
            Check::Total => self.totals(),
            Check::Number => Look::Numbers,
        })
    }

    /// The check of cells of a buffer that a pass computes.
    pub(super) fn looked_at(&self, buffer: BufferId) -> Option<Look> {
        self.checked(buffer).map(|check| match check {
            Check::Total => self.totals(),
            Check::Number => Look::Doubt,
        })
    }

    /// The lines before and after a pass.
    pub(super) fn around(&self, made: &[BufferId]) -> [String; 2] {
        let numbers = made.iter().filter(|out| self.checked(**out) == Some(Check::Number));
        let counted: Vec<String> = numbers
            .map(|out| format!("suspects += suspect_planes(&doubt, {});", name(&Of::Planes(*out).into())))
            .collect();
        let sums = if counted.is_empty() { "" } else { "let mut doubt: Doubt<T> = Doubt::default();" };
        let has_totals = self.kernel.checks.iter().any(|(_, check)| *check == Check::Total);
        let [small, counted_small] = match has_totals {
            true => ["let mut small: Suspects = Suspects::default();", "suspects += suspects_of(&small);"],
            false => [""; 2],
        };
        [
            format!("let mut suspects: usize = 0;\n{sums}\n{small}"),
            format!("{}\n{counted_small}", counted.join("\n")),
        ]
    }
}
