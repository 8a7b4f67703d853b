//! Data as a plate: the rows of a table are the elements of a set, or of a range, of a program.
//!
//! In: a program and tables. Out: [`PlateData`]: the sizes of sets, the numbers of fields, the values of families. Invariant:
//! every column is a field, a family, names of elements, or ignored; row n is the n-th element; an error names file, row,
//! column and cell.

mod asked;
mod read;
mod spaces;

use super::Records;
use crate::ids::{ParameterId, SetId, VariableId};
use crate::model::{IndexSpace, Model};

/// The data of tables about the elements of sets.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PlateData {
    tables: Vec<Records>,
    /// The index space of the rows of each table.
    spaces: Vec<IndexSpace>,
    /// The sizes of sets, and of parameters that bound ranges, by name.
    pub sizes: Vec<(String, usize)>,
    fields: Vec<Field>,
    families: Vec<Family>,
    /// The names of the elements of sets.
    names: Vec<(SetId, Vec<String>)>,
    /// Notes for the user on the reading.
    pub notes: Vec<String>,
}

/// A column of numbers that are given.
#[derive(Clone, PartialEq, Debug)]
struct Field {
    parameter: ParameterId,
    name: String,
    place: Place,
    numbers: Vec<f64>,
}

/// A column of values that are observed; NaN where a cell is missing.
#[derive(Clone, PartialEq, Debug)]
struct Family {
    variable: VariableId,
    name: String,
    place: Place,
    /// The index of the first element.
    first: i64,
    values: Vec<f64>,
}

/// A table and its column.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Place {
    table: usize,
    column: usize,
}

impl PlateData {
    /// Whether there is no table.
    pub fn is_empty(&self) -> bool {
        self.tables.is_empty()
    }

    /// Gives the elements of sets the names that they have in the tables.
    pub fn name_elements(&self, model: &mut Model) {
        for (set, names) in &self.names {
            model.sets[*set].elements.clone_from(names);
        }
    }

    /// The tables, in the order in which they were given.
    pub fn tables(&self) -> &[Records] {
        &self.tables
    }

    /// The numbers of each field and the values of each family, by name; NaN is a missing value.
    pub fn numbers(&self) -> impl Iterator<Item = (&str, &[f64])> {
        let fields = self.fields.iter().map(|field| (field.name.as_str(), field.numbers.as_slice()));
        fields.chain(self.families.iter().map(|family| (family.name.as_str(), family.values.as_slice())))
    }

    /// The families that have no column, though the rows of a table could be their elements.
    pub fn without_column(&self, model: &Model) -> Vec<VariableId> {
        let lacks = |id: &VariableId| {
            let variable = &model.variables[*id];
            variable.previous_of.is_none()
                && variable.family.is_some_and(|family| self.spaces.contains(&family.over))
                && !self.families.iter().any(|family| family.variable == *id)
        };
        model.variables.ids().filter(lacks).collect()
    }

    /// The elements of families: the family, the index of the element, its number; NaN where it is missing.
    pub fn elements(&self) -> impl Iterator<Item = (VariableId, i64, f64)> {
        self.families.iter().flat_map(|family| {
            let all = (family.first..).zip(&family.values);
            all.map(|(index, value)| (family.variable, index, *value))
        })
    }

    /// The elements that are observed.
    pub fn observed(&self) -> impl Iterator<Item = (VariableId, i64, f64)> {
        self.elements().filter(|(.., value)| !value.is_nan())
    }

    /// The families with missing cells: whether each element is missing, in the order of [`PlateData::missing`].
    pub fn missing_elements(&self) -> impl Iterator<Item = (VariableId, Vec<bool>)> {
        let elements =
            |family: &Family| (family.variable, family.values.iter().map(|value| value.is_nan()).collect());
        self.families.iter().filter(|family| family.missing().next().is_some()).map(elements)
    }

    /// The missing cells of families, in the order of [`PlateData::missing`]: of which table, its row, its column.
    pub fn missing_cells(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        self.families.iter().flat_map(|family| {
            let Place { table, column } = family.place;
            family.missing().map(move |index| (table, (index - family.first) as usize, column))
        })
    }
}

impl Family {
    /// The indices of the elements whose cells are missing.
    fn missing(&self) -> impl Iterator<Item = i64> {
        let indices = (self.first..).zip(&self.values);
        indices.filter(|(_, value)| value.is_nan()).map(|(index, _)| index)
    }

    /// The row of an element whose cell has a value.
    fn row_of(&self, index: i64) -> Option<usize> {
        let row = usize::try_from(index - self.first).ok()?;
        self.values.get(row).filter(|value| !value.is_nan()).map(|_| row)
    }
}
