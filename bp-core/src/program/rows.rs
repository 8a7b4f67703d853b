//! Data as a plate: the rows of tables are the elements of sets of a program.
//!
//! In: files, or columns in memory. Out: a [`Program`] that knows them: sizes, numbers of fields, values of families. Invariant:
//! observations are known in every question; a missing cell is not.

use super::settings::Settings;
use super::source::TableSource;
use super::{Learned, Posterior, Program, Value, learned};
use crate::answer::{self, Answer, AnswerRows, Knowledge, Part, compile_sized};
use crate::data::{PlateData, Records};
use crate::error::Error;
use crate::ids::VariableId;
use crate::learn::{self, Learner};
use crate::model::{Model, ParameterKind};
use crate::plan::Strategy;
use std::path::Path;

/// Tables whose rows are elements: `Rows::from("points.csv")`, `Rows::from("pupils.csv").and("schools.csv")`.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let line = Program::parse(
///     "program Line {
///          variables { A : real; Y[row in Rows] : real; }
///          decomposition { P(A) prod(row in Rows) { P(Y[row] | A) } }
///          forms { P(A) = normal(0, 1); P(Y[row] | A) = normal(A * x[row], 1); }
///      }",
/// )?;
/// // Precision 1 + 1² + 2², information 1 · 1 + 2 · 2; the third row is predicted.
/// let points = Rows::new().column("x", [1.0, 2.0, 3.0]).column("Y", [1.0, 2.0, f64::NAN]);
/// let line = line.rows(points)?;
/// assert!((line.ask("P(A)")?.mean()? - 5.0 / 6.0).abs() < 1e-12);
/// assert!((line.ask("P(Y)")?.mean()? - 15.0 / 6.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Rows {
    tables: Vec<Table>,
    ignore: Vec<String>,
}

/// A table, and the set of which its rows are elements, if it is given.
#[derive(Clone, Debug)]
struct Table {
    of: Option<String>,
    source: TableSource,
}

impl<P: AsRef<Path>> From<P> for Rows {
    fn from(path: P) -> Self {
        Self::new().and(path)
    }
}

impl Rows {
    /// No table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Another table, from a file.
    #[must_use]
    pub fn and(mut self, path: impl AsRef<Path>) -> Self {
        self.tables.push(Table { of: None, source: TableSource::file(path.as_ref()) });
        self
    }

    /// Another table, as it was read.
    #[must_use]
    pub fn and_records(mut self, records: Records) -> Self {
        self.tables.push(Table { of: None, source: TableSource::records(records) });
        self
    }

    /// A column in memory, of the last table in memory; NaN is a missing value. Its values are those of the column before, row
    /// by row.
    #[must_use]
    pub fn column(mut self, name: &str, values: impl IntoIterator<Item = impl Into<Value>>) -> Self {
        let cells: Vec<String> = values.into_iter().map(|value| value.into().to_string()).collect();
        match self.tables.last_mut().map(|table| &mut table.source) {
            Some(TableSource::Records(records)) => records.add_column(name, &cells),
            _ => {
                let mut records = Records::in_memory();
                records.add_column(name, &cells);
                self = self.and_records(records);
            }
        }
        self
    }

    /// The set, or the size that bounds a range, of the last table; by default that of its columns.
    #[must_use]
    pub fn of(mut self, set: &str) -> Self {
        if let Some(table) = self.tables.last_mut() {
            table.of = Some(set.to_owned());
        }
        self
    }

    /// A column to ignore.
    #[must_use]
    pub fn ignore(mut self, column: &str) -> Self {
        self.ignore.push(column.to_owned());
        self
    }

    /// The data of the tables for a program.
    fn read(self, model: &Model, settings: &Settings) -> Result<PlateData, Error> {
        let open = |table: Table| {
            let records = table.source.read()?.into_owned();
            Ok((table.of, records))
        };
        let tables = self.tables.into_iter().map(open).collect::<Result<_, Error>>()?;
        PlateData::read(model, tables, &self.ignore, &|name| settings.size(name))
    }
}

impl Settings {
    /// With the sizes and the numbers of tables whose rows are elements.
    #[must_use]
    pub fn with_rows(mut self, rows: &PlateData) -> Self {
        self.sizes.extend(rows.sizes.iter().cloned());
        let numbers = rows.numbers().map(|(name, numbers)| (name.to_owned(), numbers.to_vec()));
        self.arrays.extend(numbers);
        self
    }

