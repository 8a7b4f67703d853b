//! Controls: what a reader of a page sets.
//!
//! In: a variable's domain, or a parameter. Out: a [`Control`]. Invariant: a control's numbers are those that the host of a
//! kernel gives: of a finite variable the number of the value, as in an expression of the program.

use super::limits::Limit;
use crate::model::{Domain, Parameter, ParameterKind};
use serde::Serialize;

/// The largest number of values that a slider or a menu steps through.
const MOST_VALUES: usize = 2000;

/// The largest number of values of a menu.
const MOST_ITEMS: usize = 30;

/// The steps of a slider of reals.
const STEPS: f64 = 200.0;

/// A value that a reader sets.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Control {
    /// The name of the input that it sets.
    pub name: String,
    /// The name that a reader sees.
    pub label: String,
    /// Whether it is a parameter of the program; otherwise it is evidence.
    pub is_parameter: bool,
    /// Its number at first.
    pub value: f64,
    /// What its number must be.
    pub limits: Vec<Limit>,
    /// Of an element of a family: the list that it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element: Option<Element>,
    /// Its values.
    #[serde(flatten)]
    pub kind: Kind,
}

/// The place of a number in a list that is one input.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Element {
    /// The name of the input.
    pub of: String,
    /// The place, from 0.
    pub place: usize,
}

/// The values of a control.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Kind {
    /// One of some names, each with its number.
    Menu {
        /// The names.
        names: Vec<String>,
        /// The numbers.
        numbers: Vec<f64>,
    },
    /// One of some numbers in order, each with its name.
    Slider {
        /// The names.
        names: Vec<String>,
        /// The numbers.
        numbers: Vec<f64>,
    },
    /// Any number; a slider covers a range of it.
    Number {
        /// The lower end of the slider.
        low: f64,
        /// Its upper end.
        high: f64,
        /// Its step.
        step: f64,
        /// Whether only integers are values.
        whole: bool,
    },
}

impl Control {
    /// The control of evidence; `None` where the values of the domain are not known.
    pub fn of_evidence(name: &str, label: &str, domain: &Domain, value: f64) -> Option<Self> {
        let kind = match (domain, domain.count()) {
            (Domain::Real, _) => around(value),
            (Domain::Vector(_) | Domain::Set(_), _) | (_, None | Some(0)) => return None,
            (_, Some(count)) if count > MOST_VALUES => {
                let (low, high, whole) =
                    (domain.number(0), domain.number(count - 1), domain.bins().is_none());
                let step = if whole { 1.0 } else { (high - low) / STEPS };
                Kind::Number { low, high, step, whole }
            }
            (_, Some(count)) => {
                let names: Vec<String> = (0..count).map(|ordinal| domain.value_name(ordinal)).collect();
                let numbers: Vec<f64> = (0..count).map(|ordinal| domain.number(ordinal)).collect();
                let has_labels = match domain {
                    Domain::Boolean => true,
                    Domain::Finite { labels, .. } => !labels.is_empty(),
                    _ => false,
                };
                match has_labels && count <= MOST_ITEMS {
                    true => Kind::Menu { names, numbers },
                    false => Kind::Slider { names, numbers },
                }
            }
        };
        let value = match &kind {
            // A real in bins is given by the centre of its bin.
            Kind::Menu { numbers, .. } | Kind::Slider { numbers, .. } => domain
                .ordinal_at(value)
                .and_then(|ordinal| numbers.get(ordinal).copied())
                .unwrap_or(numbers[0]),
            Kind::Number { .. } => value,
        };
        let (name, label) = (name.to_owned(), label.to_owned());
        Some(Self { name, label, is_parameter: false, value, limits: Vec::new(), element: None, kind })
    }

    /// Whether it sets an input of this name, alone or with others.
    pub fn sets(&self, input: &str) -> bool {
        self.element.as_ref().map_or(self.name == input, |element| element.of == input)
    }

    /// The control of a parameter that is one number.
    pub(super) fn of_parameter(parameter: &Parameter, limits: Vec<Limit>) -> Self {
        let (first, kind): (f64, fn(f64) -> Kind) = match parameter.kind {
            ParameterKind::Probability => {
                (0.5, |_| Kind::Number { low: 0.0, high: 1.0, step: 1.0 / STEPS, whole: false })
            }
            ParameterKind::Real => (1.0, around),
            ParameterKind::Integer | ParameterKind::Size | ParameterKind::Element(_) => {
                (1.0, |value| Kind::Number { low: value - 10.0, high: value + 10.0, step: 1.0, whole: true })
            }
        };
        let value = parameter.default_number().unwrap_or(first);
        let (name, label) = (parameter.name.clone(), parameter.name.clone());
        let kind = within(kind(value), &limits);
        Self { name, label, is_parameter: true, value, limits, element: None, kind }
    }
}

/// The values of a control without those that a limit excludes.
fn within(kind: Kind, limits: &[Limit]) -> Kind {
    let Kind::Number { low, high, step, whole } = kind else { return kind };
    let least = |limit: &Limit| Some(limit.least? + if limit.is_open { step } else { 0.0 });
    let low = limits.iter().filter_map(least).fold(low, f64::max);
    let high = limits.iter().filter_map(|limit| limit.most).fold(high, f64::min);
    Kind::Number { low, high, step, whole }
}

/// A range of reals around a number, of one sign if it is not 0.
fn around(value: f64) -> Kind {
    let ends = [value / 10.0, value * 3.0];
    let (low, high) = match value {
        0.0 => (-1.0, 1.0),
        value if value > 0.0 => (ends[0], ends[1]),
        _ => (ends[1], ends[0]),
    };
    Kind::Number { low, high, step: (high - low) / STEPS, whole: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_has_the_values_of_its_domain() {
        let control = |domain: &Domain, value| Control::of_evidence("X", "X", domain, value).unwrap();
        let lamp = control(&Domain::Boolean, 1.0);
        let names = vec!["false".to_owned(), "true".to_owned()];
        assert_eq!((lamp.value, lamp.kind), (1.0, Kind::Menu { names, numbers: vec![0.0, 1.0] }));
        let degrees = control(&Domain::integers(-1, 1), 0.0);
        let names = ["-1", "0", "1"].map(str::to_owned).to_vec();
        assert_eq!(
            (degrees.value, degrees.kind),
            (0.0, Kind::Slider { names, numbers: vec![-1.0, 0.0, 1.0] })
        );
        let real = control(&Domain::Real, -2.0);
        assert_eq!(real.kind, Kind::Number { low: -6.0, high: -0.2, step: 5.8 / 200.0, whole: false });
        assert_eq!(Control::of_evidence("X", "X", &Domain::Vector(3), 0.0), None);
    }
}
