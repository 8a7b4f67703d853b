//! What is computed of each case: the columns of a batch.
//!
//! In: a program, the names of the observed columns, and those of the wanted variables. Out: [`Wanted`]. Invariant: nothing here
//! depends on a cell, so that the parts of a table have the same columns wherever it is divided.

use super::super::expanded::{expanded, is_expanded};
use super::super::marginals::Names;
use super::super::{Evidence, Program, Value};
use crate::analysis::relevant_factors;
use crate::answer::{Slot, marginals_strategy};
use crate::data::{Records, Values};
use crate::distribution::Setting;
use crate::error::Error;
use crate::ids::{FactorId, VariableId};
use crate::learn::sizes;
use crate::model::{Ask, IndexSpace, Model, Question, Searched, Statistic, When};
use crate::plan::Strategy;
use crate::strategies::weighting::refused_factor;
use std::collections::BTreeSet;

/// The observed and the wanted variables of all cases.
pub(super) struct Wanted {
    /// The program, with the sizes that the columns tell.
    pub(super) program: Program,
    /// For each column of the table its variable, or the family of its element.
    pub(super) observed: Vec<VariableId>,
    /// The names of the columns of the table.
    pub(super) names: Vec<String>,
    /// The wanted variables and elements, in the order of the columns.
    pub(super) slots: Vec<Slot>,
}

impl Wanted {
    /// # Errors
    /// A column or a wanted name that is no variable; a size that is missing.
    pub(super) fn new(program: &Program, records: &Records, only: &[String]) -> Result<Self, Error> {
        super::super::marginals::without_rows(program)?;
        let (program, names) = (sized(program, records)?, records.columns.clone());
        let inputs = program.settings.inputs();
        let setting = Setting::new(program.model(), &inputs)?;
        let known = Names { program: &program, setting: &setting };
        let observed = (names.iter().enumerate())
            .map(|(column, name)| observed(&known, records, (column, name)))
            .collect::<Result<_, Error>>()?;
        let slots = slots(&known, only)?;
        Ok(Self { observed, names, slots, program })
    }

    /// The names of the numbers of a case.
    pub(super) fn columns(&self) -> Vec<String> {
        let mut all = vec!["ln_p_evidence".to_owned()];
        for slot in &self.slots {
            let name = slot.name(self.program.model());
            match slot.count {
                0 => all.extend([format!("{name}.mean"), format!("{name}.deviation")]),
                count => all.extend((0..count).map(|value| {
                    format!("{name}={}", self.program.model().value_name(slot.variable, value))
                })),
            }
        }
        all
    }

    /// The model, extended by what its answers derive, and the factors that matter, if a join tree of them answers: all that
    /// matters is finite.
    ///
    /// # Errors
    /// No strategy answers.
    pub(super) fn tree(&self) -> Result<Option<(Model, Vec<FactorId>)>, Error> {
        let program = &self.program;
        if program.model().plate.is_some() || self.slots.is_empty() {
            return Ok(None);
        }
        let question = Question { name: "marginals".to_owned(), asks: self.asks(), derived: Vec::new() };
        let (model, question) = program.model().posed(&question);
        let is_finite = |id: &VariableId| model.variables[*id].domain.is_finite();
        let factors = relevant_factors(&model, &question.asks);
        let has_table = |id: &FactorId| {
            let factor = &model.factors[*id];
            factor.left.iter().chain(&factor.right).all(|use_| is_finite(&use_.variable))
                && refused_factor(&model, factor).is_none()
        };
        let mut named = self.slots.iter().map(|slot| &slot.variable).chain(&self.observed);
        if !named.all(is_finite) || !factors.iter().all(has_table) {
            return Ok(None);
        }
        let by_tree = match model.variables.values().all(|variable| variable.domain.is_finite()) {
            true => marginals_strategy(program.model(), program.options)? == Strategy::JoinTree,
            // The planner counts variables that do not matter here, and that are not finite.
            false => {
                program.options.by.is_none_or(|by| by == Strategy::JoinTree)
                    && program.options.budget.is_none()
            }
        };
        Ok(by_tree.then(|| (model.into_owned(), factors)))
    }

