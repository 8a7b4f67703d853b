//! A small typed language of loops, between a kernel and the text of a programming language.
//!
//! In: computations, loads and stores, in order. Out: statements whose names are ids. Invariant: the names that a statement
//! reads and defines are taken from the statement, never searched in text; only printers spell names and operations.

mod expression;
mod local;
mod statement;
mod validate;

pub(crate) use expression::{Element, Expression, Grain, Kind, Operation};
pub(crate) use local::{Local, Of};
pub(crate) use statement::{Lanes, Look, Statement, Target, Type};
pub(crate) use validate::validate;
