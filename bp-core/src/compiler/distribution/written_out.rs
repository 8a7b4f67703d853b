//! Expansion of families: a variable for each element, a factor for each instance.
//!
//! In: a setting, and a question to its program. Out: a program without families and the same question of it, with the
//! given values substituted. Invariant: the joint distribution is the same. An index that depends on a variable becomes
//! a chain of `if`s over the elements.
//!
//! Every strategy can then know and search single elements.

mod question;

use super::setting::{Instance, Setting};
use crate::error::Error;
use crate::ids::{Arena, ExpressionId, Id, VariableId};
use crate::model::{DerivedKind, Expression, Factor, Form, Model};
use crate::model::{Question, Variable, VariableUse};
use crate::operators::Binary;
use std::collections::HashMap;

/// Upper limit on the elements among which an index that depends on a variable chooses.
const MOST_CHOICES: usize = 256;

/// A program without families, and a question to it.
#[derive(Debug)]
pub(crate) struct WrittenOut {
    /// The program.
    pub(crate) model: Model,
    /// The question.
    pub(crate) question: Question,
    /// For each ask, the original of each of its variables: a variable, and its element.
    pub(crate) back: Vec<HashMap<VariableId, (VariableId, Option<i64>)>>,
}

struct Writer<'w, 'm> {
    setting: &'w Setting<'m>,
    model: Model,
    /// The first expanded variable of each original; those of a family are consecutive.
    first: Vec<VariableId>,
    /// For each derived element, the elements that it aliases.
    aliases: HashMap<VariableId, Vec<VariableId>>,
    question: String,
}

impl<'m> Setting<'m> {
    /// The program with its families expanded; `None` where a part of it cannot be.
    ///
    /// # Errors
    /// A value that is missing; a question that knows one element twice, or knows a variable that it searches.
    pub(crate) fn written_out(&self, question: &Question) -> Result<Option<WrittenOut>, Error> {
        let stays = |form: &Form| matches!(form, Form::Previous { .. } | Form::Unknown(_));
        let model = self.model;
        let timeless = model.variables.values().all(|it| it.previous_of.is_none())
            && !model.factors.values().any(|factor| stays(&factor.form));
        if model.plate.is_some() || !timeless {
            return Ok(None);
        }
        let mut writer = Writer {
            setting: self,
            model: Model {
                variables: Arena::default(),
                expressions: Arena::default(),
                factors: Arena::default(),
                questions: Arena::default(),
                ..model.clone()
            },
            first: Vec::new(),
            aliases: HashMap::new(),
            question: question.asks.first().map(|ask| model.ask_text(ask)).unwrap_or_default(),
        };
        model.variables.ids().for_each(|id| writer.variable(id));
        if writer.factors()?.is_none() {
            return Ok(None);
        }
        let mut back = Vec::new();
        let mut asks = Vec::new();
        for ask in &question.asks {
            let mut names = HashMap::new();
            asks.push(writer.ask(ask, &mut names)?);
            back.push(names);
        }
        let asked = Question { name: question.name.clone(), asks, derived: Vec::new() };
        if let Some(fault) = writer.model.question_faults(&asked).into_iter().next() {
            let reason = fault.message;
            return Err(Error::Unplanned { question: writer.question, reason });
        }
        Ok(Some(WrittenOut { model: writer.model, question: asked, back }))
    }
}

impl Writer<'_, '_> {
    /// The number of a variable's elements; 1 where it is not a family.
    fn elements(&self, variable: VariableId) -> usize {
        self.setting.slots_of(variable).len() / self.setting.components(variable).max(1)
    }

    /// Adds the expanded variables of a variable.
    fn variable(&mut self, id: VariableId) {
        let variable = &self.setting.model.variables[id];
        self.first.push(VariableId::new(self.model.variables.len()));
        if variable.derived == Some(DerivedKind::Element) {
            return;
        }
        let Some(family) = variable.family else {
            self.model.variables.push(variable.clone());
            return;
        };
        for element in 0..self.elements(id) {
            self.model.variables.push(Variable {
                name: self.setting.model.element_name(id, family.over.first() + element as i64),
                family: None,
                derived: Some(DerivedKind::Element),
                ..variable.clone()
            });
        }
    }

    /// The expanded variable of an element.
    fn element(&self, variable: VariableId, element: usize) -> VariableId {
        match self.aliases.get(&variable) {
            Some(elements) => elements[element],
            None => VariableId::new(self.first[variable.position()].position() + element),
        }
    }

