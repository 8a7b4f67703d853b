//! What was learned from what, in figures.
//!
//! In: a learner and what it learned. Out: a [`Report`]. Invariant: nothing that was missing, empty or put together from
//! other cases is passed over in silence.

use super::distribution::{Kind, Learnable, Share, cells_of};
use super::estimate::Outcome;
use super::learner::Learner;
use super::likelihood::ln_likelihood;
use super::statistics::Statistic;
use crate::ids::Id;
use crate::model::Fit;
use serde::Serialize;
use std::collections::BTreeSet;

/// What was learned from what.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// How many cases.
    pub cases: usize,
    /// How many of their cells were missing, hidden variables not counted.
    pub cells_missing: usize,
    /// Variables that no case shows.
    pub hidden: Vec<String>,
    /// ln P of what was seen, by the forms that were learned; where something is hidden, by the whole program.
    pub ln_likelihood: f64,
    /// How hidden variables were dealt with, if there were any.
    pub expectation: Option<Expectation>,
    /// Form by form.
    pub forms: Vec<FormReport>,
}

/// The course of expectation–maximisation.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Expectation {
    /// How many steps.
    pub iterations: usize,
    /// Whether the last step gained less than the threshold.
    pub converged: bool,
    /// What the start was drawn from.
    pub seed: u64,
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
    /// Those to which too few belong to tell a law.
    pub pooled: usize,
    /// ln P of what was seen, or is expected to have been, by this form.
    pub ln_likelihood: f64,
}

pub(super) fn report(
    learner: &Learner,
    learnable: &Learnable,
    statistics: &[Statistic],
    outcomes: &[Outcome],
    expectation: Option<Expectation>,
) -> Report {
    let model = &learnable.model;
    let mut forms: Vec<FormReport> = (learnable.factors.iter())
        .map(|factor| FormReport {
            form: learnable.head(*factor),
            learned: String::new(),
            parameters: 0,
            contexts: 0,
            empty: 0,
            pooled: 0,
            ln_likelihood: 0.0,
        })
        .collect();
    let mut counted = BTreeSet::new();
    for ((distribution, statistic), outcome) in learnable.distributions.iter().zip(statistics).zip(outcomes) {
        let form = &mut forms[learnable.rank(distribution.factor)];
        let cells = cells_of(&distribution.kind);
        let all = matches!(&distribution.kind, Kind::Row(row) if !row.contains(&Share::Rest));
        let new = cells.into_iter().filter(|cell| counted.insert(*cell)).count();
        form.parameters += new.saturating_sub(usize::from(all));
        form.contexts += 1;
        form.empty += usize::from(*outcome == Outcome::Empty);
        form.pooled += usize::from(*outcome == Outcome::Pooled);
        form.ln_likelihood += ln_likelihood(learnable, distribution, statistic);
        let learned = way(distribution.fit.as_ref(), &distribution.kind);
        if !form.learned.contains(&learned) {
            let separator = if form.learned.is_empty() { "" } else { ", " };
            form.learned = format!("{}{separator}{learned}", form.learned);
        }
    }
    let cases = learner.cases;
    let (mut cells_missing, mut hidden) = (0, Vec::new());
    for id in model.variables.ids() {
        match learner.seen[id.position()] {
            0 => hidden.push(model.variable_name(id)),
            seen => cells_missing += cases - seen,
        }
    }
    let ln_likelihood = match &expectation {
        Some(expectation) => expectation.ln_likelihood,
        None => forms.iter().map(|form| form.ln_likelihood).sum(),
    };
    Report { cases, cells_missing, hidden, ln_likelihood, expectation, forms }
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
