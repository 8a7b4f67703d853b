//! Forms as written, on the right of `P(…) =`.
//!
//! In: pairs from the grammar. Out: a tree for the printer and the checker. Invariant: a named form keeps the name as
//! written; the checker decides whether it is known.

use super::{At, Comments, Expr, Factor, If, Match, Name, Occurrence, Value};
use crate::source::Span;

/// `P(left | right) = form;`
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Its span, semicolon included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The factor of the form.
    pub head: Factor,
    /// The form.
    pub form: Form,
}

/// A form and its span.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Its span.
    pub at: At,
    /// Its kind.
    pub kind: FormKind,
}

impl Form {
    /// The span of the form.
    pub fn span(&self) -> Span {
        self.at.0
    }
}

/// The ways to write a form.
#[derive(Clone, Debug, PartialEq)]
pub enum FormKind {
    /// `uniform`, `normal(mean, sd)`, `dirac(e)`, …
    Named {
        /// Its name in the language.
        name: Name,
        /// Its arguments; `None` without brackets.
        arguments: Option<Vec<Expr>>,
        /// The indices behind `by`.
        by: Vec<Name>,
    },
    /// `table { row; row; }`
    Table(Vec<Row>),
    /// `previous(X, A) else form`
    Previous {
        /// The variable whose marginal is kept.
        variable: Box<Occurrence>,
        /// The cell of the marginal.
        of: Option<Box<Expr>>,
        /// The form at the first instant.
        otherwise: Option<Box<Form>>,
    },
    /// `ask(Sensors[i].reading | O C)`
    Ask {
        /// The path to a question of a program.
        path: Vec<Segment>,
        /// The variables on which the answer depends; `None` means all right-hand variables.
        given: Option<Vec<Occurrence>>,
    },
    /// `let k = e in form`
    Let {
        /// The bound name.
        name: Name,
        /// Its value.
        value: Box<Expr>,
        /// The form in which it is bound.
        body: Box<Form>,
    },
    /// `if c { form } else { form }`
    If(If<Form>),
    /// `match e { v => form, _ => form }`
    Match(Match<Form>),
}

/// One row of a table: `key, key : e, e;`
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its span.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The values of the right-hand variables; empty without keys.
    pub keys: Vec<Value>,
    /// The probabilities, one for each left-hand value.
    pub values: Vec<Expr>,
}

/// One step of the path to a question: `Sensors[i]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// The name.
    pub name: Name,
    /// The index in an array of programs.
    pub index: Vec<Expr>,
}
