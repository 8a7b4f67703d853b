//! The cues of a look during which the head turns.
//!
//! In: the cues of each part of the look, and how the head was turned then. Out: at most six groups, each with its cues and
//! the mean turn. Invariant: memory does not grow with the length of the look: groups become wider where there would be
//! more.

use super::binaural::Cues;
use crate::vestibular::rotation::{self, Matrix, Quaternion};

/// Parts whose turns differ by less are one group, degrees: what a direction moves by within it is less than the cells.
const WITHIN_DEG: f64 = 4.0;
/// A head that is turned by less keeps its axes, degrees.
const STILL_DEG: f64 = 0.5;
/// Most groups.
const MOST: usize = 6;

/// How the head was turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// From the axes of the head to those of the map.
    pub to_map: Quaternion,
    /// By how much the parts of the group differ from it, degrees.
    pub spread_deg: f64,
}

impl Turn {
    /// The matrix.
    pub(super) fn to_map(self) -> Matrix {
        rotation::matrix(self.to_map)
    }
}

/// A group of parts.
#[derive(Clone, Debug)]
struct Group {
    first: Quaternion,
    sum: Quaternion,
    spread_deg: f64,
    cues: Cues,
}

/// The groups of a look.
#[derive(Clone, Debug)]
pub struct Turns {
    groups: Vec<Group>,
    within_deg: f64,
}

impl Default for Turns {
    fn default() -> Turns {
        Turns { groups: Vec::new(), within_deg: WITHIN_DEG }
    }
}

impl Turns {
    /// Adds the cues of a part, and the turn in its middle.
    pub fn push(&mut self, to_map: Quaternion, cues: &Cues) {
        self.join(Group { first: to_map, sum: to_map, spread_deg: 0.0, cues: cues.clone() });
        while self.groups.len() > MOST {
            self.within_deg *= 1.5;
            for group in std::mem::take(&mut self.groups) {
                self.join(group);
            }
        }
    }

    /// Whether the head kept the axes of the map.
    pub fn is_ahead(&self) -> bool {
        let ahead = [1.0, 0.0, 0.0, 0.0];
        self.groups.iter().all(|group| angle_deg(group.first, ahead) + 2.0 * group.spread_deg < STILL_DEG)
    }

    /// The turn and the cues of each group.
    pub fn groups(&self) -> (Vec<Turn>, Vec<&Cues>) {
        let turn =
            |group: &Group| Turn { to_map: rotation::normalised(group.sum), spread_deg: group.spread_deg };
        (self.groups.iter().map(turn).collect(), self.groups.iter().map(|group| &group.cues).collect())
    }

    fn join(&mut self, other: Group) {
        let near = |group: &&mut Group| angle_deg(group.first, other.first) <= self.within_deg;
        let Some(group) = self.groups.iter_mut().find(near) else { return self.groups.push(other) };
        group.cues.add(&other.cues);
        let sign = if dot(group.sum, other.sum) < 0.0 { -1.0 } else { 1.0 };
        group.sum = std::array::from_fn(|at| group.sum[at] + sign * other.sum[at]);
        // Half the way from the first to the farthest.
        let away = 0.5 * angle_deg(group.first, other.first) + other.spread_deg;
        group.spread_deg = group.spread_deg.max(away);
    }
}

fn dot(a: Quaternion, b: Quaternion) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

/// The angle between two turns.
pub(super) fn angle_deg(a: Quaternion, b: Quaternion) -> f64 {
    2.0 * dot(a, b).abs().min(1.0).acos().to_degrees()
}
