//! Sums and products of finite variables, computed by a kernel.
//!
//! In: an equation and the host's inputs. Out: tables. Invariant: evidence of probability zero is an error that names
//! the impossible observation.

mod impossible;
mod prepared;

pub(crate) use impossible::{error as impossible, judged};

use super::{Offered, Prepared, Purpose, Route, Turn, refused};
use crate::analysis::relevant_factors;
use crate::equation::{self, Exact, Line, Marked, Notation, Strategy, Term, reachable};
use crate::error::Error;
use crate::ids::{FactorId, TermId};
use crate::model::{Ask, Domain, Model, Question, Statistic};

/// The strategy.
pub(crate) struct Engine;

impl super::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        match turn.by_tree && !turn.forced {
            true => Err(refused(model, asks, "building a join tree takes less time than writing loops")),
            false if relevant_factors(model, asks).iter().any(|id| !model.earlier(*id).is_empty()) => {
                let reason = "a family depends on its own earlier elements: sums take them one by one, once its length is given";
                Err(refused(model, asks, reason))
            }
            false => {
                if let Some(id) =
                    relevant_factors(model, asks).into_iter().find(|id| is_mixed_at_value(model, asks, *id))
                {
                    let reason = format!(
                        "`{}` has a point in some cases and a density in others: at a value, sums would add a probability to a \
                         density",
                        model.head(&model.factors[id])
                    );
                    return Err(refused(model, asks, &reason));
                }
                let exact = equation::exact(model, asks.to_vec(), turn.options)?;
                match vector(model, asks, &exact) {
                    Some(head) => {
                        let reason = format!("`{head}` distributes a vector, which has no kernel");
                        Err(refused(model, asks, &reason))
                    }
                    None => Ok(Route::Exact(exact)),
                }
            }
        }
    }
}

/// The route with a whole table in place of each entropy, and each table once; and the table of each ask. The host computes
/// entropies: the table also shows which context is impossible.
pub(crate) fn by_tables(exact: &Exact) -> (Exact, Vec<usize>) {
    let mut asks: Vec<Ask> = Vec::new();
    let mut places = Vec::with_capacity(exact.asks.len());
    for ask in &exact.asks {
        let ask = match ask.statistic {
            Statistic::Entropy => Ask { statistic: Statistic::Distribution, ..ask.clone() },
            _ => ask.clone(),
        };
        let known = asks.iter().position(|own| *own == ask);
        places.push(known.unwrap_or(asks.len()));
        if known.is_none() {
            asks.push(ask);
        }
    }
    (Exact { asks, ..exact.clone() }, places)
}

/// Whether a factor gives a real, of which one value is known or asked, a point in some cases and a density in others.
pub(crate) fn is_mixed_at_value(model: &Model, asks: &[Ask], id: FactorId) -> bool {
    let factor = &model.factors[id];
    let left = factor.left[0].variable;
    let is_known = || asks[0].known.iter().any(|known| known.variable == left);
    let is_asked =
        || asks.iter().flat_map(|ask| &ask.searched).any(|item| item.variable == left && item.at.is_some());
    let is_mixed = factor.form.has_point() && factor.form.has_density();
    is_mixed && !model.variables[left].domain.is_finite() && (is_known() || is_asked())
}

/// The head of a factor that distributes a vector: its components together, or in a product of the equation.
fn vector(model: &Model, asks: &[Ask], exact: &Exact) -> Option<String> {
    let coupled = |id: &FactorId| model.factors[*id].form.couples();
    let is_vector = |id: &FactorId| {
        matches!(model.variables[model.factors[*id].left[0].variable].domain, Domain::Vector(_))
    };
    let of_term = |id: TermId| match exact.terms[id] {
        Term::Factor(factor) => Some(factor),
        _ => None,
    };
    let used = || reachable(&exact.terms, &[exact.joint]).into_iter().filter_map(of_term);
    let found = relevant_factors(model, asks).into_iter().find(coupled).or_else(|| used().find(is_vector));
    found.map(|id| model.head(&model.factors[id]))
}

impl Offered for Exact {
    fn strategy(&self) -> Strategy {
        Strategy::Sums
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    fn cost(&self, model: &Model) -> Option<f64> {
        Some(self.cost + self.answer_cost(model).entries)
    }

    fn reason(&self) -> &'static str {
        match self.has_scan() {
            true => "exact, by sums, products and a scan: all summed variables are finite",
            false if self.eliminations.is_empty() => "exact, by products: only searched variables are summed",
            false => "exact, by sums and products: all summed variables are finite",
        }
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        self.lines(model, notation)
    }

    fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        Exact::marks(self, model, notation)
    }

    fn prepare(&self, model: &Model, question: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(prepared::Kernels::new(model, self, question)?))
    }
}
