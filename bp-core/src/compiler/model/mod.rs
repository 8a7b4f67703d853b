//! The model: the meaning of a Bayesian Program.
//!
//! In: a checked program, or calls of [`ModelBuilder`]. Out: plain data, ids instead of names. Invariant: a `Model` has
//! passed `validate`: its factors give each variable exactly one distribution, in an order without cycles, and its
//! forms have the shape of their factors.
//!
//! Bessière, Mazer, Ahuactzin and Mekhnacha, *Bayesian Programming*, CRC 2013:
//! Program = { Description = { Specification = { Variables, Decomposition, Forms }, Identification }, Question }.

mod arms;
mod bounds;
mod builder;
mod complement;
mod constants;
mod derived;
mod determined;
mod domain;
mod evaluate;
mod expression;
mod form;
mod linear;
mod notation;
mod order;
mod question;
mod recursion;
mod split;
mod validate;
mod values;
mod walk;

pub use crate::bins::{Bins, MOST_BINS};
pub(crate) use arms::Arms;
pub use builder::ModelBuilder;
pub use derived::{Derived, DerivedKind};
pub use domain::{Bound, Domain, Range};
pub use evaluate::{Environment, Read};
pub use expression::{Expression, VariableUse};
pub use form::{Apart, Fit, Form, Unlearned, row_tolerance};
pub use linear::{Leaves, LinearForm};
pub(crate) use order::in_order;
pub use question::{Ask, Finding, Known, Question, Searched, Statistic, Value, When};
pub use validate::{Fault, Place};
pub use walk::Folded;

use crate::ids::{Arena, ExpressionId, FactorId, Id, ParameterId, QuestionId, SetId, VariableId};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// A set given at run time: its elements are numbered, its size is known at run time.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// The kind of its elements.
    pub kind: SetKind,
    /// The names of its elements, such as those in a column of data; empty where they are numbered.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elements: Vec<String>,
}

/// The kind of a set's elements.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum SetKind {
    /// Unknown: they are numbered.
    Plain,
    /// They are the cells of a grid of three axes (unused ones have extent 1), see `space::Space`.
    Grid,
    /// They are displacements on the cells of that grid.
    Displacements(SetId),
}

/// The range of an array.
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

/// A number, or a field of numbers, that is given when a question is asked.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: ParameterKind,
    /// Its default: empty for none, one number for all elements, or one for each.
    pub default: Vec<f64>,
    /// The lengths of the lists of a default that is written as rows, the outer one first; empty for another.
    pub rows: Vec<usize>,
    /// Its range; empty for one number.
    pub over: Vec<IndexSpace>,
}

impl Parameter {
    /// Its default, if it is the same everywhere.
    pub fn default_number(&self) -> Option<f64> {
        match self.default.as_slice() {
            [number] => Some(*number),
            _ => None,
        }
    }
}

impl Model {
    /// The positions of a parameter's ranges in the order in which its numbers are read: as declared; of one without a table of
    /// defaults those over the set of the plate last.
    pub(crate) fn input_order(&self, parameter: ParameterId) -> Vec<usize> {
        let Parameter { over, default, .. } = &self.parameters[parameter];
        let is_plate = |at: &usize| match over[*at] {
            IndexSpace::Set(set) => default.len() < 2 && self.plate.is_some_and(|plate| plate.set == set),
            IndexSpace::Range(_) => false,
        };
        let (plate, mut order): (Vec<usize>, Vec<usize>) = (0..over.len()).partition(is_plate);
        order.extend(plate);
        order
    }
}

/// The kind of a parameter.
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
    /// An element of a set, by its number from 0: an index that is given, `school[Rows] : Schools`.
    Element(SetId),
}

/// The index over which the whole program is repeated: `program Cell over C in Grid`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Plate {
    /// The index, a variable known in every question. Its domain is `Domain::Set(set)`.
    pub index: VariableId,
    /// The set over which it ranges.
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
    /// For a family: its index.
    pub family: Option<Family>,
    /// For a variable that a question derives from others, its kind; `None` for the program's own.
    #[serde(default)]
    pub derived: Option<DerivedKind>,
}

/// The index of a family of variables: `G[1..=N except C]`, `Z[i in Sensors]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Family {
    /// Its range.
    pub over: IndexSpace,
    /// A variable whose value is excluded from the range.
    pub except: Option<VariableId>,
}

/// One factor of the decomposition: `P(left | right)`, possibly under `prod`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Factor {
    /// The left-hand variables: at least one.
    pub left: Vec<VariableUse>,
    /// The right-hand variables.
    pub right: Vec<VariableUse>,
    /// The distribution.
    pub form: Form,
    /// The enclosing `prod`s, outermost first: name and range of the index.
    pub products: Vec<(String, IndexSpace)>,
}

/// Parameters to be learned from data: `identification { mu, sigma from recordings by C; }`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Identification {
    /// The learned parameters.
    pub parameters: Vec<ParameterId>,
    /// The name of the data set.
    pub data: String,
    /// One fit for each value of this variable.
    pub by: Option<VariableId>,
}

/// A question to another program, used as a form: `ask(Paris.rain)`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Subroutine {
    /// Its name in the form: `Paris.rain`.
    pub path: String,
    /// The program that is asked.
    pub program: Model,
    /// The name of its question: one distribution of one variable, given the value of each known one.
    pub question: String,
    /// Its answer, once it is linked (`answer::link`): by known variables in the order of the question, then by the
    /// searched one. Empty until then.
    pub table: Vec<f64>,
}

/// The meaning of a Bayesian Program. Made by [`ModelBuilder::build`].
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub documentation: String,
    /// Sets bound from outside.
    pub sets: Arena<SetId, Set>,
    /// The plate of the program.
    pub plate: Option<Plate>,
    /// Parameters.
    pub parameters: Arena<ParameterId, Parameter>,
    /// Variables.
    pub variables: Arena<VariableId, Variable>,
    /// The nodes of all expressions.
    pub expressions: Arena<ExpressionId, Expression>,
    /// The decomposition, with its forms.
    pub factors: Arena<FactorId, Factor>,
    /// The parameters to be learned.
    pub identifications: Vec<Identification>,
    /// Variables declared as hidden.
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

    /// The question to another program in a form.
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

    /// The variables by their names, as written, for repeated look-ups.
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
