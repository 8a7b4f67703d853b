//! One instant of a normal law: extended by the variables of the instant, conditioned on the observed ones, and reduced.
//!
//! In: a program of reals whose forms are normal or Dirac. Out: a kernel from the carried law to the next one, its moments one
//! number each, so that every sum is written out and zeros of the program cost nothing. Invariant: where the means are linear
//! it is the Kalman filter; elsewhere the extended one, each tangent taken at the mean given the observations before it.

use super::law::{Observation, SymbolicLaw};
use super::moments::component_of;
use super::tangent::{Place, Tangents};
use super::{Phase, Step};
use crate::analysis::of_form;
use crate::equation::Exact;
use crate::error::Error;
use crate::ids::{Arena, FactorId, Id, ParameterId, TermId, ValueId, VariableId};
use crate::kernel::{Check, Extent, Index, InputKey, Kernel, OutputKey, Reduce, Role};
use crate::law::Arithmetic;
use crate::lower::Lowering;
use crate::model::{Ask, Environment, Factor, Finding, Model, Value, VariableUse};
use crate::operators::Binary;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The largest number of reals of an instant whose moments are written out.
const MOST_SLOTS: usize = 64;

/// A kernel of an instant, and the order of its moments.
#[derive(Clone, PartialEq, Debug)]
pub struct NormalLowered {
    /// The question of the instant.
    pub step: Step,
    /// The kernel: the means of the carried law, then its covariances, row by row up to the diagonal
    /// ([`OutputKey::Law`]); in the same order the moments of the searched variables ([`OutputKey::Moment`]).
    pub kernel: Kernel,
    /// The searched variables: elements, if it is a family, and components.
    pub searched: Vec<(VariableId, Option<usize>, usize)>,
}

/// Lowers an instant.
///
/// # Errors
/// A form that is neither normal nor Dirac, an expression that has no slope, sizes known only at run time.
pub fn lower_normal(
    model: &Model,
    ask: &Ask,
    (carried, relevant): (&[(VariableId, VariableId)], &BTreeSet<VariableId>),
    phase: Phase,
    name: &str,
) -> Result<NormalLowered, Error> {
    let carried: Vec<_> = carried.iter().copied().filter(|(_, before)| relevant.contains(before)).collect();
    let step = Step::of_normal(model, ask, &carried, phase);
    // Only the asks matter: parameters and observations are lowered as those of any question.
    let exact = Exact {
        asks: step.asks.clone(),
        terms: Arena::default(),
        joint: TermId::new(0),
        normalised: true,
        bindings: BTreeMap::new(),
        each: Vec::new(),
        searched: Vec::new(),
        ln_evidence: true,
        derivation: Vec::new(),
        cost: 0.0,
        eliminations: Vec::new(),
    };
    let mut build = Build::new(Lowering::new(&step.model, &exact, name), &step, relevant)?;
    build.begin()?;
    build.extend(relevant)?;
    let searched: Vec<VariableId> = ask.searched.iter().map(|item| item.variable).collect();
    let shapes = searched.iter().map(|id| build.shape(*id)).collect::<Result<_, _>>()?;
    let kernel = build.finish(&searched)?;
    Ok(NormalLowered { kernel, searched: shapes, step: step.clone() })
}

/// The moments of one instance of a factor: its components' means, and the covariances of their noise.
pub(super) struct Moments {
    pub(super) means: Vec<Place>,
    pub(super) noise: BTreeMap<(usize, usize), ValueId>,
}

pub(super) struct Build<'m> {
    pub(super) lowering: Lowering<'m>,
    pub(super) step: &'m Step,
    /// Holds the kernel's nodes, except while parameters and observations are lowered.
    pub(super) tangents: Tangents,
    /// The first slot of each variable.
    starts: HashMap<VariableId, usize>,
    pub(super) law: SymbolicLaw,
    ln_evidence: ValueId,
}

