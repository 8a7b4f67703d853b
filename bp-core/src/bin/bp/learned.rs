//! The report of learning, as text.
//!
//! In: what was learned. Out: figures form by form, remarks, and the learned forms as they would stand in the program. Invariant: a
//! long head has a line of its own, so that the figures stay aligned.

use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::wrap::{WIDTH, filled, wrapped};
use bp_core::compiler::learn::{Learned, Report};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{learned_part, parse};
use std::io::Write;
use std::path::Path;

pub(crate) fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

pub(crate) fn show(report: &Report, to: Option<&Path>, out: &mut dyn Write) -> Result<(), Failure> {
    let mut facts = vec![
        counted(report.cases, "case"),
        format!("{} missing", counted(report.cells_missing, "cell")),
        format!("ln likelihood {}", six_digits(report.ln_likelihood)),
    ];
    if let Some(weight) = report.weight {
        facts.insert(1, format!("weight {}", bp_core::compiler::spelling::number(weight)));
    }
    if !report.hidden.is_empty() {
        facts.push(format!("hidden: {}", report.hidden.join(", ")));
    }
    if let Some(course) = &report.expectation {
        let end = match (course.converged, course.held) {
            (true, true) => "converged: a further step would lower ln likelihood",
            (true, false) => "converged",
            (false, _) if course.interrupted => "interrupted",
            (false, _) => "not converged",
        };
        facts.push(format!("{}, {end}", counted(course.steps, "step")));
        if course.drawn {
            facts.push(format!(
                "the initial values are from seed {}: another `--seed` may find a higher likelihood",
                course.seed
            ));
        }
    }
    write!(out, "{}", wrapped("", &facts.join("; "), 2))?;
    writeln!(out)?;
    let headings = ["form", "learned by", "parameters", "contexts", "empty", "ln likelihood"];
    let rows: Vec<[String; 6]> = (report.forms.iter())
        .map(|form| {
            [
                form.form.clone(),
                form.learned.clone(),
                form.parameters.to_string(),
                form.contexts.to_string(),
                form.empty.to_string(),
                six_digits(form.ln_likelihood),
            ]
        })
        .collect();
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.chain([headings[column].len()]).max().unwrap_or(0)
    };
    let figures: usize = (2..6).map(|column| width(column) + 2).sum();
    let learned = width(1).min(20);
    // A long head has a line of its own.
    let head = width(0).min(WIDTH.saturating_sub(figures + learned + 4));
    let mut line = |cells: [&str; 6]| -> std::io::Result<()> {
        let mut text = format!("  {}", filled(cells[0], head));
        if cells[0].chars().count() > head {
            write!(out, "{}", wrapped("  ", cells[0], 4))?;
            text = format!("  {}", " ".repeat(head));
        }
        let way: String = cells[1].chars().take(learned).collect();
        text.push_str(&format!("  {}", filled(&way, learned)));
        for (column, cell) in cells.iter().enumerate().skip(2) {
            text.push_str(&format!("  {cell:>width$}", width = width(column)));
        }
        writeln!(out, "{}", text.trim_end())
    };
    line(headings)?;
    for row in &rows {
        line([0, 1, 2, 3, 4, 5].map(|column| row[column].as_str()))?;
    }
    for form in &report.forms {
        let mut remarks = Vec::new();
        if !form.shared.is_empty() {
            let names: Vec<String> = form.shared.iter().map(|(name, _)| format!("`{name}`")).collect();
            let by: Vec<&str> = form.shared.iter().map(|(name, _)| name.as_str()).collect();
            let count: usize = form.shared.iter().map(|(_, count)| count).product();
            remarks.push(format!(
                "one form for all {count} values of {}: their cases are pooled; `unknown by {}` learns one for each",
                names.join(" and "),
                by.join(" ")
            ));
        }
        if form.components > 1 {
            remarks.push(format!(
                "one form for all {} components: their values are pooled; declare a variable for each to learn one for each",
                form.components
            ));
        }
        if form.empty > 0 {
            remarks.push(format!("no cases for {}: {}", counted(form.empty, "context"), empty(form)));
        }
        if form.floored > 0 {
            let few = counted(form.floored, "context");
            remarks.push(format!(
                "the values of {few} are equal, or most of their weight is: the distribution is at its floor (floored)"
            ));
        }
        if form.limited > 0 {
            let few = counted(form.limited, "context");
            remarks.push(format!(
                "the likelihood of {few} rises up to the limit of a parameter, which is the estimate (limited)"
            ));
        }
        for remark in remarks {
            write!(out, "{}", wrapped("  ", &format!("{}: {remark}", form.form), 4))?;
        }
    }
    if let Some(to) = to {
        write!(out, "{}", wrapped("", &format!("written to {}", to.display()), 2))?;
    }
    Ok(())
}

/// The most lines of learned numbers beside a report.
const MOST_LINES: usize = 60;

/// The learned forms, as they would stand in the program.
pub(crate) fn show_numbers(source: &Source, learned: &Learned, out: &mut dyn Write) -> Result<(), Failure> {
    let numbers = Source::new("the learned numbers", learned.text());
    let mut text = parse(&numbers).map_err(|wrong| Failure::Wrong(wrong, numbers))?;
    if let (Ok(file), Some(program)) = (parse(source), text.programs.last_mut()) {
        *program = learned_part(&file, program);
    }
    let text = text.to_string();
    let text = text.replace("    parameters {\n    }\n", "");
    let lines: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("    ")).collect();
    writeln!(out)?;
    for line in lines.iter().take(MOST_LINES) {
        writeln!(out, "  {line}")?;
    }
    if let Some(more) = lines.len().checked_sub(MOST_LINES).filter(|more| *more > 0) {
        writeln!(out, "  … {}: `--out` writes them all", counted(more, "more line"))?;
    }
    Ok(())
}

/// The estimate of a context without cases.
fn empty(form: &bp_core::compiler::learn::FormReport) -> &'static str {
    match form.learned.as_str() {
        way if way.ends_with("prior") || way.starts_with("beta(") || way.starts_with("dirichlet(") => {
            "the mean of the prior"
        }
        "laplace_succession" | "histogram" => "uniform",
        "parameters" => "the previous parameters, or uniform",
        _ => "the distribution of all cases",
    }
}
