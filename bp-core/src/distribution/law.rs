//! Laws over the values of a finite domain, and between bounds.
//!
//! In: a law with valid parameters. Out: a probability for each value; masses, densities, an inverse. Invariant: over a
//! finite domain the probabilities sum to one, or are all 0 where the law gives the whole domain nothing.
//!
//! Integers: f(k) / Σⱼ f(j). Bins: F(bᵢ₊₁) − F(bᵢ), normalised; without a closed form, five Gauss–Legendre points in
//! each bin. Circles: what lies within half a bin of the centre, the shorter way round.

use super::Setting;
use super::form::normalised;
use crate::ids::VariableId;
use crate::law::{Law, Numbers, Support};
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
pub(super) fn mass(law: Law, [low, high]: [f64; 2], parameters: &[f64]) -> f64 {
    law.between(low, high, parameters)
}

/// The x between two bounds below which, from the lower one on, lies this mass: by bisection.
pub(super) fn inverse(law: Law, parameters: &[f64], [low, high]: [f64; 2], below: f64) -> f64 {
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
pub(super) fn over(setting: &Setting<'_>, variable: VariableId, law: Law, parameters: &[f64; 2]) -> Vec<f64> {
    if let Domain::Bins(bins) = &setting.model.variables[variable].domain {
        return match (bins.is_circle(), law) {
            (true, Law::Normal | Law::VonMises) => on_circle(bins, law, parameters),
            _ => in_bins(bins, law, exactly(law, parameters)),
        };
    }
    let count = setting.count(variable);
    let number = |ordinal: usize| setting.number_at(variable, ordinal as f64);
    let logarithms: Vec<f64> =
        (0..count).map(|ordinal| ln_density(law, number(ordinal), parameters)).collect();
    // Relative to the likeliest value, so that a normal mean far outside leaves something to divide by.
    let most = match law {
        Law::Normal => logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        _ => 0.0,
    };
    normalised(logarithms.iter().map(|logarithm| (logarithm - most).exp()).collect())
}

fn in_bins(bins: &Bins, law: Law, parameters: &[f64]) -> Vec<f64> {
    let density = |x: f64| law.ln_density(&mut Numbers, x, parameters).exp();
    let masses: Vec<f64> = (bins.edges().windows(2).enumerate())
        .map(|(bin, edges)| {
            let (from, to) = (edges[0], edges[1]);
            if let Some(mass) = law.mass(&mut Numbers, from, to, parameters) {
                return mass;
            }
            if law.support() == Support::Counts {
                return density(bins.centre(bin));
            }
            let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
            RULE.iter().map(|(node, weight)| weight * density(middle + node * half)).sum::<f64>() * half
        })
        .collect();
    normalised(masses)
}

fn on_circle(bins: &Bins, law: Law, [mean, spread]: &[f64; 2]) -> Vec<f64> {
    let (low, high) = bins.ends();
    let (turn, width) = (high - low, (high - low) / bins.count() as f64);
    let masses = (0..bins.count())
        .map(|bin| {
            let distance = (bins.centre(bin) - mean + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
            match law {
                Law::VonMises => {
                    let angle = distance * std::f64::consts::TAU / turn;
                    law.ln_density(&mut Numbers, angle, &[0.0, *spread]).exp()
                }
                _ => mass(law, [distance - 0.5 * width, distance + 0.5 * width], &[0.0, *spread]),
            }
        })
        .collect();
    normalised(masses)
}
