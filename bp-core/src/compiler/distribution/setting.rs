//! A model with numbers: parameters, sizes, and a slot for each value.
//!
//! In: a model and the host's inputs. Out: a [`Setting`], and the [`Instance`]s of its factors, parents first.
//! Invariant: every parameter has a number and every domain a count; a family under a `prod` has one instance for each
//! element, a vector one for each component.

use crate::error::Error;
use crate::exec::{Inputs, SIZE_NOT_GIVEN};
use crate::ids::{ExpressionId, FactorId, Id, ParameterId, SetId, VariableId};
use crate::law::Covariance;
use crate::model::{
    Arms, Bound, Domain, Expression, IndexSpace, Model, Parameter, ParameterKind, Variable, VariableUse,
};
use crate::spelling::number as written;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::OnceLock;

/// Upper limit on the slots: variables, elements of families and components of vectors together.
const MOST_SLOTS: usize = 1 << 25;

/// A model with numbers for its parameters.
#[derive(Clone, Debug)]
pub struct Setting<'m> {
    /// The model.
    pub model: &'m Model,
    pub(super) inputs: &'m Inputs<'m, f64>,
    pub(super) parameters: Vec<Vec<f64>>,
    sets: Vec<Option<usize>>,
    /// The first slot of each variable; last, the number of slots.
    offsets: Vec<usize>,
    counts: Vec<usize>,
    /// The arms of long `match`es, once an expression was too long to be walked.
    matches: OnceLock<HashMap<ExpressionId, Arms>>,
    /// For each factor, whether it compares determined reals in a question.
    compared: OnceLock<Vec<bool>>,
    /// Over time: whether this is the first instant.
    pub(super) first: Option<bool>,
}

/// One factor, for one value of the surrounding indices and one component of a vector.
#[derive(Clone, PartialEq, Debug)]
pub struct Instance {
    /// The factor.
    pub factor: FactorId,
    /// The indices of the surrounding `prod`s, outermost first.
    pub indices: Vec<f64>,
    /// The component of a vector.
    pub component: usize,
    /// The slots that it distributes.
    pub left: Vec<usize>,
}

impl<'m> Setting<'m> {
    /// A model with the host's inputs.
    ///
    /// # Errors
    /// A parameter or a size that is missing, or has another number of entries.
    pub fn new(model: &'m Model, inputs: &'m Inputs<'m, f64>) -> Result<Self, Error> {
        let sets: Vec<Option<usize>> = (model.sets.values())
            .map(|set| {
                inputs.find_size(&set.name).or_else(|| {
                    let extent = |part| inputs.find_size(&format!("{}.{part}", set.name));
                    Some(extent("depth")?.saturating_mul(extent("rows")?).saturating_mul(extent("lanes")?))
                })
            })
            .collect();
        let mut setting = Self {
            model,
            inputs,
            parameters: Vec::new(),
            sets,
            offsets: vec![0],
            counts: Vec::new(),
            matches: OnceLock::new(),
            compared: OnceLock::new(),
            first: None,
        };
        for (id, parameter) in model.parameters.iter() {
            let name = &parameter.name;
            let size = inputs.find_size(name).map(|size| vec![size as f64]);
            let given = inputs.find(name).map(<[f64]>::to_vec).or(size).unwrap_or(parameter.default.clone());
            if given.is_empty() {
                match is_used(model, id) {
                    true => return Err(Error::input(name, not_given(model, parameter))),
                    false => {
                        setting.parameters.push(vec![0.0]);
                        continue;
                    }
                }
            }
            if let Some((value, expected)) =
                given.iter().find_map(|value| Some((value, parameter.kind.refuses(*value)?)))
            {
                return Err(Error::input(
                    name,
                    format!("it is {}, but it must be {expected}", written(*value)),
                ));
            }
            setting.parameters.push(given);
        }
        for (parameter, declared) in model.parameters.iter() {
            if let ParameterKind::Element(set) = declared.kind {
                let size = setting.set_size(set)?;
                let numbers = &setting.parameters[parameter.position()];
                if let Some(number) = numbers.iter().find(|number| **number >= size as f64) {
                    let (number, set) = (written(*number), &model.sets[set].name);
                    let message = format!(
                        "{number} is not an element of `{set}`: its {size} elements are counted from 0"
                    );
                    return Err(Error::input(&declared.name, message));
                }
            }
            let over = &model.parameters[parameter].over;
            let places = over.iter().map(|over| setting.length(over)).product::<Result<usize, Error>>()?;
            let found = setting.parameters[parameter.position()].len();
            if found != 1 && found != places {
                let message = format!("{found} numbers were given, but {places} are expected");
                return Err(Error::input(&model.parameters[parameter].name, message));
            }
        }
        for (id, variable) in model.variables.iter() {
            let count = match &variable.domain {
                Domain::Set(set) if Some(id) == model.plate_index() => {
                    setting.sets[set.position()].unwrap_or(1)
                }
                Domain::Set(set) => setting.set_size(*set)?,
                Domain::Finite { labels, range: Some(range) } => {
                    labels.len()
                        + usize::try_from(
                            setting.bound(range.high).saturating_add(1).saturating_sub(range.low),
                        )
                        .unwrap_or(0)
                }
                domain => domain.count().unwrap_or(0),
            };
            if count == 0 && variable.domain.is_finite() {
                return Err(Error::input(model.variable_name(id), "its domain has no value"));
            }
            let family = variable.family.map_or(Ok(1), |family| setting.length(&family.over))?;
            let components = model.components(id);
            setting.counts.push(count);
            let slots = family.saturating_mul(components).saturating_add(setting.offsets[id.position()]);
            if slots > MOST_SLOTS {
                return Err(Error::TooLarge {
                    name: model.variable_name(id),
                    cells: family as f64 * components as f64,
                    most: MOST_SLOTS as f64,
                    help: "its elements are variables of their own here: make the family shorter".to_owned(),
                });
            }
            setting.offsets.push(slots);
        }
        Ok(setting)
    }

