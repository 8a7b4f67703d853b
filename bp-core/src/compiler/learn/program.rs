//! A program to be learned, with known sizes: its slots and the families of its factors.
//!
//! In: a model and its inputs (sizes, known parameters). Out: a [`Program`]. Invariant: every parameter has a number
//! for each element; a slot is one number of a case, a family is a factor for one value of the indices around it, and
//! families come parents first.

use super::parametric::{MOST_CONTEXTS, Unknowns, parametric};
use crate::distribution::{Instance, Setting};
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::{ExpressionId, FactorId, ParameterId, VariableId};
use crate::model::{
    Domain, Expression, Factor, Form, IndexSpace, Model, ParameterKind, SetKind, VariableUse,
};
use std::collections::HashSet;

/// One number of a case: a variable, or an element of a family of variables.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Slot {
    pub(super) variable: VariableId,
    /// Its name: `X`, `L[2]`.
    pub(super) name: String,
    /// Its number of values; `None` for reals.
    pub(super) count: Option<usize>,
}

/// A factor for one value of the indices around it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Family {
    pub(super) instance: Instance,
    /// The slots that it distributes or reads, ascending.
    pub(super) slots: Vec<usize>,
    /// Whether it has learned numbers.
    pub(super) learned: bool,
}

/// A parametric model with sizes and numbers.
#[derive(Clone, Debug)]
pub(super) struct Program {
    pub(super) model: Model,
    /// The sizes; numbers are the defaults of the model's parameters.
    inputs: Inputs<'static, f64>,
    pub(super) unknowns: Unknowns,
    pub(super) slots: Vec<Slot>,
    pub(super) families: Vec<Family>,
    /// The factors with learned numbers.
    pub(super) factors: Vec<FactorId>,
    /// Parameters of `identification` with a default.
    pub(super) declared: HashSet<ParameterId>,
}

impl Program {
    pub(super) fn new(model: &Model, given: &Inputs<'_, f64>) -> Result<Self, Error> {
        let mut model = model.clone();
        let mut inputs = Inputs::new();
        for set in model.sets.values() {
            if matches!(set.kind, SetKind::Displacements(_)) {
                let message = "a program with displacements on a grid cannot be learned";
                return Err(Error::input(&set.name, message));
            }
            if let Some(size) = set_size(&set.name, given) {
                inputs = inputs.size(&set.name, size);
            }
        }
        let ids: Vec<ParameterId> = model.parameters.ids().collect();
        for id in &ids {
            let parameter = &mut model.parameters[*id];
            let size = given.find_size(&parameter.name).filter(|_| parameter.kind == ParameterKind::Size);
            if let Some(numbers) = given.find(&parameter.name) {
                parameter.default = numbers.to_vec();
            } else if let Some(size) = size {
                parameter.default = vec![size as f64];
            }
        }
        let unknowns = parametric(&mut model)?;
        let mut declared = HashSet::new();
        for id in unknowns.parameters.keys() {
            let parameter = &mut model.parameters[*id];
            match (parameter.default.is_empty(), unknowns.parameters[id]) {
                (true, _) if parameter.kind == ParameterKind::Probability => parameter.default = vec![0.5],
                (true, _) => parameter.default = vec![1.0],
                (false, None) => {
                    declared.insert(*id);
                }
                (false, Some(_)) => {}
            }
        }
        let mut program = Self {
            model,
            inputs,
            unknowns,
            slots: Vec::new(),
            families: Vec::new(),
            factors: Vec::new(),
            declared,
        };
        program.lay_out()?;
        if program.factors.is_empty() {
            let message =
                "there is nothing to learn: no form is `unknown`, and `identification` names no parameter";
            return Err(Error::input(&program.model.name, message));
        }
        Ok(program)
    }

