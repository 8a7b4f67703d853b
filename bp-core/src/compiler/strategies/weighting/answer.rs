//! Answers estimated from draws.
//!
//! In: a sampled route and the host's inputs. Out: [`Answer`]s, each number with its standard error. Invariant:
//! evidence that no draw meets is an error, and a small effective sample size gives a warning.

use super::refusal::check_variance;
use super::{Sampled, weigh};
use crate::distribution::Setting;
use crate::door::Advice;
use crate::equation::Strategy;
use crate::error::Error;
use crate::exec::Inputs;
use crate::memory;
use crate::model::{Ask, Finding, Model, Statistic, Value};
use crate::posterior::{
    Answer, Drawn, Estimate, Figure, Part, PartLaw, Row, Slot, argmax, check_draws, figures,
};
use crate::progress;
use crate::radix;
use crate::random::seeded;
use crate::sample::{Draws, MOST_R_HAT, Normals, Observations, Sampling};
use crate::spelling::exact;
use crate::strategies::gibbs::gibbs;
use crate::strategies::{Case, Found, Prepared};
use rand::RngExt;
use std::cmp::Ordering;
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
    route.asks.iter().try_for_each(|ask| check_variance(&setting, ask))?;
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
    let weighted = || {
        let posterior = route.conjugate.as_ref();
        let posterior = posterior.map(|it| it.marginal(&setting, ask, &observations.values)).transpose()?;
        weigh(&setting, &route.steps, &observations, posterior.as_ref(), &kept, sampling)
    };
    let mut by = route.by;
    let drawn = match by {
        Strategy::Gibbs => gibbs(&setting, &route.steps, &observations, &route.integrated, &kept, sampling),
        _ => weighted(),
    };
    let drawn = match drawn {
        Err(Error::Unplanned { .. } | Error::Unmet { .. }) if route.or_weighting => {
            by = Strategy::Weighting;
            weighted()
        }
        drawn => drawn,
    };
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
        let mut answer = answer(&setting, ask, &draws, &kept, (sampling, by), known)?;
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
            let help = format!("make fewer draws (`{}`), or search fewer variables", Advice::Draws);
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
        answer: rows(setting, ask, draws, kept, (&[], sampling.seed))?.into(),
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
    linear: &[(usize, Normals)],
) -> Part {
    let slots: Vec<usize> = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
    let drawn = |slot: &usize| match kept.iter().position(|own| own == slot) {
        Some(position) => Drawn::At(position),
        None => {
            let own = linear.iter().find(|(own, _)| own == slot);
            Drawn::Normals(own.expect("internal: a searched slot is kept").1.clone())
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
            "the chains have not converged (R-hat {r_hat:.2} > {MOST_R_HAT}); take more draws (`{}`), or use `{}`",
            Advice::Draws,
            Advice::By("weighting")
        )),
        Some(_) if effective < FEW => Some(format!(
            "the effective number of draws is {effective:.0}: the chains mix slowly; take more draws (`{}`)",
            Advice::Draws
        )),
        None if effective < FEW => Some(format!(
            "the effective number of draws is {effective:.0}: the evidence is improbable a priori; take more draws (`{}`)",
            Advice::Draws
        )),
        _ => None,
    };
    Estimate { particles: draws.count(), effective, seed: sampling.seed, ln_evidence_error, warning }
}

