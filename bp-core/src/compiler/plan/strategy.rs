//! The choice of a strategy: the offers of all for some asks, and the accepted one.
//!
//! In: asks with the same known variables. Out: an [`Offer`] of each strategy, and the route of the accepted one.
//! Invariant: offers depend on the program and the question alone, never on the machine; an exact offer is preferred to
//! an estimate, and exact ones have a fixed order; `explain` and `ask` read the same offers.

use super::{Options, Route, Strategy};
use crate::error::Error;
use crate::model::{Ask, Model};
use crate::strategies::{Turn, engine, refused};
use serde::Serialize;

/// The offer of a strategy for some asks.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Offer {
    /// The strategy.
    pub strategy: Strategy,
    /// Whether its answer is exact.
    pub exact: bool,
    /// The number of summed products, where it is known in advance; unknown sizes count 16.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub products: Option<f64>,
    /// The reason why it cannot answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refusal: Option<String>,
    /// Whether this offer is accepted.
    pub taken: bool,
}

/// The route of the accepted strategy for asks with the same known variables, and the offers of all.
///
/// # Errors
/// No strategy answers, or not the one that the user chose.
pub(super) fn choose(model: &Model, asks: &[Ask], options: Options) -> Result<(Route, Vec<Offer>), Error> {
    let over_time = asks[0].when.is_over_time();
    let mut offers: Vec<Offer> = Vec::new();
    let mut taken: Option<Route> = None;
    let mut refusals: Vec<(Strategy, Error)> = Vec::new();
    for strategy in Strategy::ALL {
        if !(if over_time { strategy.is_over_time() } else { strategy.is_of_one_instant() }) {
            continue;
        }
        let wanted = options.by.is_none_or(|by| by == strategy);
        // Gibbs sampling is used only where the user chooses it: no rule predicts whether it beats likelihood
        // weighting.
        let wanted = wanted && (strategy != Strategy::Gibbs || options.by.is_some());
        if taken.is_some() && !options.all_offers {
            break;
        }
        let reason = refusals.iter().find(|(own, _)| matches!(own, Strategy::Sums | Strategy::Chain));
        let tree = offers.iter().any(|it| it.strategy == Strategy::JoinTree && it.refusal.is_none());
        let turn = Turn {
            options,
            forced: options.by == Some(strategy),
            by_tree: tree,
            not_exact: reason.map(|(_, error)| error),
        };
        let route = match options.elements && strategy != Strategy::JoinTree {
            true => Err(refused(
                model,
                asks,
                "an element of a family is observed alone: only a join tree takes that",
            )),
            false => engine(strategy).offer(model, asks, &turn),
        };
        let (products, refusal) = match &route {
            Ok(route) => (route.offered().cost(), None),
            Err(error) => (None, Some(reason_of(error))),
        };
        // A finite question that is too large is an error to mend; it is not estimated.
        let stop = refusals.iter().any(|(own, error)| {
            *own == Strategy::Sums && !matches!(error, Error::Unplanned { .. }) && options.by.is_none()
        });
        let take = wanted && taken.is_none() && !stop && route.is_ok();
        offers.push(Offer { strategy, exact: strategy.is_exact(), products, refusal, taken: take });
        match route {
            Ok(route) if take => taken = Some(route),
            Ok(_) => {}
            Err(error) => refusals.push((strategy, error)),
        }
    }
    if let Some(route) = taken {
        return Ok((route, offers));
    }
    let refused = |strategy: Strategy| refusals.iter().position(|(own, _)| *own == strategy);
    let told = match options.by {
        Some(by) => refused(by),
        // The error of the last strategy also gives the reasons of the others.
        None => {
            let sums =
                refused(Strategy::Sums).filter(|at| !matches!(refusals[*at].1, Error::Unplanned { .. }));
            let last = if over_time { Strategy::Particles } else { Strategy::Weighting };
            sums.or(refused(last)).or(refused(Strategy::Sums))
        }
    };
    match told {
        Some(position) => Err(refusals.swap_remove(position).1),
        None => {
            let by = options.by.map_or("no strategy", Strategy::name);
            let reason = match over_time {
                true => format!("`{by}` does not answer questions over time"),
                false => format!("`{by}` answers questions over time only"),
            };
            Err(Error::Unplanned { question: model.ask_text(&asks[0]), reason })
        }
    }
}

fn reason_of(error: &Error) -> String {
    match error {
        Error::Unplanned { reason, .. } => reason.clone(),
        other => other.to_string(),
    }
}
