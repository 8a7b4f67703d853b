//! The offer of particle filters: questions over time whose carried belief has no exact form.
//!
//! In: an ask over time. Out: a route whose linear variables are not drawn. Invariant: draws go forward only.

use super::linear;
use crate::error::Error;
use crate::model::{Ask, Finding, Model};
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
        let carried = over_time::carried(model);
        let reason = chain::refusal(model, ask, &carried);
        if reason.is_none() {
            over_time::check_sequence(model, ask)?;
        }
        let reason = reason.unwrap_or_else(|| "it is answered exactly, instant by instant".to_owned());
        let why = over_time::not_of_reals(model, ask)
            .or_else(|| virtually(model, ask))
            .or_else(|| {
                let word = ask.when.word();
                let back = ask.when.is_every_instant();
                back.then(|| format!("draws go forward only: ask for `filter`, not `{word}`"))
            })
            .or_else(|| model.factors.values().find_map(|factor| refused_factor(model, factor)));
        if let Some(why) = why {
            return Err(refused(model, asks, &format!("{reason}; and {why}")));
        }
        let by = By::Particles { linear: linear(model), reason };
        Ok(Route::OverTime(OverTime { asks: asks.to_vec(), carried, by }))
    }
}

/// The reason why virtual evidence on a variable cannot weigh draws.
fn virtually(model: &Model, ask: &Ask) -> Option<String> {
    let known = ask.known.iter().find(|known| matches!(known.evidence, Finding::Virtual(_)))?;
    let name = model.variable_name(known.variable);
    Some(format!("draws are weighted by observations: `{name}` has a likelihood"))
}
