//! A model: what a Bayesian Program means.
//!
//! In: the checker's reading of a program, or a Rust user's calls of [`ModelBuilder`]. Out: plain data, ids
//! instead of names. Invariant: a `Model` has passed `validate`: its factors give each variable exactly one
//! distribution, in an order without cycles, and its forms have the shape of their factors.
//!
//! Bessière, Mazer, Ahuactzin and Mekhnacha, *Bayesian Programming*, CRC 2013:
//! Program = { Description = { Specification = { Variables, Decomposition, Forms }, Identification }, Question }.

mod builder;
mod domain;
mod evaluate;
mod expression;
mod form;
mod notation;
mod order;
mod question;
mod validate;
mod walk;

pub use crate::bins::{Bins, MOST_BINS};
pub use builder::ModelBuilder;
pub use domain::{Bound, Domain, Range};
pub use expression::{Expression, VariableUse};
pub use form::{Fit, Form, row_tolerance};
pub(crate) use order::in_order;
pub use question::{Ask, Evidence, Known, Question, Searched, Statistic, Value, When};
pub use validate::{Fault, Place};
pub use walk::Folded;

use crate::ids::{Arena, ExpressionId, FactorId, Id, ParameterId, QuestionId, SetId, VariableId};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// A set bound from outside: its elements are numbered, its size is known at run time.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// What is known of its elements.
    pub kind: SetKind,
}

/// What is known of a set's elements.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum SetKind {
    /// Nothing: they are numbered.
    Plain,
    /// They are the cells of a grid of three axes (unused ones have extent 1), see `space::Space`.
    Grid,
    /// They are displacements on the cells of that grid.
    Displacements(SetId),
}

/// Over what an array ranges.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum IndexSpace {
    /// The elements of a set.
    Set(SetId),
    /// Integers.
    Range(Range),
}

impl IndexSpace {
    /// The index of its first element.
    pub fn first(&self) -> i64 {
        match self {
            IndexSpace::Set(_) => 0,
            IndexSpace::Range(range) => range.low,
        }
    }
}

/// A number, or a field of numbers, that a question is given when it is asked.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// What numbers it may be.
    pub kind: ParameterKind,
    /// Its value where none is given: empty for none, one number for all places, or one for each.
    pub default: Vec<f64>,
    /// Over what it ranges; empty for one number.
    pub over: Vec<IndexSpace>,
}

impl Parameter {
    /// The number that it is where none is given, if it is the same everywhere.
    pub fn default_number(&self) -> Option<f64> {
        match self.default.as_slice() {
            [number] => Some(*number),
            _ => None,
        }
    }
}

/// What numbers a parameter may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum ParameterKind {
    /// In [0, 1].
    Probability,
    /// Any finite number.
    Real,
    /// A whole number.
    Integer,
    /// A positive whole number that bounds a domain or a family.
    Size,
}

/// The index that the whole program is repeated over: `program Cell over C in Grid`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Plate {
    /// The index, a variable known in every question. Its domain is `Domain::Set(set)`.
    pub index: VariableId,
    /// The set that it runs over.
    pub set: SetId,
}

/// A variable, or a family of variables.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Variable {
    /// Its name, without `^-1`.
    pub name: String,
    /// `Some(X)`: this is `X^-1`, the variable X at the previous instant.
    pub previous_of: Option<VariableId>,
    /// Its values.
    pub domain: Domain,
    /// For a family: what it is indexed by.
    pub family: Option<Family>,
}

/// What a family of variables is indexed by: `G[1..=N except C]`, `Z[i in Sensors]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Family {
    /// Over what it ranges.
    pub over: IndexSpace,
    /// A variable whose value is left out: there is no element there.
    pub except: Option<VariableId>,
}

/// One factor of the decomposition: `P(left | right)`, perhaps under `prod`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Factor {
    /// The variables that it distributes: at least one.
    pub left: Vec<VariableUse>,
    /// Those that it depends on.
    pub right: Vec<VariableUse>,
    /// The distribution.
    pub form: Form,
    /// The enclosing `prod`s, outermost first: name of the index, and what it runs over.
    pub products: Vec<(String, IndexSpace)>,
}

/// Parameters to be learned from data: `identification { mu, sigma from recordings by C; }`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Identification {
    /// What is learned.
    pub parameters: Vec<ParameterId>,
    /// The name under which the data come.
    pub data: String,
    /// One fit for each value of this variable.
    pub by: Option<VariableId>,
}

/// A question to another program, which a form of this one asks: `ask(Paris.rain)`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Subroutine {
    /// How the form names it: `Paris.rain`.
    pub path: String,
    /// The program that is asked.
    pub program: Model,
    /// The name of its question: one distribution of one variable, given the value of each known one.
    pub question: String,
    /// Its answer, once it has been asked (`answer::link`): by known variables in the order of the question, then by the
    /// searched one. Empty until then.
    pub table: Vec<f64>,
}

/// What a Bayesian Program means. Made by [`ModelBuilder::build`].
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// What its author says of it.
    pub documentation: String,
    /// Sets bound from outside.
    pub sets: Arena<SetId, Set>,
    /// What the whole is repeated over.
    pub plate: Option<Plate>,
    /// Parameters.
    pub parameters: Arena<ParameterId, Parameter>,
    /// Variables.
    pub variables: Arena<VariableId, Variable>,
    /// The nodes of all expressions.
    pub expressions: Arena<ExpressionId, Expression>,
    /// The decomposition, with its forms.
    pub factors: Arena<FactorId, Factor>,
    /// What is to be learned.
    pub identifications: Vec<Identification>,
    /// Variables of which there are no data, by the program's own word.
    #[serde(default)]
    pub hidden: Vec<VariableId>,
    /// The questions.
    pub questions: Arena<QuestionId, Question>,
    /// The questions to other programs.
    pub subroutines: Vec<Subroutine>,
}

impl Model {
    /// The declared question of this name.
    pub fn question(&self, name: &str) -> Option<&Question> {
        self.questions.values().find(|question| question.name == name)
    }

    /// The question to another program that a form names.
    pub fn subroutine(&self, path: &str) -> Option<&Subroutine> {
        self.subroutines.iter().find(|subroutine| subroutine.path == path)
    }

    /// The variable of this name, as written: `O`, `O^-1`.
    pub fn variable(&self, name: &str) -> Option<VariableId> {
        self.variables.ids().find(|id| self.variable_name(*id) == name)
    }

    /// The factor that distributes a variable. The plate's index has none, and an `X^-1` may have none.
    pub fn factor_of(&self, variable: VariableId) -> Option<FactorId> {
        self.factors.find(|factor| factor.left.iter().any(|use_| use_.variable == variable))
    }

    /// The factor that distributes each variable, by position: all of them in one pass.
    pub fn distributions(&self) -> Vec<Option<FactorId>> {
        let mut found = vec![None; self.variables.len()];
        for (id, factor) in self.factors.iter() {
            for use_ in &factor.left {
                found[use_.variable.position()].get_or_insert(id);
            }
        }
        found
    }

    /// The variables by their names, as written: for many look-ups.
    pub fn variables_by_name(&self) -> HashMap<String, VariableId> {
        let mut found = HashMap::with_capacity(self.variables.len());
        for id in self.variables.ids() {
            found.entry(self.variable_name(id)).or_insert(id);
        }
        found
    }

    /// The plate's index.
    pub fn plate_index(&self) -> Option<VariableId> {
        self.plate.map(|plate| plate.index)
    }
}