    fn factors(&mut self) -> Result<Option<()>, Error> {
        let model = self.setting.model;
        for (id, factor) in model.factors.iter() {
            let instances = self.setting.instances(id)?;
            for instance in instances.iter().filter(|instance| instance.component == 0) {
                let left = factor.left[0].variable;
                if model.variables[left].derived == Some(DerivedKind::Element) {
                    let Form::Dirac(value) = factor.form else { return Ok(None) };
                    let Expression::Variable(use_) = &model.expressions[value] else { return Ok(None) };
                    let Some(meant) = self.used(use_, instance) else { return Ok(None) };
                    self.aliases.entry(left).or_default().extend(meant);
                    continue;
                }
                let slot_variable = |slot: &usize| {
                    let variable = self.setting.variable_of(*slot);
                    let at =
                        (slot - self.setting.slots_of(variable).start) / self.setting.components(variable);
                    VariableUse::from(self.element(variable, at))
                };
                let left: Vec<VariableUse> = instance.left.iter().map(slot_variable).collect();
                let mut right: Vec<VariableUse> = Vec::new();
                for use_ in &factor.right {
                    let uses = match self.used(use_, instance) {
                        Some(uses) => uses,
                        // An element before the first, which only the forms of later ones read.
                        None if self.is_outside(use_, instance) => Vec::new(),
                        None => {
                            let all = 0..self.elements(use_.variable);
                            all.map(|element| self.element(use_.variable, element)).collect()
                        }
                    };
                    for variable in uses {
                        if right.iter().all(|own| own.variable != variable) {
                            right.push(variable.into());
                        }
                    }
                }
                let Some(form) = self.form(&factor.form, instance) else { return Ok(None) };
                self.model.factors.push(Factor { left, right, form, products: Vec::new() });
            }
        }
        Ok(Some(()))
    }

    /// The expanded variables of a use: one element, or all; `None` where its index depends on a variable.
    fn used(&self, use_: &VariableUse, instance: &Instance) -> Option<Vec<VariableId>> {
        let Some(element) = use_.element else {
            let all = 0..self.elements(use_.variable);
            return Some(all.map(|element| self.element(use_.variable, element)).collect());
        };
        let number = self.setting.index_number(element, &instance.indices);
        let element = self.setting.element(use_.variable, number)?;
        Some(vec![self.element(use_.variable, element)])
    }

    /// Whether the index of a use is a number, and the family has no such element.
    fn is_outside(&self, use_: &VariableUse, instance: &Instance) -> bool {
        use_.element.is_some_and(|element| !self.setting.index_number(element, &instance.indices).is_nan())
            && self.used(use_, instance).is_none()
    }

    fn form(&mut self, form: &Form, at: &Instance) -> Option<Form> {
        let form = self.setting.branch(form, &at.indices);
        let one = |writer: &mut Self, id: &ExpressionId| writer.expression(*id, at);
        let all = |writer: &mut Self, ids: &[ExpressionId]| {
            ids.iter().map(|id| writer.expression(*id, at)).collect::<Option<Vec<_>>>()
        };
        Some(match form {
            Form::Uniform | Form::Flat | Form::HalfFlat | Form::Constants(_) => form.clone(),
            Form::Bernoulli(p, other) => Form::Bernoulli(
                one(self, p)?,
                match other {
                    Some(other) => Some(one(self, other)?),
                    None => None,
                },
            ),
            Form::Dirac(value) => Form::Dirac(one(self, value)?),
            Form::Weights(weight) => Form::Weights(one(self, weight)?),
            Form::Categorical(entries) => Form::Categorical(all(self, entries)?),
            Form::Dirichlet(entries) => Form::Dirichlet(all(self, entries)?),
            Form::NormalVector { mean, covariance } => Form::NormalVector {
                mean: one(self, mean)?,
                covariance: covariance.iter().map(|row| all(self, row)).collect::<Option<_>>()?,
            },
            Form::Multinomial { trials, probabilities } => {
                Form::Multinomial { trials: one(self, trials)?, probabilities: all(self, probabilities)? }
            }
            Form::Ordered(form) => Form::Ordered(Box::new(self.form(form, at)?)),
            Form::Table(rows) => {
                Form::Table(rows.iter().map(|row| all(self, row)).collect::<Option<Vec<_>>>()?)
            }
            Form::Law { law, arguments } => Form::Law { law: *law, arguments: all(self, arguments)? },
            Form::Mixture(parts) => {
                let mut written = Vec::new();
                for (weight, part) in parts {
                    written.push((one(self, weight)?, self.form(part, at)?));
                }
                Form::Mixture(written)
            }
            Form::Truncated { form, low, high } => Form::Truncated {
                form: Box::new(self.form(form, at)?),
                low: one(self, low)?,
                high: one(self, high)?,
            },
            Form::NormalBins { mean, deviation } => {
                Form::NormalBins { mean: one(self, mean)?, deviation: one(self, deviation)? }
            }
            Form::If { condition, then, otherwise } => Form::If {
                condition: one(self, condition)?,
                then: Box::new(self.form(then, at)?),
                otherwise: Box::new(self.form(otherwise, at)?),
            },
            Form::Ask { path, given } if self.setting.model.subroutine(path).is_some() => {
                let alone = given.iter().all(|id| self.setting.model.variables[*id].family.is_none());
                let given = given.iter().map(|id| self.element(*id, 0)).collect();
                alone.then_some(Form::Ask { path: path.clone(), given })?
            }
            Form::Ask { .. } | Form::Previous { .. } | Form::Initial { .. } | Form::Unknown(_) => {
                return None;
            }
        })
    }

