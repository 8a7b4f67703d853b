//! Validation of tables of constants.
//!
//! In: a factor and its numbers. Out: its first fault. Invariant: one pass over the numbers; a row is named by the values
//! of the right-hand variables.

use super::form::SUM_TOLERANCE;
use super::{Fault, Place, fault};
use crate::ids::FactorId;
use crate::model::{Model, VariableUse};
use crate::spelling::number as written;

pub(super) fn constants_fault(model: &Model, id: FactorId, numbers: &[f64]) -> Option<Fault> {
    let factor = &model.factors[id];
    let cells = |uses: &[VariableUse]| {
        uses.iter()
            .try_fold(1usize, |cells, use_| cells.checked_mul(model.variables[use_.variable].domain.count()?))
    };
    let head = || model.head(factor);
    let (Some(rows), Some(entries)) = (cells(&factor.right), cells(&factor.left)) else {
        return Some(fault(
            Place::Form(id),
            format!("a table needs finite variables of known size, but `{}` has others", head()),
        ));
    };
    if rows.checked_mul(entries) != Some(numbers.len()) {
        let message = format!(
            "a table for `{}` has {rows} rows of {entries} entries, but {} numbers are given",
            head(),
            numbers.len()
        );
        return Some(fault(Place::Form(id), message));
    }
    for (row, numbers) in numbers.chunks_exact(entries.max(1)).enumerate() {
        let at = || match factor.right.is_empty() {
            true => format!("`{}`", head()),
            false => format!("`{}` at {}", head(), model.combination_text(&factor.right, row)),
        };
        if let Some(wrong) = numbers.iter().find(|number| !(0.0..=1.0).contains(*number)) {
            let message =
                format!("{}: a probability lies between 0 and 1, but one is {}", at(), written(*wrong));
            return Some(fault(Place::Form(id), message));
        }
        let sum: f64 = numbers.iter().sum();
        // An impossible context has a row of zeros.
        if sum == 0.0 && !factor.right.is_empty() {
            continue;
        }
        if (sum - 1.0).abs() > SUM_TOLERANCE {
            let message = format!("{}: probabilities must sum to 1, but these sum to {}", at(), written(sum));
            return Some(fault(Place::Form(id), message));
        }
    }
    None
}
