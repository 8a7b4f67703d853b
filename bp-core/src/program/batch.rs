//! The posteriors of many cases, as a table of numbers.
//!
//! In: a program, and a table with a column for each observed variable. Out: a [`Batch`]: a row of numbers for each case.
//! Invariant: rows have the order of the cases; a case without an answer has its reason; one plan answers all cases.

use super::expanded::is_expanded;
use super::source::TableSource;
use super::{Evidence, Program};
use crate::answer::{Answer, Figure, marginals_strategy, of_each_variable};
use crate::data::{Records, Value, Values};
use crate::error::Error;
use crate::ids::VariableId;
use crate::learn::sizes;
use crate::plan::Strategy;
use crate::strategies::join_tree::{Named, NetworkEvidence, answer_cases};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;

/// A table of cases: `Cases::from("cases.csv")`, `Cases::from("cases.csv").only(["lung"])`, or columns in memory.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let lawn = Program::parse(
///     "program Lawn {
///          variables { Rain, Wet : bool; }
///          decomposition { P(Rain) P(Wet | Rain) }
///          forms { P(Rain) = bernoulli(0.2); P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 }); }
///      }",
/// )?;
/// let found = lawn.batch(Cases::new().column("Wet", ["true", ""]).only(["Rain"]))?;
/// assert_eq!(found.columns, ["ln_p_evidence", "Rain=false", "Rain=true"]);
/// // P(Rain | Wet) = 0.2 · 0.9 / (0.2 · 0.9 + 0.8 · 0.1); the second row observes nothing.
/// let rain = |row: usize| found.rows[row].as_ref().map(|numbers| numbers[2]).unwrap();
/// assert!((rain(0) - 0.18 / 0.26).abs() < 1e-15 && (rain(1) - 0.2).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Cases {
    source: TableSource,
    only: Vec<String>,
}

impl<P: AsRef<Path>> From<P> for Cases {
    fn from(path: P) -> Self {
        Self { source: TableSource::file(path.as_ref()), only: Vec::new() }
    }
}

impl Cases {
    /// A table without columns, to which columns are added.
    pub fn new() -> Self {
        Self::of_records(Records::in_memory())
    }

    /// Another column in memory, with a cell for each case; an empty one is not observed. It has no effect on a file.
    #[must_use]
    pub fn column<T: ToString>(mut self, name: &str, cells: impl IntoIterator<Item = T>) -> Self {
        if let TableSource::Records(records) = &mut self.source {
            records.add_column(name, &cells.into_iter().map(|cell| cell.to_string()).collect::<Vec<_>>());
        }
        self
    }

    /// A table that has been read.
    pub fn of_records(records: Records) -> Self {
        Self { source: TableSource::records(records), only: Vec::new() }
    }

    /// The posteriors of these variables only, or of these elements of families (`Z[2]`).
    #[must_use]
    pub fn only<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.only.extend(names.into_iter().map(Into::into));
        self
    }
}

impl Default for Cases {
    fn default() -> Self {
        Self::new()
    }
}

/// The posteriors of many cases.
#[derive(Debug)]
pub struct Batch {
    /// The names of the numbers: `ln_p_evidence`, then `variable=value` for the probability of each value of a finite
    /// variable, and `variable.mean`, `variable.deviation` for a real.
    pub columns: Vec<String>,
    /// For each case its numbers in the order of the columns (NaN where the case has none, as of an observed real, or
    /// ln P(evidence) by Gibbs sampling), or the reason why it has no answer.
    pub rows: Vec<Result<Vec<f64>, Error>>,
}

/// The posteriors of each case; `done` is called after each, from any thread.
pub(super) fn batch(program: &Program, cases: &Cases, done: &(dyn Fn() + Sync)) -> Result<Batch, Error> {
    let records = &*cases.source.read()?;
    let is_tree = || Ok(marginals_strategy(program.model(), program.options)? == Strategy::JoinTree);
    match !is_expanded(program.model()) && is_tree()? {
        true => by_tree(program, records, &cases.only, done),
        false => each(program, records, &cases.only, done),
    }
}

