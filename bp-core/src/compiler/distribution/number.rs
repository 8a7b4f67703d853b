//! Evaluation of expressions.
//!
//! In: an expression, and the values of the variables. Out: a number; of a vector, one of its components. Invariant: an
//! undefined expression (an element outside its family, a field of another program) is NaN, which the forms refuse.

use super::setting::{Instance, Setting};
use super::vector::{norm, rotated};
use crate::exec::scalar::Number;
use crate::ids::{ExpressionId, Id, ParameterId, VariableId};
use crate::law::{Arithmetic, Numbers, Wide};
use crate::model::{Domain, Environment, Expression, Folded, IndexSpace, Read, VariableUse};
use crate::radix;

/// The context of an expression: the values of its variables and indices.
#[derive(Clone, Copy)]
pub(super) struct Scope<'s> {
    pub(super) setting: &'s Setting<'s>,
    pub(super) values: &'s [f64],
    pub(super) indices: &'s [f64],
    pub(super) component: usize,
    /// A slot whose value in the assignment is overridden: the left-hand variable, where a form uses it.
    pub(super) instead: Option<(usize, f64)>,
}

impl Setting<'_> {
    /// The number that a value of a variable has in an expression.
    pub fn number_at(&self, variable: VariableId, value: f64) -> f64 {
        match &self.model.variables[variable].domain {
            Domain::Real | Domain::Vector(_) => value,
            Domain::Bins(bins) if (value as usize) < bins.count() => bins.centre(value as usize),
            domain => value + domain.base() as f64,
        }
    }

    /// The value of a variable with this number in an expression; `None` where its domain has no such value.
    pub fn value_at(&self, variable: VariableId, number: f64) -> Option<f64> {
        match &self.model.variables[variable].domain {
            Domain::Real | Domain::Vector(_) => number.is_finite().then_some(number),
            Domain::Bins(bins) => bins.holding(number).map(|bin| bin as f64),
            domain => {
                let ordinal = number - domain.base() as f64;
                let inside =
                    ordinal.fract() == 0.0 && ordinal >= 0.0 && ordinal < self.count(variable) as f64;
                inside.then_some(ordinal)
            }
        }
    }

    /// The position of a family's element with this index.
    pub(super) fn element(&self, family: VariableId, index: f64) -> Option<usize> {
        let position = index - self.model.variables[family].family?.over.first() as f64;
        let elements = self.slots_of(family).len() / self.components(family);
        let inside = position >= 0.0 && position.fract() == 0.0 && position < elements as f64;
        inside.then_some(position as usize)
    }

    /// The number of an expression in an instance at these values of the variables; NaN where it is undefined.
    pub(crate) fn expression(&self, id: ExpressionId, instance: &Instance, values: &[f64]) -> f64 {
        self.scope(instance, values).number(id)
    }

    /// The value of a variable that an instance's form uses.
    pub(crate) fn value_used(&self, use_: &VariableUse, instance: &Instance, values: &[f64]) -> f64 {
        self.scope(instance, values).value(use_)
    }

    /// The row-major position in a field at these indices; `None` outside it.
    pub(crate) fn place(
        &self,
        parameter: ParameterId,
        indices: &[ExpressionId],
        instance: &Instance,
        values: &[f64],
    ) -> Option<usize> {
        let scope = self.scope(instance, values);
        let index = |id: &ExpressionId| scope.with_component(0).number(*id);
        self.place_at(parameter, indices.iter().map(index))
    }

    pub(super) fn scope<'s>(&'s self, instance: &'s Instance, values: &'s [f64]) -> Scope<'s> {
        Scope {
            setting: self,
            values,
            indices: &instance.indices,
            component: instance.component,
            instead: None,
        }
    }

    /// The number of a parameter; of a field, its element at these indices, which may be one number for all; NaN outside it.
    pub(crate) fn field(&self, parameter: ParameterId, indices: &[f64]) -> f64 {
        let numbers = self.parameters[parameter.position()].as_slice();
        let over = &self.model.parameters[parameter].over;
        // Without a size there is no end.
        if over.is_empty() || numbers.len() == 1 && over.iter().any(|space| self.length(space).is_err()) {
            return numbers.first().copied().unwrap_or(f64::NAN);
        }
        let number = |place: usize| if numbers.len() == 1 { numbers.first() } else { numbers.get(place) };
        self.place_at(parameter, indices.iter().copied()).and_then(number).copied().unwrap_or(f64::NAN)
    }

    /// The slot of a component of a variable, or of the element of a family at an index; `None` outside the family.
    pub(crate) fn slot_at(
        &self,
        variable: VariableId,
        index: Option<f64>,
        component: usize,
    ) -> Option<usize> {
        let element = index.map_or(Some(0), |index| self.element(variable, index))?;
        Some(self.slots_of(variable).start + element * self.components(variable) + component)
    }

    /// The place of a field at some indices, the last in the order of [`Model::input_order`] fastest; `None` outside it.
    fn place_at(&self, parameter: ParameterId, indices: impl Iterator<Item = f64>) -> Option<usize> {
        let digit = |(index, over): (f64, &IndexSpace)| {
            let length = self.length(over).unwrap_or(0);
            let index = index - over.first() as f64;
            (index >= 0.0 && index < length as f64).then_some((index as usize, length))
        };
        let over = &self.model.parameters[parameter].over;
        if over.len() < 2 || self.model.plate.is_none() {
            return radix::position_inside(indices.zip(over).map(digit));
        }
        let all: Vec<(f64, &IndexSpace)> = indices.zip(over).collect();
        let order = self.model.input_order(parameter);
        radix::position_inside(order.into_iter().map(|at| digit(all[at])))
    }

    /// An index that depends on no variable.
    pub(super) fn index_number(&self, id: ExpressionId, indices: &[f64]) -> f64 {
        Scope { setting: self, values: &[], indices, component: 0, instead: None }.number(id)
    }
}

