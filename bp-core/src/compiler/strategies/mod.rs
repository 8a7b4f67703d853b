//! Strategies: one folder for each way to answer, with what it offers, its engine, and its answers.
//!
//! In: a model, and asks that know the same. Out: what a strategy offers for them, and what it answers. Invariant: strategies are
//! chosen by the planner, never by each other; an offer that is accepted answers.

pub mod chain;
pub mod gaussian;
pub mod gibbs;
pub mod join_tree;
pub mod over_time;
pub mod particles;
mod route;
pub(crate) mod sums;
pub mod weighting;

pub use route::Route;

use crate::equation::{Line, Marked, Notation, Options, Strategy};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::kernel::Kernel;
use crate::model::{Ask, Model, Question};
use crate::posterior::{Answer, Table};
use crate::sample::Sampling;
use gaussian::Named;
use std::fmt::Debug;

/// What was observed at an instant: names of variables (of a family `Z[2]`), and values.
pub type Observed = Vec<(String, f64)>;

/// One way to answer.
pub(crate) trait Engine: Sync {
    /// What it offers for asks that know the same.
    ///
    /// # Errors
    /// Why it does not answer them.
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error>;
}

/// The options and earlier results that a strategy receives when it makes its offer.
#[derive(Clone, Copy)]
pub(crate) struct Turn<'t> {
    pub(crate) options: Options,
    /// Whether the user names it.
    pub(crate) forced: bool,
    /// Whether a join tree is offered.
    pub(crate) by_tree: bool,
    /// Why no exact strategy answers.
    pub(crate) not_exact: Option<&'t Error>,
}

/// An offer: how some asks are answered.
pub(crate) trait Offered {
    /// The strategy.
    fn strategy(&self) -> Strategy;
    /// What is asked; answers have this order.
    fn asks(&self) -> &[Ask];
    /// Products that are summed, where that is known before.
    fn cost(&self) -> Option<f64> {
        None
    }
    /// Which way the answer is found, and why it can be.
    fn reason(&self) -> &'static str;
    /// The lines that lead to the distribution, and those that make the answers of it.
    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>);
    /// The products that are computed, each with its range of numbers.
    fn marks(&self, _model: &Model, _notation: Notation) -> Vec<Marked> {
        Vec::new()
    }
    /// Why no code is printed of it, where none is.
    fn not_printed(&self) -> Option<String> {
        None
    }
    /// Compiles what does not depend on a case.
    ///
    /// # Errors
    /// What cannot be compiled.
    fn prepare(
        &self,
        model: &Model,
        question: &Question,
        purpose: Purpose,
    ) -> Result<Box<dyn Prepared>, Error>;
}

/// What becomes of the answers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Purpose {
    /// They are shown.
    Shown,
    /// They are compared with others; over time at each instant, or at the last one.
    Compared {
        /// Whether at each.
        each: bool,
    },
}

/// An offer that is ready to run.
pub(crate) trait Prepared: Debug + Send + Sync {
    /// Which of what it finds belongs to an ask.
    fn place(&self, ask: usize) -> usize {
        ask
    }
    /// The kernel that runs, where one does.
    fn kernel(&self) -> Option<&Kernel> {
        None
    }
    /// Answers a case.
    ///
    /// # Errors
    /// Inputs that are missing or do not fit; evidence of probability zero.
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error>;
}

/// Elements of families that are observed alone.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Findings {
    /// (variable, element from 0, ordinal of its value)
    pub hard: Vec<(VariableId, usize, usize)>,
    /// (variable, element from 0, a likelihood for each value)
    pub weighed: Vec<(VariableId, usize, Vec<f64>)>,
}

impl Findings {
    /// Whether nothing is observed so.
    pub fn is_empty(&self) -> bool {
        self.hard.is_empty() && self.weighed.is_empty()
    }
}

/// What is given to a question.
#[derive(Clone, Copy)]
pub(crate) struct Case<'c> {
    pub(crate) question: &'c Question,
    pub(crate) inputs: &'c Inputs<'c, f64>,
    /// What was observed, instant by instant.
    pub(crate) instants: &'c [Observed],
    pub(crate) sampling: Sampling,
    pub(crate) findings: Option<&'c Findings>,
}

/// What a strategy finds.
pub(crate) enum Found {
    /// A whole table, and ln P(evidence) where the evidence is an event.
    Table(Table, Option<f64>),
    /// An answer as it is shown.
    Answer(Answer),
    /// Normal laws, each with the values that name it, and the answer that is made of them, where it is shown.
    Normal(Vec<Named>, Option<Answer>),
}

/// The strategy of a name.
pub(crate) fn engine(strategy: Strategy) -> &'static dyn Engine {
    match strategy {
        Strategy::Gaussian => &gaussian::Engine,
        Strategy::JoinTree => &join_tree::Engine,
        Strategy::Sums => &sums::Engine,
        Strategy::Chain => &chain::Engine,
        Strategy::Weighting => &weighting::Engine,
        Strategy::Gibbs => &gibbs::Engine,
        Strategy::Particles => &particles::Engine,
    }
}

/// The error that a strategy does not answer.
pub(crate) fn refused(model: &Model, asks: &[Ask], reason: &str) -> Error {
    Error::Unplanned { question: model.ask_text(&asks[0]), reason: reason.to_owned() }
}
