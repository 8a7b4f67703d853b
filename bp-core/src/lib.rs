//! Bayesian Programs in the notation of the formalism, answered by compiled kernels.
//!
//! A [`Program`](program::Program) is opened, configured and asked. Its answer is a [`Posterior`](program::Posterior):
//! a distribution that prints as a table and is read by variable and value. The files are in `examples/door`.
//!
//! ```standalone_crate
//! use bp_core::prelude::*;
//!
//! fn main() -> Result<(), bp_core::Error> {
//! #   std::env::set_current_dir("../examples/door").expect("the folder of the examples");
//!     let grass = Program::open("grass.bp")?.with("rate", 0.2)?;
//!     let rain = grass.ask("P(Rain | Wet = true)")?;
//!     println!("{rain}");                                   // the table with bars
//!     println!("{}", rain.p(true)?);                        // 0.2 / (0.2 + 0.8 * 0.9) = 0.217
//!     assert_eq!(rain.mode()?["Rain"], false);
//!     println!("{} nats, ln P(Wet) = {:?}", rain.entropy()?, rain.ln_evidence());
//!
//!     let asked = grass.question("P(Rain | Wet = wet)")?;   // compiled once
//!     for wet in [true, false] {
//!         println!("{wet}: {}", asked.given("wet", wet)?.ask()?.p(true)?);
//!     }
//!
//!     let door = Program::open("door.bp")?;
//!     let mut door = door.filter("P(Open | Seen)")?;        // over time
//!     for seen in [true, false, true] {
//!         println!("{:.4}", door.step(evidence! { Seen: seen })?.p(true)?);
//!     }
//!
//!     let alarm = Program::open("alarm.bif")?;              // a network: a join tree is chosen
//!     let all = alarm.marginals(&evidence! { HR: "HIGH" })?;
//!     println!("{all}");
//!     println!("{}", all.of("CATECHOL")?.p("HIGH")?);       // 0.45 / 0.475
//!
//!     let learned = grass.learn("lawns.csv")?;              // rate = 1 / 4
//!     println!("{}", learned.ask("P(Rain)")?.p(true)?);
//!     Ok(())
//! }
//! ```
//!
//! An [`Error`] prints for users: a wrong program with its lines, data with file, row and column.
//!
//! The stages of the compiler are in [`compiler`].

pub mod prelude;
pub mod program;

pub use error::Error;

/// The stages of the compiler: [`source::Source`] → parse → [`syntax::ast::Program`] → check → [`model::Model`] → plan
/// → [`plan::Plan`] → lower → [`kernel::Kernel`] → run → [`answer::Answer`]. `docs/architecture.md` describes them.
pub mod compiler {
    #[cfg(feature = "gpu")]
    #[doc(inline)]
    pub use crate::gpu;
    #[doc(inline)]
    pub use crate::{
        answer, bins, data, diagnostic, distribution, draw, emit, error, exec, files, ids, io, kernel, latex,
        law, learn, lower, model, operators, plan, progress, random, sample, source, space, special,
        spelling, strategies, syntax, xml,
    };
}

#[doc(hidden)]
pub mod answer;
#[doc(hidden)]
pub mod bins;
#[doc(hidden)]
pub mod data;
#[doc(hidden)]
pub mod diagnostic;
#[doc(hidden)]
pub mod distribution;
#[doc(hidden)]
pub mod draw;
mod elimination;
#[doc(hidden)]
pub mod emit;
pub(crate) mod equation;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod exec;
#[doc(hidden)]
pub mod files;
mod forms;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub mod gpu;
mod guess;
#[doc(hidden)]
pub mod ids;
#[doc(hidden)]
pub mod io;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod latex;
#[doc(hidden)]
pub mod law;
#[doc(hidden)]
pub mod learn;
mod loops;
#[doc(hidden)]
pub mod lower;
mod memory;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod numbers;
#[doc(hidden)]
pub mod operators;
#[doc(hidden)]
pub mod plan;
mod posterior;
mod potential;
#[doc(hidden)]
pub mod progress;
mod radix;
#[doc(hidden)]
pub mod random;
#[doc(hidden)]
pub mod sample;
#[doc(hidden)]
pub mod source;
#[doc(hidden)]
pub mod space;
#[doc(hidden)]
pub mod special;
#[doc(hidden)]
pub mod spelling;
#[doc(hidden)]
pub mod strategies;
#[doc(hidden)]
pub mod syntax;
#[doc(hidden)]
pub mod wrap;
#[doc(hidden)]
pub mod xml;
