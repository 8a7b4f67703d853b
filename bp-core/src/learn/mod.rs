//! Learning: the parameters of a program from data.
//!
//! In: a [`Model`] in which forms are `unknown` or `identification` names parameters, and [`Case`]s.
//! Out: the same model with numbers, and a [`Report`]. Invariant: what is not to be learned is left exactly as it is.
//!
//! ```
//! use bp_core::learn::{Case, Learner};
//! use bp_core::source::Source;
//! let text = "program Coin { variables { Heads : bool; } decomposition { P(Heads) }
//!             forms { P(Heads) = unknown(beta(1, 1)); } question heads { P(Heads = true) } }";
//! let model = bp_core::syntax::compile(&Source::new("coin", text)).unwrap();
//! let mut learner = Learner::new(&model).unwrap();
//! for toss in ["false", "true", "false", "false"] {
//!     learner.observe(&Case::new(&model).with_value(&model, "Heads", toss).unwrap()).unwrap();
//! }
//! let learned = learner.learned().unwrap();
//! let question = model.question("heads").unwrap();
//! let answer = bp_core::answer::ask(learned.model(), question, &bp_core::exec::Inputs::new()).unwrap();
//! assert!((answer[0].answer[0].p().unwrap() - 1.0 / 3.0).abs() < 1e-15);
//! ```

mod accelerate;
mod case;
mod cliques;
mod columns;
mod density;
mod distribution;
mod estimate;
mod expect;
mod floor;
mod kind;
mod learner;
mod likelihood;
mod maximise;
mod messages;
mod normals;
mod over_time;
mod parametric;
mod program;
mod regression;
mod report;
mod statistics;
mod text;

pub use case::Case;
pub use columns::{Columns, sizes};
pub use learner::Learner;
pub use report::{Course, FormReport, Report};

use crate::model::Model;

/// How hidden variables are learned.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// What a start is drawn from, where the parameters have no values before.
    pub seed: u64,
    /// The most steps.
    pub iterations: usize,
    /// The change of ln L + ln prior, of itself, below which a step may be the last.
    pub threshold: f64,
    /// The change of a number, of itself, below which a step may be the last: all numbers change by less then.
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { seed: 0, iterations: 10_000, threshold: 1e-10, tolerance: 1e-7 }
    }
}

/// What was learned.
#[derive(Clone, Debug)]
pub struct Learned {
    learnable: distribution::Learnable,
    /// From what, and how well.
    pub report: Report,
}

impl Learned {
    /// The model with its numbers: it is asked as any other.
    pub fn model(&self) -> &Model {
        &self.learnable.program.model
    }

    /// What was learned, as a program of parameters and forms, to be grafted onto the one that was learned
    /// (`syntax::graft`).
    pub fn text(&self) -> String {
        text::text(&self.learnable)
    }
}