/// Cases of finite variables share the propagations of join trees.
fn by_tree(
    program: &Program,
    records: &Records,
    only: &[String],
    done: &(dyn Fn() + Sync),
) -> Result<Batch, Error> {
    let opened = &program.opened;
    let question = of_each_variable(&opened.model);
    let (model, _) = opened.model.posed(&question);
    let inputs = sizes(&model, records, program.settings.inputs())?;
    let named = Named::with(model.into_owned(), &opened.known, &inputs)?;
    let names = program.variables();
    let unknown = |column: usize| records.unknown(column, names.iter().map(String::as_str));
    let columns: Vec<(usize, Values<'_>)> = (records.columns.iter().enumerate())
        .map(|(column, name)| match (named.number_of(name), program.model().variable(name)) {
            (Ok(variable), _) => Ok((variable, named.values(variable))),
            (Err(error), Some(_)) => Err(error),
            (Err(_), None) => Err(unknown(column)),
        })
        .collect::<Result<_, _>>()?;
    let always = named.evidence([], [])?;
    let case = |row: usize| -> Result<NetworkEvidence, Error> {
        let mut evidence = always.clone();
        for (column, (variable, values)) in columns.iter().enumerate() {
            if let Some(value) = records.cell(row, column, values)?.and_then(|value| value.ordinal) {
                evidence.hard.push((*variable, value));
            }
        }
        Ok(evidence)
    };
    let all = read_all(records.len(), case)?;
    let wanted: Vec<usize> = match only.is_empty() {
        true => named.shown(),
        false => only.iter().map(|name| named.number_of(name)).collect::<Result<_, _>>()?,
    };
    let answers =
        answer_cases(&named.network, &all, &wanted, done).map_err(|error| named.with_names(error))?;
    let values = wanted.iter().flat_map(|one| {
        let (name, named) = (named.variable(*one), &named);
        (0..named.network.cardinalities[*one])
            .map(move |value| format!("{name}={}", named.value(*one, value)))
    });
    let columns = std::iter::once("ln_p_evidence".to_owned()).chain(values).collect();
    let row = |found: Result<_, Error>| match found {
        Ok(crate::strategies::join_tree::Posterior { ln_evidence, marginals }) => {
            Ok(std::iter::once(ln_evidence + opened.ln_scale).chain(marginals).collect())
        }
        Err(error) => Err(named.with_names(error)),
    };
    Ok(Batch { columns, rows: answers.into_iter().map(row).collect() })
}

/// Each case is asked alone.
fn each(
    program: &Program,
    records: &Records,
    only: &[String],
    done: &(dyn Fn() + Sync),
) -> Result<Batch, Error> {
    let model = program.model();
    let mut columns: Vec<(VariableId, Values<'_>)> = Vec::new();
    let names = program.variables();
    for (column, name) in records.columns.iter().enumerate() {
        let plain = name.split('[').next().unwrap_or(name).trim();
        let id = model.variable(name).or_else(|| model.variable(plain));
        let id = id.ok_or_else(|| records.unknown(column, names.iter().map(String::as_str)))?;
        columns.push((id, Values::new(model, id, &|_| None)));
    }
    let case = |row: usize| -> Result<Evidence, Error> {
        let mut evidence = Evidence::new();
        for (column, (id, values)) in columns.iter().enumerate() {
            let name = records.columns[column].clone();
            match records.cell(row, column, values)? {
                Some(Value { ordinal: Some(ordinal), .. }) => {
                    evidence.set(name, model.value_name(*id, ordinal))
                }
                Some(value) => evidence.set(name, value.number),
                None => {}
            }
        }
        Ok(evidence)
    };
    let all = read_all(records.len(), case)?;
    let answer = |evidence: &Evidence| {
        // Nothing observed has probability 1, which no strategy needs to compute.
        let nothing = evidence.iter().next().is_none() && program.opened.known.is_empty();
        let found = program.marginals_of(only, evidence).map(|found| {
            let ln_evidence = found.ln_evidence().or(nothing.then_some(0.0));
            numbers(found.answer(), ln_evidence.unwrap_or(f64::NAN))
        });
        done();
        found
    };
    let answers: Vec<Result<Vec<(String, f64)>, Error>> = all.par_iter().map(answer).collect();
    let (mut names, mut places) = (Vec::new(), HashMap::new());
    for (name, _) in answers.iter().flatten().flatten() {
        if !places.contains_key(name) {
            places.insert(name.clone(), names.len());
            names.push(name.clone());
        }
    }
    let row = |numbers: Vec<(String, f64)>| {
        let mut row = vec![f64::NAN; names.len()];
        numbers.into_iter().for_each(|(name, number)| row[places[&name]] = number);
        row
    };
    let rows = answers.into_iter().map(|answer| answer.map(row)).collect();
    Ok(Batch { columns: names, rows })
}

/// The evidence of each row, read in parallel.
///
/// # Errors
/// The error of the first row that has one.
fn read_all<T: Send>(rows: usize, read: impl Fn(usize) -> Result<T, Error> + Sync) -> Result<Vec<T>, Error> {
    let all: Result<Vec<T>, Error> = (0..rows).into_par_iter().map(&read).collect();
    // In parallel any of several errors may come first.
    all.or_else(|_| (0..rows).map(read).collect())
}

/// The numbers of an answer, each with the name of its column.
fn numbers(answer: &Answer, ln_evidence: f64) -> Vec<(String, f64)> {
    let mut all = vec![("ln_p_evidence".to_owned(), ln_evidence)];
    for row in &answer.answer {
        let Some((name, value)) = row.values.last() else { continue };
        let mut real = |mean: f64, deviation: f64| {
            all.extend([(format!("{name}.mean"), mean), (format!("{name}.deviation"), deviation)]);
        };
        match &row.figure {
            Figure::Probability { p } | Figure::Estimated { p, .. } => {
                all.push((format!("{name}={value}"), *p))
            }
            Figure::Normal { mean, deviation }
            | Figure::Law { mean, deviation, .. }
            | Figure::Mixture { mean, deviation, .. } => {
                real(*mean, *deviation);
            }
            Figure::Real { mean, deviation, .. } => real(mean[0], deviation[0]),
            _ => {}
        }
    }
    all
}
