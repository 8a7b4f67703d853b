//! The builder of a [`Model`], for the checker and for Rust users.
//!
//! In: calls, in an order in which ids exist before they are used. Out: [`ModelBuilder::build`] returns the model or
//! all its faults. Invariant: every model is made by the builder.
//!
//! ```
//! use bp_core::compiler::model::{Ask, Domain, Form, ModelBuilder, Question, Statistic, Searched, When};
//! let mut model = ModelBuilder::new("Coin");
//! let side = model.variable("Side", Domain::labels(["heads", "tails"]));
//! model.factor([side], [], Form::Uniform);
//! let searched = vec![Searched { variable: side, at: None }];
//! let ask = Ask { statistic: Statistic::Distribution, when: When::Now, searched, known: vec![] };
//! model.question(Question { name: "side".into(), asks: vec![ask], derived: vec![] });
//! assert_eq!(model.build().unwrap().variables.len(), 1);
//! ```

use super::{
    Domain, Expression, Factor, Family, Fault, Form, Identification, IndexSpace, Model, Parameter,
    ParameterKind, Plate, Question, Set, SetKind, Subroutine, Variable, VariableUse, validate,
};
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, QuestionId, SetId, VariableId};
use crate::operators::{Binary, Unary};

/// A model under construction.
#[derive(Clone, Debug)]
pub struct ModelBuilder {
    model: Model,
}

impl ModelBuilder {
    /// An empty model of this name.
    pub fn new(name: &str) -> Self {
        Self { model: Model { name: name.to_owned(), ..Model::default() } }
    }

    /// A builder that continues a model.
    pub(crate) fn of(model: Model) -> Self {
        Self { model }
    }

    /// The model so far.
    pub fn so_far(&self) -> &Model {
        &self.model
    }

    /// The documentation of the program.
    pub fn documentation(&mut self, text: &str) {
        self.model.documentation = text.to_owned();
    }

    /// A set given at run time.
    pub fn set(&mut self, name: &str, kind: SetKind) -> SetId {
        self.model.sets.push(Set { name: name.to_owned(), kind, elements: Vec::new() })
    }

    /// Sets the kind of a set's elements.
    pub fn set_kind(&mut self, set: SetId, kind: SetKind) {
        self.model.sets[set].kind = kind;
    }

    /// Repeats the program over a set; returns the index.
    pub fn plate(&mut self, index: &str, set: SetId) -> VariableId {
        let index = self.variable(index, Domain::Set(set));
        self.model.plate = Some(Plate { index, set });
        index
    }

    /// One number.
    pub fn parameter(&mut self, name: &str, kind: ParameterKind, default: Option<f64>) -> ParameterId {
        self.parameter_over(name, kind, default.into_iter().collect(), Vec::new())
    }

    /// A field of numbers.
    pub fn parameter_over(
        &mut self,
        name: &str,
        kind: ParameterKind,
        default: Vec<f64>,
        over: Vec<IndexSpace>,
    ) -> ParameterId {
        self.model.parameters.push(Parameter { name: name.to_owned(), kind, default, rows: Vec::new(), over })
    }

    /// Says that the default of a parameter is written as rows, in lists of these lengths.
    pub fn default_rows(&mut self, parameter: ParameterId, rows: Vec<usize>) {
        self.model.parameters[parameter].rows = rows;
    }

    /// A variable.
    pub fn variable(&mut self, name: &str, domain: Domain) -> VariableId {
        self.model.variables.push(Variable {
            name: name.to_owned(),
            previous_of: None,
            domain,
            family: None,
            derived: None,
        })
    }

    /// A family of variables.
    pub fn family(&mut self, name: &str, domain: Domain, family: Family) -> VariableId {
        let family = Some(family);
        self.model.variables.push(Variable {
            name: name.to_owned(),
            previous_of: None,
            domain,
            family,
            derived: None,
        })
    }