impl<'m> Build<'m> {
    fn new(lowering: Lowering<'m>, step: &'m Step, relevant: &BTreeSet<VariableId>) -> Result<Self, Error> {
        let mut build = Self {
            lowering,
            step,
            tangents: Tangents::default(),
            starts: HashMap::new(),
            law: SymbolicLaw::default(),
            ln_evidence: ValueId::new(0),
        };
        build.lend();
        build.ln_evidence = build.tangents.builder.constant(0.0);
        let mut count = 0;
        for id in relevant.iter().filter(|id| Some(**id) != step.model.plate_index()) {
            if step.model.variables[*id].domain.is_finite() {
                let name = step.model.variable_name(*id);
                return Err(build.refused(format!("`{name}` is finite, beside normal variables")));
            }
            let (_, elements, components) = build.shape(*id)?;
            build.starts.insert(*id, count);
            count += elements.unwrap_or(1) * components;
        }
        match count > MOST_SLOTS {
            true => Err(build.refused(format!("it has {count} reals; at most {MOST_SLOTS} are written out"))),
            false => Ok(build),
        }
    }

    pub(super) fn refused(&self, reason: impl Into<String>) -> Error {
        self.lowering.unplanned(reason)
    }

    /// Exchanges the nodes of the kernel between the tangents and the lowering.
    pub(super) fn lend(&mut self) {
        std::mem::swap(&mut self.lowering.builder, &mut self.tangents.builder);
    }

