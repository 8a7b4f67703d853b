//! Laws over the values of a finite domain, and between bounds.
//!
//! In: a law with valid parameters. Out: a probability for each value; masses, densities, an inverse. Invariant: over a
//! finite domain the probabilities sum to one, or are all 0 where the law gives the whole domain nothing.
//!
//! Integers: f(k) / Σⱼ f(j). Bins: F(bᵢ₊₁) − F(bᵢ), normalised; without a closed form, five Gauss–Legendre points in
//! each bin. Circles: what lies within half a bin of the centre, the shorter way round.

use super::Setting;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::VariableId;
use crate::law::{Law, Numbers, Support, Wide};
use crate::model::{Bins, Domain};

/// Nodes and weights of the Gauss–Legendre rule of five points on [−1, 1] (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// As many parameters as a law has.
pub(super) fn exactly(law: Law, parameters: &[f64; 2]) -> &[f64] {
    &parameters[..law.parameters().len()]
}

pub(super) fn ln_density(law: Law, x: f64, parameters: &[f64; 2]) -> f64 {
    law.ln_density(&mut Numbers, x, exactly(law, parameters))
}

/// P(low < X ≤ high)
pub(super) fn mass(law: Law, [low, high]: [f64; 2], parameters: &[f64]) -> Extended {
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

/// The density at a number, which may be far below what f64 holds.
fn density(law: Law, x: f64, parameters: &[f64]) -> Extended {
    law.ln_density(&mut Wide, Extended::from_f64(x), &wide(parameters)).exponential()
}

/// The x between two bounds below which, from the lower one on, lies this mass: by bisection.
pub(super) fn inverse(law: Law, parameters: &[f64], [low, high]: [f64; 2], below: Extended) -> f64 {
    let (mut from, mut to) = (low, high);
    loop {
        let middle = 0.5 * (from + to);
        if middle <= from || middle >= to {
            return middle.clamp(low, high);
        }
        match mass(law, [low, middle], parameters) < below {
            true => from = middle,
            false => to = middle,
        }
    }
}

/// The probabilities that a law gives to the values of a finite variable.
pub(super) fn over(
    setting: &Setting<'_>,
    variable: VariableId,
    law: Law,
    parameters: &[f64; 2],
) -> Vec<Extended> {
    if let Domain::Bins(bins) = &setting.model.variables[variable].domain {
        return match (bins.is_circle(), law) {
            (true, Law::Normal | Law::VonMises) => on_circle(bins, law, parameters),
            _ => in_bins(bins, law, exactly(law, parameters)),
        };
    }
    let number = |ordinal: usize| setting.number_at(variable, ordinal as f64);
    let weight = |ordinal: usize| density(law, number(ordinal), exactly(law, parameters));
    shares((0..setting.count(variable)).map(weight).collect())
}

/// Each part of the total, however small it is; all 0 where the total is 0.
pub(super) fn shares(weights: Vec<Extended>) -> Vec<Extended> {
    let total: Extended = weights.iter().copied().sum();
    let share =
        |weight: Extended| if total > Extended::ZERO { weight / total } else { weight * Extended::ZERO };
    weights.into_iter().map(share).collect()
}

fn in_bins(bins: &Bins, law: Law, parameters: &[f64]) -> Vec<Extended> {
    let bound = |x: f64| Extended::from_f64(x);
    let masses = (bins.edges().windows(2).enumerate())
        .map(|(bin, edges)| {
            let (from, to) = (edges[0], edges[1]);
            if let Some(mass) = law.mass(&mut Wide, bound(from), bound(to), &wide(parameters)) {
                return mass;
            }
            if law.support() == Support::Counts {
                return density(law, bins.centre(bin), parameters);
            }
            let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
            let part =
                |(node, weight): &(f64, f64)| bound(*weight) * density(law, middle + node * half, parameters);
            RULE.iter().map(part).sum::<Extended>() * bound(half)
        })
        .collect();
    shares(masses)
}

fn on_circle(bins: &Bins, law: Law, [mean, spread]: &[f64; 2]) -> Vec<Extended> {
    let (low, high) = bins.ends();
    let (turn, width) = (high - low, (high - low) / bins.count() as f64);
    let masses = (0..bins.count())
        .map(|bin| {
            let distance = (bins.centre(bin) - mean + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
            match law {
                Law::VonMises => density(law, distance * std::f64::consts::TAU / turn, &[0.0, *spread]),
                _ => mass(law, [distance - 0.5 * width, distance + 0.5 * width], &[0.0, *spread]),
            }
        })
        .collect();
    shares(masses)
}
