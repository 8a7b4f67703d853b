//! Detection of suspect cells in emitted code: totals that are too small, and NaN.
//!
//! In: a computed buffer. Out: the lines that check its cells. Invariant: totals are counted; numbers are only summed
//! as they are computed, and counted if the sum is NaN.

use super::names::local;
use super::nest::Nests;
use crate::ids::BufferId;
use crate::kernel::Check;

impl Nests<'_> {
    /// The check of a buffer's cells, if there is one.
    pub(super) fn checked(&self, buffer: BufferId) -> Option<Check> {
        let check = self.kernel.checks.iter().find(|(checked, _)| *checked == buffer);
        check.map(|(_, check)| *check)
    }

    /// The total above which a cell is not suspect: 0 if no product can underflow, or if there is a plate.
    pub(super) fn least(&self) -> &'static str {
        if self.is_linear { "T::ZERO" } else { "T::LEAST_TOTAL" }
    }

    /// Checks the cells of a buffer that is computed once.
    pub(super) fn looked_at_once(&self, buffer: BufferId, cells: &str) -> Option<String> {
        self.checked(buffer).map(|check| match check {
            Check::Total => format!("suspects += suspect_totals({cells}, {});", self.least()),
            Check::Number => format!("suspects += suspect_numbers({cells});"),
        })
    }

    /// Checks the cells of a buffer that a pass computes.
    pub(super) fn looked_at(&self, buffer: BufferId, cells: &str) -> Option<String> {
        match self.checked(buffer) {
            Some(Check::Number) => Some(format!("doubt_numbers(&mut doubt, {cells});")),
            _ => self.looked_at_once(buffer, cells),
        }
    }

    /// The lines before and after a pass.
    pub(super) fn around(&self, made: &[BufferId]) -> [String; 2] {
        let numbers = made.iter().filter(|out| self.checked(**out) == Some(Check::Number));
        let counted: Vec<String> =
            numbers.map(|out| format!("suspects += suspect_planes(&doubt, {});", local("y", *out))).collect();
        let sums = if counted.is_empty() { "" } else { "let mut doubt: Doubt<T> = Doubt::default();" };
        [format!("let mut suspects: usize = 0;\n{sums}"), counted.join("\n")]
    }
}
