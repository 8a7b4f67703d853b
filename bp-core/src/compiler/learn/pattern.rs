//! Patterns: what all cases with the same missing slots share.
//!
//! In: which slots are observed. Out: the families that count, those fully observed and those with hidden slots, and a
//! tree of cliques for the hidden slots. Invariant: a family whose left-hand slots are missing, and on which no observed
//! variable depends, sums to one, unless it may leave its variable without a value: it is omitted.

use super::cliques::Cliques;
use super::program::Program;
use super::terms::Index;
use crate::analysis::is_proper;
use crate::error::Error;
use crate::model::Form;

/// Limit of the joint values of the hidden slots of one clique.
const MOST_VALUES: usize = 1 << 16;

/// A family with hidden slots.
#[derive(Clone, Debug)]
pub(super) struct Hidden {
    pub(super) family: usize,
    pub(super) slots: Vec<usize>,
    /// The number of their joint values.
    pub(super) cells: usize,
    pub(super) index: Index,
}

/// The structure common to all cases with the same missing slots.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// Families that are fully observed.
    pub(super) seen: Vec<usize>,
    pub(super) hidden: Vec<Hidden>,
    /// Of the hidden slots, if there are any.
    pub(super) cliques: Option<Cliques>,
}

impl Pattern {
    /// The structure of cases with these observed slots.
    pub(super) fn of(program: &Program, shown: &[bool]) -> Result<Self, Error> {
        if let Some(index) = program.plate_slot().filter(|slot| !shown[*slot]) {
            let message = "it is missing, but the program is repeated over it";
            return Err(Error::input(&program.slots[index].name, message));
        }
        // From the children up: a variable on which nothing observed depends sums to one, unless it may have no value.
        let (mut needed, mut kept) = (shown.to_vec(), Vec::new());
        for (number, family) in program.families.iter().enumerate().rev() {
            let factor = family.instance.factor;
            let is_finite = family.instance.left.iter().all(|slot| program.slots[*slot].count.is_some());
            let is_learned = matches!(program.model.factors[factor].form, Form::Unknown(_));
            let may_have_no_value = is_finite && !is_learned && !is_proper(&program.model, factor);
            if may_have_no_value || family.instance.left.iter().any(|slot| needed[*slot]) {
                family.slots.iter().for_each(|slot| needed[*slot] = true);
                kept.push(number);
            }
        }
        kept.reverse();
        let mut pattern = Pattern { seen: Vec::new(), hidden: Vec::new(), cliques: None };
        for number in kept {
            let family = &program.families[number];
            let (observed, hidden): (Vec<usize>, Vec<usize>) =
                family.slots.iter().copied().partition(|slot| shown[*slot]);
            if let Some(real) = hidden.iter().find(|slot| program.slots[**slot].count.is_none()) {
                let slot = &program.slots[*real];
                let domain = program.model.domain_text(&program.model.variables[slot.variable].domain);
                let head = program.head(family.instance.factor);
                let message = format!(
                    "it is `{domain}` and missing in some cases, on which `{head}` depends; only variables whose \
                     values can be listed may be hidden"
                );
                return Err(Error::input(&slot.name, message));
            }
            let form = &program.model.factors[family.instance.factor].form;
            let is_real = family.instance.left.iter().any(|slot| program.slots[*slot].count.is_none());
            if !hidden.is_empty() && is_real && form.has_point() && form.has_density() {
                let head = program.head(family.instance.factor);
                let message = format!(
                    "it is missing in some cases, but `{head}` has a point for some of its values and a density for others, \
                     which cannot be weighed against each other"
                );
                return Err(Error::input(&program.slots[hidden[0]].name, message));
            }
            match hidden.is_empty() {
                true => pattern.seen.push(number),
                false => pattern.hidden.push(Hidden {
                    family: number,
                    cells: hidden
                        .iter()
                        .map(|slot| program.slots[*slot].count.unwrap_or(1))
                        .fold(1, usize::saturating_mul),
                    slots: hidden,
                    index: Index::of(program, observed),
                }),
            }
        }
        if !pattern.hidden.is_empty() {
            let scopes: Vec<Vec<usize>> = pattern.hidden.iter().map(|hidden| hidden.slots.clone()).collect();
            let count = |slot: usize| program.slots[slot].count.unwrap_or(1);
            let cliques = Cliques::new(&scopes, &count, MOST_VALUES);
            pattern.cliques = Some(cliques.map_err(|slots| {
                let names: Vec<&str> = slots.iter().map(|slot| program.slots[*slot].name.as_str()).collect();
                let message = format!("together they have more than {MOST_VALUES} hidden values");
                Error::input(names.join(" "), message)
            })?);
        }
        Ok(pattern)
    }
}
