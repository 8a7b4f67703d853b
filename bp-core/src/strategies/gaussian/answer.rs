//! Answers in closed form, where all is linear and Gaussian.
//!
//! In: a closed form and the host's inputs. Out: [`Answer`]s: a mean and a deviation for each searched variable, or one
//! of its moments. Invariant: each parameter and each observation is one number.

use super::{Filter, Gaussian, condition};
use crate::distribution::Setting;
use crate::equation::Strategy;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Ask, Model, Statistic};
use crate::posterior::{Answer, Figure, Part, PartLaw, Row, Slot};
use crate::sample::Observations;
use crate::strategies::{Case, Found, Prepared};

/// With more variables than these, only those that are still needed are kept.
const MANY_VARIABLES: usize = 200;

/// Whether a program is long, and of one instant.
fn is_long(model: &Model, gaussian: &Gaussian) -> bool {
    gaussian.sources.len() > MANY_VARIABLES
        && gaussian.carried.is_empty()
        && gaussian.initial.is_empty()
        && gaussian.sources.iter().all(|source| model.components(source.variable) == 1)
}

/// What an ask makes of a normal law.
pub(crate) fn figure(ask: &Ask, mean: f64, deviation: f64) -> Figure {
    match ask.statistic {
        Statistic::Expectation => Figure::Expectation { expectation: mean, error: None },
        Statistic::Variance => Figure::Variance { variance: deviation.powi(2), error: None },
        _ => Figure::Normal { mean, deviation },
    }
}

impl Prepared for Gaussian {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        Ok(answers(model, self, case.inputs)?.into_iter().map(Found::Answer).collect())
    }
}

fn answers(model: &Model, gaussian: &Gaussian, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
    let given = |name: &str| match inputs.find(name) {
        None => Ok(None),
        Some([number]) => Ok(Some(*number)),
        Some(several) => {
            let count = several.len();
            Err(Error::input(name, format!("{count} numbers were given, but 1 is expected")))
        }
    };
    let mut parameters: Vec<(&str, f64)> = Vec::new();
    for parameter in model.parameters.values() {
        if let Some(number) = given(&parameter.name)? {
            parameters.push((&parameter.name, number));
        }
    }
    let setting = Setting::new(model, inputs)?;
    let evidence = Observations::of(&setting, &gaussian.asks[0])?;
    let known = gaussian.asks[0].known.iter().filter(|known| Some(known.variable) != model.plate_index());
    let slots = known.flat_map(|known| setting.slots_of(known.variable));
    let observations: Vec<(String, f64)> =
        slots.map(|slot| (setting.slot_name(slot), evidence.values[slot])).collect();
    let observations: Vec<(&str, f64)> =
        observations.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let belief = match is_long(model, gaussian) {
        true => {
            let number = |name: &str| {
                let given = parameters.iter().find(|(known, _)| *known == name).map(|(_, number)| *number);
                given.or_else(|| setting.number(name)).unwrap_or(f64::NAN)
            };
            let slot = |variable: VariableId| setting.slots_of(variable).start;
            let observed = gaussian.observed.iter().map(|id| (*id, evidence.values[slot(*id)])).collect();
            condition(model, gaussian, &number, &observed)?
        }
        false => Filter::new(model, gaussian, &parameters)?.step(&observations)?,
    };
    let numbers = belief.mean.iter().chain(belief.covariance.iter()).chain([&belief.ln_evidence]);
    if !numbers.copied().all(f64::is_finite) {
        return Err(setting.not_a_number(&model.ask_text(&gaussian.asks[0]), &evidence.values));
    }
    // The rows of the belief are those of the asks, one ask after the other.
    let mut next = 0;
    let mut part = |ask: &Ask| {
        let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
        let of: Vec<Slot> = slots.map(|slot| Slot::of(&setting, slot)).collect();
        let rows = next..next + of.len();
        next = rows.end;
        let covariance = |row: usize| rows.clone().map(move |other| (row, other));
        let covariance = rows.clone().flat_map(covariance).map(|at| belief.covariance[at]).collect();
        let law = PartLaw::Normal { mean: rows.clone().map(|row| belief.mean[row]).collect(), covariance };
        Part { instant: None, given: Vec::new(), of, law }
    };
    Ok((gaussian.asks.iter())
        .map(|ask| Answer {
            strategy: Strategy::Gaussian,
            when: ask.when,
            parts: vec![part(ask)],
            question: model.ask_text(ask),
            ln_evidence: (!observations.is_empty()).then_some(belief.ln_evidence),
            estimate: None,
            answer: (ask.searched.iter())
                .flat_map(|searched| setting.slots_of(searched.variable))
                .map(|slot| setting.slot_name(slot))
                .map(|name| {
                    let mean = belief.mean_of(&name).unwrap_or(f64::NAN);
                    let deviation = belief.deviation_of(&name).unwrap_or(f64::NAN);
                    Row { values: vec![(name, String::new())], figure: figure(ask, mean, deviation) }
                })
                .collect(),
        })
        .collect())
}
