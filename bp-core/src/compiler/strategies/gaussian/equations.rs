//! The equations of slots: each a linear form of others, with noise of its own.
//!
//! In: the equations of variables, and a setting. Out: those of single elements and components, each made when it is first
//! needed. Invariant: parents come before their children.

use super::{LinearEquation, Noise};
use crate::distribution::{Instance, Setting, has_square, no_square};
use crate::error::Error;
use crate::ids::{ExpressionId, ParameterId};
use crate::law::Conditional;
use crate::model::{Leaves, LinearForm, VariableUse};
use crate::spelling::number as written;

/// The leaves of an expression in an instance: variables are slots.
pub(crate) struct Slots<'s> {
    pub(crate) setting: &'s Setting<'s>,
    pub(crate) indices: &'s [f64],
}

impl Leaves for Slots<'_> {
    fn parameter(&self, parameter: ParameterId, indices: &[f64]) -> f64 {
        self.setting.field(parameter, indices)
    }

    fn variable(&self, use_: &VariableUse, index: Option<f64>, component: usize) -> Option<usize> {
        self.setting.slot_at(use_.variable, index, component)
    }

    fn index(&self, depth: usize) -> f64 {
        self.indices.get(depth).copied().unwrap_or(f64::NAN)
    }
}

/// One slot: its mean, linear in others, and the deviation of its own noise.
#[derive(Clone, Debug, Default)]
pub(super) struct Equation {
    /// Slots, each with its coefficient.
    pub(super) parents: Vec<(usize, f64)>,
    pub(super) constant: f64,
    /// Infinite of a flat slot.
    pub(super) deviation: f64,
}

/// The equations of slots, each made when it is first needed.
pub(super) struct Equations<'s> {
    setting: &'s Setting<'s>,
    instances: Vec<Option<(&'s LinearEquation, Instance)>>,
    pub(super) made: Vec<Option<Equation>>,
}

impl<'s> Equations<'s> {
    /// The equations of variables; of several of one variable the last.
    pub(super) fn new(
        setting: &'s Setting<'s>,
        sources: impl Iterator<Item = &'s LinearEquation>,
    ) -> Result<Self, Error> {
        let slots = || 0..setting.slots();
        let mut instances: Vec<Option<(&LinearEquation, Instance)>> = slots().map(|_| None).collect();
        for source in sources {
            for instance in setting.instances(source.factor)? {
                let holds = |(condition, holds): &(ExpressionId, bool)| {
                    (setting.expression(*condition, &instance, &[]) != 0.0) == *holds
                };
                if !source.when.iter().all(holds) {
                    continue;
                }
                let slot = instance.left[0];
                instances[slot] = Some((source, instance));
            }
        }
        Ok(Self { setting, instances, made: slots().map(|_| None).collect() })
    }

    /// Makes the equation of a slot.
    fn make(&mut self, slot: usize) -> Result<(), Error> {
        // A slot without a factor, such as the index of a plate, is 0.
        let mut made = Equation::default();
        if let Some((source, instance)) = &self.instances[slot] {
            let leaves = Slots { setting: self.setting, indices: &instance.indices };
            let model = self.setting.model;
            let context = || {
                let products = model.factors[source.factor].products.iter();
                let named =
                    products.zip(&instance.indices).map(|((name, _), index)| format!("{name} = {index}"));
                named.collect::<Vec<_>>().join(", ")
            };
            let (form, deviation) = law_of(self.setting, source, instance.component, &leaves, &context)?;
            let parents = form.coefficients.into_iter().collect();
            made = Equation { parents, constant: form.constant, deviation };
        }
        self.made[slot] = Some(made);
        Ok(())
    }

    /// Adds a slot after those that it depends on; a slot with one of these marks is not added again.
    pub(super) fn add_with_parents(
        &mut self,
        of: usize,
        (marks, mark): (&mut [usize], usize),
        order: &mut Vec<usize>,
    ) -> Result<(), Error> {
        // With each slot, how many of its parents have been looked at.
        let mut open = vec![(of, 0)];
        while let Some((slot, parent)) = open.pop() {
            if parent == 0 {
                if marks[slot] == NEEDED || marks[slot] == mark {
                    continue;
                }
                if self.made[slot].is_none() {
                    self.make(slot)?;
                }
            }
            match self.of(slot).parents.get(parent) {
                Some((next, _)) => {
                    let next = *next;
                    open.push((slot, parent + 1));
                    open.push((next, 0));
                }
                None if marks[slot] == NEEDED || marks[slot] == mark => {}
                None => {
                    marks[slot] = mark;
                    order.push(slot);
                }
            }
        }
        Ok(())
    }

    pub(super) fn of(&self, slot: usize) -> &Equation {
        self.made[slot].as_ref().expect("internal: the equation of a slot is made before it is read")
    }
}

/// The mark of the observed slots and their ancestors; those of the asks follow.
pub(super) const NEEDED: usize = 1;

/// The mean of a component of a variable, linear in others and in the earlier components, and the deviation of its own
/// noise; `context` says where an error is.
fn law_of(
    setting: &Setting<'_>,
    source: &LinearEquation,
    component: usize,
    leaves: &dyn Leaves,
    context: &dyn Fn() -> String,
) -> Result<(LinearForm, f64), Error> {
    let model = setting.model;
    let Some(mean) = source.mean else { return Ok((LinearForm::default(), f64::INFINITY)) };
    let mut form = LinearForm::of(model, mean, component, leaves);
    let factor = &model.factors[source.factor];
    let refused = |message: String| Error::Number {
        form: model.form_text(factor, &factor.form),
        context: context(),
        message,
    };
    let deviation = match &source.noise {
        Noise::None | Noise::Flat => 0.0,
        Noise::Deviation(id) => {
            let deviation = LinearForm::of(model, *id, component, leaves).constant;
            if !(deviation > 0.0 && deviation.is_finite()) {
                let found = written(deviation);
                let message = format!("the standard deviation is {found}, but it must be greater than 0");
                return Err(refused(message));
            }
            if !has_square(deviation) {
                return Err(refused(no_square(deviation)));
            }
            deviation
        }
        Noise::Covariance(entries) => {
            let covariance = setting.covariance(entries, |id| LinearForm::of(model, id, 0, leaves).constant);
            let known: Vec<usize> = (0..component).collect();
            let Conditional { weights, deviation } =
                covariance.map_err(refused)?.conditional(&known, component);
            let use_ = &factor.left[0];
            let index = use_.element.map(|element| LinearForm::of(model, element, 0, leaves).constant);
            for (earlier, weight) in weights.into_iter().enumerate() {
                let of = leaves.variable(use_, index, earlier).expect("internal: components come in order");
                let own = LinearForm { coefficients: [(of, weight)].into_iter().collect(), constant: 0.0 };
                form = form.plus(&own).plus(&LinearForm::of(model, mean, earlier, leaves).times(-weight));
            }
            deviation
        }
    };
    let mut numbers = [form.constant].into_iter().chain(form.coefficients.values().copied());
    if let Some(number) = numbers.find(|number| !number.is_finite()) {
        return Err(refused(format!("the mean is {}, but it must be a finite number", written(number))));
    }
    Ok((form, deviation))
}
