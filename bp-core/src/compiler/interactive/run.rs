//! How a page computes results: which functions it calls, and in which order.
//!
//! In: nothing. Out: a [`Run`], which the page's `series.js` follows. Invariant: each run has one result: arrays of
//! probabilities, or the moments of normal laws, at one instant or at each.

use serde::Serialize;

/// How one result is computed.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Run {
    /// The names of its functions in the code.
    pub functions: Vec<String>,
    /// In which order they are called, of a question over time; otherwise the only one is called once.
    pub steps: Option<Steps>,
}

/// Which instants have an answer, and which functions a page calls for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// The last: the first function at the first instant, the second at each later one, and the third, if there is one, at the
    /// instants that are predicted.
    #[default]
    Last,
    /// Each, given all observations. Of finite states the third function has the message to the instant before, the fourth
    /// the distribution of an instant; of a normal law the moments of the first two are corrected.
    Smooth,
    /// The most likely states together: four functions as before, then the largest probability of each state, and the state
    /// before a known one.
    Sequence,
}

/// How the functions of a question over time are called.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Steps {
    /// The instants with an answer.
    pub way: Way,
    /// The input that takes the distribution of the instant before; empty if a normal law is carried, each number of which is
    /// an input.
    pub carried: String,
    /// The input that takes the message from later instants.
    pub later: String,
    /// The carried variables, of a sequence.
    pub states: Vec<State>,
    /// The number of reals that are carried.
    pub reals: usize,
    /// The number of instants that are predicted.
    pub ahead: usize,
    /// The observations without which an instant is not computed.
    pub needed: Vec<String>,
    /// The observations of several numbers of which all are given at an instant, or none.
    pub together: Vec<String>,
    /// The observations each number of which may be missing by itself: whether it is given has an input of the same shape.
    #[serde(skip)]
    pub apart: Vec<String>,
    /// Why the first instant has no answer, if it has none.
    pub absent: Option<String>,
}

/// A carried variable of a sequence.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct State {
    /// Its name.
    pub name: String,
    /// The input that takes its value at the instant after.
    pub input: String,
    /// The numbers of its values.
    pub numbers: Vec<f64>,
}