    /// An expression of an instance.
    fn expression(&mut self, root: ExpressionId, at: &Instance) -> Option<ExpressionId> {
        let mut made: HashMap<ExpressionId, ExpressionId> = HashMap::new();
        for id in self.setting.model.nodes_below(root) {
            let node = self.node(id, at, &made)?;
            made.insert(id, self.model.expressions.push(node));
        }
        made.get(&root).copied()
    }

    fn node(
        &mut self,
        id: ExpressionId,
        at: &Instance,
        made: &HashMap<ExpressionId, ExpressionId>,
    ) -> Option<Expression> {
        let model = self.setting.model;
        Some(match &model.expressions[id] {
            Expression::Index(depth) => Expression::Number(at.indices[*depth]),
            Expression::Parameter { parameter, indices } if !indices.is_empty() => {
                let number = self.setting.index_number(id, &at.indices);
                match number.is_nan() {
                    // The index depends on a variable.
                    true => Expression::Parameter {
                        parameter: *parameter,
                        indices: indices.iter().map(|id| made[id]).collect(),
                    },
                    false => Expression::Number(number),
                }
            }
            Expression::Variable(use_) => match (use_.element, self.used(use_, at)) {
                (None, _) if model.variables[use_.variable].family.is_some() => return None,
                (_, Some(variables)) => Expression::Variable(variables[0].into()),
                (Some(element), None) if self.setting.index_number(element, &at.indices).is_nan() => {
                    self.chosen(use_.variable, element, made[&element])?
                }
                // Where it is read, this number is refused.
                (_, None) => Expression::Number(f64::NAN),
            },
            Expression::If { condition, then, otherwise }
                if let Some(condition) = self.model.constant(made[condition]) =>
            {
                let taken = if condition != 0.0 { then } else { otherwise };
                self.model.expressions[made[taken]].clone()
            }
            Expression::First { family, with: None } => {
                let over = model.variables[*family].family?.over;
                let count = self.elements(*family);
                let mut otherwise = self.number(over.first() + count as i64);
                for element in (0..count).rev() {
                    let condition = self.value(*family, element);
                    let then = self.number(over.first() + element as i64);
                    otherwise = self.model.expressions.push(Expression::If { condition, then, otherwise });
                }
                self.model.expressions[otherwise].clone()
            }
            Expression::First { .. }
            | Expression::Foreign { .. }
            | Expression::GradientNorm { .. }
            | Expression::Frontier { .. }
            | Expression::Innermost { .. } => return None,
            other => other.renumbered(&|id| made[&id]),
        })
    }

    /// The element at an index that depends on variables: printed as `index`, and built as `made`.
    fn chosen(&mut self, family: VariableId, index: ExpressionId, made: ExpressionId) -> Option<Expression> {
        let first = self.setting.model.variables[family].family?.over.first();
        let count = self.elements(family);
        if count == 0 || count > MOST_CHOICES {
            return None;
        }
        let inside = self.lies_inside(index, first, count);
        // An index outside the family gives NaN, which is an error where it is used.
        let mut otherwise = match inside {
            true => self.value(family, count - 1),
            false => self.model.expressions.push(Expression::Number(f64::NAN)),
        };
        for element in (0..count - usize::from(inside)).rev() {
            let number = self.number(first + element as i64);
            let condition = self.model.expressions.push(Expression::Binary(Binary::Equal, made, number));
            let then = self.value(family, element);
            otherwise = self.model.expressions.push(Expression::If { condition, then, otherwise });
        }
        Some(self.model.expressions[otherwise].clone())
    }

    /// Whether an index is a variable all of whose values are elements.
    fn lies_inside(&self, index: ExpressionId, first: i64, count: usize) -> bool {
        let model = self.setting.model;
        let Expression::Variable(use_) = &model.expressions[index] else { return false };
        let domain = &model.variables[use_.variable].domain;
        let values = self.setting.count(use_.variable);
        let last = (first + count as i64 - 1) as f64;
        domain.is_finite()
            && values > 0
            && domain.number(0) >= first as f64
            && domain.number(values - 1) <= last
    }

    fn number(&mut self, number: i64) -> ExpressionId {
        self.model.expressions.push(Expression::Number(number as f64))
    }

    fn value(&mut self, family: VariableId, element: usize) -> ExpressionId {
        self.model.expressions.push(Expression::Variable(self.element(family, element).into()))
    }
}

/// Whether a question uses single elements of families, so that whole families do not suffice.
pub(crate) fn uses_elements(model: &Model) -> bool {
    let mut uses = model.derived_factors().flat_map(|factor| &factor.right);
    uses.any(|use_| model.variables[use_.variable].family.is_some())
}
