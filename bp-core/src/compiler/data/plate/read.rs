//! Reads tables whose rows are elements.
//!
//! In: a program, tables, perhaps the set of each. Out: [`PlateData`]. Invariant: a table belongs to one set, by
//! default that of its columns; an index that is data is an element of its set.

use super::{Family, Field, Place, PlateData};
use crate::data::{Records, Values, is_missing};
use crate::door::Advice;
use crate::error::Error;
use crate::guess::{listed, near};
use crate::ids::{ExpressionId, ParameterId, SetId};
use crate::model::{Expression, IndexSpace, Model, ParameterKind};
use crate::spelling::number as written;
use std::collections::HashMap;

impl PlateData {
    /// Reads tables, each perhaps with the set, or the size that bounds a range, that its rows are elements of; `size` gives the sizes that were set, by name.
    ///
    /// # Errors
    /// A column that names nothing of its set; a cell that is no value of its field or family; a missing cell of a field; an
    /// index outside its set; a number of rows that is not the size of the set.
    pub fn read(
        model: &Model,
        tables: Vec<(Option<String>, Records)>,
        ignore: &[String],
        size: &dyn Fn(&str) -> Option<usize>,
    ) -> Result<Self, Error> {
        let mut reader = Reader { model, ignore, size, data: Self::default(), names: HashMap::new() };
        let mut spaces: Vec<IndexSpace> = Vec::new();
        for (of, records) in tables {
            let space = reader.space(of.as_deref(), &records)?;
            if spaces.contains(&space) {
                let name = reader.space_name(&space);
                return Err(reader.wrong(&records, format!("another table has the rows of {name} already")));
            }
            reader.count(&space, &records)?;
            reader.data.tables.push(records);
            spaces.push(space);
        }
        for (table, space) in spaces.iter().enumerate() {
            reader.element_names(table, space)?;
        }
        for (table, space) in spaces.iter().enumerate() {
            reader.columns(table, space)?;
        }
        reader.indices()?;
        reader.data.spaces = spaces;
        let names = reader.names.into_iter().map(|(set, (names, _))| (set, names));
        Ok(Self { names: names.collect(), ..reader.data })
    }
}

pub(super) struct Reader<'r> {
    pub(super) model: &'r Model,
    ignore: &'r [String],
    pub(super) size: &'r dyn Fn(&str) -> Option<usize>,
    pub(super) data: PlateData,
    /// The names of the elements of a set, and whether a table of the set fixes them.
    names: HashMap<SetId, (Vec<String>, bool)>,
}

