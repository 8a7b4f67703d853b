//! Values, as Rust users write them.
//!
//! In: booleans, whole numbers, reals, labels, lists. Out: a [`Value`], and its meaning in the domain of a variable.
//! Invariant: a boolean is `true` or `false`, never 1 or 0; a text is read as in a table of data.

use crate::answer::Slot;
use crate::data::{self, Values};
use crate::ids::VariableId;
use crate::model::{Domain, Model};
use crate::spelling::exact;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// A value of a variable or a parameter.
///
/// ```
/// use bp_core::prelude::*;
/// assert_eq!(Value::from(true), true);
/// assert_eq!(Value::from("HIGH"), "HIGH");
/// assert_eq!(Value::from((true, 3)), Value::List(vec![true.into(), 3.into()]));
/// ```
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A boolean.
    Bool(bool),
    /// A whole number; of a set, the number of its element.
    Integer(i64),
    /// A real number.
    Real(f64),
    /// A label.
    Label(String),
    /// Several values: of several variables, of the elements of a family, or of a parameter.
    List(Vec<Value>),
    /// A likelihood for each value of a variable: virtual evidence.
    Likelihood(Vec<f64>),
}

impl Value {
    /// Its boolean.
    pub fn as_bool(&self) -> Option<bool> {
        if let Value::Bool(truth) = self { Some(*truth) } else { None }
    }

    /// Its number.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Value::Integer(number) => Some(*number as f64),
            Value::Real(number) => Some(*number),
            _ => None,
        }
    }

    /// Its label.
    pub fn as_str(&self) -> Option<&str> {
        if let Value::Label(label) = self { Some(label) } else { None }
    }

    /// The values of a list; of any other value the value itself.
    pub(super) fn flat(&self) -> Vec<&Value> {
        match self {
            Value::List(values) => values.iter().flat_map(Value::flat).collect(),
            other => vec![other],
        }
    }
}

impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let list = |f: &mut Formatter<'_>, words: Vec<String>| write!(f, "({})", words.join(", "));
        match self {
            Value::Bool(truth) => write!(f, "{truth}"),
            Value::Integer(number) => write!(f, "{number}"),
            Value::Real(number) => write!(f, "{}", exact(*number)),
            Value::Label(label) => write!(f, "{label}"),
            Value::List(values) => list(f, values.iter().map(Value::to_string).collect()),
            Value::Likelihood(weights) => {
                write!(f, "virtual ")?;
                list(f, weights.iter().map(|weight| exact(*weight)).collect())
            }
        }
    }
}

macro_rules! from {
    ($($source:ty => |$value:ident| $made:expr;)*) => {
        $(impl From<$source> for Value {
            fn from($value: $source) -> Self {
                $made
            }
        })*
    };
}

from! {
    bool => |value| Value::Bool(value);
    i64 => |value| Value::Integer(value);
    i32 => |value| Value::Integer(value.into());
    u32 => |value| Value::Integer(value.into());
    u8 => |value| Value::Integer(value.into());
    usize => |value| Value::Integer(i64::try_from(value).unwrap_or(i64::MAX));
    f64 => |value| Value::Real(value);
    f32 => |value| Value::Real(value.into());
    &str => |value| Value::Label(value.to_owned());
    String => |value| Value::Label(value);
    &String => |value| Value::Label(value.clone());
    &Value => |value| value.clone();
}

impl<T: Into<Value>> From<Vec<T>> for Value {
    fn from(values: Vec<T>) -> Self {
        Value::List(values.into_iter().map(Into::into).collect())
    }
}

impl<T: Into<Value>, const N: usize> From<[T; N]> for Value {
    fn from(values: [T; N]) -> Self {
        Value::List(values.into_iter().map(Into::into).collect())
    }
}

impl<T: Clone + Into<Value>> From<&[T]> for Value {
    fn from(values: &[T]) -> Self {
        Value::List(values.iter().cloned().map(Into::into).collect())
    }
}

macro_rules! from_tuple {
    ($($name:ident)*) => {
        impl<$($name: Into<Value>),*> From<($($name,)*)> for Value {
            #[allow(non_snake_case)]
            fn from(($($name,)*): ($($name,)*)) -> Self {
                Value::List(vec![$($name.into()),*])
            }
        }
    };
}

from_tuple!(A B);
from_tuple!(A B C);
from_tuple!(A B C D);
from_tuple!(A B C D E);

macro_rules! equal {
    ($($other:ty)*) => {
        $(impl PartialEq<$other> for Value {
            fn eq(&self, other: &$other) -> bool {
                let other = Value::from(other.clone());
                *self == other
            }
        })*
    };
}

