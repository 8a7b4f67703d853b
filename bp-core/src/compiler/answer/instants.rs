//! Observations over time, read from a table.
//!
//! In: a question over time, and a table with a row for each instant. Out: the observations of each instant by name,
//! sequence by sequence. Invariant: a missing cell is not observed; a column is a variable of the program, the column
//! of sequences, or ignored.

use crate::data::{Records, Values, is_missing};
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess::{listed, near};
use crate::ids::{Id, VariableId};
use crate::model::{Ask, DerivedKind, Finding, Known, Model, Question, Statistic, Value, VariableUse, When};
use crate::strategies::Observed;
use std::collections::{HashMap, HashSet};
use std::io::{Error as Wrong, ErrorKind};

/// The columns of a table that are not variables.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct OtherColumns {
    /// The column that names the sequence of a row: consecutive rows with the same text belong together.
    pub sequence: Option<String>,
    /// Columns that are left out.
    pub ignore: Vec<String>,
}

/// The observations of each instant, all rows being one sequence. `inputs` gives the sizes on which domains depend.
///
/// # Errors
/// As [`read_sequences`].
pub fn read_instants(
    model: &Model,
    question: &Question,
    table: &Records,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<Observed>, Error> {
    let sequences = read_sequences(model, question, table, &OtherColumns::default(), inputs)?;
    Ok(sequences.into_iter().flat_map(|(_, instants)| instants).collect())
}

/// Refuses an ask that is not answered after each instant.
///
/// # Errors
/// It is no filter, or compares two distributions.
pub(super) fn after_each(model: &Model, ask: &Ask) -> Result<(), Error> {
    match ask.when == When::Filter && !matches!(ask.statistic, Statistic::Divergence { .. }) {
        true => Ok(()),
        false => {
            let message = "of the questions over time, only `filter` is answered after each row; `smooth` and `sequence` \
                           answer for every row anyway";
            Err(Error::input(model.ask_text(ask), message))
        }
    }
}

/// The question in which elements of families that have columns are families observed in part, unless it searches other
/// elements of them.
pub(super) fn of_families(model: &Model, question: &Question) -> Question {
    let mut changed = question.clone();
    // The kind of a derived variable and what it reads, before the question is posed or after.
    let derived = |id: VariableId| -> Option<(DerivedKind, &[VariableUse])> {
        if let Some(own) = question.derived.get((u32::MAX as usize).checked_sub(id.position())?) {
            return Some((own.kind, &own.right));
        }
        let kind = model.variables[id].derived?;
        Some((kind, &model.factors[model.factor_of(id)?].right))
    };
    let read = |id: VariableId| -> Vec<VariableId> {
        derived(id).map_or(vec![id], |(_, right)| right.iter().map(|use_| use_.variable).collect())
    };
    let family = |id: VariableId| match derived(id) {
        Some((DerivedKind::Element, [one])) => Some(one.variable),
        _ => None,
    };
    for ask in changed.asks.iter_mut().filter(|ask| ask.when.is_over_time()) {
        let searched: Vec<VariableId> = ask.searched.iter().flat_map(|item| read(item.variable)).collect();
        for known in ask.known.iter_mut().filter(|known| known.evidence == Finding::Each) {
            let whole = family(known.variable).filter(|id| !searched.contains(id));
            known.variable = whole.filter(|id| model.components(*id) == 1).unwrap_or(known.variable);
        }
        let mut own = HashSet::new();
        ask.known.retain(|known| own.insert(known.variable));
    }
    changed
}

/// The observations of each instant of each sequence, with the names of the sequences in order of first appearance;
/// without a column of sequences all rows are one, without a name. Columns of variables that the question does not know
/// are ignored.
///
/// # Errors
/// A column that names no variable of the program; no column that the question knows, or one whose value the question
/// gives as well; a cell that is not a value of its variable; a row that belongs to no sequence.
pub fn read_sequences(
    model: &Model,
    question: &Question,
    table: &Records,
    others: &OtherColumns,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<(String, Vec<Observed>)>, Error> {
    let (model, question) = model.posed(question);
    let columns = columns(&model, &question, table, others, inputs)?;
    let sequence = others.sequence.as_deref().map(|name| table.needed(name)).transpose()?;
    let mut sequences: Vec<(String, Vec<Observed>)> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    for row in 0..table.len() {
        let mut instant = Vec::new();
        for (position, column, values) in &columns {
            if let Some(value) = table.cell(row, *position, values)? {
                instant.push(((*column).clone(), value.number));
            }
        }
        let name = sequence.map_or("", |column| table.text(row, column).trim());
        if let Some(column) = sequence.filter(|_| is_missing(name)) {
            return Err(table.wrong(row, column, "missing; each row belongs to a sequence"));
        }
        let place = *places.entry(name).or_insert_with(|| {
            sequences.push((name.to_owned(), Vec::new()));
            sequences.len() - 1
        });
        sequences[place].1.push(instant);
    }
    Ok(sequences)
}

/// The columns that the question observes: their positions, names and values.
fn columns<'m, 't>(
    model: &'m Model,
    question: &Question,
    table: &'t Records,
    others: &OtherColumns,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<(usize, &'t String, Values<'m>)>, Error> {
    let wrong = |message: String| Error::file(&table.path, Wrong::new(ErrorKind::InvalidData, message));
    for name in others.ignore.iter().chain(&others.sequence) {
        table.needed(name)?;
    }
    let known: Vec<&Known> =
        question.asks.iter().flat_map(|ask| ask.known.iter().chain(ask.statistic.from())).collect();
    // A value that the question gives holds at every instant.
    let is_fixed = |known: &&Known| {
        matches!(known.evidence, Finding::Hard(Value::Ordinal(_) | Value::Real(_) | Value::Vector(_)))
    };
    let fixed: Vec<VariableId> =
        known.iter().filter(|known| is_fixed(known)).map(|known| known.variable).collect();
    let known: Vec<VariableId> = known.iter().map(|known| known.variable).collect();
    // A slice is called as its family is.
    let mut by_name: HashMap<String, Vec<VariableId>> = HashMap::new();
    model.variables.ids().for_each(|id| by_name.entry(model.variable_name(id)).or_default().push(id));
    let mut columns = Vec::new();
    for (position, column) in table.columns.iter().enumerate() {
        if others.ignore.contains(column) || others.sequence.as_ref() == Some(column) {
            continue;
        }
        let name = column.split('[').next().unwrap_or(column).trim();
        let Some(named) = by_name.get(name) else {
            if model.plate.is_some_and(|plate| model.sets[plate.set].name == name) {
                return Err(wrong(format!(
                    "column `{column}` is the set over which `{}` is repeated, and over time one of its elements is followed; to follow \
                     them all declare families, such as `Z[i in {name}]`, whose columns are `Z[0]`, `Z[1]`, …",
                    model.name
                )));
            }
            let guess = near(name, by_name.keys().map(String::as_str));
            let guess = guess.map_or_else(String::new, |name| format!("; did you mean `{name}`?"));
            return Err(wrong(format!(
                "column `{column}` is not a variable of `{}`{guess}; to ignore it: `{}`",
                model.name,
                Advice::Ignore(column)
            )));
        };
        // A component of a vector is called as its column is.
        let elements = || by_name.get(column.trim()).into_iter().flatten();
        if named.iter().chain(elements()).any(|variable| fixed.contains(variable)) {
            let message =
                format!("the question gives `{column}` a value, and so does a column: remove one of the two");
            return Err(wrong(message));
        }
        let has = |variable: &&VariableId| known.contains(variable) && has_column(model, **variable, column);
        if let Some(variable) = named.iter().chain(elements()).find(has) {
            columns.push((position, column, Values::new(model, *variable, &|name| inputs.find_size(name))));
        }
    }
    if columns.is_empty() && known.iter().any(|variable| !fixed.contains(variable)) {
        let names: Vec<String> = known.iter().map(|variable| model.variable_name(*variable)).collect();
        let message = format!(
            "no column is observed by the question: it knows {}, the columns are {}",
            listed(names.iter().map(String::as_str), "and"),
            listed(table.columns.iter().map(String::as_str), "and")
        );
        return Err(wrong(message));
    }
    Ok(columns)
}

/// Whether a column is of a variable that the question knows: of a slice it has the columns of its elements only.
fn has_column(model: &Model, variable: VariableId, column: &str) -> bool {
    let declared = &model.variables[variable];
    let (Some(DerivedKind::Element), Some(family)) = (declared.derived, declared.family) else { return true };
    let first = family.over.first();
    let count = model.index_count(&family.over).unwrap_or(0) as i64;
    (first..first + count).any(|index| format!("{}[{index}]", declared.name) == column.trim())
}
