//! Laws over the values of a finite domain, and between bounds.
//!
//! In: a law with valid parameters. Out: a probability for each value; masses, densities, an inverse. Invariant: over a
//! finite domain the probabilities sum to one, or are all 0 where the law gives the whole domain no mass.
//!
//! P(k) = w(k) / Σⱼ w(j), w as in `forms/law.rs`.

use super::Setting;
use crate::exec::scalar::{Extended, Scalar};
use crate::forms::{self, share};
use crate::ids::VariableId;
use crate::law::{Law, Numbers, Parameters, Support, Wide};
use crate::operators::Unary;

/// The parameters that the law uses.
pub(super) fn exactly(law: Law, parameters: &Parameters) -> &[f64] {
    &parameters[..law.parameters().len()]
}

pub(super) fn ln_density(law: Law, x: f64, parameters: &Parameters) -> f64 {
    law.ln_density(&mut Numbers, x, exactly(law, parameters))
}

/// P(low ≤ X ≤ high)
pub(super) fn mass(law: Law, [low, high]: [f64; 2], parameters: &[f64]) -> Extended {
    // A law of counts gives the lower bound itself a probability.
    let low = if law.support() == Support::Counts { low.ceil() - 1.0 } else { low };
    let between = law.between(low, high, parameters);
    if between.is_normal() {
        return Extended::from_f64(between);
    }
    let closed = law.mass(&mut Wide, Extended::from_f64(low), Extended::from_f64(high), &wide(parameters));
    closed.unwrap_or_else(|| Extended::from_f64(between)).maximum(Extended::ZERO)
}

fn wide(parameters: &[f64]) -> Vec<Extended> {
    parameters.iter().map(|number| Extended::from_f64(*number)).collect()
}

/// The quantile between two bounds: the x for which P(low ≤ X ≤ x) is this mass, by bisection; of counts a whole number.
pub(super) fn inverse(law: Law, parameters: &[f64], [low, high]: [f64; 2], below: Extended) -> f64 {
    let (mut from, mut to) = (low, high);
    loop {
        let middle = 0.5 * (from + to);
        if middle <= from || middle >= to {
            return if law.support() == Support::Counts { to.floor() } else { middle.clamp(low, high) };
        }
        match mass(law, [low, middle], parameters) < below {
            true => from = middle,
            false => to = middle,
        }
    }
}

/// The probabilities of the values of a finite variable under a law; of bins between bounds, where there are some.
pub(super) fn over(
    setting: &Setting<'_>,
    variable: VariableId,
    law: Law,
    parameters: &Parameters,
    bounds: Option<[f64; 2]>,
) -> Vec<Extended> {
    let bounds = bounds.map(|bounds| bounds.map(Extended::from_f64));
    let bins = setting.model.variables[variable].domain.bins();
    let parameters = wide(exactly(law, parameters));
    // Beyond the exponents of numbers: e^−λ is left out, which all values share.
    let rate = (law == Law::Poisson && bins.is_none()).then(|| parameters[0]);
    if let Some(rate) = rate.filter(|rate| rate.to_f64() > 1e15) {
        let ln_rate = rate.natural_logarithm().to_f64();
        let ln = |ordinal: usize| {
            let count = setting.number_at(variable, ordinal as f64);
            if count < 0.0 { f64::NEG_INFINITY } else { count * ln_rate - Unary::LnGamma.apply(count + 1.0) }
        };
        let all: Vec<f64> = (0..setting.count(variable)).map(ln).collect();
        let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        return shares(all.into_iter().map(|ln| Extended::from_f64(ln - most).exponential()).collect());
    }
    let (law, parameters) = forms::law::located(&mut Wide, law, bins, parameters);
    let weight = |ordinal: usize| {
        let mut value = Ordinal { setting, variable, ordinal, by: Wide };
        forms::law::weight(&mut value, law, bins, &parameters, bounds)
    };
    shares((0..setting.count(variable)).map(weight).collect())
}

/// A value of a finite variable, with separate exponents.
struct Ordinal<'s> {
    setting: &'s Setting<'s>,
    variable: VariableId,
    ordinal: usize,
    by: Wide,
}

impl forms::law::Value for Ordinal<'_> {
    type By = Wide;

    fn by(&mut self) -> &mut Wide {
        &mut self.by
    }

    fn number(&mut self) -> Extended {
        Extended::from_f64(self.setting.number_at(self.variable, self.ordinal as f64))
    }

    fn edges(&mut self) -> [Extended; 2] {
        let bins = self.setting.model.variables[self.variable].domain.bins();
        let edges = bins.expect("internal: bins have edges").edges();
        [self.ordinal, self.ordinal + 1].map(|edge| Extended::from_f64(edges[edge]))
    }

    fn ends(&mut self) -> [Extended; 2] {
        let last = self.setting.count(self.variable) - 1;
        [0, last].map(|end| Extended::from_f64(self.setting.number_at(self.variable, end as f64)))
    }
}

/// Each weight divided by their total, however small; all 0 where the total is 0.
pub(super) fn shares(weights: Vec<Extended>) -> Vec<Extended> {
    let total: Extended = weights.iter().copied().sum();
    weights.into_iter().map(|weight| share(&mut Wide, weight, total)).collect()
}