    pub(super) fn model(&self) -> &'m Model {
        &self.step.model
    }

    /// A variable, its elements, and its components.
    fn shape(&self, id: VariableId) -> Result<(VariableId, Option<usize>, usize), Error> {
        let model = self.model();
        let elements = model.variables[id].family.map(|family| model.index_count(&family.over).ok_or(()));
        let elements = elements.transpose().map_err(|()| {
            self.refused(format!(
                "the number of elements of `{}` is known only at run time",
                model.variable_name(id)
            ))
        })?;
        Ok((id, elements, model.components(id)))
    }

    fn slots(&self, id: VariableId) -> Result<std::ops::Range<usize>, Error> {
        let (_, elements, components) = self.shape(id)?;
        let start = self.starts[&id];
        Ok(start..start + elements.unwrap_or(1) * components)
    }

    /// The slots of X or of X^-1, in the order of the carried law.
    fn carried(&self, of: impl Fn(&(VariableId, VariableId)) -> VariableId) -> Result<Vec<usize>, Error> {
        let slots = self.step.carried.iter().map(|pair| Ok(self.slots(of(pair))?.collect::<Vec<usize>>()));
        Ok(slots.collect::<Result<Vec<_>, Error>>()?.concat())
    }

    /// The law of X^-1.
    fn begin(&mut self) -> Result<(), Error> {
        let slots = self.carried(|(_, before)| *before)?;
        if self.step.phase == Phase::First {
            // At rest, if it has no form.
            for (_, before) in &self.step.carried {
                if self.model().factor_of(*before).is_none() {
                    let zero = self.tangents.builder.constant(0.0);
                    let slots = self.slots(*before)?;
                    for slot in slots {
                        self.law.means.insert(slot, zero);
                    }
                }
            }
            return Ok(());
        }
        for (row, slot) in slots.iter().enumerate() {
            let mean = self.read(InputKey::Law(row));
            self.law.means.insert(*slot, mean);
        }
        let mut place = slots.len();
        for (row, slot) in slots.iter().enumerate() {
            for other in &slots[..=row] {
                let covariance = self.read(InputKey::Law(place));
                self.law.set(*slot, *other, covariance);
                place += 1;
            }
        }
        Ok(())
    }

    /// A number of the carried law.
    fn read(&mut self, key: InputKey) -> ValueId {
        self.lend();
        let axes = self.lowering.plate.clone();
        let buffer = self.lowering.input(key, None, &axes);
        let indices = axes.iter().map(|axis| Index::Axis(*axis)).collect();
        let value = self.lowering.builder.load(buffer, indices);
        self.lend();
        value
    }

    /// Adds the variables of the instant, parents first; each observation is taken at once.
    fn extend(&mut self, relevant: &BTreeSet<VariableId>) -> Result<(), Error> {
        let model = self.model();
        let is_before = |id: VariableId| model.variables[id].previous_of.is_some();
        let mut factors: Vec<FactorId> = model.factors.ids().collect();
        factors.retain(|id| {
            let left = model.factors[*id].left[0].variable;
            relevant.contains(&left) && (self.step.phase == Phase::First || !is_before(left))
        });
        let factors = model.parents_first(&factors);
        let kept = self.step.asks.iter().flat_map(|ask| &ask.searched).map(|item| item.variable);
        let kept: BTreeSet<VariableId> = kept.chain(self.step.carried.iter().map(|(now, _)| *now)).collect();
        for (place, id) in factors.iter().enumerate() {
            let factor = &model.factors[*id];
            for indices in self.instances(factor)? {
                let index = |index: f64| self.tangents.builder.constant(index);
                self.lowering.products = indices.into_iter().map(index).collect();
                self.instance(factor)?;
            }
            let later = factors[place + 1..].iter().flat_map(|id| of_form(model, *id));
            let mut needed = BTreeSet::new();
            for id in later.chain(kept.iter().copied()).filter(|id| relevant.contains(id)) {
                needed.extend(self.slots(id)?);
            }
            self.law.keep(&needed);
        }
        match &self.tangents.without_slope {
            Some(operator) => Err(self.refused(format!("the derivative of {operator} has no kernel"))),
            None => Ok(()),
        }
    }

    /// The indices of the instances of a factor under `prod`s.
    fn instances(&self, factor: &Factor) -> Result<Vec<Vec<f64>>, Error> {
        let mut all = vec![Vec::new()];
        for (name, over) in &factor.products {
            let count = self.model().index_count(over).ok_or_else(|| {
                self.refused(format!("the number of values of `{name}` is known only at run time"))
            })?;
            let values = |before: Vec<f64>| {
                (0..count).map(move |place| {
                    let index = over.first() as f64 + place as f64;
                    before.iter().copied().chain([index]).collect()
                })
            };
            all = all.into_iter().flat_map(values).collect();
        }
        Ok(all)
    }

    /// One instance of a factor: its variable is added, and conditioned where it is observed.
    fn instance(&mut self, factor: &Factor) -> Result<(), Error> {
        let [left] = factor.left.as_slice() else {
            return Err(self.refused("a factor distributes several variables"));
        };
        let Moments { means, noise } = self.moments(&factor.form, self.model().components(left.variable))?;
        let components = self.model().components(left.variable);
        let first = self.slot(left, 0)?;
        for component in 0..components {
            let mean = self.tangents.of(component_of(&means, component)).clone();
            self.law.extend(&mut self.tangents.builder, first + component, mean.value, &mean.slopes);
        }
        for ((one, other), more) in noise {
            self.law.add(&mut self.tangents.builder, first + one, first + other, more);
        }
        for component in 0..components {
            let Some((value, given)) = self.observed(left, component)? else { continue };
            let seen = Observation { slot: first + component, value, given };
            let ln = self.law.observe(&mut self.tangents.builder, &seen).ok_or_else(|| {
                let name = self.model().variable_name(left.variable);
                self.refused(format!("`{name}` is observed, but the program determines it"))
            })?;
            self.ln_evidence = self.tangents.builder.binary(Binary::Add, self.ln_evidence, ln);
        }
        Ok(())
    }

    /// The value of an observed slot, and whether it is given.
    fn observed(
        &mut self,
        left: &VariableUse,
        component: usize,
    ) -> Result<Option<(ValueId, Option<ValueId>)>, Error> {
        let ask = &self.step.asks[0];
        let Some(known) = ask.known.iter().find(|known| known.variable == left.variable) else {
            return Ok(None);
        };
        let name = match &known.evidence {
            Finding::Hard(Value::Real(number)) => {
                return Ok(Some((self.tangents.builder.constant(*number), None)));
            }
            Finding::Hard(Value::Vector(numbers)) => {
                return Ok(Some((self.tangents.builder.constant(numbers[component]), None)));
            }
            Finding::Hard(Value::Given(name)) => name.clone(),
            _ => return Err(self.refused("evidence on a real is a value")),
        };
        let (_, elements, components) = self.shape(left.variable)?;
        let place = self.slot(left, component)? - self.starts[&left.variable];
        let given =
            self.step.absent.iter().find(|(variable, _)| *variable == left.variable).map(|(_, flag)| *flag);
        self.lend();
        let (mut axes, mut indices) = (Vec::new(), Vec::new());
        if elements.is_some() || components > 1 {
            let key = InputKey::Value(left.variable, name.clone());
            let known = self.lowering.builder.so_far().input(&key);
            let count = Extent::constant(elements.unwrap_or(1) * components);
            axes = self.lowering.input_axes(known, &mut |lowering| vec![lowering.builder.axis(&name, count)]);
            let place = self.lowering.builder.constant(place as f64);
            indices.push(self.lowering.builder.at(place));
        }
        indices.extend(self.lowering.plate.iter().map(|axis| Index::Axis(*axis)));
        axes.extend(&self.lowering.plate);
        let buffer = self.lowering.given_buffer(left.variable, &name, &axes);
        let value = self.lowering.builder.load(buffer, indices);
        let given = given.map(|flag: ParameterId| self.lowering.parameter(flag, &[])).transpose();
        self.lend();
        Ok(Some((value, given?)))
    }

    /// The slot of a component of a variable, or of an element of a family.
    pub(super) fn slot(&mut self, use_: &VariableUse, component: usize) -> Result<usize, Error> {
        let element = match use_.element {
            None => 0,
            Some(element) => {
                let index = self.expression(element)?;
                let family = self.model().variables[use_.variable].family;
                let first = family.map_or(0, |family| family.over.first());
                match self.tangents.known(component_of(&index, 0)) {
                    Some(index) if index >= first as f64 => (index - first as f64) as usize,
                    _ => return Err(self.refused("an element of a family is named by a variable")),
                }
            }
        };
        let (_, elements, components) = self.shape(use_.variable)?;
        let start = self.starts.get(&use_.variable).copied().filter(|_| element < elements.unwrap_or(1));
        start.map(|start| start + element * components + component).ok_or_else(|| {
            let name = self.model().variable_name(use_.variable);
            self.refused(format!("`{name}` is not among the reals of the instant"))
        })
    }

    /// The kernel: the next law, the moments of the searched variables, and ln P(evidence).
    fn finish(mut self, searched: &[VariableId]) -> Result<Kernel, Error> {
        let carried = self.carried(|(now, _)| *now)?;
        let asked = searched.iter().map(|id| Ok(self.slots(*id)?.collect::<Vec<usize>>()));
        let asked: Vec<usize> = asked.collect::<Result<Vec<_>, Error>>()?.concat();
        let axes = self.lowering.plate.clone();
        let zero = self.tangents.builder.constant(0.0);
        let mut sum = self.ln_evidence;
        let mut outputs = vec![(OutputKey::LnEvidence, self.ln_evidence)];
        for (slots, is_law) in [(&carried, true), (&asked, false)] {
            let means = slots.iter().map(|slot| self.law.means[slot]);
            let covariances = slots.iter().enumerate().flat_map(|(row, slot)| {
                slots[..=row].iter().map(|other| self.law.covariance(*slot, *other).unwrap_or(zero))
            });
            let all: Vec<ValueId> = means.chain(covariances).collect();
            for (place, value) in all.into_iter().enumerate() {
                let key = if is_law { OutputKey::Law(place) } else { OutputKey::Moment(place) };
                outputs.push((key, value));
                sum = self.tangents.builder.binary(Binary::Add, sum, value);
            }
        }
        self.lend();
        for (key, value) in outputs {
            let name = match key {
                OutputKey::LnEvidence => "ln_evidence".to_owned(),
                OutputKey::Law(place) => format!("next law {place}"),
                _ => format!("{} {}", self.lowering.model.ask_text(&self.step.asks[0]), key_place(key)),
            };
            let out = self.lowering.builder.buffer(&name, Role::Output(key), &axes);
            self.lowering.builder.nest(out, Reduce::None, value);
        }
        // NaN in any moment is NaN in their sum.
        let checked = self.lowering.builder.made("sum of the moments", &axes, Reduce::None, sum);
        self.lowering.builder.check_buffer(checked, Check::Number);
        let kernel = self.lowering.finish();
        Ok(kernel.validated())
    }
}

fn key_place(key: OutputKey) -> usize {
    match key {
        OutputKey::Ask(place) | OutputKey::Law(place) | OutputKey::Moment(place) => place,
        OutputKey::LnEvidence | OutputKey::Total => 0,
    }
}
