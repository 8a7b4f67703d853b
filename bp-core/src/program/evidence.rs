//! Evidence: values by the names of their variables.
//!
//! In: `evidence! { Rain: true, Z[2]: 0.5 }`. Out: [`Evidence`]. Invariant: each name has one value, the last one, and one
//! likelihood; a question refuses a name that has both.

use super::Value;
use serde::{Serialize, Serializer};
use std::fmt::{self, Display, Formatter};
use std::ops::Index;

/// Values by the names of their variables; an element of a family is `Z[2]`.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Evidence(Vec<(String, Value)>);

impl Evidence {
    /// Empty evidence.
    pub fn new() -> Self {
        Self::default()
    }

    /// With the value of another variable.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl Into<Value>) -> Self {
        self.set(name, value);
        self
    }

    /// Sets the value of a variable, or its likelihood. An earlier one is replaced; a value and a likelihood do not replace
    /// each other: a question refuses such evidence.
    pub fn set(&mut self, name: impl Into<String>, value: impl Into<Value>) {
        let (name, value) = (name.into(), value.into());
        let weighs = |value: &Value| matches!(value, Value::Likelihood(_));
        let same = |(known, old): &&mut (String, Value)| *known == name && weighs(old) == weighs(&value);
        match self.0.iter_mut().find(same) {
            Some((_, known)) => *known = value,
            None => self.0.push((name, value)),
        }
    }

    /// The value of a variable.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value)
    }

    /// The names and values, in the order in which they were given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }
}

/// The value of an existing variable.
impl Index<&str> for Evidence {
    type Output = Value;

    /// # Panics
    /// There is no value of this variable; use [`Evidence::get`] to test.
    fn index(&self, name: &str) -> &Value {
        self.get(name).unwrap_or_else(|| panic!("`{name}` has no value here: {self}"))
    }
}

impl<N: Into<String>, V: Into<Value>> FromIterator<(N, V)> for Evidence {
    fn from_iter<I: IntoIterator<Item = (N, V)>>(pairs: I) -> Self {
        pairs.into_iter().fold(Self::new(), |evidence, (name, value)| evidence.with(name, value))
    }
}

impl Display for Evidence {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (position, (name, value)) in self.iter().enumerate() {
            let comma = if position > 0 { ", " } else { "" };
            write!(f, "{comma}{name} = {value}")?;
        }
        Ok(())
    }
}

impl Serialize for Evidence {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}

/// Values by the names of their variables. A name that is not a Rust identifier is quoted.
///
/// ```
/// use bp_core::prelude::*;
/// let seen = evidence! { Rain: true, Z[2]: 0.5, "X^-1": "HIGH" };
/// assert_eq!(seen["Rain"], true);
/// assert_eq!(seen.to_string(), "Rain = true, Z[2] = 0.5, X^-1 = HIGH");
/// ```
#[macro_export]
macro_rules! evidence {
    (@ $all:ident) => {};
    (@ $all:ident $name:ident [ $index:expr ] : $value:expr $(, $($rest:tt)*)?) => {
        $all.set(format!("{}[{}]", stringify!($name), $index), $value);
        $crate::evidence!(@ $all $($($rest)*)?);
    };
    (@ $all:ident $name:ident : $value:expr $(, $($rest:tt)*)?) => {
        $all.set(stringify!($name), $value);
        $crate::evidence!(@ $all $($($rest)*)?);
    };
    (@ $all:ident $name:literal : $value:expr $(, $($rest:tt)*)?) => {
        $all.set($name, $value);
        $crate::evidence!(@ $all $($($rest)*)?);
    };
    ($($all:tt)*) => {{
        #[allow(unused_mut)]
        let mut all = $crate::program::Evidence::new();
        $crate::evidence!(@ all $($all)*);
        all
    }};
}
