//! The values of a variable.
//!
//! In: a value of Rust, or a text. Out: numbers. Invariant: each is a value of the variable; of several, a missing one is NaN.

use super::super::Value;
use super::super::value::{read, read_cell};
use super::Settings;
use super::typed::listed_parts;
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::Model;

impl Settings {
    /// Values of a variable, from the numbers of the host.
    ///
    /// # Errors
    /// One of them is not a value of the variable.
    pub fn values(
        &self,
        model: &Model,
        variable: VariableId,
        name: &str,
        value: &Value,
    ) -> Result<Vec<f64>, Error> {
        let size = |size: &str| self.size(size);
        let one = |value: &Value| match read(model, variable, value, &size) {
            Ok((_, number)) => Ok(number),
            Err(message) => Err(Error::input(name, message)),
        };
        let has_several = model.variables[variable].family.is_some() || model.components(variable) > 1;
        // Of several values one may be missing: that element, or component, is not observed.
        let part = |value: &Value| match has_several {
            true => match read_cell(model, variable, value, &size) {
                Ok(found) => Ok(found.map_or(f64::NAN, |(_, number)| number)),
                Err(message) => Err(Error::input(name, message)),
            },
            false => one(value),
        };
        match value {
            Value::Label(text) => {
                // A label may contain brackets and commas, as `[0,5)` does.
                let whole = one(&Value::from(text.as_str()));
                match (listed_parts(text), whole) {
                    (Some(parts), Err(_)) => parts.map(|text| part(&Value::from(text.trim()))).collect(),
                    (None, Err(_)) if text.contains(',') => {
                        text.split(',').map(|text| part(&Value::from(text.trim()))).collect()
                    }
                    (None, Err(wrong)) => Err(wrong),
                    (_, Ok(number)) => Ok(vec![number]),
                }
            }
            Value::List(values) if values.len() > 1 => value.flat().into_iter().map(part).collect(),
            value => value.flat().into_iter().map(one).collect(),
        }
    }
}
