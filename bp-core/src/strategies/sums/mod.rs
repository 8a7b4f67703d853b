//! Sums and products of finite variables, computed by a kernel.
//!
//! In: an equation and the host's inputs. Out: tables. Invariant: evidence of probability zero is an error that says what cannot be.

mod impossible;

pub(crate) use impossible::error as impossible;
