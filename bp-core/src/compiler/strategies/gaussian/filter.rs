//! Linear-Gaussian programs with numbers: a Kalman filter over time, or one conditioning.
//!
//! In: a [`Gaussian`] plan, numbers for the parameters, observations at each instant. Out: a normal [`Belief`] about
//! the searched variables. Invariant: the joint law over all variables of an instant is built slot by slot (elements of
//! families and components of vectors) and conditioned on one observation after the other; only the carried variables
//! are kept for the next instant.

use super::equations::{Equations, NEEDED};
use super::{Gaussian, LinearEquation, Noise, NormalLaw};
use crate::distribution::Setting;
use crate::error::{Error, Impossible};
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Ask, Model};
use crate::strategies::over_time::Instant;
use nalgebra::{DMatrix, DVector};
use std::collections::{HashMap, HashSet};

/// A normal law of named variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Belief {
    /// Names, in the order of the question.
    pub variables: Vec<String>,
    /// Means.
    pub mean: DVector<f64>,
    /// Covariances.
    pub covariance: DMatrix<f64>,
    /// ln of the density of the observations, given the past.
    pub ln_evidence: f64,
    /// The law, in factored form.
    pub(crate) law: NormalLaw,
}

impl Belief {
    /// The belief that a law represents.
    pub(super) fn of(variables: Vec<String>, law: NormalLaw, ln_evidence: f64) -> Self {
        Self { variables, mean: law.means(), covariance: law.covariance(), ln_evidence, law }
    }

    /// Mean of one variable.
    pub fn mean_of(&self, name: &str) -> Option<f64> {
        self.variables.iter().position(|variable| variable == name).map(|row| self.mean[row])
    }
}

/// One slot: its mean as a linear form of earlier rows, and the standard deviation of its own noise; infinite for a flat one.
#[derive(Clone, Debug, Default)]
pub(super) struct Extension {
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) constant: f64,
    pub(super) deviation: f64,
}

/// The rows of an instant: first those of X^-1, then those of the extensions.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub(super) extensions: Vec<Extension>,
    /// The row of each slot.
    pub(super) rows: HashMap<usize, usize>,
}

/// A linear and Gaussian program with numbers for its parameters; over time, a Kalman filter.
#[derive(Clone, Debug)]
pub struct Filter {
    question: String,
    /// Names and slots of the searched variables, and of those that may be observed.
    pub(super) searched: Vec<(String, usize)>,
    observed: Vec<(String, usize)>,
    /// The slots of X, whose law becomes that of X^-1.
    carried: Vec<usize>,
    /// The next instant, where it differs from the later ones: the first one with forms of its own, or tangents.
    next: Option<Layout>,
    later: Layout,
    /// The law of the carried variables, its rows in the order of `carried`.
    pub(super) law: NormalLaw,
}

/// Upper limit on the instants that [`Filter::settle`] tries.
const MOST_INSTANTS: usize = 1_000_000;

impl Filter {
    /// A filter before its first instant; a carried variable without an initial form is 0 with certainty.
    ///
    /// # Errors
    /// A parameter without a value or with a value outside its range; a standard deviation that is not positive.
    pub fn new(model: &Model, plan: &Gaussian, parameters: &[(&str, f64)]) -> Result<Self, Error> {
        let mut inputs = Inputs::new();
        // The first of several values holds.
        for (name, value) in parameters.iter().rev() {
            if model.parameters.find(|parameter| parameter.name == *name).is_none() {
                return Err(Error::input(*name, format!("program `{}` has no such parameter", model.name)));
            }
            inputs = inputs.number(name, *value);
        }
        Self::of(&Setting::new(model, &inputs)?, plan)
    }

    /// As [`Filter::new`], where the numbers of the program are known.
    pub(crate) fn of(setting: &Setting<'_>, plan: &Gaussian) -> Result<Self, Error> {
        let model = setting.model;
        let slots = |ids: &mut dyn Iterator<Item = VariableId>| -> Vec<usize> {
            ids.flat_map(|id| setting.slots_of(id)).collect()
        };
        let before = slots(&mut plan.carried.iter().map(|(_, before)| *before));
        let carried = slots(&mut plan.carried.iter().map(|(now, _)| *now));
        let searched = slots(&mut plan.asks.iter().flat_map(|ask| &ask.searched).map(|item| item.variable));
        let real = |id: &VariableId| !model.variables[*id].domain.is_finite();
        let observed = slots(&mut plan.observed.iter().copied().filter(real));
        // The law of X^-1 before the first instant.
        let start = Layout::of(setting, &mut plan.initial.iter(), &[], &before)?;
        let law = start.extended(NormalLaw::new(observes_dirac(plan)));
        let law = law.select(before.iter().map(|slot| start.rows[slot])).reduced();
        let wanted = [&observed[..], &carried, &searched].concat();
        let later = Layout::of(setting, &mut plan.sources.iter(), &before, &wanted)?;
        let next = match plan.first.is_empty() {
            true => None,
            false => {
                let sources = &mut plan.sources.iter().chain(&plan.first);
                Some(Layout::of(setting, sources, &before, &wanted)?)
            }
        };
        let question = model.ask_text(&plan.asks[0]);
        let (searched, observed) = (named(setting, searched), named(setting, observed));
        Ok(Self { searched, observed, question, law, carried, next, later })
    }

