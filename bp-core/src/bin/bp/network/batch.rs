//! `bp batch`: the posteriors of many cases.
//!
//! In: a network, and a table with a column for each observed variable. Out: a table with a row for each case.
//! Invariant: the file is complete or absent; an impossible case has a row with only the reason in it.

use super::{named_values, uai_cases};
use crate::ask::setting;
use crate::data::{self, Separator};
use crate::failure::Failure;
use crate::planning::Inference;
use crate::{output, program};
use bp_core::compiler::data::{Records, read_table};
use bp_core::compiler::io::Network;
use bp_core::program::settings::{Settings, names};
use bp_core::program::{Cases, Program};
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
`NaN` and `?` are not observed. Columns that name no variable are refused; --ignore
leaves one out. Each row of the output has `ln_p_evidence`, then a column
`variable=value` for each value, and `variable.mean` and `variable.deviation`
for each real.")]
pub(crate) struct Arguments {
    /// A network (.bif, .xml, .uai, .net) or a program (.bp).
    #[arg(value_name = "NETWORK")]
    file: PathBuf,
    /// The cases: a table (CSV), or a UAI evidence file (.evid).
    #[arg(long, value_name = "FILE")]
    cases: PathBuf,
    /// Columns of the table to ignore; may be repeated.
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',')]
    ignore: Vec<String>,
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
    let network = program::network(&arguments.file, program::format_of(&arguments.file)?)?;
    let records = match table {
        Some(table) => table.without(&arguments.ignore)?,
        None => uai(&network, &arguments.cases)?,
    };
    let settings = Settings::read(&network.model, &arguments.settings, &names(&network.model))?;
    let program = arguments.inference.of(Program::of_network(network)?.with_all(settings));
    let bar = progress(records.len());
    let cases = Cases::of_records(records).only(arguments.only.iter());
    let batch = program.batch_with(&cases, || bar.inc(1))?;
    bar.finish_and_clear();
    let count = batch.rows.len();
    let mut wrong = 0;
    let mut page = csv::Writer::from_writer(Vec::new());
    let failure = |error: csv::Error| Failure::Output(std::io::Error::other(error));
    page.write_record(batch.columns.iter().map(String::as_str).chain(["error"])).map_err(failure)?;
    for row in batch.rows {
        let mut cells = vec![String::new(); batch.columns.len() + 1];
        match row {
            Ok(numbers) => {
                for (cell, number) in cells.iter_mut().zip(numbers).filter(|(_, number)| !number.is_nan()) {
                    *cell = number.to_string();
                }
            }
            Err(error) => {
                wrong += 1;
                cells[batch.columns.len()] = error.to_string();
            }
        }
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

/// A progress bar, which is hidden if stderr is not a terminal.
fn progress(cases: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} cases, {eta} left");
    let bar = ProgressBar::new(cases as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// The cases of a UAI evidence file, as a table.
fn uai(network: &Network, path: &Path) -> Result<Records, Failure> {
    let cases = uai_cases(&program::read(path)?, network)?;
    let cases: Vec<HashMap<String, String>> = (cases.iter())
        .map(|case| Ok(named_values(network, case)?.into_iter().collect()))
        .collect::<Result<_, Failure>>()?;
    let mut columns: Vec<&String> = cases.iter().flat_map(HashMap::keys).collect();
    columns.sort_unstable();
    columns.dedup();
    // Without any observation a column without values stands for the cases.
    let first = network.model.variables.values().next().map(|variable| &variable.name);
    if columns.is_empty() {
        columns.extend(first);
    }
    let mut page = csv::Writer::from_writer(Vec::new());
    let failure = |error: csv::Error| Failure::Output(std::io::Error::other(error));
    page.write_record(&columns).map_err(failure)?;
    for case in &cases {
        page.write_record(columns.iter().map(|name| case.get(*name).map_or("", String::as_str)))
            .map_err(failure)?;
    }
    let page =
        page.into_inner().map_err(|error| Failure::Output(std::io::Error::other(error.to_string())))?;
    Ok(read_table(path, page.as_slice())?)
}
