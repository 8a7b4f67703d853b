//! Questions as written.
//!
//! In: text. Out: the words of a question. Invariant: the words before a distribution are in the order of the text; the
//! checker interprets them.

use super::{At, Comments, Expr, Name, Occurrence, Range, Value};

/// `argmax P(searched | known) nearest name`, `divergence smooth P(…) from filter P(…)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// Its span.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The statistic and the kind of question over time; empty for the plain distribution.
    pub words: Vec<Word>,
    /// The distribution.
    pub distribution: Distribution,
    /// The distribution with which it is compared.
    pub from: Option<Second>,
    /// The field that breaks ties.
    pub nearest: Option<Name>,
}

/// The second distribution of a comparison: `filter P(…)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Second {
    /// The words for its instant.
    pub words: Vec<Word>,
    /// The distribution.
    pub distribution: Distribution,
}

/// A word before a distribution: `argmax`, `best(5)`, `quantile(0.1, 0.9)`, `filter`.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    /// Its span, brackets included.
    pub at: At,
    /// The word.
    pub name: Name,
    /// The numbers in brackets, as written.
    pub amounts: Vec<(At, String)>,
}

/// `P(searched | known)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Its span.
    pub at: At,
    /// The searched items.
    pub searched: Vec<Item>,
    /// The known items.
    pub known: Vec<Item>,
}

/// A searched or known item of a question, with its evidence if there is any.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Its span.
    pub at: At,
    /// Its subject.
    pub subject: Subject,
    /// Its evidence.
    pub evidence: Option<Finding>,
}

/// The subject of an item.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    /// `X`, `X^-1`, `Y[3]`
    Variable(Occurrence),
    /// `Y[1..=4]`: some elements of a family.
    Slice(Name, Range),
    /// `Tau > 5`, `A * B`
    Term(Expr),
}

/// The evidence of an item.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// `= value`
    Hard(Value),
    /// `virtual [e, e]`: one likelihood for each value.
    Virtual(Vec<Expr>),
    /// `soft [e, e]`: one probability for each value.
    Soft(Vec<Expr>),
}
