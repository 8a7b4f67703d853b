//! A distribution of one real under its usual name.
//!
//! In: a law and its parameters. Out: moments, quantiles, densities, and its name: `beta(12, 5)`. Invariant: the parameters are
//! valid.

use crate::law::{Law, Parameters, Support};
use crate::spelling::number as written;
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::{self, Display, Formatter};

/// A law with its parameters.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NamedLaw {
    /// The law.
    pub law: Law,
    /// Its parameters, in its order; those that it does not have are 0.
    pub parameters: Parameters,
}

impl NamedLaw {
    fn own(&self) -> &[f64] {
        &self.parameters[..self.law.parameters().len()]
    }

    /// The expectation.
    pub fn mean(&self) -> f64 {
        self.law.mean(self.own())
    }

    /// The variance.
    pub fn variance(&self) -> f64 {
        self.law.variance(self.own())
    }

    /// The standard deviation.
    pub fn deviation(&self) -> f64 {
        self.law.deviation(self.own())
    }

    /// The value of largest density; `None` where there is no single one.
    pub fn mode(&self) -> Option<f64> {
        self.law.mode(self.own())
    }

    /// The value of largest density and the density there; `None` where there is no single one.
    pub(crate) fn largest_density(&self) -> Option<(f64, f64)> {
        self.law.largest_density(self.own())
    }

    /// The entropy, in nats.
    pub fn entropy(&self) -> f64 {
        self.law.entropy(self.own())
    }

    /// The density at a real.
    pub fn density(&self, x: f64) -> f64 {
        self.law.density(x, self.own())
    }

    /// A draw.
    pub fn draw(&self, by: &mut impl rand::Rng) -> f64 {
        self.law.draw(by, self.own())
    }

    /// P(X ≤ x) and P(X > x), each accurate in its own tail.
    pub(crate) fn tails(&self, x: f64) -> (f64, f64) {
        self.law.tails(x, self.own())
    }

    /// The probability between two reals, or ±∞, in the tail that is smaller.
    pub fn between(&self, low: f64, high: f64) -> f64 {
        let tails = |x: f64| match x.is_finite() {
            true => self.law.tails(x, self.own()),
            false => (f64::from(u8::from(x > 0.0)), f64::from(u8::from(x < 0.0))),
        };
        let ((below_low, above_low), (below_high, above_high)) = (tails(low), tails(high));
        if below_low > 0.5 { above_low - above_high } else { below_high - below_low }
    }

    /// The value that is not exceeded with this probability, by bisection to the last digits.
    pub fn quantile(&self, level: f64) -> f64 {
        // In the tail that is smaller.
        let is_below = |x: f64| {
            let (lower, upper) = self.law.tails(x, self.own());
            if level <= 0.5 { lower < level } else { upper > 1.0 - level }
        };
        let (mut from, mut to) = match self.law.support() {
            Support::UnitInterval => (0.0, 1.0),
            Support::Positive => (0.0, 1.0),
            _ => (-1.0, 1.0),
        };
        while self.law.support() != Support::UnitInterval && is_below(to) {
            if to == f64::MAX {
                return f64::INFINITY;
            }
            (from, to) = (to, (2.0 * to).min(f64::MAX));
        }
        while from < 0.0 && !is_below(from) {
            if from == f64::MIN {
                return f64::NEG_INFINITY;
            }
            (from, to) = ((2.0 * from).max(f64::MIN), from);
        }
        loop {
            let middle = from + 0.5 * (to - from);
            if middle <= from || middle >= to {
                // What is below the normal numbers is 0.
                return if to.is_subnormal() { 0.0 } else { to };
            }
            if is_below(middle) { from = middle } else { to = middle }
        }
    }
}

impl Display for NamedLaw {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let parameters: Vec<String> = self.own().iter().map(|parameter| written(*parameter)).collect();
        write!(f, "{}({})", self.law.name(), parameters.join(", "))
    }
}

impl<'d> Deserialize<'d> for NamedLaw {
    fn deserialize<D: Deserializer<'d>>(deserializer: D) -> Result<Self, D::Error> {
        let (law, parameters) = Deserialize::deserialize(deserializer)?;
        Ok(Self { law, parameters })
    }
}

/// For readers its name and its own parameters; otherwise all that is needed to read it again.
impl Serialize for NamedLaw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return (self.law, self.parameters).serialize(serializer);
        }
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("name", self.law.name())?;
        map.serialize_entry("parameters", self.own())?;
        map.end()
    }
}
