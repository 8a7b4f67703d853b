//! Analysis: the structure of a program, as every strategy needs it.
//!
//! In: a [`Model`](crate::model::Model), and questions to it. Out: the variables that a factor reads, those that matter for a
//! question, the factors that sum to one, the forms that are linear. Invariant: answers depend on the program and the question
//! alone, and each property is decided here only (the degree of an expression in `model/linear.rs`).

mod linear;
mod proper;
mod relevance;
mod scope;

pub(crate) use linear::{Admitted, is_linear_form, is_linear_in};
pub(crate) use proper::{is_proper, is_truth, may_have_no_value};
pub(crate) use relevance::{ancestral_factors, carried, reached, relevant_factors, relevant_variables};
pub(crate) use scope::{Scope, of_expression, of_factor, of_form};
