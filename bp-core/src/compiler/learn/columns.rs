//! Reads cases from a table: the roles of its columns.
//!
//! In: a table with a header, and the roles of its columns ([`Columns`]). Out: cases. Invariant: every column is a
//! variable, the weight, or ignored; every variable has a column, or is declared hidden; so a misspelled name is an
//! error, and never a variable learned without data.

use super::distinct::{DistinctCases, MISSING};
use super::family_columns::{elements_apart, first_of, is_family, without_columns};
use super::learner::{Learner, NO_WEIGHT, count_seen, is_weight};
use super::program::Program;
use crate::analysis::carried;
use crate::data::{Cells, PlateData, Records, Values, is_missing};
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess::near;
use crate::ids::VariableId;
use crate::model::{Domain, IndexSpace, Model};
use crate::spelling::quoted;
use std::collections::{HashMap, HashSet};

/// The roles of the columns of a table, besides their names.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Columns {
    /// Hidden variables, or elements of families.
    pub hidden: Vec<String>,
    /// Ignored columns.
    pub ignore: Vec<String>,
    /// The column of weights.
    pub weight: Option<String>,
    /// Over time: the column that identifies the sequence of a row; rows with the same text follow each other.
    pub sequence: Option<String>,
}

/// The role of a column.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Slot(usize),
    Weight,
    Sequence,
    Ignored,
}

impl Learner {
    /// Observes all rows of a table.
    ///
    /// # Errors
    /// A column that no variable has, or a variable that has no column and is not declared hidden: the error suggests a
    /// name. A cell is not a value of its variable: the error names file, row, column and value.
    pub fn observe_table(&mut self, table: &Records, columns: &Columns) -> Result<(), Error> {
        let program = &self.learnable.program;
        let roles = roles(program, table, columns)?;
        if table.is_empty() {
            let message = "it has no rows: there is nothing to learn from";
            return Err(Error::input(table.path.display().to_string(), message));
        }
        let over_time = !carried(&program.model).is_empty();
        let mut cells = Row::of(program, table, &roles);
        let alone = program.plate_slot().filter(|_| !over_time);
        let (mut distinct, mut sequential) = (DistinctCases::new(program), Vec::new());
        let mut seen = vec![0; program.slots.len()];
        for row in 0..table.len() {
            let (key, weight) = cells.read(row)?;
            if let Some(index) = alone.filter(|slot| key[*slot] == MISSING) {
                let name = &program.slots[index].name;
                let message = "it is missing, but the program is repeated over it";
                return Err(table.wrong_row(row, Error::input(name, message)));
            }
            match over_time {
                true => sequential.push((key.to_vec(), weight)),
                false => {
                    count_seen(&mut seen, key);
                    if weight > 0.0 {
                        distinct.add(key, weight);
                    }
                }
            }
        }
        self.weighted |= columns.weight.is_some();
        if let Some(column) = &columns.sequence {
            let column = table.needed(column)?;
            self.is_over_time()?;
            return self.sequences_of(table, column, sequential.into_iter().map(|(key, _)| key));
        }
        if over_time {
            self.begin(String::new());
            // Beside cells of X^-1 a row without one is a transition of which it is hidden.
            let apart = sequential.iter().any(|(key, _)| !self.is_instant(key));
            sequential.into_iter().for_each(|(key, weight)| self.take(key, weight, apart));
            return Ok(());
        }
        self.observed.append(distinct);
        self.seen.iter_mut().zip(seen).for_each(|(all, seen)| *all += seen);
        self.cases += table.len();
        Ok(())
    }
}

/// Reads the rows of a table as cases.
struct Row<'t> {
    table: &'t Records,
    /// The columns that are read, with their roles.
    columns: Vec<(Role, usize, Cells<'t>)>,
    /// The case of the last row: the bits of the number in each slot.
    key: Vec<u64>,
}

