//! Derived variables of a question: predicates, functions, elements and slices of families.
//!
//! In: an expression over a program's variables. Out: [`Derived`], and the program with a variable whose form is a
//! Dirac at that expression, so that every strategy answers it. Invariant: in a question a derived variable has an id
//! beyond those of any program, until [`Model::pose`] adds it to the program.

use super::{Ask, Domain, Expression, Factor, Family, Form, IndexSpace, Model, Question, Range};
use super::{Statistic, Variable, VariableUse};
use crate::ids::{ExpressionId, FactorId, Id, VariableId};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A variable that a question derives from those of the program.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Derived {
    /// Its notation: `Tau > 5`, `Y[3]`.
    pub name: String,
    /// Its kind.
    pub kind: DerivedKind,
    /// Its values.
    pub domain: Domain,
    /// For a slice, the elements.
    pub over: Option<Range>,
    /// The variables in its expression; their element indices are nodes of this list.
    pub right: Vec<VariableUse>,
    /// The nodes of its expression, operands first; they refer to each other by their positions in this list.
    pub nodes: Vec<Expression>,
}

/// The kind of a derived variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum DerivedKind {
    /// An expression that is true or false.
    Predicate,
    /// Any other expression.
    Function,
    /// The difference of two reals that are known to be equal.
    Equation,
    /// A part of the expression of another one.
    Part,
    /// One element of a family, or a slice.
    Element,
}

impl Derived {
    /// The id of the n-th derived variable in its question.
    pub fn id(number: usize) -> VariableId {
        VariableId::new(u32::MAX as usize - number)
    }
}

impl Question {
    /// The question with its variables renamed.
    pub fn renamed(mut self, name: &impl Fn(VariableId) -> VariableId) -> Self {
        self.asks.iter_mut().for_each(|ask| ask.rename(name));
        self
    }
}

impl Ask {
    fn rename(&mut self, name: &impl Fn(VariableId) -> VariableId) {
        self.searched.iter_mut().for_each(|item| item.variable = name(item.variable));
        self.known.iter_mut().for_each(|item| item.variable = name(item.variable));
        if let Statistic::Divergence { from, .. } = &mut self.statistic {
            from.iter_mut().for_each(|item| item.variable = name(item.variable));
        }
    }
}

impl Model {
    /// Adds the derived variables of a question to the program, and splits forms of many parents; returns the question with
    /// the ids of the derived variables.
    pub fn pose(&mut self, question: &Question) -> Question {
        self.divorce(question);
        let first = self.factors.len();
        let question = self.named(question);
        for place in first..self.factors.len() {
            self.split(FactorId::new(place));
        }
        question
    }

    /// Whether a question changes nothing of the program when it is posed.
    pub fn is_posed(&self, question: &Question) -> bool {
        question.derived.is_empty() && self.with_many_parents(question).is_empty()
    }

    /// Adds the variables that a question derives, each with the factor that defines it; gives the question in the ids
    /// of this program.
    pub(crate) fn named(&mut self, question: &Question) -> Question {
        let ids: Vec<VariableId> = question.derived.iter().map(|derived| self.add_derived(derived)).collect();
        let place = |id: VariableId| (u32::MAX as usize).checked_sub(id.position());
        let name = |id: VariableId| place(id).and_then(|place| ids.get(place).copied()).unwrap_or(id);
        Question { derived: Vec::new(), ..question.clone() }.renamed(&name)
    }

    /// The program with the question's derived variables, and the question with their ids: the input of all strategies.
    pub fn posed<'m, 'q>(&'m self, question: &'q Question) -> (Cow<'m, Model>, Cow<'q, Question>) {
        if self.is_posed(question) {
            return (Cow::Borrowed(self), Cow::Borrowed(question));
        }
        let mut model = self.clone();
        let question = model.pose(question);
        (Cow::Owned(model), Cow::Owned(question))
    }

    /// Adds a derived variable and its factor.
    fn add_derived(&mut self, derived: &Derived) -> VariableId {
        let first = self.expressions.len();
        let shifted = |id: ExpressionId| ExpressionId::new(id.position() + first);
        for node in &derived.nodes {
            self.expressions.push(node.renumbered(&shifted));
        }
        let value = ExpressionId::new(self.expressions.len() - 1);
        let family = derived.over.map(|range| Family { over: IndexSpace::Range(range), except: None });
        // The elements of a slice keep the names that they have in their family.
        let name = match derived.over {
            Some(_) => self.variables[derived.right[0].variable].name.clone(),
            None => derived.name.clone(),
        };
        let variable = self.variables.push(Variable {
            name,
            previous_of: None,
            domain: derived.domain.clone(),
            family,
            derived: Some(derived.kind),
        });
        let element = family.map(|_| self.expressions.push(Expression::Index(0)));
        let right = derived.right.iter();
        let right =
            right.map(|use_| VariableUse { element: use_.element.map(shifted), ..use_.clone() }).collect();
        self.factors.push(Factor {
            left: vec![VariableUse { variable, element }],
            right,
            form: Form::Dirac(value),
            products: family.iter().map(|family| ("i".to_owned(), family.over)).collect(),
        });
        variable
    }