    /// Questions about each variable that is wanted or observed, which matter in all cases. None knows the values of another: of a sum of
    /// many variables there is a table of parts, never one over all of them.
    fn asks(&self) -> Vec<Ask> {
        let wanted = self.slots.iter().map(|slot| slot.variable).chain(self.observed.iter().copied());
        let all: BTreeSet<VariableId> =
            wanted.chain(self.program.opened.known.iter().map(|known| known.variable)).collect();
        let ask = |variable| Ask {
            statistic: Statistic::Distribution,
            when: When::Now,
            searched: vec![Searched { variable, at: None }],
            known: Vec::new(),
        };
        all.into_iter().map(ask).collect()
    }

    /// How the cells of a column are read.
    pub(super) fn values(&self, column: usize) -> Values<'_> {
        let size = |name: &str| self.program.settings.size(name);
        Values::new(self.program.model(), self.observed[column], &size)
    }

    /// The program with its families expanded, where elements that are observed or wanted need it: once for all cases.
    ///
    /// # Errors
    /// A family with another number of values than elements.
    pub(super) fn expanded(&self) -> Result<Option<(Program, Vec<String>)>, Error> {
        if !is_expanded(self.program.model()) {
            return Ok(None);
        }
        let evidence: Evidence = self.names.iter().map(|name| (name.clone(), Value::Bool(true))).collect();
        let found = expanded(&self.program, &self.wanted_names(), &evidence)?;
        Ok(found.map(|(program, names, _)| (program, names)))
    }

    /// The names of what is wanted.
    pub(super) fn wanted_names(&self) -> Vec<String> {
        self.slots.iter().map(|slot| slot.name(self.program.model())).collect()
    }
}

/// The variable of a column.
fn observed(
    known: &Names<'_>,
    records: &Records,
    (column, name): (usize, &String),
) -> Result<VariableId, Error> {
    let model = known.program.model();
    let names = known.program.variables();
    let plain = name.split('[').next().unwrap_or(name).trim();
    if model.variable(name).is_none() && model.variable(plain).is_none() {
        return Err(records.unknown(column, names.iter().map(String::as_str)));
    }
    let (variable, element) = known.find(name)?;
    let mut slots = known.setting.slots_of(variable);
    match (element, slots.len()) {
        (None, 2..) => {
            let first = known.setting.slot_name(slots.start);
            let last = known.setting.slot_name(slots.next_back().unwrap_or_default());
            let message = format!("it has several elements: give a column to each, `{first}` to `{last}`");
            Err(Error::input(name, message))
        }
        _ => Ok(variable),
    }
}

/// The wanted slots: those named, in their order, or all that an answer shows.
fn slots(names: &Names<'_>, only: &[String]) -> Result<Vec<Slot>, Error> {
    let (model, setting) = (names.program.model(), names.setting);
    let mut slots: Vec<usize> = Vec::new();
    if only.is_empty() {
        let shown = model.variables.ids().filter(|id| names.program.shows(*id));
        slots.extend(shown.flat_map(|id| setting.slots_of(id)));
    }
    for name in only {
        let (variable, element) = names.find(name)?;
        let all = setting.slots_of(variable);
        match element {
            Some(element) => slots.push(all.start + element),
            None => slots.extend(all),
        }
    }
    let mut seen = std::collections::HashSet::new();
    slots.retain(|slot| seen.insert(*slot));
    Ok(slots.into_iter().map(|slot| Slot::of(setting, slot)).collect())
}

/// The program with the sizes that the names of the columns tell: `Z[3]` is the third element at least.
fn sized(program: &Program, records: &Records) -> Result<Program, Error> {
    let model = program.model();
    if model.plate.is_some() {
        return Ok(program.clone());
    }
    let inputs = sizes(model, records, program.settings.inputs())?;
    let mut own = program.clone();
    for name in sizes_of(model) {
        if let (None, Some(size)) = (program.settings.size(&name), inputs.find_size(&name)) {
            own = own.with(&name, size as i64)?;
        }
    }
    Ok(own)
}

/// The names of the sizes of families.
fn sizes_of(model: &Model) -> Vec<String> {
    let families = model.variables.values().filter_map(|variable| variable.family);
    let name = |over| match over {
        IndexSpace::Set(set) => Some(model.sets[set].name.clone()),
        IndexSpace::Range(range) => range.high.size.map(|size| model.parameters[size].name.clone()),
    };
    families.filter_map(|family| name(family.over)).collect()
}
