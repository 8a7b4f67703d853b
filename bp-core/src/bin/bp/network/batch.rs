//! `bp batch`: the posteriors of many cases.
//!
//! In: a network, and a table with a column for each observed variable. Out: a table with a row for each case.
//! Invariant: the file is complete or absent; an impossible case has a row with only the reason in it.

use super::{network, numbered, uai_cases};
use crate::ask::setting;
use crate::data::{self, Separator};
use crate::failure::Failure;
use crate::planning::Inference;
use crate::{output, program};
use bp_core::compiler::answer::{Answer, Figure};
use bp_core::compiler::data::{Records, Value, Values};
use bp_core::compiler::error::Error;
use bp_core::compiler::io::Network;
use bp_core::compiler::model::Known;
use bp_core::compiler::strategies::join_tree::{Named, NetworkEvidence, answer_cases};
use bp_core::program::settings::{Settings, names};
use bp_core::program::{Evidence, Program};
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Compute the posteriors of many cases, one row for each.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp batch asia.bif --cases cases.csv --out posteriors.csv
  bp batch asia.bif --cases cases.csv --only lung,tub

The first row of the cases names the observed variables; an empty cell, `NA`,
`NaN` and `?` are not observed. Columns that name no variable are refused. Each
row of the output has `ln_p_evidence`, then a column `variable=value` for each
value, and `variable.mean` and `variable.deviation` for each real.")]
pub(crate) struct Arguments {
    /// A network (.bif, .xml, .uai, .net) or a program (.bp).
    #[arg(value_name = "NETWORK")]
    file: PathBuf,
    /// The cases: a table (CSV), or a UAI evidence file (.evid).
    #[arg(long, value_name = "FILE")]
    cases: PathBuf,
    #[command(flatten)]
    separator: Separator,
    /// Set a parameter, or the size of a set, of a program; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    settings: Vec<String>,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Only these variables.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    only: Vec<String>,
    #[command(flatten)]
    inference: Inference,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let is_uai = arguments.cases.extension().is_some_and(|end| end.eq_ignore_ascii_case("evid"));
    let table = if is_uai { None } else { Some(data::open(&arguments.cases, &arguments.separator)?) };
    let program = crate::program::linked(&arguments.file)?;
    let finite = program.model.variables.values().all(|variable| variable.domain.is_finite());
    if let (Some(table), true) = (&table, !finite || arguments.inference.is_chosen()) {
        return planned(arguments, program, table, out);
    }
    let (named, network) = network(&arguments.file, table.as_ref(), &arguments.settings)?;
    let cases = match &table {
        None => uai(&named, &network, &arguments.cases)?,
        Some(table) => cases(&named, table)?,
    };
    let wanted: Vec<usize> = match arguments.only.is_empty() {
        true => named.shown(),
        false => arguments.only.iter().map(|name| named.number_of(name)).collect::<Result<_, _>>()?,
    };
    let bar = progress(cases.len());
    let answers = answer_cases(&named.network, &cases, &wanted, || bar.inc(1))
        .map_err(|error| named.with_names(error))?;
    bar.finish_and_clear();
    let values = wanted.iter().flat_map(|one| {
        let name = named.variable(*one);
        let named = &named;
        (0..named.network.cardinalities[*one])
            .map(move |value| format!("{name}={}", named.value(*one, value)))
    });
    let heading: Vec<String> =
        ["ln_p_evidence".to_owned()].into_iter().chain(values).chain(["error".to_owned()]).collect();
    let rows = answers.into_iter().map(|answer| match answer {
        Ok(found) => {
            let numbers = [found.ln_evidence + named.ln_scale].into_iter().chain(found.marginals);
            Ok(numbers.map(|number| number.to_string()).collect())
        }
        Err(error) => Err(named.with_names(error).to_string()),
    });
    write(arguments, &heading, rows.collect(), out)
}

/// Writes a row for each case: its numbers, or the reason why it has no answer.
fn write(
    arguments: &Arguments,
    heading: &[String],
    rows: Vec<Result<Vec<String>, String>>,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let (count, mut wrong) = (rows.len(), 0);
    let mut page = csv::Writer::from_writer(Vec::new());
    let failure = |error: csv::Error| Failure::Output(std::io::Error::other(error));
    page.write_record(heading).map_err(failure)?;
    for row in rows {
        let (mut cells, reason) = match row {
            Ok(cells) => (cells, String::new()),
            Err(reason) => (Vec::new(), reason),
        };
        wrong += usize::from(!reason.is_empty());
        cells.resize(heading.len() - 1, String::new());
        cells.push(reason);
        page.write_record(&cells).map_err(failure)?;
    }
    let page =
        page.into_inner().map_err(|error| Failure::Output(std::io::Error::other(error.to_string())))?;
    output::write(arguments.out.as_deref(), &page, out)?;
    if wrong > 0 {
        let message = format!("{wrong} of {count} cases have no answer; their rows give the reasons");
        return Err(Failure::Words(message));
    }
    Ok(())
}

