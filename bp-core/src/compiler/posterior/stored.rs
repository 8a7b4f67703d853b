//! An answer as plain data, to be stored and read again: with all of its numbers, in a format of serde that is not
//! for readers.
//!
//! In: an [`Answer`]. Out: [`Stored`], and back. Invariant: the answer that comes back is equal. (The JSON document of an answer is
//! for readers: it has the rows without the distributions.)

use super::{Answer, AnswerRows, Estimate, Figure, NamedLaw, Part, Row};
use crate::equation::Strategy;
use crate::model::{Model, When};
use serde::{Deserialize, Deserializer, Serialize};

/// An answer as plain data.
#[derive(Serialize, Deserialize)]
pub struct Stored {
    question: String,
    ln_evidence: Option<f64>,
    estimate: Option<Estimate>,
    /// The rows, where they are not those of the parts.
    rows: Option<Vec<StoredRow>>,
    strategy: Strategy,
    when: When,
    parts: Vec<Part>,
}

#[derive(Serialize, Deserialize)]
struct StoredRow {
    values: Vec<(String, String)>,
    #[serde(with = "PlainFigure")]
    figure: Figure,
}

impl Stored {
    /// The data of an answer.
    pub(crate) fn of(model: &Model, answer: &Answer) -> Self {
        let Answer { question, ln_evidence, estimate, strategy, when, parts, .. } = answer.clone();
        let row = |row: &Row| StoredRow { values: row.values.clone(), figure: row.figure };
        let is_of_parts = !parts.is_empty() && AnswerRows::of_parts(model, &parts) == answer.answer;
        let rows = (!is_of_parts).then(|| answer.answer.iter().map(row).collect());
        Self { question, ln_evidence, estimate, rows, strategy, when, parts }
    }

    /// The answer.
    pub(crate) fn answer(self, model: &Model) -> Answer {
        let Self { question, ln_evidence, estimate, rows, strategy, when, parts } = self;
        let row = |StoredRow { values, figure }| Row { values, figure };
        let answer = match rows {
            Some(rows) => rows.into_iter().map(row).collect(),
            None => AnswerRows::of_parts(model, &parts),
        };
        Answer { question, ln_evidence, estimate, answer, strategy, when, parts }
    }
}

/// A name that the reader does not borrow.
type Name = &'static str;

/// [`Figure`] with the names of its variants, and with numbers that are not finite.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Figure")]
enum PlainFigure {
    Probability {
        p: f64,
    },
    LnProbability {
        ln_p: f64,
    },
    Density {
        density: f64,
    },
    Entropy {
        entropy: f64,
        error: Option<f64>,
    },
    Estimated {
        p: f64,
        error: f64,
    },
    Mode {
        #[serde(deserialize_with = "estimator")]
        by: Name,
    },
    Draw {
        draw: usize,
    },
    Expectation {
        expectation: f64,
        error: Option<f64>,
    },
    Variance {
        variance: f64,
        error: Option<f64>,
    },
    Quantile {
        level: f64,
        quantile: f64,
        error: Option<f64>,
    },
    Interval {
        level: f64,
        interval: [f64; 2],
        errors: Option<[f64; 2]>,
    },
    Information {
        information: f64,
    },
    Divergence {
        divergence: f64,
        infinite: bool,
    },
    Real {
        mean: [f64; 2],
        deviation: [f64; 2],
        quantiles: [[f64; 2]; 3],
    },
    Mixture {
        mean: f64,
        deviation: f64,
        quantiles: [f64; 3],
    },
    Normal {
        mean: f64,
        deviation: f64,
    },
    Law {
        law: NamedLaw,
        mean: f64,
        deviation: f64,
        quantiles: [f64; 3],
    },
}

/// The estimator of a mode, by its name.
fn estimator<'d, D: Deserializer<'d>>(deserializer: D) -> Result<Name, D::Error> {
    let name = String::deserialize(deserializer)?;
    let found = Figure::MODES.into_iter().find(|own| **own == name);
    found.ok_or_else(|| serde::de::Error::custom(format!("`{name}` is no estimator of a mode")))
}