impl Scope<'_> {
    /// The value in a slot.
    pub(super) fn at(&self, slot: usize) -> f64 {
        match self.instead {
            Some((instead, value)) if instead == slot => value,
            _ => self.values.get(slot).copied().unwrap_or(f64::NAN),
        }
    }

    /// The value of a variable, or of one element of a family.
    pub(super) fn value(&self, use_: &VariableUse) -> f64 {
        let index = use_.element.map(|element| self.with_component(0).number(element));
        self.element_value(use_, index)
    }

    /// The value of a variable, or of the element of a family at an index.
    fn element_value(&self, use_: &VariableUse, index: Option<f64>) -> f64 {
        self.slot_at(use_.variable, index).map_or(f64::NAN, |slot| self.at(slot))
    }

    /// The slot of a variable, or of one element of a family; `None` where the family has no such element.
    pub(super) fn slot(&self, use_: &VariableUse) -> Option<usize> {
        self.slot_at(use_.variable, use_.element.map(|element| self.with_component(0).number(element)))
    }

    fn slot_at(&self, variable: VariableId, index: Option<f64>) -> Option<usize> {
        let component = if self.setting.components(variable) == 1 { 0 } else { self.component };
        self.setting.slot_at(variable, index, component)
    }

    pub(super) fn with_component(&self, component: usize) -> Self {
        Self { component, ..*self }
    }

    /// The number of an expression. A short one is walked as a tree; in a longer one, and in one with many shared
    /// parts, each node is evaluated once.
    pub(super) fn number(&self, id: ExpressionId) -> f64 {
        self.number_by(id, Numbers)
    }

    /// As [`Scope::number`], by another arithmetic.
    pub(super) fn number_by<A: Known>(&self, id: ExpressionId, by: A) -> A::Number {
        let walk = || Reading { scope: *self, steps: MOST_STEPS, below: None, by }.operand(id);
        walk()
            .or_else(|TooLong| if self.setting.find_arms() { walk() } else { Err(TooLong) })
            .unwrap_or_else(|TooLong| self.in_order(id, by))
    }

    /// The number of an expression, each node evaluated once, all components of a vector together.
    fn in_order<A: Known>(&self, id: ExpressionId, by: A) -> A::Number {
        let of = |expression: &Expression, below: &Below<A>| self.components(expression, below, by);
        let all = self.setting.model.fold(id, of).root();
        component(&all, self.component)
    }

    /// The components of a node, given those of its operands.
    pub(super) fn components<A: Known>(
        &self,
        expression: &Expression,
        below: &Below<A>,
        mut by: A,
    ) -> Vec<A::Number> {
        let first = |id: &ExpressionId| component(below.of(*id), 0);
        let three = |id: &ExpressionId| [0, 1, 2].map(|at| component(below.of(*id), at));
        let known = |number: f64| A::Number::known(number);
        let count = match expression {
            Expression::Vector(name, parts) => {
                return match (name.as_str(), parts.as_slice()) {
                    ("vector", parts) => parts.iter().map(first).collect(),
                    ("component", [vector, at]) => {
                        let (vector, at) = (below.of(*vector), first(at).rounded());
                        let inside = at >= 0.0 && at.fract() == 0.0 && at < vector.len() as f64;
                        vec![if inside { vector[at as usize] } else { known(f64::NAN) }]
                    }
                    ("rotate", [vector, turn]) => rotated(&mut by, three(vector), three(turn)).to_vec(),
                    ("norm", [vector]) => vec![norm(&mut by, below.of(*vector))],
                    _ => vec![known(f64::NAN)],
                };
            }
            Expression::Variable(use_) => self.setting.components(use_.variable),
            Expression::Unary(_, operand) => below.of(*operand).len(),
            Expression::Binary(_, left, right) => below.of(*left).len().max(below.of(*right).len()),
            Expression::If { then, otherwise, .. } => below.of(*then).len().max(below.of(*otherwise).len()),
            _ => 1,
        };
        let of = |component: usize| {
            let scope = self.with_component(component);
            let mut reading = Reading { scope, steps: 0, below: Some(below), by };
            reading.value(expression).unwrap_or_else(|TooLong| known(f64::NAN))
        };
        (0..count).map(of).collect()
    }

    /// The index of the first true element, where `with` is (value, index); one past the last where none is true.
    fn first(&self, family: VariableId, with: Option<(f64, f64)>) -> f64 {
        let slots = self.setting.slots_of(family);
        let low = match self.setting.model.variables[family].family.map(|family| family.over) {
            Some(IndexSpace::Range(range)) => range.low as f64,
            _ => 0.0,
        };
        let is_true = |position: usize| match with {
            Some((value, at)) if at == low + position as f64 => value != 0.0,
            _ => self.at(slots.start + position) != 0.0,
        };
        low + (0..slots.len()).find(|position| is_true(*position)).unwrap_or(slots.len()) as f64
    }
}