impl<'t> Row<'t> {
    fn of(program: &'t Program, table: &'t Records, roles: &[Role]) -> Self {
        let size = |name: &str| program.size(name);
        let values = |role: &Role| match role {
            Role::Slot(slot) => Some(Values::new(&program.model, program.slots[*slot].variable, &size)),
            Role::Weight => Some(Values::reals("weight")),
            Role::Sequence | Role::Ignored => None,
        };
        let column =
            |(column, role): (usize, &Role)| Some((*role, column, Cells::new(table, column, values(role)?)));
        let columns = roles.iter().enumerate().filter_map(column).collect();
        Self { table, columns, key: vec![MISSING; program.slots.len()] }
    }

    /// The case of a row, and its weight.
    fn read(&mut self, row: usize) -> Result<(&[u64], f64), Error> {
        let mut weight = 1.0;
        for (role, column, cells) in &mut self.columns {
            match (role, cells.value(row)?) {
                (Role::Slot(slot), value) => {
                    self.key[*slot] = value.map_or(MISSING, |value| (value.number + 0.0).to_bits());
                }
                (Role::Weight, Some(value)) if is_weight(value.number) => weight = value.number,
                (Role::Weight, _) => return Err(self.table.wrong(row, *column, NO_WEIGHT)),
                _ => {}
            }
        }
        Ok((&self.key, weight))
    }
}

impl Learner {
    /// Observes rows, those of each sequence together, in the order in which the sequences begin.
    fn sequences_of(
        &mut self,
        table: &Records,
        column: usize,
        keys: impl Iterator<Item = Vec<u64>>,
    ) -> Result<(), Error> {
        let mut sequences: Vec<(String, Vec<Vec<u64>>)> = Vec::new();
        let mut known: HashMap<String, usize> = HashMap::new();
        for (row, key) in keys.enumerate() {
            let name = table.text(row, column).trim().to_owned();
            if is_missing(&name) {
                return Err(table.wrong(row, column, "missing; each row belongs to a sequence"));
            }
            let position = *known.entry(name.clone()).or_insert_with(|| {
                sequences.push((name, Vec::new()));
                sequences.len() - 1
            });
            sequences[position].1.push(key);
        }
        for (name, keys) in sequences {
            self.begin(name);
            keys.into_iter().for_each(|key| {
                let apart = !self.is_instant(&key);
                self.take(key, 1.0, apart);
            });
        }
        Ok(())
    }
}

