//! Questions over time, as functions of a page.
//!
//! In: a question over time, and its route. Out: the kernels of its kinds of instants, and [`Steps`]: how a page runs them.
//! Invariant: the numbers are those of the host, of finite states and of linear normal laws; what is not exact is refused.

use super::missing::with_missing;
use super::now::{law, sized};
use super::run::{State, Steps, Way};
use super::shown::{of_law, of_table};
use super::{Part, Refused};
use crate::analysis::relevant_variables;
use crate::ids::VariableId;
use crate::kernel::{InputKey, Kernel, OutputKey};
use crate::lower::{Lowered, NormalLowered, Phase, Step};
use crate::model::{Ask, Model, Searched, Statistic, When};
use crate::plan::{InstantCode, OverTime, Strategy};
use crate::strategies::Offered;

/// The functions of a question over time.
pub(super) fn followed(
    model: &Model,
    route: &OverTime,
    run: usize,
    name: &str,
) -> Result<Vec<Part>, Refused> {
    // The statistic is computed from the distribution.
    let distribution = Ask { statistic: Statistic::Distribution, ..route.ask().clone() };
    let route = OverTime { asks: vec![distribution], ..route.clone() };
    let ask = route.ask();
    if ask.searched.iter().any(|item| model.is_predicate(item.variable))
        && route.strategy() != Strategy::Chain
    {
        return Err(Refused::of(model, ask, "it asks for a predicate of reals"));
    }
    let absent = route.absent_at_first(model).map(|error| error.to_string());
    let steps = Steps { ahead: ask.when.ahead(), absent, ..Steps::default() };
    let part = match (route.strategy(), ask.when) {
        (Strategy::Chain, _) => states(model, &route, steps, run, name),
        (Strategy::Gaussian, _) => normal(model, &route, steps, run, name),
        (by, _) => {
            let by = by.name().replace('_', " ");
            Err(Refused::of(model, ask, format!("it is answered by the strategy {by}, which is not exact")))
        }
    };
    Ok(vec![part?])
}

/// A program and a route, and those of the instants that are predicted.
#[derive(Clone, Copy)]
struct Asked<'m> {
    model: &'m Model,
    route: &'m OverTime,
    ahead: (&'m Model, &'m OverTime),
}

/// Finite states, of which as many observations may be missing as possible.
fn states(model: &Model, route: &OverTime, steps: Steps, run: usize, name: &str) -> Result<Part, Refused> {
    let by = if route.ask().when.is_every_instant() { whole } else { last };
    let asked = Asked { model, route, ahead: (model, route) };
    let part = by(asked, steps.clone(), run, name)?;
    let needed = part.steps.as_ref().map_or(&[][..], |steps| &steps.needed);
    if needed.is_empty() {
        return Ok(part);
    }
    let (model, ask, apart) = with_missing(model, route.ask(), needed);
    let route = OverTime { asks: vec![ask], ..route.clone() };
    // A predicted instant has no observations.
    let asked = Asked { model: &model, route: &route, ..asked };
    // It has more to sum, and may be too large for a page.
    Ok(by(asked, Steps { apart, ..steps }, run, name).unwrap_or(part))
}

/// The kernel of an instant of finite states; what it reads is noted in the steps.
fn instant(
    asked: Asked<'_>,
    phase: Phase,
    name: &str,
    steps: &mut Steps,
) -> Result<(Step, Lowered), Refused> {
    let (model, route) = if phase == Phase::Ahead { asked.ahead } else { (asked.model, asked.route) };
    let InstantCode::Chain { step, mut lowered, .. } = route.instant(model, phase, name, false)? else {
        return Err(Refused::of(model, route.ask(), "it has no states"));
    };
    lowered.kernel = sized(lowered.kernel)?;
    let together = together(&step).into_iter().filter(|name| !steps.together.contains(name));
    steps.together.extend(together.collect::<Vec<_>>());
    for buffer in lowered.kernel.buffers.values() {
        match buffer.role.input() {
            Some(InputKey::Previous(_)) => steps.carried = buffer.name.clone(),
            Some(InputKey::Answer(_)) if phase == Phase::Back || phase == Phase::Both => {
                steps.later = buffer.name.clone()
            }
            Some(InputKey::Value(variable, input)) => {
                let is_state = phase == Phase::Trace && route.carried.iter().any(|(now, _)| now == variable);
                let may_be_absent =
                    step.absent.iter().any(|(own, _)| own == variable) || steps.apart.contains(input);
                if !is_state && !may_be_absent && !steps.needed.contains(input) {
                    steps.needed.push(input.clone());
                }
            }
            _ => {}
        }
    }
    Ok((step, lowered))
}

