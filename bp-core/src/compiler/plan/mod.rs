//! Plans: how one question is answered, and by which strategies.
//!
//! In: a [`Model`] and a [`Question`]. Out: a [`Plan`]: a route for each group of asks with the same known variables,
//! the place of each ask's answer, and the offers of the strategies. Invariant: a plan depends on the program, the
//! question and the options alone.

mod print;
mod strategy;

pub use crate::equation::{
    Cost, Elimination, Exact, Group, Mark, Marked, Notation, Options, Rewrites, Strategy, parts,
};
pub use crate::strategies::Route;
pub use crate::strategies::over_time::{InstantCode, OverTime};
pub use strategy::Offer;

use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Known, Model, Question, Statistic, Value};
use crate::strategies::gaussian;
use std::collections::HashMap;

/// The largest number of factors for which code is emitted, with a loop for each.
const MOST_LOOPS: usize = 2000;

/// The place of an ask's answer: a route and an ask of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Place {
    /// The route.
    pub route: usize,
    /// The ask.
    pub ask: usize,
}

/// How a question is answered.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// The question.
    pub question: Question,
    /// One route for each group of asks with the same known variables.
    pub routes: Vec<Route>,
    /// The offers of the strategies for each of these groups, in the order in which they were tried.
    pub offers: Vec<Vec<Offer>>,
    /// For each ask of the question, the places of the distributions that its answer combines.
    pub places: Vec<Vec<Place>>,
}

/// Plans a question.
///
/// # Errors
/// No route answers it: no exact one, and some factor can be neither drawn nor weighed.
pub fn plan(model: &Model, question: &Question, options: Options) -> Result<Plan, Error> {
    let (model, question) = model.posed(question);
    planned(&model, &question, options, |_| options.ln_evidence)
}

/// Plans a question for emitted code: by loops, even if a join tree is cheaper, unless there are too many factors.
///
/// # Errors
/// See [`plan`].
pub fn plan_for_code(model: &Model, question: &Question) -> Result<Plan, Error> {
    let cheapest = plan(model, question, Options::default())?;
    let is_tree = |route: &Route| matches!(route, Route::Tree(tree) if tree.factors.len() <= MOST_LOOPS);
    match cheapest.routes.iter().any(is_tree) {
        true => plan(model, question, Options::from(Some(Strategy::Sums))).or(Ok(cheapest)),
        false => Ok(cheapest),
    }
}

/// Whether all asks of a question have a closed form because they are linear and Gaussian.
pub(crate) fn is_closed(model: &Model, question: &Question) -> bool {
    question.asks.iter().all(|ask| !ask.when.is_over_time() && gaussian::applies(model, ask))
}

/// Plans a question whose answer is shown, with ln P(evidence) where the evidence is one event.
///
/// # Errors
/// See [`plan`].
pub fn plan_for_answer(model: &Model, question: &Question, options: Options) -> Result<Plan, Error> {
    let (model, question) = model.posed(question);
    let question: &Question = &question;
    let finite = |variable: VariableId| model.variables[variable].domain.is_finite();
    // The density of a real is answered without ln P(evidence), which would need an integral.
    let event = |ask: &Ask| {
        ask.known.iter().all(|known| !matches!(known.evidence, Finding::Each))
            && ask.searched.iter().all(|item| finite(item.variable) || item.at.is_none())
    };
    or_in_contexts(&model, question, options, |ask| model.plate.is_none() && event(ask))
}

/// Plans a question as [`plan`]; where no table has all contexts, for the values of one.
///
/// # Errors
/// See [`plan`].
pub fn plan_or_contexts(model: &Model, question: &Question, options: Options) -> Result<Plan, Error> {
    let (model, question) = model.posed(question);
    or_in_contexts(&model, &question, options, |_| options.ln_evidence)
}

fn or_in_contexts(
    model: &Model,
    question: &Question,
    options: Options,
    ln_evidence: impl Fn(&Ask) -> bool,
) -> Result<Plan, Error> {
    planned(model, question, options, ln_evidence).or_else(|refused| {
        let unplanned = matches!(refused, Error::Unplanned { .. } | Error::Refused { .. });
        match in_contexts(model, question).filter(|_| unplanned) {
            Some(given) => planned(model, &given, options, |_| false).map_err(|_| refused),
            None => Err(refused),
        }
    })
}

/// The most contexts that are answered one after the other.
const MOST_CONTEXTS: f64 = 1000.0;

/// The question with values, given under their own names, of the finite variables of which each value is a context.
fn in_contexts(model: &Model, question: &Question) -> Option<Question> {
    let first = contexts(question.asks.first()?);
    let same = |ask: &Ask| {
        !ask.when.is_over_time()
            && contexts(ask) == first
            && !matches!(ask.statistic, Statistic::Divergence { .. })
    };
    let count = |id: &VariableId| {
        let variable = &model.variables[*id];
        variable.domain.count().filter(|_| variable.family.is_none()).map(|count| count as f64)
    };
    let cells: f64 = first.iter().map(count).product::<Option<f64>>()?;
    let few = !first.is_empty() && cells <= MOST_CONTEXTS && model.plate.is_none();
    (few && question.asks.iter().all(same)).then(|| {
        let mut given = question.clone();
        for known in given.asks.iter_mut().flat_map(|ask| &mut ask.known) {
            if known.evidence == Finding::Each {
                known.evidence = Finding::Hard(Value::Given(model.variable_name(known.variable)));
            }
        }
        given
    })
}

/// The known variables of which each value is a context.
pub(crate) fn contexts(ask: &Ask) -> Vec<VariableId> {
    let each = ask.known.iter().filter(|known| known.evidence == Finding::Each);
    each.map(|known| known.variable).collect()
}

