//! `bp ask`: the answer to a question.
//!
//! In: a program, a question, settings. Out: a table with bars, or JSON. Invariant: all answers are known before the
//! first is written; of several questions each is answered or refused by itself.

use crate::answered::{
    Refused, one_or_several, write_answers, write_answers_json, write_cases, write_json, write_sequences,
};
use crate::data::{self, Separator};
use crate::failure::Failure;
use crate::planning::Inference;
use crate::rows::{self, RowTables};
use crate::{cases, over_time, plot, program};
use bp_core::compiler::answer::{
    Answer, CompiledQuestion, OtherColumns, Table, compile_by, compile_sized, filled, open,
};
use bp_core::compiler::data::PlateData;
use bp_core::compiler::error::Error;
use bp_core::compiler::ids::VariableId;
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Options, Strategy, plan_for_answer};
use bp_core::compiler::progress;
use bp_core::program::settings::{Meaning, Settings, names_of};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::PathBuf;

/// Answer a question.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp ask wet_grass.bp                          every declared question
  bp ask wet_grass.bp rain                     one of them
  bp ask wet_grass.bp 'P(Rain | Wet = true)'   any other
  bp ask wet_grass.bp 'argmax P(Rain Sprinkler | Wet = true)' --json
  bp ask umbrella.bp 'smooth P(Rain | Umbrella)' --data days.csv
  bp ask umbrella.bp 'filter P(Rain | Umbrella)' --data days.csv --sequence town
  bp ask line_of_sight.bp 'P(Z = z | O C)' \\
      --set N=10 --set Rays=1 --set sigma=0.6 --set z=3
  bp ask wet_grass.bp 'draw(10) P(Rain | Wet)' --set Wet=true --seed 7
  bp ask wet_grass.bp rain --table             the whole conditional table
  bp ask wet_grass.bp rain --data lawns.csv    an answer for each row
  bp ask line.bp 'P(A, B)' --rows points.csv   all rows are evidence
  bp ask line.bp --rows points.csv --fill filled.csv
  bp ask wet_grass.bp rain --plot rain.png     a picture too

--set gives a value to a parameter (a number, or several separated by commas), to
the size of a set, or to a variable that the question leaves open, named by its
own name or by the name in the question (a label, true, false, an integer or a
real). The size of a grid has up to three extents (`--set Grid=4,3,8`); a set of
displacements on it is written `--set V=0,1` or `--set V=0:0:0,1:0:-1`.

--table prints one number per line. The searched variables vary fastest, then the
known variables, the last one fastest. An impossible context is all zeros.

--data reads a table with commas, semicolons or tabs. Its first row names the
columns; each row gives values to the variables that the question leaves open.
An empty cell, `NA`, `NaN` and `?` are missing values. Over time each row is an
instant, and each column is a variable of the program, the column of --sequence,
or a column of --ignore.

--rows reads a table whose rows are the elements of a set of the program, or of
a range `1..=N`: a column named as a field gives its numbers, a column named as
a family is evidence where its cells have values. `P(Y)` then asks for the
missing cells of `Y`; --fill writes the table with the most likely values in
them.")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    pub(crate) file: PathBuf,
    /// A question such as `P(X | Y = 1)`, `argmax P(X | Y)` or `entropy P(X)`, or the name of a declared one; all declared questions if left out.
    pub(crate) question: Option<String>,
    /// Set a parameter, a size, or a value that the question leaves open; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    pub(crate) settings: Vec<String>,
    #[command(flatten)]
    pub(crate) inference: Inference,
    /// Answer for each row of a table (CSV); for a question over time the rows are instants.
    #[arg(long, value_name = "FILE", conflicts_with = "table")]
    data: Option<PathBuf>,
    /// Over time: the column that identifies the sequence of a row; sequences are answered separately.
    #[arg(long, value_name = "COLUMN")]
    sequence: Option<String>,
    /// Columns of the table to ignore; may be repeated.
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',')]
    pub(crate) ignore: Vec<String>,
    #[command(flatten)]
    pub(crate) separator: Separator,
    #[command(flatten)]
    pub(crate) rows: RowTables,
    /// Print the whole conditional table, numbers only.
    #[arg(long, requires = "question", conflicts_with = "all")]
    table: bool,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    /// Show all rows of large tables.
    #[arg(long)]
    all: bool,
    /// Over time: answer `filter` after each row, and not after the last one alone.
    #[arg(long, requires = "data")]
    each: bool,
    /// Draw the answers too: bars, densities, courses over time, heat maps; PNG or SVG by the extension.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["table", "fill"])]
    plot: Option<PathBuf>,
}

