//! Closed-form answers of linear-Gaussian programs.
//!
//! In: a closed form and the host's inputs. Out: [`Answer`]s, each with its law: a mean and a standard deviation for
//! each searched variable, or a statistic of the law. Invariant: each parameter and each observation is one number.

use super::equations::Slots;
use super::frontier::{Conditioned, condition};
use super::{Filter, Gaussian, NormalLaw, predicate, probabilities};
use crate::distribution::Setting;
use crate::equation::Strategy;
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::{Ask, Model, Statistic, When};
use crate::posterior::{
    Answer, Column, Figure, Part, PartLaw, Row, Slot, Table, check_draws, figures, of_normal,
};
use crate::random::seeded;
use crate::sample::Observations;
use crate::spelling::exact;
use crate::strategies::{Case, Found, Prepared};
use rand::Rng;

/// The rows that an ask's statistic makes of the normal law of the searched variables; `context` is named in each row.
///
/// # Errors
/// More draws than memory holds.
pub(crate) fn rows(
    setting: &Setting<'_>,
    ask: &Ask,
    law: &NormalLaw,
    context: &[(String, String)],
    random: &mut impl Rng,
) -> Result<Vec<Row>, Error> {
    let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
    let names: Vec<String> = slots.map(|slot| setting.slot_name(slot)).collect();
    let row = |values: Vec<(String, String)>, figure| Row { values: [context, &values].concat(), figure };
    let at = |values: &[f64], figure| {
        row(names.iter().cloned().zip(values.iter().map(|value| exact(*value))).collect(), figure)
    };
    let means = || (0..law.len()).map(|own| law.mean(own)).collect::<Vec<f64>>();
    if let (Some(values), Statistic::Distribution) = (Observations::searched(setting, ask)?, &ask.statistic) {
        let density = law.ln_density(&values).exp();
        return Ok(vec![match law.is_determined() {
            true => at(&values, Figure::Probability { p: density }),
            false => at(&values, Figure::Density { density }),
        }]);
    }
    Ok(match &ask.statistic {
        Statistic::Entropy => vec![row(Vec::new(), Figure::Entropy { entropy: law.entropy(), error: None })],
        Statistic::Information => {
            let first = setting.slots_of(ask.searched[0].variable).len();
            vec![row(Vec::new(), Figure::Information { information: law.information(first) })]
        }
        // The density is largest at the mean; the most likely sequence is answered by the mean of each instant.
        Statistic::Maximum | Statistic::Argmax { .. } if ask.when != When::Sequence => {
            vec![match law.is_determined() {
                true => at(&means(), Figure::Probability { p: 1.0 }),
                false => at(&means(), Figure::Density { density: law.ln_largest_density().exp() }),
            }]
        }
        Statistic::Draw(count) => {
            check_draws(|| setting.model.ask_text(ask), *count as f64 * law.len() as f64)?;
            (1..=*count).map(|draw| at(&law.draw(random), Figure::Draw { draw })).collect()
        }
        statistic => {
            let of = |own: usize| {
                let (mean, deviation) = (law.mean(own), law.deviation(own));
                let quantile = |level: &f64| (of_normal(mean, deviation, *level), None);
                let quantiles = |levels: &[f64]| levels.iter().map(quantile).collect();
                figures(statistic, quantiles).unwrap_or_else(|| {
                    vec![match statistic {
                        Statistic::Expectation => Figure::Expectation { expectation: mean, error: None },
                        Statistic::Variance => Figure::Variance { variance: deviation.powi(2), error: None },
                        _ => Figure::Normal { mean, deviation },
                    }]
                })
            };
            let mut rows = Vec::new();
            for (own, name) in names.iter().enumerate() {
                let named = |figure| row(vec![(name.clone(), String::new())], figure);
                rows.extend(of(own).into_iter().map(named));
            }
            rows
        }
    })
}

/// A normal law, with the values that name it.
pub(crate) type Named = (Vec<(String, String)>, NormalLaw);

/// The divergence of each law from the law of the same name.
pub(crate) fn divergences(laws: &[Named], from: &[Named]) -> Vec<Row> {
    let row = |(values, law): &Named| {
        let (_, other) = from.iter().find(|(other, _)| other == values)?;
        let divergence = law.divergence(other);
        let figure = Figure::Divergence { divergence, infinite: divergence.is_infinite() };
        Some(Row { values: values.clone(), figure })
    };
    laws.iter().filter_map(row).collect()
}

impl Prepared for Gaussian {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let answers = answers(model, self, case.inputs, case.sampling.seed)?;
        let setting = Setting::new(model, case.inputs)?;
        let found = |(ask, (answer, law)): (&Ask, (Answer, NormalLaw))| match whether(&setting, ask, &law) {
            Some(numbers) => Found::Table(truths(model, ask, numbers), answer.ln_evidence),
            None => Found::Normal(vec![(Vec::new(), law)], Some(answer)),
        };
        Ok(self.asks.iter().zip(answers).map(found).collect())
    }
}

