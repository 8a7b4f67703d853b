//! An answer as a table for a terminal.
//!
//! In: an [`Answer`]. Out: aligned columns, and bars for probabilities. Invariant: no line of a table whose values are
//! short is wider than a terminal.

use super::{Answer, Covariance, Figure, Row, word};
use crate::equation::Strategy;
use crate::model::When;
use crate::numbers::{bar, six_digits, two_digits};
use crate::wrap::{WIDTH, columns, filled, wrapped};
use std::fmt::{self, Display, Formatter, Write};

/// Number of rows of a large table that are shown by default.
const FIRST_ROWS: usize = 40;

/// The widest bar, and the narrowest that is shown.
const BARS: std::ops::RangeInclusive<usize> = 8..=40;

/// The table with bars; the first rows of a large one, all of them with `{:#}`.
impl Display for Answer {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let all = f.alternate();
        write(self, all, "`{:#}` shows them", f)
    }
}

impl Answer {
    /// The table with bars: `all` of it, or its first rows with a hint about the others.
    pub fn table(&self, all: bool, how: &str) -> String {
        let mut text = String::new();
        write(self, all, how, &mut text).expect("internal: a string accepts all text");
        text
    }
}

fn write(answer: &Answer, all: bool, how: &str, out: &mut impl Write) -> fmt::Result {
    write!(out, "{}", wrapped("", &answer.question, 4))?;
    let shown = if all { answer.answer.len() } else { answer.answer.len().min(FIRST_ROWS) };
    if let (true, Some(first)) = (shown > FIRST_ROWS, answer.answer.row_of_cells(0)) {
        return write_cells(answer, &first, out);
    }
    let rows = answer.answer.first_rows(shown);
    if rows.first().is_some_and(|row| row.values.first().is_some_and(|(name, _)| name == "sequence")) {
        return write_whole_sequences(answer, (all, how), out);
    }
    if rows.is_empty() {
        let is_possible = answer.ln_evidence.is_some_and(f64::is_finite);
        writeln!(
            out,
            "  {}",
            if is_possible { "every variable is observed" } else { "no value is possible" }
        )?;
    }
    let largest = answer.answer.largest_probability();
    let covariances = answer.covariances();
    let mut first = 0;
    for rows in rows.chunk_by(|one, other| headings(one) == headings(other)) {
        writeln!(out)?;
        let beside: Option<Vec<_>> =
            (first..first + rows.len()).map(|row| beside(&covariances, row)).collect();
        write_rows(rows, largest, beside, out)?;
        first += rows.len();
    }
    // `best(k) sequence` and `max sequence` give probabilities of whole sequences.
    let of_instants =
        |row: &Row| row.p().is_some() && row.values.first().is_some_and(|(name, _)| name != "sequence");
    if answer.when == When::Sequence && rows.iter().any(of_instants) {
        writeln!(out, "\n  the most likely sequence; each value with its probability at that instant alone")?;
    }
    if shown < answer.answer.len() {
        if let Some((_, row)) = answer.answer.largest_row().filter(|(at, _)| *at >= shown) {
            let values: Vec<String> =
                row.values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            let p = six_digits(row.p().unwrap_or_default());
            write!(out, "{}", wrapped("  ", &format!("most probable: {} with {p}", values.join(", ")), 4))?;
        }
        writeln!(out, "  … and {} more rows; {how}", answer.answer.len() - shown)?;
    }
    write_end(answer, out)
}