/// The rows of an ask: a probability for each combination of finite values, or the most frequent ones; the moments, quantiles or
/// the mode of each real, of which those in `linear` were not drawn; `seed` is that of draws that are asked for.
pub(crate) fn rows(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Arc<Draws>,
    kept: &[usize],
    (linear, seed): (&[(usize, Normals)], u64),
) -> Result<Vec<Row>, Error> {
    let model = setting.model;
    let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
    let (finite, reals): (Vec<usize>, Vec<usize>) =
        slots.partition(|slot| model.variables[setting.variable_of(*slot)].domain.is_finite());
    let row = |slot: usize, figure| Row { values: vec![(setting.slot_name(slot), String::new())], figure };
    let modes = matches!(ask.statistic, Statistic::Argmax { .. } | Statistic::Maximum);
    let by_cells = matches!(ask.statistic, Statistic::Distribution | Statistic::Entropy | Statistic::Best(_));
    let mut rows = Vec::new();
    if (modes || by_cells) && !finite.is_empty() {
        rows = cells(setting, ask, draws, kept, &finite)?;
    }
    match &ask.statistic {
        Statistic::Entropy => return Ok(vec![entropy(setting, draws, kept, &finite, &rows)]),
        Statistic::Best(count) => {
            rows.retain(|row| row.p() > Some(0.0));
            rows.sort_by(|one, other| other.p().partial_cmp(&one.p()).unwrap_or(Ordering::Equal));
            rows.truncate(*count);
            return Ok(rows);
        }
        Statistic::Draw(count) => return drawn(setting, ask, draws, kept, *count, seed),
        _ => {}
    }
    if modes {
        let scores: Vec<f64> = rows.iter().filter_map(Row::p).collect();
        let mut best: Vec<Row> = argmax(&scores, None).into_iter().map(|at| rows[at].clone()).collect();
        if ask.statistic == Statistic::Maximum {
            best.truncate(1);
        }
        let mode = |slot: &usize| {
            let position = kept.iter().position(|own| own == slot).expect("internal: the offer has looked");
            let values = vec![(setting.slot_name(*slot), exact(draws.mode(position)))];
            Row { values, figure: Figure::Mode { by: Figure::MODES[0] } }
        };
        best.extend(reals.iter().map(mode));
        return Ok(best);
    }
    let part = part(setting, ask, draws, kept, linear);
    let place = |slot: usize| {
        let own = Slot::of(setting, slot);
        part.of.iter().position(|other| *other == own).expect("internal: a searched slot is in the part")
    };
    let numbers = finite.iter().copied().filter(|_| ask.statistic != Statistic::Distribution);
    for slot in numbers.chain(reals) {
        let quantiles = |levels: &[f64]| part.quantiles(model, place(slot), levels);
        if let Some(figures) = figures(&ask.statistic, quantiles) {
            rows.extend(figures.into_iter().map(|figure| row(slot, figure)));
            continue;
        }
        let variable = setting.variable_of(slot);
        let figure = match (linear.iter().find(|(own, _)| *own == slot), &ask.statistic) {
            (Some((_, own)), Statistic::Expectation) => {
                let [expectation, error] = own.moments.mean;
                Figure::Expectation { expectation, error: Some(error) }
            }
            (Some((_, own)), Statistic::Variance) => {
                let [variance, error] = own.moments.variance;
                Figure::Variance { variance, error: Some(error) }
            }
            (Some((_, own)), _) => Figure::real(&own.moments),
            (None, statistic) => {
                let at = kept.iter().position(|own| *own == slot).expect("internal: a searched slot is kept");
                let number = |draw: usize| setting.number_at(variable, draws.value(draw, at));
                match statistic {
                    Statistic::Expectation => {
                        let [expectation, error] = draws.mean(number);
                        Figure::Expectation { expectation, error: Some(error) }
                    }
                    Statistic::Variance => {
                        let [mean, _] = draws.mean(number);
                        let [variance, error] = draws.mean(|draw| (number(draw) - mean).powi(2));
                        Figure::Variance { variance, error: Some(error) }
                    }
                    _ => Figure::real(&draws.moments(at)),
                }
            }
        };
        rows.push(row(slot, figure));
    }
    Ok(rows)
}

/// −E[ln p] over the draws, where p is the share of the draws with the same values.
fn entropy(setting: &Setting<'_>, draws: &Draws, kept: &[usize], finite: &[usize], cells: &[Row]) -> Row {
    let places = finite.iter().map(|slot| {
        let position = kept.iter().position(|own| own == slot).expect("internal: a searched slot is kept");
        (position, setting.count(setting.variable_of(*slot)))
    });
    let places: Vec<(usize, usize)> = places.collect();
    let surprise = |draw: usize| {
        let digits = places.iter().map(|(at, count)| (draws.value(draw, *at) as usize, *count));
        let p = cells[radix::position(digits)].p().unwrap_or(0.0);
        if p > 0.0 { -p.ln() } else { 0.0 }
    };
    let [entropy, error] = draws.mean(surprise);
    Row { values: Vec::new(), figure: Figure::Entropy { entropy: entropy.max(0.0), error: Some(error) } }
}

