//! Learning: the parameters of a program from data.
//!
//! In: a [`Model`] in which forms are `unknown` or `identification` names parameters, and [`Case`]s. Out: the same
//! model with numbers, and a [`Report`]. Invariant: everything else is unchanged.
//!
//! ```
//! use bp_core::compiler::learn::{Case, Learner};
//! use bp_core::compiler::source::Source;
//! let text = "program Coin { variables { Heads : bool; } decomposition { P(Heads) }
//!             forms { P(Heads) = unknown(beta(1, 1)); } question heads { P(Heads = true) } }";
//! let model = bp_core::compiler::syntax::compile(&Source::new("coin", text)).unwrap();
//! let mut learner = Learner::new(&model).unwrap();
//! for toss in ["false", "true", "false", "false"] {
//!     learner.observe(&Case::new(&model).with_value(&model, "Heads", toss).unwrap()).unwrap();
//! }
//! let learned = learner.learned().unwrap();
//! let question = model.question("heads").unwrap();
//! let answer = bp_core::compiler::answer::ask(learned.model(), question, &bp_core::compiler::exec::Inputs::new()).unwrap();
//! assert!((answer[0].answer[0].p().unwrap() - 1.0 / 3.0).abs() < 1e-15);
//! ```

mod accelerate;
mod case;
mod climb;
mod cliques;
mod columns;
mod density;
mod distinct;
mod distribution;
mod estimate;
mod expect;
mod family_columns;
mod floor;
mod kind;
mod learner;
mod likelihood;
mod maximise;
mod messages;
mod normals;
mod over_time;
mod parametric;
mod pattern;
mod program;
mod regression;
mod report;
mod statistics;
mod terms;
mod text;
mod uniform_bins;

pub use case::Case;
pub use columns::{Columns, sizes};
pub use learner::Learner;
pub use report::{Course, FormReport, Report};

use crate::model::Model;

/// Settings for hidden variables.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// The random seed of the initial values, for parameters without values.
    pub seed: u64,
    /// Limit of the number of iterations.
    pub iterations: usize,
    /// The relative change of ln L + ln prior below which EM may stop.
    pub threshold: f64,
    /// The relative change of a number below which EM may stop: all numbers change by less.
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { seed: 0, iterations: 10_000, threshold: 1e-10, tolerance: 1e-7 }
    }
}

/// The result of learning.
#[derive(Clone, Debug)]
pub struct Learned {
    learnable: distribution::Learnable,
    /// The report.
    pub report: Report,
}

impl Learned {
    /// The learned model, which is asked like any other.
    pub fn model(&self) -> &Model {
        &self.learnable.program.model
    }

    /// The learned parameters and forms as a program, to be inserted into the original text (`syntax::graft`).
    pub fn text(&self) -> String {
        text::text(&self.learnable)
    }
}
