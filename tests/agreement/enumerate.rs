//! Answers by enumeration of all assignments.
//!
//! In: a [`Program`] and an [`Ask`]. Out: the expected rows of its answer, and ln P(evidence). Invariant: sums and
//! maxima over all assignments, in the order of the definitions; nothing is eliminated, cancelled or substituted.
//! Weights are logarithms.

use crate::program::{Assignment, Domain, Program, ln_sum};
use std::collections::BTreeMap;

#[derive(Clone, Debug)]
pub(crate) enum Evidence {
    /// A row for each value.
    Each,
    /// An ordinal for each element.
    Hard(Vec<usize>),
    Real(f64),
    Virtual(Vec<f64>),
    Soft(Vec<f64>),
}

pub(crate) type Known = Vec<(usize, Evidence)>;

#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Statistic {
    Distribution,
    Maximum,
    Argmax,
    Best(usize),
    Entropy,
    Expectation,
    Variance,
    Information,
    Divergence,
}

#[derive(Clone, Debug)]
pub(crate) struct Ask {
    pub(crate) statistic: Statistic,
    pub(crate) searched: Vec<usize>,
    pub(crate) known: Known,
    /// For a divergence.
    pub(crate) from: Known,
}

/// Names of variables and of their values.
pub(crate) type Names = BTreeMap<String, String>;

/// The expected answer.
#[derive(Debug)]
pub(crate) enum Expected {
    /// The evidence has probability zero.
    Impossible,
    /// Rows and ln P(evidence), where the evidence is one event.
    Rows(Vec<(Names, f64)>, Option<f64>),
    /// For each context the most probable values, including all ties: any choice among equal ones is correct.
    Best(Vec<(Names, Vec<(Names, f64)>)>, Option<f64>),
}

/// All values of some slots, the last fastest.
pub(crate) fn values(program: &Program, slots: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for slot in slots {
        let count = program.count(program.variable_of(*slot));
        let longer =
            |values: &Vec<usize>| (0..count).map(|one| [values.as_slice(), &[one]].concat()).collect();
        all = all.iter().flat_map(|values| -> Vec<Vec<usize>> { longer(values) }).collect();
    }
    all
}

/// Every possible assignment of the finite variables with ln of its probability; reals are unknown, and integrate to
/// one.
pub(crate) fn enumerate(program: &Program) -> Vec<(Assignment, f64)> {
    let finite: Vec<usize> = (0..program.variables.len())
        .filter(|variable| program.variables[*variable].domain != Domain::Real)
        .collect();
    let slots: Vec<usize> = finite.iter().flat_map(|variable| program.slots_of(*variable)).collect();
    let all = values(program, &slots).into_iter().map(|values| {
        let mut at = vec![f64::NAN; program.slots()];
        slots.iter().zip(values).for_each(|(slot, value)| at[*slot] = value as f64);
        let ln = program.ln_joint(&finite, &at);
        (at, ln)
    });
    all.filter(|(_, ln)| is_possible(*ln)).collect()
}

pub(crate) fn is_possible(ln: f64) -> bool {
    ln > f64::NEG_INFINITY
}

/// ln Σ of the weights of those that satisfy a condition.
pub(crate) fn ln_sum_of<'a>(
    all: impl IntoIterator<Item = &'a (Assignment, f64)>,
    is: impl Fn(&Assignment) -> bool,
) -> f64 {
    let own = all.into_iter().filter(|(at, _)| is(at)).map(|(_, ln)| *ln);
    ln_sum(&own.collect::<Vec<f64>>())
}

fn slots(program: &Program, variables: &[usize]) -> Vec<usize> {
    variables.iter().flat_map(|variable| program.slots_of(*variable)).collect()
}

fn names(program: &Program, slots: &[usize], values: &[usize]) -> Names {
    let name = |(slot, value): (&usize, &usize)| {
        (program.slot_name(*slot), program.value(program.variable_of(*slot), *value))
    };
    slots.iter().zip(values).map(name).collect()
}

fn has(at: &[f64], slots: &[usize], values: &[usize]) -> bool {
    slots.iter().zip(values).all(|(slot, value)| at[*slot] == *value as f64)
}

/// Logarithms of a distribution over the values of the searched slots for each context; `None` where the context is
/// impossible.
struct Conditional {
    contexts: Vec<(Names, Option<Vec<f64>>)>,
    /// ln P(evidence), without soft evidence.
    ln_evidence: f64,
}