/// The observed slots and their values.
fn observed(setting: &Setting<'_>, gaussian: &Gaussian, evidence: &Observations) -> Vec<(usize, f64)> {
    let plate = setting.model.plate_index();
    let known = gaussian.asks[0].known.iter().filter(|known| Some(known.variable) != plate);
    let slots = known.flat_map(|known| setting.slots_of(known.variable));
    slots.map(|slot| (slot, evidence.values[slot])).filter(|(_, value)| !value.is_nan()).collect()
}

/// The laws of the asks, given what is observed.
///
/// # Errors
/// As the strategy.
pub(crate) fn conditioned(setting: &Setting<'_>, gaussian: &Gaussian) -> Result<Conditioned, Error> {
    let evidence = Observations::of(setting, &gaussian.asks[0])?;
    let observed = observed(setting, gaussian, &evidence);
    match gaussian.carried.is_empty() && gaussian.initial.is_empty() {
        true => condition(setting, gaussian, &observed),
        false => at_rest(setting, gaussian, &observed),
    }
}

fn answers(
    model: &Model,
    gaussian: &Gaussian,
    inputs: &Inputs<'_, f64>,
    seed: u64,
) -> Result<Vec<(Answer, NormalLaw)>, Error> {
    let setting = Setting::new(model, inputs)?;
    let evidence = Observations::of(&setting, &gaussian.asks[0])?;
    let observed = observed(&setting, gaussian, &evidence);
    let Conditioned { laws, ln_evidence } = conditioned(&setting, gaussian)?;
    let is_finite = |law: &NormalLaw| {
        (0..law.len()).all(|row| law.mean(row).is_finite() && law.deviation(row).is_finite())
    };
    if !ln_evidence.is_finite() || !laws.iter().all(is_finite) {
        return Err(setting.not_a_number(&model.ask_text(&gaussian.asks[0]), &evidence.values));
    }
    let answer = |(ask, law): (&Ask, NormalLaw)| -> Result<(Answer, NormalLaw), Error> {
        let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
        let of: Vec<Slot> = slots.map(|slot| Slot::of(&setting, slot)).collect();
        let question = model.ask_text(ask);
        let answer = Answer {
            strategy: Strategy::Gaussian,
            when: ask.when,
            parts: vec![Part { instant: None, given: Vec::new(), of, law: part(&law) }],
            ln_evidence: (!observed.is_empty()).then_some(ln_evidence),
            estimate: None,
            answer: rows(&setting, ask, &law, &[], &mut seeded(seed, &question))?.into(),
            question,
        };
        Ok((answer, law))
    };
    gaussian.asks.iter().zip(laws).map(answer).collect()
}

/// The laws of the searched variables at one instant; before it, the carried variables are at rest.
fn at_rest(
    setting: &Setting<'_>,
    gaussian: &Gaussian,
    observed: &[(usize, f64)],
) -> Result<Conditioned, Error> {
    let belief = Filter::of(setting, gaussian)?.step_slots(&observed.to_vec())?;
    // The rows of the belief are those of the asks, one ask after the other.
    let mut next = 0;
    let law = |ask: &Ask| {
        let first = next;
        next += ask.searched.iter().map(|item| setting.slots_of(item.variable).len()).sum::<usize>();
        belief.law.select(first..next)
    };
    Ok(Conditioned { laws: gaussian.asks.iter().map(law).collect(), ln_evidence: belief.ln_evidence })
}

/// The probabilities that a predicate of reals is false and that it is true; `None` for any other ask.
pub(crate) fn whether(setting: &Setting<'_>, ask: &Ask, law: &NormalLaw) -> Option<Vec<f64>> {
    let [only] = ask.searched.as_slice() else { return None };
    let root = predicate::of_normal(setting.model, only.variable, true)?;
    let leaves = Slots { setting, indices: &[] };
    Some(
        probabilities(setting.model, root, [law.mean(0), law.rounding(0), law.deviation(0)], &leaves)
            .to_vec(),
    )
}

/// The table of a predicate without time.
fn truths(model: &Model, ask: &Ask, numbers: Vec<f64>) -> Table {
    let variable = ask.searched[0].variable;
    let values = (0..2).map(|ordinal| model.value_name(variable, ordinal)).collect();
    let column = Column { variable: Some(variable), element: 0, name: model.variable_name(variable), values };
    let numbers = numbers.into();
    Table { question: model.ask_text(ask), right: Vec::new(), left: vec![column], numbers, extended: None }
}

/// A law as part of an answer.
pub(crate) fn part(law: &NormalLaw) -> PartLaw {
    let covariance = law.covariance();
    PartLaw::Normal {
        mean: law.means().iter().copied().collect(),
        covariance: covariance.iter().copied().collect(),
    }
}