    /// Finds slots and families, and initialises each element of the learned parameters.
    fn lay_out(&mut self) -> Result<(), Error> {
        let factors: Vec<FactorId> =
            self.model.factors.ids().filter(|id| self.is_learned(&self.model.factors[*id].form)).collect();
        let setting = self.setting()?;
        let slots = (0..setting.slots()).map(|slot| {
            let variable = setting.variable_of(slot);
            let meant = &self.model.variables[variable];
            let name = match meant.family {
                // A family with one element has an index too.
                Some(family) if setting.slots_of(variable).len() == 1 => {
                    format!("{}[{}]", self.model.variable_name(variable), family.over.first())
                }
                _ => setting.slot_name(slot),
            };
            Slot { variable, name, count: meant.domain.is_finite().then(|| setting.count(variable)) }
        });
        let slots: Vec<Slot> = slots.collect();
        let mut families = Vec::new();
        for instance in setting.ordered()? {
            let mut all = setting.reads(&instance);
            all.extend(&instance.left);
            let learned = factors.contains(&instance.factor);
            families.push(Family { slots: all.into_iter().collect(), learned, instance });
        }
        let mut places = Vec::new();
        for id in self.unknowns.parameters.keys() {
            let parameter = &self.model.parameters[*id];
            let lengths: Vec<usize> =
                parameter.over.iter().map(|over| setting.length(over)).collect::<Result<_, Error>>()?;
            let (cells, most) =
                (lengths.iter().map(|length| *length as f64).product::<f64>(), MOST_CONTEXTS as f64);
            if cells > most {
                let name = parameter.name.clone();
                let help = format!("the largest index in the data, or `{}`, gives its length", Advice::Set);
                return Err(Error::TooLarge { name, cells, most, help });
            }
            places.push((*id, lengths.iter().product()));
        }
        (self.slots, self.families, self.factors) = (slots, families, factors);
        for (id, count) in places {
            let default = &mut self.model.parameters[id].default;
            if default.len() != count {
                *default = vec![default[0]; count];
            }
        }
        Ok(())
    }