/// The cases of a program with reals, or with a chosen strategy: each is a question to the planner.
fn planned(
    arguments: &Arguments,
    network: Network,
    table: &Records,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let settings = Settings::read(&network.model, &arguments.settings, &names(&network.model))?;
    let program = arguments.inference.of(Program::of_network(network)?.with_all(settings));
    let model = program.model();
    let mut columns = Vec::new();
    for name in &table.columns {
        let plain = name.split('[').next().unwrap_or(name).trim();
        let id = model.variable(name).or_else(|| model.variable(plain)).ok_or_else(|| {
            Failure::Words(format!("column `{name}`: `{}` has no variable of this name", program.name()))
        })?;
        columns.push((name, id, Values::new(model, id, &|_| None)));
    }
    let bar = progress(table.len());
    let mut heading: Vec<String> = vec!["ln_p_evidence".to_owned()];
    let mut rows: Vec<Result<HashMap<String, String>, String>> = Vec::new();
    for row in 0..table.len() {
        let mut evidence = Evidence::new();
        for (column, (name, id, values)) in columns.iter().enumerate() {
            match table.cell(row, column, values)? {
                Some(Value { ordinal: Some(ordinal), .. }) => {
                    evidence.set((*name).clone(), model.value_name(*id, ordinal))
                }
                Some(value) => evidence.set((*name).clone(), value.number),
                None => {}
            }
        }
        rows.push(match program.marginals_of(&arguments.only, &evidence) {
            Ok(found) => Ok(cells(found.answer(), &mut heading)),
            Err(error) => Err(error.to_string()),
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let in_order = |cells: HashMap<String, String>| {
        heading.iter().map(|name| cells.get(name).cloned().unwrap_or_default()).collect()
    };
    let rows = rows.into_iter().map(|row| row.map(in_order)).collect();
    heading.push("error".to_owned());
    write(arguments, &heading, rows, out)
}

/// The numbers of an answer by the names of their columns; new columns are added to the heading.
fn cells(answer: &Answer, heading: &mut Vec<String>) -> HashMap<String, String> {
    let ln_evidence = answer.ln_evidence.unwrap_or(0.0);
    let mut all = HashMap::from([("ln_p_evidence".to_owned(), ln_evidence.to_string())]);
    let mut add = |name: String, number: f64| {
        if !heading.contains(&name) {
            heading.push(name.clone());
        }
        all.insert(name, number.to_string());
    };
    for row in &answer.answer {
        let Some((name, value)) = row.values.last() else { continue };
        match row.figure {
            Figure::Probability { p } | Figure::Estimated { p, .. } => add(format!("{name}={value}"), p),
            Figure::Normal { mean, deviation } | Figure::Mixture { mean, deviation, .. } => {
                add(format!("{name}.mean"), mean);
                add(format!("{name}.deviation"), deviation);
            }
            Figure::Real { mean, deviation, .. } => {
                add(format!("{name}.mean"), mean[0]);
                add(format!("{name}.deviation"), deviation[0]);
            }
            _ => {}
        }
    }
    all
}

/// A progress bar, which is hidden if stderr is not a terminal.
fn progress(cases: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} cases, {eta} left");
    let bar = ProgressBar::new(cases as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// The evidence of each case of a UAI file.
fn uai(named: &Named, network: &Network, path: &Path) -> Result<Vec<NetworkEvidence>, Failure> {
    let always = named.evidence([], [])?;
    let cases = uai_cases(&program::read(path)?, network)?;
    let one = |case: &Vec<Known>| {
        let mut evidence = always.clone();
        evidence.hard.extend(numbered(named, network, case)?);
        Ok(evidence)
    };
    cases.iter().map(one).collect()
}

/// The evidence of each row.
fn cases(named: &Named, table: &Records) -> Result<Vec<NetworkEvidence>, Error> {
    let columns: Vec<(usize, Values<'_>)> = (table.columns.iter())
        .map(|name| named.number_of(name).map(|variable| (variable, named.values(variable))))
        .collect::<Result<_, _>>()?;
    let always = named.evidence([], [])?;
    (0..table.len())
        .map(|row| {
            let mut evidence = always.clone();
            for (column, (variable, values)) in columns.iter().enumerate() {
                if let Some(value) = table.cell(row, column, values)?.and_then(|value| value.ordinal) {
                    evidence.hard.push((*variable, value));
                }
            }
            Ok(evidence)
        })
        .collect()
}
