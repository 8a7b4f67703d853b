//! The syntax tree of a program: sections, declarations and lists, each node with its span.
//!
//! In: pairs from the grammar. Out: the tree that only the printer and the checker use. Invariant: printing a tree and
//! parsing the text gives an equal tree. Two trees are equal if their content is equal, whatever their spans: all
//! [`At`] are equal.

mod expression;
mod form;
mod question;

pub use expression::*;
pub use form::*;
pub use question::*;

use crate::source::Span;

/// The span of a node. All spans compare equal, so that trees compare by their content.
#[derive(Clone, Copy, Debug, Default)]
pub struct At(pub Span);

impl PartialEq for At {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A name and its span.
#[derive(Clone, Debug, PartialEq)]
pub struct Name {
    /// Its span.
    pub at: At,
    /// The name.
    pub text: String,
}

impl Name {
    /// The span of the name.
    pub fn span(&self) -> Span {
        self.at.0
    }
}

/// The comments that belong to an item, with their slashes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comments {
    /// Comments on lines of their own before the item; `///` among them are its documentation.
    pub before: Vec<String>,
    /// Comments after the item, on its last line.
    pub after: Vec<String>,
}

impl Comments {
    /// The text of the `///` lines.
    pub fn documentation(&self) -> String {
        let lines = self.before.iter().filter_map(|line| line.strip_prefix("///"));
        lines.map(str::trim).collect::<Vec<_>>().join("\n")
    }
}

/// All the programs of a text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The programs, in order.
    pub programs: Vec<Program>,
    /// Comments after the last program.
    pub closing: Vec<String>,
}

/// `program Name over i in Set { … }`.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Its span, braces included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// Its name.
    pub name: Name,
    /// The plate over which the whole program is repeated.
    pub plate: Option<Plate>,
    /// Its sections, in the order of the text.
    pub sections: Vec<Section>,
    /// Comments after the last section.
    pub closing: Vec<String>,
}

/// `over index in set`.
#[derive(Clone, Debug, PartialEq)]
pub struct Plate {
    /// The index.
    pub index: Name,
    /// The set over which it ranges.
    pub set: Name,
}

/// One section of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Its span, braces included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// Its content.
    pub kind: SectionKind,
    /// Comments after its last item.
    pub closing: Vec<String>,
}

/// The sections of the formalism.
#[derive(Clone, Debug, PartialEq)]
pub enum SectionKind {
    /// `parameters { … }`
    Parameters(Vec<Parameter>),
    /// `variables { … }`
    Variables(Vec<Declaration>),
    /// `decomposition { … }`
    Decomposition(Vec<Term>),
    /// `forms { … }`
    Forms(Vec<Definition>),
    /// `identification { … }`
    Identification(Vec<Learnt>),
    /// `question name { … }`
    Question {
        /// The name of the question.
        name: Name,
        /// Its asks, in order.
        asks: Vec<Ask>,
    },
}

/// `sigma[Rays], epsilon : real = 0.5;`
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its span, semicolon included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The names, each with the ranges of its indices.
    pub names: Vec<(Name, Vec<Space>)>,
    /// `probability`, `real`, `size` or `integer`.
    pub kind: Name,
    /// The default value.
    pub default: Option<Expr>,
}

/// The range of an index: a set, or integers.
#[derive(Clone, Debug, PartialEq)]
pub enum Space {
    /// A set by name.
    Set(Name),
    /// `lo..=hi`
    Range(Range),
}

/// `lo..=hi`.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// Its span.
    pub at: At,
    /// The first value.
    pub low: Bound,
    /// The last value.
    pub high: Bound,
}

/// One end of a range: a number, or a parameter with an offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// Its span.
    pub at: At,
    /// The parameter, if there is one.
    pub name: Option<Name>,
    /// The number with its sign, as written.
    pub offset: Option<(Sign, String)>,
}

/// The sign before a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// No sign.
    None,
    /// `+`
    Plus,
    /// `-`
    Minus,
}

/// `O, O^-1 : bool;`
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// Its span, semicolon included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The variables.
    pub variables: Vec<Declared>,
    /// Their domain.
    pub domain: Domain,
}

/// One declared variable, or family of variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Its span.
    pub at: At,
    /// Its name.
    pub name: Name,
    /// `[i in Sensors]` or `[1..=N except C]`.
    pub family: Option<Family>,
    /// True for `X^-1`.
    pub before: bool,
}

/// The index of a family of variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Family {
    /// Its span.
    pub at: At,
    /// The name of the index, if it has one.
    pub index: Option<Name>,
    /// Its range.
    pub space: Space,
    /// The variable whose value is excluded from the range.
    pub except: Option<Name>,
}

/// The values that a variable may take.
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    /// Its span.
    pub at: At,
    /// Its kind.
    pub kind: DomainKind,
}

/// The ways to write a domain.
#[derive(Clone, Debug, PartialEq)]
pub enum DomainKind {
    /// `bool`, `real`, or a set.
    Named(Name),
    /// `real[3]`, `bins[0, 1, 5]`
    Listed(Name, Vec<Expr>),
    /// `bins(-50, 50, 20)`, `circle(0, 360, 36)`
    Divided(Name, Vec<Expr>),
    /// `1..=N`
    Range(Range),
    /// `{ Paris, Nice }`, optionally followed by `or 1..=N`.
    Labels(Vec<Name>, Option<Range>),
}

/// One term of the decomposition.
#[derive(Clone, Debug, PartialEq)]
pub enum Term {
    /// `P(left | right)`
    Factor(Factor),
    /// `prod(i in Sensors) { … }`
    Product(Box<Product>),
}

/// `P(left | right)`, or `P(initial(X) | right)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// Its span.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// Whether it is that of the first instant: `P(initial(X))`.
    pub initial: bool,
    /// The variables on the left.
    pub left: Vec<Occurrence>,
    /// The variables on the right.
    pub right: Vec<Occurrence>,
}

/// `prod(i in Sensors) { … }`.
#[derive(Clone, Debug, PartialEq)]
pub struct Product {
    /// Its span, braces included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The index.
    pub index: Name,
    /// Its range; without it, that of the family's own index.
    pub space: Option<Space>,
    /// The terms under the product.
    pub terms: Vec<Term>,
}

/// A use of a variable: `X`, `X[i]`, `X^-1`.
#[derive(Clone, Debug, PartialEq)]
pub struct Occurrence {
    /// Its span.
    pub at: At,
    /// Its name.
    pub name: Name,
    /// The indices of an element of a family.
    pub index: Vec<Expr>,
    /// True for `X^-1`.
    pub before: bool,
}

/// `mu, sigma from recordings by C;`, `hidden Light;`
#[derive(Clone, Debug, PartialEq)]
pub struct Learnt {
    /// Its span, semicolon included.
    pub at: At,
    /// Comments before and after it.
    pub comments: Comments,
    /// The parameters to be learned, or the hidden variables.
    pub names: Vec<Name>,
    /// The data set; `None` for hidden variables.
    pub from: Option<Name>,
    /// The index for whose values they are learned separately.
    pub by: Vec<Name>,
}

/// A value in a question, a key or a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// Its span.
    pub at: At,
    /// Its kind.
    pub kind: ValueKind,
}

/// The ways to write a value.
#[derive(Clone, Debug, PartialEq)]
pub enum ValueKind {
    /// A number with its sign.
    Number(Sign, String),
    /// `true` or `false`.
    Boolean(bool),
    /// A label, or a name whose value is given when the question is asked.
    Name(Name),
    /// `[1, 0, 2]`
    List(Vec<Value>),
}
