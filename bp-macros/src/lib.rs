//! The macro `bayesian_program!`, which checks and compiles a Bayesian Program within a Rust program.
//!
//! In: the tokens of a program, or the path of a `.bp` file. Out: a module named after the program that holds its text,
//! its model and its questions as Rust, or one `compile_error!` for each error, at the tokens that cause it. Invariant:
//! no decisions are made here; the front end checks the program and the back end writes the code.

mod errors;
mod expand;
mod origin;
mod quoted;
mod tokens;

use proc_macro::TokenStream;
use std::path::PathBuf;

/// Compiles a Bayesian Program into a module named after it, in snake case: `program WetGrass` becomes `wet_grass`.
///
/// The program is between the braces, or in a file whose path starts at the folder of the package's `Cargo.toml`:
///
/// ```
/// use bp_macros::bayesian_program;
///
/// bayesian_program! {
///     /// Is the coin fair?
///     program Coin {
///         variables { Heads : bool; }
///         decomposition { P(Heads) }
///         forms { P(Heads) = bernoulli(0.5); }
///         question heads { P(Heads) }
///     }
/// }
/// # mod files { use bp_macros::bayesian_program;
/// bayesian_program!("../tests/programs/wet_grass.bp");
/// # }
///
/// let answer = coin::heads().ask()?;
/// assert_eq!(answer.p(true), 0.5);
/// # Ok::<(), bp_core::compiler::error::Error>(())
/// ```
///
/// A question is a function that returns a builder with a method for each input, `ask`, and `run_into` for an earlier
/// answer. The answer is read by value. `docs/language.md` describes the names.
///
/// The calling package must depend on `bp-core`, which the module uses.
#[proc_macro]
pub fn bayesian_program(input: TokenStream) -> TokenStream {
    let root = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    expand::expand(input.into(), &root).unwrap_or_else(|errors| errors).into()
}