    /// The size implied by the largest index given for a set, where it is not known.
    pub(super) fn size_by_indices(&self, model: &Model) -> Option<(String, usize)> {
        model.parameters.values().find_map(|parameter| {
            let ParameterKind::Element(set) = parameter.kind else { return None };
            let name = &model.sets[set].name;
            let given = self.arrays.get(&parameter.name).unwrap_or(&parameter.default);
            let largest = given.iter().copied().fold(f64::NAN, f64::max);
            let known = self.sizes.contains_key(name) || largest.is_nan();
            (!known).then(|| (name.clone(), largest as usize + 1))
        })
    }
}

impl Program {
    /// The program whose sets have the rows of tables as their elements: a column named as a field fills it, a column named as
    /// a family is evidence where its cells have values.
    ///
    /// # Errors
    /// A table that cannot be read or does not fit, with file, row and column.
    pub fn rows(self, rows: impl Into<Rows>) -> Result<Self, Error> {
        let rows = rows.into().read(&self.opened.model, &self.given)?;
        let given = (*self.given).clone().with_rows(&rows);
        let mut opened = (*self.opened).clone();
        rows.name_elements(&mut opened.model);
        opened.rows = rows.into();
        Ok(Self::with_settings(opened.into(), given, (self.sampling, self.options)))
    }

    /// The data of its tables of rows.
    pub fn plate_data(&self) -> &PlateData {
        &self.opened.rows
    }

    /// The posterior of each missing cell of its rows, given the others.
    ///
    /// # Errors
    /// As [`Program::ask`].
    pub fn missing(&self) -> Result<Vec<Posterior>, Error> {
        let model = self.model();
        let finite = model.plate.is_none() && model.variables.values().all(|it| it.domain.is_finite());
        let by_tree =
            self.options.by.is_none_or(|by| by == Strategy::JoinTree) && self.options.budget.is_none();
        if finite && by_tree {
            match self.missing_finite() {
                Err(Error::Unplanned { .. }) => {}
                found => return found,
            }
        }
        let mut found = Vec::new();
        for asked in self.opened.rows.missing(model) {
            let (program, asked) = self.posed(asked);
            let compiled = compile_sized(program.model(), &asked, self.options)?;
            for answer in compiled.ask_with(program.inputs(), self.sampling)? {
                for part in &answer.parts {
                    let places = 0..part.of.len();
                    found.extend(places.map(|place| alone(&program, &answer, part.marginal(&[place]))));
                }
            }
        }
        Ok(found)
    }

    /// The same where all is finite: all cells by one propagation of a join tree.
    fn missing_finite(&self) -> Result<Vec<Posterior>, Error> {
        let (model, rows) = (self.model(), &self.opened.rows);
        let mut knowledge = Knowledge { known: self.opened.known.clone(), ..Knowledge::default() };
        knowledge.elements.hard.extend(rows.observed().filter_map(|(id, index, number)| {
            let variable = &model.variables[id];
            let element = usize::try_from(index - variable.family?.over.first()).ok()?;
            Some((id, element, variable.domain.ordinal_among(number, None)?))
        }));
        let missing: Vec<(VariableId, Vec<bool>)> = rows.missing_elements().collect();
        let wanted: Vec<VariableId> = missing.iter().map(|(id, _)| *id).collect();
        if wanted.is_empty() {
            return Ok(Vec::new());
        }
        let by = (self.sampling, self.options);
        let mut all = answer::marginals(model, &wanted, &knowledge, self.inputs(), by)?;
        let parts = std::mem::take(&mut all.parts).into_iter();
        let cells = parts.zip(missing.into_iter().flat_map(|(_, elements)| elements));
        Ok(cells.filter(|(_, missing)| *missing).map(|(part, _)| alone(self, &all, part)).collect())
    }

    /// Learns the `unknown` forms, and the parameters that `identification` names, from its rows: their elements are
    /// pooled.
    ///
    /// # Errors
    /// There are no rows, or nothing is to be learned; a family without a column is not declared `hidden`.
    pub fn learn_from_rows(&self, settings: &learn::Settings) -> Result<Learned, Error> {
        let model = self.model();
        let given = self.settings.inputs();
        let mut learner = Learner::with(model, &given)?;
        learner.observe_rows(&self.opened.rows, &[])?;
        learned::finished(self, learner.learned_with(settings, &mut |_, _| {})?, &given)
    }
}

/// The posterior of one cell, of an answer.
fn alone(program: &Program, answer: &Answer, part: Part) -> Posterior {
    let model = program.model();
    let answer = Answer {
        question: format!("P({})", part.of[0].name(model)),
        ln_evidence: answer.ln_evidence,
        estimate: answer.estimate.clone(),
        answer: AnswerRows::of_parts(model, std::slice::from_ref(&part)),
        strategy: answer.strategy,
        when: answer.when,
        parts: vec![part],
    };
    Posterior::new(program, answer)
}
