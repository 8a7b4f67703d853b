//! Questions as written.
//!
//! In: text. Out: the words of a question. Invariant: the words before a distribution are in the order in which they
//! were written; the checker interprets them.

use super::{At, Comments, Expr, Name, Occurrence, Range, Value};

/// `argmax P(searched | known) nearest name`, `divergence smooth P(…) from filter P(…)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// Where it stands.
    pub at: At,
    /// Comments before and behind it.
    pub comments: Comments,
    /// The statistic and the kind of question over time; empty for the plain distribution.
    pub words: Vec<Word>,
    /// The distribution.
    pub distribution: Distribution,
    /// The distribution that it is compared with.
    pub from: Option<Second>,
    /// What breaks a tie.
    pub nearest: Option<Name>,
}

/// The distribution that another is compared with: `filter P(…)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Second {
    /// Of which instant it is.
    pub words: Vec<Word>,
    /// The distribution.
    pub distribution: Distribution,
}

/// A word before a distribution: `argmax`, `best(5)`, `filter`.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    /// Where it stands, brackets included.
    pub at: At,
    /// Which.
    pub name: Name,
    /// How many, as written.
    pub count: Option<(At, String)>,
}

/// `P(searched | known)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Where it stands.
    pub at: At,
    /// What is searched.
    pub searched: Vec<Item>,
    /// What is known.
    pub known: Vec<Item>,
}

/// What a question searches or knows, with its evidence if there is any.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Where it stands.
    pub at: At,
    /// Of what it speaks.
    pub subject: Subject,
    /// What is known of it.
    pub evidence: Option<Finding>,
}

/// Of what a question speaks.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    /// `X`, `X^-1`, `Y[3]`
    Variable(Occurrence),
    /// `Y[1..=4]`: some elements of a family.
    Slice(Name, Range),
    /// `Tau > 5`, `A * B`
    Term(Expr),
}

/// What is known of a variable in a question.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// `= value`
    Hard(Value),
    /// `virtual [e, e]`: one likelihood for each value.
    Virtual(Vec<Expr>),
    /// `soft [e, e]`: one probability for each value.
    Soft(Vec<Expr>),
}