/// A distribution that is asked for.
struct Part {
    ask: Ask,
    ln_evidence: bool,
    /// Whether it is linear and Gaussian.
    closed: bool,
    /// Whether a searched real has a given value, which must not be taken for that of another ask.
    real: bool,
}

impl Part {
    /// Whether one route answers both.
    fn goes_with(&self, other: &Self) -> bool {
        !self.ask.when.is_over_time()
            && !other.ask.when.is_over_time()
            && self.ln_evidence == other.ln_evidence
            && self.closed == other.closed
            && (self.closed || !(self.real || other.real))
            && self.ask.known == other.ask.known
    }
}

fn planned(
    model: &Model,
    question: &Question,
    options: Options,
    ln_evidence: impl Fn(&Ask) -> bool,
) -> Result<Plan, Error> {
    let (wanted, all) = distinct(model, question, ln_evidence);
    let (mut routes, mut offers) = (Vec::new(), Vec::new());
    let mut places: Vec<Option<Place>> = vec![None; all.len()];
    // Asks over time come first.
    let (over_time, rest): (Vec<usize>, Vec<usize>) =
        (0..all.len()).partition(|part| all[*part].ask.when.is_over_time());
    for first in over_time.into_iter().chain(rest) {
        if places[first].is_some() {
            continue;
        }
        let goes = |part: &usize| {
            *part == first || *part > first && places[*part].is_none() && all[first].goes_with(&all[*part])
        };
        let group: Vec<usize> = (first..all.len()).filter(goes).collect();
        let options = Options { ln_evidence: all[first].ln_evidence, ..options };
        for (group, (route, offered)) in chosen(model, &all, group, options)? {
            for (ask, part) in group.into_iter().enumerate() {
                places[part] = Some(Place { route: routes.len(), ask });
            }
            routes.push(route);
            offers.push(offered);
        }
    }
    let place = |part: usize| places[part].expect("internal: every part is planned");
    let places: Vec<Vec<Place>> =
        wanted.into_iter().map(|parts| parts.into_iter().map(place).collect()).collect();
    for (ask, places) in question.asks.iter().zip(&places) {
        let is_soft = |known: &&Known| matches!(known.evidence, Finding::Soft(_));
        let route = places.iter().map(|place| &routes[place.route]);
        let drawn = route.filter_map(|route| match route {
            Route::Sampled(sampled) => Some(&sampled.reason),
            _ => None,
        });
        if let (Some(soft), Some(reason)) = (ask.known.iter().find(is_soft), drawn.into_iter().next()) {
            let name = model.variable_name(soft.variable);
            let named = options.by.filter(|by| !by.is_exact());
            let reason = named.map_or_else(|| reason.clone(), |by| format!("`{}` estimates", by.name()));
            let reason = format!("soft evidence on `{name}` is mixed from exact answers only, and {reason}");
            return Err(Error::Unplanned { question: model.ask_text(ask), reason });
        }
    }
    Ok(Plan { question: question.clone(), routes, offers, places })
}

/// Parts that go together, their route, and the offers for them.
type Chosen = (Vec<usize>, (Route, Vec<Offer>));

/// Upper limit on the parts that are planned alone.
const MOST_APART: usize = 200;

/// The routes of parts that go together: one for all of them where it is exact; otherwise one for each part that has an exact answer
/// alone, and one for the rest.
fn chosen(model: &Model, all: &[Part], group: Vec<usize>, options: Options) -> Result<Vec<Chosen>, Error> {
    let choose = |group: &[usize]| {
        let asks: Vec<Ask> = group.iter().map(|part| all[*part].ask.clone()).collect();
        strategy::choose(model, &asks, options)
    };
    let is_exact = |(route, _): &(Route, Vec<Offer>)| route.strategy().is_exact();
    let whole = choose(&group);
    let may_be_apart = match &whole {
        Ok(route) => !is_exact(route),
        Err(error) => matches!(error, Error::Unplanned { .. }),
    };
    if !may_be_apart || options.by.is_some() || !(2..=MOST_APART).contains(&group.len()) {
        return Ok(vec![(group, whole?)]);
    }
    let (mut routes, mut rest) = (Vec::new(), Vec::new());
    for part in &group {
        match choose(&[*part]).ok().filter(is_exact) {
            Some(route) => routes.push((vec![*part], route)),
            None => rest.push(*part),
        }
    }
    match (routes.is_empty(), rest.is_empty()) {
        (true, _) => return Ok(vec![(group, whole?)]),
        (false, true) => {}
        (false, false) => {
            let route = choose(&rest)?;
            routes.push((rest, route));
        }
    }
    Ok(routes)
}

/// For each ask the indices of its parts, and the distinct parts; asks over time do not share parts.
fn distinct(
    model: &Model,
    question: &Question,
    ln_evidence: impl Fn(&Ask) -> bool,
) -> (Vec<Vec<usize>>, Vec<Part>) {
    let mut all: Vec<Part> = Vec::new();
    let mut known: HashMap<Option<VariableId>, Vec<usize>> = HashMap::new();
    let mut number = |ask: Ask| {
        let alike = known.entry(ask.searched.first().map(|item| item.variable)).or_default();
        let same = |part: &&usize| all[**part].ask == ask && !ask.when.is_over_time();
        if let Some(same) = alike.iter().find(same) {
            return *same;
        }
        alike.push(all.len());
        let closed = gaussian::applies(model, &ask);
        let real = ask.searched.iter().any(|item| !model.variables[item.variable].domain.is_finite());
        all.push(Part { ln_evidence: ln_evidence(&ask), closed, real, ask });
        all.len() - 1
    };
    let wanted =
        (question.asks.iter()).map(|ask| parts(model, ask).into_iter().map(&mut number).collect()).collect();
    (wanted, all)
}
