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
//! Everything else is in [`compiler`].

pub mod compiler;
pub mod prelude;
pub mod program;

use compiler::{
    analysis, answer, bins, data, diagnostic, distribution, door, draw, elimination, emit, equation, error,
    exec, files, forms, guess, ids, io, kernel, latex, law, learn, loops, lower, memory, model, numbers,
    operators, plan, posterior, potential, progress, radix, random, sample, shared, source, space, special,
    spelling, strategies, syntax, units, wrap, xml,
};
pub use error::Error;
