//! Answers of a mixture.
//!
//! In: its components. Out: a table of the finite variables that are asked, or the moments and quantiles of reals.
//! Invariant: weights are normalised once; an impossible observation is an error that names its factor.

use super::Mixture;
use super::components::{Component, components};
use super::offer::{is_context, own_predicate};
use crate::distribution::{LnTerms, ROUNDING, Setting, ln_terms, ln_weights};
use crate::equation::Strategy;
use crate::error::{Error, Impossible};
use crate::ids::{ExpressionId, VariableId};
use crate::model::{Ask, Finding, Known, LinearForm, Model, Searched};
use crate::posterior::{self, Answer, Column, ConditionalGaussian, Part, PartLaw, Slot, Table};
use crate::radix;
use crate::sample::Observations;
use crate::strategies::gaussian::{Slots, probabilities};
use crate::strategies::{Case, Found, Prepared};

impl Prepared for Mixture {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let setting = Setting::new(model, case.inputs)?;
        let mut ask = self.asks[0].clone();
        let is_open = |known: &Known| {
            is_context(model, known) && setting.given(&model.variable_name(known.variable)).is_none()
        };
        let (open, known): (Vec<Known>, Vec<Known>) = ask.known.into_iter().partition(is_open);
        ask.known = known;
        let observations = Observations::of(&setting, &ask)?;
        let open: Vec<usize> = open.iter().flat_map(|known| setting.slots_of(known.variable)).collect();
        match open.is_empty() {
            true => self.found(&setting, &observations, case.sampling.seed),
            false => self.in_contexts(&setting, &open, observations, case.sampling.seed),
        }
    }
}

impl Mixture {
    fn found(
        &self,
        setting: &Setting<'_>,
        observations: &Observations,
        seed: u64,
    ) -> Result<Vec<Found>, Error> {
        let (model, ask) = (setting.model, &self.asks[0]);
        let components = components(setting, self, observations)?;
        let ln: Vec<LnTerms> = components.iter().map(|component| component.ln_weight).collect();
        let (weights, ln_total) = ln_weights(&ln, ln_terms::EXACT, || model.ask_text(ask))?;
        if components.is_empty() {
            let reason = setting.zero_factor(&observations.values);
            return Err(Error::Impossible(Impossible { question: model.ask_text(ask), reason }));
        }
        if !ln_total.is_finite() {
            return Err(setting.not_a_number(&model.ask_text(ask), &observations.values));
        }
        let weighted = Weighted { setting, all: weights.into_iter().zip(&components).collect() };
        let event =
            ask.known.iter().any(|known| matches!(known.evidence, Finding::Hard(_) | Finding::Virtual(_)));
        let event = event
            || observations
                .values
                .iter()
                .zip(Observations::none(setting).values)
                .any(|(observed, none)| !observed.is_nan() && none.is_nan());
        let ln_evidence = event.then_some(ln_total);
        let is_finite = |item: &Searched| model.variables[item.variable].domain.is_finite();
        let found = |ask: &Ask| match ask.searched.iter().all(is_finite) {
            true => Ok(Found::Table(weighted.table(ask), ln_evidence)),
            false => weighted.reals(ask, ln_evidence, seed).map(Found::Answer),
        };
        self.asks.iter().map(found).collect()
    }

    /// The tables for each value of some known finite slots.
    fn in_contexts(
        &self,
        setting: &Setting<'_>,
        open: &[usize],
        mut observations: Observations,
        seed: u64,
    ) -> Result<Vec<Found>, Error> {
        let column = |slot: &usize| {
            let variable = setting.variable_of(*slot);
            let value = |ordinal| setting.model.value_name(variable, ordinal);
            Column {
                variable: Some(variable),
                element: slot - setting.slots_of(variable).start,
                name: setting.slot_name(*slot),
                values: (0..setting.count(variable)).map(value).collect(),
            }
        };
        let right: Vec<Column> = open.iter().map(column).collect();
        let contexts: usize = right.iter().map(|column| column.values.len()).product();
        let (mut all, mut impossible) = (Vec::with_capacity(contexts), None);
        for context in 0..contexts {
            for (slot, ordinal) in open.iter().zip(Column::ordinals(&right, context)) {
                observations.values[*slot] = ordinal as f64;
            }
            match self.found(setting, &observations, seed) {
                Err(Error::Impossible(why)) => {
                    impossible = Some(why);
                    all.push(None);
                }
                found => all.push(Some(found?)),
            }
        }
        let table = |at: usize| {
            let own = |found: &Option<Vec<Found>>| match found.as_ref().map(|found| &found[at]) {
                Some(Found::Table(table, _)) => Some(table.clone()),
                _ => None,
            };
            let tables: Vec<Option<Table>> = all.iter().map(own).collect();
            let first = tables.iter().flatten().next()?.clone();
            // An impossible context is a row of zeros.
            let zeros = vec![0.0; first.numbers.len()];
            let numbers = tables.iter().flat_map(|own| match own {
                Some(table) => table.numbers.to_vec(),
                None => zeros.clone(),
            });
            let numbers: Vec<f64> = numbers.collect();
            Some(Found::Table(Table { right: right.clone(), numbers: numbers.into(), ..first }, None))
        };
        let tables: Option<Vec<Found>> = (0..self.asks.len()).map(table).collect();
        tables
            .ok_or_else(|| Error::Impossible(impossible.expect("internal: each context has tables or none")))
    }
}

