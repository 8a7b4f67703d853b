//! The offer of particle filters: questions over time whose carried belief has no exact form.
//!
//! In: an ask over time. Out: a route whose linear variables are not drawn. Invariant: an accepted
//! offer answers. Where earlier instants are asked given later observations, nothing is integrated: paths are lists of values.

use super::{guide, linear};
use crate::analysis::{Scope, carried, of_form};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Known, Model, When};
use crate::strategies::chain;
use crate::strategies::over_time::{self, By, OverTime};
use crate::strategies::weighting::refused_factor;
use crate::strategies::{self, Route, Turn, refused};

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], _: &Turn<'_>) -> Result<Route, Error> {
        let ask = &asks[0];
        over_time::check(model, ask)?;
        let carried = carried(model);
        let reason = chain::refusal(model, ask, &carried);
        if reason.is_none() || ask.when == When::Sequence {
            over_time::check_sequence(model, ask)?;
        }
        let reason = reason.unwrap_or_else(|| "it is answered exactly, instant by instant".to_owned());
        let all_drawn = ask.when.is_every_instant() || over_time::draws_reals(model, ask);
        let linear = if all_drawn { Vec::new() } else { linear(model) };
        let why = over_time::not_of_reals(model, ask)
            .or_else(|| virtually(model, ask))
            .or_else(|| model.factors.values().find_map(|factor| refused_factor(model, factor)))
            .or_else(|| never_met(model, ask, &linear));
        if let Some(why) = why {
            return Err(refused(model, asks, &format!("{reason}; and {why}")));
        }
        let guided = guide::applies(model, ask);
        let by = By::Particles { linear, reason, guided };
        Ok(Route::OverTime(OverTime { asks: asks.to_vec(), carried, by }))
    }
}

/// The reason why virtual evidence on a variable cannot weigh draws.
fn virtually(model: &Model, ask: &Ask) -> Option<String> {
    let known = ask.known.iter().find(|known| matches!(known.evidence, Finding::Virtual(_)))?;
    let name = model.variable_name(known.variable);
    Some(format!("draws are weighted by observations: `{name}` has a likelihood"))
}

/// The reason why no draw would ever meet an observation.
fn never_met(model: &Model, ask: &Ask, linear: &[VariableId]) -> Option<String> {
    // It depends on reals, all of which are drawn.
    let reads_drawn = |id: VariableId| {
        let read = model.factor_of(id).map_or_else(Scope::new, |factor| of_form(model, factor));
        let mut reals = read.iter().filter(|parent| !model.variables[**parent].domain.is_finite()).peekable();
        reals.peek().is_some() && reals.all(|parent| !linear.contains(parent))
    };
    let is_exact = |known: &&Known| {
        let variable = &model.variables[known.variable];
        let form = model.factor_of(known.variable).map(|factor| &model.factors[factor].form);
        !variable.domain.is_finite()
            && variable.derived.is_none()
            && form.is_some_and(|form| form.has_point())
            && reads_drawn(known.variable)
    };
    let name = model.variable_name(ask.known.iter().find(is_exact)?.variable);
    Some(format!(
        "`{name}` is observed, and has a `dirac` form: no draw would ever meet the value; observe it with some noise, \
         `normal(…, deviation)`"
    ))
}
