//! Hidden variables: expectation–maximisation.
//!
//! In: cases of which something is missing. Out: numbers at which the likelihood of what was seen has a maximum, near
//! where it began. Invariant: each step leaves ln L + ln prior as it is or makes it larger; what is not learned is not
//! touched; equal cases are asked once.
//!
//! E: n(x, u) = Σ_cases P(X = x, U = u | case), by compiled questions.  M: as from cases in which nothing is missing.
//! (Dempster, Laird and Rubin, *Journal of the Royal Statistical Society* B 39:1-38, 1977.)
//!
//! A family that nothing seen depends on, its own left-hand variables missing, says nothing: it is left out, which is the
//! same as summing it out.

use super::distribution::{Learnable, Seen};
use super::estimate::{Outcome, estimate};
use super::likelihood::{ln_likelihood, ln_prior};
use super::report::Expectation;
use super::statistics::Statistic;
use super::{Case, Settings, learner::grow};
use crate::error::Error;
use crate::exec::{Inputs, Lanes};
use crate::ids::{FactorId, VariableId};
use crate::lower::lower;
use crate::model::{Ask, Evidence, Known, Model, Question, Reduction, Searched, Value};
use crate::plan::{Exact, Options, Route, plan};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The most values that the hidden part of one family may have.
const MOST_VALUES: usize = 1 << 16;

/// The families of a case that say something, each with its ask, and the pattern to ask.
type Described = (Vec<(FactorId, usize)>, Option<usize>);

/// What was learned, from what, and how the iteration went.
type Maximised = (Vec<Outcome>, Vec<Statistic>, Option<Expectation>);

/// What is asked of all cases that miss the same variables.
struct Pattern {
    exact: Exact,
    /// The known variables, and the names under which they are given.
    known: Vec<(VariableId, String)>,
    /// The hidden variables of each ask.
    asks: Vec<Vec<VariableId>>,
}

/// A case, and where its expected counts go.
struct Asked {
    pattern: usize,
    /// What is given, in the order of the pattern's known variables.
    given: Vec<f64>,
    weight: f64,
    /// Ask, position in its answer, distribution, what would have been seen.
    counts: Vec<(usize, usize, usize, Seen)>,
}

/// Cases of which something is missing that matters.
pub(super) struct Incomplete {
    patterns: Vec<Pattern>,
    asked: Vec<Asked>,
}

/// What the E step gives.
struct Expected {
    ln_evidence: f64,
    answers: Vec<Vec<f64>>,
}

impl Incomplete {
    /// Sorts cases by what they miss; those of which nothing has to be asked are counted at once.
    pub(super) fn new(
        learnable: &mut Learnable,
        cases: &BTreeMap<Vec<Option<u64>>, f64>,
        statistics: &mut Vec<Statistic>,
    ) -> Result<Self, Error> {
        let mut incomplete = Self { patterns: Vec::new(), asked: Vec::new() };
        let mut patterns: BTreeMap<Vec<bool>, Described> = BTreeMap::new();
        for (key, weight) in cases {
            let case = Case::from_key(key);
            let shape: Vec<bool> = key.iter().map(Option::is_some).collect();
            if !patterns.contains_key(&shape) {
                let described = incomplete.pattern(learnable, &case)?;
                patterns.insert(shape.clone(), described);
            }
            let (families, pattern) = &patterns[&shape];
            let mut counts = Vec::new();
            for (factor, ask) in families {
                if *ask == usize::MAX {
                    if let Some((position, seen)) =
                        learnable.locate(*factor, &|variable| case.number(variable))?
                    {
                        match pattern {
                            // Known for sure: it is counted with the case, whose evidence it is part of.
                            Some(_) => counts.push((usize::MAX, 0, position, seen)),
                            None => {
                                grow(learnable, statistics);
                                statistics[position].add(&seen, *weight);
                            }
                        }
                    }
                    continue;
                }
                let Some(pattern) = pattern else { continue };
                let hidden = incomplete.patterns[*pattern].asks[*ask].clone();
                let numbers = combinations(&learnable.model, &hidden);
                for (position, numbers) in numbers.into_iter().enumerate() {
                    let number = |variable| {
                        let place = hidden.iter().position(|known| *known == variable);
                        place.map_or_else(|| case.number(variable), |place| Some(numbers[place]))
                    };
                    if let Some((distribution, seen)) = learnable.locate(*factor, &number)? {
                        counts.push((*ask, position, distribution, seen));
                    }
                }
            }
            if let Some(pattern) = pattern {
                let model = &learnable.model;
                let given = incomplete.patterns[*pattern].known.iter().map(|(variable, _)| {
                    let number = case.number(*variable).unwrap_or_default();
                    let domain = &model.variables[*variable].domain;
                    match domain.is_finite() {
                        true => domain.ordinal_at(number).unwrap_or_default() as f64,
                        false => number,
                    }
                });
                let given = given.collect();
                incomplete.asked.push(Asked { pattern: *pattern, given, weight: *weight, counts });
            }
        }
        Ok(incomplete)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.asked.is_empty()
    }

