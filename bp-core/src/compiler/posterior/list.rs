//! The rows of an answer, as a list or as the cells of a table.
//!
//! In: rows, or a table with its columns. Out: [`AnswerRows`], which read as a slice of [`Row`]s. Invariant: the cells of a
//! table have the names of its columns once and its numbers once; they become a list of rows only where they are read as
//! a slice, which serialisation and printing do not do.

use super::numbers::Numbers;
use super::table::{Column, Table};
use super::{Figure, Part, PartLaw, Row, Slot, as_map};
use crate::model::Model;
use serde::ser::SerializeSeq;
use serde::{Serialize, Serializer};
use std::borrow::Cow;
use std::fmt::{self, Debug, Formatter};
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

/// The rows of an answer.
#[derive(Clone)]
pub struct AnswerRows {
    /// The table whose cells they are; `None` if they are in `listed`.
    cells: Option<Cells>,
    listed: OnceLock<Vec<Row>>,
}

/// A probability for each combination of values of columns, the last one fastest.
#[derive(Clone)]
struct Cells {
    columns: Arc<[Column]>,
    numbers: Numbers,
}

/// A row whose names are those of a table.
#[derive(Serialize)]
struct Cell<'c> {
    #[serde(serialize_with = "as_map")]
    values: &'c [(&'c str, &'c str)],
    #[serde(flatten)]
    figure: Figure,
}

impl AnswerRows {
    /// A row for each cell of a table.
    pub(crate) fn of_table(table: &Table) -> Self {
        let columns = table.right.iter().chain(&table.left).cloned().collect();
        Self::of_cells(Cells { columns, numbers: table.numbers.clone() })
    }

    /// The rows of some parts, one after the other.
    pub(crate) fn of_parts(model: &Model, parts: &[Part]) -> Self {
        match Cells::of_parts(model, parts) {
            Some(cells) => Self::of_cells(cells),
            None => parts.iter().flat_map(|part| part.rows(model)).collect(),
        }
    }

    fn of_cells(cells: Cells) -> Self {
        Self { cells: Some(cells), listed: OnceLock::new() }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.cells.as_ref().map_or_else(|| (**self).len(), |cells| cells.numbers.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rows as a slice; where they are the cells of a table, they are made on the first use.
    pub fn as_slice(&self) -> &[Row] {
        self.listed.get_or_init(|| self.cells.as_ref().map(Cells::rows).unwrap_or_default())
    }

    /// The first rows, or all if there are fewer.
    pub fn first_rows(&self, count: usize) -> Cow<'_, [Row]> {
        let count = count.min(self.len());
        match &self.cells {
            Some(cells) if count < self.len() => Cow::Owned((0..count).map(|at| cells.row(at)).collect()),
            _ => Cow::Borrowed(&self[..count]),
        }
    }

    /// A row that is a cell of a table; `None` if the rows are a list, or end before it.
    pub(crate) fn row_of_cells(&self, at: usize) -> Option<Row> {
        self.cells.as_ref().filter(|cells| at < cells.numbers.len()).map(|cells| cells.row(at))
    }

    /// The largest probability; 0 if there is none.
    pub(crate) fn largest_probability(&self) -> f64 {
        match &self.cells {
            Some(cells) => cells.numbers.iter().copied().fold(0.0, f64::max),
            None => self.iter().filter_map(Row::p).fold(0.0, f64::max),
        }
    }

    /// The row of the largest probability, the first of several, with its position.
    pub(crate) fn largest_row(&self) -> Option<(usize, Row)> {
        let larger = |best: Option<(usize, f64)>, (at, p): (usize, f64)| match best {
            Some((_, most)) if p <= most => best,
            _ => Some((at, p)),
        };
        match &self.cells {
            Some(cells) => {
                let (at, _) = cells.numbers.iter().copied().enumerate().fold(None, larger)?;
                Some((at, cells.row(at)))
            }
            None => {
                let all = self.iter().enumerate().filter_map(|(at, row)| Some((at, row.p()?)));
                let (at, _) = all.fold(None, larger)?;
                Some((at, self[at].clone()))
            }
        }
    }

    /// The rows as a list that may change.
    pub(crate) fn as_list(&mut self) -> &mut Vec<Row> {
        let listed = match self.cells.take() {
            Some(cells) => cells.rows(),
            None => self.listed.take().unwrap_or_default(),
        };
        self.listed = OnceLock::new();
        self.listed.get_or_init(|| listed);
        self.listed.get_mut().expect("internal: the list was just put there")
    }

    /// Calls `look` with each number that may be written; in a list it may change the number.
    pub(super) fn each_number(
        &mut self,
        in_figure: impl Fn(&mut Figure, &mut dyn FnMut(&mut f64)),
        look: &mut dyn FnMut(&mut f64),
    ) {
        match &self.cells {
            Some(cells) => cells.numbers.iter().for_each(|number| look(&mut { *number })),
            None => self.as_list().iter_mut().for_each(|row| in_figure(&mut row.figure, look)),
        }
    }
}

impl Cells {
    /// The cells of one finite part, or of the instants of finite slots.
    fn of_parts(model: &Model, parts: &[Part]) -> Option<Self> {
        let first = parts.first()?;
        let is_alike = |part: &Part| {
            matches!(part.law, PartLaw::Finite(_)) && (&part.given, &part.of) == (&first.given, &first.of)
        };
        let instants: Option<Vec<String>> =
            parts.iter().map(|part| part.instant.map(|instant| instant.to_string())).collect();
        if !parts.iter().all(is_alike) || (instants.is_none() && parts.len() > 1) {
            return None;
        }
        let laws = parts.iter().filter_map(|part| match &part.law {
            PartLaw::Finite(numbers) => Some(numbers),
            _ => None,
        });
        let column = |name, values| Column { variable: None, element: 0, name, values };
        let slot = |slot: &Slot| {
            let values = (0..slot.count).map(|at| model.value_name(slot.variable, at)).collect();
            column(slot.name(model), values)
        };
        let instants = instants.map(|instants| column("t".to_owned(), instants));
        let columns = instants.into_iter().chain(first.given.iter().chain(&first.of).map(slot)).collect();
        Some(Self { columns, numbers: Numbers::concatenated(laws) })
    }