fn conditional(
    program: &Program,
    all: &[(Assignment, f64)],
    searched: &[usize],
    known: &Known,
) -> Conditional {
    let each: Vec<usize> = (known.iter())
        .filter(|(_, evidence)| matches!(evidence, Evidence::Each))
        .flat_map(|(variable, _)| program.slots_of(*variable))
        .collect();
    let weighed: Vec<(Assignment, f64)> = (all.iter())
        .map(|(at, ln)| {
            let (mut at, mut ln) = (at.clone(), *ln);
            for (variable, evidence) in known {
                let of = program.slots_of(*variable);
                match evidence {
                    Evidence::Hard(values) if !has(&at, &of.clone().collect::<Vec<_>>(), values) => {
                        ln = f64::NEG_INFINITY;
                    }
                    Evidence::Real(value) => {
                        at[of.start] = *value;
                        ln += program.ln_density(&program.factors[*variable], 0, &at);
                    }
                    Evidence::Virtual(weights) => ln += weights[at[of.start] as usize].ln(),
                    _ => {}
                }
            }
            (at, ln)
        })
        .filter(|(_, ln)| is_possible(*ln))
        .collect();
    let ln_evidence = ln_sum_of(&weighed, |_| true);
    let context = |context: &Vec<usize>| {
        let mut own: Vec<(Assignment, f64)> =
            weighed.iter().filter(|(at, _)| has(at, &each, context)).cloned().collect();
        for (variable, soft) in known {
            let Evidence::Soft(wanted) = soft else { continue };
            let slot = program.slot(*variable, 0);
            let mass = |value: usize| ln_sum_of(&own, |at| at[slot] == value as f64);
            let masses: Vec<f64> = (0..wanted.len()).map(mass).collect();
            if masses.iter().zip(wanted).any(|(mass, wanted)| !is_possible(*mass) && *wanted > 0.0) {
                return None;
            }
            own.iter_mut()
                .for_each(|(at, ln)| *ln += wanted[at[slot] as usize].ln() - masses[at[slot] as usize]);
            own.retain(|(_, ln)| is_possible(*ln));
        }
        let total = ln_sum_of(&own, |_| true);
        let ln = |values: Vec<usize>| ln_sum_of(&own, |at| has(at, searched, &values)) - total;
        is_possible(total).then(|| values(program, searched).into_iter().map(ln).collect())
    };
    let contexts = values(program, &each);
    let contexts = contexts.iter().map(|values| (names(program, &each, values), context(values))).collect();
    Conditional { contexts, ln_evidence }
}

fn entropy(probabilities: impl IntoIterator<Item = f64>) -> f64 {
    probabilities.into_iter().map(|p| if p > 0.0 { -p * p.ln() } else { 0.0 }).sum()
}

/// The answer to an ask.
pub(crate) fn answer(program: &Program, all: &[(Assignment, f64)], ask: &Ask) -> Expected {
    let searched = slots(program, &ask.searched);
    let found = conditional(program, all, &searched, &ask.known);
    let is = |wanted: fn(&Evidence) -> bool| ask.known.iter().any(|(_, evidence)| wanted(evidence));
    let event = !is(|evidence| matches!(evidence, Evidence::Each));
    // Beside variables with a context for each value, evidence may be impossible whatever their values.
    let observed =
        is(|evidence| matches!(evidence, Evidence::Hard(_) | Evidence::Real(_) | Evidence::Virtual(_)));
    if event && found.contexts[0].1.is_none() || observed && !is_possible(found.ln_evidence) {
        return Expected::Impossible;
    }
    let soft = is(|evidence| matches!(evidence, Evidence::Soft(_)));
    let ln_evidence = (event && !soft).then_some(found.ln_evidence);
    let cells = values(program, &searched);
    let both = |context: &Names, more: Names| context.clone().into_iter().chain(more).collect::<Names>();
    let exp = |ln: &Vec<f64>| -> Vec<f64> { ln.iter().map(|ln| ln.exp()).collect() };
    let possible = || found.contexts.iter().filter_map(|(names, ln)| Some((names, exp(ln.as_ref()?))));
    let number = |slot: usize, value: usize| program.number_of(program.variable_of(slot), value as f64);
    let marginal = |p: &[f64], place: usize, value: usize| -> f64 {
        cells.iter().zip(p).filter(|(cell, _)| cell[place] == value).map(|(_, p)| p).sum()
    };
    let mut rows = Vec::new();
    match &ask.statistic {
        Statistic::Distribution => {
            for (context, ln) in &found.contexts {
                for (place, cell) in cells.iter().enumerate() {
                    let p = ln.as_ref().map_or(0.0, |ln| ln[place].exp());
                    rows.push((both(context, names(program, &searched, cell)), p));
                }
            }
        }
        Statistic::Maximum | Statistic::Argmax | Statistic::Best(_) => {
            let best = possible().map(|(context, p)| {
                let row = |(cell, p): (&Vec<usize>, &f64)| (names(program, &searched, cell), *p);
                let mut best: Vec<(Names, f64)> = cells.iter().zip(&p).map(row).collect();
                best.sort_by(|one, other| other.1.total_cmp(&one.1));
                (context.clone(), best)
            });
            return Expected::Best(best.collect(), ln_evidence);
        }
        Statistic::Entropy => {
            rows.extend(possible().map(|(context, p)| (context.clone(), entropy(p.iter().copied()))));
        }
        Statistic::Expectation | Statistic::Variance => {
            for (context, p) in possible() {
                for (place, slot) in searched.iter().enumerate() {
                    let mean: f64 =
                        cells.iter().zip(&p).map(|(cell, p)| number(*slot, cell[place]) * p).sum();
                    let about = |x: f64| (x - mean).powi(2);
                    let variance =
                        cells.iter().zip(&p).map(|(cell, p)| about(number(*slot, cell[place])) * p).sum();
                    let figure = if ask.statistic == Statistic::Variance { variance } else { mean };
                    rows.push((both(context, [(program.slot_name(*slot), String::new())].into()), figure));
                }
            }
        }
        Statistic::Information => {
            for (context, p) in possible() {
                let alone = |place: usize| {
                    let count = program.count(program.variable_of(searched[place]));
                    entropy((0..count).map(|value| marginal(&p, place, value)))
                };
                rows.push((context.clone(), alone(0) + alone(1) - entropy(p.iter().copied())));
            }
        }
        Statistic::Divergence => {
            let second = conditional(program, all, &searched, &ask.from);
            let Some(second) = &second.contexts[0].1 else { return Expected::Impossible };
            for (context, first) in &found.contexts {
                let Some(first) = first else { continue };
                let term = |(p, q): (&f64, &f64)| if is_possible(*p) { p.exp() * (p - q) } else { 0.0 };
                rows.push((context.clone(), first.iter().zip(second).map(term).sum()));
            }
        }
    }
    Expected::Rows(rows, ln_evidence)
}
