//! Soft evidence: replaces the marginal of a variable (Jeffrey's rule).
//!
//! In: the table P(S X … | K) and a probability for each value of each variable X with soft evidence. Out: the table
//! P′(S | K). Invariant: P′(X) = q after its own replacement, and P′(S | X) = P(S | X); later evidence may change the
//! marginal of earlier evidence, since replacements do not commute.
//!
//! P′(S X) = P(S X) q(X) / P(X) (Jeffrey, *The Logic of Decision*, 1965).

use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use crate::model::{Ask, Finding, Known, Model};
use crate::posterior::{Column, Table};
use crate::spelling::exact;

/// The table of an ask, from that of its part.
///
/// # Errors
/// Soft evidence gives a positive probability to a value that the other evidence excludes.
pub(super) fn applied(model: &Model, ask: &Ask, known: &[Known], mut table: Table) -> Result<Table, Error> {
    let softly: Vec<_> = (known.iter())
        .filter_map(|known| match &known.evidence {
            Finding::Soft(weights) => Some((known.variable, weights)),
            _ => None,
        })
        .collect();
    if softly.is_empty() {
        return Ok(table);
    }
    let width = table.width();
    let columns: Vec<usize> = (softly.iter())
        .map(|(id, _)| table.left.iter().position(|column| column.variable == Some(*id)))
        .map(|position| position.expect("internal: a softly known variable is searched"))
        .collect();
    let ordinals: Vec<Vec<usize>> = (0..width).map(|at| Column::ordinals(&table.left, at)).collect();
    let mut all = table.extended();
    for numbers in all.chunks_mut(width) {
        if numbers.iter().all(|p| *p == Extended::ZERO) {
            continue;
        }
        for ((id, weights), column) in softly.iter().zip(&columns) {
            let mut believed = vec![Extended::ZERO; weights.len()];
            for (p, ordinals) in numbers.iter().zip(&ordinals) {
                let sum = &mut believed[ordinals[*column]];
                *sum = *sum + *p;
            }
            let excluded =
                (0..weights.len()).find(|value| weights[*value] > 0.0 && believed[*value] == Extended::ZERO);
            if let Some(value) = excluded {
                // In a table with contexts, only this context is impossible.
                if !table.right.is_empty() {
                    numbers.fill(Extended::ZERO);
                    break;
                }
                let (value, q) = (model.value_name(*id, value), exact(weights[value]));
                let message = format!(
                    "soft evidence gives `{value}` the probability {q}, but it is impossible given the other evidence of `{}`",
                    model.ask_text(ask)
                );
                return Err(Error::input(model.variable_name(*id), message));
            }
            for (p, ordinals) in numbers.iter_mut().zip(&ordinals) {
                let value = ordinals[*column];
                if believed[value] > Extended::ZERO {
                    *p = *p * (Extended::from_f64(weights[value]) / believed[value]);
                }
            }
        }
    }
    // The variables with soft evidence are the last columns, so a context's remaining table is the sum over runs of
    // them.
    let run: usize = columns.iter().map(|column| table.left[*column].values.len()).product();
    let all: Vec<Extended> = all.chunks(run).map(|run| run.iter().copied().sum()).collect();
    table.numbers = all.iter().map(|p| p.to_f64()).collect();
    table.extended = Some(all);
    table.left.truncate(table.left.len() - softly.len());
    Ok(table)
}
