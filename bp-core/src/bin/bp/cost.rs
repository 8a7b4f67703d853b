//! The cost of an answer, as a table.
//!
//! In: a plan. Out: a row for each variable that is summed out and one for the answer. Invariant: the sums at the foot
//! are those of the rows.

use crate::wrap::{columns, wrapped};
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Cost, Plan};
use serde::Serialize;

/// The costs of one plan.
#[derive(Serialize)]
pub(crate) struct Table {
    /// The variables that are summed out, in order; then the answer.
    pub(crate) rows: Vec<Row>,
    /// Total multiplications.
    pub(crate) multiplications: f64,
    /// Total additions.
    pub(crate) additions: f64,
    /// Total bytes of all tables.
    pub(crate) bytes: f64,
    /// Whether a chain is scanned in addition, at a few operations for each element.
    pub(crate) has_scan: bool,
    /// Whether every size is known; an unknown size counts as 16.
    pub(crate) sizes_are_known: bool,
}

/// The cost of one table.
#[derive(Serialize)]
pub(crate) struct Row {
    /// The variable that is summed out; `None` for the answer.
    pub(crate) summed: Option<String>,
    /// The variables of the table.
    pub(crate) table: Vec<String>,
    /// Numbers in it.
    pub(crate) entries: f64,
    /// Multiplications.
    pub(crate) multiplications: f64,
    /// Additions.
    pub(crate) additions: f64,
    /// Bytes.
    pub(crate) bytes: f64,
}

/// Headings of the columns.
pub(crate) const HEADINGS: [&str; 6] =
    ["sum over", "table of", "numbers", "bytes", "multiplications", "additions"];

/// A table for each exact route.
pub(crate) fn tables(model: &Model, plan: &Plan) -> Vec<Table> {
    let exact = plan.routes.iter().filter_map(|route| route.exact());
    let table = |exact: &bp_core::compiler::plan::Exact| {
        let row = |summed: Option<String>, cost: &Cost| Row {
            summed,
            table: cost.table.iter().map(|id| model.variable_name(*id)).collect(),
            entries: cost.entries,
            multiplications: cost.multiplications,
            additions: cost.additions,
            bytes: cost.bytes(),
        };
        let mut rows: Vec<Row> = (exact.eliminations.iter())
            .map(|sum| row(Some(model.variable_name(sum.variable)), &sum.cost))
            .collect();
        rows.push(row(None, &exact.answer_cost(model)));
        Table {
            multiplications: rows.iter().map(|row| row.multiplications).sum(),
            additions: rows.iter().map(|row| row.additions).sum(),
            bytes: rows.iter().map(|row| row.bytes).sum(),
            has_scan: exact.has_scan(),
            sizes_are_known: exact.sizes_are_known(model),
            rows,
        }
    };
    exact.map(table).collect()
}

/// The cells of a table, row by row.
pub(crate) fn cells(table: &Table) -> Vec<[String; 6]> {
    let cells = |row: &Row| {
        let numbers = [row.entries, row.bytes, row.multiplications, row.additions].map(number);
        let [entries, bytes, multiplications, additions] = numbers;
        let of = if row.table.is_empty() { "–".to_owned() } else { row.table.join(" ") };
        let summed = row.summed.clone().unwrap_or_else(|| "(answer)".to_owned());
        [summed, of, entries, bytes, multiplications, additions]
    };
    let rows = table.rows.len();
    if rows <= MANY_ROWS {
        return table.rows.iter().map(cells).collect();
    }
    let mut left_out = [const { String::new() }; 6];
    left_out[0] = format!("… ({} more)", rows - FIRST_ROWS - 1);
    let last = table.rows.last().map(cells);
    table.rows[..FIRST_ROWS].iter().map(cells).chain([left_out]).chain(last).collect()
}

/// Limit of rows: a longer table shows its first rows and its last one.
const MANY_ROWS: usize = 100;
const FIRST_ROWS: usize = 24;

/// The lines below a table.
pub(crate) fn in_all(table: &Table) -> String {
    let [multiplications, additions, bytes] =
        [table.multiplications, table.additions, table.bytes].map(number);
    let sizes = if table.sizes_are_known { "" } else { "; a size that is not known counts 16" };
    let scan = if table.has_scan { "; besides, a scan of a few for each element of the chain" } else { "" };
    format!("{multiplications} multiplications, {additions} additions, {bytes} bytes{sizes}{scan}")
}

/// A whole number, or its order of magnitude.
fn number(number: f64) -> String {
    if number < 1e9 { format!("{number:.0}") } else { format!("{number:.1e}") }
}

/// A table for a terminal.
pub(crate) fn as_text(table: &Table) -> String {
    /// The widest list of names.
    const WIDEST: usize = 24;
    let mut rows = cells(table);
    for row in &mut rows {
        for name in &mut row[..2] {
            if columns(name) > WIDEST {
                *name = name.chars().take(WIDEST - 1).chain(['…']).collect();
            }
        }
    }
    let headings = HEADINGS.map(str::to_owned);
    let width = |column: usize| {
        let cells = rows.iter().chain([&headings]);
        cells.map(|row| columns(&row[column])).max().unwrap_or(0)
    };
    let widths = [0, 1, 2, 3, 4, 5].map(width);
    let mut text = String::new();
    for row in [&headings].into_iter().chain(&rows) {
        let mut line = "  ".to_owned();
        for (column, (cell, width)) in row.iter().zip(widths).enumerate() {
            let blanks = " ".repeat(width - columns(cell));
            // Names are left-aligned, numbers right-aligned.
            let (before, after) = if column < 2 { ("", blanks.as_str()) } else { (blanks.as_str(), "") };
            line.push_str(&format!("{before}{cell}{after}  "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    let foot = wrapped("cost: ", &in_all(table), 4);
    format!("{foot}{text}")
}
