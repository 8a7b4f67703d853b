//! BIF, the Bayesian Interchange Format of JavaBayes, in the dialects that circulate.
//!
//! In: a text, or a model. Out: a model, or a text. Invariant: numbers in a file mean the same whether rows are written
//! one by one, with a `default`, or as one `table`; written text reads back the same.
//!
//! `variable X { type discrete [ 2 ] { a, b }; }   probability ( X | Y ) { (y0) 0.1, 0.9; default 0.5, 0.5; }`
//! (Cozman, *The Interchange Format for Bayesian Networks*, 1998). A conditional `table` there lists the values of X
//! slowest; other tools write them fastest: the order in which rows sum to one is taken.

mod read;
mod write;

pub use read::read;
pub(super) use write::write;
