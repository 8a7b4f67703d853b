//! Questions: what is searched, what is known, and what is made of the answer.
//!
//! In: ids of variables. Out: a [`Question`]. Invariant: variables that are neither searched nor known are
//! free, and are summed out; the plate's index is always known.

use crate::ids::VariableId;
use serde::{Deserialize, Serialize};

/// One or more things asked at once; they share one pass over the data.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Question {
    /// Its name; a question that a user typed has none.
    pub name: String,
    /// What is asked, in order.
    pub asks: Vec<Ask>,
}

/// One thing asked.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Ask {
    /// What is made of the distribution.
    pub reduction: Reduction,
    /// The searched variables: at least one.
    pub searched: Vec<Searched>,
    /// The known ones.
    pub known: Vec<Known>,
}

/// What is made of the distribution that answers.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Reduction {
    /// The distribution itself: `P(S | K)`.
    Probability,
    /// Its largest value: `max P(S | K)`.
    Maximum,
    /// The values at which it is largest: `argmax P(S | K)`. Among equals, the one with the smallest value of
    /// the field `nearest`, bound from outside; then the first.
    Argmax {
        /// Name of the field that breaks ties.
        nearest: Option<String>,
    },
    /// −Σ p ln p, in nats: `entropy P(S | K)` (paper, Eq. 5).
    Entropy,
}

/// A searched variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Searched {
    /// Which; a family means all of its elements.
    pub variable: VariableId,
    /// Where the probability of one value is wanted, that value.
    pub at: Option<Value>,
}

/// A known variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Known {
    /// Which; a family means all of its elements.
    pub variable: VariableId,
    /// What is known of it.
    pub evidence: Evidence,
}

/// What is known of a known variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Evidence {
    /// Its value.
    Hard(Value),
    /// Nothing yet: the answer is a table with a row for each value. (Real numbers, which have no table, and
    /// variables whose form is a question to another program, are given when asked.)
    Each,
    /// A likelihood for each of its values, in the domain's order: virtual evidence in Pearl's sense. It
    /// multiplies the joint distribution and needs not sum to one.
    Virtual(Vec<f64>),
}

/// A value in a question.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Value {
    /// The value with this ordinal of a finite domain.
    Ordinal(usize),
    /// A real number.
    Real(f64),
    /// A value given each time that the question is asked, under this name: `Z = z`.
    Given(String),
}
