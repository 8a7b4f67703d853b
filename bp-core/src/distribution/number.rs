//! Expressions, as numbers.
//!
//! In: an expression, and the values of the variables. Out: a number; of a vector, one of its components. Invariant:
//! NaN where there is none (an element that a family does not have, a field of another program): the forms refuse it.
//!
//! rotate(v, w): v turned by |w| around w (Rodrigues 1840): v cos a + (n × v) sin a + n (n · v)(1 − cos a).

use super::setting::{Instance, Setting};
use crate::ids::{ExpressionId, Id, ParameterId, VariableId};
use crate::model::{Domain, Expression, IndexSpace, VariableUse};

/// Where an expression stands: what its variables and indices are.
#[derive(Clone, Copy)]
pub(super) struct Scope<'s> {
    pub(super) setting: &'s Setting<'s>,
    pub(super) values: &'s [f64],
    pub(super) indices: &'s [f64],
    pub(super) component: usize,
    /// A slot that has another value than the assignment says: the left-hand variable, where a form speaks of it.
    pub(super) instead: Option<(usize, f64)>,
}

impl Setting<'_> {
    /// The number that a value of a variable is in an expression.
    pub fn number_at(&self, variable: VariableId, value: f64) -> f64 {
        match &self.model.variables[variable].domain {
            Domain::Real | Domain::Vector(_) => value,
            Domain::Bins(bins) if (value as usize) < bins.count() => bins.centre(value as usize),
            domain => value + domain.base() as f64,
        }
    }

    /// The value of a variable that is this number in an expression; `None` where its domain has none.
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

    /// The position of the element of a family that an index names.
    pub(super) fn element(&self, family: VariableId, index: f64) -> Option<usize> {
        let low = match self.model.variables[family].family?.over {
            IndexSpace::Range(range) => range.low,
            IndexSpace::Set(_) => 0,
        };
        let position = index - low as f64;
        let elements = self.slots_of(family).len() / self.components(family);
        let inside = position >= 0.0 && position.fract() == 0.0 && position < elements as f64;
        inside.then_some(position as usize)
    }

    /// The number that an expression is in an instance where variables have these values; NaN where it has none.
    pub(crate) fn expression(&self, id: ExpressionId, instance: &Instance, values: &[f64]) -> f64 {
        self.scope(instance, values).number(id)
    }

    /// The value of a variable that an instance's form speaks of.
    pub(crate) fn value_used(&self, use_: &VariableUse, instance: &Instance, values: &[f64]) -> f64 {
        self.scope(instance, values).value(use_)
    }

    /// The place of a field that some indices mean, row-major; `None` outside it.
    pub(crate) fn place(
        &self,
        parameter: ParameterId,
        indices: &[ExpressionId],
        instance: &Instance,
        values: &[f64],
    ) -> Option<usize> {
        self.scope(instance, values).place(parameter, indices)
    }

    fn scope<'s>(&'s self, instance: &'s Instance, values: &'s [f64]) -> Scope<'s> {
        Scope {
            setting: self,
            values,
            indices: &instance.indices,
            component: instance.component,
            instead: None,
        }
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
        let setting = self.setting;
        let components = setting.components(use_.variable);
        let element = match use_.element {
            None => Some(0),
            Some(element) => setting.element(use_.variable, self.with_component(0).number(element)),
        };
        let component = if components == 1 { 0 } else { self.component };
        element.map_or(f64::NAN, |element| {
            self.at(setting.slots_of(use_.variable).start + element * components + component)
        })
    }

    fn with_component(&self, component: usize) -> Self {
        Self { component, ..*self }
    }

    /// The number that an expression is.
    pub(super) fn number(&self, id: ExpressionId) -> f64 {
        match &self.setting.model.expressions[id] {
            Expression::Number(number) => *number,
            Expression::Parameter { parameter, indices } => self.parameter(*parameter, indices),
            Expression::Variable(use_) => self.setting.number_at(use_.variable, self.value(use_)),
            Expression::Index(depth) => self.indices.get(*depth).copied().unwrap_or(f64::NAN),
            Expression::Unary(operator, operand) => operator.apply(self.number(*operand)),
            Expression::Binary(operator, left, right) => {
                operator.apply(self.number(*left), self.number(*right))
            }
            Expression::If { condition, then, otherwise } => {
                let condition = self.with_component(0).number(*condition);
                self.number(if condition != 0.0 { *then } else { *otherwise })
            }
            Expression::First { family, with } => self.first(*family, *with),
            Expression::Foreign { path, at: None } => match self.setting.inputs.find(path) {
                Some([number]) => *number,
                _ => f64::NAN,
            },
            Expression::Vector(name, parts) => self.vector(name, parts),
            Expression::Foreign { .. }
            | Expression::GradientNorm { .. }
            | Expression::Frontier { .. }
            | Expression::Innermost { .. } => f64::NAN,
        }
    }

    fn parameter(&self, parameter: ParameterId, indices: &[ExpressionId]) -> f64 {
        let numbers = &self.setting.parameters[parameter.position()];
        if numbers.len() == 1 {
            return numbers[0];
        }
        let place = self.place(parameter, indices);
        place.and_then(|place| numbers.get(place)).copied().unwrap_or(f64::NAN)
    }

    /// The place of a field that some indices mean, row-major.
    fn place(&self, parameter: ParameterId, indices: &[ExpressionId]) -> Option<usize> {
        let mut place = 0;
        for (index, over) in indices.iter().zip(&self.setting.model.parameters[parameter].over) {
            let low = match over {
                IndexSpace::Range(range) => range.low as f64,
                IndexSpace::Set(_) => 0.0,
            };
            let length = self.setting.length(over).unwrap_or(0);
            let index = self.with_component(0).number(*index) - low;
            if !(index >= 0.0 && index < length as f64) {
                return None;
            }
            place = place * length + index as usize;
        }
        Some(place)
    }

    /// The index of the first true element; one past the last where none is true.
    fn first(&self, family: VariableId, with: Option<(ExpressionId, ExpressionId)>) -> f64 {
        let slots = self.setting.slots_of(family);
        let low = match self.setting.model.variables[family].family.map(|family| family.over) {
            Some(IndexSpace::Range(range)) => range.low as f64,
            _ => 0.0,
        };
        let with = with.map(|(value, at)| (self.number(value), self.number(at)));
        let is_true = |position: usize| match with {
            Some((value, at)) if at == low + position as f64 => value != 0.0,
            _ => self.at(slots.start + position) != 0.0,
        };
        low + (0..slots.len()).find(|position| is_true(*position)).unwrap_or(slots.len()) as f64
    }

    fn vector(&self, name: &str, parts: &[ExpressionId]) -> f64 {
        let all = |id: ExpressionId| [0, 1, 2].map(|component| self.with_component(component).number(id));
        match (name, parts) {
            ("vector", parts) => {
                parts.get(self.component).map_or(f64::NAN, |part| self.with_component(0).number(*part))
            }
            ("component", [vector, index]) => {
                let (index, length) =
                    (self.with_component(0).number(*index), vector_length(self.setting, *vector));
                let inside = index >= 0.0 && index.fract() == 0.0 && index < length as f64;
                if inside { self.with_component(index as usize).number(*vector) } else { f64::NAN }
            }
            ("rotate", [vector, by]) => rotated(all(*vector), all(*by))[self.component.min(2)],
            ("norm", [vector]) => {
                let length = vector_length(self.setting, *vector);
                let square = |component| self.with_component(component).number(*vector).powi(2);
                (0..length).map(square).sum::<f64>().sqrt()
            }
            _ => f64::NAN,
        }
    }
}

/// How many components a vector has; 1 for a number.
fn vector_length(setting: &Setting<'_>, id: ExpressionId) -> usize {
    match &setting.model.expressions[id] {
        Expression::Variable(use_) => setting.components(use_.variable),
        Expression::Unary(_, operand) => vector_length(setting, *operand),
        Expression::Binary(_, left, right) => {
            vector_length(setting, *left).max(vector_length(setting, *right))
        }
        Expression::If { then, .. } => vector_length(setting, *then),
        Expression::Vector(name, parts) if name == "vector" => parts.len(),
        Expression::Vector(name, _) if name == "rotate" => 3,
        _ => 1,
    }
}

fn rotated(v: [f64; 3], w: [f64; 3]) -> [f64; 3] {
    let angle = w.iter().map(|part| part * part).sum::<f64>().sqrt();
    if angle == 0.0 {
        return v;
    }
    let n = w.map(|part| part / angle);
    let dot = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
    let cross = [n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0]];
    let (sine, cosine) = angle.sin_cos();
    [0, 1, 2].map(|i| v[i] * cosine + cross[i] * sine + n[i] * dot * (1.0 - cosine))
}
