//! Plans: how one question is answered, and by which strategies.
//!
//! In: a [`Model`] and a [`Question`]. Out: a [`Plan`]: a route for each group of asks that know the same, and what each strategy
//! offered. Invariant: a plan depends on the program, the question and the options alone.

mod print;
mod strategy;

pub use crate::equation::Strategy;
pub use crate::equation::{Cost, Elimination, Exact, Mark, Marked, Notation, Options, Rewrites, parts};
pub use strategy::Offer;

use crate::error::Error;
use crate::model::{Ask, Model, Question};
use crate::strategies::gaussian::{self, Gaussian};
use crate::strategies::join_tree::JoinTree;
use crate::strategies::over_time::OverTime;
use crate::strategies::weighting::Sampled;

/// How some asks are answered.
#[derive(Clone, PartialEq, Debug)]
pub enum Route {
    /// Sums and products.
    Exact(Exact),
    /// Sums and products, too many for loops: over a join tree.
    Tree(JoinTree),
    /// All is linear and Gaussian: closed form.
    Gaussian(Gaussian),
    /// No exact route: estimated by draws.
    Sampled(Sampled),
    /// Over time, from instant to instant.
    OverTime(OverTime),
}

/// How a question is answered.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// The question.
    pub question: Question,
    /// One route for each group of asks that know the same.
    pub routes: Vec<Route>,
    /// What the strategies offered for each of these groups, in the order in which they were tried.
    pub offers: Vec<Vec<Offer>>,
}

/// Plans a question.
///
/// # Errors
/// No route answers it: no exact one, and something in it cannot be drawn or weighed.
pub fn plan(model: &Model, question: &Question, options: Options) -> Result<Plan, Error> {
    let (mut routes, mut all_offers) = (Vec::new(), Vec::new());
    let mut add = |asks: &[Ask]| -> Result<(), Error> {
        let (route, offers) = strategy::choose(model, asks, options)?;
        routes.push(route);
        all_offers.push(offers);
        Ok(())
    };
    let (over_time, asks): (Vec<Ask>, Vec<Ask>) =
        question.asks.iter().cloned().partition(|ask| ask.when.is_over_time());
    for ask in over_time {
        add(&[ask])?;
    }
    let mut rest: Vec<Ask> = Vec::new();
    for part in asks.iter().flat_map(|ask| parts(model, ask)) {
        if !rest.contains(&part) {
            rest.push(part);
        }
    }
    while let Some(first) = rest.first().cloned() {
        let closed = gaussian::applies(model, &first);
        // A searched real stands for one value, which must not be taken for that of another ask.
        let real =
            |ask: &Ask| ask.searched.iter().any(|item| !model.variables[item.variable].domain.is_finite());
        let (asks, others): (Vec<Ask>, Vec<Ask>) = rest.into_iter().partition(|ask| {
            *ask == first
                || ask.known == first.known
                    && gaussian::applies(model, ask) == closed
                    && (closed || !(real(ask) || real(&first)))
        });
        rest = others;
        add(&asks)?;
    }
    Ok(Plan { question: question.clone(), routes, offers: all_offers })
}
