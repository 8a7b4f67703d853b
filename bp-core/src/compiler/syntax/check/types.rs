//! Types of expressions: boolean, number, label, element of a set, vector.
//!
//! In: domains. Out: types and their names. Invariant: integers and reals are both numbers; there are no other implicit
//! conversions.

use crate::ids::SetId;
use crate::model::{Domain, Model};

/// The type of an expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Type {
    Boolean,
    Number,
    /// A value of an enumeration.
    Label(Domain),
    Element(SetId),
    Vector(usize),
}

impl Type {
    /// The type of a variable's value. The labels of a domain that has integers too count as integers.
    pub(super) fn of(domain: &Domain) -> Type {
        match domain {
            Domain::Boolean => Type::Boolean,
            Domain::Finite { range: None, .. } => Type::Label(domain.clone()),
            Domain::Finite { .. } | Domain::Bins(_) | Domain::Real => Type::Number,
            Domain::Set(set) => Type::Element(*set),
            Domain::Vector(length) => Type::Vector(*length),
        }
    }

    /// The name of a value of the type.
    pub(super) fn words(&self, model: &Model) -> String {
        match self {
            Type::Boolean => "a truth value".to_owned(),
            Type::Number => "a number".to_owned(),
            Type::Label(domain) => format!("one of `{}`", model.domain_text(domain)),
            Type::Element(set) => format!("an element of `{}`", model.sets[*set].name),
            Type::Vector(length) => format!("a vector of {length} numbers"),
        }
    }
}
