//! Questions: searched variables, known variables, and statistics.
//!
//! In: ids of variables. Out: a [`Question`]. Invariant: variables that are neither searched nor known are hidden, and
//! are summed out; the plate's index is always known.

use super::Derived;
use crate::ids::VariableId;
use serde::{Deserialize, Serialize};

/// One or more asks that share one pass over the data.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Question {
    /// Its name; empty for a question typed by a user.
    pub name: String,
    /// The asks, in order.
    pub asks: Vec<Ask>,
    /// Its derived variables: predicates, functions, elements and slices.
    #[serde(default)]
    pub derived: Vec<Derived>,
}

/// One ask: a statistic of a distribution.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Ask {
    /// The statistic.
    pub statistic: Statistic,
    /// The instant of the distribution, and the instants of its evidence.
    pub when: When,
    /// The searched variables: at least one.
    pub searched: Vec<Searched>,
    /// The known ones.
    pub known: Vec<Known>,
}

/// The instant of a distribution, and the instants of its evidence.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum When {
    /// One instant alone: `P(S | K)`.
    #[default]
    Now,
    /// The last instant, given all evidence up to it: `filter P(S | K)`.
    Filter,
    /// Some instants after the last evidence: `predict(3) P(S | K)`.
    Predict(usize),
    /// Every instant, given the evidence of all: `smooth P(S | K)`.
    Smooth,
    /// All instants together, given the evidence of all: `sequence P(S | K)`.
    Sequence,
}

/// A statistic of the answer.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Statistic {
    /// The distribution itself: `P(S | K)`.
    Distribution,
    /// Its largest value: `max P(S | K)`.
    Maximum,
    /// The values at which it is largest: `argmax P(S | K)`. Ties are broken by the smallest value of the field
    /// `nearest`, given at run time; then the first value is taken. For a sequence it is the most likely one (Viterbi
    /// 1967).
    Argmax {
        /// Name of the field that breaks ties.
        nearest: Option<String>,
    },
    /// The most probable values, best first: `best(5) P(S | K)`.
    Best(usize),
    /// Values drawn at random from a seed: `draw(10) P(S | K)`.
    Draw(usize),
    /// −Σ p ln p, in nats: `entropy P(S | K)` (paper, Eq. 5).
    Entropy,
    /// Σ s p, of each searched variable: `expectation P(S | K)`.
    Expectation,
    /// Σ (s − expectation)² p, of each searched variable: `variance P(S | K)`.
    Variance,
    /// The smallest value of each searched variable that it does not exceed with these probabilities:
    /// `quantile(0.1, 0.9) P(S | K)`.
    Quantile(Vec<f64>),
    /// Of each searched variable the quantiles at (1 − level) / 2 and (1 + level) / 2: `interval(0.9) P(S | K)`.
    Interval(f64),
    /// Σ p(x, y) ln (p(x, y) / (p(x) p(y))), in nats: `information P(X, Y | K)` (Shannon 1948).
    Information,
    /// Σ p ln (p / q), in nats: `divergence P(S | K) from P(S | K′)` (Kullback and Leibler 1951).
    Divergence {
        /// The instant of q; over time if and only if p is.
        when: When,
        /// The known variables of the second distribution, q; its searched variables are those of the first.
        from: Vec<Known>,
    },
}

impl Ask {
    /// The words before the distribution, followed by a blank; empty for a distribution without time.
    pub fn words(&self) -> String {
        let words = match (self.when, &self.statistic) {
            (When::Sequence, Statistic::Argmax { .. }) => [self.when.word(), String::new()],
            _ => [self.statistic.word(), self.when.word()],
        };
        words.iter().filter(|word| !word.is_empty()).map(|word| format!("{word} ")).collect()
    }
}

impl When {
    /// Its notation before the distribution; empty without time.
    pub fn word(&self) -> String {
        match self {
            When::Now => String::new(),
            When::Filter => "filter".to_owned(),
            When::Predict(steps) => format!("predict({steps})"),
            When::Smooth => "smooth".to_owned(),
            When::Sequence => "sequence".to_owned(),
        }
    }

    /// Whether it is over time.
    pub fn is_over_time(&self) -> bool {
        *self != When::Now
    }