/// The role of each column.
fn roles(program: &Program, table: &Records, columns: &Columns) -> Result<Vec<Role>, Error> {
    let wrong = |message: String| Error::input(table.path.display().to_string(), message);
    let known = || table.columns.iter().map(String::as_str);
    let did_you_mean =
        |near: Option<&str>| near.map_or_else(|| listed(known()), |near| format!("did you mean `{near}`?"));
    for name in columns.ignore.iter().chain(&columns.weight).chain(&columns.sequence) {
        if !table.columns.contains(name) {
            let help = did_you_mean(near(name, known()));
            return Err(wrong(format!("there is no column `{name}`; {help}")));
        }
    }
    let mut roles = Vec::with_capacity(table.columns.len());
    for column in &table.columns {
        let is_weight = columns.weight.as_ref() == Some(column);
        roles.push(match program.slot(column.trim()) {
            _ if is_weight => Role::Weight,
            _ if columns.sequence.as_ref() == Some(column) => Role::Sequence,
            _ if columns.ignore.contains(column) => Role::Ignored,
            Some(slot) => Role::Slot(slot),
            None if is_family(&program.model, column) => {
                return Err(wrong(elements_apart(&program.model, column.trim())));
            }
            None => {
                let slots = program.slots.iter().enumerate();
                let open = slots.filter(|(_, slot)| !table.columns.contains(&slot.name));
                let near = near(column, open.map(|(_, slot)| slot.name.as_str()));
                let ignore = Advice::Ignore(column);
                let over_time = !carried(&program.model).is_empty() && columns.sequence.is_none();
                let help = match near {
                    Some(near) => format!("did you mean `{near}`? Otherwise ignore the column: `{ignore}`"),
                    None if over_time => format!(
                        "if it identifies sequences, add `{}`; otherwise ignore it: `{ignore}`",
                        Advice::Sequence(column)
                    ),
                    None => match without_columns(program, table) {
                        Some(family) => format!(
                            "the columns of the family `{family}` are named by its elements, such as `{family}[{}]`; a column that is \
                             no variable is ignored: `{ignore}`",
                            first_of(&program.model, &family)
                        ),
                        None => format!("ignore the column: `{ignore}`"),
                    },
                };
                return Err(wrong(format!("`{}` has no variable named `{column}`; {help}", program.model.name)));
            }
        });
    }
    are_hidden(program, &columns.hidden, &|slot| roles.contains(&Role::Slot(slot)))?;
    for (position, slot) in program.slots.iter().enumerate() {
        let variable = &program.model.variables[slot.variable];
        let is_hidden = columns.hidden.iter().any(|name| is_named(program, slot, name))
            || program.model.hidden.contains(&slot.variable);
        if variable.previous_of.is_some() || is_hidden || roles.contains(&Role::Slot(position)) {
            continue;
        }
        let near = near(&slot.name, known().filter(|column| program.slot(column).is_none()));
        // Over time, a carried variable without a similarly named column is a hidden state; the plate's index counts
        // rows.
        let over_time = carried(&program.model);
        let is_state = over_time.iter().any(|(now, _)| *now == slot.variable)
            || (!over_time.is_empty() && program.plate_slot() == Some(position));
        if is_state && near.is_none() {
            continue;
        }
        let help = match near {
            Some(near) => format!("did you mean the column `{near}`?"),
            None => declare(program, slot.variable, &slot.name),
        };
        return Err(wrong(format!("there is no column for the variable `{}`; {help}", slot.name)));
    }
    Ok(roles)
}

/// Refuses names that are not variables, or that have a column, among those declared hidden.
fn are_hidden(program: &Program, hidden: &[String], has_column: &dyn Fn(usize) -> bool) -> Result<(), Error> {
    for name in hidden {
        let names = || {
            let variables = program.model.variables.ids().map(|id| program.model.variable_name(id));
            variables.chain(program.slots.iter().map(|slot| slot.name.clone()))
        };
        if !names().any(|own| own == *name) {
            let all: Vec<String> = names().collect();
            let help = near(name, all.iter().map(String::as_str));
            let help = help.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(wrong_name(program, name, &help));
        }
        let mut shown = program.slots.iter().enumerate().filter(|(_, slot)| is_named(program, slot, name));
        if let Some((_, slot)) = shown.find(|(slot, _)| has_column(*slot)) {
            let message = format!(
                "it is declared hidden, but there is a column `{0}`; to learn without the column, add `{1}`",
                slot.name,
                Advice::Ignore(&slot.name)
            );
            return Err(Error::input(name, message));
        }
    }
    Ok(())
}

/// Refuses rows without a column for a family whose elements they could be, if it is not declared hidden.
pub(super) fn are_columns(program: &Program, rows: &PlateData, hidden: &[String]) -> Result<(), Error> {
    let model = &program.model;
    let seen: HashSet<VariableId> = rows.elements().map(|(family, ..)| family).collect();
    are_hidden(program, hidden, &|slot| seen.contains(&program.slots[slot].variable))?;
    for id in rows.without_column(model) {
        let name = model.variable_name(id);
        if !hidden.contains(&name) && !model.hidden.contains(&id) {
            let message =
                format!("there is no column for the variable `{name}`; {}", declare(program, id, &name));
            return Err(Error::input(&model.name, message));
        }
    }
    Ok(())
}

