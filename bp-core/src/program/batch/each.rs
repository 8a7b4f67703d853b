//! Cases with reals, or of other strategies than a join tree: each is asked alone.
//!
//! In: what is wanted, and the cases. Out: a row of numbers for each. Invariant: cases that observe the same variables are planned
//! once; a case that the plan does not answer is asked as by `marginals`, whose words are the reason.

use super::super::marginals::Repeated;
use super::super::{Evidence, Program};
use super::read_all;
use super::wanted::Wanted;
use crate::answer::{Answer, Figure, Part};
use crate::data::{Records, Value, Values};
use crate::error::Error;
use crate::model::Model;
use crate::progress;
use rayon::prelude::*;
use std::collections::HashMap;

/// From this number of cases with the same observed variables on, they have a plan of their own.
const WORTH_A_PLAN: usize = 3;

/// The numbers of each case, in the order of the columns.
pub(super) fn rows(
    wanted: &Wanted,
    records: &Records,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Result<Vec<f64>, Error>>, Error> {
    let all = read_all(records.len(), case(wanted, records))?;
    let (program, names) = match wanted.expanded()? {
        Some((program, names)) => (program, names),
        None => (wanted.program.clone(), wanted.wanted_names()),
    };
    let mut patterns: HashMap<Vec<&str>, Vec<usize>> = HashMap::new();
    for (row, evidence) in all.iter().enumerate() {
        patterns.entry(evidence.iter().map(|(name, _)| name).collect()).or_default().push(row);
    }
    let plans: HashMap<Vec<&str>, Repeated<'_>> = patterns
        .into_iter()
        .filter(|(_, rows)| rows.len() >= WORTH_A_PLAN)
        .filter_map(|(pattern, rows)| Some((pattern, Repeated::new(&program, &names, &all[rows[0]])?)))
        .collect();
    let places = Places::of(wanted);
    let answer = |evidence: &Evidence| {
        let pattern: Vec<&str> = evidence.iter().map(|(name, _)| name).collect();
        let planned = plans.get(&pattern).and_then(|plan| plan.marginals(evidence).ok());
        let found = match planned {
            Some(found) => Ok(places.numbers(program.model(), evidence, &found, &program)),
            None => program
                .marginals_of(&names, evidence)
                .map(|found| places.numbers(found.model(), evidence, found.answer(), &program)),
        };
        done();
        found
    };
    let host = progress::host();
    let hosted = |evidence: &Evidence| progress::abandonable(host.clone(), || answer(evidence));
    Ok(all.par_iter().map(hosted).collect())
}

/// Reads the evidence of a row.
fn case<'r>(
    wanted: &'r Wanted,
    records: &'r Records,
) -> impl Fn(usize) -> Result<Evidence, Error> + Sync + 'r {
    let model = wanted.program.model();
    let columns: Vec<Values<'_>> = (0..wanted.names.len()).map(|column| wanted.values(column)).collect();
    move |row| {
        let mut evidence = Evidence::new();
        for (column, values) in columns.iter().enumerate() {
            let name = wanted.names[column].as_str();
            match records.cell(row, column, values)? {
                Some(Value { ordinal: Some(ordinal), .. }) => {
                    evidence.set(name, model.value_name(wanted.observed[column], ordinal));
                }
                Some(value) => evidence.set(name, value.number),
                None => {}
            }
        }
        Ok(evidence)
    }
}

/// The places of the numbers of each variable or element, by its name.
struct Places {
    first: HashMap<String, usize>,
    count: usize,
}

impl Places {
    fn of(wanted: &Wanted) -> Self {
        let (mut first, mut count) = (HashMap::new(), 1);
        for slot in &wanted.slots {
            first.insert(slot.name(wanted.program.model()), count);
            count += if slot.count == 0 { 2 } else { slot.count };
        }
        Self { first, count }
    }

    /// The numbers of an answer; NaN where it has none, as of an observed real.
    fn numbers(&self, model: &Model, evidence: &Evidence, answer: &Answer, program: &Program) -> Vec<f64> {
        let mut row = vec![f64::NAN; self.count];
        // Nothing observed has probability 1, which no strategy needs to compute.
        let nothing = evidence.iter().next().is_none() && program.opened.known.is_empty();
        row[0] = answer.ln_evidence.or(nothing.then_some(0.0)).unwrap_or(f64::NAN);
        for part in &answer.parts {
            let [slot] = part.of.as_slice() else { continue };
            let Some(first) = self.first.get(&slot.name(model)) else { continue };
            match part.probabilities() {
                Some(all) => row[*first..first + all.len()].copy_from_slice(&all),
                None => row[*first..first + 2].copy_from_slice(&moments(model, part)),
            }
        }
        row
    }
}

/// The mean and the deviation of a real.
fn moments(model: &Model, part: &Part) -> [f64; 2] {
    match part.rows(model).first().map(|row| row.figure) {
        Some(
            Figure::Normal { mean, deviation }
            | Figure::Law { mean, deviation, .. }
            | Figure::Mixture { mean, deviation, .. },
        ) => [mean, deviation],
        Some(Figure::Real { mean, deviation, .. }) => [mean[0], deviation[0]],
        _ => [f64::NAN; 2],
    }
}
