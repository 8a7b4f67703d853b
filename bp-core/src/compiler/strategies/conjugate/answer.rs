//! Answers of conjugate posteriors.
//!
//! In: a [`Conjugate`] offer and the host's inputs. Out: named distributions of unknowns, or the table of a predicted variable.
//! Invariant: time and memory grow linearly with what is observed.

mod predicted;

use super::Conjugate;
use super::likelihood::{Kind, contribution};
use super::offer::{element_of, kind_of, predicate_of};
use super::unknown::{Evidenced, Unknown};
use crate::distribution::{Distribution, Instance, LnTerms, Setting};
use crate::equation::Strategy;
use crate::error::{Error, Impossible};
use crate::ids::{ExpressionId, VariableId};
use crate::law::{Law, Support};
use crate::model::{Ask, Form, LinearForm, Model};
use crate::posterior::{Answer, NamedLaw, Part, PartLaw, Slot, Table};
use crate::sample::Observations;
use crate::strategies::gaussian::{Slots, by_counts, by_intervals};
use crate::strategies::{Case, Found, Prepared};
use std::collections::HashMap;

impl Prepared for Conjugate {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let setting = Setting::new(model, case.inputs)?;
        let observations = Observations::of(&setting, &self.asks[0])?;
        let (posterior, ln_evidence) = Posterior::of(&setting, self, &self.asks[0], observations.values)?;
        let ln_evidence = posterior.has_observations.then_some(ln_evidence);
        let answer = |ask: &Ask| match model.variables[ask.searched[0].variable].domain.is_finite() {
            true => {
                let table = match predicate_of(model, ask.searched[0].variable) {
                    Some(root) => posterior.truth(ask, root),
                    None => posterior.predicted(self, ask)?,
                };
                Ok(Found::Table(table, ln_evidence))
            }
            false => match posterior.predicted_at(self, ask, ln_evidence)? {
                Some(answer) => Ok(Found::Answer(answer)),
                None => posterior.unknowns(ask, ln_evidence, case.sampling.seed).map(Found::Answer),
            },
        };
        self.asks.iter().map(answer).collect()
    }
}

/// The unknowns, given what is observed.
pub(super) struct Posterior<'s> {
    setting: &'s Setting<'s>,
    values: Vec<f64>,
    /// The unknowns with what is observed of them, their posteriors, and the first slot of each by any of its slots.
    unknowns: HashMap<usize, (Evidenced, Unknown)>,
    first: HashMap<usize, usize>,
    /// Which slots are unknowns; their values are 0.
    is_unknown: Vec<bool>,
    has_observations: bool,
}

impl<'s> Posterior<'s> {
    /// The unknowns given these values of slots, and ln of their probability.
    ///
    /// # Errors
    /// Observations of probability zero; a number outside the range of a form.
    pub(super) fn of(
        setting: &'s Setting<'s>,
        of: &Conjugate,
        ask: &Ask,
        values: Vec<f64>,
    ) -> Result<(Self, f64), Error> {
        let (posterior, ln_evidence) = Self::at(setting, of, values)?;
        let ln_evidence = ln_evidence.total();
        if ln_evidence == f64::NEG_INFINITY {
            let reason = setting.zero_factor_but(&posterior.plain(), &|slot| posterior.is_unknown[slot]);
            return Err(Error::Impossible(Impossible { question: setting.model.ask_text(ask), reason }));
        }
        if !ln_evidence.is_finite() {
            return Err(setting.not_a_number(&setting.model.ask_text(ask), &posterior.values));
        }
        Ok((posterior, ln_evidence))
    }

    /// The same, where their probability may be 0.
    ///
    /// # Errors
    /// A number outside the range of a form.
    pub(super) fn at(
        setting: &'s Setting<'s>,
        of: &Conjugate,
        values: Vec<f64>,
    ) -> Result<(Self, LnTerms), Error> {
        let mut posterior = Self::new(setting, of, values)?;
        let ln_evidence = posterior.observe(of)?;
        Ok((posterior, ln_evidence))
    }

    /// The first slot of each unknown, and its distribution.
    pub(super) fn into_unknowns(self) -> Vec<(usize, Unknown)> {
        self.unknowns.into_iter().map(|(slot, (_, unknown))| (slot, unknown)).collect()
    }

    fn new(setting: &'s Setting<'s>, of: &Conjugate, mut values: Vec<f64>) -> Result<Self, Error> {
        let model = setting.model;
        let (mut unknowns, mut first) = (HashMap::new(), HashMap::new());
        let mut is_unknown = vec![false; setting.slots()];
        for id in &of.priors {
            is_unknown[setting.slots_of(model.factors[*id].left[0].variable)].fill(true);
            for instance in setting.instances(*id)? {
                let slot = instance.left[0];
                first.insert(slot, slot - instance.component);
                if instance.component == 0 {
                    let prior = prior(setting, &instance, &values)?;
                    unknowns.insert(slot, (Evidenced::new(prior.clone()), prior));
                }
            }
        }
        values.iter_mut().zip(&is_unknown).filter(|(_, own)| **own).for_each(|(value, _)| *value = 0.0);
        Ok(Self { setting, values, unknowns, first, is_unknown, has_observations: false })
    }

