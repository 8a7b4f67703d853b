//! Closed-form answers of linear-Gaussian programs.
//!
//! In: a closed form and the host's inputs. Out: [`Answer`]s, each with its law: a mean and a standard deviation for
//! each searched variable, or a statistic of the law. Invariant: each parameter and each observation is one number.

use super::{Filter, Gaussian, NormalLaw, condition, predicate, probabilities};
use crate::distribution::Setting;
use crate::equation::Strategy;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Ask, Model, Searched, Statistic, Value, When};
use crate::posterior::{Answer, Column, Figure, Part, PartLaw, Row, Slot, Table, figures, of_normal};
use crate::random::seeded;
use crate::sample::Observations;
use crate::spelling::exact;
use crate::strategies::{Case, Found, Prepared};
use rand::Rng;

/// Above this number of variables, `condition` keeps only those that are still needed.
const MANY_VARIABLES: usize = 200;

/// Whether a program has many variables and no time.
fn is_long(model: &Model, gaussian: &Gaussian) -> bool {
    gaussian.sources.len() > MANY_VARIABLES
        && gaussian.carried.is_empty()
        && gaussian.initial.is_empty()
        && gaussian.sources.iter().all(|source| model.components(source.variable) == 1)
}

/// Upper limit on the number of draws of one question.
const MOST_DRAWS: f64 = 1e7;

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
    let values: Option<Vec<f64>> = ask.searched.iter().map(|item| value(setting, item)).collect();
    if let (Some(values), Statistic::Distribution) = (values, &ask.statistic)
        && values.len() == law.len()
    {
        return Ok(vec![at(&values, Figure::Density { density: law.ln_density(&values).exp() })]);
    }
    Ok(match &ask.statistic {
        Statistic::Entropy => vec![row(Vec::new(), Figure::Entropy { entropy: law.entropy() })],
        Statistic::Information => {
            let first = setting.slots_of(ask.searched[0].variable).len();
            vec![row(Vec::new(), Figure::Information { information: law.information(first) })]
        }
        // The density is largest at the mean; the most likely sequence is answered by the mean of each instant.
        Statistic::Maximum | Statistic::Argmax { .. } if ask.when != When::Sequence => {
            vec![at(&means(), Figure::Density { density: law.ln_largest_density().exp() })]
        }
        Statistic::Draw(count) => {
            let cells = *count as f64 * law.len() as f64;
            if cells > MOST_DRAWS {
                let (name, help) = (setting.model.ask_text(ask), "draw fewer values".to_owned());
                return Err(Error::TooLarge { name, cells, most: MOST_DRAWS, help });
            }
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

/// The value at which a real is searched.
fn value(setting: &Setting<'_>, item: &Searched) -> Option<f64> {
    match item.at.as_ref()? {
        Value::Real(number) => Some(*number),
        Value::Given(name) => setting.given(name)?.first().copied(),
        Value::Ordinal(_) => None,
    }
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

fn answers(
    model: &Model,
    gaussian: &Gaussian,
    inputs: &Inputs<'_, f64>,
    seed: u64,
) -> Result<Vec<(Answer, NormalLaw)>, Error> {
    let given = |name: &str| match inputs.find(name) {
        None => Ok(None),
        Some([number]) => Ok(Some(*number)),
        Some(several) => {
            let count = several.len();
            Err(Error::input(name, format!("{count} numbers were given, but 1 is expected")))
        }
    };
    let mut parameters: Vec<(&str, f64)> = Vec::new();
    for parameter in model.parameters.values().filter(|parameter| parameter.over.is_empty()) {
        if let Some(number) = given(&parameter.name)? {
            parameters.push((&parameter.name, number));
        }
    }
    let setting = Setting::new(model, inputs)?;
    let evidence = Observations::of(&setting, &gaussian.asks[0])?;
    let known = gaussian.asks[0].known.iter().filter(|known| Some(known.variable) != model.plate_index());
    let slots = known.flat_map(|known| setting.slots_of(known.variable));
    let observed = slots.filter(|slot| !evidence.values[*slot].is_nan());
    let observations: Vec<(String, f64)> =
        observed.map(|slot| (setting.slot_name(slot), evidence.values[slot])).collect();
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
    // The rows of the belief follow the asks in order.
    let mut next = 0;
    let answer = |ask: &Ask| -> Result<(Answer, NormalLaw), Error> {
        let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
        let of: Vec<Slot> = slots.map(|slot| Slot::of(&setting, slot)).collect();
        let law = belief.law.select(next..next + of.len());
        next += of.len();
        let question = model.ask_text(ask);
        let answer = Answer {
            strategy: Strategy::Gaussian,
            when: ask.when,
            parts: vec![Part { instant: None, given: Vec::new(), of, law: part(&law) }],
            ln_evidence: (!observations.is_empty()).then_some(belief.ln_evidence),
            estimate: None,
            answer: rows(&setting, ask, &law, &[], &mut seeded(seed, &question))?,
            question,
        };
        Ok((answer, law))
    };
    gaussian.asks.iter().map(answer).collect()
}

/// The probabilities that a predicate of reals is false and that it is true; `None` for any other ask.
pub(crate) fn whether(setting: &Setting<'_>, ask: &Ask, law: &NormalLaw) -> Option<Vec<f64>> {
    let [only] = ask.searched.as_slice() else { return None };
    let root = predicate::of_normal(setting.model, only.variable)?;
    let parameter = |name: &str| setting.number(name).unwrap_or(f64::NAN);
    Some(probabilities(setting.model, root, (law.mean(0), law.deviation(0)), &parameter).to_vec())
}

/// The table of a predicate without time.
fn truths(model: &Model, ask: &Ask, numbers: Vec<f64>) -> Table {
    let variable = ask.searched[0].variable;
    let values = (0..2).map(|ordinal| model.value_name(variable, ordinal)).collect();
    let column = Column { variable: Some(variable), element: 0, name: model.variable_name(variable), values };
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
