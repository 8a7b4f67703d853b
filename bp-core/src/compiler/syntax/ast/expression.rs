//! Expressions as written.
//!
//! In: the flat expressions of the grammar. Out: a tree by precedence that keeps brackets as nodes, so that it prints
//! as it was written. Invariant: an operand that binds less tightly than its operator is in a [`ExprKind::Group`].

use super::{At, Name, Occurrence, Value};
use crate::source::Span;

/// An expression and its span.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// Its span.
    pub at: At,
    /// Its kind.
    pub kind: ExprKind,
}

impl Expr {
    /// The span of the expression.
    pub fn span(&self) -> Span {
        self.at.0
    }
}

/// The ways to write an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// A number, as written.
    Number(String),
    /// `true` or `false`.
    Boolean(bool),
    /// A variable, a parameter, an index, a label.
    Name(Name),
    /// `min(a, b)`
    Call(Name, Vec<Expr>),
    /// `sigma[ray]`
    Index(Box<Expr>, Vec<Expr>),
    /// `X^-1`: at the previous instant.
    Before(Box<Expr>),
    /// `map.H`
    Field(Box<Expr>, Name),
    /// `map.P(O | C)`: the answer of another program.
    Answer {
        /// The other program.
        of: Box<Expr>,
        /// The searched variables.
        searched: Vec<Occurrence>,
        /// The known variables.
        known: Vec<Occurrence>,
    },
    /// `first(G with O at C)`: the index of the first true element of a family, with another variable in place of the
    /// element at an index that the family excludes.
    First {
        /// The family.
        family: Occurrence,
        /// The variable in place of the element.
        with: Occurrence,
        /// The index of the element.
        index: Box<Expr>,
    },
    /// `-a`, `not a`
    Unary(UnaryOp, Box<Expr>),
    /// `a + b`
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `(a)`
    Group(Box<Expr>),
    /// `[a, b, c]`
    Vector(Vec<Expr>),
    /// `if c { a } else { b }`
    If(If<Expr>),
    /// `match e { v => a, _ => b }`
    Match(Match<Expr>),
}

/// Operators before an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOp {
    /// `-`
    Minus,
    /// `not`
    Not,
}

impl UnaryOp {
    /// Its notation.
    pub fn text(self) -> &'static str {
        match self {
            UnaryOp::Minus => "-",
            UnaryOp::Not => "not",
        }
    }

    /// Its precedence; operators of higher precedence bind more tightly.
    pub fn precedence(self) -> u8 {
        match self {
            UnaryOp::Not => 3,
            UnaryOp::Minus => 7,
        }
    }
}

/// Operators between two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // Each variant is named after its operator.
pub enum BinaryOp {
    Or,
    And,
    Equal,
    /// `=`, which compares in a question.
    Is,
    Different,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Plus,
    Minus,
    Times,
    Over,
}

impl BinaryOp {
    /// Every operator of an expression; `=` belongs to questions.
    pub const ALL: [BinaryOp; 12] = [
        BinaryOp::Or,
        BinaryOp::And,
        BinaryOp::Equal,
        BinaryOp::Different,
        BinaryOp::Less,
        BinaryOp::LessOrEqual,
        BinaryOp::Greater,
        BinaryOp::GreaterOrEqual,
        BinaryOp::Plus,
        BinaryOp::Minus,
        BinaryOp::Times,
        BinaryOp::Over,
    ];

    /// Its notation.
    pub fn text(self) -> &'static str {
        match self {
            BinaryOp::Or => "or",
            BinaryOp::And => "and",
            BinaryOp::Equal => "==",
            BinaryOp::Is => "=",
            BinaryOp::Different => "!=",
            BinaryOp::Less => "<",
            BinaryOp::LessOrEqual => "<=",
            BinaryOp::Greater => ">",
            BinaryOp::GreaterOrEqual => ">=",
            BinaryOp::Plus => "+",
            BinaryOp::Minus => "-",
            BinaryOp::Times => "*",
            BinaryOp::Over => "/",
        }
    }

    /// Whether it is a comparison.
    pub fn compares(self) -> bool {
        use BinaryOp::*;
        matches!(self, Equal | Is | Different | Less | LessOrEqual | Greater | GreaterOrEqual)
    }

    /// Its precedence; operators of higher precedence bind more tightly. All associate to the left.
    pub fn precedence(self) -> u8 {
        match self {
            BinaryOp::Or => 1,
            BinaryOp::And => 2,
            BinaryOp::Plus | BinaryOp::Minus => 5,
            BinaryOp::Times | BinaryOp::Over => 6,
            _ => 4,
        }
    }
}

/// `if c { a } else if d { b } else { e }`, of expressions or of forms.
#[derive(Clone, Debug, PartialEq)]
pub struct If<T> {
    /// Conditions with their branches, in order; at least one.
    pub branches: Vec<(Expr, T)>,
    /// The branch if no condition holds.
    pub otherwise: Box<T>,
}

/// `match e { v => a, _ => b }`, of expressions or of forms.
#[derive(Clone, Debug, PartialEq)]
pub struct Match<T> {
    /// The matched expression.
    pub on: Box<Expr>,
    /// Patterns with their branches, in order.
    pub arms: Vec<(Pattern, T)>,
}

/// A pattern and its span.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// Its span.
    pub at: At,
    /// Its kind.
    pub kind: PatternKind,
}

/// The ways to write a pattern.
#[derive(Clone, Debug, PartialEq)]
pub enum PatternKind {
    /// `_`
    Any,
    /// One value.
    Value(Value),
    /// `lo..=hi`
    Range(Value, Value),
}
