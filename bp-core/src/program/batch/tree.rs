//! Cases of finite variables: they share the propagations of join trees.
//!
//! In: what is wanted, the factors that matter, the cases. Out: a row of numbers for each. Invariant: cases that observe the same
//! variables have the same numbers however a table is divided.

use super::read_all;
use super::wanted::Wanted;
use crate::data::{Records, Values};
use crate::error::Error;
use crate::ids::FactorId;
use crate::model::Model;
use crate::strategies::join_tree::{Named, NetworkEvidence, Posterior, answer_cases};

/// The numbers of each case, in the order of the columns.
pub(super) fn rows(
    wanted: &Wanted,
    (model, factors): (Model, Vec<FactorId>),
    records: &Records,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Result<Vec<f64>, Error>>, Error> {
    let (opened, inputs) = (&wanted.program.opened, wanted.program.settings.inputs());
    let searched = wanted.wanted_names();
    let kept = searched.iter().chain(&wanted.names).map(String::as_str);
    let named = Named::of_factors(model, &opened.known, &inputs, &factors, kept)?;
    let number = |name: &String| named.number_of(name);
    let (columns, searched): (Vec<usize>, Vec<usize>) = (
        wanted.names.iter().map(number).collect::<Result<_, _>>()?,
        searched.iter().map(number).collect::<Result<_, _>>()?,
    );
    let values: Vec<Values<'_>> = (0..columns.len()).map(|column| wanted.values(column)).collect();
    let always = named.evidence([], [])?;
    let case = |row: usize| -> Result<NetworkEvidence, Error> {
        let mut evidence = always.clone();
        for (column, (variable, values)) in columns.iter().zip(&values).enumerate() {
            if let Some(value) = records.cell(row, column, values)?.and_then(|value| value.ordinal) {
                evidence.hard.push((*variable, value));
            }
        }
        Ok(evidence)
    };
    let all = read_all(records.len(), case)?;
    let answers =
        answer_cases(&named.network, &all, &searched, done).map_err(|error| named.with_names(error))?;
    let row = |found: Result<Posterior, Error>| match found {
        Ok(Posterior { ln_evidence, marginals }) => {
            Ok(std::iter::once(ln_evidence + opened.ln_scale).chain(marginals).collect())
        }
        Err(error) => Err(named.with_names(error)),
    };
    Ok(answers.into_iter().map(row).collect())
}
