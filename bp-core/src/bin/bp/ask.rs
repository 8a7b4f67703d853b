//! `bp ask`: the answer to a question.
//!
//! In: a program, a question, settings. Out: a table with bars, or JSON. Invariant: all answers are known before the
//! first is written.

use crate::failure::Failure;
use crate::settings::{Meaning, Settings};
use crate::{program, table};
use bp_core::answer::{self, Answer};
use bp_core::data::read_table;
use bp_core::error::Error;
use bp_core::ids::VariableId;
use bp_core::kernel::Role;
use bp_core::lower::lower;
use bp_core::model::{Evidence, Form, Model, Question, Reduction, Value};
use bp_core::plan::Route;
use bp_core::sample::{Method, Sampling};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

/// Answers a question.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp ask wet_grass.bp                          every question that the program declares
  bp ask wet_grass.bp rain                     one of them
  bp ask wet_grass.bp 'P(Rain | Wet = true)'   any other
  bp ask wet_grass.bp 'argmax P(Rain Sprinkler | Wet = true)' --json
  bp ask umbrella.bp 'smooth P(Rain | Umbrella)' --data days.csv
  bp ask line_of_sight.bp 'P(Z = z | O C)' \\
      --set N=10 --set Rays=1 --set sigma=0.6 --set z=3

What can be set: parameters (a number, or several with commas between them), the
sizes of sets, and the values that a question leaves open, by their names: labels,
true and false, integers, reals. A set that is a grid takes up to three extents
(`--set Grid=4,3,8`), a set of displacements on it takes `--set V=0,1` or
`--set V=0:0:0,1:0:-1`.")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// `P(…)`, `argmax P(…)`, `max P(…)`, `entropy P(…)`, or the name of a declared question.
    question: Option<String>,
    /// A parameter, a size, or a value that the question leaves open.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    settings: Vec<String>,
    /// What was observed, for a question over time: a CSV file, a row for each
    /// instant; an empty cell was not observed.
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// How many draws, where the answer must be estimated.
    #[arg(long, value_name = "N", default_value_t = Sampling::default().particles, value_parser = particles)]
    particles: usize,
    /// By what draws: `weighting`, or `gibbs` where the evidence is unlikely a priori.
    #[arg(long, value_name = "METHOD", default_value = "weighting", value_parser = method)]
    method: Method,
    /// Where random numbers begin: the same seed gives the same answer.
    #[arg(long, value_name = "N", default_value_t = Sampling::default().seed)]
    seed: u64,
    /// Write the answer as JSON.
    #[arg(long)]
    json: bool,
    /// Show all rows of large tables.
    #[arg(long)]
    all: bool,
}

fn particles(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (1..=100_000_000).contains(count));
    count.ok_or_else(|| "expected a number of draws, from 1 to 100000000".to_owned())
}

fn method(text: &str) -> Result<Method, String> {
    match text {
        "weighting" => Ok(Method::Weighting),
        "gibbs" => Ok(Method::Gibbs),
        _ => Err("expected `weighting` or `gibbs`".to_owned()),
    }
}

fn setting(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => Ok(text.to_owned()),
        _ => Err("expected NAME=VALUE, such as `N=10` or `sigma=0.5,0.6`".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let model = program::linked(&arguments.file)?;
    let questions = program::questions(&model, arguments.question.as_deref())?;
    let settings = Settings::read(&model, &arguments.settings, &names(&model, &questions)?)?;
    let inputs = settings.inputs();
    let sampling =
        Sampling { particles: arguments.particles, seed: arguments.seed, method: arguments.method };
    let mut answers: Vec<Answer> = Vec::new();
    for question in &questions {
        let over_time = question.asks.iter().any(|ask| ask.reduction.is_over_time());
        answers.extend(match &arguments.data {
            Some(path) if over_time => {
                let file = std::fs::File::open(path).map_err(|error| Error::file(path, error))?;
                let instants = answer::read_instants(&model, question, &read_table(path, file)?)?;
                answer::ask_over_time(&model, question, &instants, &inputs, sampling)?
            }
            _ => answer::ask_with(&model, question, &inputs, sampling)?,
        });
    }
    if arguments.json {
        let written = match answers.as_slice() {
            [one] => serde_json::to_writer(&mut *out, one),
            several => serde_json::to_writer(&mut *out, several),
        };
        written.map_err(std::io::Error::from)?;
        writeln!(out)?;
        return Ok(());
    }
    for (position, answer) in answers.iter().enumerate() {
        if position > 0 {
            writeln!(out)?;
        }
        table::write(answer, arguments.all, out)?;
    }
    Ok(())
}

/// Every name that can be set, and what it stands for.
fn names(model: &Model, questions: &[Question]) -> Result<BTreeMap<String, Meaning>, Failure> {
    let mut names = BTreeMap::new();
    for question in questions {
        for route in answer::plan_for_answer(model, question)?.routes {
            let Route::Exact(exact) = route else { continue };
            let kernel = lower(model, &exact, &question.name)?.kernel;
            let inputs = kernel.buffers.values().filter(|buffer| matches!(buffer.role, Role::Input { .. }));
            // `Grid.wraps` comes with the grid.
            let own = inputs.filter(|buffer| !buffer.name.ends_with(".wraps"));
            names.extend(own.map(|buffer| (buffer.name.clone(), Meaning::Field)));
        }
        for ask in &question.asks {
            let searched = ask.searched.iter().filter_map(|item| Some((item.variable, item.at.clone()?)));
            let known = ask.known.iter().filter_map(|known| match &known.evidence {
                Evidence::Hard(value) => Some((known.variable, value.clone())),
                Evidence::Each => given_when_asked(model, known.variable),
                Evidence::Virtual(_) | Evidence::Soft(_) => None,
            });
            for (variable, value) in searched.chain(known) {
                let Value::Given(name) = value else { continue };
                let before = names.insert(name.clone(), Meaning::Value(variable));
                if let Some(Meaning::Value(other)) = before
                    && model.variables[other].domain != model.variables[variable].domain
                {
                    let (one, other) = (model.variable_name(variable), model.variable_name(other));
                    let message = format!(
                        "it stands for values of `{other}` and `{one}`, which have different domains"
                    );
                    return Err(Error::input(name, message).into());
                }
            }
            if let Reduction::Argmax { nearest: Some(field) } = &ask.reduction {
                names.insert(field.clone(), Meaning::Field);
            }
        }
    }
    names.extend(model.sets.iter().map(|(id, set)| (set.name.clone(), Meaning::Set(id))));
    names.extend(model.parameters.iter().map(|(id, it)| (it.name.clone(), Meaning::Parameter(id))));
    Ok(names)
}

/// Known variables without a table are given under their own names, but those whose form asks another program are
/// given through that program's answers.
fn given_when_asked(model: &Model, variable: VariableId) -> Option<(VariableId, Value)> {
    let form = model.factor_of(variable).map(|factor| &model.factors[factor].form);
    let asks = matches!(form, Some(Form::Ask { .. }));
    let given = !asks && !model.variables[variable].domain.is_finite();
    given.then(|| (variable, Value::Given(model.variable_name(variable))))
}
