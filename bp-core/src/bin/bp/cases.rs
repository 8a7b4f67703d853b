//! Answers a question for many cases: the rows of a table.
//!
//! In: a model, a question, a table whose columns are named as variables. Out: the answers of each case. Invariant: a
//! value in a case replaces the one that the question leaves open; a missing value is not known in that case; an error
//! in one case does not affect the others. The question is compiled once for each set of variables that are missing
//! together.

use crate::failure::Failure;
use bp_core::compiler::answer::{Answer, CompiledQuestion, compile_by, filled, open};
use bp_core::compiler::data::{Records, Values};
use bp_core::compiler::distribution::Setting;
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::ids::VariableId;
use bp_core::compiler::learn::sizes;
use bp_core::compiler::model::{DerivedKind, Domain, Model, Question};
use bp_core::compiler::plan::{Options, Strategy};
use bp_core::compiler::sample::Sampling;
use bp_core::program::settings::Settings;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The answers to one case, or its error.
pub(crate) type Answered = Result<Vec<Answer>, Error>;

/// Answers the questions for each row of a file; each comes with its row number.
pub(crate) fn answers(
    model: &Model,
    questions: &[Question],
    table: &Records,
    settings: &Settings,
    (sampling, options): (Sampling, Options),
) -> Result<Vec<(usize, Answered)>, Failure> {
    let given = sizes(model, table, settings.inputs())?;
    let columns = columns(model, questions, table, settings, &given)?;
    let mut compiled: HashMap<Pattern, Vec<CompiledQuestion<'_>>> = HashMap::new();
    let mut answers = Vec::with_capacity(table.len());
    for row in 0..table.len() {
        let in_row = |error| table.wrong_row(row, error);
        let (pattern, inputs) = read(model, &columns, table, row, &given)?;
        let ready = match compiled.get(&pattern) {
            Some(ready) => ready,
            None => {
                let ready = compile(model, questions, &columns, &pattern, options).map_err(in_row)?;
                compiled.entry(pattern).or_insert(ready)
            }
        };
        // Each case has its own draws; multiplying by an odd constant gives each row a different seed.
        let seed = sampling.seed.wrapping_add((row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let asked = ready.iter().map(|question| question.ask_filled(&inputs, Sampling { seed, ..sampling }));
        let answered = match asked.collect::<Result<Vec<_>, Error>>() {
            Err(error) if !error.is_of_one_case() => return Err(in_row(error).into()),
            answered => answered.map(|answers| seeded(answers.concat(), sampling)),
        };
        answers.push((table.line(row), answered));
    }
    Ok(answers)
}

/// Answers that name the seed of the command, which repeats them, and not that of their row.
pub(crate) fn seeded(mut answers: Vec<Answer>, sampling: Sampling) -> Vec<Answer> {
    let estimates = answers.iter_mut().filter_map(|answer| answer.estimate.as_mut());
    estimates.for_each(|estimate| estimate.seed = sampling.seed);
    answers
}

/// The columns of an open variable: one, or one for each element of a family or component of a vector.
type Columns<'m> = BTreeMap<VariableId, (Vec<usize>, Values<'m>)>;

/// The missing values of a row.
#[derive(PartialEq, Eq, Hash)]
struct Pattern {
    /// The variables that are not observed.
    missing: BTreeSet<VariableId>,
    /// Whether some, but not all, elements of a family are observed.
    partly: bool,
}

/// The columns of the open variables; one that is set needs no column.
fn columns<'m>(
    model: &'m Model,
    questions: &[Question],
    table: &Records,
    settings: &Settings,
    given: &Inputs<'_, f64>,
) -> Result<Columns<'m>, Error> {
    let open: BTreeSet<VariableId> = questions.iter().flat_map(open).collect();
    let mut columns = Columns::new();
    for id in open {
        let name = model.variable_name(id);
        let is_vector = matches!(model.variables[id].domain, Domain::Vector(_));
        let names = match is_vector || model.variables[id].family.is_some() {
            true => {
                let setting = Setting::new(model, given)?;
                setting.slots_of(id).map(|slot| setting.slot_name(slot)).collect()
            }
            false => vec![name.clone()],
        };
        let column = names.iter().find(|name| table.column(name).is_some());
        if let (Some(column), true) = (column, settings.has(&name)) {
            let message = format!(
                "`--set` gives `{name}` a value, and so does the column `{column}`: remove one of the two"
            );
            return Err(Error::input(column, message));
        }
        if column.is_some() || !settings.has(&name) {
            let places = names.iter().map(|name| table.needed(name)).collect::<Result<_, _>>()?;
            columns.insert(id, (places, Values::new(model, id, &|size| given.find_size(size))));
        }
    }
    Ok(columns)
}

/// The values of a row; a missing element of a family is NaN.
fn read<'g>(
    model: &Model,
    columns: &Columns<'_>,
    table: &Records,
    row: usize,
    given: &Inputs<'g, f64>,
) -> Result<(Pattern, Inputs<'g, f64>), Error> {
    let mut inputs = given.clone();
    let mut pattern = Pattern { missing: BTreeSet::new(), partly: false };
    for (id, (places, values)) in columns {
        let cell = |place: &usize| {
            let value = table.cell(row, *place, values)?;
            Ok(value.map_or(f64::NAN, |value| value.number))
        };
        let cells = places.iter().map(cell).collect::<Result<Vec<f64>, Error>>()?;
        let missing = cells.iter().filter(|cell| cell.is_nan()).count();
        if missing == cells.len() {
            pattern.missing.insert(*id);
            continue;
        }
        pattern.partly |= missing > 0;
        inputs = inputs.numbers(&model.variable_name(*id), cells.into());
    }
    Ok((pattern, inputs))
}

/// The questions with these variables given. Loops need all elements of a family: where some are missing, a join tree
/// is used if possible. Where a question names elements, families are written out, and every strategy can omit some.
fn compile<'m>(
    model: &'m Model,
    questions: &[Question],
    columns: &Columns<'_>,
    pattern: &Pattern,
    options: Options,
) -> Result<Vec<CompiledQuestion<'m>>, Error> {
    let given: BTreeSet<VariableId> = columns.keys().copied().collect();
    let is_apart = model.variables.values().any(|it| it.derived == Some(DerivedKind::Element));
    let compile = |question: &Question| {
        let question = filled(model, question, &given, &pattern.missing);
        match (options.by, pattern.partly && !is_apart) {
            (None, true) => compile_by(model, &question, Options { by: Some(Strategy::JoinTree), ..options })
                .or_else(|_| compile_by(model, &question, options)),
            _ => compile_by(model, &question, options),
        }
    };
    questions.iter().map(compile).collect()
}
