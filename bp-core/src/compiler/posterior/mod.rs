//! Answers as values: distributions with the names of their values.
//!
//! In: the result of a strategy. Out: an [`Answer`], with its rows and its parts. Invariant: the probabilities of a
//! row's context sum to one, or are all zero where the context itself has probability zero.

pub(crate) mod check;
pub(crate) mod compare;
mod conditional;
mod covariance;
mod list;
mod marginal;
pub(crate) mod mixture;
mod moments;
mod named_law;
mod named_mixture;
mod numbers;
mod one_real;
mod part;
mod quantile;
mod rows;
mod show;
mod statistic;
mod stored;
mod table;

pub use conditional::ConditionalGaussian;
pub(crate) use conditional::apart;
pub use covariance::Covariance;
pub use list::AnswerRows;
pub(crate) use mixture::{Component, Mixture};
pub use named_law::NamedLaw;
pub(crate) use named_mixture::{NamedComponent, NamedMixture};
pub use numbers::Numbers;
pub use part::{Drawn, Part, PartLaw, Slot, ordinals};
pub(crate) use quantile::{figures, of_normal};
pub(crate) use rows::{Reader, named, will_fit};
pub(crate) use statistic::{check_draws, refused_of_reals, refused_values};
pub use stored::Stored;
pub use table::{Column, Table};

use crate::equation::Strategy;
use crate::exec::{compiled::least_tied, scalar::Scalar};
use crate::model::When;
use crate::sample::Moments;
use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};

/// The answer to one ask.
///
/// As JSON it has the question, ln P(evidence), the estimate, the rows, and `covariance` where several reals are asked
/// together: their matrix in the order of the rows, or a list of matrices, one for each instant or combination of values
/// of finite variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer {
    /// The question, as a user would type it.
    pub question: String,
    /// ln P(evidence), if the evidence is one event; a density if it is real.
    pub ln_evidence: Option<f64>,
    /// The estimate, if it is not exact.
    pub estimate: Option<Estimate>,
    /// The rows: all values of a distribution, the maximisers of an argmax, or one number.
    pub answer: AnswerRows,
    /// The strategy.
    pub strategy: Strategy,
    /// Its instants.
    pub when: When,
    /// The distributions of the rows, by variable and element.
    pub parts: Vec<Part>,
}

impl Serialize for Answer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("question", &self.question)?;
        if let Some(ln_evidence) = &self.ln_evidence {
            map.serialize_entry("ln_evidence", ln_evidence)?;
        }
        if let Some(estimate) = &self.estimate {
            map.serialize_entry("estimate", estimate)?;
        }
        if self.strategy == Strategy::ExtendedKalman {
            map.serialize_entry("approximate", "linearised")?;
        }
        map.serialize_entry("answer", &self.answer)?;
        let covariances = self.covariances();
        match covariances.as_slice() {
            [] => {}
            [one] if self.answer[one.first].values.len() == 1 => {
                map.serialize_entry("covariance", &one.matrix)?;
            }
            each => {
                let matrices: Vec<_> = each.iter().map(|one| &one.matrix).collect();
                map.serialize_entry("covariance", &matrices)?;
            }
        }
        map.end()
    }
}

/// The estimate of an answer.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Estimate {
    /// Number of draws.
    pub particles: usize,
    /// The effective number of draws.
    pub effective: f64,
    /// The random seed.
    pub seed: u64,
    /// The standard error of ln P(evidence), if available.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ln_evidence_error: Option<f64>,
    /// A warning about the estimate, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
}

/// One row of an answer.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Row {
    /// The names of the values, variable by variable, in the order of the question.
    #[serde(serialize_with = "as_map")]
    pub values: Vec<(String, String)>,
    /// The entry of the row.
    #[serde(flatten)]
    pub figure: Figure,
}