    /// Adds all that is observed; returns ln of its probability.
    fn observe(&mut self, of: &Conjugate) -> Result<LnTerms, Error> {
        let setting = self.setting;
        let mut ln = LnTerms::default();
        for id in &of.observed {
            let factor = &setting.model.factors[*id];
            let components = setting.model.components(factor.left[0].variable);
            let some_missing = factor
                .right
                .iter()
                .any(|use_| setting.slots_of(use_.variable).any(|slot| self.values[slot].is_nan()));
            for instance in setting.instances(*id)? {
                let slot = instance.left[0];
                if instance.component > 0 {
                    continue;
                }
                let value = &self.values[slot..slot + components];
                if value.iter().all(|number| number.is_nan()) {
                    continue;
                }
                self.has_observations = true;
                if some_missing {
                    self.reads_known(&instance)?;
                }
                let found = contribution(setting, &instance, value, &self.values, &self.is_unknown)?;
                ln.add(found.ln_factor);
                if !found.ln_factor.is_finite() {
                    // The error of the form, if one of its numbers is not valid.
                    setting.distribution(&instance, &self.plain())?;
                    return Ok(ln);
                }
                if let Some((unknown, _)) = found.slot.and_then(|slot| self.unknowns.get_mut(&slot)) {
                    unknown.observe(&found.observed);
                }
            }
        }
        self.unknowns.values_mut().for_each(|(unknown, posterior)| *posterior = unknown.posterior());
        // In the order of the slots, so that the sum has the same bits each time.
        let mut slots: Vec<&usize> = self.unknowns.keys().collect();
        slots.sort_unstable();
        slots.into_iter().for_each(|slot| ln.add(self.unknowns[slot].0.ln_probability()));
        Ok(ln)
    }

    /// Refuses an instance whose form reads an element that is not observed.
    fn reads_known(&self, instance: &Instance) -> Result<(), Error> {
        let setting = self.setting;
        let is_missing = |slot: &usize| self.values[*slot].is_nan() && !instance.left.contains(slot);
        let Some(missing) = setting.reads(instance).into_iter().find(is_missing) else { return Ok(()) };
        let (name, factor) = (setting.slot_name(missing), &setting.model.factors[instance.factor]);
        let reason = format!("`{name}` is not observed, and `{}` depends on it", setting.model.head(factor));
        Err(Error::Unplanned { question: setting.model.name.clone(), reason })
    }

    /// The values, with a valid one for each unknown.
    fn plain(&self) -> Vec<f64> {
        let mut values = self.values.clone();
        for (first, (_, unknown)) in &self.unknowns {
            match unknown {
                Unknown::Probability(_) => values[*first] = 0.5,
                Unknown::Rate(_) => values[*first] = 1.0,
                Unknown::Alone(law) => values[*first] = law.quantile(0.5),
                Unknown::Proportions(all) => values[*first..first + all.len()].fill(1.0 / all.len() as f64),
            }
        }
        values
    }

    /// The slots that an item searches.
    fn slots(&self, variable: VariableId) -> Vec<usize> {
        let setting = self.setting;
        match element_of(setting.model, variable) {
            None => setting.slots_of(variable).collect(),
            Some((use_, None)) => setting.slots_used(use_, &[]).collect(),
            Some((use_, Some(at))) => setting.slots_used(use_, &[]).skip(at).take(1).collect(),
        }
    }

    /// The named distributions of some unknowns.
    fn unknowns(&self, ask: &Ask, ln_evidence: Option<f64>, seed: u64) -> Result<Answer, Error> {
        of_laws(self.setting, ask, self.laws(ask), (ln_evidence, seed))
    }

    /// The slots that an ask searches, their distributions, and their covariances, row by row.
    pub(super) fn laws(&self, ask: &Ask) -> (Vec<Slot>, Vec<NamedLaw>, Vec<f64>) {
        let setting = self.setting;
        let mut places = Vec::new();
        for item in &ask.searched {
            let own = setting.slots_of(item.variable).zip(self.slots(item.variable));
            places.extend(own.map(|(named, slot)| (named, slot, self.first[&slot])));
        }
        let laws = places.iter().map(|(_, slot, first)| self.unknowns[first].1.law(slot - first)).collect();
        let covariance = |(_, one, first): &(usize, usize, usize)| {
            let of = |(_, other, own): &(usize, usize, usize)| match own == first {
                true => self.unknowns[first].1.covariance(one - first, other - first),
                false => 0.0,
            };
            places.iter().map(of).collect::<Vec<f64>>()
        };
        let covariance = places.iter().flat_map(covariance).collect();
        (places.iter().map(|(named, ..)| Slot::of(setting, *named)).collect(), laws, covariance)
    }

