//! The index space of the rows of a table: a set, or a range of run-time length.
//!
//! In: a table, perhaps a name. Out: an index space, and its size. Invariant: without a name, the columns name fields,
//! families or elements of one space only.

use super::read::Reader;
use crate::data::Records;
use crate::door::Advice;
use crate::error::Error;
use crate::guess::{listed, near};
use crate::model::{Domain, IndexSpace};

impl Reader<'_> {
    pub(super) fn space_name(&self, space: &IndexSpace) -> String {
        match space {
            IndexSpace::Set(set) => format!("`{}`", self.model.sets[*set].name),
            IndexSpace::Range(range) => format!(
                "`{}`",
                self.model.domain_text(&Domain::Finite { labels: Vec::new(), range: Some(*range) })
            ),
        }
    }

    /// The name by which a table can be given to an index space.
    pub(super) fn short_name(&self, space: &IndexSpace) -> Option<&str> {
        match space {
            IndexSpace::Set(set) => Some(&self.model.sets[*set].name),
            IndexSpace::Range(range) => Some(&self.model.parameters[range.high.size?].name),
        }
    }

    /// The fields and families of a program, with their index spaces.
    pub(super) fn ranging(&self) -> impl Iterator<Item = (&str, IndexSpace)> {
        let fields = self.model.parameters.values().filter_map(|it| match it.over.as_slice() {
            [over] => Some((it.name.as_str(), *over)),
            _ => None,
        });
        let families = self.model.variables.values().filter(|it| it.previous_of.is_none());
        fields.chain(families.filter_map(|it| Some((it.name.as_str(), it.family?.over))))
    }

    /// The index space of the rows of a table.
    ///
    /// # Errors
    /// There is no such set; the columns do not determine one.
    pub(super) fn space(&self, of: Option<&str>, records: &Records) -> Result<IndexSpace, Error> {
        let mut spaces: Vec<IndexSpace> = Vec::new();
        for (_, space) in self.ranging() {
            if !spaces.contains(&space) {
                spaces.push(space);
            }
        }
        if let Some(of) = of {
            let found = spaces.iter().find(|space| self.short_name(space) == Some(of));
            return found.copied().ok_or_else(|| {
                let names: Vec<&str> = spaces.iter().filter_map(|space| self.short_name(space)).collect();
                let help = match (near(of, names.iter().copied()), names.is_empty()) {
                    (Some(near), _) => format!("did you mean `{near}`?"),
                    (None, true) => "the program has none".to_owned(),
                    (None, false) => {
                        format!("rows can be elements of {}", listed(names.iter().copied(), "or"))
                    }
                };
                Error::input(
                    of,
                    format!("no field and no family ranges over a set or a size of this name; {help}"),
                )
            });
        }
        let columns = || records.columns.iter().map(|column| column.trim());
        let is_of = |column: &str, space: &IndexSpace| {
            let names = matches!(space, IndexSpace::Set(set) if self.model.sets[*set].name == column);
            names || self.ranging().any(|(name, over)| name == column && over == *space)
        };
        let has = |space: &IndexSpace| columns().any(|column| is_of(column, space));
        let found: Vec<IndexSpace> = spaces.iter().copied().filter(has).collect();
        match (found.as_slice(), spaces.as_slice()) {
            ([one], _) | ([], [one]) => Ok(*one),
            ([], []) => Err(self.wrong(
                records,
                format!("`{}` has no family and no field, whose elements rows could be", self.model.name),
            )),
            ([], _) => {
                let names = self.ranging().map(|(name, _)| name);
                Err(self.wrong(
                    records,
                    format!(
                        "no column is named as a family or a field of the program, which has {}",
                        listed(names, "and")
                    ),
                ))
            }
            (several, _) => {
                let names: Vec<String> = several.iter().map(|space| self.space_name(space)).collect();
                let file = records.path.display().to_string();
                let example = several.iter().find_map(|space| self.short_name(space)).unwrap_or("Rows");
                let message = format!(
                    "its columns range over {}: say what the rows are, as `{}`, or divide the table",
                    names.join(" and over "),
                    Advice::RowsOf(example, &file)
                );
                Err(self.wrong(records, message))
            }
        }
    }

    /// The size that a number of rows gives.
    pub(super) fn count(&mut self, space: &IndexSpace, records: &Records) -> Result<(), Error> {
        let (rows, name) = (records.len(), self.space_name(space));
        if rows == 0 {
            return Err(self.wrong(records, format!("it has no rows, so {name} would have no element")));
        }
        let size = match space {
            IndexSpace::Set(_) => rows as i64,
            IndexSpace::Range(range) => rows as i64 + range.low - 1 - range.high.offset,
        };
        let (expected, named) = match self.short_name(space) {
            Some(short) => ((self.size)(short).map(|size| size as i64), Some(short.to_owned())),
            None => (Some(0), None),
        };
        if expected.is_some_and(|expected| expected != size) || size < i64::from(named.is_some()) {
            let plural = if rows == 1 { "" } else { "s" };
            let expected = match (&named, expected) {
                (Some(named), Some(expected)) => format!("`{named}` was set to {expected}"),
                _ => format!("the program has the elements {name}"),
            };
            return Err(self.wrong(records, format!("it has {rows} row{plural}, but {expected}")));
        }
        self.data.sizes.extend(named.map(|named| (named, size as usize)));
        Ok(())
    }
}