    /// The model with the current numbers.
    pub(super) fn setting(&self) -> Result<Setting<'_>, Error> {
        Setting::new(&self.model, &self.inputs)
    }

    /// The size of this name, if it is known.
    pub(super) fn size(&self, name: &str) -> Option<usize> {
        let parameter = self.model.parameters.values().find(|parameter| parameter.name == name);
        let number = parameter.and_then(|parameter| parameter.default_number());
        self.inputs.find_size(name).or(number.map(|number| number as usize))
    }

    /// The slot of the index over which the whole program is repeated.
    pub(super) fn plate_slot(&self) -> Option<usize> {
        let index = self.model.plate_index()?;
        self.slots.iter().position(|slot| slot.variable == index)
    }

    /// The slot of this name: `X`, `L[2]`.
    pub(super) fn slot(&self, name: &str) -> Option<usize> {
        self.slots.iter().position(|slot| slot.name == name)
    }

    /// The slot of a single variable; none for a family.
    pub(super) fn only_slot(&self, variable: VariableId) -> Option<usize> {
        let own = self.slots.iter().position(|slot| slot.variable == variable)?;
        self.slots.get(own + 1).is_none_or(|next| next.variable != variable).then_some(own)
    }

    /// The slot of a family's element with this index.
    pub(super) fn element_slot(&self, family: VariableId, index: i64) -> Option<usize> {
        let own = self.slots.partition_point(|slot| slot.variable < family);
        let slot = own + usize::try_from(index - self.model.variables[family].family?.over.first()).ok()?;
        self.slots.get(slot).is_some_and(|slot| slot.variable == family).then_some(slot)
    }

    /// The ordinal of a number in a slot of a finite variable, the number itself for a real; `None` if it is not a
    /// value.
    pub(super) fn value(&self, slot: usize, number: f64) -> Option<f64> {
        let Slot { variable, count, .. } = &self.slots[slot];
        match (&self.model.variables[*variable].domain, count) {
            (Domain::Bins(bins), _) => bins.holding(number).map(|bin| bin as f64),
            (domain, Some(count)) => {
                let ordinal = number - domain.base() as f64;
                let inside = ordinal.fract() == 0.0 && ordinal >= 0.0 && ordinal < *count as f64;
                inside.then_some(ordinal)
            }
            (_, None) => number.is_finite().then_some(number),
        }
    }

    /// The number of a value of a slot in an expression.
    pub(super) fn number(&self, slot: usize, value: f64) -> f64 {
        match &self.model.variables[self.slots[slot].variable].domain {
            domain if domain.is_finite() => domain.number(value as usize),
            _ => value,
        }
    }

    /// The value of a slot in the notation of the language.
    pub(super) fn spelled(&self, slot: usize, value: f64) -> String {
        match &self.model.variables[self.slots[slot].variable].domain {
            domain if domain.is_finite() => domain.value_spelled(value as usize),
            _ => crate::spelling::number(value),
        }
    }

    /// The name of a factor.
    pub(super) fn head(&self, factor: FactorId) -> String {
        self.model.head(&self.model.factors[factor])
    }

    pub(super) fn wrong(&self, factor: FactorId, message: impl Into<String>) -> Error {
        Error::input(self.head(factor), message)
    }

    /// Whether an expression contains learned numbers.
    pub(super) fn mentions(&self, id: ExpressionId) -> bool {
        let is_learned = |id: ExpressionId| {
            self.unknowns.entries.contains_key(&id)
                || matches!(&self.model.expressions[id], Expression::Parameter { parameter, .. }
                    if self.unknowns.parameters.contains_key(parameter))
        };
        self.model.nodes_below(id).into_iter().any(is_learned)
    }

    /// How many components of a vector share the distributions of an `unknown` form.
    pub(super) fn components(&self, factor: FactorId) -> usize {
        match self.unknowns.list.iter().any(|unknown| unknown.factor == factor) {
            true => self.model.components(self.model.factors[factor].left[0].variable),
            false => 1,
        }
    }

    /// The indices, with more than one value, whose values share the distributions of an `unknown` form.
    pub(super) fn shared(&self, factor: FactorId) -> Vec<(String, usize)> {
        let Factor { form, products, .. } = &self.model.factors[factor];
        if !self.unknowns.list.iter().any(|unknown| unknown.factor == factor) {
            return Vec::new();
        }
        let reads = |wanted: Expression| {
            let mut found = false;
            form.each_expression(&mut |id| {
                let nodes = self.model.nodes_below(id);
                found = found || nodes.into_iter().any(|node| self.model.expressions[node] == wanted);
            });
            found
        };
        let Ok(setting) = self.setting() else { return Vec::new() };
        let products = products
            .iter()
            .enumerate()
            .map(|(depth, (name, over))| (name.clone(), *over, Expression::Index(depth)));
        let plate = self.model.plate.map(|plate| {
            let index = Expression::Variable(VariableUse::from(plate.index));
            (self.model.variable_name(plate.index), IndexSpace::Set(plate.set), index)
        });
        (products.chain(plate))
            .filter(|(.., index)| !reads(index.clone()))
            .filter_map(|(name, over, _)| Some((name, setting.length(&over).ok()?)))
            .filter(|(_, length)| *length > 1)
            .collect()
    }

    /// Whether a form contains learned numbers.
    pub(super) fn is_learned(&self, form: &Form) -> bool {
        let mut found = false;
        form.each_expression(&mut |id| found = found || self.mentions(id));
        found
    }
}

/// The number of given elements of a set.
pub(super) fn set_size(name: &str, given: &Inputs<'_, f64>) -> Option<usize> {
    given.find_size(name).or_else(|| {
        let extent = |part| given.find_size(&format!("{name}.{part}"));
        Some(extent("depth")? * extent("rows")? * extent("lanes")?)
    })
}