    /// The same at the first instant, or at a later one.
    pub fn at(&self, first: bool) -> Self {
        Self { first: Some(first), ..self.clone() }
    }

    /// As [`Model::compares_determined`].
    pub(super) fn compares_determined(&self, factor: FactorId) -> bool {
        let of = |factor| self.model.compares_determined(factor);
        self.compared.get_or_init(|| self.model.factors.values().map(of).collect())[factor.position()]
    }

    /// The host's inputs.
    pub fn inputs(&self) -> &Inputs<'m, f64> {
        self.inputs
    }

    /// The host's input with a name.
    pub fn given(&self, name: &str) -> Option<&[f64]> {
        self.inputs.find(name)
    }

    /// A covariance matrix, whose entries `number` computes.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn covariance(
        &self,
        entries: &[Vec<ExpressionId>],
        number: impl Fn(ExpressionId) -> f64,
    ) -> Result<Covariance, String> {
        let size = entries.len();
        if let Expression::Parameter { parameter, .. } = &self.model.expressions[entries[0][0]]
            && self.parameters[parameter.position()].len() < size * size
            && self.model.parameters[*parameter].over.len() == 2
        {
            let name = &self.model.parameters[*parameter].name;
            return Err(format!(
                "`{name}` is given one number, but the covariance matrix of {size} components has {} entries",
                size * size
            ));
        }
        Covariance::new(entries.iter().map(|row| row.iter().map(|id| number(*id)).collect()).collect())
    }

    /// A parameter that is one number.
    pub fn number(&self, name: &str) -> Option<f64> {
        let id = self.model.parameters.find(|parameter| parameter.name == name)?;
        match self.parameters[id.position()].as_slice() {
            [number] => Some(*number),
            _ => None,
        }
    }

    /// The number of slots of an assignment.
    pub fn slots(&self) -> usize {
        self.offsets[self.offsets.len() - 1]
    }

    /// The slots of a variable: all elements of a family, all components of a vector.
    pub fn slots_of(&self, variable: VariableId) -> Range<usize> {
        self.offsets[variable.position()]..self.offsets[variable.position() + 1]
    }

    /// The variable of a slot.
    pub fn variable_of(&self, slot: usize) -> VariableId {
        VariableId::new(self.offsets.partition_point(|offset| *offset <= slot) - 1)
    }

    /// The name of a slot: `X`, `Z[2]`.
    pub fn slot_name(&self, slot: usize) -> String {
        let variable = self.variable_of(slot);
        let slots = self.slots_of(variable);
        let family = self.model.variables[variable].family;
        // A family of one element is still indexed.
        if family.is_none() && slots.len() == 1 {
            return self.model.variable_name(variable);
        }
        let low = match family.map(|family| family.over) {
            Some(IndexSpace::Range(range)) => range.low,
            _ => 0,
        };
        self.model.element_name(variable, (slot - slots.start) as i64 + low)
    }

    /// The number of values of a finite variable.
    pub fn count(&self, variable: VariableId) -> usize {
        self.counts[variable.position()]
    }

    /// The number of components of a variable's value.
    pub(super) fn components(&self, variable: VariableId) -> usize {
        self.model.components(variable)
    }

    /// The arms of a long `match` that begins here, if they have been found.
    pub(super) fn arms(&self, id: ExpressionId) -> Option<&Arms> {
        self.matches.get()?.get(&id)
    }

    /// Finds the arms of all long `match`es; returns whether there are any.
    pub(super) fn find_arms(&self) -> bool {
        let found = self.matches.get_or_init(|| {
            let (mut found, mut inside) = (HashMap::new(), HashSet::new());
            let ids: Vec<ExpressionId> = self.model.expressions.ids().collect();
            for id in ids.into_iter().rev() {
                if inside.contains(&id) {
                    continue;
                }
                let mut rest = id;
                while let Some(next) = self.model.after_arm(rest).filter(|next| inside.insert(*next)) {
                    rest = next;
                }
                found.extend(self.model.arms(id, |_| true).map(|arms| (id, arms)));
            }
            found
        });
        !found.is_empty()
    }

    fn bound(&self, bound: Bound) -> i64 {
        let size = bound.size.map_or(0, |size: ParameterId| self.parameters[size.position()][0] as i64);
        size.saturating_add(bound.offset)
    }

    fn set_size(&self, set: SetId) -> Result<usize, Error> {
        self.sets[set.position()].ok_or_else(|| {
            let name = &self.model.sets[set].name;
            Error::input(name, SIZE_NOT_GIVEN)
        })
    }

    /// The number of elements of an index space.
    pub fn length(&self, over: &IndexSpace) -> Result<usize, Error> {
        match over {
            IndexSpace::Set(set) => self.set_size(*set),
            IndexSpace::Range(range) => {
                let count = self.bound(range.high).saturating_add(1).saturating_sub(range.low);
                Ok(usize::try_from(count).unwrap_or(0))
            }
        }
    }

    /// The instances of a factor.
    ///
    /// # Errors
    /// A size that is missing.
    pub fn instances(&self, id: FactorId) -> Result<Vec<Instance>, Error> {
        let factor = &self.model.factors[id];
        let mut all: Vec<Vec<f64>> = vec![Vec::new()];
        for (_, over) in &factor.products {
            let low = match over {
                IndexSpace::Range(range) => range.low,
                IndexSpace::Set(_) => 0,
            };
            let count = self.length(over)?;
            let each = |indices: &Vec<f64>| {
                (0..count)
                    .map(|position| {
                        let mut indices = indices.clone();
                        indices.push((low + position as i64) as f64);
                        indices
                    })
                    .collect::<Vec<_>>()
            };
            all = all.iter().flat_map(each).collect();
        }
        let components = factor.left.iter().map(|left| self.components(left.variable)).max().unwrap_or(1);
        let mut instances = Vec::new();
        for indices in all {
            for component in 0..components {
                let left = |use_: &VariableUse| self.left_slot(use_, &indices, component);
                let left = factor.left.iter().map(left).collect::<Option<Vec<usize>>>();
                // A family without an index under its `prod` would be distributed as one value.
                let left = left.ok_or_else(|| {
                    let head = self.model.head(factor);
                    Error::Unplanned {
                        question: self.model.name.clone(),
                        reason: format!("`{head}` distributes a whole family as one value, not one element"),
                    }
                })?;
                instances.push(Instance { factor: id, indices: indices.clone(), component, left });
            }
        }
        Ok(instances)
    }

    fn left_slot(&self, use_: &VariableUse, indices: &[f64], component: usize) -> Option<usize> {
        let slots = self.slots_of(use_.variable);
        let components = self.components(use_.variable);
        let element = match use_.element {
            None if slots.len() != components => return None,
            None => 0,
            Some(element) => self.element(use_.variable, self.index_number(element, indices))?,
        };
        let slot = slots.start + element * components + component.min(components - 1);
        slots.contains(&slot).then_some(slot)
    }

    /// The instances of all factors, parents first.
    ///
    /// # Errors
    /// As [`Setting::instances`].
    pub fn ordered(&self) -> Result<Vec<Instance>, Error> {
        let factors: Vec<FactorId> = self.model.factors.ids().collect();
        self.in_order(&self.model.parents_first(&factors))
    }
}