/// Some of the draws, chosen in proportion to their weights.
fn drawn(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Draws,
    kept: &[usize],
    count: usize,
    seed: u64,
) -> Result<Vec<Row>, Error> {
    let model = setting.model;
    let slots: Vec<usize> = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
    check_draws(|| model.ask_text(ask), count as f64 * slots.len() as f64)?;
    let mut reached = 0.0;
    let sums = (0..draws.count()).map(|draw| {
        reached += draws.weight(draw);
        reached
    });
    let sums: Vec<f64> = sums.collect();
    let mut random = seeded(seed, &model.ask_text(ask));
    let positions = slots.iter().map(|slot| kept.iter().position(|own| own == slot));
    let positions: Vec<usize> = positions.collect::<Option<_>>().expect("internal: a searched slot is kept");
    let value = |draw: usize, (slot, at): (&usize, &usize)| {
        let (variable, value) = (setting.variable_of(*slot), draws.value(draw, *at));
        let text = match model.variables[variable].domain.is_finite() {
            true => model.value_name(variable, value as usize),
            false => exact(value),
        };
        (setting.slot_name(*slot), text)
    };
    let mut row = |number: usize| {
        let at = random.random::<f64>() * reached;
        let draw = sums.partition_point(|sum| *sum <= at).min(draws.count() - 1);
        let values = slots.iter().zip(&positions).map(|place| value(draw, place)).collect();
        Row { values, figure: Figure::Draw { draw: number } }
    };
    Ok((1..=count).map(&mut row).collect())
}

/// The probability of each combination of values of some finite slots that agrees with the values of the question.
fn cells(
    setting: &Setting<'_>,
    ask: &Ask,
    draws: &Draws,
    kept: &[usize],
    finite: &[usize],
) -> Result<Vec<Row>, Error> {
    let model = setting.model;
    let counts: Vec<usize> = finite.iter().map(|slot| setting.count(setting.variable_of(*slot))).collect();
    let cells = counts
        .iter()
        .try_fold(1usize, |cells, count| cells.checked_mul(*count).filter(|cells| *cells <= MOST_ROWS));
    let Some(cells) = cells else {
        let cells = counts.iter().map(|count| *count as f64).product();
        let (name, help) = (model.ask_text(ask), "search fewer variables at once".to_owned());
        return Err(Error::TooLarge { name, cells, most: MOST_ROWS as f64, help });
    };
    let positions: Vec<usize> = finite
        .iter()
        .map(|slot| kept.iter().position(|own| own == slot).expect("internal: a searched slot is kept"))
        .collect();
    let at = |slot: &usize| {
        let variable = setting.variable_of(*slot);
        ask.searched.iter().find(|item| item.variable == variable).and_then(|item| item.at.as_ref())
    };
    let wanted = |(slot, value): (&usize, &usize)| {
        let variable = setting.variable_of(*slot);
        match at(slot) {
            None => true,
            Some(Value::Ordinal(ordinal)) => ordinal == value,
            Some(Value::Given(name)) => {
                let domain = &model.variables[variable].domain;
                let given = setting.given(name).and_then(|given| domain.ordinal_among(*given.first()?, None));
                given == Some(*value)
            }
            Some(Value::Real(number)) => setting.value_at(variable, *number) == Some(*value as f64),
            // A vector has no finite slots.
            Some(Value::Vector(_)) => false,
        }
    };
    let mut rows = Vec::new();
    for cell in 0..cells {
        let values = radix::in_order(cell, counts.iter().copied());
        if !finite.iter().zip(&values).all(wanted) {
            continue;
        }
        let agrees = |draw: usize| {
            let same = |(at, value): (&usize, &usize)| draws.value(draw, *at) == *value as f64;
            f64::from(u8::from(positions.iter().zip(&values).all(same)))
        };
        let [p, mut error] = draws.mean(agrees);
        // Where no draw, or each, has it: the deviation of a share of which nothing else is known.
        if error == 0.0 {
            error = 1.0 / (draws.effective().max(1.0) + 2.0);
        }
        let name = |(slot, value): (&usize, &usize)| {
            let domain = &model.variables[setting.variable_of(*slot)].domain;
            (setting.slot_name(*slot), domain.value_name(*value))
        };
        let values = finite.iter().zip(&values).map(name).collect();
        rows.push(Row { values, figure: Figure::Estimated { p, error } });
    }
    Ok(rows)
}