    /// The probability in a cell; −0 is 0.
    fn figure(&self, at: usize) -> Figure {
        Figure::Probability { p: self.numbers[at] + 0.0 }
    }

    fn row(&self, at: usize) -> Row {
        let ordinals = Column::ordinals(&self.columns, at);
        let named = |(column, at): (&Column, &usize)| (column.name.clone(), column.values[*at].clone());
        Row { values: self.columns.iter().zip(&ordinals).map(named).collect(), figure: self.figure(at) }
    }

    fn rows(&self) -> Vec<Row> {
        (0..self.numbers.len()).map(|at| self.row(at)).collect()
    }

    /// Calls `visit` with each cell, in order.
    fn each<E>(&self, mut visit: impl FnMut(Cell<'_>) -> Result<(), E>) -> Result<(), E> {
        let mut ordinals = vec![0; self.columns.len()];
        if self.numbers.is_empty() {
            return Ok(());
        }
        let mut values: Vec<(&str, &str)> =
            self.columns.iter().map(|column| (column.name.as_str(), column.values[0].as_str())).collect();
        for at in 0..self.numbers.len() {
            visit(Cell { values: &values, figure: self.figure(at) })?;
            for place in (0..ordinals.len()).rev() {
                ordinals[place] += 1;
                let ended = ordinals[place] == self.columns[place].values.len();
                ordinals[place] *= usize::from(!ended);
                values[place].1 = self.columns[place].values[ordinals[place]].as_str();
                if !ended {
                    break;
                }
            }
        }
        Ok(())
    }
}

impl Deref for AnswerRows {
    type Target = [Row];

    fn deref(&self) -> &[Row] {
        self.as_slice()
    }
}

impl From<Vec<Row>> for AnswerRows {
    fn from(rows: Vec<Row>) -> Self {
        Self { cells: None, listed: OnceLock::from(rows) }
    }
}

impl FromIterator<Row> for AnswerRows {
    fn from_iter<I: IntoIterator<Item = Row>>(rows: I) -> Self {
        Self::from(rows.into_iter().collect::<Vec<Row>>())
    }
}

impl<'r> IntoIterator for &'r AnswerRows {
    type Item = &'r Row;
    type IntoIter = std::slice::Iter<'r, Row>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl PartialEq for AnswerRows {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Debug for AnswerRows {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl Serialize for AnswerRows {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(cells) = &self.cells else { return (**self).serialize(serializer) };
        let mut list = serializer.serialize_seq(Some(cells.numbers.len()))?;
        cells.each(|cell| list.serialize_element(&cell))?;
        list.end()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Answer;
    use super::*;
    use crate::equation::Strategy;
    use crate::model::When;

    /// A table of some instants, and the same rows one by one.
    fn both(instants: usize) -> (AnswerRows, Vec<Row>) {
        let column = |name: &str, values: Vec<String>| Column {
            variable: None,
            element: 0,
            name: name.to_owned(),
            values,
        };
        let t: Vec<String> = (1..=instants).map(|instant| instant.to_string()).collect();
        let x = ["low", "\"high\""].map(str::to_owned);
        let y = ["0", "1", "2"].map(str::to_owned);
        let total = (6 * instants) as f64;
        let table = Table {
            question: String::new(),
            right: vec![column("t", t.clone())],
            left: vec![column("X", x.to_vec()), column("Y", y.to_vec())],
            numbers: (0..6 * instants).map(|at| at as f64 / total).collect(),
            extended: None,
        };
        let mut rows = Vec::new();
        for t in &t {
            for x in &x {
                for y in &y {
                    let values = [("t", t), ("X", x), ("Y", y)];
                    let values = values.map(|(name, value)| (name.to_owned(), value.clone())).to_vec();
                    rows.push(Row { values, figure: Figure::Probability { p: rows.len() as f64 / total } });
                }
            }
        }
        (AnswerRows::of_table(&table), rows)
    }

    #[test]
    fn cells_are_written_as_rows_are() {
        for instants in [2, 30] {
            let (cells, expected) = both(instants);
            let answer = |answer: AnswerRows| Answer {
                question: "smooth P(X Y | Z)".to_owned(),
                ln_evidence: Some(-2.5),
                estimate: None,
                answer,
                strategy: Strategy::Chain,
                when: When::Smooth,
                parts: Vec::new(),
            };
            let (cells, listed) = (answer(cells), answer(AnswerRows::from(expected)));
            assert_eq!(serde_json::to_string(&cells).unwrap(), serde_json::to_string(&listed).unwrap());
            assert_eq!(format!("{cells}"), format!("{listed}"));
            let is_listed = cells.answer.listed.get().is_some();
            assert_eq!(is_listed, instants == 2, "a large table is written without a list of its rows");
            assert_eq!(format!("{cells:#}"), format!("{listed:#}"));
        }
    }

    #[test]
    fn cells_are_read_as_rows_are() {
        let (cells, expected) = both(2);
        assert_eq!((cells.len(), cells.largest_probability()), (12, 11.0 / 12.0));
        assert_eq!(*cells.first_rows(5), expected[..5]);
        let mut changed = cells.clone();
        changed.as_list().truncate(1);
        assert_eq!((changed.len(), cells.len()), (1, 12));
        assert_eq!(cells, AnswerRows::from(expected));
    }
}
