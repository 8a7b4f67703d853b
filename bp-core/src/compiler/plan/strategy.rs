//! The choice of a strategy: the offers of all for some asks, and the accepted one.
//!
//! In: asks with the same known variables. Out: an [`Offer`] of each strategy, and the route of the accepted one.
//! Invariant: offers depend on the program and the question alone, never on the machine; the cheapest exact offer is
//! accepted, or an estimate if there is none or it exceeds the user's budget; `explain` and `ask` read the same offers.

use super::{Options, Route, Strategy};
use crate::analysis::relevant_factors;
use crate::error::Error;
use crate::ids::FactorId;
use crate::model::{Ask, Form, Model};
use crate::numbers::count;
use crate::strategies::{Turn, engine, gaussian, refused};
use serde::Serialize;

/// From this number of products on, in about a tenth of a second, building a join tree of the elements of families takes less time than
/// loops may.
const MANY_PRODUCTS: f64 = 1e7;

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
    /// The reason why it is accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choice: Option<String>,
}

/// The route of the accepted strategy for asks with the same known variables, and the offers of all.
///
/// # Errors
/// No strategy answers, or not the one that the user chose.
pub(super) fn choose(model: &Model, asks: &[Ask], options: Options) -> Result<(Route, Vec<Offer>), Error> {
    let over_time = asks[0].when.is_over_time();
    let mut market = Market {
        model,
        asks,
        options,
        made: Vec::new(),
        refusals: Vec::new(),
        by_element: false,
        excess: None,
    };
    let of_this_time = |one: &Strategy| if over_time { one.is_over_time() } else { one.is_of_one_instant() };
    let (exact, estimates): (Vec<Strategy>, Vec<Strategy>) =
        Strategy::ALL.into_iter().filter(of_this_time).partition(|one| one.is_exact());
    let named = |one: Strategy| options.by.is_none_or(|by| by == one);
    // The refusals of exact strategies are also the reason given with an estimate that the user chooses.
    for strategy in exact {
        if options.all_offers || named(strategy) || options.by.is_some_and(|by| !by.is_exact()) {
            market.offer(strategy);
        }
    }
    market.ask_for_elements();
    let cheapest = market.cheapest();
    let too_large = market.refusal(Strategy::Sums).is_some_and(is_of_size);
    market.excess = cheapest.and_then(|at| market.exceeds(at));
    // A finite question that is too large is an error to mend; it is estimated only if the user sets a budget.
    let estimate = match options.by {
        Some(by) => !by.is_exact(),
        None => market.excess.is_some() || cheapest.is_none() && (!too_large || options.budget.is_some()),
    };
    let mut drawn = None;
    for strategy in estimates {
        // Where much is observed few draws of the prior count, and Gibbs sampling is taken. The error of a linearised law is not
        // known: it answers only where the user chooses it.
        let on_request = strategy == Strategy::ExtendedKalman;
        let wanted = estimate && named(strategy) && (!on_request || options.by.is_some());
        if options.all_offers || wanted && (drawn.is_none() || strategy == Strategy::Gibbs) {
            market.offer(strategy);
            let weighted = drawn.is_some();
            let is_better = match market.made.last_mut().and_then(|(_, route)| route.as_mut()) {
                Some(Route::Sampled(sampled)) if strategy == Strategy::Gibbs && options.by.is_none() => {
                    sampled.or_weighting = weighted;
                    sampled.is_preferred(!weighted)
                }
                Some(_) => drawn.is_none(),
                None => false,
            };
            if wanted && is_better {
                drawn = Some(market.made.len() - 1);
            }
        }
    }
    match drawn.or(cheapest) {
        Some(at) => Ok(market.take(at)),
        None => Err(market.refused(over_time)),
    }
}

/// The offers for some asks.
struct Market<'m> {
    model: &'m Model,
    asks: &'m [Ask],
    options: Options,
    made: Vec<(Offer, Option<Route>)>,
    refusals: Vec<(Strategy, Error)>,
    /// Whether loops over elements of families take too many products.
    by_element: bool,
    /// The error that the cheapest exact offer exceeds the budget.
    excess: Option<Error>,
}

