//! `bp learn`: the parameters of a program from data.
//!
//! In: a program with `unknown` forms or an `identification`, a table of cases. Out: the learned program, and a report.
//! Invariant: the file is written completely or not at all, and only after it has been read back and checked.

use crate::data::{self, Separator};
use crate::failure::{Failure, colour};
use crate::learned::{counted, show, show_numbers};
use crate::numbers::six_digits;
use crate::{output, plot, program, rows};
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use bp_core::compiler::ids::VariableId;
use bp_core::compiler::learn::{Columns, Learned, Learner, Settings, sizes};
use bp_core::compiler::model::{IndexSpace, Model};
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
    /// Columns of the table to ignore; may be repeated.
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',')]
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
            let mut learner = Learner::with(&model, &given).map_err(|error| of_columns(&model, error))?;
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
            show(&learned.report, arguments.out.as_deref(), out)?;
            if arguments.out.is_none() {
                show_numbers(&source, &learned, out)?;
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

/// The error of a size that is not given, where the columns of a family would tell it.
fn of_columns(model: &Model, error: Error) -> Error {
    let Error::Input { name, message } = &error else { return error };
    let is_over = |id: &VariableId| match model.variables[*id].family.map(|family| family.over) {
        Some(IndexSpace::Set(set)) => model.sets[set].name == *name,
        Some(IndexSpace::Range(range)) => {
            range.high.size.is_some_and(|size| model.parameters[size].name == *name)
        }
        None => false,
    };
    match model.variables.ids().find(is_over) {
        Some(id) if message.contains("size was not given") => {
            let (family, first) =
                (model.spelled(id), model.variables[id].family.map_or(0, |it| it.over.first()));
            let message = format!(
                "its size is that of the columns of the family `{family}`, and there are none: they are named `{family}[{first}]`, \
                 `{family}[{}]`, …",
                first + 1
            );
            Error::input(name, message)
        }
        _ => error,
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