/// Components with weights that sum to one.
struct Weighted<'w> {
    setting: &'w Setting<'w>,
    all: Vec<(f64, &'w Component)>,
}

impl Weighted<'_> {
    /// The joint distribution of finite variables, of which one may be a predicate of reals.
    fn table(&self, ask: &Ask) -> Table {
        let setting = self.setting;
        let variables: Vec<VariableId> = ask.searched.iter().map(|item| item.variable).collect();
        let predicate = own_predicate(setting.model, ask);
        let slots: Vec<usize> = variables.iter().flat_map(|id| setting.slots_of(*id)).collect();
        let truth = predicate.map(|(place, _)| setting.slots_of(variables[place]).start);
        let extents: Vec<usize> =
            slots.iter().map(|slot| setting.count(setting.variable_of(*slot))).collect();
        let mut cells = vec![0.0; extents.iter().product()];
        for (weight, component) in &self.all {
            let of_truths = predicate.map_or([1.0, 0.0], |(_, root)| self.truths(component, root));
            for (value, p) in of_truths.into_iter().enumerate().filter(|(_, p)| *p != 0.0) {
                let own = |slot: &usize| {
                    if Some(*slot) == truth { value } else { component.values[*slot] as usize }
                };
                let digits = slots.iter().zip(&extents).map(|(slot, extent)| (own(slot), *extent));
                cells[radix::position(digits)] += weight * p;
            }
        }
        Table::read(setting.model, (ask, setting.model.ask_text(ask)), &variables, cells, None, &extents)
    }

    /// The probabilities that a predicate of reals does not hold in a component and that it does.
    fn truths(&self, component: &Component, root: ExpressionId) -> [f64; 2] {
        let leaves = Slots { setting: self.setting, indices: &[] };
        let form = LinearForm::of(self.setting.model, root, 0, &leaves);
        let terms: Vec<(usize, f64)> = form.coefficients.into_iter().collect();
        // What the component fixes, a finite variable or a known real, is a number in it.
        let fixed = |(slot, coefficient): &(usize, f64)| {
            (!component.law.has(*slot)).then(|| coefficient * self.number(component, *slot))
        };
        let constant = form.constant + terms.iter().filter_map(fixed).sum::<f64>();
        let [mean, deviation] = component.law.of_form(&terms, constant);
        // A value that finite variables determine is compared as an observation is.
        let size = |term: &(usize, f64)| {
            let of_law = || term.1 * component.law.of_form(&[(term.0, 1.0)], 0.0)[0];
            fixed(term).unwrap_or_else(of_law).abs()
        };
        let rounding = ROUNDING * terms.iter().map(size).fold(form.constant.abs(), f64::max);
        probabilities(self.setting.model, root, [mean, rounding, deviation], &leaves)
    }

    /// The number that a component has in a slot that it fixes.
    fn number(&self, component: &Component, slot: usize) -> f64 {
        self.setting.number_at(self.setting.variable_of(slot), component.values[slot])
    }

    /// The mixture of normal distributions of reals, with the values of finite variables that are asked with them.
    fn reals(&self, ask: &Ask, ln_evidence: Option<f64>, seed: u64) -> Result<Answer, Error> {
        let setting = self.setting;
        let all = || ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
        let of: Vec<Slot> = all().map(|slot| Slot::of(setting, slot)).collect();
        let (finite, slots): (Vec<usize>, Vec<usize>) =
            all().partition(|slot| setting.model.variables[setting.variable_of(*slot)].domain.is_finite());
        let normal = |(weight, component): &(f64, &Component)| {
            let law = component.law.select(&slots);
            let (mean, covariance) = (law.means(), law.covariance());
            posterior::Component {
                weight: *weight,
                mean: mean.iter().copied().collect(),
                covariance: covariance.iter().copied().collect(),
            }
        };
        let mixture = posterior::Mixture(self.all.iter().map(normal).collect());
        let values = |(_, component): &(f64, &Component)| {
            finite.iter().map(|slot| component.values[*slot] as usize).collect::<Vec<usize>>()
        };
        let law = match finite.is_empty() {
            true => PartLaw::Mixture(mixture),
            false => {
                let values = self.all.iter().map(values).collect();
                PartLaw::ConditionalGaussian(ConditionalGaussian { values, mixture })
            }
        };
        let part = Part { instant: None, given: Vec::new(), of, law };
        let rows = match Observations::searched(setting, ask)? {
            Some(values) => vec![part.row_at(setting.model, &values)],
            None => part.rows_of(setting.model, ask, seed)?,
        };
        Ok(Answer {
            question: setting.model.ask_text(ask),
            strategy: Strategy::Mixture,
            when: ask.when,
            ln_evidence,
            estimate: None,
            answer: rows.into(),
            parts: vec![part],
        })
    }
}
