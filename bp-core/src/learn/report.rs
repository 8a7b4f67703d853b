//! What was learned from what, in figures.
//!
//! In: a learner and what it learned. Out: a [`Report`]. Invariant: nothing that was missing, empty or put together from
//! other cases is passed over in silence.

use super::distribution::{Kind, Learnable, Share, cells_of};
use super::estimate::Outcome;
use super::expect::never_seen;
use super::learner::Learner;
use super::likelihood::ln_likelihood;
use super::statistics::Statistic;
use crate::model::Fit;
use serde::Serialize;
use std::collections::BTreeSet;

/// What was learned from what.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// How many cases.
    pub cases: usize,
    /// The sum of their weights, where they have some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
    /// How many of their cells were missing, hidden variables not counted.
    pub cells_missing: usize,
    /// Variables that no case shows.
    pub hidden: Vec<String>,
    /// ln P of all that was seen, by the whole program: forms that are known count too, what is missing is summed out.
    pub ln_likelihood: f64,
    /// How hidden variables were dealt with, if there were any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expectation: Option<Course>,
    /// Form by form.
    pub forms: Vec<FormReport>,
}

/// The course of expectation–maximisation.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Course {
    /// How many steps.
    #[serde(rename = "iterations")]
    pub steps: usize,
    /// Whether the last step changed less than the thresholds say.
    pub converged: bool,
    /// Whether the last step was taken back, because it and its fractions would have lowered the likelihood.
    pub held: bool,
    /// Whether it was asked to stop before that.
    pub interrupted: bool,
    /// What the start was drawn from.
    pub seed: u64,
    /// Whether something of the start was drawn: then another seed may lead to another maximum.
    pub drawn: bool,
    /// ln L + ln prior at each step.
    pub trail: Vec<f64>,
    /// ln L at the last.
    #[serde(skip)]
    pub(super) ln_likelihood: f64,
}

/// What was learned of one form.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FormReport {
    /// Its head.
    pub form: String,
    /// How it was learned.
    pub learned: String,
    /// Free parameters.
    pub parameters: usize,
    /// Distributions: one for each combination of values on the right.
    pub contexts: usize,
    /// Those to which no case belongs.
    pub empty: usize,
    /// Those whose cases are so alike that their law was kept from becoming narrower.
    pub floored: usize,
    /// ln P of what was seen, or is expected to have been, by this form.
    pub ln_likelihood: f64,
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
        form.ln_likelihood += ln_likelihood(learnable, distribution, statistic);
        let learned = way(distribution.fit.as_ref(), &distribution.kind);
        if !form.learned.contains(&learned) {
            let separator = if form.learned.is_empty() { "" } else { ", " };
            form.learned = format!("{}{separator}{learned}", form.learned);
        }
    }
    let missing = |seen: &usize| if *seen == 0 { 0 } else { learner.cases - seen };
    Report {
        cases: learner.cases,
        weight: learner.weighted.then(|| learner.observed.values().sum()),
        cells_missing: learner.seen.iter().map(missing).sum(),
        hidden: never_seen(program, &learner.seen),
        ln_likelihood: figures.ln_likelihood,
        expectation: figures.course,
        forms,
    }
}

/// How a distribution is learned, in a word or two.
fn way(fit: Option<&Fit>, kind: &Kind) -> String {
    match (fit, kind) {
        (Some(Fit::LaplaceSuccession), _) => "laplace_succession".to_owned(),
        (Some(Fit::Histogram), _) => "histogram".to_owned(),
        (Some(Fit::Dirichlet(prior)), _) => format!("dirichlet({prior})"),
        (Some(Fit::Beta(a, b)), _) => format!("beta({a}, {b})"),
        (Some(Fit::UnbiasedNormal), _) => "normal, unbiased".to_owned(),
        (Some(Fit::LinearRegression), _) => "linear_regression".to_owned(),
        (Some(Fit::Conjugate { law, .. }), _) => format!("{}, prior", law.name()),
        (Some(Fit::Law { law, .. }), _) | (None, Kind::Law(law, _)) => law.name().to_owned(),
        (None, _) => "parameters".to_owned(),
    }
}