impl Reader<'_> {
    pub(super) fn wrong(&self, records: &Records, message: String) -> Error {
        super::super::wrong(&records.path, message)
    }

    /// A size that was set, or that a table has.
    fn known_size(&self, name: &str) -> Option<usize> {
        let own = self.data.sizes.iter().find(|(known, _)| known == name).map(|(_, size)| *size);
        own.or_else(|| (self.size)(name))
    }

    /// A column that is called as the set of its table names the elements.
    fn element_names(&mut self, table: usize, space: &IndexSpace) -> Result<(), Error> {
        let records = &self.data.tables[table];
        let IndexSpace::Set(set) = space else { return Ok(()) };
        let Some(column) = records.columns.iter().position(|it| it.trim() == self.model.sets[*set].name)
        else {
            return Ok(());
        };
        let mut names: Vec<String> = Vec::with_capacity(records.len());
        for row in 0..records.len() {
            let name = records.text(row, column).trim().to_owned();
            if is_missing(&name) {
                return Err(records.wrong(row, column, "missing; each row needs the name of its element"));
            }
            if let Some(first) = names.iter().position(|known| *known == name) {
                let message = format!(
                    "the name of row {} too; each element has a name of its own",
                    records.line(first)
                );
                return Err(records.wrong(row, column, message));
            }
            names.push(name);
        }
        self.names.insert(*set, (names, true));
        Ok(())
    }

    fn columns(&mut self, table: usize, space: &IndexSpace) -> Result<(), Error> {
        for column in 0..self.data.tables[table].columns.len() {
            let records = &self.data.tables[table];
            let name = records.columns[column].trim().to_owned();
            let is_names = matches!(space, IndexSpace::Set(set) if self.model.sets[*set].name == name);
            if is_names || self.ignore.contains(&name) {
                continue;
            }
            let place = Place { table, column };
            let model = self.model;
            let field = model.parameters.iter().find(|(_, it)| it.name == name && it.over == [*space]);
            let family = model.variables.iter().find(|(_, it)| {
                it.name == name
                    && it.previous_of.is_none()
                    && it.family.is_some_and(|family| family.over == *space)
            });
            if let Some((parameter, declared)) = field {
                let numbers = match declared.kind {
                    ParameterKind::Element(set) => self.elements(place, set)?,
                    kind => self.numbers(place, &name, kind)?,
                };
                self.data.fields.push(Field { parameter, name, place, numbers });
            } else if let Some((variable, declared)) = family {
                if model.components(variable) > 1 {
                    let message =
                        format!("`{name}` is a family of vectors, whose values are no cells of one column");
                    return Err(self.wrong(records, message));
                }
                let values = Values::new(model, variable, &|name| self.known_size(name));
                let cell =
                    |row| Ok(records.cell(row, column, &values)?.map_or(f64::NAN, |value| value.number));
                let read = (0..records.len()).map(cell).collect::<Result<Vec<f64>, Error>>()?;
                let first = declared.family.map_or(0, |family| family.over.first());
                self.data.families.push(Family { variable, name, place, first, values: read });
            } else {
                return Err(self.unknown(table, &name, space));
            }
        }
        Ok(())
    }

    fn unknown(&self, table: usize, name: &str, space: &IndexSpace) -> Error {
        let records = &self.data.tables[table];
        let own: Vec<&str> = self.ranging().filter(|(_, over)| over == space).map(|(name, _)| name).collect();
        let open =
            own.iter().copied().filter(|own| records.columns.iter().all(|column| column.trim() != *own));
        let over = self.space_name(space);
        let known = self.model.variables.values().any(|it| it.name == name)
            || self.model.parameters.values().any(|it| it.name == name);
        let what = match known {
            true => format!("`{name}` does not range over {over}: it has no value for each row"),
            false => format!("no field and no family over {over} has the name of the column `{name}`"),
        };
        let help = match near(name, open) {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                format!("there are {}; or ignore the column: `{}`", listed(own, "and"), Advice::Ignore(name))
            }
        };
        self.wrong(records, format!("{what}; {help}"))
    }

    /// The numbers of a field; `true` is 1, `false` is 0.
    fn numbers(&self, place: Place, name: &str, kind: ParameterKind) -> Result<Vec<f64>, Error> {
        let (records, column) = (&self.data.tables[place.table], place.column);
        let values = Values::reals(name);
        let number = |row| {
            let number = match records.text(row, column).trim().to_ascii_lowercase().as_str() {
                "true" => 1.0,
                "false" => 0.0,
                _ => match records.cell(row, column, &values)? {
                    Some(value) => value.number,
                    None => {
                        let message = format!(
                            "missing, but `{name}` is a field: it needs a number in each row (a family may lack some)"
                        );
                        return Err(records.wrong(row, column, message));
                    }
                },
            };
            match kind.refuses(number) {
                Some(expected) => {
                    Err(records.wrong(row, column, format!("not a value of `{name}`, which is {expected}")))
                }
                None => Ok(number),
            }
        };
        (0..records.len()).map(number).collect()
    }

    /// The elements that the cells of a column name: whole numbers from 0, or else texts, numbered as they first occur.
    fn elements(&mut self, place: Place, set: SetId) -> Result<Vec<f64>, Error> {
        let (records, column) = (&self.data.tables[place.table], place.column);
        let set_name = &self.model.sets[set].name;
        let texts: Vec<&str> = (0..records.len()).map(|row| records.text(row, column).trim()).collect();
        if let Some(row) = texts.iter().position(|text| is_missing(text)) {
            let message = format!("missing, but each row needs an element of `{set_name}`");
            return Err(records.wrong(row, column, message));
        }
        let whole =
            |text: &&str| text.parse().ok().filter(|number: &f64| number.fract() == 0.0 && *number >= 0.0);
        let numbers: Option<Vec<f64>> = match self.names.contains_key(&set) {
            true => None,
            false => texts.iter().map(whole).collect(),
        };
        if let Some(numbers) = numbers {
            return Ok(numbers);
        }
        let (names, fixed) = self.names.entry(set).or_default();
        let mut places: HashMap<String, usize> =
            names.iter().cloned().enumerate().map(|(at, name)| (name, at)).collect();
        let mut found = Vec::with_capacity(texts.len());
        for (row, text) in texts.iter().enumerate() {
            let next = places.len();
            let place = match places.get(*text) {
                Some(place) => *place,
                None if *fixed => {
                    let help = match near(text, names.iter().map(String::as_str)) {
                        Some(near) => format!("; did you mean `{near}`?"),
                        None => String::new(),
                    };
                    return Err(records.wrong(row, column, format!("not an element of `{set_name}`{help}")));
                }
                None => {
                    places.insert((*text).to_owned(), next);
                    names.push((*text).to_owned());
                    next
                }
            };
            found.push(place as f64);
        }
        let shown: Vec<String> =
            names.iter().take(6).enumerate().map(|(at, name)| format!("{at} is `{name}`")).collect();
        let rest = if names.len() > shown.len() { ", …" } else { "" };
        let note = format!("elements of `{set_name}`: {}{rest}", shown.join(", "));
        if !*fixed {
            self.data.notes.retain(|known| !known.starts_with(&format!("elements of `{set_name}`")));
            self.data.notes.push(note);
        }
        Ok(found)
    }

    /// Refuses indices outside their sets; sets without a size have that of the largest index.
    fn indices(&mut self) -> Result<(), Error> {
        for (set, declared) in self.model.sets.iter() {
            let of_set =
                |field: &&Field| self.model.parameters[field.parameter].kind == ParameterKind::Element(set);
            let fields: Vec<&Field> = self.data.fields.iter().filter(of_set).collect();
            let largest = fields.iter().flat_map(|field| &field.numbers).copied().fold(-1.0, f64::max);
            let named = self.names.get(&set).map_or(0, |(names, _)| names.len());
            match self.known_size(&declared.name) {
                Some(size) => {
                    for field in fields {
                        let expected = format!(
                            "not an element of `{}`, which has {size}, counted from 0",
                            declared.name
                        );
                        self.inside(field, (0.0, size as f64 - 1.0), &expected)?;
                    }
                }
                None if largest >= 0.0 => {
                    self.data.sizes.push((declared.name.clone(), named.max(largest as usize + 1)));
                }
                None => {}
            }
        }
        let model = self.model;
        let mut uses: Vec<(ParameterId, String, IndexSpace)> = Vec::new();
        let mut used = |index: ExpressionId, name: &str, over: &IndexSpace| {
            if let Expression::Parameter { parameter, .. } = model.expressions[index] {
                uses.push((parameter, name.to_owned(), *over));
            }
        };
        for expression in model.expressions.values() {
            match expression {
                Expression::Variable(use_) => {
                    if let (Some(index), Some(family)) = (use_.element, model.variables[use_.variable].family)
                    {
                        used(index, &model.variables[use_.variable].name, &family.over);
                    }
                }
                Expression::Parameter { parameter, indices } => {
                    let declared = &model.parameters[*parameter];
                    indices
                        .iter()
                        .zip(&declared.over)
                        .for_each(|(index, over)| used(*index, &declared.name, over));
                }
                _ => {}
            }
        }
        for (parameter, name, over) in uses {
            let IndexSpace::Range(range) = over else { continue };
            let size = range.high.size.map_or(Some(0), |id| self.known_size(&model.parameters[id].name));
            let (Some(size), Some(field)) =
                (size, self.data.fields.iter().find(|it| it.parameter == parameter))
            else {
                continue;
            };
            let (low, high) = (range.low, size as i64 + range.high.offset);
            let expected = format!("not an index of `{name}`, which has the elements {low} to {high}");
            self.inside(field, (low as f64, high as f64), &expected)?;
        }
        Ok(())
    }

    fn inside(&self, field: &Field, (low, high): (f64, f64), expected: &str) -> Result<(), Error> {
        let outside = |number: &f64| !(*number >= low && *number <= high && number.fract() == 0.0);
        match field.numbers.iter().position(outside) {
            Some(row) => {
                let records = &self.data.tables[field.place.table];
                let found = written(field.numbers[row]);
                let message = match records.text(row, field.place.column).trim() == found {
                    true => expected.to_owned(),
                    false => format!("{found}, {expected}"),
                };
                Err(records.wrong(row, field.place.column, message))
            }
            None => Ok(()),
        }
    }
}
