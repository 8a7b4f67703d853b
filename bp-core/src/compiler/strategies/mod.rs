//! Strategies: one folder for each inference algorithm, with its offer, its engine, and its answers.
//!
//! In: a model, and asks with the same known variables. Out: the offers of the strategies, and their answers.
//! Invariant: the planner chooses strategies; they do not choose each other; an accepted offer answers.

pub mod chain;
pub mod conjugate;
pub mod gaussian;
pub mod gibbs;
pub mod join_tree;
pub mod mixture;
pub mod over_time;
pub mod particles;
mod route;
pub(crate) mod sums;
pub mod weighting;

pub use route::Route;
pub(crate) use sums::by_tables;

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

/// The observations of an instant: names of variables (of a family `Z[2]`), and values.
pub type Observed = Vec<(String, f64)>;

/// An inference algorithm.
pub(crate) trait Engine: Sync {
    /// The route that it offers for asks with the same known variables.
    ///
    /// # Errors
    /// The reason why it does not answer them.
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error>;
}

/// The options and earlier results that a strategy receives when it makes its offer.
#[derive(Clone, Copy)]
pub(crate) struct Turn<'t> {
    pub(crate) options: Options,
    /// Whether the user chose this strategy.
    pub(crate) forced: bool,
    /// Whether loops over elements of families take so many products that a join tree of the elements is asked for.
    pub(crate) by_element: bool,
    /// Whether the join tree is allowed to make an offer.
    pub(crate) by_tree: bool,
    /// The error of the exact strategies, where none answers.
    pub(crate) not_exact: Option<&'t Error>,
    /// Whether an exact answer exceeds the budget of the user.
    pub(crate) over_budget: bool,
}

/// An offer: how some asks are answered.
pub(crate) trait Offered {
    /// The strategy.
    fn strategy(&self) -> Strategy;
    /// The asks; answers have this order.
    fn asks(&self) -> &[Ask];
    /// The number of products that are summed, where it is known in advance; unknown sizes count 16.
    fn cost(&self, _model: &Model) -> Option<f64> {
        None
    }
    /// How the answer is found, and why that is possible.
    fn reason(&self) -> &'static str;
    /// The lines that derive the distribution, and those that compute the answers from it.
    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>);
    /// The products that are computed, each with the range of its numbers.
    fn marks(&self, _model: &Model, _notation: Notation) -> Vec<Marked> {
        Vec::new()
    }
    /// The reason why no code is printed, if it is not.
    fn not_printed(&self, _model: &Model) -> Option<String> {
        None
    }
    /// Compiles everything that does not depend on a case.
    ///
    /// # Errors
    /// An offer that cannot be compiled.
    fn prepare(
        &self,
        model: &Model,
        question: &Question,
        purpose: Purpose,
    ) -> Result<Box<dyn Prepared>, Error>;
}

/// The use of the answers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Purpose {
    /// They are shown; over time after each instant, or as the question says.
    Shown {
        /// Whether after each instant.
        each: bool,
    },
    /// They are compared with others; over time at each instant, or at the last one.
    Compared {
        /// Whether at each instant.
        each: bool,
    },
}

/// An offer that is ready to run.
pub(crate) trait Prepared: Debug + Send + Sync {
    /// Which of its results belongs to an ask.
    fn place(&self, ask: usize) -> usize {
        ask
    }
    /// The kernel, where the offer runs one.
    fn kernel(&self) -> Option<&Kernel> {
        None
    }
    /// Answers a case.
    ///
    /// # Errors
    /// Inputs that are missing or do not fit; evidence of probability zero.
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error>;
}

/// The likelihoods of an instant: names of variables (of a family `Z[2]`), and a number for each value.
pub type Likelihoods = Vec<(String, Vec<f64>)>;

/// Single elements of families that are observed or asked.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Findings {
    /// (variable, element from 0, ordinal of its value)
    pub hard: Vec<(VariableId, usize, usize)>,
    /// (variable, element from 0, a likelihood for each value)
    pub weighed: Vec<(VariableId, usize, Vec<f64>)>,
    /// The elements of a joint posterior, or the targets of observations: (variable, element from 0)
    pub about: Vec<(VariableId, usize)>,
    /// The candidates for observation: (variable, element from 0)
    pub among: Vec<(VariableId, usize)>,
    /// Over time, for each instant the likelihoods of variables or elements, by name.
    pub instants: Vec<Likelihoods>,
}

impl Findings {
    /// Whether a single element is observed or asked.
    pub fn are_elements(&self, model: &Model) -> bool {
        let asked = || self.about.iter().chain(&self.among);
        let is_element = |(id, _): &(VariableId, usize)| model.variables[*id].family.is_some();
        !self.hard.is_empty() || !self.weighed.is_empty() || asked().any(is_element)
    }
}

/// The inputs of a question.
#[derive(Clone, Copy)]
pub(crate) struct Case<'c> {
    pub(crate) question: &'c Question,
    pub(crate) inputs: &'c Inputs<'c, f64>,
    /// The observations, instant by instant.
    pub(crate) instants: &'c [Observed],
    pub(crate) sampling: Sampling,
    pub(crate) findings: Option<&'c Findings>,
}

/// The result of a strategy.
pub(crate) enum Found {
    /// A whole table, and ln P(evidence) where the evidence is an event.
    Table(Table, Option<f64>),
    /// An answer ready to be shown.
    Answer(Answer),
    /// Normal laws, each with the values that name it, and the answer made of them, where it is shown.
    Normal(Vec<Named>, Option<Answer>),
}

/// The strategy of a name.
pub(crate) fn engine(strategy: Strategy) -> &'static dyn Engine {
    match strategy {
        Strategy::Gaussian => &gaussian::Engine,
        Strategy::JoinTree => &join_tree::Engine,
        Strategy::Sums => &sums::Engine,
        Strategy::Conjugate => &conjugate::Engine,
        Strategy::Mixture => &mixture::Engine,
        Strategy::Chain => &chain::Engine,
        Strategy::Weighting => &weighting::Engine,
        Strategy::Gibbs => &gibbs::Engine,
        Strategy::Particles => &particles::Engine,
        Strategy::ExtendedKalman => &gaussian::ExtendedEngine,
    }
}

/// The error of a strategy that does not answer.
pub(crate) fn refused(model: &Model, asks: &[Ask], reason: &str) -> Error {
    Error::Unplanned { question: model.ask_text(&asks[0]), reason: reason.to_owned() }
}
