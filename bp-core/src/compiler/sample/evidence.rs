//! Observations, slot by slot.
//!
//! In: the known variables of an ask, and the host's inputs. Out: [`Observations`]. Invariant: every observed slot has
//! a value of its domain.

use crate::distribution::Setting;
use crate::error::Error;
use crate::ids::{Id, VariableId};
use crate::model::{Ask, Finding, Value};

/// Values and likelihoods of slots.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Observations {
    /// The value of each slot; NaN where it is not observed.
    pub values: Vec<f64>,
    /// Slots with likelihoods for their values (virtual evidence).
    pub likelihoods: Vec<(usize, Vec<f64>)>,
}

impl Observations {
    /// No observations. A variable of the previous instant that no factor distributes is 0, at rest; so is the plate's
    /// index.
    pub fn none(setting: &Setting<'_>) -> Self {
        let mut values = vec![f64::NAN; setting.slots()];
        let distributions = setting.model.distributions();
        for variable in setting.model.variables.ids() {
            if distributions[variable.position()].is_none() {
                values[setting.slots_of(variable)].fill(0.0);
            }
        }
        Self { values, likelihoods: Vec::new() }
    }

    /// The evidence of an ask.
    ///
    /// # Errors
    /// A value that is missing or outside its variable's domain; a program that runs over more than one element.
    pub fn of(setting: &Setting<'_>, ask: &Ask) -> Result<Self, Error> {
        let mut observations = Self::none(setting);
        if let Some(index) = setting.model.plate_index().filter(|index| setting.count(*index) > 1) {
            let name = setting.model.variable_name(index);
            let reason = format!(
                "it is estimated by draws, for one value of `{name}`, but there are {}",
                setting.count(index)
            );
            return Err(Error::Unplanned { question: setting.model.ask_text(ask), reason });
        }
        for known in &ask.known {
            let slots = setting.slots_of(known.variable);
            let name = setting.model.variable_name(known.variable);
            match &known.evidence {
                Finding::Hard(value) => observations.put(setting, known.variable, value)?,
                Finding::Virtual(likelihoods) => {
                    observations.likelihoods.push((slots.start, likelihoods.clone()))
                }
                Finding::Each if Some(known.variable) == setting.model.plate_index() => {}
                _ => observations.give(setting, slots, &name)?,
            }
            // A component that a question names is that of its vector.
            if let Some((use_, component)) = setting.model.named_component(known.variable) {
                let value = observations.values[setting.slots_of(known.variable).start];
                if let Some(slot) = setting.slots_used(use_, &[]).nth(component) {
                    observations.values[slot] = value;
                }
            }
        }
        Ok(observations)
    }

    /// The values at which all variables of an ask are searched, slot by slot: ordinals of finite variables, numbers of reals; `None`
    /// where one is not searched at a value.
    ///
    /// # Errors
    /// As [`Observations::of`].
    pub(crate) fn searched(setting: &Setting<'_>, ask: &Ask) -> Result<Option<Vec<f64>>, Error> {
        let mut observations = Self::none(setting);
        for item in &ask.searched {
            let Some(value) = &item.at else { return Ok(None) };
            observations.put(setting, item.variable, value)?;
        }
        let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
        Ok(Some(slots.map(|slot| observations.values[slot]).collect()))
    }

    /// Puts a value of a question into the slots of a variable.
    fn put(&mut self, setting: &Setting<'_>, variable: VariableId, value: &Value) -> Result<(), Error> {
        let slots = setting.slots_of(variable);
        match value {
            Value::Ordinal(ordinal) => self.values[slots].fill(*ordinal as f64),
            Value::Real(number) => self.values[slots].fill(*number),
            Value::Vector(numbers) => self.values[slots].copy_from_slice(numbers),
            Value::Given(given) => self.give(setting, slots, given)?,
        }
        Ok(())
    }

    /// Observes the values that the host gives under a name: a number for each slot; NaN for an element that is not
    /// observed.
    ///
    /// # Errors
    /// The input is missing; it has another number of values; a value outside the domain of its variable.
    pub(crate) fn give(
        &mut self,
        setting: &Setting<'_>,
        slots: std::ops::Range<usize>,
        name: &str,
    ) -> Result<(), Error> {
        let given = setting.given(name).ok_or_else(|| Error::input(name, "it was not given"))?;
        if given.len() != slots.len() {
            let (found, expected) = (given.len(), slots.len());
            let is = if expected == 1 { "is" } else { "are" };
            return Err(Error::input(
                name,
                format!("{found} numbers were given, but {expected} {is} expected"),
            ));
        }
        let several = slots.len() > 1;
        for (slot, value) in slots.zip(given) {
            if !(several && value.is_nan()) {
                self.observe(setting, slot, *value)?;
            }
        }
        Ok(())
    }

    /// Observes the value of a slot: the number that the program writes for it, not its ordinal.
    ///
    /// # Errors
    /// A value outside the domain of its variable.
    pub fn observe(&mut self, setting: &Setting<'_>, slot: usize, value: f64) -> Result<(), Error> {
        let variable = setting.variable_of(slot);
        let domain = &setting.model.variables[variable].domain;
        let read = match domain.is_finite() {
            true => domain.ordinal_among(value, Some(setting.count(variable))).map(|ordinal| ordinal as f64),
            false => Some(value).filter(|value| value.is_finite()),
        };
        let Some(read) = read else {
            let (name, text) = (setting.slot_name(slot), setting.model.domain_text(domain));
            let message = format!("{value} is not a value of `{name}`, which is `{text}`");
            return Err(Error::input(name, message));
        };
        self.values[slot] = read;
        Ok(())
    }
}