/// The entry of a row.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub enum Figure {
    /// A probability, or the density of a given real.
    Probability {
        /// The probability.
        p: f64,
    },
    /// ln of the probability of the values of the row together with the evidence.
    LnProbability {
        /// It, in nats.
        ln_p: f64,
    },
    /// The density of reals at the values of the row.
    Density {
        /// The density; infinite where some of them are determined.
        #[serde(serialize_with = "finite_or_word")]
        density: f64,
    },
    /// An entropy.
    Entropy {
        /// In nats; −∞ where a real is determined.
        #[serde(serialize_with = "finite_or_word")]
        entropy: f64,
        /// Its standard error, where it is estimated.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<f64>,
    },
    /// A probability, estimated.
    Estimated {
        /// The probability.
        p: f64,
        /// Its standard error.
        error: f64,
    },
    /// The most probable value of a real, from draws.
    Mode {
        /// The estimator.
        by: &'static str,
    },
    /// A value that was drawn.
    Draw {
        /// Its number, from 1.
        draw: usize,
    },
    /// An expectation.
    Expectation {
        /// Σ s p.
        expectation: f64,
        /// Its standard error, where it is estimated.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<f64>,
    },
    /// A variance.
    Variance {
        /// Σ (s − expectation)² p.
        variance: f64,
        /// Its standard error, where it is estimated.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<f64>,
    },
    /// A quantile.
    Quantile {
        /// Its level.
        level: f64,
        /// It.
        quantile: f64,
        /// Its standard error, where it is estimated.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<f64>,
    },
    /// The equal-tailed interval.
    Interval {
        /// The probability that it holds the value.
        level: f64,
        /// Its ends.
        interval: [f64; 2],
        /// Their standard errors, where they are estimated.
        #[serde(skip_serializing_if = "Option::is_none")]
        errors: Option<[f64; 2]>,
    },
    /// The mutual information of two variables.
    Information {
        /// In nats; infinite where reals determine something of each other.
        #[serde(serialize_with = "finite_or_word")]
        information: f64,
    },
    /// The divergence of one distribution from another.
    Divergence {
        /// In nats. JSON has no infinity: there it is the word `"infinite"`.
        #[serde(serialize_with = "finite_or_word")]
        divergence: f64,
        /// Whether the second is zero where the first is not.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        infinite: bool,
    },
    /// The estimates of a real from draws; each with its standard error.
    Real {
        /// Mean.
        mean: [f64; 2],
        /// Standard deviation.
        deviation: [f64; 2],
        /// The quantiles at 5 %, 50 % and 95 %.
        quantiles: [[f64; 2]; 3],
    },
    /// A mixture of normal laws.
    Mixture {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
        /// The quantiles at 5 %, 50 % and 95 %.
        quantiles: [f64; 3],
    },
    /// A normal law.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// A law under its usual name.
    Law {
        /// The law.
        law: NamedLaw,
        /// Mean; NaN where the law has none. JSON has the word `"undefined"` there.
        #[serde(serialize_with = "finite_or_word")]
        mean: f64,
        /// Standard deviation; infinite or NaN where the law has none.
        #[serde(serialize_with = "finite_or_word")]
        deviation: f64,
        /// The quantiles at 5 %, 50 % and 95 %.
        quantiles: [f64; 3],
    },
}

impl Row {
    /// The probability; `None` for a row of another kind.
    pub fn p(&self) -> Option<f64> {
        match self.figure {
            Figure::Probability { p } | Figure::Estimated { p, .. } => Some(p),
            _ => None,
        }
    }
}