/// A setting, `NAME=VALUE`.
pub(crate) fn setting(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => Ok(text.to_owned()),
        _ => Err("expected NAME=VALUE, such as `N=10` or `sigma=0.5,0.6`".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    if arguments.rows.fills() {
        return rows::fill(arguments, out);
    }
    let mut network = program::linked(&arguments.file)?;
    let rows =
        arguments.rows.read(&network.model, &arguments.settings, &arguments.separator, &arguments.ignore)?;
    rows.name_elements(&mut network.model);
    let asked = program::questions_of_rows(&mut network, arguments.question.as_deref(), &rows)?;
    let model = network.model;
    let asked = asked.iter().map(|asked| set(&model, asked, &arguments.settings));
    let over_time = |question: &Question| question.asks.iter().any(|ask| ask.when.is_over_time());
    // The columns of data give values to what the question leaves open.
    let by_columns = |question: &Question, is_given: &dyn Fn(&VariableId) -> bool| match arguments
        .data
        .is_some()
        && !over_time(question)
    {
        true => {
            filled(&model, question, &open(question).into_iter().filter(is_given).collect(), &BTreeSet::new())
        }
        false => question.clone(),
    };
    // A family whose length is not known has no table; its columns determine the length.
    let is_family = |id: &VariableId| model.variables[*id].family.is_some();
    let options = Options { each: arguments.each, ..arguments.inference.options() };
    let compile = |question: &Question| match rows.is_empty() {
        true => {
            let by_families = by_columns(question, &is_family);
            compile_by(&model, &by_families, options)
                .or_else(|_| compile_sized(&model, &by_families, options))
                .or_else(|error| {
                    // Without values there may be no table.
                    let given = by_columns(question, &|_| true);
                    compile_sized(&model, &given, options).map_err(|_| error)
                })
        }
        false => compile_sized(&model, question, options),
    };
    let mut refused = Refused::default();
    let (mut questions, mut compiled) = (Vec::new(), Vec::new());
    for question in asked {
        match compile(&question) {
            Ok(own) => {
                compiled.push(own);
                questions.push(question);
            }
            Err(error) => refused.add(model.ask_text(&question.asks[0]), error),
        }
    }
    if compiled.is_empty() {
        return refused.after(Ok(()));
    }
    let answered = answer(arguments, &model, (&questions, &compiled), (&rows, options), &mut refused, out);
    refused.after(answered)
}

/// Answers compiled questions; those without an answer are added to the refused ones.
fn answer(
    arguments: &Arguments,
    model: &Model,
    (questions, compiled): (&[Question], &[CompiledQuestion<'_>]),
    (rows, options): (&PlateData, Options),
    refused: &mut Refused,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let over_time = |question: &Question| question.asks.iter().any(|ask| ask.when.is_over_time());
    progress::advise(advice(model, compiled, questions, options));
    let names = names_of(model, compiled)?;
    let settings =
        Settings::read(model, &arguments.settings, &names)?.with_rows(rows).with_inferred_sizes(model);
    let sampling = arguments.inference.sampling();
    if let (Some(path), true) = (&arguments.data, questions.iter().any(over_time)) {
        let table = data::open(path, &arguments.separator)?;
        let others = OtherColumns { sequence: arguments.sequence.clone(), ignore: arguments.ignore.clone() };
        let by = (sampling, options);
        let sequences = over_time::answers(model, questions, &table, &others, &settings, by)?;
        data::note_unread(model, questions, &table, &others);
        let how = (arguments.json, arguments.all);
        let column = arguments.sequence.as_deref();
        let titled: Vec<Answer> =
            sequences.iter().flat_map(|(name, answers)| titled(column, name, answers)).collect();
        let drawn = draw(arguments, model, titled.iter(), out);
        write_sequences(&sequences, arguments.sequence.as_deref(), how, out)?;
        return drawn;
    }
    let has_no_table = rows.is_empty() && arguments.data.is_none();
    if let (Some(question), true) =
        (questions.first(), arguments.sequence.is_some() || has_no_table && !arguments.ignore.is_empty())
    {
        let text = model.ask_text(&question.asks[0]);
        let message = "`--sequence` applies to questions over time, with `--data`, and `--ignore` to `--data` or `--rows`";
        return Err(Error::input(text, message).into());
    }
    if let Some(path) = &arguments.data {
        let table = data::open(path, &arguments.separator)?.without(&arguments.ignore)?;
        let cases = cases::answers(model, questions, &table, &settings, (sampling, options))?;
        data::note_unread(model, questions, &table, &OtherColumns::default());
        let has_instants = model.variables.values().any(|variable| variable.previous_of.is_some());
        if let (Some(question), true) = (questions.first(), has_instants) {
            let text = model.ask_text(&question.asks[0]);
            program::warn(&format!(
                "note: each row is answered alone; for a series of instants write `filter {text}` or `smooth {text}`"
            ));
        }
        let answered = cases.iter().filter_map(|(_, answers)| answers.as_ref().ok());
        let drawn = draw(arguments, model, answered.flatten(), out);
        write_cases(&cases, (arguments.json, arguments.all), out)?;
        return drawn;
    }
    let inputs = settings.inputs();
    if arguments.table {
        let mut tables: Vec<Table> = Vec::new();
        for question in compiled {
            tables.extend(question.tables(&inputs)?);
        }
        return write_tables(&tables, arguments.json, out);
    }
    let mut answers: Vec<Answer> = Vec::new();
    for question in compiled {
        match question.ask_filled(&inputs, sampling) {
            Ok(own) => answers.extend(own),
            Err(error) => {
                let asked = model.ask_text(&question.question().asks[0]);
                refused.add(asked, not_given(model, &names, error));
            }
        }
        if progress::is_stopped() {
            break;
        }
    }
    let drawn = draw(arguments, model, answers.iter(), out);
    match arguments.json {
        true => write_answers_json(&answers, refused, out)?,
        false => write_answers(&answers, arguments.all, out)?,
    }
    drawn
}

/// What makes an answer exact that is estimated: the reason of the closed form's refusal, where it says what to declare.
fn advice(
    model: &Model,
    compiled: &[CompiledQuestion<'_>],
    questions: &[Question],
    options: Options,
) -> Option<String> {
    let estimated = compiled.iter().zip(questions).filter(|(compiled, _)| compiled.is_estimated());
    let plans = estimated.filter_map(|(_, question)| plan_for_answer(model, question, options).ok());
    let refusals = plans.flat_map(|plan| plan.offers).flatten();
    let mut of_closed_form = refusals.filter(|offer| offer.strategy == Strategy::Conjugate);
    of_closed_form.find_map(|offer| offer.refusal.filter(|why| why.contains("declare")))
}

/// The answers of a sequence, with its name beside the question.
fn titled(column: Option<&str>, name: &str, answers: &cases::Answered) -> Vec<Answer> {
    let mut answers = answers.as_ref().ok().cloned().unwrap_or_default();
    if let Some(column) = column {
        answers
            .iter_mut()
            .for_each(|answer| answer.question = format!("{}, {column} {name}", answer.question));
    }
    answers
}

/// Draws the answers, if a picture is wanted; they are written also where there is none.
fn draw<'a>(
    arguments: &Arguments,
    model: &Model,
    answers: impl Iterator<Item = &'a Answer>,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let Some(path) = &arguments.plot else { return Ok(()) };
    let drawn: Vec<Answer> = answers.cloned().collect();
    plot::answers(model, &drawn, path, out)
}

/// The error that a value was not given, with its variable: what was meant as a value may be read as a name of one.
fn not_given(model: &Model, names: &BTreeMap<String, Meaning>, error: Error) -> Error {
    match &error {
        Error::Input { name, message } if message.starts_with("it was not given") => match names.get(name) {
            Some(Meaning::Value(variable)) => {
                let domain = &model.variables[*variable].domain;
                let (of, text) = (model.variable_name(*variable), model.domain_text(domain));
                let message = format!(
                    "it was not given: `{name}` names a value of `{of}`, which is `{text}`; `--set {name}=…` gives it"
                );
                Error::input(name, message)
            }
            _ => error,
        },
        _ => error,
    }
}

/// The question with the settings that bear the names of open variables as known values.
pub(crate) fn set(model: &Model, question: &Question, settings: &[String]) -> Question {
    let open = open(question).into_iter();
    let is_set = |id: &VariableId| {
        let name = model.variable_name(*id);
        settings.iter().filter_map(|text| text.split_once('=')).any(|(known, _)| known.trim() == name)
    };
    filled(model, question, &open.filter(is_set).collect(), &BTreeSet::new())
}

fn write_tables(tables: &[Table], json: bool, out: &mut impl Write) -> Result<(), Failure> {
    if json {
        return write_json(&one_or_several(tables), out);
    }
    for (position, table) in tables.iter().enumerate() {
        if position > 0 {
            writeln!(out)?;
        }
        for number in &table.numbers {
            writeln!(out, "{number}")?;
        }
    }
    Ok(())
}