    /// A filter that is given the equations of each instant.
    pub(super) fn without_equations(setting: &Setting<'_>, ask: &Ask, carried: Vec<usize>) -> Self {
        let searched = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
        let known = ask.known.iter().filter(|known| Some(known.variable) != setting.model.plate_index());
        let observed = known.flat_map(|known| setting.slots_of(known.variable)).collect();
        let (searched, observed) = (named(setting, searched), named(setting, observed));
        let (question, law) = (setting.model.ask_text(ask), NormalLaw::new(true));
        Self { searched, observed, question, law, carried, next: None, later: Layout::default() }
    }

    fn layout(&self) -> &Layout {
        self.next.as_ref().unwrap_or(&self.later)
    }

    /// Gives the equations of the next instant.
    pub(super) fn set_layout(&mut self, layout: Layout) {
        self.next = Some(layout);
    }

    /// The rows of the carried variables.
    pub(super) fn carried(&self) -> Vec<usize> {
        self.carried.iter().map(|slot| self.layout().rows[slot]).collect()
    }

    /// The rows of the searched variables.
    pub(super) fn searched(&self) -> Vec<usize> {
        self.searched.iter().map(|(_, slot)| self.layout().rows[slot]).collect()
    }

    /// The names of the observed variables; a vector is named by its components (`V[0]`), a family by its elements.
    pub fn observed(&self) -> impl Iterator<Item = &str> {
        self.observed.iter().map(|(name, _)| name.as_str())
    }

    /// The joint law of this instant before conditioning: first the carried variables, then the others.
    pub(super) fn predict(&self) -> NormalLaw {
        self.layout().extended(self.law.clone())
    }

    /// Keeps the law of the carried variables, for the next instant.
    pub(super) fn keep(&mut self, law: NormalLaw) {
        self.law = law;
        self.next = None;
    }

    /// The gain of a searched variable for an observed one, at this instant.
    pub fn gain_of(&self, variable: &str, observed: &str) -> Option<f64> {
        let rows = &self.layout().rows;
        let row = rows[&self.searched.iter().find(|(name, _)| name == variable)?.1];
        self.observed.iter().find(|(name, _)| name == observed)?;
        // The gain is the mean when all means are 0, this observation is 1 and the others are 0.
        let mut law = self.predict().centred();
        for (name, slot) in &self.observed {
            law.observe(rows[slot], if name == observed { 1.0 } else { 0.0 })?;
        }
        Some(law.mean(row))
    }

    /// Conditions one instant on its observations and returns the belief; keeps the law that the next instant needs.
    ///
    /// # Errors
    /// An observation that is missing, unknown or not finite.
    pub fn step(&mut self, observations: &[(&str, f64)]) -> Result<Belief, Error> {
        if let Some((name, _)) =
            observations.iter().find(|(name, _)| self.observed.iter().all(|(row, _)| row != name))
        {
            return Err(Error::input(*name, "the question does not know this variable"));
        }
        let mut instant = Instant::new();
        for (name, slot) in &self.observed {
            let given = observations.iter().find(|(given, _)| given == name);
            let (_, value) = given.ok_or_else(|| Error::input(name, "it was not observed"))?;
            instant.push((*slot, *value));
        }
        self.step_slots(&instant)
    }

    /// As [`Filter::step`]; slots that the instant does not name are not observed.
    pub(super) fn step_slots(&mut self, instant: &Instant) -> Result<Belief, Error> {
        let (law, ln_evidence) = self.advance(self.predict(), instant)?;
        proper(&law, instant.len(), &self.question)?;
        let belief = self.belief(&law.select(self.searched()), ln_evidence);
        self.keep(law.select(self.carried()).reduced());
        Ok(belief)
    }

    /// Conditions the law of an instant on its observed variables; returns ln of their density.
    ///
    /// # Errors
    /// An observation that is not finite, or that the others exclude.
    pub(super) fn advance(&self, mut law: NormalLaw, instant: &Instant) -> Result<(NormalLaw, f64), Error> {
        let values: HashMap<usize, f64> = instant.iter().copied().collect();
        let mut ln_evidence = 0.0;
        for (name, slot) in &self.observed {
            if let Some(value) = values.get(slot) {
                ln_evidence += observe(&mut law, self.layout().rows[slot], *value, name, &self.question)?;
            }
        }
        Ok((law, ln_evidence))
    }

