//! Forms as written, on the right of `P(…) =`.
//!
//! In: pairs from the grammar. Out: a tree for the printer and the checker. Invariant: a named form keeps the name as
//! written; the checker decides whether it is known.

use super::{At, Comments, Expr, Factor, If, Match, Name, Occurrence, Value};
use crate::source::Span;

/// `P(left | right) = form;`
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Where it stands, semicolon included.
    pub at: At,
    /// Comments before and behind it.
    pub comments: Comments,
    /// The factor that is given its form.
    pub head: Factor,
    /// The form.
    pub form: Form,
}

/// A form and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where it stands.
    pub at: At,
    /// Which.
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
        /// Its usual name.
        name: Name,
        /// Its arguments; none when there is no bracket.
        arguments: Option<Vec<Expr>>,
    },
    /// `table { row; row; }`
    Table(Vec<Row>),
    /// `previous(X, A) else form`
    Previous {
        /// The variable whose marginal was kept.
        variable: Box<Occurrence>,
        /// The cell it was kept in.
        of: Option<Box<Expr>>,
        /// The form at the first instant.
        otherwise: Option<Box<Form>>,
    },
    /// `ask(Sensors[i].reading | O C)`
    Ask {
        /// Which question of which program.
        path: Vec<Segment>,
        /// What the answer depends on; none when it is everything on the right.
        given: Option<Vec<Occurrence>>,
    },
    /// `let k = e in form`
    Let {
        /// The name that is bound.
        name: Name,
        /// Its value.
        value: Box<Expr>,
        /// The form that may use it.
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
    /// Where it stands.
    pub at: At,
    /// Comments before and behind it.
    pub comments: Comments,
    /// The values of the variables on the right; empty when not written.
    pub keys: Vec<Value>,
    /// The probabilities, one for each value on the left.
    pub values: Vec<Expr>,
}

/// One step of the path to a question: `Sensors[i]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// The name.
    pub name: Name,
    /// Which of an array of programs.
    pub index: Vec<Expr>,
}
