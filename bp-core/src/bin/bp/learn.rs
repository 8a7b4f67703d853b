//! `bp learn`: the parameters of a program from data.
//!
//! In: a program with `unknown` forms or an `identification`, a table of cases. Out: the learned program, and a report.
//! Invariant: the file is written completely or not at all, and only after it has been read back and checked.

use crate::data::{self, Separator};
use crate::failure::{Failure, colour};
use crate::numbers::six_digits;
use crate::wrap::{WIDTH, filled, wrapped};
use crate::{output, plot, program, rows};
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use bp_core::compiler::learn::{Columns, Learned, Learner, Report, Settings, sizes};
use bp_core::compiler::source::Source;
use bp_core::compiler::spelling::quoted;
use bp_core::compiler::syntax::{compile, graft, parse};
use bp_core::program::settings::{Settings as Given, names};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Learn the parameters of a program from data.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp learn spam.bp --data mails.csv --out learned.bp
  bp learn weights.bp --data weights.csv --hidden Kind --out learned.bp
  bp learn asia.bp --data records.csv --ignore id --weight count --json
  bp learn binaural.bp --data recordings.csv --hidden O --out calibrated.bp
  bp learn weather.bp --data days.csv --sequence station --out learned.bp
  bp learn normal.bp --data lengths.csv --plot normal.png

The first row of the data names the columns: one for each variable, `L[0]`,
`L[1]`, … for the elements of a family, and the index of a program that is
repeated over a set (`C` of `program Binaural over C in Grid`). An empty cell,
`NA`, `NaN` and `?` are missing. Declare a variable without a column as hidden,
by `--hidden` or by `hidden Kind;` in `identification`; ignore a column without
a variable by `--ignore`. Hidden and missing values are summed out by
expectation-maximisation, which stops when both the ln likelihood and every
parameter change by less than the thresholds. If it does not converge within
--iterations, the last parameters are written and the exit status is 1.

The rows of a program over time (one with variables `X^-1`) follow each other:
they form one sequence, or several with `--sequence`. A carried
variable without a column is hidden (Baum-Welch).")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// A table of cases (CSV).
    #[arg(long, value_name = "FILE", required_unless_present = "rows", conflicts_with = "rows")]
    data: Option<PathBuf>,
    /// A table whose rows are the elements of a set of the program: all rows are one case.
    #[arg(long = "rows", value_name = "[SET=]FILE", conflicts_with_all = ["weight", "sequence"])]
    rows: Vec<String>,
    #[command(flatten)]
    separator: Separator,
    /// A variable that has no column; may be repeated.
    #[arg(long, value_name = "VARIABLE")]
    hidden: Vec<String>,
    /// A column to ignore, such as an identifier; may be repeated.
    #[arg(long, value_name = "COLUMN")]
    ignore: Vec<String>,
    /// The column of row weights or counts: each 0, or between 1e-100 and
    /// 1e100.
    #[arg(long, value_name = "COLUMN")]
    weight: Option<String>,
    /// Over time: the column that identifies the sequence of a row.
    #[arg(long, value_name = "COLUMN", conflicts_with = "weight")]
    sequence: Option<String>,
    /// Set a size, or a parameter that is not learned: `Grid=64`,
    /// `tau_max=0.001`. Sizes of families and of the program's own set are
    /// otherwise taken from the data.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Write the learned program to this file; by default the report and the learned forms are printed.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the learning curve, and the learned densities over histograms of the data; PNG or SVG by the extension.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
    /// Random seed of the starting point, if something is hidden.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Maximum number of EM steps, if something is hidden.
    #[arg(long, default_value_t = Settings::default().iterations, value_parser = at_least_one)]
    iterations: usize,
    /// Relative change of the ln likelihood below which EM stops.
    #[arg(long, default_value_t = Settings::default().threshold, value_name = "PART", value_parser = part)]
    threshold: f64,
    /// Relative change of every parameter below which EM stops.
    #[arg(long, default_value_t = Settings::default().tolerance, value_name = "PART", value_parser = part)]
    tolerance: f64,
}