    /// The belief about the searched variables, from their law.
    pub(super) fn belief(&self, law: &NormalLaw, ln_evidence: f64) -> Belief {
        let variables = self.searched.iter().map(|(name, _)| name.clone()).collect();
        Belief::of(variables, law.clone(), ln_evidence)
    }

    /// Iterates the covariance until it, and so the gains, are stationary; means do not change.
    ///
    /// # Errors
    /// The covariance does not converge: a carried variable is not observed (its noise accumulates without bound).
    pub fn settle(&mut self) -> Result<(), Error> {
        let law = self.law.clone();
        let at_rest: Instant = self.observed.iter().map(|(_, slot)| (*slot, 0.0)).collect();
        let mut before = law.covariance();
        for _ in 0..MOST_INSTANTS {
            self.step_slots(&at_rest)?;
            let covariance = self.law.covariance();
            let scale = covariance.amax().max(f64::MIN_POSITIVE);
            if (&covariance - before).amax() <= 1e-14 * scale {
                self.law.take_means(&law);
                return Ok(());
            }
            before = covariance;
        }
        Err(Error::input("covariance", "it does not converge: a carried variable is not observed"))
    }
}

fn named(setting: &Setting<'_>, slots: Vec<usize>) -> Vec<(String, usize)> {
    slots.into_iter().map(|slot| (setting.slot_name(slot), slot)).collect()
}

impl Layout {
    /// The equations of the wanted slots and of their ancestors; the first rows are those of slots that are there before.
    fn of<'s>(
        setting: &'s Setting<'s>,
        sources: &mut dyn Iterator<Item = &'s LinearEquation>,
        before: &[usize],
        wanted: &[usize],
    ) -> Result<Self, Error> {
        let mut equations = Equations::new(setting, sources)?;
        let mut marks = vec![0; setting.slots()];
        before.iter().for_each(|slot| marks[*slot] = NEEDED);
        let mut order = Vec::new();
        for slot in wanted {
            equations.add_with_parents(*slot, (&mut marks, NEEDED), &mut order)?;
        }
        let slots = before.iter().chain(&order);
        let rows: HashMap<usize, usize> = slots.enumerate().map(|(row, slot)| (*slot, row)).collect();
        let extension = |slot: &usize| {
            let equation = equations.of(*slot);
            let terms = equation.parents.iter().map(|(parent, factor)| (rows[parent], *factor)).collect();
            Extension { terms, constant: equation.constant, deviation: equation.deviation }
        };
        Ok(Self { extensions: order.iter().map(extension).collect(), rows })
    }

    pub(super) fn extended(&self, mut law: NormalLaw) -> NormalLaw {
        for Extension { terms, constant, deviation } in &self.extensions {
            law.extend(terms, *constant, *deviation);
        }
        law
    }
}

/// Whether a variable without noise of its own may be observed.
fn observes_dirac(plan: &Gaussian) -> bool {
    let observed: HashSet<VariableId> = plan.observed.iter().copied().collect();
    let diracs = (plan.sources.iter().chain(&plan.first))
        .filter(|source| matches!(source.noise, Noise::None | Noise::Covariance(_)))
        .map(|source| source.variable);
    let previous = plan.carried.iter().map(|(_, previous)| *previous);
    diracs.chain(previous).any(|variable| observed.contains(&variable))
}

/// Refuses a law of which a flat variable is not determined by the observations.
pub(super) fn proper(law: &NormalLaw, seen: usize, question: &str) -> Result<(), Error> {
    let flat = law.flats();
    if flat == 0 {
        return Ok(());
    }
    let reason = format!(
        "the posterior is improper: with {seen} observed {}, {flat} {} of its `flat` variables {} not determined; observe \
         more, or give a proper form such as `normal(0, 100)`",
        if seen == 1 { "number" } else { "numbers" },
        if flat == 1 { "direction" } else { "directions" },
        if flat == 1 { "is" } else { "are" },
    );
    Err(Error::Unplanned { question: question.to_owned(), reason })
}

/// Conditions a law on an observation; returns ln of its density.
pub(super) fn observe(
    law: &mut NormalLaw,
    row: usize,
    value: f64,
    name: &str,
    question: &str,
) -> Result<f64, Error> {
    if !value.is_finite() {
        return Err(Error::input(name, format!("an observation must be finite, but it is {value}")));
    }
    let determined = law.mean(row);
    law.observe(row, value).ok_or_else(|| {
        let reason = format!(
            "`{name} = {value}` is impossible: earlier observations determine `{name}` = {determined}"
        );
        Error::Impossible(Impossible { question: question.to_owned(), reason: Some(reason) })
    })
}