/// Whole sequences, each with its probability and a line of values for each variable.
fn write_whole_sequences(answer: &Answer, (all, how): (bool, &str), out: &mut impl Write) -> fmt::Result {
    let of = |row: &Row, name: &str| {
        row.values.iter().find(|(own, _)| own == name).map(|(_, value)| value.clone())
    };
    let sequences: Vec<&[Row]> =
        answer.answer.chunk_by(|one, other| of(one, "sequence") == of(other, "sequence")).collect();
    let shown = if all { sequences.len() } else { sequences.len().min(FIRST_ROWS) };
    for rows in &sequences[..shown] {
        let number = of(&rows[0], "sequence").unwrap_or_default();
        let p = rows[0].p().map_or_else(String::new, |p| format!(": probability {}", six_digits(p)));
        writeln!(out, "\n  sequence {number}{p}")?;
        let names = rows[0].values.iter().map(|(name, _)| name.as_str());
        for name in names.filter(|name| !["sequence", "t"].contains(name)) {
            let values: Vec<String> = rows.iter().filter_map(|row| of(row, name)).collect();
            write!(out, "{}", wrapped("    ", &format!("{name}: {}", values.join(" ")), 6))?;
        }
    }
    if shown < sequences.len() {
        writeln!(out, "\n  … and {} more sequences; {how}", sequences.len() - shown)?;
    }
    write_end(answer, out)
}

/// What follows the rows: ln P(evidence), and how good an estimate is.
fn write_end(answer: &Answer, out: &mut impl Write) -> fmt::Result {
    let knows = answer.question.contains('|');
    if let Some(ln_evidence) = answer.ln_evidence.filter(|_| knows) {
        let error = answer
            .estimate
            .as_ref()
            .and_then(|estimate| estimate.ln_evidence_error.filter(|error| *error > 0.0));
        let error = error.map_or_else(String::new, |error| format!(" ± {}", two_digits(error)));
        writeln!(out, "\n  ln P(evidence) = {}{error}", six_digits(ln_evidence))?;
    }
    if answer.strategy == Strategy::ExtendedKalman {
        writeln!(out, "\n  approximate: linearised; the error is not known")?;
    }
    if let Some(estimate) = &answer.estimate {
        let (particles, effective) = (estimate.particles, estimate.effective);
        writeln!(
            out,
            "\n  {particles} draws; effective sample size {effective:.0} (seed {})",
            estimate.seed
        )?;
        if let Some(warning) = &estimate.warning {
            write!(out, "{}", wrapped("  note: ", warning, 8))?;
        }
    }
    Ok(())
}

/// The headings of a row: its variables, and its entry. A variable without a value heads its row, not a column.
fn headings(row: &Row) -> Vec<String> {
    let named = row.values.iter().any(|(_, value)| value.is_empty());
    let valued = row.values.iter().filter(|(_, value)| !value.is_empty()).map(|(name, _)| name.clone());
    let figures: &[&str] = match row.figure {
        Figure::Probability { .. } => &["probability"],
        Figure::LnProbability { .. } => &["ln probability"],
        Figure::Density { .. } => &["density"],
        Figure::Entropy { error: None, .. } => &["entropy"],
        Figure::Entropy { .. } => &["entropy ± error"],
        Figure::Normal { .. } => &["mean ± deviation"],
        Figure::Estimated { .. } => &["probability ± error"],
        Figure::Draw { .. } => &["draw"],
        Figure::Mode { .. } => &["estimated by"],
        Figure::Expectation { error: None, .. } => &["expectation"],
        Figure::Expectation { .. } => &["expectation ± error"],
        Figure::Variance { error: None, .. } => &["variance"],
        Figure::Variance { .. } => &["variance ± error"],
        Figure::Quantile { error: None, .. } => &["level", "quantile"],
        Figure::Quantile { .. } => &["level", "quantile ± error"],
        Figure::Interval { errors: None, .. } => &["level", "low", "high"],
        Figure::Interval { .. } => &["level", "low ± error", "high ± error"],
        Figure::Information { .. } => &["information"],
        Figure::Divergence { .. } => &["divergence"],
        Figure::Mixture { .. } => &["mean", "deviation", "5 %", "50 %", "95 %"],
        Figure::Law { .. } => &["distribution", "mean", "deviation", "5 %", "50 %", "95 %"],
        Figure::Real { .. } => &["mean ± error", "deviation", "5 %", "50 %", "95 %"],
    };
    let figures = figures.iter().map(|figure| (*figure).to_owned());
    valued.chain(named.then(String::new)).chain(figures).collect()
}