    /// Whether it answers every instant.
    pub fn is_every_instant(&self) -> bool {
        matches!(self, When::Smooth | When::Sequence)
    }

    /// The number of instants after the last evidence.
    pub fn ahead(&self) -> usize {
        if let When::Predict(steps) = self { *steps } else { 0 }
    }
}

impl Statistic {
    /// Its notation before the distribution; empty for the distribution itself.
    pub fn word(&self) -> String {
        match self {
            Statistic::Distribution => String::new(),
            Statistic::Maximum => "max".to_owned(),
            Statistic::Argmax { .. } => "argmax".to_owned(),
            Statistic::Best(count) => format!("best({count})"),
            Statistic::Draw(count) => format!("draw({count})"),
            Statistic::Entropy => "entropy".to_owned(),
            Statistic::Expectation => "expectation".to_owned(),
            Statistic::Variance => "variance".to_owned(),
            Statistic::Quantile(levels) => {
                let levels: Vec<String> = levels.iter().map(f64::to_string).collect();
                format!("quantile({})", levels.join(", "))
            }
            Statistic::Interval(level) => format!("interval({level})"),
            Statistic::Information => "information".to_owned(),
            Statistic::Divergence { .. } => "divergence".to_owned(),
        }
    }

    /// The levels of the quantiles that it consists of; none of another statistic.
    pub fn levels(&self) -> Option<Vec<f64>> {
        match self {
            Statistic::Quantile(levels) => Some(levels.clone()),
            Statistic::Interval(level) => Some(vec![0.5 - 0.5 * level, 0.5 + 0.5 * level]),
            _ => None,
        }
    }

    /// The known variables of the second distribution; empty if there is none.
    pub fn from(&self) -> &[Known] {
        if let Statistic::Divergence { from, .. } = self { from } else { &[] }
    }
}

/// A searched variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Searched {
    /// The variable; a family means all of its elements.
    pub variable: VariableId,
    /// The value, if the probability of one value is asked.
    pub at: Option<Value>,
}

/// A known variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Known {
    /// The variable; a family means all of its elements.
    pub variable: VariableId,
    /// Its evidence.
    pub evidence: Finding,
}

impl Known {
    /// Multiplies the likelihoods of two findings of one variable; false where they are others, or a product is rounded to 0.
    pub(crate) fn multiply(&mut self, other: &Self) -> bool {
        let (Finding::Virtual(own), Finding::Virtual(more)) = (&mut self.evidence, &other.evidence) else {
            return false;
        };
        if self.variable != other.variable || own.len() != more.len() {
            return false;
        }
        let product: Vec<f64> = own.iter().zip(more).map(|(one, other)| one * other).collect();
        let is_kept = |((product, one), other): ((&f64, &f64), &f64)| {
            product.is_normal() || *one == 0.0 || *other == 0.0
        };
        let all_kept = product.iter().zip(own.iter()).zip(more).all(is_kept);
        if all_kept {
            *own = product;
        }
        all_kept
    }

    /// Whether all of the variable is known by one value: of a vector, each component.
    pub(crate) fn is_whole(&self) -> bool {
        match &self.evidence {
            Finding::Hard(Value::Vector(numbers)) => numbers.iter().all(|number| !number.is_nan()),
            Finding::Hard(_) => true,
            _ => false,
        }
    }
}

/// The evidence of a known variable.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Finding {
    /// Its value.
    Hard(Value),
    /// No value: the answer is a table with a row for each value. (Real numbers, which have no table, and variables
    /// whose form is a question to another program, are given when asked.)
    Each,
    /// A likelihood for each of its values, in the domain's order: virtual evidence in Pearl's sense. It multiplies the
    /// joint distribution and need not sum to one.
    Virtual(Vec<f64>),
    /// A probability for each of its values, in the domain's order: soft evidence in Jeffrey's sense. It replaces the
    /// posterior of the variable, after hard and virtual evidence, in the order in which it is written.
    Soft(Vec<f64>),
}

/// A value in a question.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Value {
    /// The value with this ordinal of a finite domain.
    Ordinal(usize),
    /// A real number.
    Real(f64),
    /// A number for each component of a vector.
    Vector(Vec<f64>),
    /// A value given each time that the question is asked, under this name: `Z = z`.
    Given(String),
}