/// How a variable is declared hidden.
fn declare(program: &Program, variable: VariableId, name: &str) -> String {
    format!(
        "if it is hidden, declare it: `{}`, or `hidden {};` in `identification`",
        Advice::Hidden(name),
        quoted(&program.model.variable_name(variable)),
    )
}

fn wrong_name(program: &Program, name: &str, help: &str) -> Error {
    Error::input(name, format!("`{}` has no variable of this name{help}", program.model.name))
}

/// Whether a name is that of a slot, or of its family.
fn is_named(program: &Program, slot: &super::program::Slot, name: &str) -> bool {
    slot.name == name || program.model.variable_name(slot.variable) == name
}

fn listed<'n>(columns: impl Iterator<Item = &'n str>) -> String {
    const MOST: usize = 12;
    let mut names: Vec<String> = columns.map(|name| format!("`{name}`")).collect();
    if names.len() > MOST {
        names.truncate(MOST);
        names.push("…".to_owned());
    }
    format!("the columns are {}", names.join(", "))
}

/// The inputs, with the sizes found in the columns of a table: for a family `L[k in Channels]` the largest index of a
/// column, for the set of the plate the largest value of its index.
///
/// # Errors
/// A cell of the index is not an element of the set.
pub fn sizes<'g>(model: &Model, table: &Records, given: Inputs<'g, f64>) -> Result<Inputs<'g, f64>, Error> {
    let mut given = given;
    let at_least = |name: &str, size: i64, given: Inputs<'g, f64>| {
        let known = super::program::set_size(name, &given).is_some();
        if known || size < 1 { given } else { given.size(name, size as usize).number(name, size as f64) }
    };
    for (id, variable) in model.variables.iter() {
        let Some(family) = variable.family else { continue };
        let prefix = format!("{}[", model.variable_name(id));
        let index = |column: &String| {
            column.trim().strip_prefix(&prefix)?.strip_suffix(']')?.trim().parse::<i64>().ok()
        };
        let Some(last) = table.columns.iter().filter_map(index).max() else {
            let size = match family.over {
                IndexSpace::Set(set) => Some(&model.sets[set].name),
                IndexSpace::Range(range) => range.high.size.map(|size| &model.parameters[size].name),
            };
            let name = model.variable_name(id);
            let is_column = table.columns.iter().any(|column| column.trim() == name);
            if is_column && size.is_some_and(|size| super::program::set_size(size, &given).is_none()) {
                return Err(Error::input(table.path.display().to_string(), elements_apart(model, &name)));
            }
            continue;
        };
        given = match family.over {
            IndexSpace::Set(set) => at_least(&model.sets[set].name, last.saturating_add(1), given),
            IndexSpace::Range(range) => match range.high.size {
                Some(size) if model.parameters[size].default.is_empty() => {
                    at_least(&model.parameters[size].name, last.saturating_sub(range.high.offset), given)
                }
                _ => given,
            },
        };
    }
    let index = model.plate_index();
    let column = index.and_then(|index| {
        let name = model.variable_name(index);
        table.columns.iter().position(|column| column.trim() == name)
    });
    if let (Some(index), None, true) = (index, column, carried(model).is_empty()) {
        let (name, columns) = (model.variable_name(index), || table.columns.iter().map(String::as_str));
        let help = near(&name, columns())
            .map_or_else(|| listed(columns()), |near| format!("did you mean `{near}`?"));
        let message = format!(
            "there is no column `{name}`, the index over which `{}` is repeated: each row needs it; {help}",
            model.name
        );
        return Err(Error::input(table.path.display().to_string(), message));
    }
    if let (Some(index), Some(column)) = (index, column)
        && let Domain::Set(set) = model.variables[index].domain
    {
        let values = Values::new(model, index, &|_| None);
        let mut last = -1;
        for row in 0..table.len() {
            if let Some(value) = table.cell(row, column, &values)? {
                last = last.max(value.number as i64);
            }
        }
        given = at_least(&model.sets[set].name, last + 1, given);
    }
    Ok(given)
}
