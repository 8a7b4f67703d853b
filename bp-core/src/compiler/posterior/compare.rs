//! Comparison of two distributions of the same variables.
//!
//! In: the tables P(S | K) and P(S | K′). Out: a row for each context of either: the known variables of the first, then
//! those that only the second has. Invariant: a context that is impossible in one of them has no row; a variable that
//! both know has one value in both.

use super::rows::named;
use super::table::{Column, Table};
use super::{Figure, Row, moments};
use crate::exec::scalar::{Extended, Scalar};

/// The divergence of the first from the second, in each context.
pub(crate) fn divergences(first: &Table, second: &Table) -> Vec<Row> {
    let mut right = first.right.clone();
    for column in &second.right {
        if !right.iter().any(|known| known.is(column)) {
            right.push(column.clone());
        }
    }
    let contexts: usize = right.iter().map(|column| column.values.len()).product();
    let width = first.width();
    let (first, second) = ((first, first.extended()), (second, second.extended()));
    let mut rows = Vec::new();
    for context in 0..contexts {
        let ordinals = Column::ordinals(&right, context);
        let numbers = |(table, all): &(&Table, Vec<Extended>)| -> Vec<Extended> {
            let at = table.right.iter().fold(0, |at, column| {
                let position = right.iter().position(|known| known.is(column));
                at * column.values.len() + ordinals[position.expect("internal: every column is there")]
            });
            all[at * width..(at + 1) * width].to_vec()
        };
        let (p, q) = (numbers(&first), numbers(&second));
        let possible = |numbers: &[Extended]| numbers.iter().any(|p| *p > Extended::ZERO);
        if possible(&p) && possible(&q) {
            let divergence = moments::divergence(&p, &q);
            let figure = Figure::Divergence { divergence, infinite: divergence.is_infinite() };
            rows.push(Row { values: named(&right, &ordinals).collect(), figure });
        }
    }
    rows
}