/// Limit on the steps of a walk; beyond it, each node is evaluated once instead.
const MOST_STEPS: usize = 256;

/// An arithmetic whose numbers are known.
pub(super) trait Known: Arithmetic<Number: Number> + Copy + Default {
    /// The number of the value in a slot.
    fn variable(&mut self, _slot: Option<usize>, number: f64) -> Self::Number {
        self.constant(number)
    }
}

impl Known for Numbers {}
impl Known for Wide {}

/// The components of the evaluated nodes.
type Below<A> = Folded<Vec<<A as Arithmetic>::Number>>;

/// An evaluation of an expression at one component of a vector.
struct Reading<'s, A: Known> {
    scope: Scope<'s>,
    /// The number of steps left.
    steps: usize,
    /// The evaluated nodes, where each node is evaluated once.
    below: Option<&'s Below<A>>,
    by: A,
}

impl<A: Known> Reading<'_, A> {
    /// The value of an index.
    fn place_of(&mut self, id: ExpressionId) -> Result<f64, TooLong> {
        Ok(self.scalar(id)?.rounded())
    }
}

/// A walk took too many steps, or met an operator on several components of a vector.
struct TooLong;

impl<A: Known> Environment for Reading<'_, A> {
    type By = A;
    type Stop = TooLong;

    fn by(&mut self) -> &mut A {
        &mut self.by
    }

    fn operand(&mut self, id: ExpressionId) -> Read<Self> {
        if let Some(below) = self.below {
            return Ok(component(below.of(id), self.scope.component));
        }
        self.steps = self.steps.checked_sub(1).ok_or(TooLong)?;
        let setting = self.scope.setting;
        let expression = &setting.model.expressions[id];
        if let Expression::If { .. } = expression
            && let Some(arms) = setting.arms(id)
        {
            let value = self.scope.with_component(0).value(&arms.variable.into());
            return self.operand(arms.selected(value));
        }
        self.value(expression)
    }

    fn scalar(&mut self, id: ExpressionId) -> Read<Self> {
        let component = std::mem::replace(&mut self.scope.component, 0);
        let number = self.operand(id);
        self.scope.component = component;
        number
    }

    fn parameter(&mut self, parameter: ParameterId, indices: &[ExpressionId]) -> Read<Self> {
        let indices = indices.iter().map(|index| self.place_of(*index)).collect::<Result<Vec<f64>, _>>()?;
        let number = self.scope.setting.field(parameter, &indices);
        Ok(self.by.constant(number))
    }

    fn variable(&mut self, use_: &VariableUse) -> Read<Self> {
        let index = use_.element.map(|element| self.place_of(element)).transpose()?;
        let slot = self.scope.slot_at(use_.variable, index);
        let value = slot.map_or(f64::NAN, |slot| self.scope.at(slot));
        Ok(self.by.variable(slot, self.scope.setting.number_at(use_.variable, value)))
    }

    fn index(&mut self, depth: usize) -> Read<Self> {
        Ok(self.by.constant(self.scope.indices.get(depth).copied().unwrap_or(f64::NAN)))
    }

    fn first(&mut self, family: VariableId, with: Option<(ExpressionId, ExpressionId)>) -> Read<Self> {
        let with = match with {
            Some((value, at)) => Some((self.place_of(value)?, self.place_of(at)?)),
            None => None,
        };
        Ok(self.by.constant(self.scope.first(family, with)))
    }

    fn other(&mut self, expression: &Expression) -> Read<Self> {
        match expression {
            Expression::Vector(name, parts) if name == "vector" => match parts.get(self.scope.component) {
                Some(part) => self.scalar(*part),
                None => Ok(self.by.constant(f64::NAN)),
            },
            Expression::Vector(..) => Err(TooLong),
            // One number of another program; its fields cannot be read here.
            Expression::Foreign { path, at: None } => {
                let given = self.scope.setting.inputs.find(path);
                let number = given.and_then(|numbers| numbers.first().filter(|_| numbers.len() == 1));
                Ok(self.by.constant(number.copied().unwrap_or(f64::NAN)))
            }
            _ => Ok(self.by.constant(f64::NAN)),
        }
    }
}

/// A component of a vector; a scalar is the same at every component.
pub(super) fn component<N: Number>(all: &[N], at: usize) -> N {
    match all {
        [number] => *number,
        several => several.get(at).copied().unwrap_or(N::known(f64::NAN)),
    }
}
