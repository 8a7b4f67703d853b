//! The extended Kalman filter: the equations of each instant are tangents at its own estimate.
//!
//! In: a program of reals whose forms are normal or Dirac with any mean, and the observations of each instant. Out: a normal
//! [`Belief`] for each instant: an approximation, exact where the means are linear. Invariant: it is used only where the user
//! names it, or to guide particles, which correct it.
//!
//! The tangent is taken where the instant's observations put its variables, and taken again there until it stays (the iterated
//! extended Kalman filter: Bell and Cathey, *IEEE Transactions on Automatic Control* 38:294-297, 1993).

use super::filter::{Extension, Layout};
use super::{Belief, Filter, NormalLaw};
use crate::analysis::{carried, relevant_variables};
use crate::distribution::{Instance, Setting};
use crate::error::Error;
use crate::model::{Ask, Form, Model};
use crate::strategies::over_time::{Instant, OverTime};
use std::collections::HashMap;

/// How often the tangents of an instant are taken.
const MOST_PASSES: usize = 8;

/// The relative change of a mean at which they stay.
const STAYS: f64 = 1e-10;

/// The reason why a program is not linearised.
pub(crate) fn not_linearised(model: &Model, ask: &Ask) -> Option<String> {
    for id in relevant_variables(model, std::slice::from_ref(ask)) {
        if Some(id) == model.plate_index() {
            continue;
        }
        let name = model.variable_name(id);
        if model.variables[id].domain.is_finite() {
            return Some(format!("`{name}` is finite: only normal laws of reals are linearised"));
        }
        if let Some(factor) = model.factor_of(id)
            && !is_normal(&model.factors[factor].form)
        {
            return Some(format!("the form of `{name}` is neither `normal` nor `dirac`"));
        }
    }
    None
}

/// Whether a form is normal or a Dirac in all its branches.
pub(crate) fn is_normal(form: &Form) -> bool {
    match form {
        Form::Dirac(_) => true,
        Form::If { then, otherwise, .. } => is_normal(then) && is_normal(otherwise),
        Form::Initial { first, later } => is_normal(first) && is_normal(later),
        Form::Previous { at: None, otherwise, .. } => is_normal(otherwise),
        form => form.as_normal().is_some(),
    }
}

/// An extended Kalman filter.
#[derive(Clone)]
pub(crate) struct Extended<'s> {
    filter: Filter,
    tangents: Tangents<'s>,
    begun: bool,
}

/// The instances of an instant, from which its tangents are made.
#[derive(Clone)]
struct Tangents<'s> {
    first: Setting<'s>,
    later: Setting<'s>,
    before: Vec<usize>,
    now: Vec<Instance>,
}

impl<'s> Extended<'s> {
    pub(crate) fn new(setting: &Setting<'s>, route: &OverTime) -> Result<Self, Error> {
        let (model, ask) = (setting.model, route.ask());
        let wanted = relevant_variables(model, std::slice::from_ref(ask));
        let mut instances = setting.ordered()?;
        instances.retain(|instance| wanted.contains(&setting.variable_of(instance.left[0])));
        let (start, now): (Vec<Instance>, Vec<Instance>) = (instances.into_iter())
            .partition(|it| model.variables[setting.variable_of(it.left[0])].previous_of.is_some());
        let pairs = carried(model).into_iter().filter(|(_, before)| wanted.contains(before));
        let pairs: Vec<(usize, usize)> =
            pairs.flat_map(|(now, before)| setting.slots_of(now).zip(setting.slots_of(before))).collect();
        let (carried, before): (Vec<usize>, Vec<usize>) = pairs.into_iter().unzip();
        let mut tangents =
            Tangents { first: setting.at(true), later: setting.at(false), before: Vec::new(), now: start };
        let mut filter = Filter::without_equations(setting, ask, carried);
        // The law of X^-1 before the first instant; what has no form starts at 0.
        let mut layout = tangents.at_mean(&filter, true, &Instant::new())?;
        for slot in &before {
            layout.rows.entry(*slot).or_insert_with(|| {
                layout.extensions.push(Extension::default());
                layout.extensions.len() - 1
            });
        }
        let law = layout.extended(NormalLaw::new(true));
        let law = law.select(before.iter().map(|slot| layout.rows[slot])).reduced();
        (tangents.before, tangents.now) = (before, now);
        filter.law = law;
        Ok(Self { filter, tangents, begun: false })
    }