/// The last instant of finite states.
fn last(asked: Asked<'_>, mut steps: Steps, run: usize, name: &str) -> Result<Part, Refused> {
    let Asked { model, route, .. } = asked;
    let (mut kernels, mut shown) = (Vec::new(), None);
    for phase in route.phases() {
        let (step, lowered) = instant(asked, *phase, name, &mut steps)?;
        kernels.push(lowered.kernel.clone());
        shown = Some((step, lowered));
    }
    let (step, lowered) = shown.ok_or_else(|| Refused::of(model, route.ask(), "it has no instants"))?;
    // The last ask is that of the question; the first is that of what is carried.
    let source = of_table(&step.model, run, &lowered, step.asks.len() - 1)?;
    Ok(Part { kernels, steps: Some(steps), sources: vec![source] })
}

/// All instants of finite states: each given all observations, and for a sequence also the most likely states.
fn whole(asked: Asked<'_>, mut steps: Steps, run: usize, name: &str) -> Result<Part, Refused> {
    let Asked { model, route, .. } = asked;
    let ask = route.ask();
    let is_carried = |item: &Searched| route.carried.iter().any(|(now, _)| *now == item.variable);
    let is_family = |(now, _): &(VariableId, VariableId)| model.variables[*now].family.is_some();
    if !ask.searched.iter().all(is_carried) || route.carried.iter().any(is_family) {
        return Err(Refused::of(
            model,
            ask,
            "of `smooth` and `sequence` it computes carried variables that are no families",
        ));
    }
    let smooth = OverTime { asks: vec![Ask { when: When::Smooth, ..ask.clone() }], ..route.clone() };
    let (mut kernels, mut shown) = (Vec::new(), None);
    for phase in smooth.phases() {
        let (step, lowered) = instant(Asked { route: &smooth, ..asked }, *phase, name, &mut steps)?;
        kernels.push(lowered.kernel.clone());
        shown = Some((step, lowered));
    }
    let (step, lowered) = shown.ok_or_else(|| Refused::of(model, ask, "it has no instants"))?;
    let source = of_table(&step.model, run, &lowered, 0)?;
    steps.way = Way::Smooth;
    if ask.when == When::Sequence {
        steps.way = Way::Sequence;
        for phase in [Phase::Best, Phase::Trace] {
            kernels.push(instant(asked, phase, name, &mut steps)?.1.kernel);
        }
        let states = route.carried.iter().map(|(now, _)| {
            let (name, domain) = (model.variable_name(*now), &model.variables[*now].domain);
            let numbers = (0..domain.count().unwrap_or(0)).map(|ordinal| domain.number(ordinal)).collect();
            State { input: format!("{name} then"), name, numbers }
        });
        steps.states = states.collect();
    }
    Ok(Part { kernels, steps: Some(steps), sources: vec![source] })
}

/// A normal law over time.
fn normal(
    model: &Model,
    route: &OverTime,
    mut steps: Steps,
    run: usize,
    name: &str,
) -> Result<Part, Refused> {
    let ask = route.ask();
    let mut relevant = relevant_variables(model, std::slice::from_ref(ask));
    let carried: Vec<_> =
        route.carried.iter().copied().filter(|(_, before)| relevant.contains(before)).collect();
    let mut asked = Ask { when: When::Filter, ..ask.clone() };
    let mut phases = vec![Phase::First, Phase::Later];
    match ask.when {
        When::Smooth | When::Sequence => {
            steps.way = Way::Smooth;
            // Each instant is corrected by the next one, through what is carried.
            let ends = carried.iter().map(|(now, _)| *now).chain(carried.iter().map(|(_, before)| *before));
            asked.searched.extend(ends.map(|variable| Searched { variable, at: None }));
            relevant.extend(relevant_variables(model, std::slice::from_ref(&asked)));
        }
        When::Predict(1..) => phases.push(Phase::Ahead),
        _ => {}
    }
    let mut made: Vec<NormalLowered> = Vec::new();
    for phase in phases {
        let mut lowered = law(model, &asked, (&carried, &relevant), phase, name)?;
        lowered.kernel = sized(lowered.kernel)?;
        made.push(lowered);
    }
    steps.reals = reals(&made[0].kernel);
    steps.together = together(&made[0].step);
    if steps.reals == 0 {
        return Err(Refused::of(model, ask, "nothing is carried from instant to instant"));
    }
    let source = of_law(model, run, &made[0].searched[..ask.searched.len()]);
    let kernels = made.into_iter().map(|lowered| lowered.kernel).collect();
    Ok(Part { kernels, steps: Some(steps), sources: vec![source] })
}

/// The observations of several numbers that have one input which says whether they are given.
fn together(step: &Step) -> Vec<String> {
    let variables = step.absent.iter().map(|(variable, _)| *variable);
    let several =
        |id: &VariableId| step.model.variables[*id].family.is_some() || step.model.components(*id) > 1;
    variables.filter(several).map(|id| step.model.variable_name(id)).collect()
}

/// The number of reals whose law a kernel hands on.
fn reals(kernel: &Kernel) -> usize {
    let numbers = kernel.outputs().filter(|(_, key)| matches!(key, OutputKey::Law(_))).count();
    // Means, and covariances up to the diagonal.
    (0..).find(|count| count + count * (count + 1) / 2 >= numbers).unwrap_or(0)
}