/// The names of the reals that a row's real is asked with, and its covariances with them.
fn beside(covariances: &[Covariance], row: usize) -> Option<(&[String], &[f64])> {
    let place = covariances.partition_point(|own| own.first <= row).checked_sub(1)?;
    let own = &covariances[place];
    Some((&own.names, own.matrix.get(row - own.first)?))
}

/// A column: its heading, and its cells.
type Shown = (String, Vec<String>);

/// The columns that take all of a line.
fn width(of: &[Shown]) -> usize {
    of.iter().map(|column| width_of(column) + 2).sum()
}

fn width_of((heading, cells): &Shown) -> usize {
    cells.iter().map(|cell| columns(cell)).max().unwrap_or(0).max(columns(heading))
}

/// The line of headings, and one for each row.
fn lines(of: &[Shown]) -> Vec<String> {
    let widths: Vec<usize> = of.iter().map(width_of).collect();
    let line = |row: Option<usize>| {
        let cell =
            |(column, width): (&Shown, &usize)| filled(row.map_or(&column.0, |row| &column.1[row]), *width);
        format!("  {}", of.iter().zip(&widths).map(cell).collect::<Vec<_>>().join("  "))
    };
    let rows = of.first().map_or(0, |(_, cells)| cells.len());
    std::iter::once(None).chain((0..rows).map(Some)).map(line).collect()
}

/// The rows; covariances follow in the same lines if these are wide enough, else in lines of their own.
fn write_rows(
    rows: &[Row],
    largest: f64,
    beside: Option<Vec<(&[String], &[f64])>>,
    out: &mut impl Write,
) -> fmt::Result {
    let headings = headings(&rows[0]);
    let labels = headings.len().min(rows[0].values.len());
    let mut cells: Vec<Vec<String>> = vec![Vec::new(); headings.len()];
    for row in rows {
        cells.iter_mut().zip(cells_of(row)).for_each(|(column, cell)| column.push(cell));
    }
    let mut table: Vec<Shown> = headings.into_iter().zip(cells).collect();
    let mut more = beside.map_or_else(Vec::new, |beside| covariances_of(&beside));
    if width(&table) + width(&more) <= WIDTH {
        table.append(&mut more);
    }
    let left = bar_width(width(&table));
    let bars = rows.len() > 1 && left > 0 && largest > 0.0;
    let drawn = |row: &Row| row.p().filter(|_| bars).map(|p| bar(p / largest, left)).unwrap_or_default();
    let bars = std::iter::once(String::new()).chain(rows.iter().map(drawn));
    for (line, bar) in lines(&table).into_iter().zip(bars) {
        writeln!(out, "{}", format!("{line}  {bar}").trim_end())?;
    }
    while !more.is_empty() {
        let fits = |count: &usize| width(&table[..labels]) + width(&more[..*count]) <= WIDTH;
        let count = (1..=more.len()).rev().find(fits).unwrap_or(1);
        let block: Vec<Shown> = table[..labels].iter().cloned().chain(more.drain(..count)).collect();
        writeln!(out)?;
        lines(&block).iter().try_for_each(|line| writeln!(out, "{}", line.trim_end()))?;
    }
    Ok(())
}

/// All rows of a large table, one at a time: their widths, then their lines.
fn write_cells(answer: &Answer, first: &Row, out: &mut impl Write) -> fmt::Result {
    let rows = || (0..answer.answer.len()).filter_map(|at| answer.answer.row_of_cells(at));
    let headings = headings(first);
    let mut widths: Vec<usize> = headings.iter().map(|heading| columns(heading)).collect();
    for row in rows() {
        widths.iter_mut().zip(cells_of(&row)).for_each(|(width, cell)| *width = columns(&cell).max(*width));
    }
    let taken: usize = widths.iter().map(|width| width + 2).sum();
    let (left, largest) = (bar_width(taken), answer.answer.largest_probability());
    let line = |cells: &[String]| {
        let cells: Vec<String> =
            cells.iter().zip(&widths).map(|(cell, width)| filled(cell, *width)).collect();
        format!("  {}", cells.join("  "))
    };
    writeln!(out, "\n{}", line(&headings).trim_end())?;
    for row in rows() {
        let bar = row.p().filter(|_| left > 0 && largest > 0.0).map(|p| bar(p / largest, left));
        writeln!(out, "{}", format!("{}  {}", line(&cells_of(&row)), bar.unwrap_or_default()).trim_end())?;
    }
    write_end(answer, out)
}

