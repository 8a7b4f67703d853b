//! The report of learning.
//!
//! In: a learner and its result. Out: a [`Report`]. Invariant: missing values, empty contexts and pooled cases are
//! reported.

use super::distribution::{Kind, Learnable, Share, cells_of};
use super::estimate::Outcome;
use super::expect::never_seen;
use super::learner::Learner;
use super::likelihood::ln_likelihood;
use super::statistics::Statistic;
use crate::model::Fit;
use crate::spelling::number as written;
use serde::Serialize;
use std::collections::BTreeSet;

/// A report of learning.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// Number of cases.
    pub cases: usize,
    /// The sum of their weights, if they have any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
    /// Number of missing cells, without hidden variables.
    pub cells_missing: usize,
    /// Variables observed in no case.
    pub hidden: Vec<String>,
    /// ln P of the data by the whole program, known forms included; missing values are summed out.
    pub ln_likelihood: f64,
    /// The course of EM, if there are hidden variables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expectation: Option<Course>,
    /// Form by form.
    pub forms: Vec<FormReport>,
}

/// The course of expectation–maximisation.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Course {
    /// Number of iterations.
    #[serde(rename = "iterations")]
    pub steps: usize,
    /// Whether it converged.
    pub converged: bool,
    /// Whether the last step was rejected, because it and its fractions would have lowered the likelihood.
    pub held: bool,
    /// Whether it was interrupted.
    pub interrupted: bool,
    /// The random seed of the initial values.
    pub seed: u64,
    /// Whether initial values were random: then another seed may lead to another maximum.
    pub drawn: bool,
    /// ln L + ln prior at each step.
    pub trail: Vec<f64>,
    /// ln L at the last.
    #[serde(skip)]
    pub(super) ln_likelihood: f64,
}

/// The result for one form.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FormReport {
    /// Its head.
    pub form: String,
    /// Its estimator.
    pub learned: String,
    /// Free parameters.
    pub parameters: usize,
    /// Number of distributions: one for each combination of right-hand values.
    pub contexts: usize,
    /// Number of distributions without cases.
    pub empty: usize,
    /// Number of distributions at the floor, because most of their values are equal.
    pub floored: usize,
    /// Number of distributions with a parameter at its limit.
    pub limited: usize,
    /// The indices whose values share the distributions, each with the number of its values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shared: Vec<(String, usize)>,
    /// The components of a vector whose values share the distributions; 1 of a number.
    #[serde(skip_serializing_if = "is_one")]
    pub components: usize,
    /// ln P of the observed, or expected, values of this form.
    pub ln_likelihood: f64,
}

fn is_one(count: &usize) -> bool {
    *count == 1
}

/// The outcome of learning, in numbers.
pub(super) struct Figures<'f> {
    pub(super) statistics: &'f [Statistic],
    pub(super) outcomes: &'f [Outcome],
    pub(super) ln_likelihood: f64,
    pub(super) course: Option<Course>,
}

pub(super) fn report(learner: &Learner, learnable: &Learnable, figures: Figures<'_>) -> Report {
    let program = &learnable.program;
    let mut forms: Vec<FormReport> = (program.factors.iter())
        .map(|factor| FormReport {
            form: program.head(*factor),
            learned: String::new(),
            parameters: 0,
            contexts: 0,
            empty: 0,
            floored: 0,
            limited: 0,
            shared: program.shared(*factor),
            components: program.components(*factor),
            ln_likelihood: 0.0,
        })
        .collect();
    let mut counted = BTreeSet::new();
    let all = learnable.distributions().iter().zip(figures.statistics).zip(figures.outcomes);
    for ((distribution, statistic), outcome) in all {
        let form = &mut forms[learnable.rank(distribution.factor)];
        let cells = cells_of(&distribution.kind);
        let all = matches!(&distribution.kind, Kind::Row(row) if !row.contains(&Share::Rest));
        let new = cells.into_iter().filter(|cell| counted.insert(*cell)).count();
        form.parameters += new.saturating_sub(usize::from(all));
        form.contexts += 1;
        form.empty += usize::from(*outcome == Outcome::Empty);
        form.floored += usize::from(*outcome == Outcome::Floored);
        form.limited += usize::from(*outcome == Outcome::Limited);
        // A sum of nothing is −0.
        form.ln_likelihood += ln_likelihood(learnable, distribution, statistic) + 0.0;
        let learned = way(distribution.fit.as_ref(), &distribution.kind);
        if !form.learned.contains(&learned) {
            let separator = if form.learned.is_empty() { "" } else { ", " };
            form.learned = format!("{}{separator}{learned}", form.learned);
        }
    }
    // Probabilities are 1 at most, but for rounding.
    let finite = program.slots.iter().all(|slot| slot.count.is_some());
    let most = if finite { 0.0 } else { f64::INFINITY };
    let missing = |(seen, of_rows): (&usize, &bool)| match *seen == 0 && !of_rows {
        true => 0,
        false => learner.cases - seen,
    };
    Report {
        cases: learner.cases,
        weight: learner.weighted.then(|| learner.observed.total()),
        cells_missing: learner.seen.iter().zip(&learner.of_rows).map(missing).sum(),
        hidden: never_seen(program, &learner.seen),
        ln_likelihood: figures.ln_likelihood.min(most) + 0.0,
        expectation: figures.course,
        forms,
    }
}

/// The name of an estimator.
fn way(fit: Option<&Fit>, kind: &Kind) -> String {
    match (fit, kind) {
        (Some(Fit::LaplaceSuccession), _) => "laplace_succession".to_owned(),
        (Some(Fit::Histogram), _) => "histogram".to_owned(),
        (Some(Fit::Dirichlet(prior)), _) => format!("dirichlet({})", written(*prior)),
        (Some(Fit::Beta(a, b)), _) => format!("beta({}, {})", written(*a), written(*b)),
        (Some(Fit::UnbiasedNormal), _) => "normal, unbiased".to_owned(),
        (Some(Fit::LinearRegression), _) => "linear_regression".to_owned(),
        (Some(Fit::Conjugate { law, .. }), _) => format!("{}, prior", law.name()),
        (Some(Fit::Law { law, .. }), _) | (None, Kind::Law(law, _)) => law.name().to_owned(),
        (None, _) => "parameters".to_owned(),
    }
}
