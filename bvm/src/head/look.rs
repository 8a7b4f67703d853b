//! The record of a look.
//!
//! In: what happened. Out: [`Look`], written to and read from JSON. Invariant: times of computation are in fields whose
//! names end in `ms`, and nothing else in a record depends on the machine.

use super::frames::Attitude;
use super::policy::Gaze;
use super::sense::Bearing;
use serde::{Deserialize, Serialize};

/// A look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// From 1.
    pub number: usize,
    /// Time of the world, s.
    pub time_s: f64,
    /// The gaze, in the map's frame.
    pub gaze: Gaze,
    /// The estimated attitude of the head.
    pub attitude: Attitude,
    /// The true one, in a simulated world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<Attitude>,
    /// What each sense gave; balance is the last.
    pub senses: Vec<Contribution>,
    /// Σ H(O, V) over the map after the look, nats.
    pub entropy: f64,
    /// Σ H(O) over the map after the look, nats.
    pub occupancy_entropy: f64,
    /// Directions that the neck reaches and that looks can still tell something about.
    pub open_directions: usize,
    /// The gaze that was chosen for the next look, within the limits of the neck.
    pub next: Gaze,
    /// How long the turn took, s.
    pub turn_s: f64,
    /// How far the head turned, rad.
    pub travel_rad: f64,
    /// Times of computation beside the senses, ms.
    pub stages_ms: Stages,
}

/// What a sense gave to a look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// Its name.
    pub sense: String,
    /// The number of its readings.
    pub readings: usize,
    /// What its likelihood alone would tell the map: Σ over cells of KL(P(O | reading) ‖ P(O)), nats.
    pub information: f64,
    /// What was wrong with its data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The sources that it found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub found: Vec<Bearing>,
    /// Time of computation, ms, without that of the simulation of its data.
    pub ms: f64,
    /// Time of that simulation, ms.
    #[serde(default)]
    pub simulated_ms: f64,
}

/// Times of computation, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// Prediction and estimation of the map.
    pub estimate: f64,
    /// The choice of the gaze.
    pub gaze: f64,
    /// The simulation of the turn.
    pub turn: f64,
}

/// Σ over cells of the divergence from P(O) to P(O | a likelihood), nats.
pub(super) fn information(occupied: &[f32], likelihood: &[f32]) -> f64 {
    let (empty, full) = likelihood.split_at(occupied.len());
    let one = |((p, empty), full): ((&f32, &f32), &f32)| {
        if empty == full {
            return 0.0;
        }
        let (p, empty, full) = (f64::from(*p), f64::from(*empty), f64::from(*full));
        let [was, is] = [[1.0 - p, p], [(1.0 - p) * empty, p * full]];
        let total = is[0] + is[1];
        let term = |was: f64, is: f64| if is > 0.0 { is / total * (is / total / was).ln() } else { 0.0 };
        if total > 0.0 { (term(was[0], is[0]) + term(was[1], is[1])).max(0.0) } else { 0.0 }
    };
    occupied.iter().zip(empty).zip(full).map(one).sum()
}

/// The sum of many small numbers.
pub(super) fn sum(values: &[f32]) -> f64 {
    values.iter().map(|value| f64::from(*value)).sum()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_likelihood_of_three_to_one_tells_0_13_nats() {
        // ½ becomes ¾: ¾ ln 1.5 + ¼ ln 0.5 = 0.1308.
        let found = super::information(&[0.5, 0.5], &[1.0, 0.2, 3.0, 0.2]);
        assert!((found - (0.75 * 1.5f64.ln() + 0.25 * 0.5f64.ln())).abs() < 1e-7, "{found}");
    }
}