impl Figure {
    /// The estimators of a mode.
    pub(crate) const MODES: [&'static str; 2] = ["half-sample mode", "most probable of the drawn paths"];

    /// The moments and quantiles of one slot of a mixture.
    pub(crate) fn of_mixture(mixture: &Mixture, place: usize) -> Self {
        let quantiles = Moments::LEVELS.map(|level| mixture.quantile(place, level));
        Figure::Mixture { mean: mixture.mean(place), deviation: mixture.deviation(place), quantiles }
    }

    /// The moments and quantiles of a named law.
    pub(crate) fn of_law(law: NamedLaw) -> Self {
        let quantiles = Moments::LEVELS.map(|level| law.quantile(level));
        Figure::Law { law, mean: law.mean(), deviation: law.deviation(), quantiles }
    }

    /// The moments and quantiles of a real, estimated from draws.
    pub(crate) fn real(of: &Moments) -> Self {
        Figure::Real { mean: of.mean, deviation: of.deviation, quantiles: of.quantiles }
    }

    /// The number of a figure that has one.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Figure::Probability { p } | Figure::Estimated { p, .. } => Some(p),
            Figure::LnProbability { ln_p: number }
            | Figure::Density { density: number }
            | Figure::Entropy { entropy: number, .. }
            | Figure::Information { information: number }
            | Figure::Divergence { divergence: number, .. }
            | Figure::Expectation { expectation: number, .. }
            | Figure::Variance { variance: number, .. }
            | Figure::Quantile { quantile: number, .. } => Some(number),
            Figure::Draw { .. }
            | Figure::Mode { .. }
            | Figure::Interval { .. }
            | Figure::Real { .. }
            | Figure::Mixture { .. }
            | Figure::Law { .. }
            | Figure::Normal { .. } => None,
        }
    }
}

fn finite_or_word<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match number.is_finite() {
        true => serializer.serialize_f64(*number),
        false => serializer.serialize_str(word(*number)),
    }
}

/// The word for a number that is not finite.
fn word(number: f64) -> &'static str {
    match number {
        number if number.is_nan() => "undefined",
        number if number > 0.0 => "infinite",
        _ => "-infinite",
    }
}

fn as_map<T: AsRef<str>, S: Serializer>(values: &[(T, T)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(values.len()))?;
    for (variable, value) in values {
        map.serialize_entry(variable.as_ref(), value.as_ref())?;
    }
    map.end()
}

/// Scores, of which the best is kept.
const PART: usize = 4096;

/// The positions of the largest score; with `nearest`, the one of these with the smallest value of that field (the
/// first, if several), so that at most one is left. None if no score is positive.
pub fn argmax<T: Scalar>(scores: &[T], nearest: Option<&[T]>) -> Vec<usize> {
    // The best of each part: most parts need no second look.
    let parts: Vec<T> = scores.chunks(PART).map(greatest).collect();
    let best = greatest(&parts);
    if best <= T::ZERO {
        return Vec::new();
    }
    let least = least_tied(best);
    let tied = (parts.iter().enumerate())
        .filter(|(_, best)| **best >= least)
        .flat_map(|(part, _)| part * PART..scores.len().min((part + 1) * PART))
        .filter(|position| scores[*position] >= least);
    match nearest {
        None => tied.collect(),
        Some(field) => tied
            .reduce(|best, other| if field[other] < field[best] { other } else { best })
            .into_iter()
            .collect(),
    }
}

/// Orders items by their scores, the largest first; those that are tied with the first of them by their places, as the table
/// has them, so that rounding does not decide.
pub(crate) fn rank<I>(
    items: &mut [I],
    score: impl Fn(&I) -> f64,
    least_tied: impl Fn(f64) -> f64,
    place: impl Fn(&I) -> [usize; 2],
) {
    items.sort_by(|one, other| score(other).total_cmp(&score(one)));
    let mut rest = items;
    while let Some(first) = rest.first() {
        let least = least_tied(score(first));
        let tied = rest.iter().take_while(|item| score(item) >= least).count().max(1);
        let (run, after) = rest.split_at_mut(tied);
        run.sort_by_key(&place);
        rest = after;
    }
}

/// The greatest of some numbers, 0 at least. Sixty-four at a time, since maxima one after another wait for each other.
fn greatest<T: Scalar>(scores: &[T]) -> T {
    let mut best = [T::ZERO; 64];
    let (chunks, rest) = scores.as_chunks::<64>();
    for chunk in chunks {
        for (best, score) in best.iter_mut().zip(chunk) {
            *best = best.maximum(*score);
        }
    }
    best.iter().chain(rest).fold(T::ZERO, |best, score| best.maximum(*score))
}