/// Whether a number of a parameter is read: in an expression, or as the size of a domain or of an index.
fn is_used(model: &Model, id: ParameterId) -> bool {
    let read = |it: &Expression| matches!(it, Expression::Parameter { parameter, .. } if *parameter == id);
    let over = |over: &IndexSpace| matches!(over, IndexSpace::Range(range) if range.high.size == Some(id));
    let variable = |it: &Variable| {
        matches!(&it.domain, Domain::Finite { range: Some(range), .. } if range.high.size == Some(id))
            || it.family.is_some_and(|family| over(&family.over))
    };
    model.expressions.values().any(read)
        || model.variables.values().any(variable)
        || model.parameters.values().any(|it| it.over.iter().any(over))
        || model.factors.values().any(|it| it.products.iter().any(|(_, space)| over(space)))
}

/// The error of a parameter without numbers.
fn not_given(model: &Model, parameter: &Parameter) -> String {
    let set = parameter.over.iter().find_map(|over| match over {
        IndexSpace::Set(set) => Some(&model.sets[*set].name),
        IndexSpace::Range(_) => None,
    });
    match set {
        Some(set) => format!(
            "it was not given: it has a number for each element of `{set}`; give them, or a table with a row for each element"
        ),
        None => "this parameter was not given, and it has no default".to_owned(),
    }
}
