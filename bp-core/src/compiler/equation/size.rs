//! Refusal of plans that are too large.
//!
//! In: an exact plan. Out: nothing, or an error with the figure and a suggestion. Invariant: unknown sizes are checked
//! at run time (`exec/inputs.rs`); the limits are fixed, so that the same question is refused on every machine.

use super::Exact;
use crate::error::Error;
use crate::model::Model;

/// Limit of the cells of one table.
const MOST_CELLS: f64 = 1e9;

/// Limit of the summed products: some ten seconds of one core.
pub(crate) const MOST_PRODUCTS: f64 = 1e10;

/// Refuses a plan with a larger table, or more products.
pub(super) fn check(model: &Model, exact: &Exact) -> Result<(), Error> {
    let question = || model.ask_text(&exact.asks[0]);
    let large = exact.eliminations.iter().find(|sum| sum.cost.entries > MOST_CELLS);
    if let Some(sum) = large {
        let help = format!(
            "the sum over `{}` makes the largest table: observe more variables, or make their domains smaller",
            model.variable_name(sum.variable)
        );
        return Err(Error::TooLarge { name: question(), cells: sum.cost.entries, most: MOST_CELLS, help });
    }
    let one_value = exact.normalised
        && exact.asks.iter().flat_map(|ask| &ask.searched).all(|searched| searched.at.is_some());
    let entries = exact.answer_cost(model).entries;
    if entries > MOST_CELLS && !one_value {
        let help = "search or know fewer variables at once, or make their domains smaller".to_owned();
        return Err(Error::TooLarge { name: question(), cells: entries, most: MOST_CELLS, help });
    }
    if exact.cost > MOST_PRODUCTS {
        let help = "observe more variables, or make their domains smaller".to_owned();
        let (question, products) = (question(), exact.cost);
        return Err(Error::TooLong { question, products, most: MOST_PRODUCTS, help });
    }
    Ok(())
}