impl Market<'_> {
    /// Asks a strategy for its offer.
    fn offer(&mut self, strategy: Strategy) {
        let (model, asks, options) = (self.model, self.asks, self.options);
        let mut refusals = self.refusals.iter();
        let not_exact = refusals.find(|(own, _)| matches!(own, Strategy::Sums | Strategy::Chain));
        let too_large = not_exact.is_some_and(|(_, error)| is_of_size(error)) && options.budget.is_some();
        let outruns = |(_, route): &(Offer, Option<Route>)| matches!(route, Some(Route::Tree(tree)) if tree.outruns_loops);
        let turn = Turn {
            options,
            forced: options.by == Some(strategy),
            by_element: self.by_element,
            by_tree: self.made.iter().any(outruns),
            not_exact: self.excess.as_ref().or(not_exact.map(|(_, error)| error)),
            over_budget: self.excess.is_some() || too_large,
        };
        let route = match options.elements && strategy != Strategy::JoinTree {
            true => Err(refused(
                model,
                asks,
                "an element of a family is observed alone, which only a join tree takes here; ask one variable at a time, \
                 such as `P(X | F[1] = true)`",
            )),
            false => engine(strategy).offer(model, asks, &turn),
        };
        let (products, refusal) = match &route {
            Ok(route) => (route.offered().cost(model), None),
            Err(error) => (None, Some(reason_of(error))),
        };
        let exact = strategy.is_exact();
        let offer = Offer { strategy, exact, products, refusal, taken: false, choice: None };
        let route = route.map_err(|error| self.refusals.push((strategy, error))).ok();
        self.made.push((offer, route));
    }

    /// Asks for a join tree of the elements of families, which loops take together, where loops take many products.
    fn ask_for_elements(&mut self) {
        let place = |strategy: Strategy| self.made.iter().position(|(offer, _)| offer.strategy == strategy);
        let (Some(sums), Some(tree)) = (place(Strategy::Sums), place(Strategy::JoinTree)) else { return };
        let is_long = |(offer, route): &(Offer, Option<Route>)| match route {
            Some(_) => offer.products.is_some_and(|products| products > MANY_PRODUCTS),
            None => self.refusal(Strategy::Sums).is_some_and(is_of_size),
        };
        if self.made[tree].1.is_some() || self.options.by.is_some() || !is_long(&self.made[sums]) {
            return;
        }
        self.by_element = true;
        self.refusals.retain(|(own, _)| *own != Strategy::JoinTree);
        self.offer(Strategy::JoinTree);
        self.made.swap_remove(tree);
    }

    fn refusal(&self, strategy: Strategy) -> Option<&Error> {
        self.refusals.iter().find(|(own, _)| *own == strategy).map(|(_, error)| error)
    }

    /// The exact offer with the fewest products; the first of several. A closed form is preferred to sums at any cost: it
    /// gives the whole law of a real, whereas sums give densities at single values.
    fn cheapest(&self) -> Option<usize> {
        let wanted = |(offer, route): &(Offer, Option<Route>)| {
            offer.exact && route.is_some() && self.options.by.is_none_or(|by| by == offer.strategy)
        };
        let cost = |at: &usize| match &self.made[*at].0 {
            Offer { strategy: Strategy::Gaussian, .. } => f64::NEG_INFINITY,
            offer => offer.products.unwrap_or(f64::INFINITY),
        };
        let places = (0..self.made.len()).filter(|at| wanted(&self.made[*at]));
        places.min_by(|one, other| cost(one).total_cmp(&cost(other)))
    }

    /// The error that an exact offer exceeds the budget, if it does.
    fn exceeds(&self, at: usize) -> Option<Error> {
        let (offer, budget) = (&self.made[at].0, self.options.budget? as f64);
        let products = offer.products.filter(|products| *products > budget && self.options.by.is_none())?;
        let (products, budget) = (count(products), count(budget));
        let name = offer.strategy.name();
        let reason = format!("`{name}` takes {products} products, more than the budget of {budget}");
        Some(refused(self.model, self.asks, &reason))
    }

    /// Accepts an offer.
    fn take(mut self, at: usize) -> (Route, Vec<Offer>) {
        let choice = self.choice(&self.made[at].0);
        let (offer, route) = &mut self.made[at];
        (offer.taken, offer.choice) = (true, Some(choice));
        let route = route.take().expect("internal: the offer can be taken");
        (route, self.made.into_iter().map(|(offer, _)| offer).collect())
    }

    /// The reason why an offer is accepted.
    fn choice(&self, taken: &Offer) -> String {
        let excess = self.excess.as_ref().map(reason_of);
        let exact = self.made.iter().filter(|(offer, route)| offer.exact && route.is_some()).count();
        let choice = match (taken.exact, excess) {
            _ if self.options.by.is_some() => "the user chose it",
            (false, Some(excess)) => return excess,
            (false, None) => "no exact strategy answers within the limits",
            (true, Some(excess)) => return format!("{excess}, but no estimate is possible"),
            (true, None) if taken.strategy == Strategy::Gaussian => "the whole law has a closed form",
            (true, None) if exact == 1 => "no other exact strategy answers",
            (true, None) => "of the exact strategies it takes the fewest products",
        };
        choice.to_owned()
    }

    /// Whether a real is searched or known.
    fn has_real(&self) -> bool {
        let known = self.asks.iter().flat_map(|ask| ask.known.iter().map(|known| known.variable));
        let searched = self.asks.iter().flat_map(|ask| ask.searched.iter().map(|item| item.variable));
        known.chain(searched).any(|id| !self.model.variables[id].domain.is_finite())
    }

    /// The error if no offer is accepted.
    fn refused(mut self, over_time: bool) -> Error {
        let unlearned = |id: &FactorId| matches!(self.model.factors[*id].form, Form::Unknown(_));
        if let Some(id) = relevant_factors(self.model, self.asks).into_iter().find(unlearned) {
            let head = self.model.head(&self.model.factors[id]);
            let reason = format!("`{head}` is `unknown`: learn it from data first, with `bp learn`");
            return refused(self.model, self.asks, &reason);
        }
        let place = |strategy: Strategy| self.refusals.iter().position(|(own, _)| *own == strategy);
        let reported = match self.options.by {
            Some(by) => place(by),
            // The error of the last strategy also gives the reasons of the others.
            None => {
                let sums = place(Strategy::Sums).filter(|at| is_of_size(&self.refusals[*at].1));
                let last = if over_time { Strategy::Particles } else { Strategy::Weighting };
                // A linear Gaussian question lacks a statistic, not a closed form.
                let linear = self.asks.iter().all(|ask| gaussian::is_linear(self.model, ask));
                let closed = place(Strategy::Gaussian).filter(|_| linear);
                sums.or(closed).or(place(last)).or(place(Strategy::Sums))
            }
        };
        if let Some(position) = reported {
            let error = self.refusals.swap_remove(position).1;
            let Some(by) = self.options.by else { return error };
            let linear = || self.asks.iter().all(|ask| gaussian::is_linear(self.model, ask));
            return match error {
                Error::Unplanned { question, reason } => {
                    let reason = match by == Strategy::Sums && self.has_real() && linear() {
                        true => "sums need finite variables, but it has reals".to_owned(),
                        false => reason,
                    };
                    Error::Refused { by: by.name(), question, reason }
                }
                other => other,
            };
        }
        let by = self.options.by.map_or("no strategy", Strategy::name);
        let reason = match over_time {
            true => format!("`{by}` does not answer questions over time"),
            false => format!("`{by}` answers questions over time only"),
        };
        refused(self.model, self.asks, &reason)
    }
}

/// Whether an exact answer is refused for its size alone.
fn is_of_size(error: &Error) -> bool {
    !matches!(error, Error::Unplanned { .. })
}

fn reason_of(error: &Error) -> String {
    match error {
        Error::Unplanned { reason, .. } => reason.clone(),
        other => other.to_string(),
    }
}