    /// The distribution of a slot of an unknown.
    pub(super) fn law_of(&self, slot: usize) -> NamedLaw {
        let first = self.first[&slot];
        self.unknowns[&first].1.law(slot - first)
    }

    /// The probabilities that a predicate of one unknown does not hold and that it does.
    fn truth(&self, ask: &Ask, root: ExpressionId) -> Table {
        truth(self.setting, ask, root, &|slot| self.law_of(slot))
    }
}

/// The probabilities that a predicate of one unknown does not hold and that it does, from the law of the unknown's slot.
pub(super) fn truth(
    setting: &Setting<'_>,
    ask: &Ask,
    root: ExpressionId,
    law: &dyn Fn(usize) -> NamedLaw,
) -> Table {
    let (model, cells) = (setting.model, truth_cells(setting, root, law).to_vec());
    Table::read(model, (ask, model.ask_text(ask)), &[ask.searched[0].variable], cells, None, &[2])
}

/// The same as numbers.
pub(super) fn truth_cells(
    setting: &Setting<'_>,
    root: ExpressionId,
    law: &dyn Fn(usize) -> NamedLaw,
) -> [f64; 2] {
    let model = setting.model;
    let leaves = Slots { setting, indices: &[] };
    let form = LinearForm::of(model, root, 0, &leaves);
    let (slot, scale) = form.coefficients.iter().next().expect("internal: a predicate reads an unknown");
    let law = law(*slot);
    if law.law.support() == Support::Counts {
        let mass = |first: f64, last: f64| match first == last {
            true => law.density(first),
            false => law.between(first - 1.0, last),
        };
        return by_counts(model, root, (*scale, form.constant), &mass, &leaves);
    }
    let mass = |low: f64, high: f64| {
        let (one, other) = ((low - form.constant) / scale, (high - form.constant) / scale);
        law.between(one.min(other), one.max(other))
    };
    by_intervals(model, root, &mass, &leaves)
}

/// The answer that consists of the laws of some slots, and of their covariance, row by row.
///
/// # Errors
/// A number that f64 does not hold.
pub(super) fn of_laws(
    setting: &Setting<'_>,
    ask: &Ask,
    (of, laws, covariance): (Vec<Slot>, Vec<NamedLaw>, Vec<f64>),
    (ln_evidence, seed): (Option<f64>, u64),
) -> Result<Answer, Error> {
    let model = setting.model;
    let part = Part { instant: None, given: Vec::new(), of, law: PartLaw::Laws { laws, covariance } };
    let rows = match Observations::searched(setting, ask)? {
        Some(values) => vec![part.row_at(model, &values)],
        None => part.rows_of(model, ask, seed)?,
    };
    Ok(Answer {
        question: model.ask_text(ask),
        strategy: Strategy::Conjugate,
        when: ask.when,
        ln_evidence,
        estimate: None,
        answer: rows.into(),
        parts: vec![part],
    })
}

/// The prior of an unknown.
///
/// # Errors
/// A parameter outside the range of the form.
fn prior(setting: &Setting<'_>, instance: &Instance, values: &[f64]) -> Result<Unknown, Error> {
    let model = setting.model;
    let form = &model.factors[instance.factor].form;
    let distribution = setting.distribution(instance, values)?;
    Ok(match (kind_of(model, form), distribution) {
        (Some(Kind::Probability), Distribution::Law(Law::Beta, [a, b, _])) => Unknown::Probability([a, b]),
        (Some(Kind::Probability), _) => Unknown::Probability([1.0, 1.0]),
        (Some(Kind::Alone), Distribution::Law(law, parameters)) => {
            Unknown::Alone(NamedLaw { law, parameters })
        }
        (_, Distribution::Law(Law::Exponential, [rate, ..])) => Unknown::Rate([1.0, rate]),
        (_, Distribution::Law(_, [shape, rate, _])) => Unknown::Rate([shape, rate]),
        _ => {
            let Form::Dirichlet(parameters) = form else {
                let reason =
                    format!("`{}` is no conjugate prior", model.head(&model.factors[instance.factor]));
                return Err(Error::Unplanned { question: model.name.clone(), reason });
            };
            let number = |id: &crate::ids::ExpressionId| setting.expression(*id, instance, values);
            Unknown::Proportions(parameters.iter().map(number).collect())
        }
    })
}
