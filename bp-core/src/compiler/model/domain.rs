//! Domains: the values of a variable.
//!
//! In: labels, bounds. Out: a [`Domain`]. Invariant: the values of a finite domain are numbered from 0 (their
//! *ordinal*); as a number in an expression a value is `ordinal + base`, so an integer is itself, `true` is 1,
//! the labels that precede a range take the integers just below it, and a bin is its centre.

use super::Bins;
use crate::ids::{ParameterId, SetId};
use crate::spelling::quoted;
use serde::{Deserialize, Serialize};

/// An integer bound, possibly known only at run time: `offset`, or `size + offset`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Bound {
    /// A parameter of kind size, if the bound depends on one.
    pub size: Option<ParameterId>,
    /// The offset.
    pub offset: i64,
}

impl Bound {
    /// A constant bound.
    pub fn constant(offset: i64) -> Self {
        Self { size: None, offset }
    }

    /// A bound that is a size parameter.
    pub fn size(parameter: ParameterId) -> Self {
        Self { size: Some(parameter), offset: 0 }
    }
}

/// The integers from `low` to `high`, both included.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Range {
    /// The first integer. Always a constant.
    pub low: i64,
    /// The last.
    pub high: Bound,
}

/// The values of a variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Domain {
    /// `bool`: false (ordinal 0), true (ordinal 1).
    Boolean,
    /// Labels, then integers; at least one of both. `{ NoDetection } or 1..=N`.
    Finite {
        /// Names of the first values.
        labels: Vec<String>,
        /// The integers that follow.
        range: Option<Range>,
    },
    /// A real in bins, each represented by its centre.
    Bins(Bins),
    /// The elements of a set that is given at run time.
    Set(SetId),
    /// A real number.
    Real,
    /// A vector of real numbers: `real[3]`.
    Vector(usize),
}

impl Domain {
    /// The bins, where the values are bins.
    pub fn bins(&self) -> Option<&Bins> {
        match self {
            Domain::Bins(bins) => Some(bins),
            _ => None,
        }
    }

    /// A domain of labels.
    pub fn labels<'a>(labels: impl IntoIterator<Item = &'a str>) -> Self {
        Domain::Finite { labels: labels.into_iter().map(str::to_owned).collect(), range: None }
    }

    /// The integers from `low` to `high`, both included.
    pub fn integers(low: i64, high: i64) -> Self {
        Domain::Finite { labels: Vec::new(), range: Some(Range { low, high: Bound::constant(high) }) }
    }

    /// The number of a value of a finite domain in an expression.
    pub fn number(&self, ordinal: usize) -> f64 {
        match self {
            Domain::Bins(bins) => bins.centre(ordinal),
            _ => self.base().saturating_add(ordinal as i64) as f64,
        }
    }

    /// The ordinal of the value with this number, for a finite domain with known bounds: the number itself, or the bin
    /// that contains it.
    pub fn ordinal_at(&self, number: f64) -> Option<usize> {
        match self {
            Domain::Bins(bins) => bins.holding(number),
            _ => self.ordinal_among(number, Some(self.count()?)),
        }
    }

    /// The ordinal of the value with this number, for a given number of values.
    pub fn ordinal_among(&self, number: f64, count: Option<usize>) -> Option<usize> {
        if let Domain::Bins(bins) = self {
            return bins.holding(number);
        }
        let ordinal = number - self.base() as f64;
        let inside =
            number.fract() == 0.0 && ordinal >= 0.0 && count.is_none_or(|count| ordinal < count as f64);
        inside.then_some(ordinal as usize)
    }

    /// The difference between a value's number in an expression and its ordinal; bins have none.
    pub fn base(&self) -> i64 {
        match self {
            Domain::Finite { labels, range: Some(range) } => range.low.saturating_sub(labels.len() as i64),
            _ => 0,
        }
    }

    /// The number of values, if it is known without any size: `None` for sizes, sets and reals.
    pub fn count(&self) -> Option<usize> {
        match self {
            Domain::Boolean => Some(2),
            Domain::Bins(bins) => Some(bins.count()),
            Domain::Finite { labels, range: None } => Some(labels.len()),
            Domain::Finite { labels, range: Some(Range { low, high: Bound { size: None, offset } }) } => {
                let integers = offset.checked_sub(*low).map_or(i64::MAX, |last| last.saturating_add(1));
                Some(labels.len().saturating_add(usize::try_from(integers).unwrap_or(0)))
            }
            _ => None,
        }
    }

    /// Whether the domain is finite, once sizes and sets are known.
    pub fn is_finite(&self) -> bool {
        !matches!(self, Domain::Real | Domain::Vector(_))
    }

    /// How a value is written, where the domain's own notation does not say it.
    pub fn help(&self) -> Option<String> {
        match self {
            Domain::Boolean => Some("write `true` or `false`".to_owned()),
            Domain::Bins(bins) if !bins.is_circle() && bins.points().is_none() => {
                let (low, high) = bins.ends();
                Some(format!("a value is a number from {low} to {high}, which means its bin"))
            }
            _ => None,
        }
    }

    /// The name of the value with this ordinal.
    pub fn value_name(&self, ordinal: usize) -> String {
        match self {
            Domain::Boolean => (if ordinal == 0 { "false" } else { "true" }).to_owned(),
            Domain::Finite { labels, .. } if ordinal < labels.len() => labels[ordinal].clone(),
            Domain::Bins(bins) if ordinal < bins.count() => bins.name(ordinal),
            _ => self.base().saturating_add(ordinal as i64).to_string(),
        }
    }

    /// The value with this ordinal in the notation of the language: `Rain`, `"<5"`, `-3`.
    pub fn value_spelled(&self, ordinal: usize) -> String {
        match self {
            Domain::Finite { labels, .. } if ordinal < labels.len() => quoted(&labels[ordinal]).into_owned(),
            _ => self.value_name(ordinal),
        }
    }

    /// The ordinal of the value with this name, if it is one of a domain whose bounds are known.
    pub fn ordinal_of(&self, name: &str) -> Option<usize> {
        match self {
            Domain::Boolean => match name {
                "false" => Some(0),
                "true" => Some(1),
                _ => None,
            },
            Domain::Finite { labels, .. } => {
                if let Some(position) = labels.iter().position(|label| label == name) {
                    return Some(position);
                }
                let ordinal = usize::try_from(name.parse::<i64>().ok()?.checked_sub(self.base())?).ok()?;
                let known = self.count().is_none_or(|count| ordinal < count);
                (ordinal >= labels.len() && known).then_some(ordinal)
            }
            Domain::Bins(bins) => bins.holding(name.parse().ok()?),
            _ => None,
        }
    }
}
