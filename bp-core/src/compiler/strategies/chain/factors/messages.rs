//! The factors of an instant, as an error names them.
//!
//! In: slots and values. Out: names, heads of factors, errors. Invariant: a slot is named as the program writes it.

use super::Factors;
use crate::error::Error;
use crate::potential::MOST_CELLS;

impl Factors<'_> {
    /// An observed value in its written form, and the head of the factor that distributes its slot.
    pub(in super::super) fn named(&self, slot: usize, value: f64) -> (String, String) {
        let (model, name) = (self.setting.model, self.setting.slot_name(slot));
        let value = match self.counts[slot] {
            0 => value.to_string(),
            _ => model.value_name(self.setting.variable_of(slot), value as usize),
        };
        let factor = self.distributes[slot].map(|own| &model.factors[self.own[own].instance.factor]);
        (format!("{name} = {value}"), factor.map_or_else(String::new, |factor| model.head(factor)))
    }

    /// The error that a table would have too many cells.
    pub(in super::super) fn too_large(&self, cells: f64) -> Error {
        let help = "carry, search or observe fewer variables, or fewer values of them".to_owned();
        Error::TooLarge { name: self.setting.model.name.clone(), cells, most: MOST_CELLS, help }
    }

    /// The error that a real parent of a factor is not observed.
    pub(super) fn not_observed(&self, position: usize, slot: usize) -> Error {
        let model = self.setting.model;
        let head = model.head(&model.factors[self.own[position].instance.factor]);
        let message =
            format!("it is a real that `{head}` depends on, and it is not observed at some instant");
        Error::input(self.setting.slot_name(slot), message)
    }
}
