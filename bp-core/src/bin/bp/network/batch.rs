//! `bp batch`: the posteriors of many cases.
//!
//! In: a network, and a table with a column for each observed variable. Out: a table with a row for each case.
//! Invariant: the file is complete or absent; an impossible case has a row with only the reason in it.

use super::{network, numbered, uai_cases};
use crate::ask::setting;
use crate::data::{self, Separator};
use crate::failure::Failure;
use crate::{output, program};
use bp_core::compiler::data::{Records, Values};
use bp_core::compiler::error::Error;
use bp_core::compiler::io::Network;
use bp_core::compiler::model::Known;
use bp_core::compiler::strategies::join_tree::{Named, NetworkEvidence, answer_cases};
use indicatif::{ProgressBar, ProgressStyle};
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
value.")]
pub(crate) struct Arguments {
    /// A network (.bif, .xml, .uai, .net) or a program (.bp) whose variables are all finite.
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
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let is_uai = arguments.cases.extension().is_some_and(|end| end.eq_ignore_ascii_case("evid"));
    let table = if is_uai { None } else { Some(data::open(&arguments.cases, &arguments.separator)?) };
    let (named, network) = network(&arguments.file, table.as_ref(), &arguments.settings)?;
    let cases = match &table {
        None => uai(&named, &network, &arguments.cases)?,
        Some(table) => cases(&named, table)?,
    };
    let wanted: Vec<usize> = match arguments.only.is_empty() {
        true => named.shown(),
        false => arguments.only.iter().map(|name| named.number_of(name)).collect::<Result<_, _>>()?,
    };
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} cases, {eta} left");
    // Hidden if stderr is not a terminal.
    let bar = ProgressBar::new(cases.len() as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let answers =
        answer_cases(&named.network, &cases, &wanted, || bar.inc(1)).map_err(|error| named.tell(error))?;
    bar.finish_and_clear();
    let mut page = csv::Writer::from_writer(Vec::new());
    let told = |error: csv::Error| Failure::Output(std::io::Error::other(error));
    let values = wanted.iter().flat_map(|one| {
        let name = named.variable(*one);
        let named = &named;
        (0..named.network.cardinalities[*one])
            .map(move |value| format!("{name}={}", named.value(*one, value)))
    });
    let heading: Vec<String> =
        ["ln_p_evidence".to_owned()].into_iter().chain(values).chain(["error".to_owned()]).collect();
    page.write_record(&heading).map_err(told)?;
    let mut wrong = 0;
    for answer in answers {
        let cells: Vec<String> = match answer {
            Ok(found) => {
                let numbers = [found.ln_evidence + named.ln_scale].into_iter().chain(found.marginals);
                numbers.map(|number| number.to_string()).chain([String::new()]).collect()
            }
            Err(error) => {
                wrong += 1;
                let empty = vec![String::new(); heading.len() - 1];
                empty.into_iter().chain([named.tell(error).to_string()]).collect()
            }
        };
        page.write_record(&cells).map_err(told)?;
    }
    let page =
        page.into_inner().map_err(|error| Failure::Output(std::io::Error::other(error.to_string())))?;
    output::write(arguments.out.as_deref(), &page, out)?;
    if wrong > 0 {
        let message = format!("{wrong} of {} cases have no answer; their rows give the reasons", cases.len());
        return Err(Failure::Words(message));
    }
    Ok(())
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