fn part(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| (0.0..f64::INFINITY).contains(number));
    number.ok_or_else(|| "expected a number of at least 0".to_owned())
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|count| *count > 0).ok_or_else(|| "expected 1 or more".to_owned())
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    if let Some(to) = &arguments.out {
        files::check_name(to).map_err(|error| Error::file(to, error))?;
    }
    if let Some(path) = &arguments.plot {
        plot::check_path(path)?;
    }
    let source = program::read(&arguments.file)?;
    let model = match compile(&source) {
        Ok(model) => model,
        Err(wrong) => return Err(Failure::Wrong(wrong, source)),
    };
    let rows =
        rows::read(&model, &arguments.rows, &arguments.settings, &arguments.separator, &arguments.ignore)?;
    let given = Given::read(&model, &arguments.settings, &names(&model))?
        .with_rows(&rows)
        .with_inferred_sizes(&model);
    let table = arguments.data.as_ref().map(|data| data::open(data, &arguments.separator)).transpose()?;
    let learner = match &table {
        Some(table) => {
            let given = sizes(&model, table, given.inputs())?;
            let mut learner = Learner::with(&model, &given)?;
            let columns = Columns {
                hidden: arguments.hidden.clone(),
                ignore: arguments.ignore.clone(),
                weight: arguments.weight.clone(),
                sequence: arguments.sequence.clone(),
            };
            learner.observe_table(table, &columns)?;
            learner
        }
        None => {
            let mut learner = Learner::with(&model, &given.inputs())?;
            learner.observe_rows(&rows, &arguments.hidden)?;
            learner
        }
    };
    let settings = Settings {
        seed: arguments.seed,
        iterations: arguments.iterations,
        threshold: arguments.threshold,
        tolerance: arguments.tolerance,
    };
    let bar = progress(settings.iterations);
    let learned = learner.learned_with(&settings, &mut |iteration, ln_likelihood| {
        bar.set_position(iteration as u64);
        bar.set_message(format!("ln likelihood {}", six_digits(ln_likelihood)));
    });
    bar.finish_and_clear();
    let learned = learned?;
    let text = arguments.out.as_ref().map(|_| program_text(&source, &learned, arguments)).transpose()?;
    // A program is written only beside the picture that was wanted.
    if let Some(path) = &arguments.plot {
        plot::learned(&source, &learned, table.as_ref(), path, out)?;
    }
    if let (Some(to), Some(text)) = (&arguments.out, text) {
        output::write(Some(to), text.as_bytes(), out)?;
    }
    // Where stdout is the program, the report is beside it.
    let beside = arguments.out.as_deref().is_some_and(output::is_stdout);
    let out: &mut dyn Write = if beside { &mut std::io::stderr() } else { out };
    match arguments.json {
        true => {
            serde_json::to_writer(&mut *out, &learned.report).map_err(std::io::Error::from)?;
            writeln!(out)?;
        }
        false => {
            show(&learned.report, arguments, out)?;
            if arguments.out.is_none() {
                show_numbers(&learned, out)?;
            }
        }
    }
    match &learned.report.expectation {
        Some(course) if course.interrupted => {
            let steps = counted(course.steps, "step");
            let to = arguments.out.as_ref();
            let to = to.map_or_else(String::new, |to| format!(", and written to {}", to.display()));
            Err(Failure::Words(format!("interrupted after {steps}: the estimates so far are reported{to}")))
        }
        Some(course) if !course.converged => {
            let steps = counted(course.steps, "step");
            Err(Failure::Words(format!(
                "not converged after {steps}: raise `--iterations`, or `--threshold` and `--tolerance`"
            )))
        }
        _ => Ok(()),
    }
}

/// A progress bar on stderr, if that is a terminal.
fn progress(iterations: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(iterations as u64);
    let plain = if colour(&std::io::stderr()) { "{bar:30.cyan}" } else { "{bar:30}" };
    let style = ProgressStyle::with_template(&format!(
        "{plain} {{pos}}/{{len}} {{msg}}; Ctrl-C stops with the estimates so far"
    ));
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// The author's text with the learned numbers, under a comment that names the data.
fn program_text(source: &Source, learned: &Learned, arguments: &Arguments) -> Result<String, Failure> {
    let wrong = |wrong, text: &str| Failure::Wrong(wrong, Source::new("the learned program", text));
    let text = learned.text();
    let forms = parse(&Source::new("learned", text.as_str())).map_err(|error| wrong(error, &text))?;
    let mut file = parse(source).map_err(|error| wrong(error, &source.text))?;
    if let Some(forms) = forms.programs.first() {
        graft(&mut file, forms);
    }
    let report = &learned.report;
    let paths = arguments.data.iter().map(PathBuf::as_path).chain(
        arguments
            .rows
            .iter()
            .map(|text| Path::new(text.rsplit_once('=').map_or(text.as_str(), |(_, path)| path))),
    );
    let names = paths.map(|path| path.file_name().unwrap_or_default().to_string_lossy().into_owned());
    let name = names.collect::<Vec<_>>().join(", ");
    let mut remark = format!(
        "// Learned from {}: {}, {} missing.",
        name.replace(char::is_control, " "),
        counted(report.cases, "case"),
        counted(report.cells_missing, "cell")
    );
    if !report.hidden.is_empty() {
        let hidden: Vec<_> = report.hidden.iter().map(|name| quoted(name)).collect();
        remark.push_str(&format!(" Hidden: {}.", hidden.join(", ")));
    }
    if let Some(program) = file.programs.last_mut() {
        program.comments.before.retain(|comment| !comment.starts_with("// Learned from "));
        program.comments.before.insert(0, remark);
    }
    let text = file.to_string();
    let read_back = Source::new("the learned program", text.as_str());
    match compile(&read_back) {
        Ok(_) => Ok(text),
        Err(error) => Err(Failure::Wrong(error, read_back)),
    }
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn show(report: &Report, arguments: &Arguments, out: &mut dyn Write) -> Result<(), Failure> {
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
    if let Some(to) = &arguments.out {
        write!(out, "{}", wrapped("", &format!("written to {}", to.display()), 2))?;
    }
    Ok(())
}

/// The most lines of learned numbers beside a report.
const MOST_LINES: usize = 60;

/// The learned forms, as they would stand in the program.
fn show_numbers(learned: &Learned, out: &mut dyn Write) -> Result<(), Failure> {
    let source = Source::new("the learned numbers", learned.text());
    let text = parse(&source).map_err(|wrong| Failure::Wrong(wrong, source))?.to_string();
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