equal!(bool i64 i32 usize f64 &str String);

/// The meaning of a value in the domain of a variable: its ordinal, if the domain is finite, and its number in an
/// expression. `Err` is the reason why it is not a value, to follow a name.
pub(super) fn read(
    model: &Model,
    variable: VariableId,
    value: &Value,
    size: &dyn Fn(&str) -> Option<usize>,
) -> Result<(Option<usize>, f64), String> {
    read_cell(model, variable, value, size)?.ok_or_else(|| format!("`{value}` means not observed: omit it"))
}

/// The same; `None` where the value is missing.
pub(super) fn read_cell(
    model: &Model,
    variable: VariableId,
    value: &Value,
    size: &dyn Fn(&str) -> Option<usize>,
) -> Result<Option<(Option<usize>, f64)>, String> {
    let domain = &model.variables[variable].domain;
    if let (Domain::Boolean, Value::Bool(truth)) = (domain, value) {
        return Ok(Some((Some(usize::from(*truth)), f64::from(u8::from(*truth)))));
    }
    let values = Values::new(model, variable, size);
    let name = model.variable_name(variable);
    let refused = |why: &str| Err(format!("`{value}` is not a value of `{name}`, {why}"));
    let texts: Vec<String> = match (domain, value) {
        (Domain::Boolean, Value::Integer(_) | Value::Real(_)) => {
            return refused("which is `bool`: write `true` or `false`");
        }
        // Networks of other tools represent booleans as labels.
        (Domain::Finite { .. }, Value::Bool(true)) => ["true", "True", "TRUE"].map(str::to_owned).to_vec(),
        (Domain::Finite { .. }, Value::Bool(false)) => {
            ["false", "False", "FALSE"].map(str::to_owned).to_vec()
        }
        (_, Value::List(_)) => return refused("which has one value"),
        (_, Value::Likelihood(_)) => return refused("but a likelihood of its values"),
        (_, value) => vec![value.to_string()],
    };
    let mut found = values.read(&texts[0]);
    for text in &texts[1..] {
        if let Ok(Some(_)) = found {
            break;
        }
        found = values.read(text).or(found);
    }
    match found {
        Ok(found) => Ok(found.map(|value| (value.ordinal, value.number))),
        Err(expected) => Err(format!("`{value}` is {expected}")),
    }
}

/// Whether a value says that nothing is observed, as a missing cell does.
pub(super) fn is_missing(value: &Value) -> bool {
    match value {
        Value::Real(number) => number.is_nan(),
        Value::Label(text) => data::is_missing(text),
        _ => false,
    }
}

/// The ordinal of a value of a finite slot.
pub(super) fn ordinal(model: &Model, slot: &Slot, value: &Value) -> Result<usize, String> {
    let (ordinal, _) = read(model, slot.variable, value, &|_| None)?;
    let name = slot.name(model);
    match ordinal {
        Some(ordinal) if ordinal < slot.count => Ok(ordinal),
        _ => Err(format!("`{value}` is not a value of `{name}`, which has {} values", slot.count)),
    }
}

/// The value with this ordinal of a finite slot.
pub(super) fn value(model: &Model, slot: &Slot, ordinal: usize) -> Value {
    let domain = &model.variables[slot.variable].domain;
    match domain {
        Domain::Boolean => Value::Bool(ordinal == 1),
        Domain::Finite { labels, .. } if ordinal < labels.len() => Value::Label(labels[ordinal].clone()),
        Domain::Bins(bins) => Value::Real(bins.centre(ordinal)),
        Domain::Set(_) => Value::Integer(ordinal as i64),
        _ => Value::Integer(domain.number(ordinal) as i64),
    }
}

/// The value that an answer shows of a variable, or of an element.
pub(super) fn of_text(model: &Model, name: &str, text: &str) -> Value {
    let plain = name.split('[').next().unwrap_or(name);
    let id = model.variable(name).or_else(|| model.variable(plain));
    let label = || Value::Label(text.to_owned());
    match id.map(|id| &model.variables[id].domain) {
        Some(Domain::Boolean) => Value::Bool(text == "true"),
        Some(Domain::Finite { labels, .. }) if labels.iter().any(|own| own == text) => label(),
        Some(Domain::Finite { .. } | Domain::Set(_)) => text.parse().map_or_else(|_| label(), Value::Integer),
        _ => text.parse().map_or_else(|_| label(), Value::Real),
    }
}