    /// For cases that miss these variables: the families that say something, each with the ask that tells its hidden
    /// part (none: `usize::MAX`), and the pattern to ask, if any.
    fn pattern(&mut self, learnable: &Learnable, case: &Case) -> Result<Described, Error> {
        let model = &learnable.model;
        let (mut families, mut asks): (Vec<(FactorId, usize)>, Vec<Vec<VariableId>>) = Default::default();
        for factor in &learnable.factors {
            let family = learnable.family(*factor);
            let hidden: Vec<VariableId> =
                family.iter().copied().filter(|variable| case.number(*variable).is_none()).collect();
            if hidden.is_empty() {
                families.push((*factor, usize::MAX));
                continue;
            }
            if says_nothing(model, *factor, case) {
                continue;
            }
            if let Some(real) =
                hidden.iter().find(|variable| model.variables[**variable].domain.count().is_none())
            {
                let (name, text) =
                    (model.variable_name(*real), model.domain_text(&model.variables[*real].domain));
                let message = format!(
                    "it is `{text}` and missing in some cases, on which `{}` depends; only variables whose values can \
                     be listed may be hidden",
                    learnable.head(*factor)
                );
                return Err(Error::input(name, message));
            }
            let ask = asks.iter().position(|known| *known == hidden).unwrap_or_else(|| {
                asks.push(hidden.clone());
                asks.len() - 1
            });
            families.push((*factor, ask));
        }
        if asks.is_empty() {
            return Ok((families, None));
        }
        let known: Vec<(VariableId, String)> = (model.variables.ids())
            .filter(|variable| case.number(*variable).is_some())
            .map(|variable| (variable, format!("case {}", model.variable_name(variable))))
            .collect();
        let question = question(&asks, &known);
        if let Some(ask) = asks.iter().find(|ask| values(model, ask).is_none()) {
            let names: Vec<String> = ask.iter().map(|variable| model.variable_name(*variable)).collect();
            let message = format!("together they have more than {MOST_VALUES} hidden values");
            return Err(Error::input(names.join(" "), message));
        }
        let options = Options { ln_evidence: true, ..Options::default() };
        let mut routes = plan(model, &question, options)?.routes;
        match (routes.pop(), routes.is_empty()) {
            (Some(Route::Exact(exact)), true) => {
                self.patterns.push(Pattern { exact, known, asks });
                Ok((families, Some(self.patterns.len() - 1)))
            }
            _ => {
                let message = "hidden variables are only learned where the answers are sums over values";
                Err(Error::input(&model.name, message))
            }
        }
    }

    /// Asks every case.
    fn expect(&self, model: &Model) -> Result<Vec<Expected>, Error> {
        let mut compiled = Vec::new();
        for pattern in &self.patterns {
            let lowered = lower(model, &pattern.exact, "case")?;
            compiled.push((Lanes::new(lowered.kernel), lowered.outputs));
        }
        (self.asked.par_iter())
            .map(|asked| {
                let (pattern, (lanes, outputs)) = (&self.patterns[asked.pattern], &compiled[asked.pattern]);
                let mut inputs = Inputs::new();
                for ((_, name), number) in pattern.known.iter().zip(&asked.given) {
                    inputs = inputs.number(name, *number);
                }
                let run = lanes.run(&inputs)?;
                let ln_evidence = run.get("ln_evidence")[0];
                if !ln_evidence.is_finite() {
                    let message = format!("the case {} has probability zero", told(model, asked, pattern));
                    return Err(Error::input(&model.name, message));
                }
                let answers = pattern.asks.iter().map(|ask| {
                    let output = outputs.iter().find(|output| {
                        let searched = output.ask.as_ref().map(|ask| &ask.searched);
                        searched.is_some_and(|searched| {
                            searched.iter().map(|it| it.variable).eq(ask.iter().copied())
                        })
                    });
                    let output = output.expect("internal: each ask has an output");
                    reordered(model, run.get(&output.name), &output.variables, ask)
                });
                Ok(Expected { ln_evidence, answers: answers.collect() })
            })
            .collect()
    }

    /// Adds weights of what is hidden to what was seen.
    fn add(&self, statistics: &mut [Statistic], weight: &mut dyn FnMut(usize, usize, usize) -> f64) {
        for (number, asked) in self.asked.iter().enumerate() {
            for (ask, position, distribution, seen) in &asked.counts {
                let share = if *ask == usize::MAX { 1.0 } else { weight(number, *ask, *position) };
                if share > 0.0 {
                    statistics[*distribution].add(seen, asked.weight * share);
                }
            }
        }
    }
}

/// Whether a family's left-hand variables are missing, and all that depends on them.
fn says_nothing(model: &Model, factor: FactorId, case: &Case) -> bool {
    let mut below: Vec<VariableId> = model.factors[factor].left.iter().map(|use_| use_.variable).collect();
    let mut next = 0;
    while let Some(variable) = below.get(next).copied() {
        if case.number(variable).is_some() {
            return false;
        }
        for child in model.factors.values() {
            if child.right.iter().any(|use_| use_.variable == variable) {
                let new = child.left.iter().map(|use_| use_.variable).filter(|left| !below.contains(left));
                let new: Vec<VariableId> = new.collect();
                below.extend(new);
            }
        }
        next += 1;
    }
    true
}