    /// The factors of the derived variables, the last of the program, in one pass.
    pub fn derived_factors(&self) -> impl Iterator<Item = &Factor> {
        let of = self.distributions();
        let derived = self.variables.ids().rev().take_while(|id| self.variables[*id].derived.is_some());
        derived.filter_map(move |id| of[id.position()]).map(|id| &self.factors[id])
    }

    /// Whether a variable is the difference of two sides that a question knows to be equal.
    pub fn is_equation(&self, variable: VariableId) -> bool {
        self.variables[variable].derived == Some(DerivedKind::Equation)
    }

    /// Whether a factor is that of a predicate or an equation about numbers which other variables determine, and which are not whole:
    /// they have rounding errors, and are compared as an observation is.
    pub fn compares_determined(&self, factor: &Factor) -> bool {
        let has_dirac = |form: &Form| {
            let (mut waiting, mut found) = (vec![form.clone()], false);
            while let (Some(form), false) = (waiting.pop(), found) {
                found = matches!(form, Form::Dirac(_));
                form.each_part(&mut |part| waiting.push(part.clone()));
            }
            found
        };
        let is_determined = |use_: &VariableUse| {
            self.variables[use_.variable].domain == Domain::Real
                && self.factor_of(use_.variable).is_some_and(|id| has_dirac(&self.factors[id].form))
        };
        let is_asked =
            |left: &VariableUse| self.is_predicate(left.variable) || self.is_equation(left.variable);
        let is_finite = |use_: &VariableUse| self.variables[use_.variable].domain.is_finite();
        factor.left.iter().all(is_asked)
            && (factor.right.iter().any(is_determined)
                || factor.right.iter().all(is_finite) && self.compares_fractions(factor))
    }

    /// Whether a factor compares numbers that are not whole by construction: `K * 0.1 == 0.3`.
    fn compares_fractions(&self, factor: &Factor) -> bool {
        let Form::Dirac(root) = factor.form else { return false };
        let is_whole = |id: &ExpressionId| self.is_whole(*id);
        self.nodes_below(root).into_iter().any(|id| match &self.expressions[id] {
            Expression::Binary(operator, left, right) => {
                let compares = operator.compares() || id == root && self.is_equation(factor.left[0].variable);
                compares && ![left, right].into_iter().all(is_whole)
            }
            _ => false,
        })
    }

    /// Whether a variable is a predicate of a question.
    pub fn is_predicate(&self, variable: VariableId) -> bool {
        self.variables[variable].derived == Some(DerivedKind::Predicate)
    }
}

impl Expression {
    /// The node with its operands renumbered.
    pub fn renumbered(&self, number: &impl Fn(ExpressionId) -> ExpressionId) -> Self {
        let all = |ids: &[ExpressionId]| ids.iter().map(|id| number(*id)).collect();
        match self {
            Expression::Number(_) | Expression::Index(_) => self.clone(),
            Expression::Parameter { parameter, indices } => {
                Expression::Parameter { parameter: *parameter, indices: all(indices) }
            }
            Expression::Variable(use_) => {
                Expression::Variable(VariableUse { element: use_.element.map(number), ..use_.clone() })
            }
            Expression::Unary(operator, operand) => Expression::Unary(*operator, number(*operand)),
            Expression::Binary(operator, left, right) => {
                Expression::Binary(*operator, number(*left), number(*right))
            }
            Expression::If { condition, then, otherwise } => Expression::If {
                condition: number(*condition),
                then: number(*then),
                otherwise: number(*otherwise),
            },
            Expression::First { family, with } => Expression::First {
                family: *family,
                with: with.map(|(value, at)| (number(value), number(at))),
            },
            Expression::Foreign { path, at } => {
                Expression::Foreign { path: path.clone(), at: at.map(number) }
            }
            Expression::GradientNorm { field, at, before } => Expression::GradientNorm {
                field: number(*field),
                at: number(*at),
                before: before.map(number),
            },
            Expression::Frontier { condition, at } => {
                Expression::Frontier { condition: number(*condition), at: number(*at) }
            }
            Expression::Innermost { at } => Expression::Innermost { at: number(*at) },
            Expression::Vector(name, parts) => Expression::Vector(name.clone(), all(parts)),
        }
    }
}

impl Model {
    /// The vector of which an expression is one component, and the number of this component.
    pub(crate) fn component_of(&self, id: ExpressionId) -> Option<(&VariableUse, usize)> {
        let Expression::Vector(name, parts) = &self.expressions[id] else { return None };
        let [vector, at] = parts.as_slice() else { return None };
        match (&self.expressions[*vector], self.constant(*at)) {
            (Expression::Variable(use_), Some(at)) if name == "component" => Some((use_, at as usize)),
            _ => None,
        }
    }

    /// The vector of which a variable of a question is one component, and the number of this component.
    pub(crate) fn named_component(&self, variable: VariableId) -> Option<(&VariableUse, usize)> {
        match self.factors[self.factor_of(variable)?].form {
            Form::Dirac(value) if self.variables[variable].derived.is_some() => self.component_of(value),
            _ => None,
        }
    }
}
