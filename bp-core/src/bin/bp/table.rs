//! An answer as a table.
//!
//! In: an [`Answer`]. Out: aligned columns, and bars for probabilities. Invariant: no line of a table whose values are
//! short is wider than a terminal.

use crate::numbers::{bar, six_digits};
use crate::wrap::{WIDTH, columns, filled, wrapped};
use bp_core::answer::{Answer, Figure, Row};
use std::io::{Result, Write};

/// The rows of a large table that are shown unless all are wanted.
const FIRST_ROWS: usize = 40;

/// The widest bar, and the narrowest that is worth showing.
const BARS: std::ops::RangeInclusive<usize> = 8..=40;

/// Writes an answer.
pub(crate) fn write(answer: &Answer, all: bool, out: &mut impl Write) -> Result<()> {
    write!(out, "{}", wrapped("", &answer.question, 4))?;
    let shown = if all { answer.answer.len() } else { answer.answer.len().min(FIRST_ROWS) };
    let rows = &answer.answer[..shown];
    if !rows.is_empty() {
        writeln!(out)?;
        write_rows(rows, largest(&answer.answer), out)?;
    } else {
        writeln!(out, "  no value is possible")?;
    }
    if shown < answer.answer.len() {
        writeln!(out, "  … and {} more rows; --all shows them", answer.answer.len() - shown)?;
    }
    let knows = answer.question.contains('|');
    if let Some(ln_evidence) = answer.ln_evidence.filter(|_| knows) {
        writeln!(out, "\n  ln P(evidence) = {}", six_digits(ln_evidence))?;
    }
    Ok(())
}

fn largest(rows: &[Row]) -> f64 {
    rows.iter().filter_map(Row::p).fold(0.0, f64::max)
}

fn write_rows(rows: &[Row], largest: f64, out: &mut impl Write) -> Result<()> {
    let mut headings: Vec<&str> = rows[0].values.iter().map(|(variable, _)| variable.as_str()).collect();
    headings.push(match rows[0].figure {
        Figure::Probability { .. } => "probability",
        Figure::Entropy { .. } => "entropy",
        Figure::Normal { .. } => "mean ± deviation",
    });
    let mut cells: Vec<Vec<String>> = rows.iter().map(cells_of).collect();
    // The variable of a normal law is a name without a value: it heads its row, not a column.
    if let Figure::Normal { .. } = rows[0].figure {
        headings = vec!["", "mean ± deviation"];
        for (row, cells) in rows.iter().zip(&mut cells) {
            let names: Vec<_> = row.values.iter().map(|(name, _)| name.as_str()).collect();
            *cells = vec![names.join(" "), cells.pop().unwrap_or_default()];
        }
    }
    let width = |column: usize| {
        let widest = cells.iter().map(|row| columns(&row[column])).max().unwrap_or(0);
        widest.max(columns(headings[column]))
    };
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let line = |cells: &[&str]| {
        let cells: Vec<_> = cells.iter().zip(&widths).map(|(cell, width)| filled(cell, *width)).collect();
        format!("  {}", cells.join("  "))
    };
    writeln!(out, "{}", line(&headings).trim_end())?;
    let used = widths.iter().map(|width| width + 2).sum::<usize>() + 2;
    let left = WIDTH.saturating_sub(used).min(*BARS.end());
    let bars = rows.len() > 1 && left >= *BARS.start() && largest > 0.0;
    for (row, cells) in rows.iter().zip(&cells) {
        let cells: Vec<&str> = cells.iter().map(String::as_str).collect();
        let drawn = match row.p().filter(|_| bars) {
            Some(p) => bar(p / largest, left),
            None => String::new(),
        };
        writeln!(out, "{}", format!("{}  {drawn}", line(&cells)).trim_end())?;
    }
    Ok(())
}

fn cells_of(row: &Row) -> Vec<String> {
    let mut cells: Vec<String> = row.values.iter().map(|(_, value)| value.clone()).collect();
    cells.push(match row.figure {
        Figure::Probability { p } => six_digits(p),
        Figure::Entropy { entropy } => format!("{} nats", six_digits(entropy)),
        Figure::Normal { mean, deviation } => format!("{} ± {}", six_digits(mean), six_digits(deviation)),
    });
    cells
}
