//! Answers estimated from draws.
//!
//! In: a sampled route and the host's inputs. Out: [`Answer`]s, each number with its standard error. Invariant:
//! evidence that no draw meets is an error, and a small effective sample size gives a warning.

use super::{Sampled, weigh};
use crate::distribution::Setting;
use crate::equation::Strategy;
use crate::error::Error;
use crate::exec::Inputs;
use crate::memory;
use crate::model::{Ask, Finding, Model, Statistic, Value};
use crate::posterior::{Answer, Drawn, Estimate, Figure, Part, PartLaw, Row, Slot};
use crate::progress;
use crate::radix;
use crate::sample::{Draws, MOST_R_HAT, Moments, Observations, Sampling};
use crate::strategies::gibbs::gibbs;
use crate::strategies::{Case, Found, Prepared};
use std::sync::Arc;

/// Effective sample size below which an answer carries a warning.
pub(crate) const FEW: f64 = 200.0;

/// Upper limit on the rows of a table of estimates.
const MOST_ROWS: usize = 1 << 20;

impl Prepared for Sampled {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        Ok(answers(model, self, case.inputs, case.sampling)?.into_iter().map(Found::Answer).collect())
    }
}

fn answers(
    model: &Model,
    route: &Sampled,
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    let setting = Setting::new(model, inputs)?;
    let ask = &route.asks[0];
    let observations = Observations::of(&setting, ask)?;
    let mut kept: Vec<usize> = route
        .asks
        .iter()
        .flat_map(|ask| &ask.searched)
        .flat_map(|item| setting.slots_of(item.variable))
        .collect();
    kept.sort_unstable();
    kept.dedup();
    fits(model.ask_text(ask), &kept, sampling)?;
    let by = if route.by == Strategy::Gibbs { gibbs } else { weigh };
    let drawn = by(&setting, &route.steps, &observations, &kept, sampling);
    let unmet = match &drawn {
        Ok(draws) => draws.is_impossible().then(|| draws.count()),
        Err(Error::Unmet { draws, .. }) => Some(*draws),
        Err(_) => None,
    };
    if let Some(draws) = unmet {
        return Err(setting.unmet(model.ask_text(ask), &observations.values, draws));
    }
    let draws = Arc::new(drawn?);
    let known = ask
        .known
        .iter()
        .any(|known| !matches!(known.evidence, Finding::Each) || known_real(model, known.variable));
    let one = |ask: &Ask| {
        let mut answer = answer(&setting, ask, &draws, &kept, (sampling, route.by), known)?;
        if let (Some(estimate), true) = (&mut answer.estimate, route.over_budget) {
            let others = estimate.warning.take().map_or_else(String::new, |other| format!("; {other}"));
            estimate.warning = Some(format!("{}, so the answer is estimated{others}", route.reason));
        }
        Ok(answer)
    };
    route.asks.iter().map(one).collect()
}

/// Refuses more draws than memory holds.
fn fits(name: String, kept: &[usize], sampling: Sampling) -> Result<(), Error> {
    // For each draw: its values, stored twice while they are gathered, and its weight.
    let cells = sampling.particles as f64 * (2.0 * kept.len() as f64 + 8.0);
    match memory::free() {
        Some(free) if 8.0 * cells > free => {
            let help = "make fewer draws (--particles), or search fewer variables".to_owned();
            Err(Error::TooLarge { name, cells, most: (free / 8.0).floor(), help })
        }
        _ => Ok(()),
    }
}

fn known_real(model: &Model, variable: crate::ids::VariableId) -> bool {
    !model.variables[variable].domain.is_finite()
}

/// The estimate of one ask.
pub(crate) fn answer(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Arc<Draws>,
    kept: &[usize],
    (sampling, by): (Sampling, Strategy),
    known: bool,
) -> Result<Answer, Error> {
    let ln_evidence = draws.ln_evidence().filter(|_| known);
    Ok(Answer {
        question: setting.model.ask_text(ask),
        ln_evidence: ln_evidence.map(|[ln, _]| ln),
        estimate: Some(estimate(draws, ln_evidence.map(|[_, error]| error), sampling)),
        answer: rows(setting, ask, draws, kept, &[])?,
        strategy: by,
        when: ask.when,
        parts: vec![part(setting, ask, draws, kept, &[])],
    })
}

/// The draws of the searched variables of an ask.
pub(crate) fn part(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Arc<Draws>,
    kept: &[usize],
    linear: &[(usize, Moments)],
) -> Part {
    let slots: Vec<usize> = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
    let drawn = |slot: &usize| match kept.iter().position(|own| own == slot) {
        Some(position) => Drawn::At(position),
        None => {
            let own = linear.iter().find(|(own, _)| own == slot);
            Drawn::Moments(own.expect("internal: what is searched is kept").1)
        }
    };
    let drawn = slots.iter().map(drawn).collect();
    Part {
        instant: None,
        given: Vec::new(),
        of: slots.iter().map(|slot| Slot::of(setting, *slot)).collect(),
        law: PartLaw::Draws(Arc::clone(draws), drawn),
    }
}