fn question(asks: &[Vec<VariableId>], known: &[(VariableId, String)]) -> Question {
    let known: Vec<Known> = (known.iter())
        .map(|(variable, name)| Known {
            variable: *variable,
            evidence: Evidence::Hard(Value::Given(name.clone())),
        })
        .collect();
    let asks = asks.iter().map(|hidden| Ask {
        reduction: Reduction::Probability,
        searched: hidden.iter().map(|variable| Searched { variable: *variable, at: None }).collect(),
        known: known.clone(),
    });
    Question { name: "case".to_owned(), asks: asks.collect() }
}

/// How many values some variables have together, if not too many.
fn values(model: &Model, variables: &[VariableId]) -> Option<usize> {
    let mut counts = variables.iter().map(|variable| model.variables[*variable].domain.count());
    counts.try_fold(1usize, |total, count| total.checked_mul(count?).filter(|total| *total <= MOST_VALUES))
}

/// The numbers of all combinations of values, the last variable fastest.
fn combinations(model: &Model, variables: &[VariableId]) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new()];
    for variable in variables {
        let domain = &model.variables[*variable].domain;
        let count = domain.count().unwrap_or(1);
        let extend = |before: &Vec<f64>| {
            let with = |ordinal| before.iter().copied().chain([domain.number(ordinal)]).collect();
            (0..count).map(with).collect::<Vec<Vec<f64>>>()
        };
        all = all.iter().flat_map(extend).collect();
    }
    all
}

/// The cells of an answer in the order of other variables.
fn reordered(model: &Model, cells: &[f64], from: &[VariableId], to: &[VariableId]) -> Vec<f64> {
    if from == to {
        return cells.to_vec();
    }
    let count = |variable: &VariableId| model.variables[*variable].domain.count().unwrap_or(1);
    let mut ordered = vec![0.0; cells.len()];
    for (position, cell) in cells.iter().enumerate() {
        let mut rest = position;
        let mut ordinals = BTreeMap::new();
        for variable in from.iter().rev() {
            ordinals.insert(*variable, rest % count(variable));
            rest /= count(variable);
        }
        let place = to.iter().fold(0, |place, variable| place * count(variable) + ordinals[variable]);
        ordered[place] = *cell;
    }
    ordered
}

fn told(model: &Model, asked: &Asked, pattern: &Pattern) -> String {
    let values = pattern.known.iter().zip(&asked.given).map(|((variable, _), number)| {
        let finite = model.variables[*variable].domain.is_finite();
        let value = if finite { model.value_name(*variable, *number as usize) } else { number.to_string() };
        format!("{} = {value}", model.variable_name(*variable))
    });
    format!("`{}`", values.collect::<Vec<_>>().join(", "))
}

/// Iterates until ln L + ln prior grows by less than the threshold.
pub(super) fn maximise(
    learnable: &mut Learnable,
    hidden: &mut Incomplete,
    complete: &[Statistic],
    keep: &[bool],
    settings: &Settings,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Maximised, Error> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let mut statistics = complete.to_vec();
    grow(learnable, &mut statistics);
    let complete = statistics.clone();
    // A start in which all values of a hidden variable are alike would stay so: weights are drawn, u⁴ for contrast.
    let mut drawn = |_, _, _| generator.random::<f64>().powi(4) + 1e-3;
    hidden.add(&mut statistics, &mut drawn);
    let mut keep = keep.to_vec();
    keep.resize(statistics.len(), false);
    let mut outcomes = estimate(learnable, &statistics, &keep)?;
    keep.fill(false);
    let mut expectation = Expectation {
        iterations: 0,
        converged: false,
        seed: settings.seed,
        trail: Vec::new(),
        ln_likelihood: f64::NAN,
    };
    loop {
        let expected = hidden.expect(&learnable.model)?;
        let of_complete = (learnable.distributions.iter().zip(&complete))
            .map(|(it, statistic)| ln_likelihood(learnable, it, statistic));
        let of_hidden = hidden.asked.iter().zip(&expected).map(|(asked, it)| asked.weight * it.ln_evidence);
        let priors = learnable.distributions.iter().map(|it| ln_prior(learnable, it));
        let (ln_seen, ln_prior) = (of_complete.chain(of_hidden).sum::<f64>(), priors.sum::<f64>());
        expectation.iterations += 1;
        progress(expectation.iterations, ln_seen);
        let last = expectation.trail.last().copied();
        expectation.trail.push(ln_seen + ln_prior);
        statistics = complete.clone();
        hidden.add(&mut statistics, &mut |number, ask, position| expected[number].answers[ask][position]);
        expectation.converged = last.is_some_and(|last| ln_seen + ln_prior - last < settings.threshold);
        if expectation.converged || expectation.iterations >= settings.iterations {
            expectation.ln_likelihood = ln_seen;
            return Ok((outcomes, statistics, Some(expectation)));
        }
        outcomes = estimate(learnable, &statistics, &keep)?;
    }
}