    /// As [`Filter::filtered`].
    pub(crate) fn filtered(&mut self, instants: &[Instant]) -> Result<Vec<Belief>, Error> {
        let mut first = !self.begun;
        let tangents = &self.tangents;
        let beliefs = self.filter.filtered_by(instants, &mut |filter, instant| {
            tangents.prepare(filter, std::mem::take(&mut first), instant)
        })?;
        self.begun |= !instants.is_empty();
        Ok(beliefs)
    }

    /// As [`Filter::smoothed`]; the tangents are those of the filter.
    pub(crate) fn smoothed(&mut self, instants: &[Instant]) -> Result<Vec<Belief>, Error> {
        let mut first = !self.begun;
        let tangents = &self.tangents;
        self.filter.smoothed_by(instants, &mut |filter, instant| {
            tangents.prepare(filter, std::mem::take(&mut first), instant)
        })
    }

    /// As [`Filter::predicted`].
    pub(crate) fn predicted(&self, steps: usize) -> Result<Belief, Error> {
        let mut first = !self.begun;
        let nothing = vec![Instant::new(); steps];
        let beliefs = self.filter.clone().filtered_by(&nothing, &mut |filter, instant| {
            self.tangents.prepare(filter, std::mem::take(&mut first), instant)
        })?;
        Ok(beliefs.into_iter().next_back().expect("internal: a belief for each instant"))
    }
}

impl Tangents<'_> {
    /// Gives a filter the equations of its next instant.
    fn prepare(&self, filter: &mut Filter, first: bool, instant: &Instant) -> Result<(), Error> {
        let layout = self.at_mean(filter, first, instant)?;
        filter.set_layout(layout);
        Ok(())
    }

    /// The tangents at the means given the observations of the instant.
    fn at_mean(&self, filter: &Filter, first: bool, instant: &Instant) -> Result<Layout, Error> {
        let setting = if first { &self.first } else { &self.later };
        let mut values = crate::sample::Observations::none(setting).values;
        self.before.iter().enumerate().for_each(|(row, slot)| values[*slot] = filter.law.mean(row));
        instant.iter().for_each(|(slot, value)| values[*slot] = *value);
        let seen: HashMap<usize, f64> = instant.iter().copied().collect();
        let mut layout = self.at(setting, &mut values, &seen, true)?;
        for _ in 1..MOST_PASSES {
            let mut law = layout.extended(filter.law.clone());
            for (slot, value) in instant {
                // An observation that cannot be is refused by the filter itself.
                if let Some(row) = layout.rows.get(slot) {
                    law.observe(*row, *value);
                }
            }
            let mut change: f64 = 0.0;
            for (slot, row) in layout.rows.iter().filter(|(slot, _)| !seen.contains_key(slot)) {
                let mean = law.mean(*row);
                change = change.max((mean - values[*slot]).abs() / (1.0 + mean.abs()));
                values[*slot] = mean;
            }
            if change <= STAYS {
                break;
            }
            // Outside the range of a form the tangents before are kept.
            match self.at(setting, &mut values, &seen, false) {
                Ok(next) => layout = next,
                Err(_) => break,
            }
        }
        Ok(layout)
    }

    /// The tangents at some values; `forward`: values that are not observed are the means, parents first.
    fn at(
        &self,
        setting: &Setting<'_>,
        values: &mut [f64],
        seen: &HashMap<usize, f64>,
        forward: bool,
    ) -> Result<Layout, Error> {
        let rows = self.before.iter().enumerate().map(|(row, slot)| (*slot, row)).collect();
        let mut layout = Layout { extensions: Vec::new(), rows };
        for instance in &self.now {
            let slot = instance.left[0];
            let tangent =
                setting.tangent(instance, values)?.expect("internal: the offer has looked at the form");
            if forward && !seen.contains_key(&slot) {
                values[slot] = tangent.at(values);
            }
            let terms =
                tangent.terms.iter().filter_map(|(parent, slope)| Some((*layout.rows.get(parent)?, *slope)));
            let terms = terms.collect();
            layout.rows.insert(slot, self.before.len() + layout.extensions.len());
            layout.extensions.push(Extension {
                terms,
                constant: tangent.constant,
                deviation: tangent.deviation,
            });
        }
        Ok(layout)
    }
}