fn estimate(draws: &Draws, ln_evidence_error: Option<f64>, sampling: Sampling) -> Estimate {
    let effective = draws.effective();
    let warning = match draws.r_hat() {
        _ if progress::is_stopped() => {
            let made = draws.count();
            Some(format!("interrupted: {made} draws were made, of the {} asked for", sampling.particles))
        }
        Some(r_hat) if r_hat > MOST_R_HAT => Some(format!(
            "the chains have not converged (R-hat {r_hat:.2} > {MOST_R_HAT}); take more draws (--particles), or \
             use `--by weighting`"
        )),
        Some(_) if effective < FEW => Some(format!(
            "the effective number of draws is {effective:.0}: the chains mix slowly; take more draws (--particles)"
        )),
        None if effective < FEW => Some(format!(
            "the effective number of draws is {effective:.0}: the evidence is improbable a priori; take more draws \
             (--particles)"
        )),
        _ => None,
    };
    Estimate { particles: draws.count(), effective, seed: sampling.seed, ln_evidence_error, warning }
}

/// The rows of an ask: a probability for each combination of finite values; the moments of each real, which are known
/// for those in `linear`.
pub(crate) fn rows(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Draws,
    kept: &[usize],
    linear: &[(usize, Moments)],
) -> Result<Vec<Row>, Error> {
    let model = setting.model;
    let position =
        |slot: usize| kept.iter().position(|own| *own == slot).expect("internal: what is searched is kept");
    let (mut finite, mut reals) = (Vec::new(), Vec::new());
    for item in &ask.searched {
        for slot in setting.slots_of(item.variable) {
            match model.variables[item.variable].domain.is_finite() {
                true => finite.push((slot, item.at.clone())),
                false => reals.push(slot),
            }
        }
    }
    let mut rows = Vec::new();
    if ask.statistic == Statistic::Distribution && !finite.is_empty() {
        let count = |slot: usize| setting.count(setting.variable_of(slot));
        let cells = finite
            .iter()
            .map(|(slot, _)| count(*slot))
            .try_fold(1usize, |cells, count| cells.checked_mul(count).filter(|cells| *cells <= MOST_ROWS));
        let Some(cells) = cells else {
            let cells = finite.iter().map(|(slot, _)| count(*slot) as f64).product();
            let (name, help) = (model.ask_text(ask), "search fewer variables at once".to_owned());
            return Err(Error::TooLarge { name, cells, most: MOST_ROWS as f64, help });
        };
        for cell in 0..cells {
            let values = radix::in_order(cell, finite.iter().map(|(slot, _)| count(*slot)));
            let wanted = |((slot, at), value): (&(usize, Option<Value>), &usize)| match at {
                None => true,
                Some(Value::Ordinal(ordinal)) => ordinal == value,
                Some(Value::Given(name)) => {
                    let domain = &model.variables[setting.variable_of(*slot)].domain;
                    let given =
                        setting.given(name).and_then(|given| domain.ordinal_among(*given.first()?, None));
                    given == Some(*value)
                }
                Some(Value::Real(number)) => {
                    setting.value_at(setting.variable_of(*slot), *number) == Some(*value as f64)
                }
            };
            if !finite.iter().zip(&values).all(wanted) {
                continue;
            }
            let holds = |draw: usize| {
                let agrees = |((slot, _), value): (&(usize, Option<Value>), &usize)| {
                    draws.value(draw, position(*slot)) == *value as f64
                };
                if finite.iter().zip(&values).all(agrees) { 1.0 } else { 0.0 }
            };
            let [p, error] = draws.mean(holds);
            let name = |(slot, _): &(usize, Option<Value>), value: usize| {
                let domain = &model.variables[setting.variable_of(*slot)].domain;
                (setting.slot_name(*slot), domain.value_name(value))
            };
            let values = finite.iter().zip(values).map(|(slot, value)| name(slot, value)).collect();
            rows.push(Row { values, figure: Figure::Estimated { p, error } });
        }
    }
    let numbers = finite.iter().map(|(slot, _)| *slot).filter(|_| ask.statistic != Statistic::Distribution);
    for slot in numbers.chain(reals) {
        let variable = setting.variable_of(slot);
        if let Some((_, of)) = linear.iter().find(|(own, _)| *own == slot) {
            let figure = match ask.statistic {
                Statistic::Expectation => {
                    Figure::Expectation { expectation: of.mean[0], error: Some(of.mean[1]) }
                }
                Statistic::Variance => {
                    let [deviation, error] = of.deviation;
                    Figure::Variance { variance: deviation.powi(2), error: Some(2.0 * deviation * error) }
                }
                _ => Figure::Real { mean: of.mean, deviation: of.deviation, quantiles: of.quantiles },
            };
            rows.push(Row { values: vec![(setting.slot_name(slot), String::new())], figure });
            continue;
        }
        let at = position(slot);
        let number = |draw: usize| setting.number_at(variable, draws.value(draw, at));
        let figure = match ask.statistic {
            Statistic::Expectation => {
                let [expectation, error] = draws.mean(number);
                Figure::Expectation { expectation, error: Some(error) }
            }
            Statistic::Variance => {
                let [mean, _] = draws.mean(number);
                let [variance, error] = draws.mean(|draw| (number(draw) - mean).powi(2));
                Figure::Variance { variance, error: Some(error) }
            }
            _ => {
                let of = draws.moments(at);
                Figure::Real { mean: of.mean, deviation: of.deviation, quantiles: of.quantiles }
            }
        };
        rows.push(Row { values: vec![(setting.slot_name(slot), String::new())], figure });
    }
    Ok(rows)
}