/// The width of bars beside columns that take this much of a line; 0 if they would be too narrow.
fn bar_width(taken: usize) -> usize {
    let left = WIDTH.saturating_sub(taken + 2).min(*BARS.end());
    if left >= *BARS.start() { left } else { 0 }
}

/// A column of covariances for each of the reals that are asked together.
fn covariances_of(beside: &[(&[String], &[f64])]) -> Vec<Shown> {
    let column = |(at, name): (usize, &String)| {
        let cells = beside.iter().map(|(_, own)| six_digits(own[at])).collect();
        (format!("{}with {name}", if at == 0 { "covariance " } else { "" }), cells)
    };
    beside[0].0.iter().enumerate().map(column).collect()
}

fn or_word(number: f64, unit: &str) -> String {
    match number.is_finite() {
        true => format!("{}{unit}", six_digits(number)),
        false => word(number).to_owned(),
    }
}

fn cells_of(row: &Row) -> Vec<String> {
    let mut cells: Vec<String> =
        row.values.iter().map(|(_, value)| value.clone()).filter(|value| !value.is_empty()).collect();
    let names: Vec<&str> =
        row.values.iter().filter(|(_, value)| value.is_empty()).map(|(name, _)| name.as_str()).collect();
    if !names.is_empty() {
        cells.push(names.join(" "));
    }
    let estimated = |value: f64, error: f64| format!("{} ± {}", six_digits(value), two_digits(error));
    match row.figure {
        Figure::Probability { p } => cells.push(six_digits(p)),
        Figure::LnProbability { ln_p } => cells.push(six_digits(ln_p)),
        Figure::Density { density } => cells.push(or_word(density, "")),
        Figure::Entropy { entropy, error } => cells.push(match error {
            Some(error) => format!("{} nats", estimated(entropy, error)),
            None => or_word(entropy, " nats"),
        }),
        Figure::Normal { mean, deviation } => {
            cells.push(format!("{} ± {}", six_digits(mean), six_digits(deviation)));
        }
        Figure::Estimated { p, error } => cells.push(estimated(p, error)),
        Figure::Mode { by } => cells.push(by.to_owned()),
        Figure::Draw { draw } => cells.push(draw.to_string()),
        Figure::Expectation { expectation: value, error } | Figure::Variance { variance: value, error } => {
            cells.push(error.map_or_else(|| six_digits(value), |error| estimated(value, error)));
        }
        Figure::Quantile { level, quantile, error } => {
            cells.push(six_digits(level));
            cells.push(error.map_or_else(|| six_digits(quantile), |error| estimated(quantile, error)));
        }
        Figure::Interval { level, interval, errors } => {
            cells.push(six_digits(level));
            let end = |at: usize| match errors {
                Some(errors) => estimated(interval[at], errors[at]),
                None => six_digits(interval[at]),
            };
            cells.extend([end(0), end(1)]);
        }
        Figure::Information { information } => cells.push(or_word(information, " nats")),
        Figure::Divergence { divergence, .. } => cells.push(or_word(divergence, " nats")),
        Figure::Mixture { mean, deviation, quantiles } => {
            cells.extend([mean, deviation].into_iter().chain(quantiles).map(six_digits));
        }
        Figure::Law { law, mean, deviation, quantiles } => {
            cells.push(law.to_string());
            cells.extend([mean, deviation].map(|moment| or_word(moment, "")));
            cells.extend(quantiles.map(six_digits));
        }
        Figure::Real { mean, deviation, quantiles } => {
            cells.push(estimated(mean[0], mean[1]));
            cells.push(six_digits(deviation[0]));
            cells.extend(quantiles.map(|[quantile, _]| six_digits(quantile)));
        }
    }
    cells
}