    /// A variable at the previous instant; repeated calls return the same one.
    pub fn previous(&mut self, of: VariableId) -> VariableId {
        if let Some(id) = self.model.variables.find(|variable| variable.previous_of == Some(of)) {
            return id;
        }
        let previous = Variable { previous_of: Some(of), ..self.model.variables[of].clone() };
        self.model.variables.push(previous)
    }

    /// A node of an expression.
    pub fn expression(&mut self, expression: Expression) -> ExpressionId {
        self.model.expressions.push(expression)
    }

    /// Removes the nodes from this one on and returns them; they refer to each other by their positions among them.
    pub(crate) fn take_nodes(&mut self, first: usize) -> Vec<Expression> {
        let local = |id: ExpressionId| ExpressionId::new(id.position() - first);
        let taken = self.model.expressions.split_off(first);
        taken.iter().map(|node| node.renumbered(&local)).collect()
    }

    /// Removes the variables from this one on.
    pub(crate) fn forget_variables(&mut self, first: usize) {
        self.model.variables.split_off(first);
    }

    /// A number.
    pub fn number(&mut self, number: f64) -> ExpressionId {
        self.expression(Expression::Number(number))
    }

    /// The value of a variable.
    pub fn value(&mut self, variable: VariableId) -> ExpressionId {
        self.expression(Expression::Variable(variable.into()))
    }

    /// An operator on one operand.
    pub fn unary(&mut self, operator: Unary, operand: ExpressionId) -> ExpressionId {
        self.expression(Expression::Unary(operator, operand))
    }

    /// An operator on two operands.
    pub fn binary(&mut self, operator: Binary, left: ExpressionId, right: ExpressionId) -> ExpressionId {
        self.expression(Expression::Binary(operator, left, right))
    }

    /// `bernoulli(p)`: true with this probability.
    pub fn bernoulli(&mut self, chance: ExpressionId) -> Form {
        self.model.bernoulli(chance)
    }

    /// An expression of 1 − p, where it has more digits than the difference.
    pub(super) fn complement(&mut self, chance: ExpressionId) -> Option<ExpressionId> {
        self.model.complement(chance)
    }

    /// A factor without indices.
    pub fn factor<const L: usize, const R: usize>(
        &mut self,
        left: [VariableId; L],
        right: [VariableId; R],
        form: Form,
    ) -> FactorId {
        let uses = |ids: &[VariableId]| ids.iter().map(|id| VariableUse::from(*id)).collect();
        self.push_factor(Factor { left: uses(&left), right: uses(&right), form, products: Vec::new() })
    }

    /// A factor.
    pub fn push_factor(&mut self, factor: Factor) -> FactorId {
        self.model.factors.push(factor)
    }

    /// Replaces the form of a factor.
    pub fn set_form(&mut self, factor: FactorId, form: Form) {
        self.model.factors[factor].form = form;
    }

    /// Declares that the data have no column for a variable: it is hidden.
    pub fn hidden(&mut self, variable: VariableId) {
        self.model.hidden.push(variable);
    }

    /// Parameters to be learned.
    pub fn identification(&mut self, identification: Identification) {
        self.model.identifications.push(identification);
    }

    /// A question to another program; equal ones are shared between forms.
    pub fn subroutine(&mut self, subroutine: Subroutine) {
        if self.model.subroutine(&subroutine.path).is_none() {
            self.model.subroutines.push(subroutine);
        }
    }

    /// A question.
    pub fn question(&mut self, question: Question) -> QuestionId {
        self.model.questions.push(question)
    }

    /// The model, or all its faults.
    pub fn build(self) -> Result<Model, Vec<Fault>> {
        let faults = validate::faults(&self.model);
        if faults.is_empty() { Ok(self.model) } else { Err(faults) }
    }
}

impl Model {
    /// The faults of a question to this model; none if it can be asked.
    pub fn question_faults(&self, question: &Question) -> Vec<Fault> {
        let (model, question) = self.posed(question);
        validate::question_faults(&model, &question, None)
    }
}
